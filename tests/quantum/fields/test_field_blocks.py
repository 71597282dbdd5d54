"""States in a field: closed forms, full matrices of QuTiP's coefficients, tilted fields against rotated ones, blocks that are found."""

from __future__ import annotations

import numpy as np
import pytest
from field_matrices import contracted_vectors, rigid, rotation_function, states
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rotor.alignment.axis_functions import absolute_cosine, asymmetric_elements
from rotor.quantum.blocks.connected import coloured_components
from rotor.quantum.fields.axial import cosine_bands
from rotor.quantum.fields.blocks import Contraction
from rotor.quantum.fields.solved_space import field_space, tilted_space
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

Z = np.array([0, 0, 1.0])
ZZ = np.outer(Z, Z)
WATER_LIKE = Top.from_constants("A=10 B=6 C=4 MHz")
DIPOLE, TENSOR = np.array([1.0, 0.7, -0.4]), np.array([[2.1, 0.3, -0.2], [0.3, 1.4, 0.5], [-0.2, 0.5, 1.0]])


def dense(matrix) -> np.ndarray:
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def energies(space, terms, jmax: int) -> np.ndarray:
    """All eigenvalues of H0 - Σ size contraction, each as often as its block exists."""
    terms = list(terms)
    out = []
    for m in range(jmax + 1):
        for block in space.blocks(m):
            matrix = np.diag(block.energies_mhz).astype(complex)
            for contraction, size in terms:
                matrix = matrix - size * dense(block.matrix(contraction))
            out += np.repeat(np.linalg.eigvalsh(matrix), block.copies).tolist()
    return np.sort(out)


# Direction cosines


@given(k=st.integers(-6, 6), m=st.integers(-6, 6))
@settings(max_examples=30)
def test_cosine_is_a_rotation_function(k, m):
    j = np.arange(max(abs(k), abs(m)), 9)
    basis = [(int(value), k, m) for value in j]
    diagonal, beside = cosine_bands(1, int(j[0]), 8, 1, k, m)
    slow = rotation_function(basis, 1, 0, 0)
    assert np.allclose(np.diag(slow), diagonal, atol=1e-7)  # QuTiP's alternating sums
    assert np.allclose(np.diag(slow, 1), beside, atol=1e-7)  # the same


def test_cosine_squared_is_two_thirds_of_rank_two_and_a_third():
    for k, m in ((0, 0), (2, 1), (-1, 3)):
        j = np.arange(max(abs(k), abs(m)), 8)
        slow = 2 / 3 * rotation_function([(int(x), k, m) for x in j], 2, 0, 0)
        for n, band in enumerate(cosine_bands(2, int(j[0]), 7, 1, k, m)):
            assert np.allclose(np.diag(slow, n), band, atol=1e-7)  # QuTiP's alternating sums


def test_absolute_cosine_squares_to_cosine_squared():
    """|cosθ|² = cos²θ where the basis is long enough for the sum over states in between."""
    top = Top.from_constants("A=9 B=4 MHz", dipole_abc_debye=(1, 0, 0))
    square = Contraction(np.diag([1.0, 0, 0]), ZZ)
    space = field_space(top, 160, [square])
    for m in (0, 2):
        for block in space.blocks(m)[:4]:
            computed = (absolute_cosine(block) @ absolute_cosine(block))[:3, :3]
            assert np.allclose(
                computed, block.matrix(square)[:3, :3], atol=2e-6
            )  # |cosθ| has a kink: its series falls as J^-4


# Against full matrices


def test_three_dipole_components_against_the_full_matrix():
    """An asymmetric top in Iʳ: x, y, z = b, c, a."""
    basis = states(4)
    full = rigid(basis, 6.0, 4.0, 10.0) - 3.0 * contracted_vectors(basis, DIPOLE[[1, 2, 0]], Z)
    dipole = Contraction(DIPOLE, Z)
    space = field_space(WATER_LIKE, 4, [dipole])
    assert any(
        np.iscomplexobj(block.matrix(dipole)) for block in space.blocks(1)
    )  # no phases make three components real
    assert np.allclose(energies(space, [(dipole, 3.0)], 4), np.linalg.eigvalsh(full), atol=1e-6)  # QuTiP's sums, J to 5


@pytest.mark.parametrize("text", ["A=10 B=6 C=4 MHz", "B=6 MHz", "A=10 B=4 MHz", "B=6 C=4 MHz"])
@pytest.mark.parametrize(("a", "b", "c"), [(1.0, 0.7, -0.4), (1.0, 0.7, 0), (1.0, 0, 0), (0, 0, 1.0)])
def test_a_tilted_field_is_a_rotated_one(text, a, b, c):
    """The spectrum does not know the direction of the field; light and a static field together."""
    if text == "B=6 MHz" and (b or c):
        return  # a linear top has its dipole along a
    axis = 2 if c and not a else 0
    tensor = TENSOR if b and c else np.diag(np.where(np.arange(3) == axis, 2.0, 1.0))
    top, straight = Top.from_constants(text), [Contraction([a, b, c], Z), Contraction(tensor, ZZ)]
    along = energies(field_space(top, 4, straight), zip(straight, (5.0, 3.0), strict=True), 4)
    field = Rotation.from_euler("zyz", [0.3, 0.7, -1.1]).apply(Z)
    turned = [Contraction([a, b, c], field), Contraction(tensor, np.outer(field, field))]
    for contractions in (straight, turned):
        tilted_energies = energies(tilted_space(top, 4, contractions), zip(contractions, (5.0, 3.0), strict=True), 4)
        assert np.allclose(along, tilted_energies, atol=1e-11)  # round-off of energies of 200 MHz


