"""From a match of three lines to a species with all its lines, its evidence and its refined constants."""
