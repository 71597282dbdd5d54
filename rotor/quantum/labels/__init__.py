"""Labels of levels: quantum numbers by name, labelled levels as functions of the parameters, and their tracking through a fit."""
