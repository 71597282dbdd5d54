"""A local catalogue of spectral lines in one file, and the formats it is made from."""
