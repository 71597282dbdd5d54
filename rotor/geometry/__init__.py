"""Geometry of rigid bodies: rotations, superposition, rigid motions, inertia."""
