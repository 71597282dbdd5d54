"""Accuracy sweeps (J max of the basis) and plans of levels in a field."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rotor.quantum.effects.stark import answer_stark
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.effects.zeeman import answer_zeeman
from rotor.quantum.estimates.plans import plan_fields
from rotor.quantum.fields.block_states import solve_block
from rotor.quantum.fields.field_map import each_block
from rotor.quantum.fields.inputs import ENERGY, largest_difference
from rotor.requests.knob import Knob, Measure
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut, largest_first

MORE_J = 6  # values of J that the reference has beyond the basis
SHORT_FIELDS = (2, 20)  # numbers of fields from which the cost is extrapolated


def _with_basis(request: Any) -> Any:
    """The request of levels in an electric field with J max of its basis, without criteria that refuse a small basis."""
    plain = replace(request, diabatic_gap_mhz=None, most_at_edge=1.0)
    return replace(plain, jmax=int(answer_stark(plain).states.jmax))


def _energies(request: Any) -> Any:
    """Energies of all states of a map with J max of the basis, even one that a map would refuse as too small."""
    fields, jmax = request.map, request.jmax
    parts = each_block(fields, jmax, partial(solve_block, fields, fields=fields.fields, jmax=jmax))
    return np.concatenate([part.energies[:, part.j <= fields.j_highest].ravel() for part in parts])


def _basis(
    steps: Callable[[Any], Iterable[int]], measure: Measure, answer: Callable[[Any], Any], used: Callable[[Any], bool]
) -> Knob:
    """J max of the basis."""
    return Knob(
        steps,
        lambda request: request.jmax + MORE_J,
        (measure,),
        "J max {}",
        key="numerics.jmax",
        title="highest J of the basis",
        attribute="jmax",
        used=used,
        answer=answer,
    )


def _fields(request: Any, count: int) -> Any:
    """The request at fewer fields: the ends, then the highest, which need the largest basis."""
    name = request.map.kind.name
    fields = getattr(request, name)
    ordered = dict.fromkeys((max(fields), min(fields), *sorted(fields, key=abs, reverse=True)))
    return replace(request, **{name: tuple(ordered)[:count]})


FIELDS = Knob(
    key="conditions.field",
    fixed="",
    cost=Growth(
        SHORT_FIELDS,
        lambda request: len(getattr(request, request.map.kind.name)),
        _fields,
        lambda request: replace(request, diabatic_gap_mhz=None) if hasattr(request, "diabatic_gap_mhz") else request,
    ),
)


def _describe_in_field(acts: str, good: str, within: str, request: Any, cost: Cost) -> dict[str, Any]:
    """What levels in a field are. acts: what acts in the field, with its strength. within: effect that the field contains."""
    fields, facts = getattr(request, request.map.kind.name), cost.answer.facts()
    described = plan_fields(request.top, max(request.j_highest, 1), request.effects or SEMI_RIGID)
    known_names = {limit.name for limit in described["left_out"]}
    field_limits = [
        LeftOut(limit["name"], limit["size_mhz"], "MHz", limit["text"])
        for limit in facts["limits"]
        if limit["name"] not in known_names
    ]
    error = f"{facts['accuracy_mhz']:.1e} MHz at the ends of the fields: by which energies move with a higher J max, and round-off"
    others = (part for part in described["left_out"] if part.name != within)
    return {
        "effects": (*described["effects"], acts.format(max(map(abs, fields)))),
        "good": () if getattr(request, "tilted", False) else ("M_F" if request.hyperfine else "M",),
        "parts": (
            ("basis", f"J to {facts['jmax']}: the tolerance of {request.tolerance_mhz:g} MHz at the highest field"),
            ("method", f"exact blocks of one {good} (and K, or D2 species), every field diagonalised"),
            ("error", error),
        ),
        "counts": {"fields": len(fields), "states": len(fields) * facts["curves"]},
        "left_out": largest_first([*field_limits, *others]),
    }


ENERGIES = Measure("energy", "MHz", largest_difference)
STARK = Numerics(
    {"MHz": Goal("energies")},
    knobs=(
        _basis(
            lambda request: range(request.j_highest + 2, request.jmax + 1), ENERGIES, _energies, lambda request: True
        ),
        FIELDS,
    ),
    prepare=_with_basis,
    describe=partial(
        _describe_in_field, "dipole in the field, up to {:g} kV/cm", "|M|", "Stark shift of a stray field"
    ),
)
ZEEMAN = Numerics(
    {"MHz": Goal("energies")},
    knobs=(_basis(lambda request: (), ENERGY, answer_zeeman, lambda request: request.jmax is not None), FIELDS),
    describe=partial(_describe_in_field, "magnetic moments in the field, up to {:g} T", "M", ""),
)
