"""Scenes: what to simulate, written in one file; read, planned and run."""
