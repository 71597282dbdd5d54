"""Scenes: simulations described in one file; read, planned and run."""
