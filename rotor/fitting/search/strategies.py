"""Search strategies: direct; most of the lines first; by rising J; with a sign reversed; without lines that are far off.

A direct search finds the minimum from most starts. If it stalls or ends far from the lines, the other strategies are tried, and the
best point is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.fitting.search.residuals import Blends, FitOptions, Search, round_off, too_few
from rotor.statistics.least_squares import EXHAUSTED, INTERRUPTED, STALLED, Iteration, Minimum, Progress, minimise
from rotor.statistics.regression import regression

_REJECTIONS = 20  # a bound: two sets of rejected lines may alternate
_STAGES = (0.1, 0.2, 0.35, 0.5, 0.7, 0.85)  # stages of a search by rising J: shares of the lines in order of J
_STAGE_ITERATIONS = 4  # per stage
_FAR = 15.0  # times the median residual, about ten standard deviations: lines beyond it may belong to other levels
_ROUNDS = 8  # searches with the lines that are not far off
_ROUND_ITERATIONS = 12  # per such search
_NEARLY = 0.1  # standard errors: a round has converged when its next step is smaller
_FIRST_ITERATIONS = 12  # of a direct search, before its progress is judged
_WAY = 0.01  # of the weighted rms at the start: below it the search makes progress
_LATELY = 6  # later iterations in which the weighted rms must halve
_TURNED = 5  # parameters whose other sign is tried
_TURNED_ITERATIONS = 8  # of such a search, before its progress is judged
_BETTER = 0.99  # of the weighted rms: below it the other sign is taken
# times its size at the start, and standard errors: a parameter that moved further may be in another minimum
_FURTHER, _MANY_ERRORS = (
    0.5,
    20.0,
)
_PUT_BACK = 3  # parameters that are reset to their start
_LOWER = 1.0  # required decrease of χ² after a reset: one standard error of one parameter
_AT_ZERO_MHZ = 1e-30  # how far a constant that starts at 0 may move in these stages


def with_rejection(
    search: Search, options: FitOptions, progress: Progress | None
) -> tuple[Search, Minimum, dict[int, str]]:
    """Search, then repeat without the lines that are too far off until the rejected lines no longer change.

    If no minimum is reached, or too few lines would be left, all lines count: then the constants are wrong, not the lines. The
    exception is a start that describes at least half of the lines, see `_from_near_lines`.
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
    """Return the minimum; raise KeyboardInterrupt for an interrupted search if `pass_interrupt` is set."""
    if minimum.status == INTERRUPTED and options.pass_interrupt:
        raise KeyboardInterrupt
    return minimum


def _near(search: Search, may: NDArray[np.bool_], values: Floats) -> NDArray[np.bool_]:
    """Which lines are at most `reject_above` errors off; blends are judged by their means."""
    calculated = search.line_values(values).calculated
    group = Blends.from_lines(search.lines, may)
    means = group.spread_back(group.mean(calculated), calculated)
    off = np.abs(search.lines.frequency_mhz - means) / search.sigma
    return np.asarray(off <= (search.options.reject_above or math.inf))


def _from_near_lines(search: Search, first: Minimum, progress: Progress | None) -> tuple[Search, Minimum]:
    """Search with the lines that the start describes, if these are at least half and the search with all lines failed.

    SPFIT always rejects lines at the start. With slightly wrong constants, lines that start far away then never return; so here
    all lines are tried first.
    """
    start, limit = search.parameters.start, search.options.most_iterations
    near = search.used & _near(search, search.used, start)
    if 2 * near.sum() < search.used.sum() or too_few(search.lines, near, search.parameters):
        return search, first
    few = replace(search, used=near)
    minimum = _continued(first, _minimised(few, start, progress, limit))
    if minimum.status == INTERRUPTED:
        return search, _better(first, minimum, replaced=False)
    return (few, minimum) if minimum.converged and not _is_poor(few, minimum) else (search, first)


def _searched(search: Search, progress: Progress | None) -> Minimum:
    """A direct search; if it stalls or ends far from the lines, one with most of the lines, two by rising J, and reversed signs.

    The remaining iterations continue from the best point.
    """
    limit = search.options.most_iterations
    first = _minimised(search, search.parameters.start, progress, limit, _makes_no_way(search.options))
    for further in (
        _with_most_lines,
        partial(_by_stages, rough=10.0),
        partial(_by_stages, rough=1.0),
        _with_a_sign_turned,
    ):
        if _is_open(search, first):
            first = further(search, first, progress)
    if _is_open(search, first) and first.status == EXHAUSTED:
        left = limit - len(first.iterations)
        first = _continued(first, _minimised(search, first.parameters, progress, left))
    if first.converged and "v" in search.lines.names:
        first = _with_a_reset_parameter(search, first, progress)
    return first


