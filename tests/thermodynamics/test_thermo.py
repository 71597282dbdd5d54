"""Q(T): closed forms, the classical limit, published sums, truncation."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.molecules.nuclei import data_folder
from rotor.quantum.solve import solve_levels
from rotor.thermodynamics.sums.classical_limit import classical_limit, classical_partition_function
from rotor.thermodynamics.sums.level_sums import level_sums
from rotor.thermodynamics.sums.partition import partition_function
from rotor.thermodynamics.sums.trusted_levels import trusted_energies_mhz
from rotor.thermodynamics.vibration import vibrational_partition_function
from rotor.tops.constants.constants import Constants
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
    for goal in (1e-3, 1e-6):
        partition = partition_function(top, temperature, goal)
        assert abs(partition.q / exact - 1) < goal
        assert partition.relative_error < goal


def test_levels_count_from_the_lowest_that_exists():
    """Only odd J: the ground level is J = 1, so Q starts at g = 3."""
    top = Top.from_constants("B=100 GHz", spin_weights={"even": 0, "odd": 1})
    assert partition_function(top, 0.5).q == pytest.approx(3.0, rel=1e-6)


QUARTIC_WATER = Constants(
    A=835840.288, B=435351.717, C=278138.7, DeltaJ=37.59422, DeltaJK=-172.91276, DeltaK=973.29052,
    deltaJ=15.210402, deltaK=41.05025,
)  # fmt: skip


def test_levels_that_distortion_does_not_serve_are_counted_with_their_error():
    """Quartic water at 1000 K: within the stated error of the sum with all its constants; at 10,000 K there is no answer."""
    partition = partition_function(Top(QUARTIC_WATER), 1000.0, 1e-9)
    better = partition_function(Top(rotor.read("water").constants), 1000.0)
    assert 1e-9 < partition.relative_error < 0.05
    # what the series leaves out of trusted levels (DeltaK K⁴ is 9 % of A K² at Ka = 9) is no part of the error
    assert partition.q == pytest.approx(better.q, rel=partition.relative_error + 0.02)
    assert f"relative error about {partition.relative_error:.0e}" in partition.source
    with pytest.raises(ValueError, match=r"Q\(10000 K\): populated levels lie beyond the reach"):
        partition_function(Top(QUARTIC_WATER), [300.0, 10_000.0])


def test_a_diving_series_does_not_stop_the_sum():
    """Ketene at 300 K: P_KKJ J² K⁸ turns the levels of J >= 75 upside down; a sum of better ones is met."""
    constants = rotor.read("CH2CO").constants
    low_order = {
        name: value for name, value in constants.values.items() if name not in ("PKKJ", "PK", "LKKJ", "LK", "LJK")
    }
    tame = Top(
        Constants(reduction="S", representation="Ir", **low_order), spin_weights=rotor.read("CH2CO").spin_weights
    )
    partition = partition_function(rotor.read("CH2CO"), 300.0)
    assert partition.relative_error < 1e-4
    assert partition.q == pytest.approx(partition_function(tame, 300.0).q, rel=2e-4)  # what octic terms move of K <= 12


def test_a_rigid_top_is_trusted_however_asymmetric():
    top = Top.from_constants("A=64 B=8 C=0.5 MHz")
    levels = solve_levels(top, 12)
    energies, lowest = trusted_energies_mhz(top, levels)
    assert (energies == levels.energy_mhz).all()
    assert (lowest == levels.energy_mhz).all()
    bent = Top.from_constants(Constants(A=64.0, B=8.0, C=0.5, DeltaJ=1e-9))  # rigid to nine digits
    assert np.allclose(trusted_energies_mhz(bent, solve_levels(bent, 12))[0], levels.energy_mhz, rtol=1e-6, atol=1e-6)


TOPS = {
    "linear": ("B=3 GHz", None),
    "linear, ortho and para": ("B=3 GHz D=1e-7 GHz", {"even": 1, "odd": 3}),
    "with distortion": ("B=3 GHz D=3e-6 GHz H=3e-12 GHz", None),
    "prolate": ("A=150 B=4 GHz", {"0": 2, "1": 1, "2": 1}),
    "oblate": ("B=5 C=2.6 GHz DJ=1e-6 GHz DJK=-2e-6 GHz DK=1e-6 GHz", None),
    "six-fold": ("B=5.7 C=2.85 GHz", {"0even": 7, "0odd": 13, "1": 11, "2": 9, "3": 14, "4": 9, "5": 11}),
    "asymmetric": ("A=9 B=6 C=3.6 GHz", {"ee": 1, "eo": 3, "oe": 3, "oo": 1}),
    "asymmetric with distortion": ("A=9 B=3 C=2.5 GHz DeltaJ=1e-6 DeltaJK=-5e-6 DeltaK=4e-5 deltaJ=2e-7 deltaK=1e-6 GHz", None),
    "spherical": ("B=4 GHz kind", {"A": 5, "E": 2, "F": 3}),
}  # fmt: skip


@pytest.mark.parametrize("name", TOPS)
def test_the_expansion_is_within_its_error_of_the_sum(name):
    """Q, U and C_v of the classical limit with corrections against the sum over levels, each within the error stated."""
    text, weights = TOPS[name]
    if name == "spherical":
        top = Top.from_constants(Constants(B=4000.0, D=1e-3, kind="spherical"), spin_weights=weights)
    else:
        top = Top.from_constants(text, spin_weights=weights)
    limit, temperatures = classical_limit(top), np.array([8.0, 20.0, 50.0, 100.0])
    sums = level_sums(top, [top.spin_weights], temperatures, 1e-13)[0]  # too much for the expansion: summed
    assert (sums.jmax > 0).all()
    below = sums.ground_k / temperatures
    q, energy, cv = limit.corrected(temperatures)
    computed = [q * np.exp(below), energy - below, cv]
    exact = [sums.q, sums.energy_over_rt, sums.cv_over_r]
    off = np.abs(np.array(computed) / np.array(exact) - 1)
    assert (off < limit.errors(temperatures) + 1e-11).all(), (off, limit.errors(temperatures))  # round-off of the sums
    assert limit.errors(temperatures)[0, -1] < 1e-2  # and it says something


def test_a_long_sum_is_replaced_where_that_is_as_good():
    """A = 430, B = 57, C = 55 MHz at 300 K: J = 9000 or the expansion, which knows Q to 1e-12 and takes no time."""
    top = Top.from_constants("A=430 B=57 C=55 MHz")
    start = time.perf_counter()
    partition = partition_function(top, 300.0)
    assert time.perf_counter() - start < 1.0  # 0.01 s; 39 s before
    assert partition.jmax is None
    assert partition.source == "classical with corrections, relative error below 1e-06"
    theta = np.array(top.rotational_constants_mhz) / units.MHZ_PER_K
    assert partition.q == pytest.approx(math.sqrt(math.pi * 300.0**3 / np.prod(theta)), rel=1e-5)  # a/T is 2e-6
    start = time.perf_counter()
    heavy = partition_function(Top.from_constants("A=0.03 B=0.025 C=0.02 MHz"), [5.0, 300.0])  # ten thousand atoms
    assert time.perf_counter() - start < 1.0
    assert heavy.jmax.tolist() == [-1, -1]


def test_a_long_sum_reports_its_progress():
    seen = []
    top = Top.from_constants("A=9 B=3 C=2.5 GHz DeltaJ=1e-4 GHz")  # too much distortion for the expansion
    partition_function(top, [20.0], progress=lambda j, last: seen.append((j, last)))
    assert [j for j, _ in seen] == sorted(j for j, _ in seen)
    assert len(seen) > 2
    assert seen[-1][0] <= seen[-1][1] <= 1000


def test_many_temperatures_at_once():
    """A list or an array gives arrays; never the first temperature alone."""
    top = Top.from_constants("A=10 B=6 C=4 GHz")
    one_by_one = [partition_function(top, t).q for t in (10.0, 100.0)]
    for grid in ([10.0, 100.0], (10, 100), np.array([10.0, 100.0])):
        together = partition_function(top, grid)
        assert together.q.tolist() == one_by_one
        assert together.temperature_k.tolist() == [10.0, 100.0]
        assert together.relative_error.shape == together.jmax.shape == (2,)
    assert [f.q for f in partition_function(top, [10.0, 100.0])] == one_by_one
    assert together.to_pandas()["q"].tolist() == one_by_one
    assert isinstance(partition_function(top, 10).q, float)
    assert classical_partition_function(top, np.array([10.0, 100.0])).tolist() == [
        classical_partition_function(top, t) for t in (10.0, 100.0)
    ]
    co2 = ([667.4, 1388.2, 2349.1], [2, 1, 1])
    for harmonic in (True, False):
        both = vibrational_partition_function(*co2, [300.0, 600.0], harmonic=harmonic)
        assert both.tolist() == [vibrational_partition_function(*co2, t, harmonic=harmonic) for t in (300.0, 600.0)]
    with pytest.raises(ValueError, match=r"temperature 0\.0 K"):
        partition_function(top, [10.0, 0.0])
    with pytest.raises(ValueError, match=r"temperature -1\.0 K"):
        vibrational_partition_function(*co2, [300.0, -1.0])


@pytest.mark.parametrize("name", sorted(path.stem for path in (data_folder() / "molecules").glob("*.toml")))
def test_every_molecule_of_the_library_has_a_partition_function(name):
    """At 10, 100 and 300 K, to 1e-3 or better, and near the classical limit at 300 K."""
    top = rotor.read(name)
    partition = partition_function(top, [10.0, 100.0, 300.0])
    assert (np.diff(partition.q) > 0).all()
    assert (partition.relative_error < 1e-3).all()
    if name != "H2":  # Θ = 85 K
        assert partition.q[-1] == pytest.approx(
            classical_partition_function(top, 300.0), rel=0.05
        )  # Θ/3T of HCl, 2DkT/B²


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
    partition = partition_function(top, 300.0)
    assert partition.q == pytest.approx(classical_partition_function(top, 300.0), rel=0.01)  # quantum correction ~ B/kT


def test_a_looser_error_costs_no_sum_that_a_tighter_one_does_without():
    """Glycolaldehyde at 100 K: the limit with corrections serves errors to 1e-4, so it serves 0.1 too, where the sum would be short."""
    from rotor.thermodynamics.sums.level_sums import NOT_SUMMED, level_sums

    top = rotor.read("CH2OHCHO")
    for error in (1e-1, 1e-2, 1e-3, 1e-4):
        sums = level_sums(top, [top.spin_weights], [10.0, 100.0], error)[0]
        assert sums.jmax[0] > 0
        assert sums.jmax[1] == NOT_SUMMED


def test_the_error_of_sums_is_said_with_its_temperature(call):
    """2 % of Q of water at 1000 K, beyond the levels that its constants reach, is not the error at 300 K."""
    _, out, _ = call("thermo", "water", "--temperature", "300,1000")
    assert "e-02 of themselves, worst at 1000 K" in out
    _, out, _ = call("thermo", "water", "--temperature", "300")
    assert "worst" not in out
