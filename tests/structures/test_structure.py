"""Structures: exact ones come back from rigid moments; published ones from measured constants."""

from __future__ import annotations

import importlib.util
import sys
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ocs_species import OCS_SPECIES
from places import PROJECT

import rotor
from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.point_group import molecule_symmetry
from rotor.statistics.least_squares import minimise
from rotor.structures.consistency import doubts, gains, moments_across_planes, without_each
from rotor.structures.coordinates import bonds_and_angles, moved_to, named, symmetric_displacements, symmetric_geometry
from rotor.structures.family import family
from rotor.structures.kraitchman import kraitchman, planar_moments
from rotor.structures.least_squares import STUDENT, fit_structure
from rotor.structures.substitution import substitution_structure
from rotor.tops.top import Top
from rotor.units import ROTATIONAL_MHZ_U_ANGSTROM2

OCS = Molecule(("O", "C", "S"), [[0, 0, 1.16], [0, 0, 0], [0, 0, -1.56]])


def rigid_family(molecule, substitutions, start=None, **keywords):
    """A family with the exact moments of a rigid molecule."""
    measured = []
    for isotopes in substitutions:
        changed = molecule.with_isotopes(isotopes) if isotopes else molecule
        top = Top.from_molecule(changed)
        constants = {n: v for n, v in zip("ABC", top.rotational_constants_mhz, strict=True) if np.isfinite(v)}
        measured.append((isotopes or "parent", isotopes, constants, {}))
    return family(start or molecule, measured, **keywords)


# Kraitchman


@given(seed=st.integers(0, 2**31))
def test_a_rigid_asymmetric_body_gives_the_place_of_every_atom_exactly(seed):
    rng = np.random.default_rng(seed)
    masses, places = rng.uniform(1, 20, 6), rng.normal(size=(6, 3)) * [2.0, 1.2, 0.7]
    moments, axes = moments_of(masses, places)
    coordinates = (places - masses @ places / masses.sum()) @ axes
    atom = int(rng.integers(6))
    heavier = masses.copy()
    heavier[atom] += 1.0
    substitution = kraitchman(moments, moments_of(heavier, places)[0], mass_u=masses.sum(), change_u=1.0)
    gap = np.diff(np.sort(planar_moments(moments))).min() / moments.max()
    assert substitution.squares_angstrom2 == pytest.approx(
        coordinates[atom] ** 2, abs=1e-12 / max(gap, 1e-6)
    )  # round-off over the gap


def moments_of(masses, places):
    r = places - masses @ places / masses.sum()
    tensor = np.eye(3) * (masses @ (r * r).sum(axis=1)) - (masses[:, None] * r).T @ r
    values, vectors = np.linalg.eigh(tensor)
    return values, vectors


def test_a_lighter_isotope_serves_as_well():
    masses, places = (
        np.array([12.0, 16, 2, 1]),
        np.array([[0, 0, 0], [1.2, 0.1, 0], [-0.6, 0.9, 0.2], [-0.6, -0.9, 0.1]]),
    )
    lighter = masses - [0, 0, 1, 0]
    parent, axes = moments_of(masses, places)
    substitution = kraitchman(parent, moments_of(lighter, places)[0], mass_u=masses.sum(), change_u=-1.0)
    coordinates = (places - masses @ places / masses.sum()) @ axes
    assert substitution.coordinates_angstrom == pytest.approx(np.abs(coordinates[2]), rel=1e-9)  # round-off


@pytest.mark.parametrize("pair", ["ab", "ac", "bc"])
def test_a_planar_molecule_by_each_pair_of_moments(pair):
    formaldehyde = rotor.read("H2CO").molecule
    parent, other = (Top.from_molecule(m) for m in (formaldehyde, formaldehyde.with_isotopes("3=2H")))
    place = (formaldehyde.positions_angstrom[2] - parent.frame.centre) @ parent.frame.axes.T
    change = formaldehyde.with_isotopes("3=2H").mass_u - formaldehyde.mass_u
    substitution = kraitchman(
        parent.moments_u_angstrom2, other.moments_u_angstrom2, mass_u=formaldehyde.mass_u, change_u=change,
        shape="planar", pair=pair,
    )  # fmt: skip
    assert substitution.coordinates_angstrom == pytest.approx(np.abs(place), abs=1e-9)  # round-off


@pytest.mark.parametrize(
    ("name", "isotopes"), [("CH3CN", "2=13C"), ("CH3CN", "4=2H"), ("NH3", "2=2H"), ("C6H6", "1=13C")]
)
def test_symmetric_tops_on_and_off_the_axis(name, isotopes):
    molecule = rotor.read(name).molecule
    atom = int(isotopes.split("=")[0]) - 1
    structure = substitution_structure(rigid_family(molecule, ["", isotopes])).atoms[0]
    top = Top.from_molecule(molecule)
    place = (molecule.positions_angstrom[atom] - top.frame.centre) @ top.frame.axes.T
    along = 0 if top.kind == "prolate" else 2
    ours, theirs = structure.coordinates_angstrom, place
    assert abs(ours[along]) == pytest.approx(
        abs(theirs[along]), abs=2e-5
    )  # geometries of files are symmetric to 1e-5 Å
    across = [np.sqrt(place @ place - place[along] ** 2) for place in (ours, theirs)]  # axes across are free to turn
    assert across[0] == pytest.approx(across[1], abs=2e-5)


