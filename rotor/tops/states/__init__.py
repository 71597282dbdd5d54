"""Vibrational states of a top: constants, rules, and tables of levels."""
