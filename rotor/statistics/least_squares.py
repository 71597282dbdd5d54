"""Nonlinear least squares by the Levenberg-Marquardt method in scaled variables, with a statement of how the search ended.

With residuals r(p) = (observed - calculated)/σ and the Jacobian J = ∂(calculated/σ)/∂p, the step δ minimises

    |J δ - r|² + λ |D δ|²,       D the norms of the columns of J,

(K. Levenberg, Q. Appl. Math. 2, 164 (1944); D. W. Marquardt, J. SIAM 11, 431 (1963); J. J. Moré, Lect. Notes Math. 630,
105 (1978) for D). In the variables D p all columns have length 1, so that constants of 1e5 and 1e-13 MHz can be fitted together. The
step comes from a QR decomposition and the singular values of R, not from JᵀJ, whose condition number is squared. λ starts at 0: for a
nearly linear model Gauss-Newton converges in a few steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.table import counted

Evaluate = Callable[[Floats], tuple[Floats, Floats]]  # p (n,) -> r (m,), J (m, n)
Progress = Callable[["Iteration"], None]

CONVERGED, STALLED, EXHAUSTED, INTERRUPTED = "converged", "stalled", "too many iterations", "interrupted"
FIRST_DAMPING, MOST_DAMPING = 1e-4, 1e12  # λ in the variables D p
_FLOOR = 10.0  # times the tolerance: a shorter step that is not shorter than the last one is round-off
BENT = 0.01  # standard errors left at a minimum above which the linear model does not hold
_NOTHING = 1e-9  # relative to χ²: round-off of the residuals hides smaller changes by a damped step
_PARTS = (1.0, 0.5, 0.25, 0.125)  # fraction of a refused step at which the curved path is evaluated
_MOST_BENT = 0.75  # of the step's length: a larger second-order term makes the curved path unreliable
_WORTHWHILE = 0.1  # of the decrease predicted for the straight step
_UNFORESEEN = 1e-6  # of the length of the residuals: smaller deviations from the linear model may be round-off
_FINER = 0.01  # a λ smaller than the smallest tried so far by this factor is worth trying
_NOISE = 1e-7  # relative to χ²: for smaller changes round-off decides nothing, and the linear model is used
ROUND_OFF = 1e-13  # singular values below this fraction of the largest carry no information


@dataclass(frozen=True)
class Iteration:
    """A trial step: its number, weighted rms before and after, λ, and whether it was accepted.

    predicted : the decrease of χ² in the linear model
    """

    number: int
    rms_before: float
    rms_after: float
    damping: float
    predicted: float
    taken: bool

    def gain(self, count: int) -> float:
        """The ratio of actual to predicted decrease of χ²; count : number of residuals."""
        return (self.rms_before**2 - self.rms_after**2) * count / self.predicted if self.predicted > 0 else -1.0


@dataclass(frozen=True)
class Minimum:
    """The end of a search.

    parameters (n,), residuals (m,), jacobian (m, n) : at the best point, even if the search failed
    status : "converged", "stalled", "too many iterations" or "interrupted"
    gradient : largest |cosine| between the residuals and a column of the Jacobian, 0 at a minimum
    distance : length of the undamped step in standard errors, √(δᵀ JᵀJ δ), 0 at a minimum
    """

    parameters: Floats
    residuals: Floats
    jacobian: Floats
    status: str
    gradient: float
    distance: float
    iterations: tuple[Iteration, ...] = field(default=(), repr=False)

    @property
    def converged(self) -> bool:
        """Whether the search ended at a minimum."""
        return self.status == CONVERGED

    @property
    def rms(self) -> float:
        """√(Σ r²/m), the weighted rms."""
        return _rms(self.residuals)

    @property
    def reason(self) -> str:
        """The status as a sentence with numbers."""
        count, left = len(self.iterations), f"{self.distance:.1e} standard errors"
        bends = ", of which χ² allows none: it bends upwards" if self.distance > BENT * max(1.0, self.rms) else ""
        return {
            CONVERGED: f"converged after {counted(count, 'iteration')}: the next step would be {left}{bends}",
            STALLED: f"no step decreases the residuals, although {left} seem to be left",
            EXHAUSTED: f"not converged after {counted(count, 'iteration')}: the next step would be {left}",
            INTERRUPTED: f"interrupted after {counted(count, 'iteration')}: the next step would be {left}",
        }[self.status]


def minimise(
    evaluate: Evaluate,
    start: Floats,
    *,
    tolerance: float = 1e-4,
    most_iterations: int = 100,
    floor: Floats | None = None,
    progress: Progress | None = None,
    hopeless: Callable[[Sequence[Iteration]], bool] | None = None,
) -> Minimum:
    """Minimise Σ r² over the parameters, from a start.

    Parameters
    ----------
    evaluate : callable
        p (n,) to weighted residuals (m,) and the Jacobian (m, n) of the calculated values. Out of bounds it raises ValueError or
        returns numbers that are not finite; the step is then shortened.
    start : (n,) array
    tolerance : float
        The search has converged if the full step is below this many standard errors (times the weighted rms if above 1). A step below
        ten times this limit also suffices if an undamped step has not halved it, because it is then round-off.
    most_iterations : int
        Largest number of evaluations after the first.
    floor : (n,) array, optional
        Norms below which a column of the Jacobian is round-off from cancellation; such a parameter is not moved.
    progress : callable, optional
        Called with each `Iteration`. A KeyboardInterrupt, there or in `evaluate`, ends the search with the best point.
    hopeless : callable, optional
        Whether further iterations are useless; the search then ends as if all iterations were used.

    Returns
    -------
    Minimum

    Raises
    ------
    ValueError
        When the start itself cannot be evaluated.

    Notes
    -----
    Second derivatives of the model are neglected (Gauss-Newton); the minimum may be local.

    >>> x = np.arange(5.0)
    >>> def decay(p):
    ...     return np.exp(-0.5 * x) - np.exp(-p[0] * x), (-x * np.exp(-p[0] * x))[:, None]
    >>> minimum = minimise(decay, np.array([2.0]))
    >>> minimum.status, round(float(minimum.parameters[0]), 3)
    ('converged', 0.5)
    """
    point = np.array(start, dtype=float)
    blind = np.zeros(len(point)) if floor is None else floor
    state = _State.at(point, *_evaluated(evaluate, point))
    scale, damping, taken, before = state.norms, 0.0, list[Iteration](), math.inf
    refused, arc = list[tuple[float, float]](), None
    first = FIRST_DAMPING  # the smallest λ above 0 to try; lowered if no larger λ helps
    try:
        while True:
            scale = np.maximum(scale, state.norms)
            linear = _Linear.at_state(state, scale, blind)
            if _is_enough(linear.distance, before, tolerance, state):
                return state.ended(CONVERGED, linear, taken)
            if len(taken) >= most_iterations or (hopeless and hopeless(taken)):
                return state.ended(EXHAUSTED, linear, taken)

            step, predicted = arc or linear.step(damping)
            trial = _tried(evaluate, state.parameters + step)
            taken.append(_judged(len(taken) + 1, state, trial, damping, predicted))
            before = linear.distance if damping == 0 else math.inf
            if trial and taken[-1].taken:
                state, refused = trial, []
            if progress:
                progress(taken[-1])
            if trial and not taken[-1].taken and not arc:
                off = trial.residuals - state.residuals + state.jacobian @ step
                refused.append((float(np.linalg.norm(scale * step)), float(np.linalg.norm(off))))
                if arc := linear.arc(state, scale, off, damping):
                    continue
            arc = None
            if taken[-1].taken:
                gain = taken[-1].gain(len(state.residuals))
                if damping == first and gain > 0.75 and len(taken) > 1 and taken[-2].damping == 0:
                    first /= 10.0  # the undamped step goes too far, this one not far enough
                damping = _relaxed(damping, gain, first)
                continue
            damping = max(10.0 * damping, first)
            if damping > MOST_DAMPING or (damping > first and predicted < _NOTHING * state.chi_squared):
                if all(step.damping > 0 for step in _refused(taken)):
                    damping = 0.0  # only damped steps were tried at this point
                elif linear.weakest < _FINER * first:
                    damping = first = linear.weakest
                else:
                    return state.ended(_without_decrease(linear, state, taken, refused), linear, taken)
    except KeyboardInterrupt:
        return state.ended(INTERRUPTED, _Linear.at_state(state, scale, blind), taken)


def _judged(number: int, state: _State, trial: _State | None, damping: float, predicted: float) -> Iteration:
    """A trial step, accepted if χ² decreases; if round-off hides the change, the linear model decides."""
    after = trial.rms if trial else math.inf
    step = Iteration(number, state.rms, after, damping, predicted, False)
    small = damping == 0 and predicted <= _NOISE * state.chi_squared and after <= (1 + _NOISE) * state.rms
    return replace(step, taken=math.isfinite(after) and (step.gain(len(state.residuals)) > 1e-4 or small))


def _is_enough(distance: float, before: float, tolerance: float, state: _State) -> bool:
    """Whether the full step is below the tolerance, or is round-off: an undamped step has not halved it."""
    enough = tolerance * max(1.0, state.rms)
    return distance <= enough or before / 2 < distance <= min(_FLOOR * enough, math.sqrt(_NOISE * state.chi_squared))


def _refused(taken: Sequence[Iteration]) -> list[Iteration]:
    """The refused steps at the last point, latest first."""
    return list(takewhile(lambda step: not step.taken, reversed(taken)))


def _relaxed(damping: float, gain: float, first: float) -> float:
    """λ after an accepted step: smaller if the linear model predicted its gain, larger if not."""
    if gain < 0.25:
        return max(4.0 * damping, first)
    if gain > 0.75:
        damping /= 10.0
    return damping if damping >= first else 0.0


def _without_decrease(
    linear: _Linear, state: _State, taken: Sequence[Iteration], refused: Sequence[tuple[float, float]]
) -> str:
    """The end of a search without a decreasing step: a minimum if the remaining gain is small, otherwise stalled."""
    if not _are_smooth(refused, _UNFORESEEN * float(np.linalg.norm(state.residuals))):
        return STALLED
    left = min(linear.distance, math.sqrt(_left_to_gain(taken, len(state.residuals))))
    return CONVERGED if left < BENT * max(1.0, state.rms) else STALLED


def _are_smooth(refused: Sequence[tuple[float, float]], noise: float) -> bool:
    """Whether the model is smooth: the deviation |r(p + δ) - r + J δ| from the linear model decreases with the square of |δ|.

    If levels exchange their labels, it decreases linearly or not at all. χ² then has a kink, and a point where no step is accepted is
    not a minimum. refused : lengths and deviations of the refused steps; deviations below `noise` are ignored.
    """
    significant = sorted((length, off) for length, off in refused if off > noise)
    longer = [(length, off) for length, off in significant if length > 3 * significant[0][0]]
    if not longer or not significant[0][0]:
        return True
    (short, little), (long, much) = significant[0], longer[0]
    return math.log(much / little) > 1.5 * math.log(long / short)


def _left_to_gain(taken: Sequence[Iteration], count: int) -> float:
    """Upper estimate of the remaining decrease of χ² from the refused steps at the last point; count : number of residuals.

    A step with predicted decrease P and actual decrease G decreases χ² by 2 P t - (2 P - G) t² at its fraction t, to second order: at
    most P²/(2 P - G). If χ² is strongly curved, G is far below 0 and the estimate far below P. A step out of bounds gives no
    information, so the estimate is P.
    """
    left = 0.0
    for step in _refused(taken):
        gain = (step.rms_before**2 - step.rms_after**2) * count
        if not math.isfinite(gain):
            left = max(left, step.predicted)
        elif step.predicted > 0:
            left = max(left, step.predicted**2 / max(2 * step.predicted - gain, step.predicted))
    return left


def _evaluated(evaluate: Evaluate, point: Floats) -> tuple[Floats, Floats]:
    residuals, jacobian = evaluate(point)
    if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
        raise ValueError("the model is not finite at the start; give other start values")
    if jacobian.shape != (len(residuals), len(point)):
        raise ValueError(f"a Jacobian of shape {jacobian.shape}; ({len(residuals)}, {len(point)}) is needed")
    return residuals, jacobian


def _tried(evaluate: Evaluate, point: Floats) -> _State | None:
    try:
        return _State.at(point, *_evaluated(evaluate, point))
    except ValueError:  # out of the bounds of the model: the step is too long
        return None


def _rms(residuals: Floats) -> float:
    return float(np.sqrt(residuals @ residuals / len(residuals))) if len(residuals) else 0.0


class _State(NamedTuple):
    """A point with residuals, Jacobian and the factor R of the QR decomposition of (J, r)."""

    parameters: Floats
    residuals: Floats
    jacobian: Floats
    triangle: Floats

    @classmethod
    def at(cls, parameters: Floats, residuals: Floats, jacobian: Floats) -> _State:
        stacked = np.empty((len(residuals), len(parameters) + 1), order="F")
        stacked[:, :-1], stacked[:, -1] = jacobian, residuals
        return cls(parameters, residuals, jacobian, _triangle(stacked))

    @property
    def norms(self) -> Floats:
        """Lengths (n,) of the columns of the Jacobian."""
        return np.asarray(np.sqrt(np.einsum("ij,ij->j", self.triangle[:, :-1], self.triangle[:, :-1])))

    @property
    def rms(self) -> float:
        return _rms(self.residuals)

    @property
    def chi_squared(self) -> float:
        return float(self.residuals @ self.residuals)

    def ended(self, status: str, linear: _Linear, iterations: list[Iteration]) -> Minimum:
        return Minimum(
            self.parameters, self.residuals, self.jacobian, status, linear.gradient, linear.distance, tuple(iterations)
        )


def _triangle(stacked: Floats) -> Floats:
    """R of the QR decomposition of (m, n), or the matrix itself if it has fewer rows than columns."""
    if len(stacked) <= stacked.shape[1]:
        return stacked
    return np.asarray(np.linalg.qr(stacked, mode="r"))


class _Linear(NamedTuple):
    """The linear model at a point in the variables D p: singular values s, z = Uᵀ r, and D⁻¹ V."""

    s: Floats
    z: Floats
    back: Floats
    gradient: float

    @classmethod
    def at_state(cls, state: _State, scale: Floats, blind: Floats) -> _Linear:
        safe = np.where(scale > 0, scale, 1.0)
        columns: Floats = np.where(state.norms > blind, state.triangle[:, :-1], 0.0)
        last: Floats = state.triangle[:, -1]
        u, s, vt = np.linalg.svd(columns / safe, full_matrices=False)
        s = np.where(s > ROUND_OFF * s.max(initial=0.0), s, 0.0)
        size = float(np.linalg.norm(last)) or 1.0
        norms = np.where(state.norms > 0, state.norms, 1.0)
        gradient = np.abs(columns.T @ last) / (norms * size)
        return cls(s, u.T @ last, vt.T / safe[:, None], float(gradient.max(initial=0.0)))

    @property
    def distance(self) -> float:
        """√(δᵀ JᵀJ δ) of the undamped step."""
        return float(np.linalg.norm(self.z[self.s > 0]))

    @property
    def weakest(self) -> float:
        """Half the square of the smallest singular value; as λ it reduces the step of the least determined combination to two thirds."""
        used = self.s[self.s > 0]
        return float(used.min()) ** 2 / 2 if len(used) else math.inf

    def step(self, damping: float) -> tuple[Floats, float]:
        """The step δ and the predicted decrease of χ², |r|² - |r - J δ|²."""
        used = self.s > 0
        factor = np.where(used, self.s / np.where(used, self.s**2 + damping, 1.0), 0.0)
        along = factor * self.z
        promised = 2 * (self.s * along) @ self.z - (self.s * along) @ (self.s * along)
        return self.back @ along, float(promised)

    def arc(self, state: _State, scale: Floats, off: Floats, damping: float) -> tuple[Floats, float] | None:
        """A point t δ + t² a on a curved path, and the predicted decrease of χ² there; None if the decrease is small.

        The deviation from the linear model, u = r(p + δ) - r + J δ, is ½ δᵀ(∇²r)δ to lowest order. It gives the geodesic acceleration
        a = (JᵀJ + λD²)⁻¹ Jᵀu and r(t) = r - t J δ + t² (u - J a) (M. K. Transtrum and J. P. Sethna, arXiv:1201.5885 (2012)). Here u
        comes from a refused step, so that no additional evaluation is needed. scale : D. off : u
        """
        used = self.s > 0
        inverse = np.where(used, 1 / np.where(used, self.s**2 + damping, 1.0), 0.0)
        bent = self.back @ (inverse * (self.back.T @ (state.jacobian.T @ off)))
        step, promised = self.step(damping)
        along, across = state.jacobian @ step, off - state.jacobian @ bent
        ratio = float(np.linalg.norm(scale * bent)) / (float(np.linalg.norm(scale * step)) or 1.0)
        ways = [(_left(state.residuals - t * along + t * t * across), t) for t in _PARTS if t * ratio <= _MOST_BENT]
        if not ways or state.chi_squared - min(ways)[0] < _WORTHWHILE * promised:
            return None
        least, t = min(ways)
        return t * step + t * t * bent, state.chi_squared - least


def _left(residuals: Floats) -> float:
    return float(residuals @ residuals)
