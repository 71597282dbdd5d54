"""The files of SPFIT and SPCAT: .cat, .egy, .lin, .int, .par/.var, and the codes their parameters go by."""
