"""Torsion about a bond: its potential, its levels and the classical motion."""
