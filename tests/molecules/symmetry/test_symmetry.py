"""Point groups: known molecules in any orientation, with noise; what is only near; what is refused."""

from __future__ import annotations

import gzip
import json
import time
from pathlib import Path

import numpy as np
import pytest
from ase.collections import g2
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import masses
from rotor.molecules.symmetry.operations import best_turn, closed_group, find_operations, shortest_distance
from rotor.molecules.symmetry.point_group import Symmetry, find_symmetry, molecule_symmetry

# Point groups of ASE's g2 collection (geometries: L. A. Curtiss et al., J. Chem. Phys. 106, 1063 (1997)), typed from
# chemistry. Radicals are distorted there as theory has them: CH3O and CH3S are Cs, H2COH is C1. Acetamide (pyramidal
# N) and isopropanol (gauche) are C1; the t-butyl radical is C3v, the isopropyl radical Cs.
G2_GROUPS = {
    "Kh": "Si S F C Cl Be Al Na P H B O N Li",
    "C∞v": "CS CO LiF CN NaCl ClF NO LiH CH OH HCl SiO N2O HCN OCS ClO HF SO NH CCH SH BeH",
    "D∞h": "P2 H2 C2H2 CO2 CS2 NCCN S2 O2 Si2 Li2 F2 N2 Cl2 Na2",
    "C1": "H2COH C2H6CHOH CH3CONH2",
    "Cs": "CH3CHO CH3COF CH3CH2OCH3 HCOOH HOCl CH3SH CH3CO CH2NHCH2 HCO ClNO H3CNH2 CH3CH2OH C2H3 CH3ONO H2CCHCl "
    "H2CCHCN CH3COOH CH3S CH3CH2SH CH3NO2 CH3O CH3OH C3H7Cl CH3CH2O H2CCHF C3H7 C2H5 C2H6NH CH3CH2Cl CH3COCl C3H6_Cs "
    "HCOOCH3 C2H6SO CH3CH2NH2",
    "C2": "N2H4 H2O2",
    "C2h": "OCHCHO trans-butane butadiene",
    "C2v": "SH2 C4H4NH CH3SCH3 SiH2_s3B1d ClF3 isobutene bicyclobutane methylenecyclopropane PH2 cyclobutene NH2 "
    "CH2OCH2 H2CO SiH2_s1A1d C4H4S CH3OCH3 C5H5N H2O CH2_s1A1d C4H4O O3 COF2 F2O SO2 H2CCl2 C3H8 CH2_s3B1d H2CF2 "
    "CH2SCH2 CH3COCH3 H2CCO C3H4_C2v NO2",
    "C3v": "PH3 C3H9C HCCl3 CH3Cl CH3SiH3 PF3 CH3CN SiH3 HCF3 isobutane CF3CN NF3 NH3 C3H9N C3H4_C3v",
    "D2d": "cyclobutane C3H4_D2d C5H8",
    "D2h": "C2H4 C2F4 C2Cl4",
    "D3h": "AlF3 C3H6_D3h CH3 BCl3 AlCl3 2-butyne BF3",
    "D3d": "C2H6 Si2H6",
    "D6h": "C6H6",
    "Td": "SiH4 SiF4 CCl4 SiCl4 CF4 CH4",
}
GROUP_OF = {name: group for group, names in G2_GROUPS.items() for name in names.split()}
SIGMA = {"Kh": 1, "C∞v": 1, "D∞h": 2, "C1": 1, "Cs": 1, "C2": 2, "C2h": 2, "C2v": 2, "C3v": 3, "D2d": 4, "D2h": 4}
SIGMA |= {"D3h": 6, "D3d": 6, "D6h": 12, "Td": 12}


