"""Choice of the constants that the lines determine, and of lines to measure next."""
