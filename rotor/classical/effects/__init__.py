"""Effects on a classical rigid body, one per file."""
