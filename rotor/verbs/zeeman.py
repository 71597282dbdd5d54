"""`zeeman`: levels of a molecule in a static magnetic field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.quantum.effects.zeeman import ZeemanAnswer, ZeemanRequest, answer_zeeman
from rotor.reports import top_facts
from rotor.reports.screen import Table
from rotor.requests.field import all_fields, declared
from rotor.requests.fill import Entries, read_instance, within
from rotor.requests.lists import Numbers
from rotor.tops.magnetic import MagneticTensors, tensor_for
from rotor.verbs.common.field_maps import MAP, MAP_FILES, accuracy_fact, field_fact, table_of_states
from rotor.verbs.common.molecule import DIPOLE, POLARIZABILITY, REFINEMENT, STATES, Reading
from rotor.verbs.common.outputs import Report
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Verb

if TYPE_CHECKING:
    from rotor.tops.magnetic import Tensor
    from rotor.tops.top import Top

EXAMPLES = """\
  rotor zeeman --constants "B=6081.492 MHz" --g -0.03 --field 0:5T --plot levels.png --csv levels.csv
  rotor zeeman --constants "A=10 B=6 C=4 GHz" --g 0.6,-0.2,0.3 --magnetisability -3,2,-7 --field 0:20T:41 --states "J<=1"
  rotor zeeman HC3N --g -0.01 --field 0:200G --states "J<=1" --spin-constants "chi_aa(14N)=-4.3 MHz" --plot hc3n.png
  rotor zeeman molecule.toml --field 1T --json -"""


@dataclass(frozen=True)
class MagneticInput:
    """Tensors on which a magnetic field acts; by default those in the molecule's file, table [magnetic]."""

    g: tuple[float, ...] | None = declared(
        None, Numbers(example="0.6,-0.2,0.3"), "Rotational g tensor along a, b, c: aa,bb,cc[,ab,ac,bc]; parallel,perpendicular; or g",
        "magnetic.g", common=True, example=[-0.03],
    )  # fmt: skip
    magnetisability: tuple[float, ...] | None = declared(
        None, Numbers(example="-3,2,-7"), "Magnetisability tensor likewise, with sign, in 1e-6 erg/(G² mol)", "magnetic.magnetisability",
        example=[-3.0, 2.0, -7.0],
    )  # fmt: skip


def with_tensors(top: Top, reading: Reading, entries: Entries) -> Top:
    """The top with the tensors of the inputs, else with those of its file."""
    magnetic = read_instance(MagneticInput, entries)
    called = {field.name: field.called(entries.style) for field in all_fields(MagneticInput).values()}

    def tensor(name: str) -> Tensor | None:
        numbers = getattr(magnetic, name)
        with within(called[name]):
            return None if numbers is None else tensor_for(top.kind, list(numbers))

    g, chi = tensor("g"), tensor("magnetisability")
    if g is not None:
        if top.kind == "linear" and g[0][0]:
            reading.note(f"{called['g']}: the element along the axis of a linear molecule, {g[0][0]:g}, has no effect")
        source = f"given ({called['g']}, {called['magnetisability']})" if chi else f"given ({called['g']})"
        return replace(top, magnetic=MagneticTensors(g, chi, source))
    if top.magnetic is None:
        raise ValueError(
            f"the rotational g tensor is not known: give {called['g']} aa,bb,cc (principal axes), parallel,perpendicular of a "
            "symmetric top, or the single g of a linear top"
        )
    return top if chi is None else replace(top, magnetic=replace(top.magnetic, magnetisability=chi))


def _table(answer: ZeemanAnswer, report: Report) -> Table:
    states = answer.states
    return table_of_states(states, "T", {"moment there (μ_N)": lambda ends: f"{states.slope[ends[1]]:z.6f}"})


def _facts(answer: ZeemanAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    chi = content["magnetisability_abc"]
    return [
        ("constants", top_facts.constants_text(answer.request.top)),
        ("g", _tensor_text(content["g_abc"])),
        field_fact(answer.states, "along Z"),
        ("magnetisability", "" if chi is None else f"{_tensor_text(chi)} 1e-6 erg/(G² mol)"),
        ("g of spins", ", ".join(f"{name} {value:g}" for name, value in (content["nuclear_g"] or {}).items())),
        accuracy_fact(answer.states),
    ]


def _tensor_text(tensor: Tensor) -> str:
    (aa, ab, ac), (_, bb, bc), (_, _, cc) = tensor
    mixed = [f"{name} {value:g}" for name, value in (("ab", ab), ("ac", ac), ("bc", bc)) if value]
    return ", ".join([f"aa {aa:g}", f"bb {bb:g}", f"cc {cc:g}", *mixed])


VERB = Verb(
    **MAP,
    name="zeeman",
    about="Levels in a static magnetic field: energies, labels and magnetic moments for all M, optionally with nuclear spins.",
    examples=EXAMPLES,
    request=ZeemanRequest,
    answer=lambda request, work: answer_zeeman(request, work.executor),
    show=top_facts.report_on_top(_facts, _table),
    outputs=MAP_FILES,
    subject=OneMolecule((*DIPOLE, *POLARIZABILITY, "spin_weights", *REFINEMENT, *STATES), with_tensors, MagneticInput),
    stated=("g_abc", "magnetisability_abc", "nuclear_g"),
    drawn="T",
    small_blocks=True,
    numerics="rotor.quantum.fields.numerics:ZEEMAN",
    accuracy_example="1 Hz",
    start={"molecule": "OCS", "magnetic.g": [-0.03], "conditions.field": "0:5T:51", "outputs.csv": "zeeman.csv"},
)
