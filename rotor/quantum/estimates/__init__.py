"""Reliability of levels: convergence, neglected effects, derivatives and errors."""
