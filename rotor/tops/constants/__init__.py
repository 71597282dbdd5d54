"""Rotational constants: names, operators, kinds, covariance and their printed form."""
