"""The molecules of data/: geometry against constants, dipole on the right axis, constants against measured lines."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
from plain_watson import levels

from rotor.formats.library import library_molecule, names
from rotor.formats.molecule_file import MoleculeFile, read_molecule_file
from rotor.formats.spcat.cat import read_cat
from rotor.formats.spcat.fields import BLANK
from rotor.quantum.levels import solve_levels
from rotor.top import Top
from rotor.units import MHZ_PER_CM, ROTATIONAL_MHZ_U_ANGSTROM2

MOLECULES = [read_molecule_file(path) for path in sorted(set(names().values()))]
every = pytest.mark.parametrize("molecule", MOLECULES, ids=lambda molecule: molecule.name)


def moments(molecule: MoleculeFile) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments in u Å² and axes as columns, from Σ m (r² - r rᵀ)."""
    m, r = molecule.molecule.masses_u, molecule.molecule.positions_angstrom
    r = r - m @ r / m.sum()
    return np.linalg.eigh(np.eye(3) * (m @ (r**2).sum(axis=1)) - (m[:, None] * r).T @ r)


def test_the_library_has_its_eight_molecules():
    assert {"CO", "OCS", "HC3N", "CH4", "CH3CN", "H2O", "H2CO", "SO2"} <= names().keys()


@every
def test_every_table_says_where_it_is_from(molecule):
    tables = {"geometry", "constants", "dipole"} | ({"spin_weights"} if molecule.spin_weights.rule != "none" else set())
    assert tables <= molecule.sources.keys()
    assert all(len(molecule.sources[table]) > 5 for table in tables)


@every
def test_geometry_gives_the_constants_within_the_stated_difference(molecule):
    inertia, _ = moments(molecule)
    known = [c for c in molecule.constants.rigid if np.isfinite(c)]  # A of a linear molecule is infinite
    computed = ROTATIONAL_MHZ_U_ANGSTROM2 / inertia[3 - len(known) :]
    difference = np.abs(computed / known - 1).max()
    assert difference < molecule.vibrational_difference
    assert difference > molecule.vibrational_difference / 4  # the bound is a statement, not a blank cheque


@every
def test_geometry_has_the_symmetry_of_its_kind(molecule):
    a, b, c = moments(molecule)[0]
    kind = molecule.constants.kind
    if kind == "linear":
        assert a < 1e-12 * c  # round-off
    elif kind == "asymmetric":  # all of ours are planar: I_c = I_a + I_b
        assert a + b == pytest.approx(c, rel=1e-12)
        assert a < 0.99 * b < 0.99 * c
    else:
        assert b == pytest.approx(c, rel=1e-5)  # coordinates have six decimals
        assert (a == pytest.approx(b, rel=1e-5)) == (kind == "spherical")


@pytest.mark.parametrize(
    ("name", "axis"), [("H2O", 1), ("SO2", 1), ("H2CO", 0), ("CH3CN", 0), ("OCS", 0), ("CO", 0), ("HC3N", 0)]
)
def test_dipole_lies_on_the_symmetry_axis(name, axis):
    molecule = library_molecule(name)
    assert np.flatnonzero(molecule.dipole_abc_debye).tolist() == [axis]
    along = moments(molecule)[1][:, axis]
    assert np.abs(along).tolist() == pytest.approx([0, 0, 1], abs=1e-9)  # our files have the symmetry axis along z


def test_spin_weights_are_those_of_the_textbook():
    def weights(name: str) -> dict[str, int]:
        return library_molecule(name).spin_weights.to_mapping()

    assert weights("H2O") == {"ee": 1, "eo": 3, "oe": 3, "oo": 1}  # 1(01) is ortho
    assert weights("H2CO") == {"ee": 1, "eo": 1, "oe": 3, "oo": 3}
    assert weights("SO2") == {"ee": 1, "eo": 0, "oe": 0, "oo": 1}
    assert weights("CH3CN") == {"0": 2, "1": 1, "2": 1}
    assert weights("CH4") == {"A": 5, "E": 2, "F": 3}


