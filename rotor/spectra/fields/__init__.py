"""Spectra of molecules in a static field: lines with M, spectra over a sample, Stark coefficients."""
