"""A local catalogue of spectral lines in one file, and the formats from which it is built."""