@pytest.mark.parametrize("representation", ["Ir", "Il", "IIIr", "IIIl"])
def test_direction_cosines_are_those_of_a_rotation(representation):
    """Φ_Xa = Φ_Yb Φ_Zc - Φ_Yc Φ_Zb, a proper rotation and not its mirror image; all commute; rows have length 1; cos² is a square."""
    top = Top.from_constants(Constants(A=10.0, B=6.0, C=4.0, representation=representation))
    unit = np.eye(3)
    block = tilted_space(top, 5, [Contraction(DIPOLE, [0.3, 0.5, 0.8]), Contraction(TENSOR, TENSOR)]).blocks(0)[0]
    assert len(block) == sum((2 * j + 1) ** 2 for j in range(6))
    cosine = {(f, g): dense(block.matrix(Contraction(unit[g], unit[f]))) for f in range(3) for g in range(3)}
    inner = block.j <= 3  # products of two pass through J ≤ 5

    def product(p, q) -> np.ndarray:
        return (cosine[p] @ cosine[q])[np.ix_(inner, inner)]

    def alone(p) -> np.ndarray:
        return cosine[p][np.ix_(inner, inner)]

    for f in range(3):
        x, y = (f + 1) % 3, (f + 2) % 3
        for g in range(3):
            b, c = (g + 1) % 3, (g + 2) % 3
            assert np.allclose(
                product((x, b), (y, c)) - product((x, c), (y, b)), alone((f, g)), atol=1e-12
            )  # round-off
            assert np.allclose(product((f, g), (x, b)), product((x, b), (f, g)), atol=1e-12)  # the same
            square = dense(block.matrix(Contraction(np.outer(unit[g], unit[g]), np.outer(unit[f], unit[f]))))
            assert np.allclose(product((f, g), (f, g)), square[np.ix_(inner, inner)], atol=1e-12)  # the same


def test_left_and_right_handed_representations_agree():
    dipole = Contraction(DIPOLE, Z)
    results = []
    for representation in ("Ir", "Il", "IIr", "IIIr", "IIIl"):
        top = Top.from_constants(Constants(A=10.0, B=6.0, C=4.0, representation=representation))
        results.append(energies(field_space(top, 4, [dipole]), [(dipole, 3.0)], 4))
    assert np.ptp(results, axis=0).max() < 1e-11  # round-off of energies of 200 MHz


# Blocks


def test_blocks_are_those_that_the_field_leaves_apart():
    """A diagonal polarizability: four species, at M = 0 each with J even and odd apart; one dipole component joins two species."""
    light, dipole = Contraction(np.diag([3.0, 2.0, 1.0]), ZZ), Contraction([1.0, 0, 0], Z)
    space = field_space(WATER_LIKE, 6, [light])
    assert [len(space.blocks(m)) for m in (0, 1)] == [8, 4]
    both = field_space(WATER_LIKE, 6, [dipole])
    assert [len(both.blocks(m)) for m in (0, 1)] == [4, 2]
    assert sum(len(block) * block.copies for m in range(7) for block in both.blocks(m)) == sum(
        (2 * j + 1) ** 2 for j in range(7)
    )


def test_elliptical_light_leaves_sixteen_blocks():
    light = Contraction(np.diag([3.0, 2.0, 1.0]), np.diag([0.25, 0, 0.75]))
    space = tilted_space(WATER_LIKE, 15, [light])
    sizes = [len(block) for block in space.blocks(0)]
    assert len(sizes) == 16
    assert sum(sizes) == 5456  # Σ (2J+1)²
    assert 344 in sizes  # that of J = 0 (fields.md)


def test_colours_that_contradict_each_other_are_noticed():
    assert coloured_components(3, [(0, 1, 1), (1, 2, 1), (0, 2, 1)])[0][2] is False


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="spherical top"):
        field_space(Top.from_constants(Constants(B=5.0, kind="spherical")), 4, [Contraction(np.eye(3), ZZ)])
    with pytest.raises(ValueError, match="two vectors"):
        Contraction([1, 0, 0], ZZ)


# Functions of the angle of an axis


@pytest.mark.parametrize("representation", ["Ir", "Il", "IIr", "IIIr", "IIIl"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_functions_of_an_axis_over_an_asymmetric_top(representation, axis):
    """cos²θ by quadrature is the tensor's; |cosθ| squares to it where the sum over states in between is long enough."""
    top = Top.from_constants(Constants(A=10.0, B=6.0, C=4.0, representation=representation))
    along = np.eye(3)[axis]
    square = Contraction(np.outer(along, along), ZZ)
    space = field_space(top, 14, [Contraction(np.diag([3.0, 2.0, 1.0]), ZZ)])
    for m in (0, 2):
        for block in space.blocks(m):
            exact = block.matrix(square)
            assert np.abs(asymmetric_elements(block, axis, lambda x: x**2) - exact).max() < 1e-12  # round-off
            absolute = asymmetric_elements(block, axis)
            low = block.j <= 2
            assert np.allclose(
                (absolute @ absolute)[np.ix_(low, low)], exact[np.ix_(low, low)], atol=2e-3
            )  # J^-4 from 14
