"""Motion of rigid molecules in a box: state, dynamics, thermostats, thermometers."""
