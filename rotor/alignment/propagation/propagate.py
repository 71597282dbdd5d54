"""Propagation of a block of states through a window of a pulse, all columns together.

If a single operator W acts, V(t) = -u(t) W, then H = H0 + V is split into drifts, diagonal in the free states, and kicks, diagonal
in the eigenvectors of W in the block (a discrete variable representation of the angle). Time advances with the drifts. The states are
represented in the eigenvectors of W, where a drift is the matrix Q† exp(-i E a h) Q, computed once for each a. Three splittings:

- `nystrom 4`, `nystrom 6`: for a rigid body [V, [V, [V, H0]]] = 0, because H0 is of second order in the momenta, so that the
  Runge-Kutta-Nyström compositions SRKN6b (order 4, 6 drifts) and SRKN11b (order 6, 11 drifts) of S. Blanes and P. C. Moan serve
  (J. Comput. Appl. Math. 142, 313 (2002), table 3);
- `gradient`: for linear and symmetric tops ½ [V, [H0, V]] = B (dV/dθ)² is known at the eigenvectors too, and the splitting of
  order 4 with 2 drifts of S. A. Chin (Phys. Lett. A 226, 344 (1997)) is the cheapest for short pulses.

If several operators act at once (light and a THz field, crossed polarizations), or a block is too large to diagonalise, each
step is the product of two exponentials of the commutator-free Magnus method of order 4 (S. Blanes and P. C. Moan, Appl. Numer.
Math. 56, 1519 (2006)), each evaluated as a Chebyshev series (H. Tal-Ezer and R. Kosloff, J. Chem. Phys. 81, 3967 (1984)). A kick is
a diagonal phase. Tests measure the orders.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.alignment.propagation.timeline import Window
from rotor.arrays import Floats, Ints

Complexes = NDArray[np.complex128]

# drifts and kicks of half a step, the rest by symmetry and Σ = 1
_NYSTROM_4 = (
    (0.245298957184271, 0.604872665711080),
    (0.0829844064174052, 0.396309801498368, -0.0390563049223486),
)
_NYSTROM_6 = (
    (0.123229775946271, 0.290553797799558, -0.127049212625417, -0.246331761062075, 0.357208872795928),
    (0.0414649985182624, 0.198128671918067, -0.0400061921041533, 0.0752539843015807, -0.0115113874206879),
)
CHEBYSHEV_BELOW = 1e-14  # smaller terms of the series are neglected
_INSIDE = 1e-9  # of a step
CHECKS = 8  # approximate number of leakage checks inside a window
SNAPSHOT_NUMBERS = 1 << 20  # complex numbers of snapshots held at once
PRODUCTS_OF_A_CALL = 1 << 27  # complex products of one call of the compiled loop, 0.1 to 0.5 s


@dataclass(frozen=True)
class Splitting:
    """A symmetric composition: kick b[0], drift a[0], kick b[1], ..., kick b[-1] of a step, of `order`.

    gradients: shares of h³ [V, [H0, V]]/2 in the kicks, 0 where there are none.
    """

    order: int
    drifts: Floats
    kicks: Floats
    gradients: Floats

    @cached_property
    def nodes(self) -> Floats:
        """Times of the kicks in steps; those at the ends are just inside, since the pulse may jump there."""
        return np.asarray(np.clip(np.concatenate([[0.0], np.cumsum(self.drifts)]), _INSIDE, 1 - _INSIDE))

    @cached_property
    def different_drifts(self) -> tuple[Floats, Ints]:
        """The distinct durations of drifts, and the index of each drift among them."""
        shares, which = np.unique(self.drifts, return_inverse=True)
        return shares, which.ravel()


SPLITTINGS = ("gradient", "nystrom 4", "nystrom 6")


@lru_cache(maxsize=8)
def splitting(name: str) -> Splitting:
    """A composition by its name in `SPLITTINGS`: order 4 with 2, order 4 with 6, order 6 with 11 drifts a step.

    >>> splitting("nystrom 4").drifts.sum().round(15), splitting("nystrom 6").kicks.sum().round(15)
    (np.float64(1.0), np.float64(1.0))
    """
    if name == "gradient":
        return Splitting(4, np.array([0.5, 0.5]), np.array([1.0, 4.0, 1.0]) / 6, np.array([0.0, 1 / 36, 0.0]))
    if name == "nystrom 4":
        (a1, a2), first = _NYSTROM_4
        a = [a1, a2, 0.5 - a1 - a2]
        b = [*first, 1 - 2 * sum(first)]
        return Splitting(4, np.array([*a, *a[::-1]]), np.array([*b, *b[-2::-1]]), np.zeros(7))
    if name == "nystrom 6":
        half, kicks = _NYSTROM_6
        a = [*half, 1 - 2 * sum(half)]
        b = [*kicks, 0.5 - sum(kicks)]
        return Splitting(6, np.array([*a, *a[-2::-1]]), np.array([*b, *b[::-1]]), np.zeros(12))
    raise ValueError(f"splitting {name!r}: known are {', '.join(SPLITTINGS)}")


@dataclass(frozen=True)
class Grid:
    """Intervals of a window with equal steps, (n,) each; the observables are evaluated after those with `sampled`."""

    starts: Floats
    steps: Floats
    counts: Ints
    sampled: NDArray[np.bool_]

    @property
    def steps_taken(self) -> int:
        """All steps."""
        return int(self.counts.sum())

    @property
    def stages(self) -> int:
        """The cost of a run, in exponentials."""
        return 2 * self.steps_taken

    def refined(self, factor: int) -> Grid:
        """These intervals with `factor` times as many steps."""
        return Grid(self.starts, self.steps / factor, self.counts * factor, self.sampled)


def step_grid(window: Window, longest_step_ps: float, times_ps: Floats) -> Grid:
    """Steps no longer than `longest_step_ps` that meet the window's breaks and all `times_ps` inside it."""
    first, last = np.searchsorted(times_ps, window.start_ps, "right"), np.searchsorted(times_ps, window.stop_ps)
    inside = times_ps[first:last]
    edges = np.unique(np.concatenate([[window.start_ps, window.stop_ps], window.breaks_ps, inside]))
    lengths = np.diff(edges)
    # a quotient that is whole but for round-off makes no further step
    counts = np.maximum(1, np.ceil(lengths / longest_step_ps - 1e-9)).astype(np.int64)
    return Grid(edges[:-1], lengths / counts, counts, _among(edges[1:], inside))


