"""Molecule-fixed tensors: commutators and sum rules of whole matrices, rotations, closed forms, phases, selection rules."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import qutip
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_tensors import symmetric_top_elements
from scipy import sparse
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from slow_matrix import AXES, watson_matrix

from rotor.quantum.blocks.reduced import connected_wang_blocks, wang_amplitudes
from rotor.quantum.operators.symmetric_top_elements import coupling, coupling_to
from rotor.quantum.operators.tensors import (
    BodyTensor,
    acting_on,
    axis_order,
    bands_between,
    block_elements,
    body_tensor,
    frame_of,
    phase_exponent,
    spherical_components,
)
from rotor.quantum.operators.wigner import three_j
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.basis import REPRESENTATIONS, WangBlock, wang_blocks
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

JMAX = 8
ROUND_OFF = 1e-14  # some ten products of numbers up to J(J+1) = 72
EYE = np.eye(3)
UNEVEN = {"A": 9.0, "B": 6.0, "C": 4.0, "DeltaK": 1e-3}


def random_tensor(rank: int, seed: int = 1) -> BodyTensor:
    """Any tensor with T_-q = (-1)^q T_q*."""
    rng = np.random.default_rng([rank, seed])
    half = rng.normal(size=rank + 1) + 1j * rng.normal(size=rank + 1)
    half[0] = half[0].real
    negative = [(-1) ** q * half[q].conjugate() for q in range(rank, 0, -1)]
    return BodyTensor(rank, tuple(negative) + tuple(half.tolist()))


# Whole matrices over |J k M⟩, J ≤ 8, by the Wigner-Eckart theorem


def space_operator(components: np.ndarray, p: int, jmax: int) -> sparse.csr_array:
    """T^K_p over all |J k M⟩, k fastest."""
    rank = len(components) // 2
    rows = []
    for j_up in range(jmax + 1):
        m_up = np.arange(-j_up, j_up + 1)[:, None]
        row = []
        for j_low in range(jmax + 1):
            m_low = np.arange(-j_low, j_low + 1)
            over_m = (-1.0) ** (j_up - m_up) * three_j(j_up, rank, j_low, -m_up, p, m_low)
            row.append(sparse.kron(over_m, symmetric_top_elements(j_up, j_low, components)))
        rows.append(row)
    return sparse.block_array(rows, format="csr")


def cartesian_in_space(components: np.ndarray, jmax: int) -> list[sparse.csr_array]:
    """X, Y and Z of a vector."""
    down, along, up = (space_operator(components, p, jmax) for p in (-1, 0, 1))
    return [(down - up) / np.sqrt(2), 1j * (down + up) / np.sqrt(2), along]


def ladder(j: int) -> np.ndarray:
    """√(J(J+1) - k(k+1)) from k to k + 1, rising."""
    k = np.arange(-j, j)
    return np.diag(np.sqrt(j * (j + 1.0) - k * (k + 1)), -1)


def body_momenta(j: int) -> list[np.ndarray]:
    """Jx, Jy, Jz over k of a right-handed frame: Jx - i Jy raises k."""
    up = ladder(j)
    return [(up + up.T) / 2, 1j * (up - up.T) / 2, np.diag(np.arange(-j, j + 1.0))]


def momenta(jmax: int, representation: str) -> tuple[list, list]:
    """J along a, b, c and along X, Y, Z."""
    body, space = [], []
    for axis in range(3):
        inside = [sparse.kron(np.eye(2 * j + 1), body_momenta(j)[axis]) for j in range(jmax + 1)]
        outside = [sparse.kron(body_momenta(j)[axis].conj(), np.eye(2 * j + 1)) for j in range(jmax + 1)]
        body.append(sparse.block_diag(inside, format="csr"))
        space.append(sparse.block_diag(outside, format="csr"))
    turn = frame_of(representation)
    return [sum(turn[g, axis] * body[g] for g in range(3)) for axis in range(3)], space


@pytest.fixture(scope="module", params=list(REPRESENTATIONS))
def cosines(request):
    """Φ_Fg of one representation, [F][g] with g = a, b, c, J along a, b, c and along X, Y, Z, and the inner states."""
    columns = [cartesian_in_space(spherical_components(axis, 1, request.param), JMAX) for axis in EYE]
    phi = [[columns[g][f] for g in range(3)] for f in range(3)]
    inner = sum((2 * j + 1) ** 2 for j in range(JMAX))  # their neighbours are all there
    return phi, *momenta(JMAX, request.param), inner


def differs(left, right, inner: int | None = None) -> float:
    """The largest element of the difference, in the columns of the inner states."""
    return abs(left - right).toarray()[:, :inner].max()


def commutator(p, q):
    return p @ q - q @ p


CYCLIC = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def test_commutators_of_angular_momentum(cosines):
    """[Ja, Jb] = -i Jc in the molecule, [JX, JY] = i JZ in space, and they commute."""
    _, body, space, _ = cosines
    for f, g, h in CYCLIC:
        assert differs(commutator(body[f], body[g]), -1j * body[h]) < ROUND_OFF
        assert differs(commutator(space[f], space[g]), 1j * space[h]) < ROUND_OFF
    for p, q in itertools.product(body, space):
        assert abs(commutator(p, q)).max() < ROUND_OFF


def test_direction_cosines_turn_as_vectors(cosines):
    """[Ja, Φ_Fb] = -i Φ_Fc and [JX, Φ_Yg] = i Φ_Zg, cyclic; a component along the same axis commutes."""
    phi, body, space, _ = cosines
    for other in range(3):
        for f, g, h in CYCLIC:
            assert differs(commutator(body[f], phi[other][g]), -1j * phi[other][h]) < ROUND_OFF
            assert differs(commutator(space[f], phi[g][other]), 1j * phi[h][other]) < ROUND_OFF
            assert abs(commutator(body[f], phi[other][f])).max() < ROUND_OFF
            assert abs(commutator(space[f], phi[f][other])).max() < ROUND_OFF


def test_direction_cosines_are_an_orthogonal_matrix(cosines):
    """They commute and are Hermitian; Σ_F Φ_Fg Φ_Fh = δ, Σ_g Φ_Fg Φ_Gg = δ; Φ_Xa = Φ_Yb Φ_Zc - Φ_Zb Φ_Yc."""
    phi, _, _, inner = cosines
    flat = [operator for row in phi for operator in row]
    item = sparse.eye_array(flat[0].shape[0])
    for p, q in itertools.combinations(flat, 2):
        assert abs(commutator(p, q)).toarray()[:, :inner].max() < 1e-15  # numbers below 1
    for p in flat:
        assert differs(p, p.conj().T) < 1e-15
    for g, h in itertools.product(range(3), repeat=2):
        assert differs(sum(phi[f][g] @ phi[f][h] for f in range(3)), (g == h) * item, inner) < 3e-15
        assert differs(sum(phi[g][f] @ phi[h][f] for f in range(3)), (g == h) * item, inner) < 3e-15
    for (f, g, h), (k, l, m) in itertools.product(CYCLIC, CYCLIC):
        assert differs(phi[g][l] @ phi[h][m] - phi[g][m] @ phi[h][l], phi[f][k], inner) < 3e-15


def test_products_of_cosines_are_tensors_of_rank_0_and_2(cosines, request):
    """Φ_Zg Φ_Zh = √(2/3) T²_0 - T⁰_0/√3 of the matrix e_g e_h: rank 2 has the phases of rank 1."""
    phi, _, _, inner = cosines
    representation = request.node.callspec.params["cosines"]
    for g, h in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        matrix = np.outer(EYE[g], EYE[h])
        scalar, tensor = (space_operator(spherical_components(matrix, k, representation), 0, JMAX) for k in (0, 2))
        assert differs(phi[2][g] @ phi[2][h], np.sqrt(2 / 3) * tensor - scalar / np.sqrt(3), inner) < 3e-15


# Components


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_frames_are_right_handed(representation):
    turn = frame_of(representation)
    assert np.linalg.det(turn) == pytest.approx(1.0, abs=1e-15)
    assert ["abc"[np.argmax(np.abs(row))] for row in turn] == list(AXES[representation])
    assert axis_order(representation) == AXES[representation]


@pytest.mark.parametrize("rank", [0, 1, 2])
@pytest.mark.parametrize("representation", ["Ir", "IIIl"])
def test_components_of_a_matrix_are_coupled_vectors(rank, representation):
    """T^K_q of u v = Σ ⟨1 m 1 n|K q⟩ u_m v_n with QuTiP's coefficients, the antisymmetric part among them."""
    u, v = np.random.default_rng(3).normal(size=(2, 3))
    at = [spherical_components(vector, 1, representation) for vector in (u, v)]
    slow = [
        sum(
            qutip.clebsch(1, 1, rank, m, q - m, q) * at[0][m + 1] * at[1][q - m + 1]
            for m in (-1, 0, 1)
            if abs(q - m) < 2
        )
        for q in range(-rank, rank + 1)
    ]
    assert np.allclose(spherical_components(np.outer(u, v), rank, representation), slow, atol=1e-14)  # round-off


