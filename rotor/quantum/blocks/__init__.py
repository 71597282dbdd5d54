"""Blocks of a Hamiltonian that is linear in its parameters: connected parts, their solution side by side, a few states of large ones."""
