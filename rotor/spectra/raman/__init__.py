"""Rotational Raman lines."""