def _makes_no_way(options: FitOptions) -> Callable[[Sequence[Iteration]], bool]:
    """A test whether a direct search has stalled, so that other strategies should use the remaining iterations."""

    def hopeless(taken: Sequence[Iteration]) -> bool:
        if len(taken) < _FIRST_ITERATIONS:
            return False
        now = min(iteration.rms_after for iteration in taken)
        lately = min(iteration.rms_after for iteration in taken[:-_LATELY])
        # no way: twice the best rms of the last iterations ago is not reached
        return now > options.poor_rms and (now > _WAY * taken[0].rms_before or now > lately / 2)

    return hopeless


def _is_open(search: Search, minimum: Minimum) -> bool:
    """Whether other strategies should be tried: iterations are left, and the lines are not described or the search stalled."""
    if minimum.status == INTERRUPTED or len(minimum.iterations) >= search.options.most_iterations:
        return False
    return minimum.status == STALLED or _is_poor(search, minimum)


def _is_poor(search: Search, minimum: Minimum) -> bool:
    """Whether the lines are not described: all of them, or those left after rejection if these are at least half."""
    limit, size = search.options.reject_above, np.abs(minimum.residuals[: len(search.group.first)])
    if limit is not None and minimum.converged and 2 * int((size <= limit).sum()) >= len(size):
        size = size[size <= limit]
        return bool(np.sqrt(size @ size / max(len(size), 1)) > search.options.poor_rms)
    return minimum.rms > search.options.poor_rms


def _with_a_sign_turned(search: Search, first: Minimum, progress: Progress | None) -> Minimum:
    """Restart from a poor minimum with the sign of one parameter reversed; return the best minimum.

    The sign of a coupling between states matters only in products with other couplings, so a search may end with a wrong sign.
    The few parameters with the largest relative change from their start are tried.
    """

    def hopeless(taken: Sequence[Iteration]) -> bool:
        return (
            len(taken) >= _TURNED_ITERATIONS
            and min(iteration.rms_after for iteration in taken) > search.options.poor_rms
        )

    start, reached = search.parameters.start, first.parameters
    # a parameter that begins at 0 has no relative change
    moved = np.abs(reached - start) / np.maximum(np.abs(start), _AT_ZERO_MHZ)
    for place in np.argsort(-moved, kind="stable")[:_TURNED].tolist():
        turned = reached.copy()
        turned[place] *= -1
        left = search.options.most_iterations - len(first.iterations)
        try:
            second = _continued(first, _minimised(search, turned, progress, max(left, 0), hopeless))
        except ValueError:  # out of the bounds of the model
            continue
        # without a clear improvement the lines do not determine the sign
        first = _better(first, second, replaced=second.rms < _BETTER * first.rms)
        if first.status == INTERRUPTED or first.rms <= search.options.poor_rms:
            break
    return first


def _with_a_reset_parameter(search: Search, first: Minimum, progress: Progress | None) -> Minimum:
    """Restart from a minimum with one parameter reset to its start; return the better minimum.

    Two couplings of the same states act through a square, (G + F)², so that χ² has two similar minima along one of them. The few
    parameters that changed by more than half their size and by many standard errors are tried.
    """
    start, moved = search.parameters.start, first.parameters - search.parameters.start
    floor = round_off(search, search.line_values(first.parameters).slopes)
    errors = regression(first.jacobian, search.parameters.names, floor).errors
    far = (start != 0) & (np.abs(moved) > _FURTHER * np.abs(start)) & (np.abs(moved) > _MANY_ERRORS * errors)
    order = np.argsort(np.where(far, -np.abs(moved) / np.maximum(np.abs(start), _AT_ZERO_MHZ), 0.0), kind="stable")
    for place in order[: min(int(far.sum()), _PUT_BACK)].tolist():
        back = first.parameters.copy()
        back[place] = start[place]
        left = min(search.options.most_iterations - len(first.iterations), _FIRST_ITERATIONS)
        try:
            second = _continued(first, _minimised(search, back, progress, max(left, 0)))
        except ValueError:  # out of the bounds of the model
            continue
        lower = first.residuals @ first.residuals - second.residuals @ second.residuals
        first = _better(first, second, replaced=second.converged and bool(lower > _LOWER))
        if first.status == INTERRUPTED:
            break
    return first


