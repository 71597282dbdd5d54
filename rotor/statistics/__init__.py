"""Degrees of freedom, the test of equipartition, least squares, and the statistics of fitted parameters."""
