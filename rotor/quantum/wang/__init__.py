"""Rotation without spins: Wang functions, matrices of angular momentum, their solution, and states that couplings connect."""
