"""Files of SPFIT and SPCAT (.cat, .egy, .lin, .int, .par, .var) and their parameter codes."""
