"""Structures from the moments of isotopologues: r_s, r_0, r_m and semi-experimental r_e."""
