"""Levels and line strengths of all rigid asymmetric tops, tabulated in Ray's κ.

    E = ½(A+C) J(J+1) + ½(A-C) E_κ(κ),    κ = (2B-A-C)/(A-C) = -cos θ

(G. W. King, R. M. Hainer, P. C. Cross, J. Chem. Phys. 11, 27 (1943), eqs. 7 to 9). E_κ, its derivatives by A, B, C and the quartic
constants (S reduction, Iʳ) and the strengths S of dipole components a, b, c depend on κ only. `rotor.quantum` computes them at
Chebyshev nodes in θ; between nodes they are interpolated with an error below 1e-5 (A-C)
(`tests/assignment/test_assignment_table.py`). Distortion shifts levels to first order. Refined constants come from `rotor.fitting` with
the full Hamiltonian.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.spectra.transitions.pairs import all_transitions
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

PARAMETERS = ("A", "B", "C", "DJ", "DJK", "DK", "d1", "d2")
TYPES = "abc"
MIXED = len(TYPES)  # the type of a family of lines of several types
JMAX = 30
KA_MAX = 10  # highest J of lines; higher ones are weak at the temperatures of jets
NODES, STRENGTH_NODES = 96, 24
POINTS, STRENGTH_POINTS = 401, 101
WEAKEST = 0.02  # lines whose strength is below this at all κ are left out


@dataclass(frozen=True, eq=False)
class RigidTable:
    """Levels and lines over κ.

    theta (POINTS,) : grid, κ = -cos θ. quanta (levels, 3) : J, Ka, Kc. levels (POINTS, levels, 9) : E_κ, then ∂E/∂ of `PARAMETERS`
    upper, lower (lines,) : rows of levels. kind (lines,) : 0, 1, 2 for a, b, c. strength (STRENGTH_POINTS, lines) : S per D²
    Lines whose frequency changes sign with κ are listed twice, with upper and lower exchanged.
    """

    theta: Floats
    quanta: Ints
    levels: Floats
    upper: Ints
    lower: Ints
    kind: Ints
    strength: NDArray[np.float32]

    @cached_property
    def reduced(self) -> Floats:
        """E_κ (POINTS, levels)."""
        return np.ascontiguousarray(self.levels[:, :, 0])

    @cached_property
    def kappa(self) -> Floats:
        """Ray's κ of the grid (POINTS,)."""
        return np.asarray(-np.cos(self.theta))

    @cached_property
    def _tables_by_type(self) -> list[RigidTable]:
        return [self._selected(np.flatnonzero(self.kind == q)) for q in range(len(TYPES))]

    def with_type(self, kind: int) -> RigidTable:
        """The table with the lines of a type alone, or of all for a kind beyond those."""
        return self._tables_by_type[kind] if kind < len(TYPES) else self

    def _selected(self, lines: Ints) -> RigidTable:
        return replace(
            self, upper=self.upper[lines], lower=self.lower[lines], kind=self.kind[lines],
            strength=np.ascontiguousarray(self.strength[:, lines]),
        )  # fmt: skip

    def label(self, line: int) -> str:
        """A line as text, `3 1 2 - 2 1 1`."""
        return " - ".join(" ".join(map(str, self.quanta[row[line]].tolist())) for row in (self.upper, self.lower))


@lru_cache(maxsize=2)
def rigid_table(jmax: int = JMAX) -> RigidTable:
    """The table up to `jmax`, computed once per process (1 s)."""
    # Chebyshev nodes in θ: interpolation of smooth functions converges fast
    nodes = np.pi * (np.arange(NODES) + 0.5) / NODES
    coarse_nodes = np.pi * (np.arange(STRENGTH_NODES) + 0.5) / STRENGTH_NODES
    quanta, kind, upper, lower = _lines(jmax)
    levels = np.stack([_levels_at(-float(np.cos(theta)), jmax) for theta in nodes])
    strength = np.stack([_strengths_at(-float(np.cos(theta)), jmax)[upper, lower] for theta in coarse_nodes])

    strong = strength.max(axis=0) >= WEAKEST
    kind, upper, lower, strength = kind[strong], upper[strong], lower[strong], strength[:, strong]
    theta = np.linspace(nodes[0], nodes[-1], POINTS)
    coarse = np.linspace(nodes[0], nodes[-1], STRENGTH_POINTS)
    inside = np.clip(coarse, coarse_nodes[0], coarse_nodes[-1])
    return RigidTable(
        theta=theta,
        quanta=quanta,
        levels=np.ascontiguousarray(np.tensordot(_interpolation(nodes, theta), levels, axes=1)),
        upper=upper,
        lower=lower,
        kind=kind,
        # interpolation may leave a strength of 0 negative
        strength=np.maximum(_interpolation(coarse_nodes, inside) @ strength, 0.0).astype(np.float32),
    )