@given(seed=st.integers(0, 10**6))
@settings(max_examples=25)
def test_components_keep_lengths(seed):
    """Σ_K Σ_q |T^K_q|² = Σ T_gh²."""
    matrix = np.random.default_rng(seed).normal(size=(3, 3))
    for representation in REPRESENTATIONS:
        total = sum(np.sum(np.abs(spherical_components(matrix, rank, representation)) ** 2) for rank in (0, 1, 2))
        assert total == pytest.approx(np.sum(matrix**2), rel=1e-13)  # round-off


def test_antisymmetric_parts_are_i_times_a_vector():
    matrix = np.random.default_rng(5).normal(size=(3, 3))
    vector = [matrix[1, 2] - matrix[2, 1], matrix[2, 0] - matrix[0, 2], matrix[0, 1] - matrix[1, 0]]
    for representation in REPRESENTATIONS:
        expected = 1j / np.sqrt(2) * spherical_components(vector, 1, representation)
        assert np.allclose(spherical_components(matrix, 1, representation), expected, atol=1e-15)  # round-off
    with pytest.raises(ValueError, match="real Cartesian components"):
        body_tensor(matrix, 1, "Ir")


# Coupling


@pytest.mark.parametrize("rank", [0, 1, 2])
def test_closed_forms_are_three_j(rank):
    for j, j_up in itertools.product(range(12), repeat=2):
        k = np.arange(-j - 1, j + 2)
        inside = np.clip(k, -j, j)
        for q in range(-rank - 1, rank + 2):
            exists = (np.abs(k) <= j) & (np.abs(k + q) <= j_up) & (abs(q) <= rank)
            sign = np.where((j_up - k - q) % 2, -1, 1)
            slow = sign * np.sqrt((2 * j_up + 1) * (2 * j + 1)) * three_j(j_up, rank, j, -inside - q, q, inside)
            assert np.allclose(
                coupling(j, j_up, rank, q, k), np.where(exists, slow, 0.0), atol=1e-14
            )  # of numbers to 5


