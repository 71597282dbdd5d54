"""The semi-rigid Hamiltonian: rigid and centrifugal terms, A and S reductions, every representation.

Every term of an effective Hamiltonian in one vibrational state is c · ½[Jz^2q, J₊^2n + J₋^2n]₊ · J^2p (n = 0:
c · J^2p Jz^2q), so a Hamiltonian is a table {(p, q, n): c in MHz}. Its matrix elements are, with X = J(J+1),

    ⟨K|H|K⟩     = Σ c X^p K^2q                                             (n = 0)
    ⟨K+2n|H|K⟩  = Σ c X^p ½[(K+2n)^2q + K^2q] √∏_{i<2n} (J-K-i)(J+K+i+1)    (n > 0)

with the phases of J∓ (body-fixed) real and positive. Which name stands for which term: `rotor.tops.operators`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.quantum.basis import WangBlock
from rotor.quantum.effect import QuantumEffect
from rotor.tops.operators import Operators, Powers, axes_of, distortion_terms, powers_of_spelled

if TYPE_CHECKING:
    from rotor.tops.constants import Constants
    from rotor.tops.top import Top


def operators_by_name(constants: Constants) -> dict[str, Operators]:
    """∂H/∂c of every constant c that the set has, by name: H is the sum of them times the constants.

    >>> from rotor.tops.constants import Constants
    >>> operators_by_name(Constants(A=9.0, B=3.0, C=2.0))["C"]
    {(1, 0, 0): 0.5, (0, 1, 0): -0.5, (0, 0, 1): -0.25}
    """
    return {name: operators_of_name(constants, name) for name in constants.values}


def operators_of_name(constants: Constants, name: str) -> Operators:
    """∂H/∂c of one name of the vocabulary that a set of constants has, whether or not it is in the set.

    >>> from rotor.tops.constants import Constants
    >>> operators_of_name(Constants(A=9.0, B=3.0, C=2.0, reduction="A"), "DeltaJ")
    {(2, 0, 0): -1.0}
    """
    table = _rigid_terms(constants) | distortion_terms(constants.kind, constants.reduction)
    return table[name] if name in table else {_powers(name): 1.0}


def _powers(name: str) -> Powers:
    powers = powers_of_spelled(name)
    if powers is None:
        raise ValueError(f"{name} has no operator here")
    return powers


def _rigid_terms(constants: Constants) -> dict[str, Operators]:
    """½(Bx+By) J² + [Bz - ½(Bx+By)] Jz² + ¼(Bx-By)(J₊² + J₋²) taken apart, axes by the representation.

    A linear or spherical top has the first term alone; z is a in a prolate and c in an oblate symmetric top. Where
    equal constants are given twice, B is the one that counts.
    """
    if constants.kind in ("linear", "spherical"):
        return {"A": {}, "C": {}, "B": {(1, 0, 0): 1.0}}
    if constants.kind in ("prolate", "oblate"):
        along, equal = ("A", "C") if constants.kind == "prolate" else ("C", "A")
        return {along: {(0, 1, 0): 1.0}, "B": {(1, 0, 0): 1.0, (0, 1, 0): -1.0}, equal: {}}
    x, y, z = (axis.upper() for axis in axes_of(str(constants.representation)))
    return {
        z: {(0, 1, 0): 1.0},
        x: {(1, 0, 0): 0.5, (0, 1, 0): -0.5, (0, 0, 1): 0.25},
        y: {(1, 0, 0): 0.5, (0, 1, 0): -0.5, (0, 0, 1): -0.25},
    }


def _added(constants: Constants, names: Iterable[str]) -> Operators:
    by_name = operators_by_name(constants)
    total: Operators = {}
    for name in names:
        for powers, factor in by_name[name].items():
            total[powers] = total.get(powers, 0.0) + factor * constants.values[name]
    return total


def rigid_operators(constants: Constants) -> Operators:
    """The terms of A, B, C."""
    return _added(constants, [name for name in constants.values if name in "ABC"])


def centrifugal_operators(constants: Constants) -> Operators:
    """The distortion terms of the constants' own reduction and representation, and those without a name."""
    return _added(constants, [name for name in constants.values if name not in "ABC"])


class Rigid(QuantumEffect):
    """The rigid rotor: A, B, C."""

    name = "rigid rotor"

    def parameters(self, top: Top) -> dict[str, float]:
        """A, B, C in MHz, those that the set has."""
        return {name: value for name, value in top.constants.values.items() if name in "ABC"}

    def operators(self, top: Top) -> dict[str, Operators]:
        """∂H/∂A, ∂H/∂B, ∂H/∂C."""
        return {name: terms for name, terms in operators_by_name(top.constants).items() if name in "ABC"}

    def size_mhz(self, top: Top, j: int) -> float:
        """A J(J+1) bounds the rigid energy."""
        return max(self.parameters(top).values()) * j * (j + 1)


