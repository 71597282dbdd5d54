"""Choice of the constants that the lines determine, and of the unmeasured line that would help most.

Adding one constant changes χ²₀ of a fit to χ²₁ with f₁ degrees of freedom. If the constant is not needed,
F = (χ²₀ - χ²₁)/(χ²₁/f₁) follows Fisher's distribution with 1 and f₁ degrees of freedom. The second criterion is Akaike's, with
the correction for small samples (N. Sugiura, Commun. Stat. A7, 13 (1978)),

    AICc = n ln(χ²/n) + 2k + 2k(k + 1)/(n - k - 1),

the third the rms of the leave-one-out residuals r_i/(1 - h_i), to first order in the leverages h
(D. M. Allen, Technometrics 16, 125 (1974)). A constant is added when all three criteria improve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments
from rotor.fitting.choice.criteria import aicc, cross_validated_rms, f_test
from rotor.fitting.choice.orders import j_order
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import Parameters, parameters, with_names
from rotor.fitting.result import Fit
from rotor.fitting.search.first_values import beside_zero, line_evaluator, weighted_derivatives
from rotor.fitting.top_constants import ConstantSet
from rotor.quantum.labels.labelled import LevelModel
from rotor.statistics.least_squares import INTERRUPTED
from rotor.table import counted

CHANCE = 0.01  # highest probability of an F this large by chance for which a constant is added
_MOST_STEPS = 40
_TRIED = 8  # most promising constants, or pairs, that are fitted at each step
_MADE_UP = 1e-14  # relative squared length below which a column of derivatives depends linearly on the others


@dataclass(frozen=True, eq=False)
class Trial:
    """A fit with one constant added or removed.

    name, added : the constant ("HK with h1" for a pair), and whether it was added (True) or removed. fit : the resulting fit
    f_ratio, chance : F and the probability of an F this large if the constant is not needed
    aicc, cross_validated : criteria of this model; `aicc_before` and `cross_validated_before` : of the model before the change
    """

    name: str
    added: bool
    fit: Fit
    f_ratio: float
    chance: float
    aicc: float
    cross_validated: float
    aicc_before: float
    cross_validated_before: float

    @property
    def better(self) -> bool:
        """Whether the fit converged and all criteria favour this model."""
        return self.fit.converged and not self.objections

    @property
    def objections(self) -> tuple[str, ...]:
        """The criteria that do not favour this model: "by chance", "AICc", "left-one-out rms"."""
        if self.added:
            favoured = {
                "by chance": self.chance < CHANCE,
                "AICc": self.aicc < self.aicc_before,
                "left-one-out rms": self.cross_validated < self.cross_validated_before,
            }
        else:
            favoured = {"by chance": self.chance >= CHANCE, "AICc": self.aicc <= self.aicc_before}
        return tuple(name for name, favours in favoured.items() if not favours)

    @property
    def error_ratio(self) -> float:
        """|constant|/standard error in the larger model; nan where it is not in the model tried."""
        if not self.added:
            return float("nan")
        # a trial of a pair is named "first with second"
        i = self.fit.parameters.names.index(self.name.partition(" with ")[0])
        return float(abs(self.fit.values[i]) / self.fit.errors[i])


def try_constants(fit: Fit, candidates: Sequence[str], options: FitOptions | None = None) -> list[Trial]:
    """Repeat the fit with each candidate added (starting from 0) if it is not free, or removed (set to 0) if it is.

    Parameters
    ----------
    fit : Fit
        In plain constants (see `rotor.fitting.parameters.parameters`).
    candidates : sequence of str
    options : FitOptions, optional

    Returns
    -------
    list of Trial
        Added constants first, sorted by decreasing F. A, B, C, the energy E of a state, and constants with an a-priori error
        (a measurement in itself) are never removed. Ties and a-priori errors stay; a constant tied to a removed one
        becomes 0 too.

    Raises
    ------
    ValueError
        For a name that does not belong to the kind of top or the reduction, and for a tied constant.
    """
    options = replace(options or FitOptions(), pass_interrupt=True)
    constants = with_names(fit.named, [name for name in candidates if name not in fit.parameters.names])
    out = []
    for name in candidates:
        full_name = constants.spelling(name)
        if full_name in fit.parameters.names:
            has_prior = np.isfinite(fit.parameters.prior[fit.parameters.names.index(full_name)])
            if full_name.partition("[")[0] not in ("A", "B", "C", "E") and not has_prior:
                out.append(_without(fit, full_name, options))
        else:
            out.append(_with(fit, constants, full_name, options))
    return sorted([trial for trial in out if trial], key=lambda trial: (not trial.added, -trial.f_ratio))


def _with(fit: Fit, constants: ConstantSet, name: str, options: FitOptions | None) -> Trial | None:
    others = [other for other in constants.values if other not in fit.named.values and other != name]
    extended, _ = beside_zero(constants.replace(**dict.fromkeys(others)), [name], fit.lines, options)
    more = fit.parameters.moved(fit.values).with_free(extended, [name])
    try:
        trial_fit = fit_lines(fit.lines, extended, more, options)
    except ValueError:  # more constants than lines
        return None
    ratio, chance = f_test(fit, trial_fit)
    return _trial(name, True, fit, trial_fit, ratio, chance)


def _without(fit: Fit, name: str, options: FitOptions | None) -> Trial | None:
    rest = fit.parameters.moved(fit.values).without(name)
    constants = dict(zip(rest.constant_names, rest.to_constants(rest.start).tolist(), strict=True))
    try:
        trial_fit = fit_lines(fit.lines, fit.named.replace(**constants), rest, options)
    except ValueError:  # constants that the model refuses are no candidate
        return None
    ratio, chance = f_test(trial_fit, fit)
    return _trial(name, False, fit, trial_fit, ratio, chance)


def _trial(name: str, added: bool, before: Fit, trial_fit: Fit, ratio: float, chance: float) -> Trial:
    return Trial(
        name,
        added,
        trial_fit,
        ratio,
        chance,
        aicc(trial_fit),
        cross_validated_rms(trial_fit),
        aicc(before),
        cross_validated_rms(before),
    )


def choose_constants(
    lines: Assignments,
    constants: ConstantSet,
    base: Sequence[str] | Parameters,
    candidates: Sequence[str],
    options: FitOptions | None = None,
    *,
    by_order: bool = True,
    progress: Callable[[Trial], None] | None = None,
) -> tuple[Fit, list[Trial]]:
    """Build up a model order by order in J, then remove the constants that it does not need.

    Within an order, the candidate with the largest F among those favoured by all three criteria is added, until none is
    left. If no single constant helps, pairs of the same order are tried, because such constants are often significant only
    together. Then the next order follows. At the end, constants that the model does not need are removed one by one, highest
    order first.

    Parameters
    ----------
    lines : Assignments
    constants : Constants or TopConstants
        Start of the fit; candidates that it lacks start from 0.
    base : sequence of str or Parameters
        Constants that are always free; given as `Parameters`, their ties and a-priori errors stay.
    candidates : sequence of str
    options : FitOptions, optional
    by_order : bool
        False: candidates of all orders compete from the first step on. For perturbed states this can reach high-order constants
        that the search by order misses; compare both by `aicc`.
    progress : callable, optional
        Called after each step.

    Returns
    -------
    (Fit, list of Trial)
        The last fit and the steps that led to it. After a KeyboardInterrupt: the model so far, marked as not converged.
    """
    start = constants if isinstance(base, Parameters) else with_names(constants, base)
    free = base if isinstance(base, Parameters) else parameters(start, base)
    fit = fit_lines(lines, start, free, _patient(options))
    fixed, taken = tuple(fit.parameters.names), list[Trial]()
    extended = with_names(start, [name for name in candidates if name not in start])  # refuses unknown names
    names = dict.fromkeys(extended.spelling(name) for name in candidates)
    orders = {name: j_order(name, extended) for name in names if name not in fixed}
    free.with_free(extended, list(orders))  # refuses tied constants

    different = sorted(set(orders.values()))
    groups = [{order} for order in different] if by_order else [set(different)]
    try:
        for trial in _steps(fit, fixed, orders, groups, _patient(options)):
            taken.append(trial)
            if progress:
                progress(trial)
    except KeyboardInterrupt:
        last = taken[-1].fit if taken else fit
        ended = replace(last.minimum, status=INTERRUPTED)
        return replace(
            last,
            minimum=ended,
            converged=False,
            reason=f"interrupted after {counted(len(taken), 'step')} of the choice",
        ), taken
    return taken[-1].fit if taken else fit, taken


def _steps(
    fit: Fit, fixed: Sequence[str], orders: Mapping[str, int], groups: Sequence[set[int]], options: FitOptions
) -> Iterator[Trial]:
    """The steps of `choose_constants`; each trial is better than the model before it."""
    count, before = 0, -1
    while count > before:  # repeat while constants are added: a higher order may make a lower one significant
        before = count
        for group in groups:
            while count < _MOST_STEPS:
                left = [name for name in orders if orders[name] in group and name not in fit.parameters.names]
                best = _best_added(fit, left, options)
                if best is None:
                    break
                count, fit = count + 1, best.fit
                yield best
    while True:
        spare = [name for name in fit.parameters.names if name not in fixed]
        needless = [trial for trial in try_constants(fit, _weakest(fit, spare), options) if trial.better]
        if not needless:
            return
        # the highest order first: its operators contain those of lower order
        least = min(needless, key=lambda trial: (-orders[trial.name], trial.f_ratio))
        fit = least.fit
        yield least


def _best_added(fit: Fit, left: Sequence[str], options: FitOptions) -> Trial | None:
    """The candidate with the largest F that all three criteria favour; a pair if no single constant helps.

    Only the few candidates with the largest decrease of χ² in the linear model are fitted; see `promised`.
    """
    if not left:
        return None
    alone, pairs = promised(fit, left, options)
    for name in beside_zero(with_names(fit.named, left), left, fit.lines, options)[
        1
    ]:  # their first derivatives are 0, so the linear model cannot judge them
        i = left.index(name)
        alone[i], pairs[i], pairs[:, i] = np.inf, 0.0, 0.0
    few = [left[i] for i in np.argsort(-alone, kind="stable")[:_TRIED].tolist()]
    best = next((trial for trial in try_constants(fit, few, options) if trial.added and trial.better), None)
    if best is not None or len(left) < 2:
        return best
    upper = [(i, j) for i in range(len(left)) for j in range(i)]
    order = sorted(upper, key=lambda pair: -pairs[pair])[:_TRIED]
    pairs_better = [trial for i, j in order if (trial := _pair(fit, left[j], left[i], options)) and trial.better]
    return max(pairs_better, key=lambda trial: trial.f_ratio, default=None)


def promised(fit: Fit, names: Sequence[str], options: FitOptions | None = None) -> tuple[Floats, Floats]:
    """First-order decrease of χ² for each constant set free (n,), and for each pair (n, n).

    Let x be the derivatives by a new constant, projected off those of the fit: x - J J⁺ x. The constant decreases χ² by
    (x · r)²/(x · x); a pair by b A⁻¹ b with b_i = x_i · r and A_ij = x_i · x_j. A linearly dependent constant gives 0.
    """
    search = line_evaluator(fit.lines, fit.named, fit.parameters, options or FitOptions(), fit.used)
    derivatives, columns = search.weighted(fit.values)[1], weighted_derivatives(fit, names, options)
    # a-priori values do not depend on other constants
    columns = np.vstack([columns, np.zeros((len(derivatives) - len(columns), len(names)))])
    size = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(size > 0, size, 1.0)
    # unit columns, so that no unit of a constant decides the rank
    basis = np.linalg.qr(
        derivatives / np.where(np.linalg.norm(derivatives, axis=0) > 0, np.linalg.norm(derivatives, axis=0), 1.0)
    )[0]
    for _ in range(2):  # project twice: the first projection loses digits by cancellation
        columns = columns - basis @ (basis.T @ columns)
    products, along = columns.T @ columns, columns.T @ fit.residuals
    squared_norms = np.diag(products).copy()
    seen = squared_norms > _MADE_UP
    alone = np.where(seen, along**2 / np.where(seen, squared_norms, 1.0), 0.0)
    determinant = np.outer(squared_norms, squared_norms) - products**2
    both = np.outer(along**2, squared_norms) + np.outer(squared_norms, along**2) - 2 * np.outer(along, along) * products
    # the determinant of nearly parallel columns is round-off
    apart = determinant > 1e-6 * np.outer(squared_norms, squared_norms)
    apart &= np.outer(seen, seen)
    return alone, np.where(apart, both / np.where(apart, determinant, 1.0), 0.0)


def _weakest(fit: Fit, names: Sequence[str]) -> list[str]:
    """The few constants that are smallest relative to their standard errors."""
    ratio = dict(zip(fit.parameters.names, np.abs(fit.values) / fit.errors, strict=True))
    return sorted(names, key=lambda name: ratio[name])[:_TRIED]


def _patient(options: FitOptions | None) -> FitOptions:
    """Options of intermediate models: they may fit poorly, and an interrupt ends the whole choice."""
    # a trial is judged by its F-ratio, not by its rms
    return replace(options or FitOptions(), poor_rms=1e12, pass_interrupt=True)


def _pair(fit: Fit, first: str, other: str, options: FitOptions) -> Trial | None:
    """Two constants added in one step; None if the lines are too few."""
    constants, _ = beside_zero(with_names(fit.named, [first, other]), [first, other], fit.lines, options)
    try:
        free = fit.parameters.moved(fit.values).with_free(constants, [first, other])
        both = fit_lines(fit.lines, constants, free, options)
    except ValueError:  # constants that the model refuses are no candidate
        return None
    ratio, chance = f_test(fit, both)
    return _trial(f"{first} with {other}", True, fit, both, ratio, chance)


@dataclass(frozen=True)
class Suggestion:
    """An unmeasured line: labels, predicted frequency and its error, and the ratio by which it would reduce the error of the constant."""

    upper: tuple[int, ...]
    lower: tuple[int, ...]
    frequency_mhz: float
    error_mhz: float
    error_ratio: float


def suggest_lines(
    fit: Fit,
    name: str,
    upper: Ints,
    lower: Ints,
    *,
    error_mhz: float,
    model: Callable[[Ints], LevelModel] | None = None,
) -> list[Suggestion]:
    """Lines ranked by how much their measurement would reduce the standard error of one parameter.

    A line with derivatives d by the parameters and error σ reduces the variance C_jj by (C d)_j²/(σ² + dᵀ C d).

    Parameters
    ----------
    fit : Fit
    name : str
        The parameter.
    upper, lower : (m, k) arrays
        Labels of the lines to choose from.
    error_mhz : float
        Error of the measurement.
    model : callable, optional
        As in `fit_lines`.

    Returns
    -------
    list of Suggestion

    Raises
    ------
    ValueError
        For an unknown parameter, or one that the lines do not determine (any line that depends on it would).
    """
    if name not in fit.parameters.names:
        raise ValueError(f"{name} is not among the free parameters {', '.join(fit.parameters.names)}")
    column = fit.parameters.names.index(name)
    if not np.isfinite(fit.errors).all():
        raise ValueError(
            "some parameters are not determined by the lines; hold them to get a suggestion for the next line"
        )
    labels, places = np.unique(np.concatenate([upper, lower]), axis=0, return_inverse=True)
    places = places.reshape(-1)
    level_model = model(labels) if model else label_model(fit.named, labels)
    energies, slopes = level_model.levels(fit.parameters.to_constants(fit.values))
    slopes = slopes @ fit.parameters.matrix
    up, low = places[: len(upper)], places[len(upper) :]
    rows = slopes[up] - slopes[low]
    covariance = fit.statistics.covariance
    spread = np.einsum("ij,jk,ik->i", rows, covariance, rows)
    gained = (rows @ covariance[:, column]) ** 2 / (error_mhz**2 + spread)
    ratio = np.sqrt(np.maximum(1 - gained / covariance[column, column], 0.0))  # round-off may leave a negative rest
    frequency = energies[up] - energies[low]
    return [
        Suggestion(
            tuple(np.asarray(upper)[i].tolist()), tuple(np.asarray(lower)[i].tolist()), float(frequency[i]),
            float(np.sqrt(spread[i])), float(ratio[i]),
        )
        for i in np.argsort(ratio, kind="stable").tolist()
    ]  # fmt: skip