@given(j=st.integers(0, 200), rise=st.integers(-2, 2), rank=st.sampled_from([1, 2]), q=st.integers(-2, 2))
@settings(max_examples=60)
def test_couplings_squared_add_up(j, rise, rank, q):
    """Σ_k c² = (2J+1)(2J'+1)/(2K+1) wherever there is one."""
    j_up, k = j + rise, np.arange(-j, j + 1)
    there = abs(rise) <= rank <= j + j_up and j_up >= 0 and abs(q) <= rank
    expected = (2 * j + 1) * (2 * j_up + 1) / (2 * rank + 1) if there else 0.0
    assert np.sum(coupling(j, j_up, rank, q, k) ** 2) == pytest.approx(expected, rel=1e-12)  # round-off of 400 terms


@pytest.mark.parametrize("rank", [1, 2, 3, 4])
def test_couplings_of_j_1000_add_up(rank):
    """Σ_k c² = (2J+1)(2J'+1)/(2K+1), and over J' for one k, q: 2J + 1."""
    j, k = 1000, np.arange(-1000, 1001)
    for q in (-rank, 0, 1):
        squares = [coupling(j, j + rise, rank, q, k) ** 2 for rise in range(-rank, rank + 1)]
        for rise, square in enumerate(squares, -rank):
            assert square.sum() == pytest.approx(2001 * (2001 + 2 * rise) / (2 * rank + 1), rel=1e-13)  # 2001 terms
        assert np.allclose(sum(squares), 2001, rtol=1e-13)  # round-off of some terms


