"""Accuracy as an input: the cheapest settings that reach what a scene asks for, and the error that was reached.

| kind | accuracy of | what is chosen | error stated |
|---|---|---|---|
| spectrum, levels, raman | frequencies, energies, shifts, "1 kHz" | spins, left out if smaller; method of several | rounding, and these |
| stark, zeeman | energies, "1 kHz" | tolerance, and with it J max of the basis | by which energies move with a higher J max, round-off |
| align | cosines, 1e-4 | the loosest tolerance (steps, populations), the smallest J max | steps, edge, populations, phases |
| thermo | Q, U and C_v, "0.1 %" | levels summed, or the classical limit with corrections | of the sums |
| tumble | attitude, "1e-6 rad" | see `rotor.scenes.accuracy_motion`; free motion is exact | from finer steps |
| spectrum | intensities, "0.1 %" | nothing: Q is summed to 1e-8 | of the sum Q, and rounding |
| emission | brightness, "1 mK" | the largest least depth, in decades | lines left out, Q |
| fit | frequencies, "1 kHz"; constants, "1 %" of their standard errors | the loosest tolerance of the search, in decades | the next step |
| torsion | levels | nothing: exact | functions, terms of the series |
| gas, fluid | see `rotor.scenes.accuracy_sampled` | | |

It is the numerical error with the constants as given. Their own uncertainty, and orders of distortion that they do not have, are
beside it in a plan. What double precision cannot give is refused.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm
from rotor.scenes.choice import NOTHING_CHEAPER, Accuracy, Choice, Reached, TotalAccuracy, quantity
from rotor.scenes.numerics import choose, choose_by_knob, error_of, numerics_of
from rotor.scenes.scene import Scene

EXACT, FOR_METHOD = "exact", 0.9  # the usual method of spins; the part of an accuracy that another one may take
LOOSEST_COSINE = 0.05
MOST_CONFIRMED = 6  # J max that are confirmed by whole runs of an alignment, before the one of its tolerance is taken
LOOSER = (1e3, 1e2, 1e1, 1.0, 0.3, 0.1)  # tolerances of cosines that are tried, times the accuracy


def asked_of(scene: Scene) -> float | None:
    """The accuracy that a scene asks for, in the unit of its kind; None where it asks for none.

    >>> from rotor.scenes.scene import StarkScene, ThermoScene
    >>> asked_of(StarkScene(molecule="OCS", accuracy="1 kHz")), asked_of(ThermoScene(molecule="CO", accuracy="0.1 %"))
    (0.001, 0.001)
    """
    given = accuracy_text(scene)
    if given is None:
        return None
    numerics = numerics_of(scene.kind)
    if numerics.units:
        return _sampled(scene, given)
    text, scale = str(given).strip(), 1.0
    if text.endswith("%"):
        text, scale = text[:-1], 0.01
    if numerics.unit == "rad":
        text = text.removesuffix("rad").strip()
    if scale != 1.0 and numerics.relative:
        scale = 1.0  # in percent
    elif scale != 1.0 and not numerics.percent:
        raise ValueError(f"accuracy: {given!r}: expected {numerics.unit}, not a percentage")
    unit = numerics.unit if numerics.unit in ("MHz", "K", "Å") and unit_of(scene) != "%" else ""
    value = scale * quantity("accuracy", text, unit)
    if not value > 0.0:
        raise ValueError(f"accuracy: {given!r}: expected more than 0")
    return value


def accuracy_text(scene: Any) -> str | float | None:
    """The accuracy as the scene gives it, of the total or of the numerical error."""
    given: Accuracy = getattr(scene, "accuracy", None)
    return given.total if isinstance(given, TotalAccuracy) else given


def unit_of(scene: Scene) -> str:
    """The unit of the accuracy of a scene.

    >>> from rotor.scenes.scene import GasScene
    >>> [unit_of(GasScene(molecule="water", accuracy=one)) for one in ("1 K", "0.1 %", 0.02)]
    ['K', '%', '']
    """
    numerics = numerics_of(scene.kind)
    text = str(accuracy_text(scene)).strip()
    if not numerics.units:
        return "%" if numerics.relative and text.endswith("%") else numerics.unit
    return "" if _of_curves(scene, text) else "%" if text.endswith("%") else "K"


def _of_curves(scene: Any, text: str) -> bool:
    """Whether an accuracy is that of C1 and C2: a number, or a percentage where their times are asked for; both are 1 at first."""
    percent = text.endswith("%") and scene.kind == "gas" and scene.observables.times is not None
    return percent or _is_number(text)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _sampled(scene: Scene, given: str | float) -> float:
    """The accuracy of a gas or fluid in K, percent, or as a number.

    Raises ValueError for a unit that the kind has not.
    """
    text = str(given).strip()
    if _is_number(text) and "" not in numerics_of(scene.kind).units:
        raise ValueError(f"accuracy: {given!r}: expected a unit: K of the conserved energy, or % of the forces")
    percent = text.endswith("%")
    value = quantity("accuracy", text.removesuffix("%"), "" if percent or _is_number(text) else "K")
    if not value > 0.0:
        raise ValueError(f"accuracy: {given!r}: expected more than 0")
    return 0.01 * value if percent and _of_curves(scene, text) else value


def chosen(scene: Scene, request: Any) -> Choice:
    """The request with the cheapest settings that reach the accuracy of its scene.

    Raises ValueError for what double precision cannot give, and where a knob is given by hand as well.
    """
    asked = asked_of(scene)
    assert asked is not None
    return choose(scene, request, asked, unit_of(scene))


def reached(scene: Scene, answer: Any, choice: Choice) -> Reached:
    """The error that an answer reached; ValueError where it is more than what was asked for, with the reason."""
    asked = asked_of(scene)
    assert asked is not None
    unit = unit_of(scene)
    error = max(error_of(scene.kind, answer, unit), choice.error)
    if error > asked:
        raise out_of_reach(asked, error, unit, choice.how)
    if isinstance(getattr(scene, "accuracy", None), TotalAccuracy):
        refuse_total(_with_error(answer.errors, choice), asked, unit)
    return Reached(asked, error, unit, choice.how)


def out_of_reach(asked: float, error: float, unit: str, how: str) -> ValueError:
    """The refusal of an accuracy that the settings, or double precision, do not reach."""
    return ValueError(
        f"accuracy: {asked:g} {unit}".rstrip()
        + f" cannot be given: the error here is {error:.2g} ({how}); ask for less"
    )


def _with_error(budget: ErrorBudget, choice: Choice) -> ErrorBudget:
    """The budget with the error that was found while the settings were chosen, where the answer alone does not say it."""
    if not choice.error or budget.truncation.value is not None:
        return budget
    return replace(budget, truncation=ErrorTerm(choice.error, choice.how))


def refuse_total(budget: ErrorBudget, accuracy: float, unit: str) -> None:
    """ValueError where the total of a budget is larger than an accuracy, or not estimated: with the terms, and what would lower them."""
    requested = f"accuracy.total: {accuracy:g} {unit}".rstrip()
    if budget.unit != unit:
        raise ValueError(
            f"{requested}: the errors here are of {budget.of} in {budget.unit or 'parts of 1'}; use that unit"
        )
    alone = "an accuracy without total is that of the numerical error alone"
    unknown = [(name, term) for name, term in budget.shown() if term.value is None]
    if unknown:
        texts = [
            f"{name} {term.text(unit)}" + (f" ({term.remedy} would lower it)" if term.remedy else "")
            for name, term in unknown
        ]
        raise ValueError(f"{requested} cannot be given: {'; '.join(texts)}; {alone}")
    total = budget.total
    if total is not None and total > accuracy:
        largest = budget.shortfall(accuracy) or budget.line()
        raise ValueError(
            f"{requested} cannot be given: the total is {total:.2g} {unit}".rstrip() + f"; {largest}; {alone}"
        )


def choose_spins(scene: Any, request: Any, asked: float) -> Choice:
    """Spins whose constants are known are taken where they are larger than what was asked for, several by the cheapest method.

    All orders of distortion that the constants have are taken: of J ≤ 40 of water, 13 ms, the orders above J⁴ are 3 ms, and those
    above are not small beside 1 kHz.
    """
    top, present = request.top, request.effects
    has_spins = any(effect.spins(top) for effect in present)
    if top.spin_constants is None or not (has_spins or scene.effects.hyperfine is None):
        return Choice(request, NOTHING_CHEAPER)
    size = _spin_size(top)
    if size <= asked and not has_spins:
        return Choice(request, f"spins of nuclei left out, {size:.2g} MHz")
    if len(top.spin_constants.twice) > 1 and scene.effects.hyperfine_method == EXACT:
        return _cheapest_method(request, size, asked)
    if has_spins:
        return Choice(request, "with spins of nuclei: exact, nothing cheaper")
    from rotor.quantum.effects.of_top import effects_of

    return Choice(
        replace(request, effects=effects_of(top, True)), f"with spins of nuclei, {size:.2g} MHz: exact, nothing cheaper"
    )


def _cheapest_method(request: Any, size: float, asked: float) -> Choice:
    """Spins by the cheapest method that is estimated to be within what was asked for; the estimate is in the error stated.

    One nucleus is exact at no more cost (docs/accuracy.md).
    """
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.effects.watson import Centrifugal

    tolerance = FOR_METHOD * asked
    taken = effects_of(request.top, True, "auto", tolerance)
    if not any(isinstance(one, Centrifugal) for one in request.effects):
        taken = tuple(one for one in taken if not isinstance(one, Centrifugal))
    how = f"with spins of nuclei, {size:.2g} MHz, by the cheapest method to {tolerance:g} MHz"
    return Choice(replace(request, effects=taken), how)


def _spin_size(top: Any) -> float:
    """The largest size of known couplings of spins at J = 1."""
    from rotor.quantum.effects.of_top import spin_effects

    return max((effect.size_mhz(top, 1) for effect in spin_effects(top)), default=0.0)


def rounding_mhz(levels: Any) -> float:
    """Of the eigenvalues of some levels: that of the largest."""
    return ROUNDING * float(np.abs(levels.energy_mhz).max(initial=0.0))


def error_of_list(answer: Any, unit: str) -> float:
    """The error of the lines of an answer."""
    return _levels_error(answer.lines.top, answer.lines.levels)


def error_of_levels(answer: Any, unit: str) -> float:
    """The error of the levels of an answer."""
    return _levels_error(answer.request.top, answer.table.levels)


def _levels_error(top: Any, levels: Any) -> float:
    """Rounding of the largest energy, the size of known spins that are left out, and the estimate of the method of others."""
    from rotor.quantum.hyperfine_method import used_method

    rounding = rounding_mhz(levels)
    has_spins = any(effect.spins(top) for effect in levels.effects)
    if has_spins:
        used = used_method(levels)
        return rounding + (used.estimate_mhz if used else 0.0)
    return rounding + (0.0 if top.spin_constants is None else _spin_size(top))


def choose_basis(scene: Any, request: Any, asked: float) -> Choice:
    """The loosest tolerance of those tried whose error as it is found by a run is what was asked for, and then the smallest J max.

    A tolerance bounds each source of error; what a run finds is often a hundred times less.
    """
    from rotor.alignment.request import answer_align

    found = choose_by_knob(request, asked)
    for looser in LOOSER:
        tried = replace(request, tolerance=min(looser * asked, LOOSEST_COSINE), classical_molecules=0)
        trace = answer_align(tried).trace
        if trace.error_estimate > asked:
            continue
        if request.jmax is not None:
            return Choice(replace(request, tolerance=tried.tolerance), f"tolerance {tried.tolerance:g}")
        return _least_basis(request, tried.tolerance, trace, asked)
    return found


def _least_basis(request: Any, tolerance: float, trace: Any, asked: float) -> Choice:
    """The smallest J max that is within what the other errors leave, looked for on one block and confirmed by a run."""
    from rotor.alignment.align import BasisTooSmallError, truncation_apart
    from rotor.alignment.basis import least_jmax
    from rotor.alignment.request import answer_align

    first, truncation = least_jmax(trace, asked - truncation_apart(trace))
    for jmax in range(first, min(first + MOST_CONFIRMED, trace.jmax)):
        smaller = replace(request, tolerance=tolerance, jmax=jmax)
        try:
            found = answer_align(replace(smaller, classical_molecules=0)).trace
        except BasisTooSmallError:
            continue
        error = truncation_apart(found) + max(found.edge_population, truncation)
        if error <= asked:
            return Choice(smaller, f"tolerance {tolerance:g}, and J max {jmax}", error)
    return Choice(replace(request, tolerance=tolerance), f"tolerance {tolerance:g}, and J max {trace.jmax} from it")
