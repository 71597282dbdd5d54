"""Plans of levels in a static field, electric or magnetic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.scenes import left_out
from rotor.scenes.plan_parts import Plan, effect_texts, extrapolated, extrapolated_mb

SHORT_FIELDS = (2, 20)  # of the calibration


@dataclass(frozen=True)
class _Case:
    """kind: of the scene. answer: of its request. name: of the request's fields. acts: what the field is, up to a value. own: the size
    that the scene does not leave out. method: how it is solved.
    """

    kind: str
    answer: Callable[[Any], Any]
    name: str
    acts: str
    own: str
    method: str


def plan_in_field(request: Any) -> Plan:
    """The plan of levels in a field: J max and the error are those at the ends of the fields."""
    case, top, j = _case_of(request), request.top, max(request.j_highest, 1)
    fields, effects = getattr(request, case.name), request.effects or SEMI_RIGID

    def at(some: tuple[float, ...]) -> Any:
        return case.answer(replace(request, **{case.name: some}))

    facts = at(tuple(dict.fromkeys((min(fields), max(fields))))).facts()
    lasting = sorted(fields, key=abs, reverse=True)  # the highest fields need the largest basis

    def short(n: int) -> Any:
        return at(tuple(lasting[:n])).states.columns

    good = () if getattr(request, "tilted", False) else ("M_F" if request.hyperfine else "M",)
    return Plan(
        kind=case.kind,
        effects=(*effect_texts(top, j, effects), case.acts.format(max(map(abs, fields)))),
        good=good,
        parts=(
            ("basis", f"J to {facts['jmax']}: the tolerance of {request.tolerance_mhz:g} MHz at the highest field"),
            ("method", case.method),
            (
                "error",
                f"{facts['accuracy_mhz']:.1e} MHz at the ends of the fields: by which energies move with a higher J max, and round-off",
            ),
        ),
        counts={"fields": len(fields), "states": len(fields) * facts["curves"]},
        seconds=extrapolated(short, float, SHORT_FIELDS, len(fields)),
        memory_mb=extrapolated_mb(short, float, SHORT_FIELDS, len(fields)),
        left_out=tuple(one for one in left_out.of_levels(top, j, effects) if one.name != case.own),
    )


def _case_of(request: Any) -> _Case:
    from rotor.quantum.fields.stark_request import StarkRequest, answer_stark
    from rotor.quantum.fields.zeeman_request import answer_zeeman

    if isinstance(request, StarkRequest):
        return _Case(
            "stark",
            lambda one: answer_stark(replace(one, diabatic_gap_mhz=None)),
            "fields_kv_per_cm",
            "dipole in the field, up to {:g} kV/cm",
            "Stark shift of a stray field",
            "exact blocks of one |M| (and K, or D2 species), every field diagonalised",
        )
    return _Case(
        "zeeman",
        answer_zeeman,
        "fields_tesla",
        "magnetic moments in the field, up to {:g} T",
        "",
        "exact blocks of one M (and K, or D2 species), every field diagonalised",
    )
