"""Sweeps of levels, of lines and of Raman lines: orders of distortion, method of hyperfine structure, J max, cut.

Energies of levels with one J are eigenvalues of whole blocks: no J max makes them better, and what a list loses is whole lines.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats
from rotor.requests.knob import Measure, Setting, Sweep, Sweeps
from rotor.scenes.choice import NOTHING_CHEAPER

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

SHARES_OF_J = (0.25, 0.4, 0.55, 0.7, 0.85, 1.0)  # of the J max of the scene
BEYOND = 1.3  # times that J max: the reference
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


def distortion(request: Any, error: Callable[[Any, Any], float], of: str, answer: Callable[[Any], Any]) -> list[Sweep]:
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
    list of Sweep
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
    return [Sweep("effects.distortion", (Measure(of, "MHz", error),), tuple(settings), plain, against, answer)]


def hyperfine(request: Any, error: Callable[[Any, Any], float], of: str, answer: Callable[[Any], Any]) -> list[Sweep]:
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
    list of Sweep
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
        Sweep(
            "effects.hyperfine_method",
            (measure,),
            tuple(settings),
            settings[-1].request,
            "the exact method itself",
            answer,
        )
    ]


def levels(request: Any) -> Sweeps:
    """Of a scene of levels."""
    from rotor.quantum.request import answer_levels

    def error(found: Any, reference: Any) -> float:
        return level_error(found.table.levels, reference.table.levels)

    of = "energy of a level"
    found = (*distortion(request, error, of, answer_levels), *hyperfine(request, error, of, answer_levels))
    return Sweeps(
        found, (f"observables.jmax: {NOTHING_CHEAPER}; it says which levels, not how well", *_of_states(request))
    )


def _of_states(request: Any) -> list[str]:
    return ["effects.distortion: not swept: the top has several states"] if request.top.states is not None else []


def spectrum(request: Any) -> Sweeps:
    """Of a scene of lines."""
    from rotor.spectra.request import INTENSITY, answer_spectrum

    def error(found: Any, reference: Any) -> float:
        return line_error(found.lines, reference.lines)

    jmax = answer_spectrum(request).lines.jmax
    fixed = replace(request, jmax=jmax)
    found = (
        _reach(request, jmax, answer_spectrum, INTENSITY),
        *distortion(fixed, error, "frequency of a line", answer_spectrum),
        *hyperfine(fixed, error, "frequency of a line", answer_spectrum),
    )
    return Sweeps(found, tuple(_of_states(request)))


def _reach(request: Any, jmax: int, answer: Callable[[Any], Any], measure: Measure) -> Sweep:
    values = sorted({max(1, round(share * jmax)) for share in SHARES_OF_J})
    settings = tuple(Setting(str(j), replace(request, jmax=j), j == jmax) for j in values)
    beyond = math.ceil(BEYOND * jmax) + 1
    return Sweep("numerics.jmax", (measure,), settings, replace(request, jmax=beyond), f"J max {beyond}", answer)


def raman(request: Any) -> Sweeps:
    """Of a scene of Raman lines."""
    from rotor.spectra.raman_request import SECTION, answer_raman

    def error(found: Any, reference: Any) -> float:
        return shift_error(found.lines, reference.lines)

    jmax = answer_raman(request).lines.jmax
    fixed = replace(request, jmax=jmax)
    found = (
        _reach(request, jmax, answer_raman, SECTION),
        *distortion(fixed, error, "shift of a line", answer_raman),
        *hyperfine(fixed, error, "shift of a line", answer_raman),
    )
    return Sweeps(found, tuple(_of_states(request)))
