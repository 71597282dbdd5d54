"""Fluids of rigid molecules: bodies, potentials, dynamics, thermostats, and external engines."""
