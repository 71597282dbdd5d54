"""Geometries become tops: constants, kinds with margins, frames that do not depend on how the molecule came."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import rotor
from rotor import units
from rotor.molecules.molecule import Molecule
from rotor.tops.constants.constants import Constants
from rotor.tops.kind import kind_from_moments
from rotor.tops.top import Top

WATER = Molecule(
    ("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]], dipole_debye=[0, 0, -1.85]
)
FORMIC = Molecule(  # Cs, no other symmetry
    ("C", "O", "O", "H", "H"),
    [[-0.1317, 0.4010, 0], [-1.1319, -0.2652, 0], [1.1210, -0.1055, 0], [-0.1066, 1.4973, 0], [1.0416, -1.0740, 0]],
    dipole_debye=[1.3, 0.3, 0.0],
)
CHIRAL = Molecule(
    ("C", "H", "F", "Cl", "Br"),
    [[0, 0, 0], [0.6, 0.6, 0.7], [0.8, -0.8, -0.75], [-1.0, 1.05, -1.0], [-1.1, -1.1, 1.15]],
    dipole_debye=[0.3, -0.7, 0.4],
)
AMMONIA = Molecule(
    ("N", "H", "H", "H"),
    [[0, 0, 0.1173], *([0.9377 * np.cos(t), 0.9377 * np.sin(t), -0.2738] for t in (0, 2 * np.pi / 3, 4 * np.pi / 3))],
)
METHANE = Molecule(
    ("C", "H", "H", "H", "H"), 0.629 * np.array([[0, 0, 0], [1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
)


def shaken(molecule: Molecule, seed: int) -> Molecule:
    """The same molecule turned, shifted, its atoms in another order."""
    rng = np.random.default_rng(seed)
    turn, order = Rotation.random(rng=rng).as_matrix(), rng.permutation(len(molecule.symbols))
    dipole = None if molecule.dipole_debye is None else turn @ molecule.dipole_debye
    return Molecule(
        tuple(molecule.symbols[i] for i in order),
        (molecule.positions_angstrom @ turn.T + rng.normal(size=3))[order],
        dipole_debye=dipole,
    )


@given(st.sampled_from([WATER, FORMIC, CHIRAL, AMMONIA, METHANE]), st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_orientation_place_and_order_change_nothing(molecule, seed):
    first, other = Top.from_molecule(molecule), Top.from_molecule(shaken(molecule, seed))
    assert other.kind == first.kind
    assert other.rotational_constants_mhz == pytest.approx(first.rotational_constants_mhz, rel=1e-12)  # round-off
    if first.dipole_abc_debye is not None:
        assert other.dipole_abc_debye == pytest.approx(first.dipole_abc_debye, abs=1e-9)
    assert same_cloud(in_frame(first), in_frame(other))


def in_frame(top: Top) -> np.ndarray:
    """Masses and positions in a, b, c."""
    positions = (top.molecule.positions_angstrom - top.frame.centre) @ top.frame.axes.T
    return np.column_stack([top.molecule.masses_u, positions])


def same_cloud(cloud: np.ndarray, other: np.ndarray) -> bool:
    """Whether every atom of one has its own partner in the other, within what candidates of a frame may tie by."""
    distances = np.abs(cloud[:, None, :] - other[None, :, :]).max(axis=2)
    return bool((distances.min(axis=1) < 1e-4).all() and len(set(distances.argmin(axis=1))) == len(cloud))


def test_water_from_its_geometry_has_constants_to_one_per_cent():
    """r0 geometry of CCCBDB against its constants, to the 1 % that vibration makes; planar; dipole along b."""
    top = Top.from_molecule(WATER)
    assert top.kind == "asymmetric"
    assert top.rotational_constants_mhz == pytest.approx((835840.3, 435351.7, 278138.7), rel=0.03)
    assert top.inertial_defect_u_angstrom2 == pytest.approx(0, abs=1e-12)
    assert top.planar_moments_u_angstrom2[2] == pytest.approx(0, abs=1e-12)
    assert np.abs(top.dipole_abc_debye) == pytest.approx([0, 1.85, 0], abs=1e-12)
    assert top.kappa == pytest.approx(-0.44, abs=0.02)
    assert top.mass_u == pytest.approx(18.0105647, abs=1e-6)


def test_constants_of_unit_inertia():
    """505379.00844 MHz u Å² / I (CODATA 2022)."""
    assert Top.from_constants("B=505379.00844 MHz").moments_u_angstrom2[2] == pytest.approx(1.0, rel=1e-10)


def test_isotopic_masses():
    """HDO: C of water from 278 to about 192 GHz, and a dipole along a appears: 0.67 D (hard case 13)."""
    hdo = Top.from_molecule(WATER.with_isotopes({2: "2H"}))
    assert hdo.rotational_constants_mhz == pytest.approx((701931.5, 272912.6, 192055.25), rel=0.03)
    assert abs(hdo.dipole_abc_debye[0]) == pytest.approx(0.67, abs=0.02)


@pytest.mark.parametrize("seed", range(40))
def test_linear_in_any_orientation(seed):
    """Hard case 8: I_a of HCl is round-off, also negative; A is never computed."""
    top = Top.from_molecule(shaken(Molecule(("H", "Cl"), [[0, 0, 0], [0, 0, 1.27455]]), seed))
    assert top.kind == "linear"
    assert set(top.constants.values) == {"B"}
    assert top.frame.moments[0] == 0
    assert top.kappa is None


@pytest.mark.parametrize(
    ("bend_degrees", "kind"), [(0.0, "linear"), (0.01, "linear"), (0.5, "asymmetric"), (5.0, "asymmetric")]
)
def test_near_linear_says_by_which_number(bend_degrees, kind):
    """Hard case 9: OCS bent a little; I_a/I_c against 1e-6 decides and is stated with its margin."""
    t = np.radians(bend_degrees)
    top = Top.from_molecule(
        Molecule(("O", "C", "S"), [[0, 0, 1.156], [0, 0, 0], [1.561 * np.sin(t), 0, -1.561 * np.cos(t)]])
    )
    assert top.kind == kind
    assert top.kind_of_top.margin > 1
    assert (top.kind_of_top.linearity < top.kind_of_top.linear_below) == (kind == "linear")


def test_margins_tell_doubtful_choices():
    near = kind_from_moments([1.0, 2.0, 2.0 * (1 + 2e-6)])
    assert near.kind == "asymmetric"
    assert near.margin == pytest.approx(2, rel=1e-3)
    assert kind_from_moments([1.0, 2.0, 2.0 * (1 + 2e-6)], equal_within=1e-5).kind == "prolate"
    assert kind_from_moments([1.0, 2.0, 3.0]).margin > 1e5


@pytest.mark.parametrize(
    ("text", "kind", "kappa"),
    [
        ("B=1 GHz", "linear", None),
        ("A=2 B=1 GHz", "prolate", -1.0),
        ("B=2 C=1 GHz", "oblate", 1.0),
        ("A=2 B=2 C=2 GHz", "spherical", None),
        ("A=3 B=2 C=1 GHz", "asymmetric", 0.0),
    ],
)
def test_kinds_of_constants(text, kind, kappa):
    top = Top.from_constants(text)
    assert (top.kind, top.kappa) == (kind, kappa)


def test_an_almost_equal_pair_of_constants_is_taken_as_given():
    assert Top(Constants(A=10.0, B=5.0 * (1 + 1e-6), C=5.0)).kind == "asymmetric"


def test_single_atom_and_bad_dipole():
    with pytest.raises(ValueError, match="single atom"):
        Top.from_molecule(Molecule(("Ar",), [[0, 0, 0]]))
    with pytest.raises(ValueError, match="three finite numbers"):
        Top.from_constants("B=1 GHz", dipole_abc_debye=(1, 2))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_polarizability_turns_along(seed):
    """In principal axes nothing depends on how the molecule came, but for the signs of axes that symmetry leaves free."""
    alpha = np.array([[1.415, 0, 0], [0, 1.528, 0], [0, 0, 1.468]])
    turned = replace(WATER, polarizability_angstrom3=alpha).moved(
        Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    )
    computed = np.array(Top.from_molecule(turned).polarizability_abc_angstrom3)
    assert computed == pytest.approx(np.diag([1.528, 1.468, 1.415]), abs=1e-12)  # round-off of a turn
    assert not computed[~np.eye(3, dtype=bool)].any()


@pytest.mark.parametrize("symbols", [("N", "N"), ("C", "O")])
def test_noise_in_a_polarizability_that_symmetry_forbids_is_left_out(symbols):
    """A rod: α∥ along a, the mean of the others across; what is more than 0.001 of the whole is refused."""
    rod = Molecule(symbols, [[0, 0, 0], [0, 0, 1.1]])
    computed = Top.from_molecule(replace(rod, polarizability_angstrom3=np.diag([1.5, 1.5001, 2.2])))
    assert np.diag(computed.polarizability_abc_angstrom3) == pytest.approx([2.2, 1.50005, 1.50005], abs=1e-12)
    with pytest.raises(ValueError, match=r"not invariant under (D∞h|C∞v); the invariant part is 2.2, 0, 0, 1.55"):
        Top.from_molecule(replace(rod, polarizability_angstrom3=np.diag([1.5, 1.6, 2.2])))


def test_an_axis_makes_the_polarizability_axial():
    angle = 2 * np.pi / 3 * np.arange(3)
    ring = np.stack([np.cos(angle), np.sin(angle), np.full(3, 0.4)], axis=1)
    pyramid = Molecule(
        ("N", "H", "H", "H"), np.vstack([[0, 0, 0], ring]), polarizability_angstrom3=np.diag([2.0, 2.002, 2.4])
    )
    a, b, c = np.diag(Top.from_molecule(pyramid).polarizability_abc_angstrom3)
    assert (a, b, c) == pytest.approx((2.001, 2.001, 2.4), abs=1e-12)


@pytest.mark.oracle
def test_339_geometries(shared: Path):
    """CCCBDB: constants from each geometry deviate from the measured ones by what the file says, within 5e-5."""
    with gzip.open(shared / "reference" / "structures" / "geometry_and_constants.json.gz", "rt") as handle:
        species = json.load(handle)
    assert len(species) == 339
    assert all(abs(deviation(entry) - entry["max_rel_dev"]) < 5e-5 for entry in species.values())


@pytest.mark.oracle
def test_averaged_masses_would_be_seen(shared: Path):
    """Negative control: with averaged masses of Cl and Br the comparison fails for BrCl."""
    with gzip.open(shared / "reference" / "structures" / "geometry_and_constants.json.gz", "rt") as handle:
        entry = json.load(handle)["BrCl_13863417"]
    measured = entry["rot_cm1"][0] * units.MHZ_PER_CM
    reduced_mass = 79.904 * 35.453 / (79.904 + 35.453)
    averaged = units.ROTATIONAL_MHZ_U_ANGSTROM2 / (reduced_mass * 2.136**2)
    assert abs(abs(averaged / measured - 1) - entry["max_rel_dev"]) > 5e-5


def deviation(entry: dict) -> float:
    """Largest relative difference between constants of the geometry and those measured."""
    rows = [line.split() for line in entry["xyz"].splitlines() if line.strip()]
    top = Top.from_molecule(
        Molecule(tuple(r[0] for r in rows), [[float(x) for x in r[1:4]] for r in rows], charge=entry["charge"])
    )
    measured = np.array(sorted((x for x in entry["rot_cm1"] if x), reverse=True)) * units.MHZ_PER_CM
    a, b, c = top.rotational_constants_mhz
    ours = {1: [c], 2: [b, c] if top.kind == "linear" else [a, c], 3: [a, b, c]}[len(measured)]
    return float(np.abs(np.array(ours) / measured - 1).max())


# What symmetry forbids


@pytest.mark.parametrize(
    ("name", "dipole", "said"),
    [
        ("water", (1.8, 0, 0), r"dipole μa = 1.8 D: a molecule of C2v has none along a; symmetry allows μb alone"),
        ("NH3", (0, 1.4, 0), r"dipole μb = 1.4 D: .* C3v .* allows μc alone"),
        ("CO2", (0.1, 0, 0), r"D∞h has none along a; symmetry allows none"),
        ("CH4", (0, 0, 1), r"Td has none along c; symmetry allows none"),
        ("HCOOH", (0, 0, 0.5), r"Cs has none along c; symmetry allows μa and μb alone"),
    ],
)
def test_a_dipole_that_symmetry_forbids_is_refused(name, dipole, said):
    with pytest.raises(ValueError, match=said):
        rotor.read(name).with_dipole(dipole, "by hand")


ORTHO_PARA = {"ee": 1, "eo": 3, "oe": 3, "oo": 1}


@pytest.mark.parametrize("axis", "abc")
def test_spin_weights_tell_which_dipole_there_is(axis):
    """Constants alone: a component is refused exactly where it makes lines between levels of different weight."""
    dipole = [1.0 if letter == axis else 0.0 for letter in "abc"]
    bare = Top.from_constants("A=9 B=6 C=4 GHz", dipole_abc_debye=dipole)
    lines = rotor.api.line_list(bare, jmax=4, min_lgint=None)
    levels, columns = lines.levels, lines.columns
    parity = [["eo"[q % 2] for q in columns[f"{name}_{end}"]] for end in ("upper", "lower") for name in ("ka", "kc")]
    pairs = {(a + b, c + d) for a, b, c, d in zip(*parity, strict=True)}
    for weights in (
        ORTHO_PARA,
        {"ee": 1, "eo": 1, "oe": 3, "oo": 3},
        {"ee": 1, "eo": 3, "oe": 1, "oo": 3},
        {"ee": 7, "eo": 3, "oe": 3, "oo": 3},
    ):
        forbidden = any(weights[first] != weights[other] for first, other in pairs)
        if forbidden:
            with pytest.raises(ValueError, match=f"has none along {axis}"):
                Top.from_constants("A=9 B=6 C=4 GHz", dipole_abc_debye=dipole, spin_weights=weights)
        else:
            Top.from_constants("A=9 B=6 C=4 GHz", dipole_abc_debye=dipole, spin_weights=weights)
    assert len(levels) == 25


def test_weights_of_other_rules_forbid_too():
    for text, dipole, weights in (
        ("B=9 GHz", (1, 0, 0), {"even": 1, "odd": 3}),
        ("B=6 C=3 GHz", (0, 0, 1), {"0even": 7, "0odd": 13, "1": 11, "2": 9, "3": 14, "4": 9, "5": 11}),
    ):
        with pytest.raises(ValueError, match=r"symmetry allows none|has none along"):
            Top.from_constants(text, dipole_abc_debye=dipole, spin_weights=weights)
    Top.from_constants("A=90 B=9 GHz", dipole_abc_debye=(1, 0, 0), spin_weights={"0": 2, "1": 1, "2": 1})


def test_a_polarizability_that_symmetry_forbids_is_refused():
    tensor = [[1.5, 0.3, 0], [0.3, 1.4, 0], [0, 0, 1.6]]
    with pytest.raises(ValueError, match=r"αab = 0.3, .* not invariant under C2v; .* 1.5, 0, 0, 1.4, 0, 1.6"):
        rotor.read("water").with_polarizability(tensor, "by hand")
    with pytest.raises(ValueError, match=r"αab = 0.3 Å³: .* different nuclear-spin weight; give 0"):
        Top.from_constants("A=9 B=6 C=4 GHz", spin_weights=ORTHO_PARA).with_polarizability(tensor, "by hand")
    Top.from_constants("A=9 B=6 C=4 GHz").with_polarizability(tensor, "by hand")


# Symmetry nearly there


def test_buckminsterfullerene_of_ase_is_near_ih():
    from ase.build import molecule

    atoms = molecule("C60")
    top = Top.from_molecule(Molecule(tuple(atoms.get_chemical_symbols()), atoms.positions))
    assert (top.kind, top.symmetry.symmetry_number) == ("asymmetric", 1)
    assert any("near Ih: nuclei are up to 0.0047 Å off" in note for note in top.notes)
    ball = top.with_symmetry_within(0.005)
    assert (ball.kind, ball.symmetry.point_group, ball.symmetry.symmetry_number) == ("spherical", "Ih", 60)
    assert ball.spin_weights.to_mapping() == {"A": 1, "F1": 0, "F2": 0, "G": 0, "H": 0}  # 12C has no spin
    assert ball.notes == ()
    with pytest.raises(ValueError, match=r"up to 0\.138 Å, a tenth of the shortest distance"):
        top.with_symmetry_within(0.5)
    with pytest.raises(ValueError, match="has constants that do not follow"):
        rotor.read("water").with_symmetry_within(0.005)


def test_tops_and_requests_are_compared_by_content():
    """A copy is equal and has the same hash; one number changed is another top; a list of tops can be searched."""
    import copy
    import pickle

    water = rotor.read("water")
    again = pickle.loads(pickle.dumps(water))
    assert water == again == copy.deepcopy(water) == rotor.read("water")
    assert hash(water) == hash(again)
    other = replace(water, dipole_abc_debye=(0.0, 1.0, 0.0))
    assert water != other
    assert water != "water"
    assert [other, water].index(again) == 1
    assert {water: 1}[again] == 1
    assert rotor.api.SpectrumRequest(water, jmax=3) == rotor.api.SpectrumRequest(again, jmax=3)
    turned = rotor.read("water", isotopes={2: "D"})
    assert turned not in (water, other)
    levels = rotor.api.solve_levels(water, 2)
    assert levels in [levels]
    assert levels != rotor.api.solve_levels(water, 2)  # tables are compared column by column, by their reader
