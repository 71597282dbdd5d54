"""Rigid molecules that attract and repel: bodies, potentials, dynamics, thermostats, and the engines beside ours."""
