"""Observed spectra: LTE models of radio sources and gas cells, fits, line identification."""
