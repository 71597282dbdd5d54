"""Rotation alone: Wang functions, matrices of angular momentum, and their solution."""