class Centrifugal(QuantumEffect):
    """Centrifugal distortion of every order that the constants carry."""

    name = "centrifugal distortion"

    def parameters(self, top: Top) -> dict[str, float]:
        """The distortion constants in MHz."""
        return {name: value for name, value in top.constants.values.items() if name not in "ABC"}

    def operators(self, top: Top) -> dict[str, Operators]:
        """∂H/∂c of every distortion constant."""
        return {name: terms for name, terms in operators_by_name(top.constants).items() if name not in "ABC"}

    def size_mhz(self, top: Top, j: int) -> float:
        """Every term at K = J, all added in size."""
        x = j * (j + 1.0)
        terms = centrifugal_operators(top.constants).items()
        return float(sum(abs(c) * x**p * float(j) ** (2 * q) * (2 * x**n if n else 1.0) for (p, q, n), c in terms))


SEMI_RIGID: tuple[QuantumEffect, ...] = (Rigid(), Centrifugal())


def scalar_energy(operators: Operators, j: int) -> float:
    """The part that is one number for the whole of J, Σ c X^p, left out of the matrices for the sake of digits."""
    x = j * (j + 1)
    return float(sum(c * x**p for (p, q, n), c in operators.items() if q == n == 0))


class JMatrix:
    """Matrix elements of all |J K⟩ of one J, from which its four Wang blocks are cut; the scalar part left out."""

    def __init__(self, operators: Operators, j: int) -> None:
        self.order = max((n for _, _, n in operators), default=0)
        self._margin = 2 * self.order  # K starts at -margin, so that folded elements are at hand
        k = np.arange(-self._margin, j + 1)
        steps = _ladder_steps(j, np.arange(-self._margin, j + self._margin + 1))
        with np.errstate(over="ignore", invalid="ignore"):  # said where the block is diagonalised
            self._elements = [_elements(operators, j, k, n, steps) for n in range(self.order + 1)]

    def element(self, k: NDArray[np.int64], n: int) -> NDArray[np.float64]:
        """⟨K+2n|H|K⟩ for K from -2 `order` to J; zero where K + 2n is beyond J."""
        return self._elements[n][self._margin + k]

    def folded(self, low: int, n: int) -> float:
        """⟨2n - low|H|-low⟩, which connects K = low and K = 2n - low of a Wang block."""
        return float(self._elements[n][self._margin - low])

    def band(self, block: WangBlock, n: int) -> NDArray[np.float64]:
        """⟨K+2n|H|K⟩ over the K of a block, size - n of them."""
        first = self._margin + block.first_k
        return self._elements[n][first : first + 2 * (block.size - n) : 2].copy()


def _ladder_steps(j: int, k: NDArray[np.int64]) -> NDArray[np.float64]:
    """√(J(J+1) - K(K+1)), what J₊ makes of |J K⟩; zero outside the multiplet."""
    return np.asarray(np.sqrt(np.maximum((j - k) * (j + k + 1), 0)))


def _elements(
    operators: Operators, j: int, k: NDArray[np.int64], n: int, steps: NDArray[np.float64]
) -> NDArray[np.float64]:
    """⟨K+2n|H|K⟩ = ½[P((K+2n)²) + P(K²)] times the ladder, P(y) = Σ_q y^q Σ_p c X^p."""
    x = float(j * (j + 1))
    powers = [(p, q, c) for (p, q, order), c in operators.items() if order == n and (n or q)]
    coefficients = np.zeros(1 + max((q for _, q, _ in powers), default=0))
    for p, q, c in powers:
        coefficients[-1 - q] += c * x**p

    squares = np.arange(k[0], k[-1] + 2 * n + 1.0) ** 2
    values = np.full(len(squares), coefficients[0])
    for coefficient in coefficients[1:].tolist():
        values *= squares
        values += coefficient
    if n == 0:
        return values
    total = 0.5 * (values[: len(k)] + values[2 * n :])
    for i in range(2 * n):
        total *= steps[i : i + len(k)]
    return np.asarray(total)


def block_bands(multiplet: JMatrix, block: WangBlock) -> list[NDArray[np.float64]]:
    """Diagonals of the block's matrix, without the scalar part: the n-th has the elements (i+n, i), size - n of them.

    ⟨K' s|H|K s⟩ = ⟨K'|H|K⟩ + s ⟨K'|H|-K⟩, times √2 where one of them is K = 0. The second term is there where
    K + K' = 2n and folds an operator of high n back to lower diagonals.
    """
    bands = [multiplet.band(block, n) for n in range(min(multiplet.order, block.size - 1) + 1)]
    if block.first_k == 0:
        for band in bands[1:]:
            band[0] *= np.sqrt(2)

    last = block.first_k + 2 * (block.size - 1)
    for n in range(1, multiplet.order + 1):
        for low in range(max(block.first_k, 2 - block.first_k % 2), n + 1, 2):
            high = 2 * n - low
            if high <= last:
                bands[(high - low) // 2][(low - block.first_k) // 2] += block.sign * multiplet.folded(low, n)
    return bands
