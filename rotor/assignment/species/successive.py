"""Successive species: the best one among the remaining peaks, until no further species is significant."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import peak_list
from rotor.assignment.search import _kernels
from rotor.assignment.search.bounds import Bounds
from rotor.assignment.search.families import Family
from rotor.assignment.search.rigid_table import MIXED, RigidTable
from rotor.assignment.search.roots import Candidate, Field, alike, quick_ratios, ranked, search_roots
from rotor.assignment.species.grown import LEAST_RATIO, Grown
from rotor.assignment.species.growth import grow, regrown
from rotor.assignment.species.likelihood import line_slopes, predict

CLEAR = 300.0  # evidence at which a search ends at once
FAINT = 10.0  # smallest ln likelihood ratio of a root that is grown
CHUNK = 12  # families per chunk, after which candidates are examined
PER_FAMILY, PER_CHUNK = 4, 5
PATIENCE, OPEN_PATIENCE = 10, 40  # chunks without a better species after which a search ends; where constants are open
BEYOND_ALIASES = 600.0  # evidence above which a species is not compared with tops whose lines it would be a part of
# relative difference of constants of roots of which one is grown; of those near a species
NEAR, GROWN_NEAR = (
    3e-4,
    2e-3,
)
AROUND = 0.01  # relative difference below which roots may belong to one species
MOST_ALIASES = 4
SURELY_MOVED = 12  # peaks of lines with ΔJ ≠ 0: a wrong twin of Q branches has fewer, those that A + C, DJ, DJK and chance can match
LOW_J, LOW_KA, SHIFT_PEAKS = 8, 3, 25  # lines and peaks that tell shifts of A, B and C together
PEAK_MHZ = 0.1  # half the width of a peak
MULTIPLES = (2.0, 0.5, 3.0, 1.5, 2 / 3, 1 / 3)


@dataclass(frozen=True)
class Stage:
    """A stage of a search: number of strongest peaks, and range of families to match."""

    seeds: int
    first: int
    last: int


FIRST_STAGES = (Stage(60, 0, 150), Stage(60, 150, 600), Stage(110, 0, 60))
# of a further species, while several of the strongest peaks are left
STRONG_STAGES = (
    Stage(60, 0, 120),
    Stage(60, 120, 420),
)
GUESS_STAGES = (  # within narrow bounds
    Stage(60, 0, 60), Stage(180, 0, 90), Stage(60, 60, 200), Stage(400, 0, 60), Stage(180, 90, 400), Stage(60, 200, 1200),
)  # fmt: skip
NEXT_STAGES = (Stage(60, 0, 120),)
SCARCE = 45  # most peaks for which all families are tried: the cost of a family is cubic in their number


@dataclass(eq=False)
class Clock:
    """The time limit of a search in seconds."""

    seconds: float
    started: float = field(default_factory=time.monotonic)

    def over(self) -> bool:
        """Whether the time limit is exceeded."""
        return time.monotonic() - self.started > self.seconds


def next_species(
    seen: Field, families: Sequence[Family], stages: Sequence[Stage], clock: Clock, clear: float = CLEAR
) -> list[Grown]:
    """The species with the most evidence among the peaks, and rivals with other constants, best first.

    The search ends when a species is clear, after some chunks without a better one, after all stages, or at the time limit.
    """
    grown, tried, highest, chunks, last = list[Grown](), list[tuple[Floats, float]](), 0.0, 0, 0
    best: Grown | None = None
    need = 3 if len(seen.peaks) <= SCARCE else 4
    if len(seen.peaks) <= SCARCE:
        stages = (Stage(SCARCE, 0, len(families)),)
    for stage in stages:
        seeds = seen.seeds(stage.seeds)
        if len(seeds) < 5:
            break
        chosen = families[stage.first : stage.last]
        for at in range(0, len(chosen), CHUNK):
            if clock.over():
                return _finished(seen, grown, [])
            candidates = list[Candidate]()
            for family in chosen[at : at + CHUNK]:
                candidates += ranked(seen, family, search_roots(seen, family, seeds, need), FAINT)[:PER_FAMILY]
            grown += _grown(seen, candidates, tried, PER_CHUNK)
            chunks += 1
            best = max(grown, key=lambda species: species.evidence, default=None)
            if best is not None and best.evidence > highest:
                highest, last = best.evidence, chunks
            if best is None or highest < clear / 8:
                continue
            if best.determined and highest > clear:
                return _finished(seen, grown, candidates)
            if chunks - last >= max(PATIENCE if best.determined else OPEN_PATIENCE, last):
                return _finished(seen, grown, [])
        if best is not None and best.determined and highest > clear / 8:
            break
    return _finished(seen, grown, [])


def _finished(seen: Field, grown: list[Grown], candidates: list[Candidate]) -> list[Grown]:
    """The species with rivals: other roots near the best one, multiples of its J, and the best one grown again."""
    best = _best(grown)
    if not best or best[0].evidence < 0:
        return best
    first = best[0]
    near = [candidate for candidate in candidates if alike(candidate.constants, first.constants[:3], AROUND)]
    again = [
        regrown(seen, first),
        *_grown(seen, near, [], 2),
        *_grown(seen, aliases(seen, first) if first.evidence < BEYOND_ALIASES else [], [], 3 * MOST_ALIASES),
    ]
    return _best(best + again)


@lru_cache(maxsize=1)
def compiled(table: RigidTable) -> bool:
    """Load the compiled loops by a search of five peaks, so that the time limit does not include the compiler."""
    peaks = peak_list([9000.0, 9500.0, 10000.0, 10100.0, 11000.0], np.ones(5), 0.1)
    seen = Field(peaks, table, Bounds(np.array([2.0e3, 500, 400]), np.array([4.0e3, 2e3, 2e3])), np.array([2.0, 4.0]))
    low = _lowest_a_lines(seen)
    family = Family(0, low[table.quanta[table.upper[low], 0] == 5], low[:0], 0.0)
    search_roots(seen, family, seen.seeds(5), 1)
    candidate = Candidate(np.array([3000.0, 1050.0, 950.0]), family, 0.0, 2.0)
    quick_ratios(seen, candidate.constants[None, :], 0)
    grow(seen, candidate)
    return True


def _grown(seen: Field, candidates: list[Candidate], tried: list[tuple[Floats, float]], most: int) -> list[Grown]:
    """Grow the best candidates, except those near tried ones."""
    out = list[Grown]()
    for candidate in sorted(candidates, key=lambda candidate: -candidate.ratio):
        if len(out) >= most:
            break
        # equal constants grow to equal species
        if any(alike(candidate.constants, other, near) for other, near in tried):
            continue
        tried.append((candidate.constants, NEAR))
        species = grow(seen, candidate)
        if species is not None and np.isfinite(species.evidence):
            out.append(species)
            if species.evidence > CLEAR / 8:
                tried.append((species.constants[:3], GROWN_NEAR))
    return out


def _best(grown: Sequence[Grown]) -> list[Grown]:
    """Distinct species by decreasing evidence."""
    out = list[Grown]()
    for species in sorted(grown, key=lambda species: -species.evidence):
        if not any(alike(species.constants[:3], other.constants[:3], 1e-4) for other in out):
            out.append(species)
    return out


def aliases(seen: Field, grown: Grown) -> list[Candidate]:
    """Candidates with other constants whose lines include those of a species, which may then be wrong."""
    return [*multiples(seen, grown), *(shifts(seen, grown) if grown.moved < SURELY_MOVED else [])]


def multiples(seen: Field, grown: Grown) -> list[Candidate]:
    """Candidates whose a-type R branches have the same peaks, with J multiplied by a ratio r.

    B' = B/r, C' = C/r and A' - ½(B'+C') = r (A - ½(B+C)) preserve the splitting of K = 1, (B-C) J, and the shift of K = 0,
    (B-C)² J³/8(A - ½(B+C)) (second order, J. K. Bragg and S. Golden, Phys. Rev. 75, 735 (1949)). The lines of K = 0 and 1 of the species
    give A', B', C' by least squares.
    """
    low = _lowest_a_lines(seen)
    known = np.flatnonzero(np.isin(grown.rows, low))
    upper = seen.table.quanta[seen.table.upper]
    rows, f = grown.rows[known], seen.peaks.frequency_mhz[grown.peak[known]]
    a, b, c = grown.constants[:3]
    mean, tops, families = (b + c) / 2, list[Floats](), list[Family]()
    for ratio in MULTIPLES:
        top = np.array([ratio * (a - mean) + mean / ratio, b / ratio, c / ratio])
        places = [_multiple_row(low, upper, row, ratio) for row in rows.tolist()]
        present = np.array([place >= 0 for place in places], dtype=bool)
        lines = np.array(places, dtype=np.int64)[present]
        # three kinds of lines at least: fewer leave a constant free
        if top[0] <= top[1] or len({(upper[line, 1], upper[line, 2] - upper[line, 0]) for line in lines.tolist()}) < 3:
            continue
        top = _fitted_top(seen, top, lines, f[present])
        if (top > seen.bounds.low).all() and (top < seen.bounds.high).all() and top[0] > top[1] > top[2]:
            tops.append(top)
            families.append(Family(0, lines, lines[:0], 0.0))
    if not tops:
        return []
    ratios, temperatures = quick_ratios(seen, np.array(tops), 0)
    each = zip(tops, families, ratios.tolist(), temperatures.tolist(), strict=True)
    return [Candidate(*values) for values in each if values[2] > FAINT]


def _multiple_row(low: Ints, upper: Ints, row: int, ratio: float) -> int:
    """The line with J of the upper level multiplied by a ratio and the same Ka and Kc - J; -1 without one."""
    j, ka, kc = upper[row].tolist()
    changed = round(ratio * j)
    if abs(changed - ratio * j) > 1e-9:  # the ratio of J is no whole number: no such line
        return -1
    same = low[(upper[low] == (changed, ka, kc - j + changed)).all(axis=1)]
    return int(same[0]) if len(same) else -1


def _fitted_top(seen: Field, top: Floats, lines: Ints, frequency: Floats) -> Floats:
    """A, B, C near `top` from lines with their frequencies, by least squares."""
    constants, energy = np.concatenate([top, np.zeros(5)]), np.empty(len(seen.jj))
    for _ in range(3):
        if not constants[0] > constants[1] > constants[2] > 0:
            break
        _kernels.level_energies(seen.table.levels, seen.table.theta, seen.jj, constants, energy)
        residual = frequency - (energy[seen.table.upper[lines]] - energy[seen.table.lower[lines]])
        constants[:3] += np.linalg.lstsq(line_slopes(seen, lines, constants)[:, :3], residual, rcond=None)[0]
    return constants[:3]


def shifts(seen: Field, grown: Grown) -> list[Candidate]:
    """Candidates with the same Q branches: A + x, B + x, C + x, and mirrored ones; x matches an R-branch line to a strong peak.

    In E = ½(A+C) J(J+1) + ½(A-C) E_κ(J, τ) the sum is absent from Q branches, and E_κ(J, τ) = -E_-κ(J, -τ) (G. W. King, R. M. Hainer and
    P. C. Cross, J. Chem. Phys. 11, 27 (1943)): a top with A - C and -κ has the Q branches too, Ka and Kc and a and c types exchanged.
    """
    table = seen.table
    present = grown.ratios > LEAST_RATIO
    slow = grown.rows[seen.jj[table.upper[grown.rows]] == seen.jj[table.lower[grown.rows]]][:2]
    shifted = _shifted(seen, grown.constants, present, slow)
    mirrored = np.zeros_like(grown.constants)
    a, b, c = grown.constants[:3]
    mirrored[:3] = a, a + c - b, c
    rows = [row for row in (_mirrored_row(table, row) for row in slow.tolist()) if row is not None]
    if len(rows) < len(slow) or not len(slow):
        return shifted
    return [*shifted, *_shifted(seen, mirrored, present[::-1], np.array(rows))]


def _mirrored_row(table: RigidTable, row: int) -> int | None:
    """The line between the levels of a line with Ka and Kc exchanged, the upper one below; None where the table lacks it."""
    upper, lower = (table.quanta[side[row]][[0, 2, 1]] for side in (table.lower, table.upper))
    same = (table.quanta[table.upper] == upper).all(axis=1) & (table.quanta[table.lower] == lower).all(axis=1)
    return int(np.argmax(same)) if same.any() else None


def _shifted(seen: Field, start: Floats, present: NDArray[np.bool_], slow: Ints) -> list[Candidate]:
    """Candidates A + x, B + x, C + x; present : types of lines (3,). slow : lines of Q branches that the candidates begin with."""
    table, constants = seen.table, start.copy()
    energy = np.empty(len(seen.jj))
    _kernels.level_energies(table.levels, table.theta, seen.jj, constants, energy)
    change = seen.jj[table.upper] - seen.jj[table.lower]
    low = (table.quanta[table.upper, 0] <= LOW_J) & (table.quanta[table.upper, 1] <= LOW_KA)
    rows = np.flatnonzero(low & present[table.kind] & (change > 0) & (table.quanta[table.lower, 1] <= LOW_KA))
    line = energy[table.upper[rows]] - energy[table.lower[rows]]
    peaks = seen.peaks.frequency_mhz[seen.order[:SHIFT_PEAKS]]
    x = ((peaks[None, :] - line[:, None]) / change[rows][:, None]).ravel()
    tops = constants[:3] + x[:, None]
    a, b, c = tops.T
    # not at the place itself, and not beyond planarity
    sound = (np.abs(x) > 1e-3 * constants[2]) & (c * (a + b) > 0.99 * a * b)
    sound &= (tops > seen.bounds.low).all(axis=1) & (tops < seen.bounds.high).all(axis=1)
    tops, which = np.ascontiguousarray(tops[sound]), np.repeat(rows, len(peaks))[sound]
    if not len(tops):
        return []
    each = [quick_ratios(seen, tops, q) for q in np.flatnonzero(present).tolist()]
    ratios = np.sum([ratio for ratio, _ in each], axis=0)
    temperatures = np.array([temperature for _, temperature in each])[
        np.argmax([ratio for ratio, _ in each], axis=0), np.arange(len(tops))
    ]
    out = list[Candidate]()
    for n in np.argsort(-ratios)[: 5 * MOST_ALIASES].tolist():
        if ratios[n] > FAINT and not any(alike(tops[n], candidate.constants, NEAR) for candidate in out):
            family = Family(MIXED, np.concatenate([which[n : n + 1], slow]), slow[:0], 0.0)
            out.append(Candidate(tops[n], family, float(ratios[n]), float(temperatures[n])))
    return out[:MOST_ALIASES]


def _lowest_a_lines(seen: Field) -> Ints:
    """Rows of the a-type lines J ← J-1 with Ka = 0 and 1."""
    table = seen.table
    upper, lower = table.quanta[table.upper], table.quanta[table.lower]
    return np.flatnonzero(
        (table.kind == 0) & (upper[:, 0] == lower[:, 0] + 1) & (upper[:, 1] <= 1) & (upper[:, 1] == lower[:, 1])
    )


def explained(seen: Field, grown: Grown) -> NDArray[np.bool_]:
    """Which peaks a species explains: assigned ones, and those at a predicted line that are not much stronger than it."""
    out = np.zeros(len(seen.peaks), dtype=bool)
    out[grown.peak] = True
    lines = predict(seen, grown.constants, grown.temperature_k, 4000)
    # types without evidence have no lines
    level = lines.expected + np.where(grown.ratios > LEAST_RATIO, grown.scales, -np.inf)[lines.kind]
    strong = level > seen.peaks.log_threshold - 2.0  # lines well below the weakest peak cannot be seen
    f, height = lines.frequency[strong], level[strong]
    peaks = seen.peaks
    reach = max(PEAK_MHZ, 2 * grown.rms_mhz)
    first, last = np.searchsorted(peaks.frequency_mhz, f - reach), np.searchsorted(peaks.frequency_mhz, f + reach)
    for n in np.flatnonzero(last > first).tolist():
        near = slice(first[n], last[n])
        out[near] |= peaks.log_intensity[near] < height[n] + 1.5
    return out


def strength(seen: Field, grown: Grown) -> float:
    """Height of the strongest line of a species in the units of the intensities, from the fitted scales."""
    lines = predict(seen, grown.constants, grown.temperature_k, 20)
    level = lines.expected + np.where(grown.ratios > LEAST_RATIO, grown.scales, -np.inf)[lines.kind]
    return float(np.exp(level.max()))
