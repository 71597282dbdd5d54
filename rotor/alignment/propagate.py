"""One block of states carried through one window of a pulse, all its columns at once.

Where one operator W acts, V(t) = -u(t) W, H = H0 + V is split into drifts, diagonal over the free states, and kicks, diagonal
over the eigenvectors of W in the block (a discrete variable representation of the angle). For a rigid body [V, [V, [V, H0]]] = 0,
because H0 has two derivatives, so the Runge-Kutta-Nyström compositions of S. Blanes and P. C. Moan (J. Comput. Appl. Math. 142, 313
(2002), table 3: SRKN6b of order 4, SRKN11b of order 6) serve, whose errors are a hundred times smaller than Yoshida's; a test
measures both orders. Time goes on with the drifts. The states live in the eigenvectors of W, where a drift is the matrix
Q† exp(-i E a h) Q, made once for each a.

Where several operators act at once (light and a THz field, crossed polarizations), each step is the product of two exponentials of
the commutator-free Magnus method of order 4 (S. Blanes and P. C. Moan, Appl. Numer. Math. 56, 1519 (2006), eq. 43), each of them a
Chebyshev series (H. Tal-Ezer and R. Kosloff, J. Chem. Phys. 81, 3967 (1984)). A kick is a diagonal phase.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.alignment.timeline import Window
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
CHEBYSHEV_BELOW = 1e-14  # terms of the series below it are left out
CHECKS = 12  # how often, about, leakage is looked at inside a window
SNAPSHOT_NUMBERS = 1 << 20  # complex numbers of snapshots held at once


@dataclass(frozen=True)
class Splitting:
    """A symmetric composition: kick b[0], drift a[0], kick b[1], ..., kick b[-1] of a step, of `order`."""

    order: int
    drifts: Floats
    kicks: Floats

    @property
    def nodes(self) -> Floats:
        """When each kick acts, in steps."""
        return np.concatenate([[0.0], np.cumsum(self.drifts)])


def nystrom(order: int) -> Splitting:
    """The composition of order 4 (6 drifts a step) or 6 (11 drifts).

    >>> nystrom(4).drifts.sum().round(15), nystrom(6).kicks.sum().round(15)
    (np.float64(1.0), np.float64(1.0))
    """
    if order == 4:
        (a1, a2), kicks = _NYSTROM_4
        a = [a1, a2, 0.5 - a1 - a2]
        b = [*kicks, 1 - 2 * sum(kicks)]
        return Splitting(4, np.array([*a, *a[::-1]]), np.array([*b, *b[-2::-1]]))
    if order == 6:
        half, kicks = _NYSTROM_6
        a = [*half, 1 - 2 * sum(half)]
        b = [*kicks, 0.5 - sum(kicks)]
        return Splitting(6, np.array([*a, *a[-2::-1]]), np.array([*b, *b[::-1]]))
    raise ValueError(f"splittings of order 4 and 6 exist; got {order!r}")


@dataclass(frozen=True)
class Grid:
    """Stretches of a window with equal steps, (n,) each; after those with `sampled` the observables are taken."""

    starts: Floats
    steps: Floats
    counts: Ints
    sampled: NDArray[np.bool_]

    @property
    def total(self) -> int:
        """All steps."""
        return int(self.counts.sum())

    def refined(self, factor: int) -> Grid:
        """The same stretches with `factor` times as many steps."""
        return Grid(self.starts, self.steps / factor, self.counts * factor, self.sampled)


def grid_of(window: Window, longest_step_ps: float, times_ps: Floats) -> Grid:
    """Steps no longer than `longest_step_ps` that meet the window's breaks and all `times_ps` inside it."""
    inside = times_ps[(times_ps > window.start_ps) & (times_ps < window.stop_ps)]
    edges = np.unique(np.concatenate([[window.start_ps, window.stop_ps], window.breaks_ps, inside]))
    lengths = np.diff(edges)
    counts = np.maximum(1, np.ceil(lengths / longest_step_ps - 1e-9)).astype(np.int64)
    return Grid(edges[:-1], lengths / counts, counts, np.isin(edges[1:], inside))


@dataclass(frozen=True)
class KickPlan:
    """For each stretch of a grid: u(t) times the duration of every kick, (kicks,), and the step. Shared by all blocks."""

    splitting: Splitting
    grid: Grid
    areas: tuple[Floats, ...]


