"""Operators of the rotation contracted for many N at once, against the same pair by pair."""

from __future__ import annotations

import numpy as np
import pytest
from plain_elements import rotor_elements, tensor_elements

from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.operators.rotation import components, direction_cosine, j_squared
from rotor.quantum.operators.tensors import body_tensor, tensor_between
from rotor.quantum.spins.contraction import operators_of_stacks, pieces_in_both_orders, stacks_of, tensors_of_stacks
from rotor.quantum.spins.rotor import Piece, acts, solved_rotor
from rotor.quantum.spins.scheme import ByElements, Cosines, CosinesWithN, Scalar
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

TOP = Top(Constants(A=9400.0, B=3100.0, C=2500.0, DeltaJK=-2.0, deltaK=0.3), dipole_abc_debye=(1.2, 0.7, 0.4))
STATES = InteractingStates(
    {"E[1]": 2e4, "A[1]": 9300.0, "B[1]": 3110.0, "C[1]": 2490.0, "G_c[0,1]": 300.0, "F_ab[0,1]": 4.0}
)
RNG = np.random.default_rng(5)


def by_numbers(contracted):
    """The (n', n) elements by pairs of block numbers, without pairs where all are zero."""
    out = {}
    for up, low, pairs, matrices in contracted:
        numbers = zip(up.numbers[pairs.up].tolist(), low.numbers[pairs.low].tolist(), strict=True)
        for matrix, number, a, b in zip(matrices, numbers, pairs.up, pairs.low, strict=True):
            if matrix.any():
                out[number] = matrix[: up.sizes[a], : low.sizes[b]]
    return out


def _matrix() -> tuple[tuple[float, float, float], ...]:
    return tuple(tuple(float(x) for x in row) for row in RNG.standard_normal((3, 3)))


def _blocks(effects: tuple) -> tuple[list, str]:
    return solved_rotor(TOP, (*SEMI_RIGID, *effects), [], 0, 7, None)


def one_way(up, low, pieces: list, representation: str) -> np.ndarray | None:
    """Σ value ⟨r'‖X‖r⟩ between the states of two blocks, part by part."""
    total = None
    for piece in pieces:
        for left in up.parts:
            for right in low.parts:
                computed = rotor_elements(piece.rotor, left.basis, right.basis, representation)
                if acts(piece, left.v, right.v) and computed is not None and computed.any():
                    m, n = left.basis.j, right.basis.j
                    bra, ket = (part.basis.k.astype(float) ** (2 * piece.nz2) for part in (left, right))
                    powers = piece.value * ((m * (m + 1.0)) ** piece.n2 + (n * (n + 1.0)) ** piece.n2) / 2
                    scaled = powers * (bra[:, None] + ket) / 2 * computed
                    moved = up.vectors[left.place].T @ scaled @ low.vectors[right.place]
                    total = moved if total is None else total + moved
    return total


def both_ways(up, low, pieces: list, representation: str) -> np.ndarray | None:
    """With the conjugates of pieces between different states; coefficients of coupling have c(p', p) = (-1)^(N'-N) c(p, p')."""
    computed = one_way(up, low, pieces, representation)
    back = one_way(low, up, [piece for piece in pieces if piece.bra != piece.ket], representation)
    if back is None:
        return computed
    turned = (-1.0) ** (up.j - low.j) * back.T
    return turned if computed is None else computed + turned


def plain_tensor(up, low, tensors: dict) -> np.ndarray | None:
    """⟨r'‖T‖r⟩ between the states of two blocks, part by part."""
    total = None
    for left in up.parts:
        for right in low.parts:
            computed = tensor_elements(left.basis, right.basis, tensor_between(tensors, left.v, right.v))
            if computed is not None and computed.any():
                moved = up.vectors[left.place].T @ computed @ low.vectors[right.place]
                total = moved if total is None else total + moved
    return total


PRODUCT = direction_cosine("a", "Ir") @ components("Ir")["b"] @ components("Ir")["c"]
PIECES = {
    "quadrupole with every element": [Piece(-57.0, Cosines(_matrix()), -1, -1, 0, 0)],
    "spin-rotation, antisymmetric part too": [Piece(3.0, CosinesWithN(_matrix()), -1, -1, 0, 0)],
    "powers of N² and Nz²": [
        Piece(2.0, CosinesWithN(_matrix()), 0, 0, 1, 1),
        Piece(1.0, Cosines(_matrix()), 0, 0, 1, 0),
    ],
    "operators of N": [Piece(1.5, Scalar((((1, 1, 0), 2.0), ((0, 0, 1), 0.3))), -1, -1, 0, 0)],
    "an operator of the algebra": [
        Piece(0.7, ByElements(1, PRODUCT), -1, -1, 0, 0),
        Piece(0.3, ByElements(1, PRODUCT), 0, 1, 1, 1),
    ],
    "between states": [Piece(7.0, Cosines(_matrix()), 0, 1, 0, 0), Piece(5.0, Cosines((0.3, 0.5, 0.7)), 0, 1, 0, 0)],
}