def any_turn(rng):
    """A random proper rotation matrix."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.linalg.det(turn)


def g2_symmetry(name: str, change=lambda positions: positions) -> Symmetry:
    atoms = g2[name]
    symbols = atoms.get_chemical_symbols()
    return find_symmetry(symbols, masses(symbols), change(atoms.positions))


def test_every_molecule_of_g2_has_an_expected_group():
    assert set(GROUP_OF) == set(g2.names)


@pytest.mark.parametrize("seed", [1, 2])
def test_g2_in_any_orientation_with_noise(seed):
    rng = np.random.default_rng(seed)

    def disturbed(positions):
        turned = positions @ any_turn(rng).T + rng.normal(scale=5, size=3)
        return turned + rng.normal(scale=1e-4, size=positions.shape)  # the noise in Å that must not hide a symmetry

    for name, group in GROUP_OF.items():
        computed = g2_symmetry(name, disturbed)
        assert (computed.point_group, computed.symmetry_number) == (group, SIGMA[group]), name
        assert computed.deviation_angstrom < 6e-4, name  # six standard deviations of the noise


# Shapes for the groups that g2 lacks, with the rotations and their number


def ring(n, radius, height, start=0.0):
    angles = start + 2 * np.pi * np.arange(n) / n
    return np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(n, height)], axis=1)


def turn_about(axis, n):
    """The rotation by 2π/n about an axis."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    return expm(2 * np.pi / n * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))


def orbit(point, *generators):
    """All images of a point under products of the generators."""
    images = [np.asarray(point, dtype=float)]
    for image in images:
        for generator in generators:
            new = generator @ image
            if min(np.linalg.norm(new - old) for old in images) > 1e-6:
                images.append(new)
    return np.array(images)


PHI = (1 + 5**0.5) / 2
C2, C3, C4, C5 = (turn_about(*a) for a in (([0, 0, 1], 2), ([1, 1, 1], 3), ([0, 0, 1], 4), ([0, 1, PHI], 5)))
OFF_AXES = np.array([0.5, 1.1, 2.3])
S4, S6 = turn_about([0, 0, 1], 4) * [1, 1, -1], turn_about([0, 0, 1], 6) * [1, 1, -1]
SHAPES = {
    "Ci": (np.concatenate([orbit(p, -np.eye(3)) for p in ([1, 0, 0.2], [0.3, 1.2, 0], [0.5, 0.4, 1.4])]), "C1", 1),
    "S4": (np.concatenate([orbit(p, S4) for p in ([1, 0, 1], [1.8, 0.8, 2])]), "C2", 2),
    "S6": (np.concatenate([orbit(p, S6) for p in ([1, 0, 1], [1.8, 0.8, 2])]), "C3", 3),
    "C3": (np.concatenate([ring(3, 1, 0), ring(3, 2, 1, 0.3), ring(3, 2, 3, 0.9)]), "C3", 3),
    "C3h": (np.concatenate([ring(3, 1, 0), ring(3, 2, 0, 0.5)]), "C3", 3),
    "C4v": (np.concatenate([ring(4, 1, 0), ring(1, 0, 1.5)]), "C4", 4),
    "D2": (orbit(OFF_AXES, C2, turn_about([1, 0, 0], 2)), "D2", 4),
    "D3": (np.concatenate([ring(3, 1, 1), ring(3, 1, -1, 0.4)]), "D3", 6),
    "D4d": (np.concatenate([ring(4, 1, 1), ring(4, 1, -1, np.pi / 4)]), "D4", 8),
    "D5d": (np.concatenate([ring(5, 1, 1), ring(5, 1, -1, np.pi)]), "D5", 10),
    "D7h": (ring(7, 1.5, 0), "D7", 14),
    "T": (orbit(OFF_AXES, C2, C3), "T", 12),
    "Th": (orbit(OFF_AXES, C2, C3, -np.eye(3)), "T", 12),
    "O": (orbit(OFF_AXES, C4, C3), "O", 24),
    "Oh": (orbit([1, 1, 1], C4, C3), "O", 24),
    "I": (orbit(OFF_AXES, C5, C3), "I", 60),
    "Ih": (orbit([0, 1, PHI], C5, C3), "I", 60),
}


@pytest.mark.parametrize("group", SHAPES)
def test_groups_beyond_g2(group):
    points, rotations, number = SHAPES[group]
    points = points @ any_turn(np.random.default_rng(3)).T
    computed = find_symmetry(["F"] * len(points), np.full(len(points), 19.0), points)
    assert (computed.point_group, computed.rotation_group, computed.symmetry_number) == (group, rotations, number)
    sizes = {len(alike) for alike in computed.equivalent}
    assert all(number * (2 if computed.improper else 1) % size == 0 for size in sizes)  # orbits divide the order


