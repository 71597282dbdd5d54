"""Molecules as they come in: nuclei, geometry, and the files and programs that bring them."""
