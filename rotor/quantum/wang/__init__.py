"""Rotation without spins: Wang functions, matrices of angular momentum, and their solution."""
