"""Identification of the species that an observed spectrum needs."""
