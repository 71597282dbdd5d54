"""Point groups of molecules and their operations."""