def _top(kappa: float) -> Top:
    """A top with ½(A+C) = 3 and ½(A-C) = 1."""
    constants = Constants(
        A=4.0, B=3.0 + kappa, C=2.0, DJ=0.0, DJK=0.0, DK=0.0, d1=0.0, d2=0.0, reduction="S", representation="Ir"
    )
    return Top.from_constants(constants, dipole_abc_debye=(1.0, 1.0, 1.0))


def _levels_at(kappa: float, jmax: int) -> Floats:
    """E_κ and derivatives (levels, 9)."""
    top = _top(kappa)
    levels = solve_levels(top, jmax)
    j = levels.quanta["j"]
    values = np.column_stack([levels.energy_mhz - 3.0 * j * (j + 1), level_derivatives(top, levels, PARAMETERS)])
    return np.asarray(values[_order(levels.quanta)])


def _strengths_at(kappa: float, jmax: int) -> Floats:
    """S per D² (levels, levels); each line belongs to one component of the dipole."""
    levels = solve_levels(_top(kappa), jmax)
    order = _order(levels.quanta)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    lines = all_transitions(levels, (1.0, 1.0, 1.0))
    strength = np.zeros((len(order), len(order)))
    strength[rank[lines.upper], rank[lines.lower]] = lines.strength_debye2
    strength[rank[lines.lower], rank[lines.upper]] = lines.strength_debye2
    return strength


def _order(quanta: dict[str, Ints]) -> Ints:
    """Sort levels by J, then Ka, then decreasing Kc: the order of energy within J."""
    return np.lexsort((-quanta["kc"], quanta["ka"], quanta["j"]))


@lru_cache(maxsize=2)
def _lines(jmax: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Quantum numbers of levels, and type, upper and lower level of all allowed lines."""
    levels = solve_levels(_top(0.0), jmax)
    order = _order(levels.quanta)
    quanta = np.column_stack([levels.quanta[name][order] for name in ("j", "ka", "kc")]).astype(np.int64)
    upper, lower = np.nonzero(np.abs(quanta[:, None, 0] - quanta[None, :, 0]) <= 1)
    j, ka, kc = (quanta[upper] - quanta[lower]).T
    selected = (np.minimum(quanta[upper, 1], quanta[lower, 1]) <= KA_MAX) & ((j != 0) | (upper > lower))
    change = (ka % 2) * 2 + kc % 2  # parities of the changes of Ka and Kc
    kind = np.array([-1, 0, 2, 1])[change]  # (even, odd): a, (odd, odd): b, (odd, even): c
    selected &= (kind >= 0) & ~((kind == 0) & (ka == 0) & (j < 0))
    return quanta, kind[selected], upper[selected], lower[selected]


def _interpolation(nodes: Floats, points: Floats) -> Floats:
    """Interpolation matrix (points, nodes) of the polynomial through Chebyshev nodes.

    Barycentric form, J.-P. Berrut, L. N. Trefethen, SIAM Rev. 46, 501 (2004), eqs. 4.2 and 5.3.
    """
    weights = (-1.0) ** np.arange(len(nodes)) * np.sin(nodes)  # barycentric weights of Chebyshev nodes
    apart = np.cos(points)[:, None] - np.cos(nodes)[None, :]
    hit = np.abs(apart) < 1e-15  # at a node the formula is 0/0: its value is that of the node
    terms = weights / np.where(hit, 1.0, apart)
    matrix = terms / terms.sum(axis=1, keepdims=True)
    exact = hit.any(axis=1)
    matrix[exact] = hit[exact]
    return np.asarray(matrix)
