"""Forces between rigid molecules: models, neighbours, Ewald sum, potential."""