def _among(values: NDArray[Any], sorted_values: NDArray[Any]) -> NDArray[np.bool_]:
    """Which values are among `sorted_values`; for few values `np.isin` takes longer than a step."""
    if not len(sorted_values):
        return np.zeros(len(values), dtype=bool)
    place = np.minimum(np.searchsorted(sorted_values, values), len(sorted_values) - 1)
    return np.asarray(sorted_values[place] == values)


@dataclass(frozen=True)
class KickPlan:
    """Integration of a window by a splitting, common to all blocks.

    durations: (kinds,) distinct durations of drifts. which: (stages,) the drift after each kick. areas: (stages + 1,) u(t) times the
    duration of each kick; the last kick of a step and the first of the next are merged. gradients: u(t)² times h³ and its share; None
    without gradients. marks: (stages,) whether the states are examined after a drift. sampled: (marks,) whether for the observables.
    steps_taken: number of steps.
    """

    durations: Floats
    which: Ints
    areas: Floats
    gradients: Floats | None
    marks: NDArray[np.bool_]
    sampled: NDArray[np.bool_]
    steps_taken: int

    @property
    def stages(self) -> int:
        """The cost of a run, in drifts."""
        return len(self.which)


def kick_plan(window: Window, grid: Grid, rule: Splitting) -> KickPlan:
    """The kicks and drifts of a window with a single channel.

    The observables are functions of the angle, which a kick does not change, so they can be evaluated between drifts. Kicks at the
    ends of a step are evaluated just inside it, since the pulse may jump there.
    """
    stages = len(rule.drifts)
    steps, last = np.repeat(grid.steps, grid.counts), np.cumsum(grid.counts)
    number = np.arange(len(steps)) - np.repeat(last - grid.counts, grid.counts)  # of each step in its stretch
    starts = np.repeat(grid.starts, grid.counts) + steps * number
    times = starts[:, None] + np.multiply.outer(steps, rule.nodes)
    strength = window.channels[0].strength(times.ravel()).reshape(times.shape)
    areas = _merged(strength * rule.kicks * steps[:, None])
    gradients = _merged(strength**2 * rule.gradients * steps[:, None] ** 3) if rule.gradients.any() else None

    # 13 decimals: equal steps that round differently share one drift
    lengths, kind = _different(np.round(grid.steps, 13))
    shares, share = rule.different_drifts
    durations = np.multiply.outer(lengths, shares).ravel()
    which = np.add.outer(np.repeat(kind, grid.counts) * len(shares), share).ravel()
    piece = max(1, len(steps) // CHECKS) * stages  # whole steps stay in one piece
    marks, observed = np.zeros((2, len(areas) - 1), dtype=bool)
    observed[last[grid.sampled] * stages - 1] = True
    marks[piece - 1 :: piece] = True
    marks |= observed
    return KickPlan(
        np.asarray(durations, dtype=np.float64),
        which.ravel(),
        areas,
        gradients,
        marks,
        observed[marks],
        len(steps),
    )


def _different(values: Floats) -> tuple[Floats, Ints]:
    """Distinct values in increasing order, and the index of each value; for few values `np.unique` takes longer than a step."""
    listed = values.tolist()
    place = {value: number for number, value in enumerate(sorted(set(listed)))}
    return np.array(list(place)), np.array([place[value] for value in listed])


def _merged(table: Floats) -> Floats:
    """Kicks of steps (steps, kicks) as one sequence (stages + 1,); the last kick of a step is added to the first of the next."""
    stages = table.shape[1] - 1
    out = np.append(table[:, :-1].ravel(), 0.0)
    out[stages::stages] += table[:, -1]
    return out


@dataclass(frozen=True)
class Decomposed:
    """Eigenvalues (n,) and eigenvectors (n, n) in columns of the operator W of a channel in a block.

    gradient: if W is a function of one angle, ½ [W, [H0, W]] = B (dW/dθ)² at the eigenvalues (n,), in rad/ps times the unit of W².
    """

    values: Floats
    vectors: NDArray[Any]
    gradient: Floats | None = None

    def phases(self, areas: Floats, gradients: Floats | None) -> Complexes:
        """Phase factors (kicks, n) of kicks with `areas` (kicks,) and with those of the gradient."""
        angles = np.multiply.outer(areas, self.values)
        if gradients is not None and self.gradient is not None:
            angles += np.multiply.outer(gradients, self.gradient)
        out = np.empty(angles.shape, dtype=np.complex128)
        np.cos(angles, out=out.real)
        np.sin(angles, out=out.imag)
        return out


def decompose(matrix: Any) -> Decomposed:
    """Eigenvalues and vectors of a dense or sparse Hermitian matrix; LAPACK's tridiagonal solver if it applies."""
    matrix = matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
    size = len(matrix)
    if size > 2 and not np.iscomplexobj(matrix) and _is_tridiagonal(matrix):
        from scipy.linalg.lapack import dstevd

        values, vectors, info = dstevd(np.diag(matrix).copy(), np.diag(matrix, 1).copy())
        if info == 0:
            return Decomposed(values, vectors)
    values, vectors = np.linalg.eigh(matrix)
    return Decomposed(values, vectors)


def _is_tridiagonal(matrix: Floats) -> bool:
    beside = np.count_nonzero(np.diagonal(matrix, 1)) + np.count_nonzero(np.diagonal(matrix, -1))
    return int(np.count_nonzero(matrix)) == np.count_nonzero(np.diagonal(matrix)) + beside


def split_through(
    plan: KickPlan,
    energies: Floats,
    operator: Decomposed,
    states: Complexes,
    edge: NDArray[np.bool_],
    snapshots: list[Complexes] | None = None,
) -> tuple[Complexes, Floats]:
    """States (n, m) in the free basis after a window with one channel, and the largest edge population of each.

    Parameters
    ----------
    plan : KickPlan
        Of the window.
    energies : (n,) rad/ps
        Of the free states.
    operator : Decomposed
        Of the channel in this block.
    states : (n, m)
        At the start of the window.
    edge : (n,) of bool
        The states whose population is leakage; checked about a dozen times.
    snapshots : list, optional
        The states at the sampled times, (times, n, m) in pieces, are appended.

    Returns
    -------
    states : (n, m) array
        At the end of the window.
    leaked : (m,) array
        Largest population at the edge.
    """
    from rotor.alignment.propagation._kernels import kick_and_drift

    vectors = operator.vectors
    here = np.ascontiguousarray(vectors.conj().T @ states)
    drifts = _drift_matrices(plan.durations, energies, vectors)
    phases = operator.phases(plan.areas, plan.gradients)
    leaked, looks = np.zeros(states.shape[1]), 0
    for piece in _pieces(plan.marks, states.shape):
        marks = plan.marks[piece]
        seen = np.empty((int(marks.sum()), *states.shape), dtype=np.complex128)
        kick_and_drift(here, drifts, plan.which[piece], phases[piece], marks, seen)
        leaked = np.maximum(leaked, (np.abs(vectors[edge] @ seen) ** 2).sum(axis=1).max(axis=0, initial=0.0))
        sampled = plan.sampled[looks : looks + len(seen)]
        looks += len(seen)
        if snapshots is not None and sampled.any():
            snapshots.append(vectors @ seen[sampled])
    here *= phases[-1][:, None]
    return np.asarray(vectors @ here), leaked


def _pieces(marks: NDArray[np.bool_], shape: tuple[int, ...]) -> list[slice]:
    """Split the stages into pieces whose snapshots of states (n, m) fit into memory; between pieces, signals are handled."""
    size, columns = shape
    at_once = max(1, SNAPSHOT_NUMBERS // max(size * columns, 1))
    stages = max(1, PRODUCTS_OF_A_CALL // max(size * size * columns, 1))
    ends = np.flatnonzero(marks)[at_once - 1 :: at_once] + 1
    edges = np.unique(np.concatenate([np.arange(0, len(marks), stages), ends, [len(marks)]])).tolist()
    return [slice(first, last) for first, last in itertools.pairwise(edges)]


def _drift_matrices(durations: Floats, energies: Floats, vectors: NDArray[Any]) -> Complexes:
    """Q† exp(-i E d) Q for all durations, (durations, n, n)."""
    angles = np.multiply.outer(durations, energies)
    out = np.empty((len(durations), *vectors.shape), dtype=np.complex128)
    if np.iscomplexobj(vectors):
        np.matmul(vectors.conj().T, np.exp(-1j * angles)[:, :, None] * vectors, out=out)
    else:  # two real products
        out.real = vectors.T @ (np.cos(angles)[:, :, None] * vectors)
        out.imag = vectors.T @ (-np.sin(angles)[:, :, None] * vectors)
    return out


def kick_through(area: float, operator: Decomposed, states: Complexes) -> Complexes:
    """States (n, m) after exp(i area W)."""
    turned = np.exp(1j * area * operator.values)[:, None] * (operator.vectors.conj().T @ states)
    return np.asarray(operator.vectors @ turned)


def magnus_through(
    window: Window,
    grid: Grid,
    energies: Floats,
    operators: Sequence[Any],
    states: Complexes,
    edge: NDArray[np.bool_],
    snapshots: list[Complexes] | None = None,
) -> tuple[Complexes, Floats]:
    """States after a window with any channels, and the largest edge population of each; see `split_through`.

    Parameters
    ----------
    window : Window
        Its channels give the strength of each operator over time.
    grid : Grid
        Steps, and which of them end at a sampled time.
    energies : (n,) array
        Of the free states, rad/ps.
    operators : sequence of (n, n) arrays
        Dense or sparse, one for each channel.
    states : (n, m) array
        At the start of the window.
    edge : (n,) array of bool
        The states whose population is leakage.
    snapshots : list, optional
        The states at the sampled times, (times, n, m) in pieces, are appended.

    Returns
    -------
    states : (n, m) array
        At the end of the window.
    leaked : (m,) array
        Largest population at the edge.
    """
    # Gauss points of order 4, as Magnus expansions use them
    first, second = 0.5 - math.sqrt(3) / 6, 0.5 + math.sqrt(3) / 6
    large, small = 0.25 + math.sqrt(3) / 6, 0.25 - math.sqrt(3) / 6
    reach = [_norm_bound(operator) for operator in operators]
    leaked = np.zeros(states.shape[1])
    for start, step, count, sampled in zip(grid.starts, grid.steps, grid.counts, grid.sampled, strict=True):
        begins = start + step * np.arange(count)
        early = np.array([channel.strength(begins + first * step) for channel in window.channels])
        late = np.array([channel.strength(begins + second * step) for channel in window.channels])
        for u1, u2 in zip(early.T, late.T, strict=True):
            for weights in (large * u1 + small * u2, small * u1 + large * u2):
                states = _chebyshev(0.5 * step * energies, -step * weights, operators, reach, states)
            leaked = np.maximum(leaked, (np.abs(states[edge]) ** 2).sum(axis=0))
        if sampled and snapshots is not None:
            snapshots.append(states[None])
    return states, leaked


def _norm_bound(operator: Any) -> float:
    """The largest row sum of absolute values, an upper bound of the eigenvalues."""
    return float(np.max(abs(operator).sum(axis=1)))  # the row sum bounds the norm of a Hermitian operator


def _chebyshev(
    diagonal: Floats, factors: Floats, operators: Sequence[Any], reach: list[float], states: Complexes
) -> Complexes:
    """exp(-i (diagonal + Σ factor operator)) states by Σ (2 - δ_n0) (-i)^n J_n(R) T_n(H/R), with H shifted to its centre."""
    from scipy.special import jv

    # the spectrum is moved to the middle of [-1, 1] for Chebyshev polynomials
    centre = (diagonal.max() + diagonal.min()) / 2
    radius = (diagonal.max() - diagonal.min()) / 2 + sum(abs(f) * r for f, r in zip(factors, reach, strict=True))
    if radius == 0:
        return np.asarray(np.exp(-1j * centre) * states)
    # Bessel functions fall steeply beyond order R + some R^(1/3)
    terms = int(radius + 12 + 8 * radius ** (1 / 3)) + 8
    coefficients = jv(np.arange(terms), radius)
    last = int(np.flatnonzero(np.abs(coefficients) > CHEBYSHEV_BELOW)[-1])
    scaled = ((diagonal - centre) / radius)[:, None]

    def applied(vectors: Complexes) -> Complexes:
        out = scaled * vectors
        for factor, operator in zip(factors, operators, strict=True):
            if factor:
                out += (factor / radius) * (operator @ vectors)
        return np.asarray(out)

    before, now = states, -1j * applied(states)
    total = coefficients[0] * before + 2 * coefficients[1] * now
    for n in range(2, last + 1):
        before, now = now, -2j * applied(now) + before
        total += 2 * coefficients[n] * now
    return np.asarray(np.exp(-1j * centre) * total)
