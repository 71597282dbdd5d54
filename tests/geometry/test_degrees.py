"""One count of degrees of freedom: linear, bent, atoms, removed totals, molecules put in, and what other programs got wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rotor
from rotor.geometry.inertia import point_masses, principal_frame
from rotor.statistics.degrees_of_freedom import atomic_degrees, count_degrees, rotating_axes, vibrational_degrees

WATER, CARBON_DIOXIDE, ATOM = (0.61457, 1.15512, 1.76968), (0.0, 43.2, 43.2), (0.0, 0.0, 0.0)


def bent(angle_rad: float, masses: tuple[float, ...] = (12.0, 15.9949, 15.9949), bonds: float = 1.0) -> np.ndarray:
    """Moments of OCO, or of another molecule with its middle atom first and a ratio of its bonds, bent by an angle."""
    half = 0.5 * angle_rad
    arm = 1.16 * np.array([math.cos(half), math.sin(half), 0.0])
    positions = np.array([[0.0, 0.0, 0.0], arm, bonds * arm * [-1.0, 1.0, 1.0]])
    return np.asarray(principal_frame(point_masses(masses, positions), masses, positions).moments)


def test_every_kind_of_molecule():
    box = count_degrees([WATER] * 10 + [CARBON_DIOXIDE] * 5 + [ATOM] * 4)
    assert (box.translation, box.rotation, box.total) == (57, 40, 97)
    assert box.notes == ()


@pytest.mark.parametrize(
    ("name", "rotations"), [("water", 3), ("CO2", 2), ("HCN", 2), ("NH3", 3), ("CH4", 3), ("C2H2", 2)]
)
def test_molecules_of_the_library(name, rotations):
    top = rotor.read(name)
    assert rotating_axes(top.moments_u_angstrom2).sum() == rotations


def test_a_linear_triatomic_has_five_degrees_not_six():
    assert count_degrees([bent(0.0)]).total == 5
    assert vibrational_degrees(3, True) == 4
    assert count_degrees([bent(0.0)]).total + vibrational_degrees(3, True) == 3 * 3
    assert atomic_degrees(3, 4) == 5  # four constraints, though there are only three distances


def test_a_bend_of_a_milliradian_is_linear_by_our_rule_and_said():
    """Some programs take it as linear in silence."""
    others = {"OCS": ((12.0, 15.9949, 31.9721), 1.56 / 1.16), "HCN": ((12.0, 1.0078, 14.0031), 1.15 / 1.06)}
    moments = [bent(1e-3), *(bent(1e-3, *other) for other in others.values())]
    ratios = [moment.min() / moment.max() for moment in moments]
    assert 4.8e-8 < min(ratios) < max(ratios) < 8.5e-8  # what docs/gas.md states
    box = count_degrees([bent(1e-3)])
    assert box.rotation == 2
    assert "is below 1e-06: 2 rotational degrees" in box.notes[0]
    assert count_degrees([bent(1e-3)], linear_below=1e-9).rotation == 3
    wider = count_degrees([bent(1e-2)])
    assert wider.rotation == 3
    assert "is not below" in wider.notes[0]
    assert count_degrees([bent(0.5)]).notes == ()


@pytest.mark.parametrize("unit", [1e-47, 1e-10, 1.0, 1e20])
def test_small_moments_in_any_unit_still_turn(unit):
    """An absolute threshold would stop molecules in SI units."""
    assert rotating_axes(np.array([WATER, CARBON_DIOXIDE]) * unit).sum(axis=-1).tolist() == [3, 2]


def test_a_removed_total_is_subtracted_once():
    assert count_degrees([WATER] * 216, removed=3).total == 6 * 216 - 3
    assert count_degrees([ATOM] * 100, removed=3).total == 297
    assert atomic_degrees(648, 648, 3) == 6 * 216 - 3


def test_molecules_put_in_are_counted():
    before, after = count_degrees([WATER] * 10, removed=3), count_degrees([WATER] * 10 + [CARBON_DIOXIDE], removed=3)
    assert after.total == before.total + 5
    energy = 0.5 * before.total  # kT = 1
    assert before.kt(energy) == pytest.approx(1.0, rel=1e-15)  # a division
    assert after.kt(energy + 2.5) == pytest.approx(1.0, rel=1e-15)


def test_no_degree_has_no_temperature():
    with pytest.raises(ValueError, match="no degree of freedom left"):
        count_degrees([ATOM], removed=3).kt(0.0)


@pytest.mark.parametrize(
    ("moments", "removed", "said"),
    [
        ([WATER], 4, "4 totals removed"),
        ([WATER], -1, "-1 totals removed"),
        ([[0.0, 0.0, 1.0]], 0, "a single moment above 0"),
        ([[-1.0, 1.0, 1.0]], 0, "numbers of 0 or more"),
        ([[math.nan] * 3], 0, "finite"),
        (WATER, 0, "have shape"),
    ],
)
def test_degrees_of_freedom_refuse_wrong_input(moments, removed, said):
    with pytest.raises(ValueError, match=said):
        count_degrees(moments, removed=removed)


def test_wrong_counts_of_atoms():
    with pytest.raises(ValueError, match="two atoms are always linear"):
        vibrational_degrees(2, False)
    with pytest.raises(ValueError, match="leave -1 degrees"):
        atomic_degrees(1, 1, 3)
