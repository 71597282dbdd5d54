"""Molecules in fields: states with M, blocks that a field does not connect, and maps of levels against its strength."""