@pytest.mark.parametrize("name", PIECES)
@pytest.mark.parametrize("effects", [(), (STATES,)], ids=["one state", "two states"])
def test_operators_are_those_of_pairs(name, effects):
    """Every pair of blocks up to ΔN = 2, one by one; of blocks with one Wang function too."""
    blocks, representation = _blocks(effects)
    for piece in PIECES[name]:
        computed = by_numbers(operators_of_stacks(stacks_of(blocks), 2, [[piece]], representation)[0])
        expected = {}
        for i, up in enumerate(blocks):
            for k, low in enumerate(blocks[: i + 1]):
                near = abs(up.j - low.j) <= piece.rotor.rank <= up.j + low.j
                item = both_ways(up, low, [piece], representation) if near else None
                if item is not None and item.any():
                    expected[i, k] = item
        assert computed.keys() == expected.keys()
        largest = max((np.abs(item).max() for item in expected.values()), default=0.0)
        for pair, item in expected.items():
            assert np.abs(computed[pair] - item).max() <= 1e-14 * largest  # two orders of summation


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["alike", "with the sign of the order"])
def test_dipoles_are_those_of_pairs(sign):
    """Both ways round; dipoles between states may change their sign with the order of the states."""
    blocks, representation = _blocks((STATES,))
    along = np.array([1.2, 0.7, 0.4])
    tensors = {(v, w): body_tensor((1 + v + w) * along, 1, representation) for v, w in ((0, 0), (1, 1), (0, 1))}
    tensors[1, 0] = body_tensor(sign * 2 * along, 1, representation)
    computed = by_numbers(tensors_of_stacks(stacks_of(blocks), tensors, representation))
    count = 0
    for i, up in enumerate(blocks):
        for k, low in enumerate(blocks):
            item = plain_tensor(up, low, tensors) if abs(up.j - low.j) <= 1 <= up.j + low.j else None
            assert (item is None) == ((i, k) not in computed)
            if item is not None:
                count += 1
                assert np.abs(computed[i, k] - item).max() < 1e-13  # elements of up to 30, two orders of summation
    assert count > 40


COSINE = direction_cosine("c", "Ir")


@pytest.mark.parametrize("states", [(0, 0), (1, 0)], ids=["within a state", "between states"])
@pytest.mark.parametrize(
    "operator",
    [COSINE @ j_squared() + j_squared() @ COSINE, COSINE @ j_squared() - j_squared() @ COSINE],
    ids=["Hermitian", "anti-Hermitian"],
)
def test_moments_are_those_of_pairs(operator, states):
    """{φ, N²} and [φ, N²] in both orders; within a state the second has elements of its own in either order, not its adjoint."""
    blocks, representation = _blocks((STATES,))
    piece, sign = Piece(0.4, ByElements(1, 1j * operator), *states, 0, 0), -1.0
    computed = by_numbers(pieces_in_both_orders(stacks_of(blocks), [piece], sign, representation))
    count = 0
    for i, up in enumerate(blocks):
        for k, low in enumerate(blocks):
            if not abs(up.j - low.j) <= 1 <= up.j + low.j:
                continue
            item = one_way(up, low, [piece], representation)
            back = None if states == (0, 0) else one_way(low, up, [piece], representation)
            if back is not None:
                turned = sign * (-1.0) ** (up.j - low.j) * back.T
                item = turned if item is None else item + turned
            if item is None or np.abs(item).max() < 1e-12:
                assert np.abs(computed.get((i, k), 0.0)).max() < 1e-12
                continue
            count += 1
            assert np.abs(computed[i, k] - item).max() <= 1e-14 * np.abs(item).max() + 1e-13  # two orders of summation
    assert count > 20


@pytest.mark.parametrize("body", [(0.3, 0.5, 1.2), np.diag([2.0, -1.0, -1.0]) + 0.3], ids=["vector", "second rank"])
def test_tensors_of_axial_tops_are_those_of_pairs(body):
    """|N K⟩ to N = 6, each for both signs of K, so that squares of elements with a K above 0 count twice."""
    blocks, representation = solved_rotor(Top(Constants(A=9400.0, B=3100.0)), SEMI_RIGID, [], 0, 6, None)
    rank = np.ndim(body)
    tensors = {(0, 0): body_tensor(body, rank, representation)}
    computed = by_numbers(tensors_of_stacks(stacks_of(blocks), tensors, representation))
    count = 0
    for i, up in enumerate(blocks):
        for k, low in enumerate(blocks):
            item = plain_tensor(up, low, tensors) if abs(up.j - low.j) <= rank <= up.j + low.j else None
            assert (item is None) == ((i, k) not in computed)
            if item is not None:
                count += 1
                both = 2.0 if max(up.parts[0].basis.axial_k, low.parts[0].basis.axial_k) else 1.0
                assert computed[i, k][0, 0] ** 2 == pytest.approx(
                    both * item[0, 0] ** 2, rel=1e-12
                )  # round-off of 3j symbols
    assert count > 60


def test_large_blocks_have_stacks_of_their_own():
    blocks, _ = solved_rotor(TOP, SEMI_RIGID, [], 0, 80, None)
    stacks = stacks_of(blocks)
    assert sorted(number for stack in stacks for number in stack.numbers.tolist()) == list(range(len(blocks)))
    for stack in stacks:
        assert max(stack.sizes) <= max(16, 1.5 * min(stack.sizes))
        assert (np.diff(stack.n) > 0).all()
