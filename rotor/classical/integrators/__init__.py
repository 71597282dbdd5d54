"""Integrators of rigid-body motion, one method per file."""
