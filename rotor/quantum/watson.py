"""The semi-rigid Hamiltonian: rigid and centrifugal terms, A and S reductions, every representation.

Every term of an effective Hamiltonian in one vibrational state is c · ½[Jz^2q, J₊^2n + J₋^2n]₊ · J^2p (n = 0:
c · J^2p Jz^2q), so a Hamiltonian is a table {(p, q, n): c in MHz}. Its matrix elements are, with X = J(J+1),

    ⟨K|H|K⟩     = Σ c X^p K^2q                                             (n = 0)
    ⟨K+2n|H|K⟩  = Σ c X^p ½[(K+2n)^2q + K^2q] √∏_{i<2n} (J-K-i)(J+K+i+1)    (n > 0)

with the phases of J∓ (body-fixed) real and positive. Names and signs: J. K. G. Watson, "Aspects of quartic and sextic
centrifugal effects", in Vibrational Spectra and Structure 6 (1977), eq. 39 (A) and table 6 (S).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.effects import QuantumEffect
from rotor.quantum.basis import REPRESENTATIONS, WangBlock

if TYPE_CHECKING:
    from rotor.constants import Constants
    from rotor.top import Top

Operators = dict[tuple[int, int, int], float]

_LINEAR = {"B": (1, 0, 0, 1), "D": (2, 0, 0, -1), "H": (3, 0, 0, 1), "L": (4, 0, 0, 1)}
_DIAGONAL_OCTIC = {"LJ": (4, 0), "LJJK": (3, 1), "LJK": (2, 2), "LKKJ": (1, 3), "LK": (0, 4)}
_DIAGONAL_DECIC = {"PJ": (5, 0), "PJJK": (4, 1), "PJK": (3, 2), "PKJ": (2, 3), "PKKJ": (1, 4), "PK": (0, 5)}
_DIAGONAL = {"J": (2, 0), "JK": (1, 1), "K": (0, 2)}
_DIAGONAL_SEXTIC = {"J": (3, 0), "JK": (2, 1), "KJ": (1, 2), "K": (0, 3)}


def _diagonal_names(quartic: str, sextic: str) -> dict[str, tuple[int, int, int, int]]:
    """(p, q, n, sign) of the terms diagonal in K, named DJ ... or DeltaJ ..., HJ ... or PhiJ ..., LJ ..., PJ ..."""
    table = {quartic + name: (*powers, 0, -1) for name, powers in _DIAGONAL.items()}
    table |= {sextic + name: (*powers, 0, 1) for name, powers in _DIAGONAL_SEXTIC.items()}
    return table | {name: (*powers, 0, 1) for name, powers in (_DIAGONAL_OCTIC | _DIAGONAL_DECIC).items()}


_SYMMETRIC = _diagonal_names("D", "H")
_A_REDUCTION = _diagonal_names("Delta", "Phi") | {
    "deltaJ": (1, 0, 1, -1), "deltaK": (0, 1, 1, -1),
    "phiJ": (2, 0, 1, 1), "phiJK": (1, 1, 1, 1), "phiK": (0, 2, 1, 1),
    "lJ": (3, 0, 1, 1), "lJK": (2, 1, 1, 1), "lKJ": (1, 2, 1, 1), "lK": (0, 3, 1, 1),
}  # fmt: skip
_S_REDUCTION = _SYMMETRIC | {
    "d1": (1, 0, 1, 1), "d2": (0, 0, 2, 1),
    "h1": (2, 0, 1, 1), "h2": (1, 0, 2, 1), "h3": (0, 0, 3, 1),
    "l1": (3, 0, 1, 1), "l2": (2, 0, 2, 1), "l3": (1, 0, 3, 1), "l4": (0, 0, 4, 1),
}  # fmt: skip


def operators_by_name(constants: Constants) -> dict[str, tuple[int, int, int, int]]:
    """(p, q, n, sign) of the operator of every name that constants of that kind and reduction can have."""
    if constants.kind in ("linear", "spherical"):
        return _LINEAR
    if constants.kind in ("prolate", "oblate"):
        return _SYMMETRIC
    return _A_REDUCTION if constants.reduction == "A" else _S_REDUCTION


def rigid_operators(constants: Constants) -> Operators:
    """½(Bx+By) J² + [Bz - ½(Bx+By)] Jz² + ¼(Bx-By)(J₊² + J₋²), axes by the representation.

    A linear or spherical top has the first term alone; z is a in a prolate and c in an oblate symmetric top.
    """
    if constants.kind in ("linear", "spherical"):
        return {(1, 0, 0): constants["B"]}
    if constants.kind in ("prolate", "oblate"):
        along, across = (
            (constants["A"], constants["B"]) if constants.kind == "prolate" else (constants["C"], constants["B"])
        )
        return {(1, 0, 0): across, (0, 1, 0): along - across}

    axes = REPRESENTATIONS[str(constants.representation)]
    bx, by, bz = (constants[axis.upper()] for axis in axes)
    return {(1, 0, 0): (bx + by) / 2, (0, 1, 0): bz - (bx + by) / 2, (0, 0, 1): (bx - by) / 4}


def centrifugal_operators(constants: Constants) -> Operators:
    """The distortion terms of the constants' own reduction and representation."""
    table = operators_by_name(constants)
    out: Operators = {}
    for name, value in constants.values.items():
        if name not in ("A", "B", "C"):
            p, q, n, sign = table[name]
            out[p, q, n] = out.get((p, q, n), 0.0) + sign * value
    return out