def test_hoenl_london_factors():
    """Parallel K²(2J+1)/(J(J+1)) and ((J+1)² - K²)/(J+1), perpendicular (J+K+1)(J+K+2)/(2(J+1)), as they are printed."""
    j, k = 7, np.arange(8.0)
    along, across = spherical_components([1, 0, 0], 1, "Ir"), spherical_components([0, 1, 0], 1, "Ir")
    level = np.abs(symmetric_top_elements(j, j, along)) ** 2
    above = np.abs(symmetric_top_elements(j + 1, j, along)) ** 2
    aside = np.abs(symmetric_top_elements(j + 1, j, across)) ** 2
    at = np.arange(8) + j
    assert np.allclose(level[at, at], k**2 * 15 / 56, rtol=1e-14)
    assert np.allclose(above[at + 1, at], (64 - k**2) / 8, rtol=1e-14)
    assert np.allclose(aside[at + 2, at], (8 + k) * (9 + k) / 32, rtol=1e-14)  # a half of it for one of x, y
    assert np.allclose(aside[at, at], (8 - k) * (9 - k) / 32, rtol=1e-14)


# Rotations of the molecule's frame


@pytest.mark.parametrize("rank", [1, 2, 3, 4])
def test_turned_tensors_are_turned_functions(rank):
    """D(R) T between |J k⟩ is T between functions turned by exp(-iθ n·J); rank 3 and 4 as products of vectors."""
    rng = np.random.default_rng(rank)
    turn = Rotation.random(random_state=2)
    vectors = rng.normal(size=(rank, 3))
    before, after = (
        _coupled([spherical_components(v, 1, "Ir") for v in w]) for w in (vectors, vectors @ turn.as_matrix().T)
    )
    axis = frame_of("Ir") @ turn.as_rotvec()

    def turned(j: int) -> np.ndarray:
        return expm(1j * sum(n * operator for n, operator in zip(axis, body_momenta(j), strict=True)))

    for j, j_up in ((4, 4), (4, 5), (5, 3), (6, 6)):
        moved = turned(j_up) @ symmetric_top_elements(j_up, j, before) @ turned(j).conj().T
        assert np.allclose(symmetric_top_elements(j_up, j, after), moved, atol=1e-13)  # exponential of 6
    assert np.abs(after - before).max() > 0.1


def _coupled(vectors: list[np.ndarray]) -> np.ndarray:
    """The stretched product of vectors, of the highest rank."""
    product = vectors[0]
    for rank, vector in enumerate(vectors[1:], 2):
        product = np.array(
            [
                sum(qutip.clebsch(1, rank - 1, rank, m, q - m, q) * vector[m + 1] * product[q - m + rank - 1]
                    for m in (-1, 0, 1) if abs(q - m) < rank)
                for q in range(-rank, rank + 1)
            ]
        )  # fmt: skip
    return product


# Wang blocks


def over_k(block: WangBlock) -> np.ndarray:
    """|J K s)) over k = -J ... J, phases among them."""
    out = np.zeros((2 * block.j + 1, block.size), dtype=complex)
    for place, k in enumerate(block.k):
        out[block.j + k, place], out[block.j - k, place] = (1, 1) if k == 0 else (0.5**0.5, block.sign * 0.5**0.5)
    return out * 1j ** phase_exponent(block)


@pytest.mark.parametrize("rank", range(6))
def test_blocks_are_parts_of_the_full_matrix(rank):
    """Even ranks real, odd ranks i times real, for any tensor; what is not said to connect is zero."""
    tensor, connected = random_tensor(rank), 0
    for j, j_up in itertools.product(range(8), repeat=2):
        full = symmetric_top_elements(j_up, j, tensor.components)
        for low, up in itertools.product(wang_blocks(j, "Ir"), wang_blocks(j_up, "Ir")):
            slow = over_k(up).conj().T @ full @ over_k(low)
            ours = (1j if rank % 2 else 1) * block_elements(up, low, tensor)
            assert np.allclose(ours, slow, atol=1e-14)  # round-off of numbers to 5
            connected += bool(bands_between(up, low, tensor))
    assert connected > 0


@pytest.mark.parametrize("rank", range(1, 5))
def test_the_other_triangle_is_the_transpose(rank):
    tensor = random_tensor(rank)
    for j, j_up in itertools.product(range(6), repeat=2):
        for low, up in itertools.product(wang_blocks(j, "IIr"), wang_blocks(j_up, "IIr")):
            back = (-1) ** (j_up - j + rank) * block_elements(low, up, tensor).T
            assert np.allclose(block_elements(up, low, tensor), back, atol=1e-14)  # round-off of numbers to 5


