"""Effects on a classical rigid body, one a file."""
