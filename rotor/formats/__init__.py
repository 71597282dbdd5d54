"""File formats of the field, one file a format; a folder where a format has several files."""

from rotor.formats.read_write import read, write

__all__ = ["read", "write"]
