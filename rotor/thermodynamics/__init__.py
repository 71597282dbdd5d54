"""Thermodynamics of rotation: sums over levels and their classical limit, the ideal gas, torsion, and a classical gas."""
