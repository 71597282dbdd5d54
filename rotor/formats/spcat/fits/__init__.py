"""SPFIT's files as input of a fit, and what is written of one."""
