"""Molecule files and the library of molecules."""
