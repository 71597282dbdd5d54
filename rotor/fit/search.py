"""The search of a fit: weighted residuals and their derivatives for any constants, blends, robust losses, far-off lines, stages.

Levels keep their label by block and rank, so that no iteration reassigns a line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.fit.assignment import Assignments
from rotor.fit.parameters import Parameters
from rotor.quantum.labelled import LevelModel
from rotor.statistics.least_squares import INTERRUPTED, Iteration, Minimum, Progress, minimise

LOSSES = ("squares", "huber", "cauchy")
POOR_RMS = 10.0  # weighted rms above which the lines are not described, unless the caller says otherwise
_HUBER, _CAUCHY = 1.345, 2.385  # σ at which a loss bends: 95 % efficiency for normal errors
_CANCELLED = 1e-12  # of the level derivatives: what is left of differences below it is round-off
_REJECTIONS = 20
_STAGES = (0.1, 0.2, 0.35, 0.5, 0.7, 0.85)  # shares of the lines, in order of J, of a search that begins with low J
_ROUGH = 10.0  # standard errors within which a stage has converged
_FIRST_ITERATIONS = 12  # of a direct search, after which it must have made way
_WAY = 0.01  # of the weighted rms at the start, below which it has
_LATELY = 6  # iterations in which it must halve the weighted rms after these
_TURNED = 5  # parameters whose other sign is tried
_TURNED_ITERATIONS = 8  # after which it must have made way
_BETTER = 0.99  # of the weighted rms, below which the other sign is taken
_NONE = np.zeros(0, dtype=np.int64)
_AT_ZERO_MHZ = 1e-30  # how far a constant that starts at 0 may move in these stages


@dataclass(frozen=True)
class FitOptions:
    """How a fit is done.

    reject_above : lines with |obs - calc| above so many errors do not count; they are reported. None: every line counts
    loss : "squares", or "huber" or "cauchy", whose weight falls for lines beyond 1.3 or 2.4 errors
    default_error_mhz : of lines whose file gives 0; such lines are left out, and reported, where it is None
    poor_rms : weighted rms above which the fit has failed
    tolerance, most_iterations : of the search, see `rotor.statistics.least_squares.minimise`
    kmax : cut of the basis of an asymmetric top, as SPFIT's KNMAX; None for the whole basis
    leave_out_missing : lines with a level that does not exist are left out, and named, as SPFIT does; else they are an error
    pass_interrupt : a KeyboardInterrupt goes on to the caller, of a fit that is one of many; else the fit ends with its best point
    """

    reject_above: float | None = None
    loss: str = "squares"
    default_error_mhz: float | None = None
    poor_rms: float = POOR_RMS
    tolerance: float = 1e-4
    most_iterations: int = 100
    kmax: int | None = None
    leave_out_missing: bool = False
    pass_interrupt: bool = False

    def __post_init__(self) -> None:
        if self.loss not in LOSSES:
            raise ValueError(f"loss {self.loss!r}: one of {', '.join(LOSSES)} is needed")
        for name in ("reject_above", "default_error_mhz", "poor_rms", "tolerance"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}: a finite number above 0 is needed")


def robust(residuals: Floats, loss: str) -> tuple[Floats, Floats]:
    """sign(r) √ρ(r²) and its derivative; ρ = r² for "squares".

    Huber: r² up to c, then 2 c |r| - c². Cauchy: c² ln(1 + r²/c²). Source: P. J. Huber, Robust Statistics (1981).
    """
    r, size = residuals, np.abs(residuals)
    if loss == "huber":
        far = size > _HUBER
        root = np.sqrt(np.where(far, 2 * _HUBER * size - _HUBER**2, r**2))
        slope = np.where(far, _HUBER / np.where(far, root, 1.0), 1.0)
        return np.sign(r) * root, slope
    if loss == "cauchy":
        root = _CAUCHY * np.sqrt(np.log1p((r / _CAUCHY) ** 2))
        near = size < 1e-6
        slope = np.where(near, 1.0, size / (1 + (r / _CAUCHY) ** 2) / np.where(near, 1.0, root))
        return np.sign(r) * root, slope
    return residuals, np.ones_like(residuals)


class Grouping(NamedTuple):
    """The measured frequencies that count: for each the position of its first line; order, starts, shares: how blends add.

    plain : no blend among them. each : every line counts, in its order
    blended, members, bounds : which of them are blends, the places of their lines in `order`, and where each begins among these
    """

    first: Ints
    order: Ints
    starts: Ints
    shares: Floats
    plain: bool
    each: bool
    blended: Ints
    members: Ints
    bounds: Ints

    @classmethod
    def of(cls, lines: Assignments, used: NDArray[np.bool_]) -> Grouping:
        rows = np.flatnonzero(used)
        order = rows[np.argsort(lines.blend[rows], kind="stable")]
        blend = lines.blend[order]
        starts = np.flatnonzero(np.concatenate(([True], np.diff(blend) != 0))) if len(order) else np.zeros(0, np.int64)
        weights = np.where(lines.weight[order] > 0, lines.weight[order], 0.0)
        totals = np.add.reduceat(weights, starts) if len(starts) else np.zeros(0)
        counts = np.diff(np.append(starts, len(order)))
        each = np.repeat(np.arange(len(starts)), counts)
        equal = 1.0 / counts[each] if len(order) else weights
        shares = np.where(totals[each] > 0, weights / np.where(totals[each] > 0, totals[each], 1.0), equal)
        blended = np.flatnonzero(counts > 1)
        bounds = np.concatenate([[0], np.cumsum(counts[blended])[:-1]]).astype(np.int64)
        members = np.flatnonzero(np.isin(each, blended))
        first = order[starts]
        each_line = np.array_equal(first, np.arange(len(lines)))
        return cls(first, order, starts, shares, len(blended) == 0, each_line, blended, members, bounds)

    def mean(self, values: Floats) -> Floats:
        """The weighted mean over each blend of values (lines, ...); these themselves where every line stands alone."""
        if self.plain and self.each:
            return values
        out = values[self.first]
        if not self.plain:
            shares = self.shares[self.members].reshape(-1, *[1] * (values.ndim - 1))
            out[self.blended] = np.add.reduceat(values[self.order[self.members]] * shares, self.bounds, axis=0)
        return out

    def spread_back(self, means: Floats, values: Floats) -> Floats:
        """Values (lines,) with those of a blend replaced by its mean."""
        out = values.copy()
        out[self.order] = np.repeat(means, np.diff(np.append(self.starts, len(self.order))))
        return out


@dataclass(frozen=True, eq=False)
class Search:
    """What is evaluated at each point."""

    lines: Assignments
    model: LevelModel
    parameters: Parameters
    options: FitOptions
    upper: Ints
    lower: Ints
    sigma: Floats
    used: NDArray[np.bool_]

    def lines_of(self, values: Floats) -> tuple[Floats, Floats, Floats]:
        """Calculated lines (lines,), derivatives by the parameters (lines, n), and of the levels (levels, n).

        The last point is not computed a second time: the search ends where it was.
        """
        point = values.tobytes()
        before: tuple[bytes, tuple[Floats, Floats, Floats]] | None = self.__dict__.get("_last")
        if before is None or before[0] != point:
            before = self.__dict__["_last"] = (point, self._lines_of(values))
        return before[1]

    def _lines_of(self, values: Floats) -> tuple[Floats, Floats, Floats]:
        energies, slopes = self.model.levels(self.parameters.constants_of(values))
        slopes = self.parameters.slopes_of(slopes)
        if self.from_zero:  # the place -1 of such lower levels is the last one
            energies, slopes = np.append(energies, 0.0), np.vstack([slopes, np.zeros(slopes.shape[1])])
        derivatives = slopes[self.upper]
        derivatives -= slopes[self.lower]
        return energies[self.upper] - energies[self.lower], derivatives, slopes

    @property
    def from_zero(self) -> bool:
        """Whether a line is an energy from the zero of the Hamiltonian: its lower level has the place -1."""
        return bool((self.lower < 0).any())

    @property
    def grouping(self) -> Grouping:
        return Grouping.of(self.lines, self.used)

    def evaluate(self, values: Floats) -> tuple[Floats, Floats]:
        """Weighted residuals, those of a-priori values behind them, and the Jacobian."""
        return self.bent(*self.weighted(values))

    def weighted(self, values: Floats) -> tuple[Floats, Floats]:
        calculated, jacobian, _ = self.lines_of(values)
        group = self.group
        sigma = self.sigma[group.first]
        residuals = (self.lines.frequency_mhz[group.first] - group.mean(calculated)) / sigma
        rows = group.mean(jacobian) / sigma[:, None]
        spread, of_spread = self._apart(calculated, jacobian)
        known = np.flatnonzero(np.isfinite(self.parameters.prior))
        prior = self.parameters.prior[known]
        behind = np.zeros((len(known), len(values)))
        behind[np.arange(len(known)), known] = 1 / prior
        if not len(known) and not len(spread):
            return residuals, rows
        held = (self.parameters.start - values)[known] / prior
        return np.concatenate([residuals, spread, held]), np.vstack([rows, of_spread, behind])

    def _apart(self, calculated: Floats, jacobian: Floats) -> tuple[Floats, Floats]:
        """√w (mean - calculated)/width of the components of blends of a known width, and the derivatives of the negative.

        With the mean's own residual they make (obs - mean)²/σ² + Σ w (calculated - mean)²/width², w of the sum 1.
        """
        group, places = self.group, self.wide
        if not len(places):
            return np.zeros(0), np.zeros((0, jacobian.shape[1]))
        rows = group.order[places]
        of_group = np.searchsorted(group.starts, places, side="right") - 1
        widths = np.array([self.lines.widths_mhz[number] for number in self.lines.blend[rows].tolist()])
        factor = np.sqrt(group.shares[places]) / widths
        means, of_means = group.mean(calculated)[of_group], group.mean(jacobian)[of_group]
        return factor * (means - calculated[rows]), factor[:, None] * (jacobian[rows] - of_means)

    @property
    def wide(self) -> Ints:
        """Places, in the order of the groups, of the components of blends whose width is known."""
        numbers = self.lines.blend[self.group.order]
        return np.flatnonzero(np.isin(numbers, list(self.lines.widths_mhz))) if self.lines.widths_mhz else _NONE

    @property
    def group(self) -> Grouping:
        cached: Grouping | None = self.__dict__.get("_group")
        if cached is None:
            cached = self.grouping
            self.__dict__["_group"] = cached
        return cached

    def bent(self, residuals: Floats, jacobian: Floats) -> tuple[Floats, Floats]:
        """√ρ(r²) with its sign in place of r for a robust loss, so that Σ ρ is what is made least."""
        count = len(self.group.first)
        bent, slope = robust(residuals[:count], self.options.loss)
        if self.options.loss == "squares":
            return residuals, jacobian
        factor = np.concatenate([slope, np.ones(len(residuals) - count)])
        return np.concatenate([bent, residuals[count:]]), jacobian * factor[:, None]


def with_rejection(
    search: Search, options: FitOptions, progress: Progress | None
) -> tuple[Search, Minimum, dict[int, str]]:
    """The search, repeated without the lines that are too far off until the same ones stay out.

    Where no minimum was reached, or too few lines would be left, all lines count: the constants are wrong, not the lines; unless
    the start describes half of the lines and more, see `_from_near_lines`.
    """
    minimum, may = _passed_on(_searched(search, progress), options), search.used
    if options.reject_above is None or minimum.status == INTERRUPTED:
        return search, minimum, {}
    if not minimum.converged or _is_poor(search, minimum):
        search, minimum = _from_near_lines(search, minimum, progress)
    if not _passed_on(minimum, options).converged:
        return search, minimum, {}
    for _ in range(_REJECTIONS):
        used = may & _near(search, may, minimum.parameters)
        if (used == search.used).all():
            break
        if too_few(search.lines, used, search.parameters):
            break
        search = replace(search, used=used)
        minimum = _continued(minimum, _minimised(search, minimum.parameters, progress, options.most_iterations))
        if _passed_on(minimum, options).status == INTERRUPTED:
            break
    out = np.flatnonzero(may & ~search.used)
    return search, minimum, {int(i): f"more than {options.reject_above:g} errors off" for i in out}


def _passed_on(minimum: Minimum, options: FitOptions) -> Minimum:
    """The same; KeyboardInterrupt for a search that was interrupted, where the caller asked for it."""
    if minimum.status == INTERRUPTED and options.pass_interrupt:
        raise KeyboardInterrupt
    return minimum


def _near(search: Search, may: NDArray[np.bool_], values: Floats) -> NDArray[np.bool_]:
    """Which lines are no more than `reject_above` errors off, blends among those that may count by their means."""
    calculated, _, _ = search.lines_of(values)
    group = Grouping.of(search.lines, may)
    means = group.spread_back(group.mean(calculated), calculated)
    off = np.abs(search.lines.frequency_mhz - means) / search.sigma
    return np.asarray(off <= (search.options.reject_above or math.inf))


def _from_near_lines(search: Search, first: Minimum, progress: Progress | None) -> tuple[Search, Minimum]:
    """The minimum of the lines that the start describes, where these are half of them and more and all together led nowhere.

    SPFIT leaves lines out at the start always. Then lines that constants a little off put far away never come back, so that all
    lines are tried first here.
    """
    start, limit = search.parameters.start, search.options.most_iterations
    near = search.used & _near(search, search.used, start)
    if 2 * near.sum() < search.used.sum() or too_few(search.lines, near, search.parameters):
        return search, first
    few = replace(search, used=near)
    found = _continued(first, _minimised(few, start, progress, limit))
    if found.status == INTERRUPTED:
        return search, _interrupted(replace(first, iterations=found.iterations))
    return (few, found) if found.converged and not _is_poor(few, found) else (search, first)


def _searched(search: Search, progress: Progress | None) -> Minimum:
    """A direct search; where it makes no way for some iterations, or ends far from the lines, one by rising J, then other signs."""
    options = search.options

    def hopeless(taken: Sequence[Iteration]) -> bool:
        if len(taken) < _FIRST_ITERATIONS:
            return False
        now = min(one.rms_after for one in taken)
        lately = min(one.rms_after for one in taken[:-_LATELY])
        return now > options.poor_rms and (now > _WAY * taken[0].rms_before or now > lately / 2)

    limit = options.most_iterations
    first = _minimised(search, search.parameters.start, progress, limit, hopeless)
    for further in (_by_stages, _with_a_sign_turned):
        if _is_poor(search, first) and first.status != INTERRUPTED and len(first.iterations) < limit:
            first = further(search, first, progress)
    return first


def _is_poor(search: Search, found: Minimum) -> bool:
    """Whether the lines are not described: by all of them, or by those that rejection would leave, where it leaves half and more."""
    limit, size = search.options.reject_above, np.abs(found.residuals[: len(search.group.first)])
    if limit is not None and found.converged and 2 * int((size <= limit).sum()) >= len(size):
        size = size[size <= limit]
        return bool(np.sqrt(size @ size / max(len(size), 1)) > search.options.poor_rms)
    return found.rms > search.options.poor_rms


def _with_a_sign_turned(search: Search, first: Minimum, progress: Progress | None) -> Minimum:
    """The better of a minimum that does not describe the lines and those that are reached from it with the sign of one parameter turned.

    The sign of a coupling between states counts only in products with others, so that a search may end with one of them turned.
    Tried are the few that went furthest from their start, counted in its size.
    """

    def hopeless(taken: Sequence[Iteration]) -> bool:
        return len(taken) >= _TURNED_ITERATIONS and min(one.rms_after for one in taken) > search.options.poor_rms

    start, reached = search.parameters.start, first.parameters
    moved = np.abs(reached - start) / np.maximum(np.abs(start), _AT_ZERO_MHZ)
    for place in np.argsort(-moved, kind="stable")[:_TURNED].tolist():
        turned = reached.copy()
        turned[place] *= -1
        left = search.options.most_iterations - len(first.iterations)
        try:
            second = _continued(first, _minimised(search, turned, progress, max(left, 0), hopeless))
        except ValueError:  # out of the bounds of the model
            continue
        better = second.rms < _BETTER * first.rms  # else the lines do not know the sign
        if second.status == INTERRUPTED:
            return _interrupted(second if better else replace(first, iterations=second.iterations))
        first = second if better else replace(first, iterations=second.iterations)
        if first.rms <= search.options.poor_rms:
            break
    return first


def _continued(first: Minimum, second: Minimum) -> Minimum:
    """The second search with the iterations of both."""
    return replace(second, iterations=(*first.iterations, *second.iterations))


def _by_stages(search: Search, first: Minimum, progress: Progress | None) -> Minimum:
    """The better of the minimum found and the one that a search by rising J ends in.

    Low J moves nearly linearly with the constants even when these are 10 % off, and what it fixes carries the next lines: the
    lines come in by J, a tenth of them first. Until all are in, a constant stays within about itself of its start, and one that
    starts at 0 stays there.
    """
    j = np.maximum(search.lines.upper[:, 0], search.lines.lower[:, 0])
    last, limit = replace(first, parameters=search.parameters.start), search.options.most_iterations
    rough = replace(search.options, tolerance=_ROUGH)
    try:
        for share in _STAGES:
            cut = np.quantile(j[search.used], share)
            soft = np.minimum(search.parameters.prior, np.maximum(np.abs(search.parameters.start), _AT_ZERO_MHZ))
            stage = replace(
                search, options=rough, used=search.used & (j <= cut), parameters=replace(search.parameters, prior=soft)
            )
            last = _continued(last, _minimised(stage, last.parameters, progress, max(limit - len(last.iterations), 0)))
            if last.status == INTERRUPTED:  # of a part of the lines; the best point of all of them is the one before
                return _interrupted(replace(first, iterations=last.iterations))
        second = _continued(last, _minimised(search, last.parameters, progress, max(limit - len(last.iterations), 0)))
    except ValueError:  # a stage left the bounds of the model
        return first
    best = second if second.rms < first.rms else replace(first, iterations=second.iterations)
    return _interrupted(best) if second.status == INTERRUPTED else best


def _interrupted(best: Minimum) -> Minimum:
    """The best point so far of a search that was interrupted on another way."""
    return replace(best, status=INTERRUPTED, reason=f"interrupted after {len(best.iterations)} iterations")


def _minimised(
    search: Search,
    start: Floats,
    progress: Progress | None,
    limit: int,
    hopeless: Callable[[Sequence[Iteration]], bool] | None = None,
) -> Minimum:
    return minimise(
        search.evaluate,
        start,
        tolerance=search.options.tolerance,
        most_iterations=limit,
        floor=round_off(search, search.lines_of(start)[2]),
        progress=progress,
        hopeless=hopeless,
    )


def round_off(search: Search, slopes: Floats) -> Floats:
    """Norms (n,) of weighted columns below which they are what round-off leaves of level derivatives that cancel."""
    size = (np.abs(slopes[search.upper]) + np.abs(slopes[search.lower])) / search.sigma[:, None]
    return np.asarray(_CANCELLED * np.sqrt(np.einsum("ij,ij->j", size[search.used], size[search.used])))


def too_few(lines: Assignments, used: NDArray[np.bool_], parameters: Parameters) -> str:
    """What is wrong with fewer measured frequencies than free constants; empty where they are enough."""
    count = len(set(lines.blend[used].tolist())) + int(np.isfinite(parameters.prior).sum())
    if count >= len(parameters.names):
        return ""
    return f"{len(parameters.names)} free constants for {count} measured frequencies; free fewer, or add lines"


def errors_of(lines: Assignments, options: FitOptions) -> tuple[dict[int, str], Floats]:
    """Lines without an error, by position, and errors with the default put in."""
    zero = lines.error_mhz == 0
    if zero.all() and options.default_error_mhz is None:
        raise ValueError(
            f"{lines.source or 'the lines'}: every line has an error of 0: give errors in the file, or one for all of them "
            "(default_error_mhz, --default-error)"
        )
    if options.default_error_mhz is not None:
        return {}, np.where(zero, options.default_error_mhz, lines.error_mhz)
    return {int(i): "its error is 0" for i in np.flatnonzero(zero)}, np.where(zero, 1.0, lines.error_mhz)