def test_an_imaginary_coordinate_is_reported_not_hidden():
    substitution = kraitchman([10.0, 20.0, 30.2], [10.11, 20.1, 30.5], mass_u=30.0, change_u=1.0)
    assert substitution.imaginary[2]
    assert substitution.coordinates_angstrom[2] == 0.0
    assert substitution.squares_angstrom2[2] < 0


def test_errors_of_moments_are_carried_and_costains_rule_added():
    exact = {"mass_u": 60.0, "change_u": 1.0, "shape": "linear"}
    plain = kraitchman([0, 83.0, 83.0], [0, 84.0, 84.0], **exact)
    z2 = 1.0 / (60.0 / 61.0)
    assert plain.squares_angstrom2[0] == pytest.approx(z2, rel=1e-12)  # round-off
    assert plain.costain_angstrom[0] == pytest.approx(0.0015 / np.sqrt(z2), rel=1e-12)
    with_errors = kraitchman(
        [0, 83.0, np.nan], [0, 84.0, np.nan], parent_errors=[0, 0.01, 0], substituted_errors=[0, 0.02, 0], **exact
    )
    expected = np.hypot(0.01, 0.02) * 61 / 60 / (2 * np.sqrt(z2))
    assert with_errors.measured_angstrom[0] == pytest.approx(expected, rel=1e-6)  # differences


@pytest.mark.parametrize(
    ("change", "message"),
    [({"shape": "bent"}, "shape 'bent'"), ({"pair": "ba", "shape": "planar"}, "pair 'ba'"), ({"change_u": 0.0}, "other than 0"),
     ({"mass_u": -1.0}, "a mass above 0")],
)  # fmt: skip
def test_impossible_requests_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        kraitchman([1.0, 2.0, 3.0], [1.1, 2.1, 3.1], **{"mass_u": 10.0, "change_u": 1.0, **change})
    with pytest.raises(ValueError, match="need A, B, C of both"):
        kraitchman([1.0, np.nan, 3.0], [1.1, 2.1, 3.1], mass_u=10.0, change_u=1.0)


# Coordinates and symmetry


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("OCS", 2),
        ("CO2", 1),
        ("CH3CN", 4),
        ("C6H6", 2),
        ("NH3", 2),
        ("H2CO", 3),
        ("HCONH2", 9),
        ("CH4", 1),
        ("CH3CHCH2O", 24),
    ],
)
def test_there_are_as_many_symmetric_displacements_as_totally_symmetric_vibrations(name, count):
    molecule = rotor.read(name).molecule
    assert symmetric_displacements(molecule).shape == (3 * len(molecule.symbols), count)


def test_a_linear_molecule_with_an_atom_at_its_centre_has_equal_bonds():
    bent = Molecule(("O", "C", "O"), [[0, 0, 1.16004], [0, 0, 0], [0, 0, -1.16]])
    heights = symmetric_geometry(bent).positions_angstrom[:, 2]
    assert heights[0] - heights[1] == pytest.approx(heights[1] - heights[2], abs=1e-14)  # round-off
    assert heights[0] - heights[2] == pytest.approx(2.32004, abs=1e-14)


def test_coordinates_are_set_without_loss_of_symmetry():
    molecule = symmetric_geometry(rotor.read("CH3CN").molecule)
    space, coordinates = symmetric_displacements(molecule), bonds_and_angles(molecule)[:4]
    changes = np.array([0.02, -0.01, 0.005, 1.5])
    targets = changes + [coordinate.value(molecule.positions_angstrom) for coordinate in coordinates]
    moved = moved_to(molecule.positions_angstrom, space, coordinates, targets)
    assert [coordinate.value(moved) for coordinate in coordinates] == pytest.approx(
        targets, abs=1e-10
    )  # Newton's method to round-off
    assert molecule_symmetry(Molecule(molecule.symbols, moved), 1e-8).point_group == "C3v"


def test_contradictions_and_nonsense_are_refused():
    water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]])
    with pytest.raises(ValueError, match="atoms 1 to 3"):
        named(water, "OX", [1, 4])
    with pytest.raises(ValueError, match=r"2 \(distance\), 3"):
        named(water, "O", [1])
    with pytest.raises(ValueError, match="a straight angle cannot be fitted"):
        named(OCS, "OCS", [1, 2, 3])
    sides = [named(water, "r", [1, 2]), named(water, "d", [2, 3])]
    with pytest.raises(ValueError, match="no symmetric geometry"):
        moved_to(water.positions_angstrom, symmetric_displacements(water), sides, np.array([0.5, 1.5]))


# Families


@pytest.mark.parametrize("method", ["r0", "rs"])
@pytest.mark.parametrize(
    ("name", "substitutions"),
    [
        ("H2CO", ["", "1=18O", "2=13C", "3=2H", "H=2H", "1=18O,3=2H"]),
        ("CH3CN", ["", "1=13C", "2=13C", "3=15N", "4=2H"]),
        ("SO2", ["", "1=18O", "2=18O", "3=34S", "1=34S", "2=34S"]),
    ],
)
def test_an_exact_structure_comes_back_from_rigid_moments(name, substitutions, method):
    molecule = rotor.read(name).molecule
    usable = []
    for text in substitutions:
        try:
            usable += [text] if not text or molecule.with_isotopes(text) else []
        except ValueError:  # the sulfur of SO2 stands where the file has it
            continue
    start = Molecule(molecule.symbols, molecule.positions_angstrom * 1.02)
    together = rigid_family(molecule, usable, start)
    computed = fit_structure(together, "r0", leave_out=()) if method == "r0" else substitution_structure(together)
    true = {coordinate.name: coordinate.value(molecule.positions_angstrom) for coordinate in bonds_and_angles(molecule)}
    assert computed.values
    for value in computed.values:
        assert value.value == pytest.approx(
            true[value.name], rel=2e-6
        )  # moments to the 1e-6 of equal ones, geometry to 1e-4 of symmetry


