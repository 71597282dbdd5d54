"""Eigenvalue solvers: they see matrices, never what these stand for."""
