"""LTE and non-LTE models of a source: species, partition functions, parameters."""
