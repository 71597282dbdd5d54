"""Short tests of single safeguards that no other test isolates."""

from __future__ import annotations

import pytest

from rotor.alignment.pulse import RAD_PER_PS_ANGSTROM3_W_PER_CM2


def test_the_factor_of_an_oscillating_field():
    """U0/ħ of 1 Å³ and 1e12 W/cm² is 1.98739 rad/ps: Friedrich and Herschbach's formula with ¼ ε² and I = c ε0 ε²/2."""
    assert pytest.approx(1.98739, abs=5e-6) == RAD_PER_PS_ANGSTROM3_W_PER_CM2 * 1e12  # digits of the figure
