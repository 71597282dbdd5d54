"""Requests of fits and of structures, from the files that hold their lines, constants and families."""
