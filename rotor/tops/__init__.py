"""Tops: constants, operators, distortion; folders for isotopes, nuclear spins and vibrational states."""
