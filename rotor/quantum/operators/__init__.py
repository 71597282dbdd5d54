"""Operators on labelled functions: an algebra of shift operators, and the factors that the terms of a Hamiltonian are built from."""
