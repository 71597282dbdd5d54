"""Sums over rotational levels with their errors, their classical limit, and nuclear-spin species."""
