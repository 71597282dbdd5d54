"""From measured lines to constants: assignments, the least-squares fit and its statistics, and the choice of a model."""
