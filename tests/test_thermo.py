"""Q(T): closed forms, the classical limit, published sums, truncation."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rotor import units
from rotor.quantum.solve import solve_levels
from rotor.thermo import classical_partition_function, partition_function, partition_functions
from rotor.tops.constants import Constants
from rotor.tops.top import Top


def test_linear_molecule_meets_its_series():
    """Q = T/θ + 1/3 + θ/15T + 4θ²/315T² (Mulholland 1928)."""
    top = Top.from_constants("B=57635.968 MHz")
    theta = 57635.968 / units.MHZ_PER_K
    for t in (50.0, 300.0, 1000.0):
        x = theta / t
        series = 1 / x + 1 / 3 + x / 15 + 4 * x**2 / 315
        assert partition_function(top, t, 1e-12).q == pytest.approx(series, rel=1e-6)  # the next term is x³/315


def test_spherical_and_symmetric_tops_meet_the_classical_limit():
    for text, weights in (("A=5 B=5 C=5 GHz", None), ("A=5 B=3 GHz", {"0": 2, "1": 1, "2": 1}), ("B=5 C=3 GHz", None)):
        top = Top.from_constants(text, spin_weights=weights)
        ratio = partition_function(top, 300.0).q / classical_partition_function(top, 300.0)
        assert ratio == pytest.approx(1, abs=1e-3)  # the first quantum correction is about B/4kT = 2e-4


def test_methane_with_its_weights():
    """CH4 at 296 K: Q = 590.5 with full spin weights 5:2:3 (HITRAN's rotation-vibration sum), rigid B = 5.2410 cm⁻¹."""
    top = Top.from_constants("A=5.2410 B=5.2410 C=5.2410 cm-1", spin_weights={"A": 5, "E": 2, "F": 3})
    assert partition_function(top, 296.0).q == pytest.approx(590.5, rel=0.01)  # vibration makes 0.7 % of it


@pytest.mark.parametrize("temperature", [9.375, 75.0, 300.0])
def test_error_is_below_what_was_asked(temperature):
    top = Top.from_constants("A=8572 B=3640 C=2790 MHz")
    exact = partition_function(top, temperature, 1e-13).q
    for asked in (1e-3, 1e-6):
        found = partition_function(top, temperature, asked)
        assert abs(found.q / exact - 1) < asked
        assert found.relative_error < asked


def test_levels_count_from_the_lowest_that_exists():
    """Only odd J: the ground level is J = 1, so Q starts at g = 3."""
    top = Top.from_constants("B=100 GHz", spin_weights={"even": 0, "odd": 1})
    assert partition_function(top, 0.5).q == pytest.approx(3.0, rel=1e-6)


def test_diverging_distortion_is_said():
    quartic_water = Constants(
        A=835840.288, B=435351.717, C=278138.7, DeltaJ=37.59422, DeltaJK=-172.91276, DeltaK=973.29052,
        deltaJ=15.210402, deltaK=41.05025,
    )  # fmt: skip
    with pytest.raises(ValueError, match="beyond their reach"):
        partition_function(Top(quartic_water), 1000.0, 1e-9)


def test_many_temperatures_at_once():
    top = Top.from_constants("A=10 B=6 C=4 GHz")
    together = partition_functions(top, [10.0, 100.0])
    assert [f.q for f in together] == [partition_function(top, t).q for t in (10.0, 100.0)]


@pytest.mark.parametrize("temperature", [0.0, -1.0, math.nan])
def test_impossible_temperature(temperature):
    with pytest.raises(ValueError, match="above 0 K"):
        partition_function(Top.from_constants("B=1 GHz"), temperature)


def test_a_plain_sum_over_levels_agrees():
    top = Top.from_constants("A=300 B=200 C=120 GHz", spin_weights={"ee": 1, "eo": 3, "oe": 3, "oo": 1})
    levels = solve_levels(top, 60)
    plain = float(levels.degeneracy @ np.exp(-levels.energy_mhz / units.MHZ_PER_K / 300.0))
    assert partition_function(top, 300.0, 1e-12).q == pytest.approx(plain, rel=1e-11)


def published_q(shared: Path, tag: int, column: int) -> float:
    """Q of a species in CDMS's table; columns 3 to 13 are lg Q at 1000, 500, 300, 225, 150, 75 ... K."""
    text = (shared / "reference" / "partition" / "cdms_partfunc.cat").read_text(errors="replace")
    rows = (line.split("|") for line in text.splitlines() if line.startswith("|"))
    return 10 ** float(next(row for row in rows if row[1].strip() == str(tag))[column + 1])


@pytest.mark.oracle
@pytest.mark.parametrize(("tag", "text"), [(28503, "B=57635.968 D=0.1835 MHz"), (60503, "B=6081.492 D=0.0013 MHz")])
@pytest.mark.parametrize(("column", "temperature"), [(5, 300.0), (7, 150.0), (8, 75.0), (10, 18.75)])
def test_published_sums_of_linear_molecules(shared: Path, tag, text, column, temperature):
    """CDMS's sums of CO and OCS in v = 0, from 18.75 to 300 K, printed to 4 decimals of lg Q."""
    ours = partition_function(Top.from_constants(text), temperature).q
    assert math.log10(ours) == pytest.approx(math.log10(published_q(shared, tag, column)), abs=1.01e-4)


@pytest.mark.parametrize(
    ("constants", "weights"),
    [
        (
            Constants(A=60778.5, B=10318.1, C=8799.7),
            {"ee": 1, "eo": 0, "oe": 0, "oo": 1},
        ),  # SO2: J + 1 and J levels in turn
        (Constants(B=59646.0), {"even": 2, "odd": 1}),  # N2
        (Constants(B=11698.0), {"even": 1, "odd": 0}),  # CO2
        (Constants(B=4050.0, kind="spherical"), {"A": 1, "E": 0, "F": 0}),  # OsO4: no level at J = 1, 2, 5
    ],
)
def test_weights_that_alternate_with_j_do_not_stop_the_sum(constants, weights):
    """The sum goes on where the terms of neighbouring J rise and fall; its classical limit is near."""
    top = Top.from_constants(constants, spin_weights=weights)
    found = partition_function(top, 300.0)
    assert found.q == pytest.approx(classical_partition_function(top, 300.0), rel=0.01)  # quantum correction ~ B/kT
