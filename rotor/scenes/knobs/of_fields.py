"""Knobs of sums over levels, of levels in a field and of alignment: the tolerance of each, and J max of the basis."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rotor.requests.knob import Measure, Setting, Sweep, Sweeps, ladder

MORE_J = 6  # in the reference
SHARES_OF_J = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


def thermo(request: Any) -> Sweeps:
    """Of a scene of thermodynamic functions: nothing beside the knob of its field."""
    return Sweeps((), ("vibration: its states are summed in closed form",) if request.vibrations else ())


def stark(request: Any) -> Sweeps:
    """Of a scene of levels in a field: J max of the basis."""
    from rotor.quantum.fields.knobs import largest_difference
    from rotor.quantum.fields.stark_request import answer_stark

    # energies alone decide on a basis that is to be seen failing
    plain = replace(request, diabatic_gap_mhz=None, most_at_edge=1.0)
    jmax = int(answer_stark(plain).states.jmax)
    basis = ladder(range(request.j_highest + 2, jmax + 1), jmax, lambda one: (plain, int(one)))
    beyond, energy = jmax + MORE_J, Measure("energy", "MHz", largest_difference)
    return Sweeps((Sweep("numerics.jmax", (energy,), basis, (plain, beyond), f"J max {beyond}", _energies),))


def zeeman(request: Any) -> Sweeps:
    """Of a scene of levels in a magnetic field: J max of the basis where it is given."""
    from rotor.quantum.fields.knobs import ENERGY
    from rotor.quantum.fields.zeeman_request import answer_zeeman

    if request.jmax is None:
        return Sweeps(())
    beyond = replace(request, jmax=request.jmax + MORE_J)
    settings = (Setting(str(request.jmax), request, True),)
    return Sweeps((Sweep("numerics.jmax", (ENERGY,), settings, beyond, f"J max {beyond.jmax}", answer_zeeman),))


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


def align(request: Any) -> Sweeps:
    """Of a scene of alignment: J max of the basis, and the number of classical molecules."""
    from rotor.alignment.basis import trace_with
    from rotor.alignment.request import answer_align, cosine_error

    found = answer_align(replace(request, classical_molecules=0)).trace
    shares = {round(share * found.jmax) for share in SHARES_OF_J} | {found.jmax - 1}
    values = sorted(j for j in shares if j >= found.ensemble.jmax)
    basis = tuple(Setting(str(j), j, j == found.jmax) for j in values)
    beyond, measure = found.jmax + MORE_J, Measure("cosine", "", cosine_error)
    knobs = [Sweep("numerics.jmax", (measure,), basis, beyond, f"J max {beyond}", partial(trace_with, found))]
    if request.classical_molecules:
        knobs.append(_classical(request))
    return Sweeps(tuple(knobs))


def _classical(request: Any) -> Sweep:
    """The number of classical molecules, whose error is that of a mean."""
    from rotor.alignment.request import answer_align
    from rotor.quantum.fields.knobs import largest_difference

    def error(found: Any, reference: Any) -> float:
        return max(largest_difference(found.classical[name], true) for name, true in reference.classical.items())

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
    return Sweep(
        "observables.classical_molecules", (measure,), counts, most, f"{16 * own} other molecules", answer_align
    )
