"""Propagation of wave packets through pulses."""
