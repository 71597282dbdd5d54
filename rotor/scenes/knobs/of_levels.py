"""Knobs of levels, of lines and of Raman lines: orders of distortion, method of hyperfine structure, J max, cut.

Energies of levels with one J are eigenvalues of whole blocks: no J max makes them better, and what a list loses is whole lines.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats
from rotor.scenes.choice import NOTHING_CHEAPER
from rotor.scenes.knobs.knob import Knob, Knobs, Measure, Setting

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

SHARES_OF_J = (0.25, 0.4, 0.55, 0.7, 0.85, 1.0)  # of the J max of the scene
BEYOND = 1.3  # times that J max: the reference
COARSER_CUTS = (5.0, 4.0, 3.0, 2.0, 1.0, 0.0)  # decades above the cut of the scene
FINER_CUT = 2.0  # decades below it: a hundred times finer
COARSE_CUTS = (-4.0, -6.0, -8.0, -10.0, -12.0)  # of log10 of the intensity, where a scene has no cut
METHODS = ("first-order", "N-diagonal", "exact")
SPINS = frozenset({"nuclear quadrupole", "spin-rotation", "spin-spin", "hyperfine method"})


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
    sought, own = key[: len(reference)], key[len(reference) :]
    order = np.argsort(own, kind="stable")
    rows = order[np.minimum(np.searchsorted(own[order], sought), len(own) - 1)]
    return np.where(own[rows] == sought, levels.energy_mhz[rows], np.nan)


def level_error(found: Levels, reference: Levels) -> float:
    """The largest difference of an energy in MHz; infinite where no level is in both."""
    return _largest(energies_like(reference, found) - reference.energy_mhz)


def line_error(found: Any, reference: Any) -> float:
    """The largest difference in MHz of a frequency of the reference's lines, from the levels of another list."""
    energies = energies_like(reference.levels, found.levels)
    return _largest(energies[reference.upper] - energies[reference.lower] - reference.frequency_mhz)


def shift_error(found: Any, reference: Any) -> float:
    """The largest difference in MHz of a Raman shift of the reference's lines, from the levels of another list."""
    energies = energies_like(reference.levels, found.levels)
    return _largest(energies[reference.final] - energies[reference.initial] - reference.shift_mhz)


def _largest(differences: Floats) -> float:
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


def distortion(request: Any, error: Callable[[Any, Any], float], of: str, answer: Callable[[Any], Any]) -> list[Knob]:
    """Orders of centrifugal distortion, up to those that the constants have; nothing where there are none.

    Parameters
    ----------
    request : LevelsRequest, SpectrumRequest or RamanRequest
    error : callable
        Of an answer beside the one with all constants, MHz.
    of : str
        What it is the error of.
    answer : callable
        Of a request.

    Returns
    -------
    list of Knob
    """
    top, names = request.top, [name for name in request.top.constants.values if name not in "ABC"]
    if not names or top.states is not None or not any(one.name == "centrifugal distortion" for one in request.effects):
        return []
    orders = [2, *sorted({order_of(name, top) for name in names})]
    plain = replace(request, top=top.with_constants(top.constants))  # without a table of levels
    settings = [
        Setting(f"order J^{one}", replace(request, top=to_order(top, one)), one == orders[-1]) for one in orders
    ]
    against = "all constants; the orders that they do not have are in the plan"
    return [Knob("effects.distortion", (Measure(of, "MHz", error),), tuple(settings), plain, against, answer)]


def hyperfine(request: Any, error: Callable[[Any, Any], float], of: str, answer: Callable[[Any], Any]) -> list[Knob]:
    """Methods of hyperfine structure, and no spins at all; nothing where the calculation has none.

    Parameters
    ----------
    request : LevelsRequest, SpectrumRequest or RamanRequest
    error : callable
        Of an answer beside the exact one, MHz.
    of : str
        What it is the error of.
    answer : callable
        Of a request.

    Returns
    -------
    list of Knob
    """
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.hyperfine_method import HyperfineMethod

    if not any(one.name in SPINS for one in request.effects):
        return []
    used = next((one.method for one in request.effects if isinstance(one, HyperfineMethod)), "exact")
    settings = [Setting("left out", replace(request, effects=effects_of(request.top, False)))]
    for method in METHODS:
        settings.append(
            Setting(method, replace(request, effects=effects_of(request.top, True, method)), method == used)
        )
    measure = Measure(of, "MHz", error)
    return [
        Knob(
            "effects.hyperfine_method",
            (measure,),
            tuple(settings),
            settings[-1].request,
            "the exact method itself",
            answer,
        )
    ]


