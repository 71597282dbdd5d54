"""`stark`: levels of a molecule in a static electric field."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.quantum.effects.stark import StarkAnswer, StarkRequest, answer_stark
from rotor.reports import top_facts
from rotor.reports.screen import Table, record_table
from rotor.requests.fill import Entries
from rotor.spectra.fields.request import MAKERS, FieldRequest, FieldSample
from rotor.verbs.common.field_maps import MAP, MAP_FILES, SHOWN, accuracy_fact, field_fact, table_of_states
from rotor.verbs.common.molecule import REFINEMENT, STATES, Reading, with_known_polarizability, with_some_dipole
from rotor.verbs.common.outputs import PICTURES, Output, Report
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Shown, Verb

if TYPE_CHECKING:
    from rotor.spectra.fields.stark_coefficients import StarkCoefficients
    from rotor.tops.top import Top

EXAMPLES = """\
  rotor stark OCS --field 0:200kV/cm --states "J<=2" --plot ocs.png --csv ocs.csv
  rotor stark indole --field 0:200kV/cm --states "J<=2" --plot indole.png
  rotor stark --constants "A=5655.2654 B=1546.8759 C=1214.4040 MHz" --dipole-abc 4.5152,0,0 --field 0,100kV/cm
  rotor stark OCS --field 0:50kV/cm:101 --intensity "1e11 W/cm2" --tilt 45 --states "J<=1"
  rotor stark OCS --field 0:5kV/cm:21 --states "J<=3" --line "2 - 1" --light perpendicular --lines lobes.csv --coefficients c.csv
  rotor stark OCS --field 20kV/cm --states "J<=6" --spread 0.005 --linewidth 0.5MHz --range 0:90GHz --spectrum ocs.csv
  rotor stark HC3N --field 0:2kV/cm --states "J<=1" --spin-constants "chi_aa(14N)=-4.3 MHz" --plot hc3n.png
  rotor stark indole --field 0:50kV/cm --temperature 1 --mixture indole_1k.csv --deflection mu_eff.csv"""


@dataclass(frozen=True)
class StarkShown(FieldSample, Shown):
    """Sample for lines, spectra and mixtures, and display options of `stark`."""


def prepare(top: Top, reading: Reading, entries: Entries) -> Top:
    """The top with its dipole and, for laser light, its polarizability."""
    top = with_some_dipole(top, reading)
    return with_known_polarizability(top, reading) if entries.values.get("conditions.intensity") else top


def _further(name: str, what: str) -> Output:
    """File of a table derived from the map."""
    return Output(name, (".csv",), f"Write {what} as CSV", of=partial(_derived_table, name), scene=False)


def _derived_table(name: str, answer: StarkAnswer, report: Report) -> Any:
    """A table derived from the map, computed once for all files that need it."""
    if name not in report.cache:
        sample = {field.name: getattr(report.shown, field.name) for field in fields(FieldSample)}
        report.cache[name] = MAKERS[name](FieldRequest(answer.request, **sample), answer.states, report.executor)
    return report.cache[name]


def draw_lines(answer: StarkAnswer, path: Path, report: Report) -> None:
    """Draw the lines against the field."""
    from rotor.plots.show import write_picture

    write_picture(_derived_table("lines", answer, report), path, report.command, title=report.content["name"])


def _coefficient_table(_: StarkAnswer, report: Report) -> Table | None:
    """The first rows of the file of --coefficients, if it is written."""
    coefficients: StarkCoefficients | None = report.cache.get("coefficients")
    if coefficients is None:
        return None
    columns = {name.replace("_m", " M").replace("label", "state"): f"{{{name}}}" for name in coefficients.names}
    columns = {name.upper() if name == "m" else name: form for name, form in columns.items()}
    units = ("kV/cm", *(f"(kV/cm){power}" for power in "²³⁴"))
    columns |= {f"c{p} (MHz/{unit})": f"{{c{p}:z.6g}}" for p, unit in enumerate(units, 1)}
    columns["valid to (kV/cm)"] = "{valid:.3g}"
    values = {f"c{p}": column for p, column in enumerate(coefficients.coefficients.T, 1)}
    cells = {**coefficients.names, **values, "valid": coefficients.valid_to_kv_per_cm}
    count = len(coefficients)
    rows = [{name: column[row] for name, column in cells.items()} for row in range(min(count, SHOWN))]
    title = f"Stark coefficients, {SHOWN} of {count} rows" if count > SHOWN else "Stark coefficients"
    return record_table(title, columns, rows, set(columns) & {"state", "upper", "lower"})


def _table(answer: StarkAnswer, report: Report) -> Table:
    """The first states, by M and block; M is mixed in a field at an angle with Z."""
    states, (x, y, _) = answer.states, report.content["field_direction"]
    columns: dict[str, Any] = {"M": lambda ends: "mixed"} if x or y else {}
    columns["μ_eff there (D)"] = lambda ends: f"{states.slope[ends[1]]:.6f}"
    columns["⟨cosθ⟩ there"] = lambda ends: f"{states.cosines['costheta'][ends[1]]:.6f}"
    return table_of_states(states, "kV/cm", columns)


def _along(direction: list[float]) -> str:
    x, _, z = direction
    if not x:
        return "along Z"
    return f"at {math.degrees(math.atan2(x, z)):g}° with Z"


def _facts(answer: StarkAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    top, states, laser = answer.request.top, answer.states, content["intensity_w_per_cm2"]
    return [
        ("constants", top_facts.constants_text(top)),
        ("dipole", top_facts.dipole_text(top)),
        field_fact(states, _along(content["field_direction"])),
        ("laser", f"{laser:g} W/cm² along Z" if laser else ""),
        accuracy_fact(states),
    ]


VERB = Verb(
    **MAP,
    name="stark",
    about="Levels in a static electric field: energies, labels, effective dipoles and cosines for all M; lines and mixtures.",
    examples=EXAMPLES,
    request=StarkRequest,
    answer=lambda request, work: answer_stark(request, work.executor),
    show=top_facts.report_on_top(_facts, _table, _coefficient_table, sources=("constants", "dipole")),
    outputs=(
        *MAP_FILES,
        _further("lines", "the lines in every field, resolved in M,"),
        Output("lobes", PICTURES, "Draw the lines against the field (.png, .pdf, .svg)", draw_lines, scene=False),
        _further("spectrum", "the cross section at the highest field"),
        _further("coefficients", "Stark coefficients of the states, or of --line,"),
        _further("mixture", "means of the thermal mixture against the field"),
        _further("deflection", "effective dipoles, one column for each state,"),
    ),
    subject=OneMolecule(("anisotropy", "spin_weights", *REFINEMENT, *STATES), prepare),
    shown=StarkShown,
    stated=("dipole_abc_debye",),
    drawn="kV/cm",
    small_blocks=True,
    numerics="rotor.quantum.fields.numerics:STARK",
    start={"molecule": "OCS", "conditions.field": "0:200kV/cm:201", "outputs.csv": "stark.csv"},
)