SPECIES = {"eo": "a", "oe": "c", "oo": "b", "ee": ""}  # parities of (ΔKa, ΔKc) -> component of a vector


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_species_choose_the_component(representation):
    """A vector along a changes the parity of Kc, along c that of Ka, along b both; a matrix as the product of two."""
    for low, up in itertools.product(wang_blocks(4, representation), wang_blocks(5, representation)):
        change = "".join("e" if p == q else "o" for p, q in zip(low.species, up.species, strict=True))
        acting = "".join(
            g for g, e in zip("abc", EYE, strict=True) if bands_between(up, low, body_tensor(e, 1, representation))
        )
        assert acting == SPECIES[change]
        for g, h in ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2)):
            tensor = body_tensor(np.outer(EYE[g], EYE[h]), 2, representation)
            expected = {0: "ee"}.get(g - h) or {(0, 1): "oe", (0, 2): "oo", (1, 2): "eo"}[g, h]
            assert bool(bands_between(up, low, tensor)) == (change == expected)


# Solved states


def slow_dipole_strengths(values: dict[str, float], representation: str, dipole, jmax: int) -> dict:
    """S between all states in order of energy, from full matrices over k."""
    components = spherical_components(dipole, 1, representation)
    states = [np.linalg.eigh(_rising(watson_matrix(values, "A", representation, j)))[1] for j in range(jmax + 1)]
    return {
        (j, j_up): np.abs(states[j_up].conj().T @ symmetric_top_elements(j_up, j, components) @ states[j]) ** 2
        for j in range(jmax + 1)
        for j_up in (j, j + 1)
        if j_up <= jmax
    }


def _rising(matrix: np.ndarray) -> np.ndarray:
    """K from -J, where QuTiP's begins with +J."""
    return matrix[::-1, ::-1]


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_dipole_strengths_are_those_of_full_matrices(representation):
    dipole = (1.2, -0.7, 0.4)
    levels = solve_levels(Top(Constants(reduction="A", representation=representation, **UNEVEN)), 6)
    rank = np.concatenate([np.argsort(np.argsort(levels.energy_mhz[levels.quanta["j"] == j])) for j in range(7)])
    slow = slow_dipole_strengths(UNEVEN, representation, dipole, 6)
    total = 0.0
    for up, low in connected_wang_blocks(levels.blocks, body_tensor(dipole, 1, representation)):
        strengths = wang_amplitudes(up, low, body_tensor(dipole, 1, representation)) ** 2
        i, k = (rank[block.start : block.start + block.basis.size] for block in (up, low))
        expected = slow[low.basis.j, up.basis.j][np.ix_(i, k)]
        assert np.allclose(strengths, expected, atol=1e-10)  # near-degenerate vectors of the full matrix
        total += strengths.sum()
    everything = sum(m.sum() if j != j_up else m.sum() / 2 for (j, j_up), m in slow.items())
    assert total == pytest.approx(everything, rel=1e-12)  # nothing is missing


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("rank", [0, 1, 2, 3])
def test_strengths_from_one_level_add_up(rank, representation):
    """Σ S over all final states with J - K ... J + K is (2J+1) Σ |T_q|², for any tensor and top."""
    j, tensor = 9, random_tensor(rank, seed=7)
    levels = solve_levels(
        Top(Constants(reduction="A", representation=representation, **UNEVEN)), j + rank, jmin=j - rank
    )
    sums = np.zeros(len(levels))
    for up, low in connected_wang_blocks(levels.blocks, tensor):
        strength = wang_amplitudes(up, low, tensor) ** 2
        sums[low.start : low.start + low.basis.size] += strength.sum(axis=0)
        if up is not low:
            sums[up.start : up.start + up.basis.size] += strength.sum(axis=1)
    expected = (2 * j + 1) * np.sum(np.abs(tensor.components) ** 2)
    assert np.allclose(sums[levels.quanta["j"] == j], expected, rtol=1e-12)  # round-off of some hundred terms


