"""SPFIT's files and named constants, both ways."""