def energy(molecule: MoleculeFile):
    """A function from quantum numbers to MHz, by closed forms or full matrices, each J computed once."""
    values, kind = molecule.constants.values, molecule.constants.kind
    done: dict[int, dict[tuple[int, int, int], float]] = {}

    def symmetric(j: int, k: int = 0) -> float:
        x, z = j * (j + 1), k * k
        names_of = {"linear": ("B", "D", "H", "L"), "prolate": ("B", "DJ", "HJ", "LJ")}[kind]
        total = sum((-1 if n == 2 else 1) * values.get(name, 0.0) * x**n for n, name in enumerate(names_of, start=1))
        mixed = {"DJK": (1, 1), "DK": (0, 2), "HJK": (2, 1), "HKJ": (1, 2), "HK": (0, 3), "LJJK": (3, 1)}
        mixed |= {"LJK": (2, 2), "LKKJ": (1, 3), "PJJK": (4, 1), "PJK": (3, 2)}
        total += sum((-1 if n[0] == "D" else 1) * values.get(n, 0.0) * x**p * z**q for n, (p, q) in mixed.items())
        return total + (values["A"] - values["B"]) * z if kind == "prolate" else total

    def asymmetric(j: int, ka: int, kc: int) -> float:
        if j not in done:
            done[j] = levels(values, j)
        return done[j][j, ka, kc]

    return asymmetric if kind == "asymmetric" else symmetric


def catalogue_lines(molecule: MoleculeFile, shared):
    """(frequency, error, upper, lower) of the ground state's lines in the stated range, and which are measured."""
    tag = molecule.catalogue
    found = read_cat(gzip.decompress((shared / "reference" / "catalogues" / f"{tag.tag}.cat.gz").read_bytes()))
    width = {"linear": 1, "prolate": 2, "asymmetric": 3}[molecule.constants.kind]
    for i in range(len(found)):
        quanta = [q[i].tolist() for q in (found.quanta_upper, found.quanta_lower)]
        excited = any(rest not in (0, BLANK) for q in quanta for rest in q[width:])
        j, k = (max(q[n] for q in quanta) for n in (0, 1))
        beyond = j > (tag.j_max or 99) or (tag.k_max is not None and k > tag.k_max)
        if not (excited or beyond):
            yield found.tag[i] < 0, found.frequency_mhz[i], found.error_mhz[i], *(tuple(q[:width]) for q in quanta)


@pytest.mark.oracle
@pytest.mark.parametrize("name", ["CO", "OCS", "HC3N", "CH3CN", "H2O", "H2CO", "SO2"])
def test_constants_meet_the_measured_lines_as_stated(name, shared):
    molecule = library_molecule(name)
    of = energy(molecule)
    off = [f - (of(*up) - of(*low)) for seen, f, _, up, low in catalogue_lines(molecule, shared) if seen]
    assert len(off) == molecule.catalogue.lines
    rms = float(np.sqrt(np.mean(np.square(off))))
    assert 0.85 * molecule.catalogue.rms_mhz < rms < molecule.catalogue.rms_mhz * 1.02  # stated with two digits


@pytest.mark.parametrize(("name", "jmax"), [("H2O", 12), ("SO2", 25), ("CH3CN", 20), ("OCS", 20)])
def test_package_and_plain_route_have_the_same_levels(name, jmax):
    molecule = library_molecule(name)
    of, found = energy(molecule), solve_levels(Top.from_constants(molecule.constants), jmax, vectors=False)
    width = {"linear": 1, "prolate": 2, "asymmetric": 3}[found.kind]
    quanta = np.stack([found.j, found.ka, found.kc], axis=1)[:, :width].tolist()
    plain = [of(*q) for q in quanta]
    assert len(quanta) >= jmax + 1
    assert found.energy_mhz == pytest.approx(plain, rel=1e-12, abs=1e-6)  # round-off of 1e8 MHz


@pytest.mark.oracle
def test_water_levels_beyond_the_fitted_range_are_off_by_what_the_file_says(shared):
    """Level energies (cm-1) of the catalogue, which is not made from these constants."""
    path = shared / "reference" / "catalogues" / "c018003.cat.gz"
    found = read_cat(gzip.decompress(path.read_bytes()))
    known = {
        tuple(q[:3]): float(e)
        for q, e in zip(found.quanta_lower.tolist(), found.energy_lower_cm, strict=True)
        if q[3] == 0
    }
    of = energy(library_molecule("H2O"))
    worst = {}
    for (j, ka, kc), e in known.items():
        if ka <= 5:
            worst[j] = max(worst.get(j, 0.0), abs(of(j, ka, kc) / MHZ_PER_CM - e))
    assert [round(worst[j], digits) for j, digits in ((12, 3), (15, 2), (20, 1))] == [0.004, 0.04, 0.9]
    ladder = [[of(j, ka, j - ka) for ka in range(j + 1)] for j in range(26)]
    assert all((np.diff(energies) > 0).all() for energies in ladder)  # no fold: the decic constants see to it
