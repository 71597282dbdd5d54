"""Rotational wave packets: molecules aligned and oriented by pulses of light."""