class Rigid(QuantumEffect):
    """The rigid rotor: A, B, C."""

    def operators(self, top: Top) -> Operators:
        """Coefficients in MHz, see `rigid_operators`."""
        return rigid_operators(top.constants)

    def estimate_mhz(self, top: Top, j: int) -> float:
        """A J(J+1) bounds the rigid energy."""
        return max(top.constants.values.values()) * j * (j + 1)


class Centrifugal(QuantumEffect):
    """Centrifugal distortion of every order that the constants carry."""

    def operators(self, top: Top) -> Operators:
        """Coefficients in MHz, see `centrifugal_operators`."""
        return centrifugal_operators(top.constants)

    def estimate_mhz(self, top: Top, j: int) -> float:
        """Every term at K = J, all added in size."""
        x = j * (j + 1.0)
        terms = self.operators(top).items()
        return float(sum(abs(c) * x**p * float(j) ** (2 * q) * (2 * x**n if n else 1.0) for (p, q, n), c in terms))


def scalar_energy(operators: Operators, j: int) -> float:
    """The part that is one number for the whole of J, Σ c X^p, kept out of the matrices for the sake of digits."""
    x = j * (j + 1)
    return float(sum(c * x**p for (p, q, n), c in operators.items() if q == n == 0))


class Multiplet:
    """Matrix elements of all |J K⟩ of one J, from which its four Wang blocks are cut; the scalar part left out."""

    def __init__(self, operators: Operators, j: int) -> None:
        self.order = max((n for _, _, n in operators), default=0)
        self._margin = 2 * self.order  # K starts at -margin, so that folded elements are at hand
        k = np.arange(-self._margin, j + 1)
        steps = _ladder_steps(j, np.arange(-self._margin, j + self._margin + 1))
        with np.errstate(over="ignore", invalid="ignore"):  # said where the block is diagonalised
            self._elements = [_elements(operators, j, k, n, steps) for n in range(self.order + 1)]

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

    squares = (k * k).astype(float)
    if n == 0:
        return np.asarray(np.polyval(coefficients, squares))
    total = 0.5 * (np.polyval(coefficients, squares) + np.polyval(coefficients, (k + 2.0 * n) ** 2))
    for i in range(2 * n):
        total *= steps[i : i + len(k)]
    return np.asarray(total)


def block_bands(multiplet: Multiplet, block: WangBlock) -> list[NDArray[np.float64]]:
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