@pytest.mark.parametrize("name", ["NH3", "C2H4", "C6H6", "CH4", "C3H4_D2d", "C2H6", "CO2", "H2O2"])
def test_operations_are_a_group_and_do_what_they_say(name):
    computed = g2_symmetry(name)
    mass = masses(g2[name].get_chemical_symbols())
    positions = g2[name].positions - mass @ g2[name].positions / mass.sum()
    known = {rotation.permutation.tobytes() for rotation in computed.rotations}
    for rotation in computed.rotations:
        images = positions @ rotation.matrix.T
        assert np.abs(images - positions[rotation.permutation]).max() < 1e-5  # g2 prints six decimals
        assert abs(np.linalg.det(rotation.matrix) - 1) < 1e-12  # round-off
        for other in computed.rotations:
            assert rotation.permutation[other.permutation].tobytes() in known


def test_axes_of_water_and_allene():
    water, allene = g2_symmetry("H2O"), g2_symmetry("C3H4_D2d")
    assert [order for order, _ in water.axes] == [2]
    assert abs(water.axes_abc[1] @ water.axes[0][1]) == pytest.approx(1)  # H2O turns about b
    assert np.allclose(np.abs(allene.axes_abc @ np.array([axis for _, axis in allene.axes]).T).max(axis=0), 1)
    assert np.linalg.det(allene.axes_abc) == pytest.approx(1)
    assert allene.moments_u_angstrom2[1] == pytest.approx(allene.moments_u_angstrom2[2])


# Near symmetry: neither invented nor lost


def bent_ocs(degrees):
    angle = np.radians(180 - degrees)
    return ["O", "C", "S"], [[-1.16, 0, 0], [0, 0, 0], [1.56 * np.cos(angle), 1.56 * np.sin(angle), 0]]


def hooh(dihedral):
    """HOOH with OO 1.46 Å, OH 0.97 Å, angle 100°."""
    along, across = 0.97 * np.cos(np.radians(100)), 0.97 * np.sin(np.radians(100))
    half = np.radians(dihedral) / 2
    y, z = across * np.cos(half), across * np.sin(half)
    return [*"OOHH"], [[-0.73, 0, 0], [0.73, 0, 0], [-0.73 + along, y, z], [0.73 - along, y, -z]]


def ammonia(height):
    return [*"NHHH"], np.concatenate([[[0, 0, height]], ring(3, 1.0, 0)])


@pytest.mark.parametrize(
    ("shape", "group", "near", "displacement"),
    [
        (bent_ocs(175), "Cs", "C∞v", 0.044),
        (bent_ocs(180), "C∞v", None, 0),
        (hooh(170), "C2", "C2h", 0.078),
        (hooh(180), "C2h", None, 0),
        (hooh(112), "C2", None, 0),
        (ammonia(0.1), "C3v", "D3h", 0.082),
        (ammonia(0.0), "D3h", None, 0),
        (ammonia(0.38), "C3v", None, 0),
    ],
)
def test_near_symmetry_is_said_and_not_used(shape, group, near, displacement):
    symbols, positions = shape
    computed = find_symmetry(symbols, masses(symbols), positions)
    assert computed.point_group == group
    assert (computed.near.point_group if computed.near else None) == near
    if computed.near:
        assert computed.near.displacement_angstrom == pytest.approx(
            displacement, abs=1e-3
        )  # worked out by hand to 1e-3
        assert f"near {near}" in computed.describe()


def test_isotopes_break_symmetry_and_are_not_near():
    symbols = g2["C6H6"].get_chemical_symbols()
    computed = molecule_symmetry(Molecule(("13C", *symbols[1:]), g2["C6H6"].positions))
    assert (computed.point_group, computed.symmetry_number, computed.near) == ("C2v", 2, None)


def test_masses_tell_nuclei_apart_where_kinds_do_not():
    symbols, mass = g2["C6H6"].get_chemical_symbols(), masses(g2["C6H6"].get_chemical_symbols())
    opposite = int(np.argmax(np.linalg.norm(g2["C6H6"].positions[:6] - g2["C6H6"].positions[0], axis=1)))
    mass[[0, opposite]] = 13.00335  # the centre of mass stays, so that nothing else breaks the symmetry
    assert find_symmetry(symbols, mass, g2["C6H6"].positions).point_group == "D2h"


