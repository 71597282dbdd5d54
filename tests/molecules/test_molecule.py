"""The molecule itself: what it refuses, isotopes, and everything that turns along."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rotor.molecules.molecule import Molecule
from rotor.units import DEBYE_PER_E_ANGSTROM

WATER = [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]]


def water(**fields):
    return Molecule(("O", "H", "H"), WATER, **fields)


def turn(vector):
    """Rotation matrix of a rotation vector, by Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = np.asarray(vector) / (angle or 1)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.mark.parametrize(
    ("symbols", "positions", "message"),
    [
        ((), np.zeros((0, 3)), "without atoms"),
        (("O", "H"), [[0, 0, 0], [0, 0, np.nan]], "atom 2: .* not finite"),
        (("O", "H"), [[0, 0, 0], [0, 0, np.inf]], "atom 2: .* not finite"),
        (("O", "Q"), [[0, 0, 0], [0, 0, 1]], "atom 2: 'Q' is not an element"),
        (("O", "99H"), [[0, 0, 0], [0, 0, 1]], "atom 2: isotope 99H"),
        (("O", "H", "H"), [[0, 0, 0], [0, 1, 0], [0, 1, 0.05]], r"atoms 2 \(H\) and 3 \(H\) are 0.05 Å apart"),
        (("O", "H"), [[0, 0, 0]], r"shape \(1, 3\); expected \(2, 3\)"),
        (("O", "H"), [["a", 0, 0], [0, 0, 1]], "numbers in an array"),
    ],
)
def test_bad_geometries_are_refused(symbols, positions, message):
    with pytest.raises(ValueError, match=message):
        Molecule(symbols, positions)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"dipole_debye": [1, 2]}, r"dipole_debye has shape \(2,\)"),
        ({"dipole_debye": [0, 0, np.nan]}, "dipole_debye: .* not finite"),
        ({"polarizability_angstrom3": [[1, 2, 0], [0, 1, 0], [0, 0, 1]]}, "not symmetric"),
        ({"charge": 0.5}, "whole number"),
        ({"charge": "plus"}, "expected a number"),
        ({"mass_numbers": (16, 1)}, "3 symbols but 2 mass numbers"),
        ({"mass_numbers": (16, 1, 0)}, "atom 3: isotope 0H"),
    ],
)
def test_bad_fields_are_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        water(**fields)


def test_one_atom_is_a_molecule_here():
    assert Molecule(("Ar",), [[1, 2, 3]]).formula == "Ar"


def test_ten_thousand_atoms_in_a_second():
    grid = np.stack(np.meshgrid(*[np.arange(22.0)] * 3), axis=-1).reshape(-1, 3)[:10_000]
    start = time.perf_counter()
    big = Molecule(("O", "H") * 5000, grid)
    assert time.perf_counter() - start < 5  # s; 0.1 s on a laptop, n² arrays of 10⁸ distances would take 10 s
    assert big.formula == "H5000O5000"
    grid[9_999] = grid[17] + 0.01
    with pytest.raises(ValueError, match=r"atoms 18 .* and 10000 "):
        Molecule(("O", "H") * 5000, grid)


@given(arrays(float, (6, 3), elements=st.integers(0, 8).map(lambda i: i / 16)))
def test_atoms_that_coincide_are_found_like_by_the_full_table_of_distances(positions):
    distances = np.linalg.norm(positions[:, None] - positions, axis=-1)[np.triu_indices(6, 1)]
    if distances.min() < 0.1:
        with pytest.raises(ValueError, match="apart, nearer than"):
            Molecule(("H",) * 6, positions)
    else:
        Molecule(("H",) * 6, positions)


def test_labels_are_isotopes():
    heavy = Molecule(("18O", "D", "H"), WATER)
    assert heavy.symbols == ("O", "H", "H")
    assert heavy.mass_numbers == (18, 2, 1)
    assert heavy.formula == "H[2H][18O]"


