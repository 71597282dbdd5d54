"""Pictures, one kind in a file."""
