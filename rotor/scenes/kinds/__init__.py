"""What each kind of scene asks the library for, one kind a file; loaded when a scene of that kind is run."""
