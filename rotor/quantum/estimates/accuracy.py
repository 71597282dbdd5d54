"""Accuracy of levels and lines: choice of spins and of their treatment, sweeps of orders of distortion and of treatments.

Energies of one J are eigenvalues of complete blocks, so that a higher J max only adds levels. The stated error contains rounding, the size
of known spin couplings that are neglected, and the estimated error of an approximate treatment of spins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.estimates.plans import describe_levels, levels_cost
from rotor.requests.budget import ROUNDING
from rotor.requests.knob import NOTHING_CHEAPER, Choice, Knob, Measure, Sought
from rotor.requests.numerics import Goal, Numerics, numerical_error

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

TREATMENTS = ("left out", "first-order", "N-diagonal", "exact")
EXACT, FOR_METHOD = "exact", 0.9  # default treatment of spins; share of an accuracy for the error of another treatment
SPINS = frozenset({"nuclear quadrupole", "spin-rotation", "spin-spin", "hyperfine method"})


def _treatments(sought: Sought) -> Iterator[Choice]:
    """Treatments of spins with known constants, cheapest first: left out, of several spins the cheapest method, and exact.

    All orders of distortion remain: for water up to J = 40 (13 ms) orders above J⁴ cost 3 ms, and they are not small against 1 kHz. A
    single nucleus is exact at the same cost (docs/accuracy.md). Spins that the user turned on or off remain so.
    """
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.effects.watson import Centrifugal

    request, entries = sought.request, sought.entries.values
    top = request.top
    present = any(effect.spins(top) for effect in request.effects)
    if top.spin_constants is None or not (present or entries.get("effects.hyperfine") is None):
        return
    size = _spin_size(top)
    if not present:
        yield Choice(request, f"spins of nuclei left out, {size:.2g} MHz", size)
    if len(top.spin_constants.twice) > 1 and entries.get("effects.hyperfine_method", EXACT) == EXACT:
        tolerance = FOR_METHOD * sought.accuracy
        effects = effects_of(top, True, "auto", tolerance)
        if not any(isinstance(effect, Centrifugal) for effect in request.effects):
            effects = tuple(effect for effect in effects if not isinstance(effect, Centrifugal))
        how = f"with spins of nuclei, {size:.2g} MHz, by the cheapest method to {tolerance:g} MHz"
        yield Choice(replace(request, effects=effects), how)  # its answer states the error of the method
    elif present:
        yield Choice(request, "with spins of nuclei: exact, nothing cheaper")
    else:
        how = f"with spins of nuclei, {size:.2g} MHz: exact, nothing cheaper"
        yield Choice(replace(request, effects=effects_of(top, True)), how)


def _spin_size(top: Any) -> float:
    """The largest size of known spin couplings at J = 1."""
    from rotor.quantum.effects.of_top import spin_effects

    return max((effect.size_mhz(top, 1) for effect in spin_effects(top)), default=0.0)


def rounding_mhz(levels: Any) -> float:
    """Rounding error of levels: that of the largest eigenvalue."""
    return ROUNDING * float(np.abs(levels.energy_mhz).max(initial=0.0))


def levels_error(answer: Any, top: Any, levels: Any) -> float:
    """The numerical error that an answer states, plus the size of known spin couplings that are neglected."""
    has_spins = top.spin_constants is None or any(effect.spins(top) for effect in levels.effects)
    return numerical_error(answer) + (0.0 if has_spins else _spin_size(top))


def energies_like(reference: Levels, levels: Levels) -> Floats:
    """Energies of `levels` in the rows of a reference, matched by the quantum numbers that both have; NaN for a missing level.

    J and N, the rotational angular momentum, are matched with each other.
    """
    shared = [name for name in reference.quanta_names if name in levels.quanta_names and name not in ("n", "j")]
    pairs = [(reference.rotational, levels.rotational)]
    pairs += [(reference.quanta[name], levels.quanta[name]) for name in shared]
    key = np.zeros(len(reference) + len(levels), dtype=np.int64)
    for both in pairs:
        _, code = np.unique(np.concatenate(both), return_inverse=True)
        _, key = np.unique(key * (int(code.max(initial=0)) + 1) + code, return_inverse=True)
    sought, level_keys = key[: len(reference)], key[len(reference) :]
    order = np.argsort(level_keys, kind="stable")
    rows = order[np.minimum(np.searchsorted(level_keys[order], sought), len(level_keys) - 1)]
    return np.where(level_keys[rows] == sought, levels.energy_mhz[rows], np.nan)


def level_error(levels: Levels, reference: Levels) -> float:
    """The largest difference of an energy in MHz; infinite if no level is in both."""
    return largest(energies_like(reference, levels) - reference.energy_mhz)


def largest(differences: Floats) -> float:
    """The largest absolute value that is not NaN; infinite without any."""
    sizes = np.abs(differences[np.isfinite(differences)])
    return float(sizes.max()) if len(sizes) else math.inf


def order_of(name: str, top: Top) -> int:
    """Power of J in the operator of a constant: 2 for A, 4 for DeltaJ."""
    from rotor.quantum.effects.watson import operators_by_name

    return max(2 * sum(powers) for powers in operators_by_name(top.constants)[name])


def to_order(top: Top, order: int) -> Top:
    """A top without the constants whose operators have a higher power of J."""
    above = {name: None for name in top.constants.values if name not in "ABC" and order_of(name, top) > order}
    return top.with_constants(top.constants.replace(**above))


def _has_distortion(request: Any) -> bool:
    """Whether orders of distortion can be swept."""
    names = [name for name in request.top.constants.values if name not in "ABC"]
    present = any(effect.name == "centrifugal distortion" for effect in request.effects)
    return bool(names) and request.top.states is None and present


def _orders(request: Any) -> list[int]:
    """Powers of J in the operators of the constants."""
    top = request.top
    return [2, *sorted({order_of(name, top) for name in top.constants.values if name not in "ABC"})]


def distortion(measure: Measure) -> Knob:
    """The order of centrifugal distortion, up to the highest of the constants."""
    return Knob(
        _orders,
        None,
        (measure,),
        lambda _: "all constants; the orders that they do not have are in the plan",
        change=lambda request, _, order: replace(request, top=to_order(request.top, order)),
        prepare=lambda request: replace(
            request, top=request.top.with_constants(request.top.constants)
        ),  # no level table
        used=_has_distortion,
        key="effects.distortion",
        title="order of centrifugal distortion",
        value=lambda request: _orders(request)[-1],
        reference=lambda request: request,
        label="order J^{}".format,
    )


def hyperfine(measure: Measure) -> Knob:
    """The treatment of hyperfine structure, from none to the exact one, by its place in TREATMENTS."""
    return Knob(
        range(len(TREATMENTS)),
        TREATMENTS.index(EXACT),
        (measure,),
        lambda _: "the exact method itself",
        change=lambda request, _, place: _treated(request, TREATMENTS[place]),
        used=lambda request: any(effect.name in SPINS for effect in request.effects),
        key="effects.hyperfine_method",
        title="method of hyperfine structure",
        value=_treatment,
        label=lambda place: TREATMENTS[place],
        search=_treatments,
        series=False,
    )


def _treatment(request: Any) -> int | None:
    """The place of a request's treatment in TREATMENTS; None for another treatment."""
    from rotor.quantum.hyperfine_method import HyperfineMethod

    used = next((effect.method for effect in request.effects if isinstance(effect, HyperfineMethod)), EXACT)
    return TREATMENTS.index(used) if used in TREATMENTS else None


