"""Faults of one sign or word that other tests let pass: each test here goes red for one that was put in on purpose."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.classical.driven import DrivenRequest
from rotor.classical.gas.ensembles import thermal_ensemble
from rotor.classical.lyapunov import Flow, lyapunov_exponents
from rotor.fitting.reports.publication import suitable_unit, value_text
from rotor.formats.spcat.hamiltonian.labels import Functions, _by_k2
from rotor.plots.show import write_picture
from rotor.plots.spectra.raman import picture as raman_picture
from rotor.plots.view import View
from rotor.quantum.wang import wang_matrix
from rotor.quantum.wang.wang_matrix import lowest_energies
from rotor.spectra.raman.raman import raman_lines
from rotor.tops.spins.spin_weights import MOST_WEIGHT, SpinWeights

# Blocks of three bands


@pytest.mark.parametrize("width", [1, 3, 4])
def test_all_bands_of_a_large_block_count(width):
    """A bisection for tridiagonal matrices would leave out all bands but two; it is for large blocks that this matters."""
    size = wang_matrix.SMALL + 50
    bands = [np.arange(size) ** 2.0, *(np.full(size - n, 40.0 / n) for n in range(1, width))]
    whole = np.linalg.eigvalsh(sum(np.diag(b, n) + (np.diag(b, -n) if n else 0) for n, b in enumerate(bands)))
    computed = lowest_energies(bands, float(whole[2] + whole[3]) / 2)
    assert len(computed) >= 3
    assert computed[:3] == pytest.approx(whole[:3], abs=1e-9)  # round-off of 2e4


def test_a_block_that_overflows_is_refused_whatever_its_size():
    size = wang_matrix.SMALL + 5
    bands = [np.full(size, np.inf), np.ones(size - 1)]
    with pytest.raises(ValueError, match="overflows"):
        lowest_energies(bands, 0.0)


# Names by ⟨K²⟩


def test_the_mean_of_k_squared_is_that_of_the_share_in_the_group():
    """State 0 has 1 % of itself in the group, all of it at K = 2; state 1 has 90 %, at K = 0. Without the division 0.04 < 0.09."""
    none = np.zeros((2, 0), dtype=np.int64)
    names = np.array([[0, 0, 2], [0, 2, 1]])  # v, Ka, Kc of N = 2
    zero = np.zeros(2, dtype=np.int64)
    functions = Functions(names, np.array([0, 2]), none, zero, np.eye(2), np.array([2, 2]))
    shares = np.array([[0.0, 0.885], [0.01, 0.015]])  # of K = 0 and K = 2 in states 0 and 1
    named = _by_k2(functions, np.array([0, 1]), np.array([0, 1]), shares, np.array([1.0, 2.0]))
    assert functions.k[named].tolist() == [2, 0]


# Gases


def test_a_linear_gas_moves_and_an_atom_does_not_turn():
    rng = np.random.default_rng(2)
    rods = thermal_ensemble((0.0, 2.0, 2.0), 1.0, 50, rng=rng)
    later = rods.moved(0.7)
    assert np.abs(later.attitude - rods.attitude).max() > 0.1
    axis, after = (rotor_axis(item.attitude) for item in (rods, later))
    angle = np.linalg.norm(rods.momentum, axis=1) / 2.0 * 0.7  # the axis turns with |L|/I
    assert np.einsum("ni,ni->n", axis, after) == pytest.approx(np.cos(angle), abs=1e-12)
    atoms = thermal_ensemble((0.0, 0.0, 0.0), 1.0, 5, rng=rng, mass=1.0)
    assert np.array_equal(atoms.moved(0.7).attitude, atoms.attitude)
    assert rods.kinetic.total == 100  # two rotations each
    assert rods.kinetic.total == rods.moved(0.7).kinetic.total


def rotor_axis(attitude):
    """The body axis 1 in space, of quaternions with the scalar first."""
    w, x, y, z = attitude.T
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)


# Flows that depend on time


def test_segments_of_a_timed_flow_are_at_their_own_times():
    """dy/dt = t y (and -2 t y): the exponent of a segment is the mean of t over it."""
    flow = Flow(lambda t, y: t * y * np.array([1.0, -2.0]), np.array([0.0, 0.0]), timed=True)
    exponents = lyapunov_exponents(flow, time=12.0, segments=3, transient=5.0, interval=0.5, tolerance=1e-10)
    length, aligning = 4.0, 0.2 * 4.0
    means = [5.0 + length * n + aligning + length / 2 for n in range(3)]
    assert exponents.values == pytest.approx([np.mean(means), -2 * np.mean(means)], rel=1e-7)
    assert exponents.divergence == pytest.approx(-np.mean(means), rel=1e-7)
    spread = np.std(means, ddof=1) / math.sqrt(3)
    assert exponents.errors[0] == pytest.approx(math.hypot(spread, exponents.bias), rel=1e-6)


# Requests of driven motions


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"times": (0.0, 1.0, math.inf)}, "at least two finite times"),
        ({"times": (0.0, math.nan)}, "at least two finite times"),
        ({"times": (-math.inf, 0.0)}, "at least two finite times"),
        ({"times": (0.0,)}, "at least two finite times"),
        ({"times": (0.0, 2.0, 1.0)}, "all increase, or all decrease"),
        ({"times": (0.0, 1.0, 1.0)}, "without repetition"),
        ({"attitude": (1.0, 0.1, 0.0, 0.0)}, "a unit quaternion"),
        ({"angular_velocity": (0.0, math.inf, 0.0)}, "three finite numbers"),
        ({"angular_momentum": (0.0, 1.0, 0.0)}, "give one of them"),
    ],
)
def test_what_a_driven_motion_refuses(change, said):
    fine = {"moments": (1.0, 2.0, 2.5), "times": (0.0, 1.0), "angular_velocity": (0.1, 1.0, 0.0)}
    assert DrivenRequest(**fine).momentum.tolist() == [0.1, 2.0, 0.0]
    with pytest.raises(ValueError, match=said):
        DrivenRequest(**{**fine, **change})


# Spin weights


@pytest.mark.parametrize(
    "weights", [{"even": 0, "odd": 0}, {"even": 1.5, "odd": 1}, {"even": -1, "odd": 3}, {"even": 1, "odd": -1}]
)
def test_weights_that_cannot_be(weights):
    with pytest.raises(ValueError, match="whole numbers of 0 or more, not all 0"):
        SpinWeights.from_mapping(weights)


def test_weights_beyond_exact_sums_are_refused_and_the_largest_is_served():
    assert SpinWeights("J", ("even", "odd"), (MOST_WEIGHT, 1)).linear_weights([0, 1]).tolist() == [MOST_WEIGHT, 1]
    with pytest.raises(ValueError, match="digits, too many to add up exactly"):
        SpinWeights("J", ("even", "odd"), (MOST_WEIGHT + 1, 1)).linear_weights([0])


@pytest.mark.parametrize(
    ("weights", "use"),
    [
        ({"even": 1, "odd": 3}, lambda w: w.asymmetric_weight("ee")),
        ({"even": 1, "odd": 3}, lambda w: w.symmetric_weights(1, 1)),
        ({"ee": 1, "eo": 3, "oe": 3, "oo": 1}, lambda w: w.linear_weights(1)),
        ({"even": 1, "odd": 3}, lambda w: w.spherical_weights(1)),
        ({"even": 1, "odd": 3}, lambda w: w.irrep_weight("A1")),
        ({"even": 1, "odd": 3}, lambda w: w.modulus),
    ],
)
def test_weights_of_another_rule_are_refused(weights, use):
    with pytest.raises(ValueError, match="do not fit"):
        use(SpinWeights.from_mapping(weights))


def test_irreps_that_there_are_not():
    tetrahedral = SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3})
    with pytest.raises(ValueError, match="irrep 'G': known are"):
        tetrahedral.irrep_weight("G")
    icosahedral = SpinWeights.from_mapping({"A": 1, "F1": 2, "F2": 3, "G": 4, "H": 5})
    with pytest.raises(ValueError, match="icosahedral"):
        icosahedral.irrep_weight("A1")
    assert SpinWeights().irrep_weight("F1") == 3


# Tables of publications


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (12.0, 0.0, "12.0"), (12.0, -1.0, "12.0"), (12.0, math.inf, "12.0"), (12.0, math.nan, "12.0"),
        (1.0, 0.0996, "1.00(10)"), (1.0, 0.0994, "1.000(99)"), (1.0, 0.995, "1.0(10)"), (8200.0, 130.0, "8200(130)"),
        (1e-4, 1e-6, "0.0001000(10)"), (0.99e-4, 1e-6, "0.0990(10)e-3"), (0.0, 3e-4, "0.00000(30)"),
    ],
)  # fmt: skip
def test_numbers_with_errors_at_the_edges(value, error, text):
    assert value_text(value, error) == text


@pytest.mark.parametrize(
    ("value", "error", "unit"),
    [
        (0.1, None, "MHz"), (0.0999, None, "kHz"), (1e-4, None, "kHz"), (0.99e-4, None, "Hz"), (0.0, 1.0, "MHz"), (0.0, 0.99, "kHz"),
        (0.0, None, "pHz"),
    ],
)  # fmt: skip
def test_units_at_their_edges(value, error, unit):
    assert suitable_unit(value, error)[0] == unit


# Raman lines


def test_the_provenance_of_raman_lines():
    top = rotor.read("N2")
    lines = raman_lines(top, temperature_k=77.0, laser_nm=488.0)
    facts = lines.provenance
    assert facts["polarizability_abc_angstrom3"] == top.polarizability_abc_angstrom3
    assert facts["polarizability_source"] == top.polarizability_source != ""
    assert (facts["temperature_k"], facts["laser_nm"]) == (77.0, 488.0)
    assert (facts["jmax"], facts["lines"], facts["q"]) == (lines.jmax, len(lines), lines.partition.q)
    assert facts["min_relative"] == (lines.min_relative or None)
    assert replace(lines, min_relative=0.0).provenance["min_relative"] is None
    assert replace(lines, min_relative=0.25).provenance["min_relative"] == 0.25
    assert facts["q_source"] == lines.partition.source
    assert facts["warnings"] == list(lines.warnings)
    assert facts["constants_mhz" if "constants_mhz" in facts else "constants"] is not None


def test_a_raman_picture_has_the_title_and_the_facts_that_are_given(folder):
    lines = raman_lines(rotor.read("N2"), temperature_k=77.0)
    assert raman_picture(lines, title="own title").figure.axes[0].get_title(loc="left") == "own title"
    write_picture(lines, "a.svg", title="own title", provenance={"command": "rotor raman N2"})
    text = (folder / "a.svg").read_text()
    assert "own title" in text
    assert "rotor raman N2" in text
    assert "temperature_k" in text
    write_picture(lines, "b.svg", title="own title", view=View(title="of the view"))
    assert "of the view" in (folder / "b.svg").read_text()
    assert "own title" not in (folder / "b.svg").read_text()
    with pytest.raises(ValueError, match="no line between"):
        write_picture(lines, "c.svg", view=View(horizontal=(1e5, 2e5)))
    with pytest.raises(ValueError, match=r"c\.txt"):
        write_picture(lines, "c.txt")


def test_the_picture_of_a_command_and_of_a_scene_are_of_its_lines(call, folder):
    code, _, err = call(
        "raman", "N2", "--temperature", "77", "--plot", "a.svg", "--plot-title", "cold", "--save-scene", "s.toml"
    )
    assert code == 0, err
    text = (folder / "a.svg").read_text()
    assert "cold" in text
    assert "raman N2" in text
    (folder / "a.svg").unlink()
    scene = (folder / "s.toml").read_text()
    assert "a.svg" in scene
    code, _, err = call("run", "s.toml")
    assert code == 0, err
    assert "77" in (folder / "a.svg").read_text()
    code, _, err = call("raman", "N2", "--plot", "b.svg", "--plot-range", "100000:200000")
    assert code != 0
    assert "no line between" in err
