"""Actions of the page of `rotor view` on lines, species and fits."""
