"""Peaks of a spectrum, and what is read from them before a search: doublets, progressions, intensities."""
