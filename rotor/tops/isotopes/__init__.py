"""Isotopologues: their constants and their nuclear coupling constants."""
