"""Molecules: nuclei, geometry, and readers of files and of program output."""
