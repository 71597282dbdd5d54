"""Pictures of lines and spectra: predicted, observed, assigned, fitted."""
