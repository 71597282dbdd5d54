"""Molecules in fields: states with M, the blocks that a field leaves apart, and maps of levels against its strength."""
