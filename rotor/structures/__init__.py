"""From the moments of isotopologues to a structure: r_s, r_0, r_m and semi-experimental r_e."""