def test_hill_formulas():
    line = [[0, 0, i] for i in range(5)]
    assert Molecule(("O", "H", "Cl", "C", "13C"), line).formula == "C[13C]HClO"
    assert Molecule(("O", "H", "Cl", "H", "H"), line, charge=1).formula == "ClH3O+"
    assert Molecule(("S", "O", "O", "O", "O"), line, charge=-2).formula == "O4S(2-)"


def test_substitution_by_atom_and_by_element():
    assert water().with_isotopes({1: "18O", "H": "D"}).mass_numbers == (18, 2, 2)
    assert water().with_isotopes("H=D, 3=T").mass_numbers == (16, 2, 3)  # the atom's number wins
    assert water().with_isotopes({3: "T", "H": "D"}).mass_numbers == (16, 2, 3)
    assert water().mass_numbers == (16, 1, 1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({4: "D"}, "atoms 1 to 3"),
        ({0: "D"}, "atoms 1 to 3"),
        ({"C": "13C"}, "element 'C' to substitute is not in H2O"),
        ({1: "D"}, "atom 1 is O: 'D' is an isotope of H"),
        ("1:D", "'1:D' is not of the kind"),
        ({1: "99O"}, "isotope 99O"),
    ],
)
def test_substitutions_that_do_not_fit(changes, message):
    with pytest.raises(ValueError, match=message):
        water().with_isotopes(changes)


def test_the_dipole_of_an_ion_moves_with_its_centre_of_mass_and_that_of_a_molecule_does_not():
    ion = Molecule(("Ar", "H"), [[0, 0, 0], [0, 0, 1.28]], charge=1, dipole_debye=[0, 0, 2.2])
    heavy = ion.with_isotopes("H=D")
    shift = heavy.centre_of_mass_angstrom - ion.centre_of_mass_angstrom
    assert heavy.dipole_debye[2] == pytest.approx(2.2 - DEBYE_PER_E_ANGSTROM * shift[2], rel=1e-12)  # round-off
    assert shift[2] > 0.02  # so the test would see a dipole that stays
    assert water(dipole_debye=[0, 0, -1.85]).with_isotopes("2=D").dipole_debye[2] == -1.85


@given(arrays(float, 3, elements=st.floats(-4, 4)), arrays(float, 3, elements=st.floats(-9, 9)))
def test_everything_turns_along(vector, shift):
    alpha = np.array([[1.5, 0.1, 0], [0.1, 1.4, 0.2], [0, 0.2, 1.6]])
    still = water(dipole_debye=[0.3, 0.1, 1.8], polarizability_angstrom3=alpha)
    moved = still.moved(turn(vector), shift)

    def invariants(m):
        arms = m.positions_angstrom - m.centre_of_mass_angstrom
        return np.concatenate(
            [arms @ m.dipole_debye, np.einsum("ia,ab,jb->ij", arms, m.polarizability_angstrom3, arms).ravel()]
        )

    np.testing.assert_allclose(invariants(moved), invariants(still), atol=1e-12)  # Å D, Å⁵: round-off of numbers ~ 10
    np.testing.assert_allclose(
        moved.centre_of_mass_angstrom, turn(vector) @ still.centre_of_mass_angstrom + shift, atol=1e-12  # round-off
    )  # fmt: skip


@pytest.mark.parametrize("matrix", [-np.eye(3), 2 * np.eye(3), np.eye(2), np.diag([1, 1, -1])])
def test_what_is_no_rotation(matrix):
    with pytest.raises(ValueError, match="rotation"):
        water().moved(matrix)


def test_arrays_are_copies_that_nobody_changes():
    positions = np.array(WATER)
    molecule = Molecule(("O", "H", "H"), positions)
    positions[0, 0] = 5
    assert molecule.positions_angstrom[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        molecule.positions_angstrom[0, 0] = 1


@pytest.mark.parametrize("size", [0.0, -1.0, np.inf, np.nan])
def test_a_constant_of_the_electron_spin_is_finite_and_above_zero(size):
    with pytest.raises(ValueError, match=r"electron_spin_mhz .*: expected a finite number above 0"):
        Molecule(("O", "O"), [[0, 0, 0], [0, 0, 1.2]], multiplicity=3, electron_spin_mhz=size)
