"""What the lines of SPFIT's files mean as operators: codes, states, series, l-doubled states, symmetry, names of levels."""