def _better(first: Minimum, second: Minimum, *, replaced: bool) -> Minimum:
    """The better of two searches with the iterations of both; an interrupt of the second ends the whole search."""
    best = second if replaced else replace(first, iterations=second.iterations)
    return replace(best, status=INTERRUPTED) if second.status == INTERRUPTED else best


def _continued(first: Minimum, second: Minimum) -> Minimum:
    """The second search with the iterations of both."""
    return replace(second, iterations=(*first.iterations, *second.iterations))


def _with_most_lines(search: Search, first: Minimum, progress: Progress | None) -> Minimum:
    """Restart with far-off lines added last; return the better minimum.

    If two levels are mixed nearly half and half, a small error of the constants exchanges their labels. The residuals of such lines
    equal the level spacing, a hundred times those of the others, and they dominate a direct search. Once the other lines fit, the
    labels are right and these lines are included again.
    """
    last, limit = replace(first, parameters=search.parameters.start), search.options.most_iterations
    rough = replace(search.options, tolerance=_NEARLY)
    for number in range(_ROUNDS):
        part = replace(search, options=rough, used=_not_far_off(search, last.parameters))
        if (part.used == search.used).all() and not number:
            return first  # all lines: this repeats the direct search
        if (part.used == search.used).all() or too_few(search.lines, part.used, search.parameters):
            break
        before = part.evaluate(last.parameters)[0]
        left = min(max(limit - len(last.iterations), 0), _ROUND_ITERATIONS)
        last = _continued(last, _minimised(part, last.parameters, progress, left))
        if last.status == INTERRUPTED:  # `first` remains the best point with all lines
            return _better(first, last, replaced=False)
        # the rms of this part has not halved
        if last.residuals @ last.residuals > before @ before / 4 and last.rms > search.options.poor_rms:
            return replace(first, iterations=last.iterations)
    left = max(limit - len(last.iterations), 0)
    second = _continued(last, _minimised(search, last.parameters, progress, left, _makes_no_way(search.options)))
    return _better(first, second, replaced=second.rms < first.rms)


def _not_far_off(search: Search, values: Floats) -> NDArray[np.bool_]:
    """Which lines (lines,) count and have a residual that is not many times the median."""
    group = search.group
    size = np.abs(search.weighted(values)[0][: len(group.first)])
    near = size <= max(_FAR * float(np.median(size)), search.options.poor_rms)
    blends = search.lines.blend[group.first[near]]
    return search.used & np.isin(search.lines.blend, blends)


def _by_stages(search: Search, first: Minimum, progress: Progress | None, rough: float) -> Minimum:
    """Search by rising J; return the better minimum.

    Lines of low J depend almost linearly on the constants even if these are 10 % off, and the constants that they determine predict
    the next lines. Lines are added by J, a tenth of them first. Until all lines are in, a constant may change by about its own
    size, and one that starts at 0 stays there. rough : standard errors within which a stage has converged
    """
    j = np.maximum(search.lines.upper[:, 0], search.lines.lower[:, 0])
    last, limit = replace(first, parameters=search.parameters.start), search.options.most_iterations
    coarse = replace(search.options, tolerance=rough)  # a stage only prepares the next, so that it ends early
    try:
        for share in _STAGES:
            cut = np.quantile(j[search.used], share)  # lines of low J first: they depend little on distortion
            # what low J does not determine stays near its start
            soft = np.minimum(search.parameters.prior, np.maximum(np.abs(search.parameters.start), _AT_ZERO_MHZ))
            stage = replace(
                search, options=coarse, used=search.used & (j <= cut), parameters=replace(search.parameters, prior=soft)
            )
            left = min(max(limit - len(last.iterations), 0), _STAGE_ITERATIONS)
            last = _continued(last, _minimised(stage, last.parameters, progress, left))
            # this minimum has only part of the lines; `first` remains the best point with all lines
            if last.status == INTERRUPTED:
                return _better(first, last, replaced=False)
        left = max(limit - len(last.iterations), 0)
        second = _continued(last, _minimised(search, last.parameters, progress, left, _makes_no_way(search.options)))
    except ValueError:  # a stage left the bounds of the model
        return first
    return _better(first, second, replaced=second.rms < first.rms)


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
        floor=round_off(search, search.line_values(start).slopes),
        progress=progress,
        hopeless=hopeless,
    )
