"""Measured lines back to constants: assignments, the fit, what it knows and what it does not, and the choice of a model."""
