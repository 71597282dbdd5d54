"""Torque-free motion: the exact solution, its stability and its polhodes."""
