"""Integrators of rigid-body motion, one method a file."""