@pytest.mark.parametrize("rank", [1, 2])
def test_every_representation_gives_the_same_strengths(rank):
    cartesian = np.random.default_rng(4).normal(size=(3,) * rank)
    results = {}
    for representation in REPRESENTATIONS:
        levels = solve_levels(Top(Constants(A=9.0, B=6.0, C=4.0, representation=representation)), 7)
        tensor = body_tensor(cartesian, rank, representation)
        table = np.zeros((len(levels), len(levels)))
        for up, low in connected_wang_blocks(levels.blocks, tensor):
            inside = np.ix_(*(np.arange(b.start, b.start + b.basis.size) for b in (up, low)))
            table[inside] = wang_amplitudes(up, low, tensor) ** 2
        order = np.lexsort((levels.quanta["kc"], levels.quanta["ka"], levels.quanta["j"]))
        table = table[np.ix_(order, order)]
        results[representation] = np.maximum(table, table.T)
    for table in results.values():
        assert np.allclose(table, results["Ir"], atol=1e-11)  # round-off of vectors
    assert results["Ir"].max() > 1.0


def test_solved_blocks_of_j_1000_add_up():
    """Σ over all states of J' and J of one component of a vector: (2J+1)(2J'+1)/3."""
    basis = [wang_blocks(j, "Ir") for j in (999, 1000)]
    for axis in EYE:
        tensor = body_tensor(axis, 1, "Ir")
        total = sum(
            float(np.sum(band.elements**2))
            for up in basis[1]
            for low in basis[0]
            for band in bands_between(up, low, tensor)
        )
        assert total == pytest.approx(1999 * 2001 / 3, rel=1e-12)  # round-off of 2000 terms
    tensor = random_tensor(2)
    total = sum(
        float(np.sum(band.elements**2))
        for up in basis[1]
        for low in basis[0]
        for band in bands_between(up, low, tensor)
    )
    assert total == pytest.approx(1999 * 2001 / 5 * np.sum(np.abs(tensor.components) ** 2), rel=1e-12)


def test_acting_on_columns_is_the_matrix():
    low, up = wang_blocks(6, "Ir")[0], wang_blocks(7, "Ir")[2]
    tensor, columns = random_tensor(3), np.random.default_rng(1).normal(size=(low.size, 3))
    assert np.abs(block_elements(up, low, tensor)).max() > 0.1
    assert np.allclose(acting_on(columns, up, low, tensor), block_elements(up, low, tensor) @ columns, atol=1e-14)


# Arguments


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: axis_order("IV"), "representation 'IV': known are Ir, Il"),
        (lambda: spherical_components([1, 2, 3], 2, "Ir"), r"rank 2 of an array \(3,\)"),
        (lambda: spherical_components(np.eye(3), 3, "Ir"), r"rank 3 of an array \(3, 3\)"),
        (lambda: BodyTensor(1, (1, 0, 0)), "real Cartesian components has T_-q"),
        (lambda: BodyTensor(2, (0, 1, 0)), "2K . 1 = 5 components"),
        (lambda: BodyTensor(0, (float("nan"),)), "real Cartesian components"),
    ],
)
def test_what_is_no_tensor_is_an_error(call, said):
    with pytest.raises(ValueError, match=said):
        call()


@pytest.mark.parametrize("j", [0.5, 1.0, 1.5, 2.0, 2.5])
def test_couplings_of_half_integer_j_are_those_of_three_j_symbols(j):
    """Spins of 1/2 and 3/2 use the same function; a placeholder for missing J once replaced J = 1/2."""
    for rank in (1, 2, 3):
        for rise in range(-rank, rank + 1):
            for q in range(-rank, rank + 1):
                k = np.arange(-j, j + 1)
                j_up = j + rise
                closes = j_up >= 0 and j + j_up >= rank
                exists = closes & (np.abs(k + q) <= j_up)
                sign = np.where((j_up - k - q) % 2, -1.0, 1.0)
                expected = np.array(
                    [
                        s * np.sqrt((2 * j_up + 1) * (2 * j + 1)) * float(three_j(j_up, rank, j, -kk - q, q, kk))
                        if e
                        else 0.0
                        for kk, s, e in zip(k, sign, exists, strict=True)
                    ]
                )
                assert coupling_to(j, rise, rank, q, k) == pytest.approx(expected, abs=1e-13), (rank, rise, q)
