"""The numerical knobs of every kind of scene: what `rotor accuracy` sweeps. One file a group of kinds."""
