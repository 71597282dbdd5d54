"""The search of one species: families of three lines are matched to the strongest peaks."""
