"""Degrees of freedom, the test of equipartition, least squares and what a fit knows of its parameters."""
