"""Tops: constants, operators, spin weights, isotopologues, distortion."""