def kick_plan(window: Window, grid: Grid, splitting: Splitting) -> KickPlan:
    """The kicks of the one channel of a window; those at the end of a step and the start of the next are one."""
    strength = window.channels[0].strength
    areas = []
    for start, step, count in zip(grid.starts, grid.steps, grid.counts, strict=True):
        times = start + step * (np.arange(count)[:, None] + splitting.nodes)
        table = strength(times.ravel()).reshape(times.shape) * splitting.kicks * step
        merged = np.append(table[:, :-1].ravel(), 0.0)
        merged[:: len(splitting.drifts)][1:] += table[:, -1]
        areas.append(merged)
    return KickPlan(splitting, grid, tuple(areas))


@dataclass(frozen=True)
class Decomposed:
    """Eigenvalues (n,) and eigenvectors (n, n) in columns of the operator W of a channel in a block."""

    values: Floats
    vectors: NDArray[Any]


def decompose(matrix: NDArray[Any]) -> Decomposed:
    """Of a Hermitian matrix; LAPACK's tridiagonal solver where it has one band."""
    size = len(matrix)
    if size > 2 and not matrix[np.triu_indices(size, 2)].any() and not np.iscomplexobj(matrix):
        from scipy.linalg.lapack import dstevd

        values, vectors, info = dstevd(np.diag(matrix).copy(), np.diag(matrix, 1).copy())
        if info == 0:
            return Decomposed(values, vectors)
    values, vectors = np.linalg.eigh(matrix)
    return Decomposed(values, vectors)


def split_through(
    plan: KickPlan,
    energies: Floats,
    operator: Decomposed,
    states: Complexes,
    edge: NDArray[np.bool_],
    snapshots: list[Complexes] | None = None,
) -> tuple[Complexes, Floats]:
    """States (n, m) over the free states after a window with one channel, and each one's largest population at the edge.

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
        The states whose population is leakage, looked at a dozen times.
    snapshots : list, optional
        The states at every sampled time are appended.
    """
    from rotor.alignment._kernels import kick_and_drift

    vectors = operator.vectors
    here = np.ascontiguousarray(vectors.conj().T @ states)
    matrices: dict[float, Complexes] = {}
    stages, piece = len(plan.splitting.drifts), max(1, plan.grid.total // CHECKS)
    leaked = np.zeros(states.shape[1])
    for step, count, area, sampled in zip(plan.grid.steps, plan.grid.counts, plan.areas, plan.grid.sampled, strict=True):
        key = round(float(step), 12)
        if key not in matrices:
            matrices[key] = _drift_matrices(plan.splitting.drifts * step, energies, vectors)
        phases = _phases(area, operator.values)
        for first in range(0, count, piece):
            last = min(first + piece, count)
            mine = phases[first * stages : last * stages + 1]
            if first:
                mine = np.concatenate([np.ones((1, len(energies))), mine[1:]])  # its first kick has been made
            kick_and_drift(here, matrices[key], np.tile(np.arange(stages), last - first), mine)
            leaked = np.maximum(leaked, (np.abs(vectors[edge] @ here) ** 2).sum(axis=0))
        if sampled and snapshots is not None:
            snapshots.append(vectors @ here)
    return np.asarray(vectors @ here), leaked


def _phases(areas: Floats, values: Floats) -> Complexes:
    """exp(i area value), (kicks, n)."""
    angles = np.multiply.outer(areas, values)
    out = np.empty(angles.shape, dtype=np.complex128)
    np.cos(angles, out=out.real)
    np.sin(angles, out=out.imag)
    return out


def _drift_matrices(durations: Floats, energies: Floats, vectors: NDArray[Any]) -> Complexes:
    """Q† exp(-i E a h) Q for all a of a step, (drifts, n, n); equal ones are made once."""
    made: dict[float, Complexes] = {}
    for duration in durations.tolist():
        if duration not in made:
            made[duration] = vectors.conj().T @ (np.exp(-1j * duration * energies)[:, None] * vectors)
    return np.ascontiguousarray([made[duration] for duration in durations.tolist()])


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
    """As `split_through`, of a window with any channels, one operator (n, n), dense or sparse, for each."""
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
            snapshots.append(states)
    return states, leaked


def _norm_bound(operator: Any) -> float:
    """The largest sum of absolute values in a row: no eigenvalue is larger."""
    return float(np.max(abs(operator).sum(axis=1)))


def _chebyshev(diagonal: Floats, factors: Floats, operators: Sequence[Any], reach: list[float], states: Complexes) -> Complexes:
    """exp(-i (diagonal + Σ factor operator)) states by Σ (2 - δ_n0) (-i)^n J_n(R) T_n(H/R) after H is centred."""
    from scipy.special import jv

    centre = (diagonal.max() + diagonal.min()) / 2
    radius = (diagonal.max() - diagonal.min()) / 2 + sum(abs(f) * r for f, r in zip(factors, reach, strict=True))
    if radius == 0:
        return np.exp(-1j * centre) * states
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
