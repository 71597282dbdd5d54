"""Knobs of sums over levels, of levels in a field and of alignment: the tolerance of each, and J max of the basis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.scenes.knobs.knob import Knob, Knobs, Measure, Setting, ladder

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace

ERRORS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)  # of a partition function, relative
FINEST_SUM = 1e-13
TOLERANCES_MHZ = (1e3, 1e2, 1e1, 1.0, 1e-1, 1e-2, 1e-4, 1e-6)
TOLERANCES = (3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
FINEST_TOLERANCE = 1e-11
MORE_J = 6  # in the reference
SHARES_OF_J = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


def thermo(request: Any) -> Knobs:
    """Of a scene of thermodynamic functions."""
    from rotor.thermodynamics.request import answer_thermo

    measures = tuple(
        Measure(of, "%", _relative(name))
        for of, name in (("Q", "q_rot"), ("U", "energy_j_per_mol"), ("C_v", "cv_over_r"))
    )
    settings = ladder(ERRORS, request.relative_error, lambda one: replace(request, relative_error=one))
    finest = replace(request, relative_error=FINEST_SUM)
    against = f"sums to {FINEST_SUM:g}"
    knob = Knob("numerics.relative_error", measures, settings, finest, against, answer_thermo)
    return Knobs((knob,), ("vibration: its states are summed in closed form",) if request.vibrations else ())


def _relative(name: str) -> Callable[[Any, Any], float]:
    """The largest relative error in percent of a column, relative to its largest value where it passes through 0."""

    def error(found: Any, reference: Any) -> float:
        one, true = (np.asarray(getattr(answer.functions, name)) for answer in (found, reference))
        return 100.0 * float(np.max(np.abs(one - true) / np.maximum(np.abs(true), 1e-12)))

    return error


def stark(request: Any) -> Knobs:
    """Of a scene of levels in a field."""
    from rotor.quantum.fields.stark_request import answer_stark

    # energies alone decide on a basis that is to be seen failing
    plain = replace(request, diabatic_gap_mhz=None, most_at_edge=1.0)
    measure = Measure(
        "energy", "MHz", lambda found, reference: _apart(found.states.energy_mhz, reference.states.energy_mhz)
    )
    knobs = []
    if request.jmax is None:
        finest = replace(plain, tolerance_mhz=max(1e-2 * min(*TOLERANCES_MHZ, request.tolerance_mhz), 1e-9))
        settings = ladder(TOLERANCES_MHZ, request.tolerance_mhz, lambda one: replace(plain, tolerance_mhz=one))
        against = f"a tolerance of {finest.tolerance_mhz:g} MHz"
        knobs.append(Knob("numerics.tolerance", (measure,), settings, finest, against, answer_stark))
    jmax = int(answer_stark(plain).states.jmax)
    values, energy = range(request.j_highest + 2, jmax + 1), Measure("energy", "MHz", _apart)
    basis = ladder(values, jmax, lambda one: (plain, int(one)))
    beyond = jmax + MORE_J
    knobs.append(Knob("numerics.jmax", (energy,), basis, (plain, beyond), f"J max {beyond}", _energies))
    return Knobs(tuple(knobs))


def zeeman(request: Any) -> Knobs:
    """Of a scene of levels in a magnetic field."""
    from rotor.quantum.fields.zeeman_request import answer_zeeman

    measure = Measure(
        "energy", "MHz", lambda found, reference: _apart(found.states.energy_mhz, reference.states.energy_mhz)
    )
    jmax = int(answer_zeeman(request).states.jmax)
    beyond = replace(request, jmax=jmax + MORE_J)
    if request.jmax is not None:
        knob = Knob(
            "numerics.jmax",
            (measure,),
            (Setting(str(jmax), request, True),),
            beyond,
            f"J max {jmax + MORE_J}",
            answer_zeeman,
        )
        return Knobs((knob,))
    settings = ladder(TOLERANCES_MHZ, request.tolerance_mhz, lambda one: replace(request, tolerance_mhz=one))
    against = f"J max {jmax + MORE_J}"
    return Knobs((Knob("numerics.tolerance", (measure,), settings, beyond, against, answer_zeeman),))


def _energies(asked: tuple[Any, int]) -> Any:
    """Energies of all states of a map with one J max of the basis, however small: a map itself refuses one that is too small."""
    from rotor.quantum.effects.stark import map_request
    from rotor.quantum.fields.field_map import each_block

    request, jmax = asked
    of_map = map_request(
        request.top, request.fields_kv_per_cm, request.j_highest, request.m_values, request.intensity_w_per_cm2,
        request.direction, request.tolerance_mhz, None, request.effects,
    )  # fmt: skip
    parts = each_block(of_map, jmax, partial(_of_block, of_map, jmax))
    return np.concatenate([part.ravel() for part in parts])


def _of_block(request: Any, jmax: int, block: Any) -> Any:
    from rotor.quantum.fields.block_states import block_states

    found = block_states(request, block, request.fields, jmax)
    return found.energies[:, block.levels.j[found.rows] <= request.j_highest]


def _apart(one: Any, other: Any) -> float:
    return float(np.max(np.abs(np.asarray(one) - np.asarray(other)), initial=0.0))


def align(request: Any) -> Knobs:
    """Of a scene of alignment."""
    from rotor.alignment.basis import trace_with
    from rotor.alignment.request import answer_align

    def error(found: AlignmentTrace, reference: AlignmentTrace) -> float:
        return max(_apart(found.cosines[name], true) for name, true in reference.cosines.items())

    def of_tolerance(one: float) -> Any:
        return plain if one == request.tolerance else replace(free, tolerance=one)

    plain = replace(request, classical_molecules=0)
    free = replace(plain, jmax=None)  # a J max that serves one tolerance is too small for a finer one
    finest = replace(free, tolerance=max(1e-2 * min(*TOLERANCES, request.tolerance), FINEST_TOLERANCE))
    measure = Measure("cosine", "", error)
    settings = ladder(TOLERANCES, request.tolerance, of_tolerance)
    against = f"a tolerance of {finest.tolerance:g}"
    knobs = [Knob("numerics.tolerance", (measure,), settings, finest, against, lambda asked: answer_align(asked).trace)]
    own = answer_align(plain).trace
    shares = {round(share * own.jmax) for share in SHARES_OF_J} | {own.jmax - 1}
    values = sorted(j for j in shares if j >= own.ensemble.jmax)
    basis = tuple(Setting(str(j), j, j == own.jmax) for j in values)
    beyond = own.jmax + MORE_J
    knobs.append(Knob("numerics.jmax", (measure,), basis, beyond, f"J max {beyond}", partial(trace_with, own)))
    if request.classical_molecules:
        knobs.append(_classical(request))
    return Knobs(tuple(knobs))


def _classical(request: Any) -> Knob:
    """The number of classical molecules, whose error is that of a mean."""
    from rotor.alignment.request import answer_align

    def error(found: Any, reference: Any) -> float:
        return max(_apart(found.classical[name], true) for name, true in reference.classical.items())

    coarse = replace(request, tolerance=max(request.tolerance, 1e-2))  # the quantum gas beside it does not matter here
    own = request.classical_molecules
    counts = ladder(
        (own / 64, own / 16, own / 4),
        own,
        lambda n: replace(coarse, classical_molecules=max(int(n), 2)),
        "{:.0f}".format,
    )
    most = replace(coarse, classical_molecules=16 * own, seed=request.seed + 1)
    measure = Measure("cosine of the classical gas", "", error)
    return Knob(
        "observables.classical_molecules", (measure,), counts, most, f"{16 * own} other molecules", answer_align
    )
