"""Accuracy of levels and lines: choice of spins and of their treatment, sweeps of orders of distortion and of treatments.

Energies of one J are eigenvalues of complete blocks, so that a higher J max only adds levels. The stated error contains rounding, the size
of known spin couplings that are neglected, and the estimated error of an approximate treatment of spins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.effects.watson import order_of_constant, to_order
from rotor.quantum.estimates.plans import describe_levels
from rotor.quantum.levels import energies_like
from rotor.requests.budget import ErrorTerm, size_text
from rotor.requests.knob import NOTHING_CHEAPER, Estimate, Knob, Measure, Sought
from rotor.requests.numerics import Goal, Numerics, numerical_error
from rotor.requests.plan import Growth

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

TREATMENTS = ("left out", "first-order", "N-diagonal", "auto", "exact")
FOR_METHOD = 0.9  # share of an accuracy for the error of another treatment
SPINS = frozenset({"nuclear quadrupole", "spin-rotation", "spin-spin", "hyperfine method"})
SHORT_J = (12, 30)  # J from which the cost is extrapolated; up to the second J it is measured


class Treatment(NamedTuple):
    """A treatment of spins by its place in TREATMENTS, and the tolerance of "auto"."""

    place: int
    tolerance_mhz: float = 0.0

    def __str__(self) -> str:
        return TREATMENTS[self.place]


LEFT_OUT, FIRST_ORDER, DIAGONAL, AUTO, EXACT = map(Treatment, range(len(TREATMENTS)))


def _treatments(sought: Sought) -> Iterator[Treatment]:
    """Treatments of spins with known constants, cheapest first: left out, of several spins the cheapest method, and exact.

    All orders of distortion remain: for water up to J = 40 (13 ms) orders above J⁴ cost 3 ms, and they are not small against 1 kHz. A
    single nucleus is exact at the same cost (docs/accuracy.md). Spins that the user turned on or off remain so.
    """
    top, entries, present = sought.request.top, sought.entries.values, _has_spins(sought.request)
    if top.spin_constants is None or not (present or entries.get("effects.hyperfine") is None):
        return
    sought.known["size"] = _spin_size(top)
    if not present:
        yield LEFT_OUT
    method = entries.get("effects.hyperfine_method", str(EXACT))
    if method != str(EXACT):
        yield Treatment(TREATMENTS.index(method))
    elif len(top.spin_constants.twice) > 1:
        yield AUTO._replace(tolerance_mhz=FOR_METHOD * sought.accuracy)
    else:
        yield EXACT


def _treatment_text(sought: Sought, treatment: Treatment) -> str:
    size = size_text(sought.known["size"], "MHz")
    if treatment == LEFT_OUT:
        return f"spins of nuclei left out, {size}"
    if treatment.tolerance_mhz:
        return f"with spins of nuclei, {size}, by the cheapest method to {treatment.tolerance_mhz:g} MHz"
    spins = "with spins of nuclei" + ("" if _has_spins(sought.request) else f", {size}")
    return f"{spins}: {treatment}" + (", nothing cheaper" if treatment == EXACT else "")


def _has_spins(request: Any) -> bool:
    return any(effect.spins(request.top) for effect in request.effects)


def _spin_size(top: Any) -> float:
    """The largest size of known spin couplings at J = 1."""
    from rotor.quantum.effects.of_top import spin_effects

    return max((effect.size_mhz(top, 1) for effect in spin_effects(top)), default=0.0)


def levels_error(answer: Any, top: Any, levels: Any) -> float:
    """The numerical error that an answer states, plus the size of known spin couplings that are neglected."""
    has_spins = top.spin_constants is None or any(effect.spins(top) for effect in levels.effects)
    return numerical_error(answer) + (0.0 if has_spins else _spin_size(top))


def level_error(levels: Levels, reference: Levels) -> float:
    """The largest difference of an energy in MHz; infinite if no level is in both."""
    return largest(energies_like(reference, levels) - reference.energy_mhz)


def largest(differences: Floats) -> float:
    """The largest absolute value that is not NaN; infinite without any."""
    sizes = np.abs(differences[np.isfinite(differences)])
    return float(sizes.max()) if len(sizes) else math.inf


def _orders(request: Any) -> list[int]:
    """Powers of J in the operators of the constants."""
    top = request.top
    return [2, *sorted({order_of_constant(name, top.constants) for name in top.constants.values if name not in "ABC"})]


def _without_orders(request: Any) -> str | None:
    """Why orders of distortion cannot be swept; None if they can."""
    if request.top.states is not None:
        return "not swept: the top has several states"
    present = any(effect.name == "centrifugal distortion" for effect in request.effects)
    return None if present and len(_orders(request)) > 1 else ""


def distortion(measure: Measure) -> Knob:
    """The order of centrifugal distortion, up to the highest of the constants."""
    return Knob(
        _orders,
        None,
        (measure,),
        lambda _: "all constants; the orders that they do not have are in the plan",
        key="effects.distortion",
        title="order of centrifugal distortion",
        unchosen="all that the constants have: fewer save milliseconds at the most",
        change=lambda request, _, order: replace(request, top=to_order(request.top, order)),
        value=lambda request: _orders(request)[-1],
        fixed=_without_orders,
        # no level table
        prepare=lambda request: replace(request, top=request.top.with_constants(request.top.constants)),
        reference=lambda request: request,
        label="order J^{}".format,
    )


def hyperfine(measure: Measure) -> Knob:
    """The treatment of hyperfine structure, from none to the exact one."""
    return Knob(
        (LEFT_OUT, FIRST_ORDER, DIAGONAL, EXACT),
        EXACT,
        (measure,),
        lambda _: "the exact method itself",
        key="effects.hyperfine_method",
        title="method of hyperfine structure",
        change=_treated,
        value=_treatment,
        fixed=lambda request: None if any(effect.name in SPINS for effect in request.effects) else "",
        label=str,
        series=False,
        tried=_treatments,
        # the answer states the error of other treatments
        error=lambda sought, _, treatment: Estimate(sought.known["size"] if treatment == LEFT_OUT else 0.0),
        text=_treatment_text,
        refuses=(),
    )


def _treatment(request: Any) -> Treatment | None:
    """The treatment of a request; None for one that depends on a tolerance."""
    from rotor.quantum.hyperfine_method import HyperfineMethod

    if not _has_spins(request):
        return LEFT_OUT
    name = next((effect.method for effect in request.effects if isinstance(effect, HyperfineMethod)), str(EXACT))
    treatment = Treatment(TREATMENTS.index(name))
    return None if treatment == AUTO else treatment


def _treated(request: Any, _: str, treatment: Treatment) -> Any:
    """The request with another treatment of spins; it has distortion only if it had it before."""
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.effects.watson import Centrifugal

    if treatment == _treatment(request):
        return request
    tolerance = [treatment.tolerance_mhz] if treatment.tolerance_mhz else []
    effects = effects_of(request.top, treatment != LEFT_OUT, str(treatment), *tolerance)
    if not any(isinstance(effect, Centrifugal) for effect in request.effects):
        effects = tuple(effect for effect in effects if not isinstance(effect, Centrifugal))
    return replace(request, effects=effects)


def rounding_of(top: Any, j: int) -> ErrorTerm:
    """Rounding error (MHz) of the rotational energies of one J."""
    from rotor.quantum.estimates.budgets import rounding_term
    from rotor.quantum.request import LevelsRequest, answer_levels

    levels = answer_levels(LevelsRequest(top, jmin=j, jmax=j)).table.levels
    return replace(rounding_term(levels.energy_mhz), source="the highest energy")


def by_blocks(top: Top, j: float) -> float:
    """Work of the levels up to J: blocks of an asymmetric top are diagonalised, other tops have closed forms."""
    return (j + 1.0) ** (3 if top.kind == "asymmetric" else 1)


ENERGY = Measure(
    "energy of a level",
    "MHz",
    lambda answer, reference: level_error(answer.table.levels, reference.table.levels),
)
JMAX = Knob(
    key="observables.jmax",
    attribute="jmax",
    fixed=f"{NOTHING_CHEAPER}; it says which levels, not how well",
    cost=Growth(
        SHORT_J,
        prepare=lambda request: replace(request, jmin=0, kmin=None, kmax=None, max_energy_mhz=None),
        work=lambda request, j: by_blocks(request.top, j),
        memory=lambda request, j: by_blocks(request.top, j),
    ),
)
LEVELS = Numerics(
    {"MHz": Goal("energies", lambda answer: levels_error(answer, answer.request.top, answer.table.levels))},
    knobs=(JMAX, distortion(ENERGY), hyperfine(ENERGY)),
    describe=describe_levels,
    rounding=lambda request: rounding_of(request.top, request.jmax),
)
