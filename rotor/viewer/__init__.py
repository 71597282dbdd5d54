"""`rotor view`: a spectrum, its prediction and its assignment in the browser and in notebooks."""
