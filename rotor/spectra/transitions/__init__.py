"""Pairs of states that form a line, found without visiting all pairs."""
