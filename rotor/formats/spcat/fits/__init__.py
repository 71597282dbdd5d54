"""SPFIT's files as input and output of a fit."""
