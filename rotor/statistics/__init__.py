"""Degrees of freedom and the test of equipartition."""
