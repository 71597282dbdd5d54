"""Pictures and films of motion: free and driven rotation, alignment, gases and liquids."""