def test_axes_are_matched_by_overlap_where_they_change_places():
    """Heavy isotopes on one side of a nearly symmetric rotor exchange a and b; the fit must not notice."""
    molecule = rotor.read("SO2").molecule
    swapped = [
        isotopes
        for isotopes in ("", "1=18O", "2=18O", "3=18O", "1=34S")
        if not isotopes or molecule.symbols[int(isotopes[0]) - 1] in isotopes
    ]
    together = rigid_family(molecule, swapped)
    assert fit_structure(together, "r0").rms_u_angstrom2 < 1e-5  # of moments of 50 u Å²
    water = rotor.read("H2O").molecule
    hydrogen = 1 + water.symbols.index("H")
    both = rigid_family(water, ["", f"{hydrogen}=2H", "H=2H"])
    assert fit_structure(both, "r0").rms_u_angstrom2 < 1e-6


def test_vibrational_terms_are_recovered_when_they_are_there():
    """Moments made with I + c √I come back as r_m⁽¹⁾ exactly, and as r_0 with an error that shows it."""
    water = rotor.read("H2O").molecule
    hydrogen, oxygen = 1 + water.symbols.index("H"), 1 + water.symbols.index("O")
    measured = []
    for isotopes in ("", f"{hydrogen}=2H", "H=2H", f"{oxygen}=18O", f"{oxygen}=17O"):
        top = Top.from_molecule(water.with_isotopes(isotopes) if isotopes else water)
        moments = np.array(top.moments_u_angstrom2)
        changed = moments + np.array([0.01, 0.02, 0.03]) * np.sqrt(moments)
        measured.append(
            (isotopes or "H2O", isotopes, dict(zip("ABC", ROTATIONAL_MHZ_U_ANGSTROM2 / changed, strict=True)), {})
        )
    together = family(water, measured)
    structure = fit_structure(together, "rm1")
    assert [correction.value for correction in structure.vibrational] == pytest.approx(
        [0.01, 0.02, 0.03], abs=2e-3
    )  # c against r are 0.99 correlated
    assert structure.rms_u_angstrom2 < 0.05 * fit_structure(together, "r0").rms_u_angstrom2
    true = {coordinate.name: coordinate.value(water.positions_angstrom) for coordinate in bonds_and_angles(water)}
    for value in structure.values:
        assert value.value == pytest.approx(true[value.name], rel=2e-3)


def test_the_rm_structure_of_a_diatomic_is_the_closed_form():
    """I = μ r² + c √(μ r²) is linear in r² and c r: a straight line of I/√μ against √μ through three B_0 = B_e - α/2, α ~ μ^(-3/2)."""
    rod = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.1283]])
    constants = {}
    for name in ("", "C=13C", "O=18O"):
        changed = rod.with_isotopes(name) if name else rod
        equilibrium = ROTATIONAL_MHZ_U_ANGSTROM2 / Top.from_molecule(changed).moments_u_angstrom2[2]
        constants[name] = equilibrium - 0.5 * 0.009 * equilibrium**1.5 / 57898.0**0.5
    together = family(rod, [(name or "CO", name, {"B": b}, {}) for name, b in constants.items()])
    mu = np.array(
        [np.prod(component.molecule.masses_u) / component.molecule.masses_u.sum() for component in together.species]
    )
    moments = np.array([component.moments[1] for component in together.species])
    slope, offset = np.linalg.lstsq(np.stack([mu, np.sqrt(mu)], axis=1), moments)[0]
    structure = fit_structure(together, "rm1")
    assert structure.values[0].value == pytest.approx(np.sqrt(slope), abs=1e-9)  # digits of the constants
    assert structure.vibrational[0].value == pytest.approx(offset / np.sqrt(slope), abs=1e-8)  # the same
    assert structure.values[0].value == pytest.approx(
        1.12832, abs=3e-4
    )  # r_e of CO; r_m of a diatomic leaves out higher terms
    assert any("1 degree of freedom" in text for text in structure.notes)
    wide = fit_structure(together, "rm2")  # d has the same mass factor as c √I: no isotopologue tells them apart
    assert set(wide.undetermined[0].names) == {"c_b", "d_b"}


def test_the_rm2_terms_of_a_linear_molecule_come_back():
    """Moments made with I + c √I + d (m₁ m₂ m₃/M)^(1/4): every number returns, since nothing is left to misfit."""
    chain = Molecule(("O", "C", "S"), [[0, 0, 1.1562], [0, 0, 0], [0, 0, -1.5614]])
    measured = []
    for isotopes in ("", "C=13C", "S=34S", "O=18O", "S=33S", "O=17O", "C=13C,O=18O", "C=13C,S=34S"):
        changed = chain.with_isotopes(isotopes) if isotopes else chain
        rigid = Top.from_molecule(changed).moments_u_angstrom2[2]
        masses = changed.masses_u
        moment = rigid + 0.02 * np.sqrt(rigid) + 0.03 * (np.prod(masses) / masses.sum()) ** 0.25
        measured.append((isotopes or "OCS", isotopes, {"B": ROTATIONAL_MHZ_U_ANGSTROM2 / moment}, {}))
    structure = fit_structure(family(chain, measured), "rm2")
    lengths = sorted(value.value for value in structure.values)
    assert lengths == pytest.approx([1.1562, 1.5614], abs=1e-5)  # 1e-9 of the moments times the condition
    assert [correction.value for correction in structure.vibrational] == pytest.approx(
        [0.02, 0.03], abs=2e-4
    )  # the same


