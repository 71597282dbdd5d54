"""Conversion between SPFIT's files and named constants."""
