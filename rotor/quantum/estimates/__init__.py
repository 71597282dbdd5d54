"""How far levels can be relied on: convergence, limits, derivatives and errors."""
