"""The texts of SPFIT and SPCAT: reading and writing each file, before any meaning is given to its codes."""