def _treated(request: Any, treatment: str) -> Any:
    """The request with another treatment of spins."""
    from rotor.quantum.effects.of_top import effects_of

    if treatment == TREATMENTS[0]:
        return replace(request, effects=effects_of(request.top, False))
    return replace(request, effects=effects_of(request.top, True, treatment))


def rounding_of(top: Any, j: int) -> float:
    """Rounding error (MHz) of the rotational energies of one J."""
    from rotor.quantum.request import LevelsRequest, answer_levels

    return rounding_mhz(answer_levels(LevelsRequest(top, jmin=j, jmax=j)).table.levels)


def reason_of_no_distortion_sweep(top: Top) -> tuple[str, ...]:
    """Reason why distortion of a top with several states is not swept."""
    return ("effects.distortion: not swept: the top has several states",) if top.states is not None else ()


ENERGY = Measure(
    "energy of a level",
    "MHz",
    lambda answer, reference: level_error(answer.table.levels, reference.table.levels),
)
HYPERFINE = hyperfine(ENERGY)
LEVELS = Numerics(
    {
        "MHz": Goal(
            "energies", lambda answer: levels_error(answer, answer.request.top, answer.table.levels), (HYPERFINE,)
        )
    },
    knobs=(distortion(ENERGY), HYPERFINE),
    remarks=lambda request: (
        f"observables.jmax: {NOTHING_CHEAPER}; it says which levels, not how well",
        *reason_of_no_distortion_sweep(request.top),
    ),
    describe=describe_levels,
    cost=levels_cost,
    rounding=lambda request: rounding_of(request.top, request.jmax),
)