def test_few_degrees_of_freedom_have_the_t_of_student():
    from scipy.special import stdtrit

    for free, factor in STUDENT.items():
        assert factor == pytest.approx(stdtrit(free, (1 + 0.682689) / 2), abs=0.005)  # two decimals


def test_a_constant_that_the_geometry_cannot_have_is_refused():
    rod = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.13]])
    for second, words in (
        (551010.1, "13CO: B = 551010 MHz, where the geometry and the parent give about 55"),
        (57.6, r"13CO: B = 57\.6"),
    ):
        with pytest.raises(ValueError, match=words):
            family(rod, [("CO", "", {"B": 57635.968}, {}), ("13CO", "C=13C", {"B": second}, {})])
    with pytest.raises(ValueError, match=r"CO: B = 57\.636 MHz, where the geometry gives about"):
        family(rod, [("CO", "", {"B": 57.636}, {})])


def test_semi_experimental_structures_use_the_corrections():
    """Constants less a correction and the correction together are the equilibrium."""
    shifted = [
        (name, isotopes, {"B": constants["B"] - 20.0}, errors) for name, isotopes, constants, errors in OCS_SPECIES
    ]
    plain = fit_structure(family(OCS, OCS_SPECIES), "r0")
    structure = fit_structure(family(OCS, shifted, corrections_mhz=[{"B": 20.0}] * 4), "re")
    assert [v.value for v in structure.values] == pytest.approx(
        [v.value for v in plain.values], rel=1e-9
    )  # the same moments
    with pytest.raises(ValueError, match="no constant has a correction"):
        fit_structure(family(OCS, OCS_SPECIES), "re")


def test_errors_weigh_and_hold_and_leave_out():
    together = family(OCS, OCS_SPECIES)
    weighted = fit_structure(together, "r0", weights="errors")
    equal = fit_structure(together, "r0")
    assert weighted.values[0].value != equal.values[0].value
    held = fit_structure(together, "r0", coordinates=[named(OCS, "CO", [1, 2])], held=[named(OCS, "CS", [2, 3])])
    assert next(v.value for v in held.values if v.name == "CS") == pytest.approx(1.56, abs=1e-9)  # Newton's method
    with pytest.raises(ValueError, match="both fitted and held"):
        fit_structure(together, "r0", coordinates=[named(OCS, "CO", [1, 2])], held=[named(OCS, "x", [2, 1])])
    with pytest.raises(ValueError, match="unknowns for"):
        fit_structure(family(OCS, OCS_SPECIES[:1]), "r0")
    with pytest.raises(ValueError, match="method 'rg'"):
        fit_structure(together, "rg")
    with pytest.raises(ValueError, match="leave_out: axes d"):
        fit_structure(together, "r0", leave_out=["d"])


@pytest.mark.parametrize(
    ("measured", "message"),
    [
        ([], "a family without isotopologues"),
        ([("x", "C=13C", {"B": 1.0}, {})], "the first isotopologue is the parent"),
        ([("x", "", {"D": 1.0}, {})], "D; expected at least one of A, B, C"),
        ([("x", "", {"B": -1.0}, {})], "a rotational constant is above 0"),
        ([("x", "", {"B": 1.0}, {"A": 1.0})], "error of A, but no such constant"),
        (
            [("x", "", {"B": 1.0}, {}), ("y", "C=13C", {"B": 1.0}, {}), ("z", "2=13C", {"B": 1.0}, {})],
            "have the same isotopes",
        ),
    ],
)
def test_impossible_families_are_refused(measured, message):
    with pytest.raises(ValueError, match=message):
        family(OCS, measured)


# Published structures


def test_the_substitution_structure_of_ocs():
    structure = substitution_structure(family(OCS, OCS_SPECIES))
    assert all(atom.zero_by_symmetry == (False, True, True) for atom in structure.atoms)
    values = {value.name: value for value in structure.values}
    assert values["r(O1-C2)"].value == pytest.approx(1.16054, abs=1e-5)  # digits as published
    assert values["r(C2-S3)"].value == pytest.approx(1.55967, abs=1e-5)
    assert 0.001 < values["r(O1-C2)"].error < 0.005  # Costain's rule