def levels(request: Any) -> Knobs:
    """Of a scene of levels."""
    from rotor.quantum.request import answer_levels

    def error(found: Any, reference: Any) -> float:
        return level_error(found.table.levels, reference.table.levels)

    of = "energy of a level"
    found = (*distortion(request, error, of, answer_levels), *hyperfine(request, error, of, answer_levels))
    return Knobs(
        found, (f"observables.jmax: {NOTHING_CHEAPER}; it says which levels, not how well", *_of_states(request))
    )


def _of_states(request: Any) -> list[str]:
    return ["effects.distortion: not swept: the top has several states"] if request.top.states is not None else []


def spectrum(request: Any) -> Knobs:
    """Of a scene of lines."""
    from rotor.spectra.request import answer_spectrum

    def error(found: Any, reference: Any) -> float:
        return line_error(found.lines, reference.lines)

    jmax = answer_spectrum(request).lines.jmax
    fixed = replace(request, jmax=jmax)
    found = (
        _reach(request, jmax, answer_spectrum, Measure("intensity left out", "%", _intensity_lost)),
        _cut(request, answer_spectrum),
        *distortion(fixed, error, "frequency of a line", answer_spectrum),
        *hyperfine(fixed, error, "frequency of a line", answer_spectrum),
    )
    return Knobs(found, tuple(_of_states(request)))


def _intensity_lost(found: Any, reference: Any) -> float:
    """The part of the intensity in percent that a list leaves out."""
    one, whole = (float(answer.lines.intensity_nm2_mhz.sum()) for answer in (found, reference))
    return 100.0 * max(1.0 - one / whole, 0.0) if whole else 0.0


def _reach(request: Any, jmax: int, answer: Callable[[Any], Any], measure: Measure) -> Knob:
    values = sorted({max(1, round(share * jmax)) for share in SHARES_OF_J})
    settings = tuple(Setting(str(j), replace(request, jmax=j), j == jmax) for j in values)
    beyond = math.ceil(BEYOND * jmax) + 1
    return Knob("numerics.jmax", (measure,), settings, replace(request, jmax=beyond), f"J max {beyond}", answer)


def _cut(request: Any, answer: Callable[[Any], Any]) -> Knob:
    own = request.min_lgint
    values = COARSE_CUTS if own is None else tuple(own + decades for decades in COARSER_CUTS)
    finest = None if own is None else own - FINER_CUT
    settings = [Setting(f"{cut:g}", replace(request, min_lgint=cut), cut == own) for cut in values]
    if own is None:
        settings.append(Setting("none", request, True))
    measure = Measure("intensity left out", "%", _intensity_lost)
    against = "no cut" if finest is None else f"a cut at {finest:g}"
    return Knob(
        "observables.min_lgint", (measure,), tuple(settings), replace(request, min_lgint=finest), against, answer
    )


def raman(request: Any) -> Knobs:
    """Of a scene of Raman lines."""
    from rotor.spectra.raman_request import answer_raman

    def error(found: Any, reference: Any) -> float:
        return shift_error(found.lines, reference.lines)

    def lost(found: Any, reference: Any) -> float:
        sums = [float(one.lines.cross_section_cm2_per_sr.sum()) for one in (found, reference)]
        return 100.0 * max(1.0 - sums[0] / sums[1], 0.0) if sums[1] else 0.0

    jmax = answer_raman(request).lines.jmax
    measure, own = Measure("cross section left out", "%", lost), request.min_relative
    cuts = [cut for cut in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8) if own is None or cut > own]
    settings = [Setting(f"{cut:g}", replace(request, min_relative=cut)) for cut in cuts]
    settings.append(Setting("none" if own is None else f"{own:g}", request, True))
    finest = None if own is None else 1e-2 * own
    relative = Knob(
        "observables.min_relative",
        (measure,),
        tuple(settings),
        replace(request, min_relative=finest),
        "no cut" if finest is None else f"a cut at {finest:g}",
        answer_raman,
    )
    fixed = replace(request, jmax=jmax)
    found = (
        _reach(request, jmax, answer_raman, measure),
        relative,
        *distortion(fixed, error, "shift of a line", answer_raman),
        *hyperfine(fixed, error, "shift of a line", answer_raman),
    )
    return Knobs(found, tuple(_of_states(request)))
