"""Parameter codes of SPFIT as operators: series, l-doubled states, symmetry, labels of levels."""