@pytest.fixture(scope="module")
def make():
    """docs/make_published_structures.py, whose page says what is tested here."""
    path = PROJECT / "docs" / "make_published_structures.py"
    spec = importlib.util.spec_from_file_location("make_published_structures", path)
    module = sys.modules["make_published_structures"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.oracle
def test_published_substitution_structures(shared, make):
    """Every coordinate of 16 molecules is met, 7 plainly and 9 as the page explains; of one they are no r_s."""
    plainly = set()
    sets = make.published(shared)
    assert len(sets) == 17  # of 22 molecules in the file the others have no published coordinates
    for name, (mass, parent, atoms) in sets.items():
        reading = make.READINGS.get(name, make.Reading())
        if reading == make.Reading():
            plainly.add(name)
        good = make.met(mass, parent, atoms, reading)
        assert all(good) != reading.computed, name
        if reading != make.Reading() and not reading.computed:
            assert not all(make.met(mass, parent, atoms, make.Reading())), name  # the explanation is needed
    assert len(plainly) == 7


@pytest.mark.oracle
@pytest.mark.parametrize("name", ["OCS", "HC3N"])
def test_bonds_from_measured_lines_without_a_typed_constant(shared, make, name):
    together, fits = make.of_lines(name, shared)
    bonds = [value.value for value in substitution_structure(together).values if len(value.atoms) == 2]
    assert all(fit.converged for fit in fits.values())
    digits = {"OCS": 1.5e-5, "HC3N": 1e-4}[name]  # one unit of the last digit published, r(CS) being 1.55967
    assert bonds == pytest.approx(make.PUBLISHED_RS[name], abs=digits)


def test_a_semi_experimental_structure_meets_the_published_one(make):
    """Maleic anhydride: constants, corrections and r_e of one publication."""
    computed = {value.atoms: value for value in make.maleic_anhydride().values}
    for atoms, theirs in make.PUBLISHED_RE.items():
        assert abs(computed[atoms].value - theirs) < 1.5 * computed[atoms].error, atoms
        assert computed[atoms].error < (1e-3 if len(atoms) == 2 else 0.1)


@pytest.mark.parametrize("method", ["r0", "rm1", "rm2"])
def test_derivatives_of_moments_are_those_of_differences(method):
    from rotor.structures.least_squares import _Problem

    water = rotor.read("H2O").molecule
    hydrogen = 1 + water.symbols.index("H")
    together = rigid_family(water, ["", f"{hydrogen}=2H", "H=2H", "O=18O"])
    problem = _Problem.from_family(together, method, (), (), "equal", ())
    at = np.concatenate([[0.01, -0.02], np.full(problem.count - 2, 0.3)])
    _, jacobian = problem.model(at)
    for i, step in enumerate(1e-5 * np.eye(problem.count)):
        difference = (problem.model(at + step)[0] - problem.model(at - step)[0]) / 2e-5
        assert jacobian[:, i] == pytest.approx(difference, abs=1e-7)  # third derivatives and round-off at this step


def test_an_atom_that_would_leave_the_molecule_ends_a_fit():
    """More than 1 Å from the start is another molecule; 0.5 Å is a step."""
    from rotor.structures.least_squares import _Problem

    water = rotor.read("H2O").molecule
    problem = _Problem.from_family(rigid_family(water, ["", "O=18O"]), "r0", (), (), "equal", ())
    direction = np.eye(problem.count)[0]
    largest = np.abs(problem.positions(direction * 1e-3) - water.positions_angstrom).max() / 1e-3
    assert np.isfinite(problem.positions(direction * 0.9 / largest)).all()
    with pytest.raises(ValueError, match="more than 1 Å from the start geometry"):
        problem.positions(direction * 1.1 / largest)


CHAIN = Molecule(
    ("O", "C", "C", "C", "H", "H"),
    [[2.26, -0.62, 0], [1.19, -0.07, 0], [-0.03, -0.86, 0], [-1.04, -1.51, 0], [-1.93, -2.085, 0], [1.125, 1.04, 0]],
)


def chain(wrong: str = "", shift_mhz: float = 0.0):
    """A planar chain of four heavy atoms, I + c √I as vibration, with one B that is off."""
    measured = []
    for isotopes in ("", "2=13C", "3=13C", "4=13C", "1=18O", "6=2H"):
        changed = CHAIN.with_isotopes(isotopes) if isotopes else CHAIN
        rigid = rotor.Top.from_molecule(changed).constants
        moments = ROTATIONAL_MHZ_U_ANGSTROM2 / np.array([rigid[name] for name in "ABC"])
        values = ROTATIONAL_MHZ_U_ANGSTROM2 / (moments + np.array([0.012, 0.018, 0.032]) * np.sqrt(moments))
        values[1] += shift_mhz if isotopes == wrong else 0.0
        measured.append((isotopes or "parent", isotopes, dict(zip("ABC", values.tolist(), strict=True)), {}))
    return family(CHAIN, measured)


def test_a_wrong_constant_of_an_isotopologue_in_a_plane_is_called_doubtful():
    assert not doubts(chain())
    assert {(difference.species, difference.axis) for difference in moments_across_planes(chain())} == {
        (name, "c") for name in ("2=13C", "3=13C", "4=13C", "1=18O", "6=2H")
    }
    for name, shift in (("3=13C", 1.0), ("4=13C", -10.0), ("1=18O", 1.0)):
        said = doubts(chain(name, shift))
        assert len(said) == 1
        assert said[0].startswith(f"{name}: P_c")
    assert len(doubts(chain("", 1.0))) >= 4  # of the parent: all the others differ from it


@pytest.mark.slow
def test_the_isotopologue_that_is_unlike_the_others_is_found():
    """Of the r_m fit, which has the vibration of this family exactly: without the wrong one nothing is left."""
    whole = chain("3=13C", 1.0)
    computed = without_each(whole, fit_structure(whole, "rm1"), partial(fit_structure, method="rm1"))
    assert computed[0].species == "3=13C"
    assert computed[0].rms_u_angstrom2 < 1e-6  # round-off of the constants
    assert computed[0].chance < 1e-6
    assert all(entry.chance > 0.1 for entry in computed[1:])
    assert "without 3=13C" in gains("rm1", computed, 0.003)[0]
    assert not gains("rm1", computed[1:], 0.003)


def test_measured_families_have_no_false_alarm():
    """Of maleic anhydride the published constants: its planar moments change by 0.0024 along c and by 0.017 along a."""
    from rotor.formats.fits.family_file import read_family

    file = read_family(PROJECT / "examples" / "maleic_anhydride.toml")
    assert len(moments_across_planes(file.family)) >= 9
    assert not doubts(file.family)


# Symmetry in substitution structures

METHANAL = Molecule(
    ("O", "C", "H", "H"),
    [
        [0, 0, 1.2072],
        [0, 0, 0],
        *([0, sign * 1.1039 * np.sin(np.radians(121.77)), 1.1039 * np.cos(np.radians(121.77))] for sign in (1, -1)),
    ],
)
PYRAMID = Molecule(
    ("N", "H", "H", "H"),
    [[0, 0, 0.1], *([0.94 * np.cos(t), 0.94 * np.sin(t), -0.27] for t in np.radians([0, 120, 240]))],
)
METHANE = Molecule(
    ("C", "H", "H", "H", "H"),
    [[0, 0, 0], *(0.63 * np.array(p) for p in ([1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]))],
)


def shaken_family(molecule, substitutions, part=1e-4, seed=5):
    """Rigid moments, each constant changed by about `part` of itself, as vibration does."""
    rigid, rng = rigid_family(molecule, substitutions), np.random.default_rng(seed)
    measured = []
    for component, isotopes in zip(rigid.species, substitutions, strict=True):
        shaken = {name: value * (1 + part * rng.normal()) for name, value in component.constants_mhz.items()}
        if len(set(np.round(list(component.constants_mhz.values()), 3))) < 3:  # equal constants stay equal
            factor = 1 + part * rng.normal()
            shaken = {name: value * factor for name, value in component.constants_mhz.items()}
        measured.append((component.name, isotopes, shaken, {}))
    return family(molecule, measured)


@pytest.mark.parametrize("seed", range(4))
def test_atoms_on_an_axis_stay_there(seed):
    """H2CO: O and C have b = 0 without an error, angles add up to 360 degrees, r(CH) has the 0.0020 Å of Costain's rule."""
    structure = substitution_structure(shaken_family(METHANAL, ["", "1=18O", "2=13C", "3=2H"], seed=seed))
    values = {value.name: value for value in structure.values}
    assert np.array_equal(structure.positions_angstrom[:2, 1:], np.zeros((2, 2)))
    assert np.array_equal(structure.errors_angstrom[:2, 1:], np.zeros((2, 2)))
    angles = 2 * values["a(O1-C2-H3)"].value + values["a(H3-C2-H4)"].value
    assert angles == pytest.approx(360, abs=1e-10)  # round-off
    assert 2 * values["a(O1-C2-H3)"].error == pytest.approx(values["a(H3-C2-H4)"].error, rel=1e-9)  # one move of both H
    assert values["r(C2-H3)"].error == pytest.approx(0.0020, abs=1e-4)  # 0.0015 Å²/|r| of a_C, a_H and b_H
    assert abs(values["r(C2-H3)"].value - 1.1039) < 0.0020
    assert abs(values["a(O1-C2-H3)"].value - 121.77) < values["a(O1-C2-H3)"].error
    assert not [note for note in structure.notes if "b²" in note or "|b|" in note]


def test_the_centre_of_a_linear_molecule_has_no_error():
    dioxide = Molecule(("O", "C", "O"), [[0, 0, 1.16], [0, 0, 0], [0, 0, -1.16]])
    structure = substitution_structure(shaken_family(dioxide, ["", "2=13C", "1=18O"]))
    (bond,) = structure.values
    assert not structure.positions_angstrom[1].any()
    assert not structure.errors_angstrom[1].any()
    assert bond.error == pytest.approx(0.0015 / 1.16, rel=0.01)  # Costain's rule of O alone; vibration moves r by 1e-4
    assert abs(bond.value - 1.16) < bond.error
    assert not structure.notes


def test_errors_across_the_axis_of_a_symmetric_top_lie_along_the_distance():
    """NH3: δρ = K/ρ in the direction of H, not K/|b| and K/|c| of its two components, one of which may be 0."""
    exact = substitution_structure(rigid_family(PYRAMID, ["", "1=15N", "2=2H"]))
    computed = {atom.atom: atom for atom in exact.atoms}[2]
    assert np.linalg.norm(computed.errors_angstrom[:2]) == pytest.approx(
        0.0015 / 0.94, rel=1e-3
    )  # ρ from rigid moments
    bond = next(value for value in exact.values if len(value.atoms) == 2)
    assert bond.value == pytest.approx(np.hypot(0.94, 0.37), abs=1e-6)  # round-off over gaps
    n, h = (np.abs(atom.coordinates_angstrom[2]) for atom in exact.atoms)
    along = 0.37 / bond.value * np.hypot(0.0015 / n, 0.0015 / h)
    assert bond.error == pytest.approx(np.hypot(along, 0.94 / bond.value * 0.0015 / 0.94), rel=1e-3)
    assert not exact.atoms[0].errors_angstrom[:2].any()  # N is on the axis


@pytest.mark.parametrize("constants", [None, ("B",)])
def test_a_spherical_parent(constants):
    """CH4: the distance from the centre from the moments across it, C in the centre; tetrahedral angles have no error."""
    methane = rigid_family(METHANE, ["", "2=2H", "1=13C"])
    if constants:
        keep = [constants, "BC", "BC"]
        rows = [
            (component.name, isotopes, {name: component.constants_mhz[name] for name in names}, {})
            for component, isotopes, names in zip(methane.species, ("", "2=2H", "1=13C"), keep, strict=True)
        ]
        methane = family(METHANE, rows)
    structure = substitution_structure(methane)
    bond, angle = structure.values
    assert bond.value == pytest.approx(0.63 * np.sqrt(3), rel=1e-9)  # round-off
    assert bond.error == pytest.approx(0.0015 / bond.value, rel=1e-9)
    assert angle.value == pytest.approx(np.degrees(np.arccos(-1 / 3)), abs=1e-9)
    assert angle.error < 1e-9
    assert np.isfinite(structure.errors_angstrom).all()
    with pytest.raises(ValueError, match="shape 'spherical' need"):  # of a lighter one I_a and I_b are across
        kraitchman([10.0] * 3, [np.nan, np.nan, 10.0], mass_u=18.0, change_u=-1.0, shape="spherical")
    lighter = rigid_family(METHANE.with_isotopes("2=2H,3=2H,4=2H,5=2H"), ["", "2=1H"])
    assert substitution_structure(lighter).atoms[0].kraitchman.coordinates_angstrom[0] == pytest.approx(
        bond.value, rel=1e-9
    )


@pytest.mark.parametrize("b_mhz", [32191.200, 34191.200])
def test_formaldehyde_from_published_constants(call, folder, b_mhz):
    """H2(13)CO as in its abstract (Müller et al. 2000, S reduction), H2CO of the library, HD(13)CO of CDMS's page of its entry.

    The B of entry e032507 as it stands there, 32191.200 MHz, is that of no planar molecule and called doubtful; with one digit
    changed r(CH) = 1.1036(20) Å and HCH = 116.48(27) degrees, so that OCH is 121.76 degrees, as from other
    species, 1.1039(20) Å and 121.77 degrees.
    """
    atoms = [["O", 0, 0, 1.205], ["13C", 0, 0, 0], ["H", 0, 0.9429, -0.5876], ["H", 0, -0.9429, -0.5876]]
    (folder / "h2co.toml").write_text(
        f'name = "H2[13C]O"\n[geometry]\natoms = {atoms}\n'
        '[[isotopologue]]\nconstants = "A=281993.0397(31) B=37809.106966(213) C=33215.941417(207) MHz"\n'
        f'[[isotopologue]]\nisotopes = "2=12C"\nconstants = "{" ".join(rotor.read("H2CO").constants.text().split()[:3])} MHz"\n'
        f'[[isotopologue]]\nisotopes = "3=2H"\nconstants = "A=197648.21 B={b_mhz} C=29035.860 MHz"\n'
    )
    code, out, err = call("structure", "h2co.toml", "--method", "rs")
    assert code == 0, err
    right = b_mhz > 34000
    assert ("doubtful" in out, "are its constants right?" in err) == (not right, not right)
    assert ("1.1036(20)" in out, "116.48(27)" in out) == (right, right)


def test_imaginary_coordinates_have_digits():
    structure = substitution_structure(shaken_family(OCS, ["", "C=13C"], part=0.0))
    assert not structure.notes
    small = Molecule(("O", "C", "S"), [[0, 0, 1.16], [0, 0, 0], [0, 0, -1.1601]])
    near = family(small, [("parent", "", {"B": 9000.0}, {}), ("13C", "C=13C", {"B": 9000.001}, {})])
    (note,) = substitution_structure(near).notes
    assert "imaginary coordinate, a² = -6.3e-06 Å²" in note


def test_the_command_prints_symmetric_families(call, folder):
    """A spherical parent ended in "cannot convert float NaN to integer"."""
    atoms = [[s, *p] for s, p in zip(METHANE.symbols, METHANE.positions_angstrom.tolist(), strict=True)]
    (folder / "ch4.toml").write_text(
        f'name = "CH4"\n[geometry]\natoms = {atoms}\n[[isotopologue]]\nconstants = "A=157000 B=157000 C=157000 MHz"\n'
        '[[isotopologue]]\nisotopes = "2=2H"\nconstants = "A=157000 B=117500 C=117500 MHz"\n'
    )
    code, out, err = call("structure", "ch4.toml", "--method", "rs,r0")
    assert code == 0, err
    assert "nan" not in (out + err).lower()
    assert "109.471 (by symmetry)" in out
    assert out.count("spherical") == 2


@pytest.mark.parametrize("sulphur", [False, True])
def test_a_structure_without_bonds_has_no_empty_table(call, folder, sulphur):
    """One substituted atom has a coordinate and no bond: the table `rs` of bonds and angles was an empty heading."""
    more = '[[isotopologue]]\nisotopes = "3=34S"\nconstants = "B=5932.83 MHz"\n' if sulphur else ""
    (folder / "ocs.toml").write_text(
        'name = "OCS"\n[geometry]\natoms = [["O", 0, 0, 1.16], ["C", 0, 0, 0], ["S", 0, 0, -1.56]]\n'
        '[[isotopologue]]\nconstants = "B=6081.49 MHz"\n'
        f'[[isotopologue]]\nisotopes = "2=13C"\nconstants = "B=6061.92 MHz"\n{more}'
    )
    code, out, err = call("structure", "ocs.toml", "--method", "rs")
    assert (code, err) == (0, "")
    assert "rs: coordinates" in out
    assert ("rs" in out.splitlines()) == sulphur
    assert ("C2-S3" in out.replace(" ", "")) == sulphur


def test_the_bound_of_bond_lengths_holds_for_a_loose_search(monkeypatch):
    """Lengths of a search that ends early, within twice its next step of those of a full one; and what rounding can do is below it."""
    from rotor.structures import least_squares
    from rotor.structures.budgets import lengths_budget

    def fitted(tolerance):
        loose = lambda evaluate, start, **more: minimise(evaluate, start, **{**more, "tolerance": tolerance})  # noqa: E731
        monkeypatch.setattr(least_squares, "minimise", loose)
        return fit_structure(family(OCS, OCS_SPECIES), "r0")

    full, bounds = fitted(1e-13), []
    for tolerance in (1e3, 1e-1, 1e-3):
        computed = fitted(tolerance)
        pairs = zip(computed.values, full.values, strict=True)
        actual = max(abs(single.value - true.value) for single, true in pairs if single.unit == "Å")
        budget = lengths_budget("r0", computed.values, computed, "equal")
        assert actual <= budget.numerical
        bounds.append(budget.truncation.value)
    assert bounds[0] > bounds[-1]
    assert budget.data.value == max(value.error for value in computed.values if value.unit == "Å")


@pytest.mark.parametrize(
    ("isotopes", "said"),
    [
        ("C2=13C", ""),
        ("2=13C", ""),
        ("C1=13C", "atom C1 to substitute: atom 1 of COS is O"),
        ("C4=13C", "atom C4 to substitute: COS has atoms 1 to 3"),
        ("N=15N", "name an element of it or an atom, by number or as O1"),
    ],
)
def test_isotopes_by_the_atoms_that_the_answer_names(isotopes, said):
    """r(O1-C2) is in the answer, and C2=13C ended in "element 'C2' to substitute is not in COS"."""
    if said:
        with pytest.raises(ValueError, match=said):
            OCS.with_isotopes(isotopes)
    else:
        assert OCS.with_isotopes(isotopes).mass_numbers == (16, 13, 32)
    both = Molecule(("O", "C", "O"), [[0, 0, 1.16], [0, 0, 0], [0, 0, -1.16]])
    assert (
        both.with_isotopes("O1=17O,O=18O").mass_numbers
        == both.with_isotopes("O=18O,1=17O").mass_numbers
        == (17, 12, 18)
    )


def test_a_method_with_too_few_moments_leaves_the_others(call, folder):
    """--method rs,r0 with two unknowns for one moment ended without rs; --plot was refused with the name of --xyz."""
    text = (
        'name = "OCS"\n[geometry]\natoms = [["O", 0, 0, 1.16], ["C", 0, 0, 0], ["S", 0, 0, -1.56]]\n'
        '[[isotopologue]]\nconstants = "B=6081.492114(6) MHz"\n'
        '[[isotopologue]]\nisotopes = "C2=13C"\nconstants = "B=6061.92385(2) MHz"\n'
    )
    (folder / "ocs.toml").write_text(text)
    code, out, err = call("structure", "ocs.toml", "--method", "rs,rm1")
    assert code == 1
    assert "rs: coordinates" in out
    assert err.rstrip().endswith(
        "rm1: OCS: 3 unknowns for 2 moments; fit fewer coordinates and hold the others, or add isotopologues"
    )
    code, out, err = call("structure", "ocs.toml", "--method", "rm1")
    assert (code, out, err) == (
        2,
        "",
        "error: OCS: 3 unknowns for 2 moments; fit fewer coordinates and hold the others, or add isotopologues\n",
    )
    for option, name in (("--plot", "o.png"), ("--xyz", "o.xyz")):
        code, _, err = call("structure", "ocs.toml", "--method", "rs", option, name)
        assert code == 1
        assert f"error: {option}: rs has not every atom" in err
    (folder / "held.toml").write_text(text + "[held]\nCS = [2, 3]\n")  # was passed over without a word
    code, out, err = call("structure", "held.toml", "--method", "r0")
    assert (code, out, err) == (
        2,
        "",
        "error: CS is held, but no coordinate is named that is fitted; name those, too\n",
    )
    (folder / "held.toml").write_text(text + "[coordinates]\nCO = [1, 2]\n[held]\nCS = [2, 3]\n")
    code, out, err = call("structure", "held.toml", "--method", "rm1")
    assert code == 0, err


def test_an_atom_next_to_the_figure_axis_is_on_it():
    """0.0005 Angstrom off the axis is no distance that moments determine: the coordinate across it is 0."""
    from rotor.structures.substitution import _directions

    assert _directions("prolate", np.array([-1.2, 3e-4, -4e-4])).tolist() == [[-1, 0, 0], [0, 0, 0], [0, 0, 0]]
    off = _directions("oblate", np.array([0.3, -0.4, 1.0]))
    np.testing.assert_allclose(off, [[0, 0, 1], [0.6, -0.8, 0], [0, 0, 0]], atol=1e-15)
