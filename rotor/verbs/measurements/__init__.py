"""Inputs of verbs on measurements: observed spectra, models over them, measured lines."""
