"""Lines and spectra."""
