"""Accuracy of levels and lines: spins and the method of several, chosen by size; orders of distortion and methods, swept.

Energies of levels with one J are eigenvalues of whole blocks: no J max makes them better, and what a list loses is whole lines. The error
stated is rounding, the size of known spins that are left out, and the estimate of the method of others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.estimates.plans import plan_of_levels
from rotor.requests.budget import ROUNDING
from rotor.requests.knob import NOTHING_CHEAPER, Choice, Measure, Setting, Sweep, Sweeps
from rotor.requests.numerics import Goal, Numerics, numerical_error

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

METHODS = ("first-order", "N-diagonal", "exact")
EXACT, FOR_METHOD = "exact", 0.9  # the usual method of spins; the part of an accuracy that another one may take
SPINS = frozenset({"nuclear quadrupole", "spin-rotation", "spin-spin", "hyperfine method"})


def choose_spins(scene: Any, request: Any, allowed: float) -> Choice:
    """Spins whose constants are known are taken where they are larger than what was asked for, several by the cheapest method.

    All orders of distortion that the constants have are taken: of J ≤ 40 of water, 13 ms, the orders above J⁴ are 3 ms, and those
    above are not small beside 1 kHz.
    """
    top, present = request.top, request.effects
    has_spins = any(effect.spins(top) for effect in present)
    if top.spin_constants is None or not (has_spins or scene.effects.hyperfine is None):
        return Choice(request, NOTHING_CHEAPER)
    size = _spin_size(top)
    if size <= allowed and not has_spins:
        return Choice(request, f"spins of nuclei left out, {size:.2g} MHz")
    if len(top.spin_constants.twice) > 1 and scene.effects.hyperfine_method == EXACT:
        return _cheapest_method(request, size, allowed)
    if has_spins:
        return Choice(request, "with spins of nuclei: exact, nothing cheaper")
    from rotor.quantum.effects.of_top import effects_of

    return Choice(
        replace(request, effects=effects_of(top, True)), f"with spins of nuclei, {size:.2g} MHz: exact, nothing cheaper"
    )


def _cheapest_method(request: Any, size: float, allowed: float) -> Choice:
    """Spins by the cheapest method that is estimated to be within what was asked for; the estimate is in the error stated.

    One nucleus is exact at no more cost (docs/accuracy.md).
    """
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.effects.watson import Centrifugal

    tolerance = FOR_METHOD * allowed
    taken = effects_of(request.top, True, "auto", tolerance)
    if not any(isinstance(effect, Centrifugal) for effect in request.effects):
        taken = tuple(effect for effect in taken if not isinstance(effect, Centrifugal))
    how = f"with spins of nuclei, {size:.2g} MHz, by the cheapest method to {tolerance:g} MHz"
    return Choice(replace(request, effects=taken), how)


def _spin_size(top: Any) -> float:
    """The largest size of known couplings of spins at J = 1."""
    from rotor.quantum.effects.of_top import spin_effects

    return max((effect.size_mhz(top, 1) for effect in spin_effects(top)), default=0.0)


def rounding_mhz(levels: Any) -> float:
    """Of the eigenvalues of some levels: that of the largest."""
    return ROUNDING * float(np.abs(levels.energy_mhz).max(initial=0.0))


def levels_error(answer: Any, top: Any, levels: Any) -> float:
    """The numerical error that an answer states, and the size of known spins that are left out."""
    has_spins = top.spin_constants is None or any(effect.spins(top) for effect in levels.effects)
    return numerical_error(answer) + (0.0 if has_spins else _spin_size(top))


def energies_like(reference: Levels, levels: Levels) -> Floats:
    """Energies of other levels in the rows of a reference, by the quantum numbers that both have; NaN for a level that is not there.

    The rotational angular momentum counts as one of them, whatever its name is.
    """
    shared = [name for name in reference.quanta_names if name in levels.quanta_names and name not in ("n", "j")]
    pairs = [(reference.rotational, levels.rotational)]
    pairs += [(reference.quanta[name], levels.quanta[name]) for name in shared]
    key = np.zeros(len(reference) + len(levels), dtype=np.int64)
    for both in pairs:
        _, code = np.unique(np.concatenate(both), return_inverse=True)
        _, key = np.unique(key * (int(code.max(initial=0)) + 1) + code, return_inverse=True)
    sought, of_levels = key[: len(reference)], key[len(reference) :]
    order = np.argsort(of_levels, kind="stable")
    rows = order[np.minimum(np.searchsorted(of_levels[order], sought), len(of_levels) - 1)]
    return np.where(of_levels[rows] == sought, levels.energy_mhz[rows], np.nan)


def level_error(levels: Levels, reference: Levels) -> float:
    """The largest difference of an energy in MHz; infinite where no level is in both."""
    return largest(energies_like(reference, levels) - reference.energy_mhz)


def largest(differences: Floats) -> float:
    known = np.abs(differences[np.isfinite(differences)])
    return float(known.max()) if len(known) else math.inf


def order_of(name: str, top: Top) -> int:
    """The power of J in the operator of a constant: 2 of A, 4 of DeltaJ."""
    from rotor.quantum.effects.watson import operators_by_name

    return max(2 * sum(powers) for powers in operators_by_name(top.constants)[name])


def to_order(top: Top, order: int) -> Top:
    """A top with the constants whose operators have no higher power of J."""
    above = {name: None for name in top.constants.values if name not in "ABC" and order_of(name, top) > order}
    return top.with_constants(top.constants.replace(**above))


def distortion(request: Any, error: Callable[[Any, Any], float], of: str, answer: Callable[[Any], Any]) -> list[Sweep]:
    """Orders of centrifugal distortion, up to those that the constants have; nothing where there are none.

    error: of an answer beside the reference in MHz. of: what it is the error of. answer: of a request.
    """
    top, names = request.top, [name for name in request.top.constants.values if name not in "ABC"]
    if (
        not names
        or top.states is not None
        or not any(effect.name == "centrifugal distortion" for effect in request.effects)
    ):
        return []
    orders = [2, *sorted({order_of(name, top) for name in names})]
    plain = replace(request, top=top.with_constants(top.constants))  # without a table of levels
    settings = [
        Setting(f"order J^{order}", replace(request, top=to_order(top, order)), order == orders[-1]) for order in orders
    ]
    against = "all constants; the orders that they do not have are in the plan"
    return [Sweep("effects.distortion", (Measure(of, "MHz", error),), tuple(settings), plain, against, answer)]


def hyperfine(request: Any, error: Callable[[Any, Any], float], of: str, answer: Callable[[Any], Any]) -> list[Sweep]:
    """Methods of hyperfine structure, and no spins at all; nothing where the calculation has none.

    error: of an answer beside the reference in MHz. of: what it is the error of. answer: of a request.
    """
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.hyperfine_method import HyperfineMethod

    if not any(effect.name in SPINS for effect in request.effects):
        return []
    used = next((effect.method for effect in request.effects if isinstance(effect, HyperfineMethod)), "exact")
    settings = [Setting("left out", replace(request, effects=effects_of(request.top, False)))]
    for method in METHODS:
        settings.append(
            Setting(method, replace(request, effects=effects_of(request.top, True, method)), method == used)
        )
    measure = Measure(of, "MHz", error)
    return [
        Sweep(
            "effects.hyperfine_method",
            (measure,),
            tuple(settings),
            settings[-1].request,
            "the exact method itself",
            answer,
        )
    ]


def rounding_of(top: Any, j: int) -> float:
    """Rounding of the rotational energies of one J in MHz."""
    from rotor.quantum.request import LevelsRequest, answer_levels

    return rounding_mhz(answer_levels(LevelsRequest(top, jmin=j, jmax=j)).table.levels)


def of_states(top: Top) -> tuple[str, ...]:
    """Why distortion is not swept of a top with several states."""
    return ("effects.distortion: not swept: the top has several states",) if top.states is not None else ()


def sweeps_of_levels(request: Any) -> Sweeps:
    """Orders of distortion and methods of hyperfine structure."""
    from rotor.quantum.request import answer_levels

    def error(answer: Any, reference: Any) -> float:
        return level_error(answer.table.levels, reference.table.levels)

    of = "energy of a level"
    sweeps = (*distortion(request, error, of, answer_levels), *hyperfine(request, error, of, answer_levels))
    exact = f"observables.jmax: {NOTHING_CHEAPER}; it says which levels, not how well"
    return Sweeps(sweeps, (exact, *of_states(request.top)))


LEVELS = Numerics(
    {
        "MHz": Goal(
            "energies", choose_spins, lambda answer: levels_error(answer, answer.request.top, answer.table.levels)
        )
    },
    sweeps=sweeps_of_levels,
    plan=plan_of_levels,
    rounding=lambda request: rounding_of(request.top, request.jmax),
)
