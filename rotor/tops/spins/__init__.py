"""Nuclear spins of a top: coupling constants, statistics and weights."""