def test_a_limit_that_cuts_through_a_group_is_lowered():
    """A triangle with one corner moved: of the mismatches of C3v some are within a limit set between them, some not."""
    corners = ring(3, 1.0, 0.0) + np.array([[0.02, 0, 0], [0, 0.013, 0], [0, 0, 0]])
    points = np.concatenate([corners, [[0, 0, 0.8], [0, 0, -1.1]]])
    kinds, mass = "CCCNO", np.array([12.0, 12, 12, 14, 16])
    centred = points - mass @ points / mass.sum()
    operations, base = find_operations(np.array([0, 0, 0, 1, 2]), centred, 0.2)
    mismatches = np.array([operation.mismatch_angstrom for operation in operations])
    limits = np.sort(mismatches) + 1e-9
    within = [int((mismatches <= limit).sum()) for limit in limits]
    selected = [len(closed_group(operations, base, limit)) for limit in limits]
    assert len(operations) == 6
    assert set(selected) <= {1, 2, 3, 6}  # orders of the subgroups of C3v
    cut = [limit for limit, n, m in zip(limits, within, selected, strict=True) if m < n]
    assert cut  # four or five operations within the limit, which cannot be a group
    for limit in cut:
        computed = find_symmetry(kinds, mass, points, tolerance=limit / shortest_distance(points))
        assert computed.point_group in ("C1", "Cs", "C3")


def test_tolerance_is_relative_and_stated():
    symbols, positions = hooh(179)
    tight = find_symmetry(symbols, masses(symbols), positions, tolerance=1e-4)
    loose = find_symmetry(symbols, masses(symbols), positions, tolerance=0.05)
    large = find_symmetry(symbols, masses(symbols), 100 * np.array(positions), tolerance=0.05)
    assert (tight.point_group, loose.point_group, large.point_group) == ("C2", "C2h", "C2h")
    assert loose.tolerance_angstrom == pytest.approx(0.05 * 0.97)
    assert loose.deviation_angstrom == pytest.approx(0.0078, abs=2e-4)  # a tenth of that at 170°
    assert "off exact symmetry" in loose.describe()


# Algebra


@settings(max_examples=25)
@given(
    name=st.sampled_from(["H2O", "NH3", "C2H4", "C3H4_D2d", "CH4", "C6H6", "CO2", "N2H4", "C2H6", "CH3O", "BF3"]),
    seed=st.integers(0, 2**32 - 1),
)
def test_rotation_shift_and_order_of_atoms_change_nothing(name, seed):
    rng = np.random.default_rng(seed)
    atoms, order = g2[name], rng.permutation(len(g2[name]))
    symbols = [atoms.get_chemical_symbols()[i] for i in order]
    moved = (atoms.positions @ any_turn(rng).T + rng.normal(scale=3, size=3))[order]
    first, other = g2_symmetry(name), find_symmetry(symbols, masses(symbols), moved)

    assert (first.point_group, first.rotation_group) == (other.point_group, other.rotation_group)
    assert (first.near is None) == (other.near is None)
    assert {frozenset(group) for group in first.equivalent} == {
        frozenset(int(order[i]) for i in group) for group in other.equivalent
    }
    assert np.allclose(first.moments_u_angstrom2, other.moments_u_angstrom2, atol=1e-8)
    back = {tuple(order[r.permutation][np.argsort(order)].tolist()) for r in other.rotations}
    assert back == {tuple(r.permutation.tolist()) for r in first.rotations}


def test_best_turn_is_of_the_handedness_asked_for_in_a_plane():
    points = ring(5, 1.0, 0.0)
    for proper in (True, False):
        turn = best_turn(points, points[[1, 2, 3, 4, 0]], proper)
        assert np.allclose(points @ turn.T, points[[1, 2, 3, 4, 0]])
        assert np.linalg.det(turn) == pytest.approx(1 if proper else -1)


# What is refused


@pytest.mark.parametrize(
    ("kinds", "mass", "positions", "message"),
    [
        ("", [], np.zeros((0, 3)), "n of 1 or more"),
        ("HH", [1, 1], [[0, 0, 0]], "expected "),
        ("HH", [1, 0], [[0, 0, 0], [0, 0, 1]], "above 0"),
        ("HH", [1, 1], [[0, 0, 0], [0, 0, np.nan]], "finite"),
        ("HH", [1, 1], [[0, 0, 0], [0, 0, 1e-9]], "nearer than"),
    ],
)
def test_bad_input_is_told(kinds, mass, positions, message):
    with pytest.raises(ValueError, match=message):
        find_symmetry(kinds, mass, positions)


@pytest.mark.parametrize("tolerance", [0, -1, 0.3, float("nan")])
def test_bad_tolerances_are_told(tolerance):
    with pytest.raises(ValueError, match="fraction of the shortest distance"):
        find_symmetry("HH", [1, 1], [[0, 0, 0], [0, 0, 0.74]], tolerance)


def test_a_single_atom_has_spherical_symmetry():
    computed = find_symmetry(["He"], [4.0], [[1, 2, 3]])
    assert (computed.point_group, computed.rotation_group, computed.symmetry_number, computed.equivalent) == (
        "Kh",
        "K",
        1,
        ((0,),),
    )


# Ten thousand nuclei


def test_ten_thousand_nuclei_in_seconds():
    rng = np.random.default_rng(7)
    grid = np.array([[x, y, z] for x in range(17) for y in range(17) for z in range(17)], dtype=float)
    half = 2.0 * grid + rng.uniform(-0.4, 0.4, size=grid.shape) + [1.0, 2.0, 3.0]
    points = np.concatenate([half, half * [-1, -1, 1]])
    start = time.perf_counter()
    computed = find_symmetry(["C"] * len(points), np.full(len(points), 12.0), points)
    lone = find_symmetry(["C"] * len(points), np.full(len(points), 12.0), np.concatenate([points[:-1], [[99.0, 0, 0]]]))
    assert (len(points), computed.point_group, lone.point_group) == (9826, "C2", "C1")
    assert "not looked for" in computed.describe()
    assert time.perf_counter() - start < 20  # about a second here; a slower machine has room

    with pytest.raises(ValueError, match="too many like atoms"):
        find_symmetry(["C"] * 10_000, np.full(10_000, 12.0), ring(10_000, 3000, 0))


# The experimental geometries of CCCBDB

# Where the geometry in the file has another symmetry than the name of the group beside it.
CCCBDB_DIFFERS = {
    "BH3+_13283313": "D3h",  # the file says C2v; its three B-H are alike to 2e-5 Å
    "NO3+_12033497": "D3h",  # the file says C2v; its three N-O are alike to 3e-5 Å
    "C2H5Cl_75003": "C1",  # two of its H are 0.008 Å off the plane of symmetry; near Cs
    "C3H6O_107186": "C1",  # 2-propen-1-ol in a gauche geometry, named Cs
    "C8H6_536743": "Cs",  # phenylacetylene with a misprint: z of two like H is -0.4102 and -0.0410 Å
    "CH2N2_420042": "Cs",  # cyanamide with pyramidal NH2; C2v only on average
    "CH3NO_75127": "Cs",  # a planar formamide, named C1
    "CH4N2O_57136": "C2",  # urea with pyramidal NH2
    "CNZn_73963981": "C∞v",  # the file says Cs of a linear geometry
    "H2Zn_14018827": "D∞h",  # the file says C2v of a linear geometry
    "N2O2_57932566": "C2v",  # the file says C2 of a planar geometry
}


@pytest.mark.oracle
def test_groups_of_cccbdb(shared: Path):
    with gzip.open(shared / "reference/structures/geometry_and_constants.json.gz", "rt", encoding="utf-8") as handle:
        species = json.load(handle)
    differ = {}
    for key, component in species.items():
        rows = [line.split() for line in component["xyz"].splitlines()]
        symbols = [row[0] for row in rows]
        computed = find_symmetry(symbols, masses(symbols), [[float(x) for x in row[1:4]] for row in rows])
        if computed.point_group != component["point_group"]:
            differ[key] = computed.point_group
    assert len(species) == 339
    assert differ == CCCBDB_DIFFERS
