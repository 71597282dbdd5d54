"""`levels`: energy levels of a molecule as a table and a term diagram."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rotor.frozen import dataclass
from rotor.quantum.labels import quanta
from rotor.quantum.labels.quanta import headings
from rotor.quantum.request import LevelsAnswer, LevelsRequest, answer_levels
from rotor.reports import top_facts
from rotor.reports.line_tables import first_rows_title
from rotor.reports.screen import Table, record_table, table_records
from rotor.requests.field import OBSERVABLES, OUTPUT, declared
from rotor.requests.lists import whole_range
from rotor.requests.readers import Text, Whole
from rotor.verbs.common.molecule import DIPOLE, POLARIZABILITY
from rotor.verbs.common.outputs import Output, Report, drawing, picture, tables
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Extra, Shown, Verb

COLUMNS = {
    "MHz": ("energy_mhz", "{energy:.4f}"),
    "cm-1": ("energy_cm", "{energy:.6f}"),
    "K": ("energy_k", "{energy:.6f}"),
}

EXAMPLES = """\
  rotor levels water
  rotor levels water --jmax 4 --unit K --csv water.csv --plot terms.png
  rotor levels CH3CN --k 0:3 --jmax 20 --egy levels.egy
  rotor levels formamide --hyperfine --jmax 3
  rotor levels --constants "A=9.2 B=3 C=2.5 GHz" --j 2:5 --max-energy 10cm-1"""


@dataclass(frozen=True)
class LevelsShown(Shown):
    """Display options of `levels`."""

    unit: str = declared(
        "cm-1", Text(tuple(COLUMNS), "UNIT"), "Unit of the table and the diagram: MHz, cm-1 or K", panel=OUTPUT
    )
    top_levels: int = declared(30, Whole(0), "Number of lowest levels shown", option="--top", panel=OUTPUT)


def _span(name: str) -> Any:
    """Reader of `2:5` as the range of a quantum number."""

    def read(text: str) -> Mapping[str, Any]:
        first, last = whole_range(text)
        return {f"observables.{name}min": first, f"observables.{name}max": last}

    return read


def _facts(answer: LevelsAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    top, request = answer.request.top, answer.request
    between = f"= {request.jmin}" if request.jmin == request.jmax else f"from {request.jmin} to {request.jmax}"
    last_k = request.jmax if request.kmax is None else request.kmax
    has_k, highest = request.kmin is not None or request.kmax is not None, request.max_energy_mhz
    levels = answer.table.levels
    lowest = levels.energy_mhz == content["ground_mhz"]
    name = ", ".join(" ".join(label.split()) for label in levels.labels(np.flatnonzero(lowest & (levels.weight > 0))))
    ground = f"{headings(levels.quanta_names)} = {name}, {round(content['ground_mhz'], 4) + 0.0:.4f} MHz above the Hamiltonian's zero"
    absent = int((levels.weight[answer.table.rows] == 0).sum())
    limits = (
        f"{'N' if 'n' in content['quantum_numbers'] else 'J'} {between}"
        + (f", K from {request.kmin or 0} to {last_k}" if has_k else "")
        + ("" if highest is None else f", up to {highest:g} MHz")
        + (f"; {absent} of spin weight 0, which do not exist, are not shown" if absent else "")
    )
    return [
        ("constants", top_facts.constants_text(top)),
        *top_facts.weights_facts(top, content["spin_weights"]),
        *top_facts.states_facts(top)[:1],
        ("levels", f"{len(answer.table)}: {limits}"),
        ("lowest", f"{ground}: energies count from this level, the lowest that exists"),
        *top_facts.hyperfine_lines(content["hyperfine"]),
    ]


def _table(answer: LevelsAnswer, report: Report) -> Table:
    """The lowest existing levels in order of energy."""
    table, shown = answer.table, report.shown
    order = np.argsort(table.energy_mhz, kind="stable")
    existing = order[table.levels.weight[table.rows[order]] > 0]
    rows = existing[: shown.top_levels]
    labels = table.levels.labels(table.rows[rows])
    name, form = COLUMNS[shown.unit]
    energy = getattr(table, name)[rows].tolist()
    records = [
        record | {"state": label, "energy": value}
        for record, label, value in zip(table_records(table, rows), labels, energy, strict=True)
    ]
    columns = {
        quanta.headings(table.levels.quanta_names): "{state}",
        f"E ({shown.unit})": form,
        "spin weight": "{weight}",
        "g": "{degeneracy}",
    }
    title = first_rows_title(len(rows), len(existing), "lowest level")
    return record_table(f"{title}, in order of energy", columns, records)


VERB = Verb(
    name="levels",
    about="Energy levels of a molecule: quantum numbers, energies, degeneracies, term diagram.",
    examples=EXAMPLES,
    small_blocks=True,
    request=LevelsRequest,
    answer=lambda request, work: answer_levels(request, work.executor),
    results=lambda answer: {
        "levels": len(answer.table),
        "lowest_cm": answer.table.energy_cm.min(),
        "highest_cm": answer.table.energy_cm.max(),
    },
    rows="levels",
    show=top_facts.report_on_top(_facts, _table, sources=("constants", "spin weights")),
    outputs=(
        *tables("all levels", "levels"),
        Output("egy", (".egy",), "Write all levels as SPCAT's list (.egy)", example="levels.egy"),
        picture("Draw the term diagram", "levels.png", drawing(unit=lambda answer, report: report.shown.unit)),
    ),
    subject=OneMolecule((*DIPOLE, *POLARIZABILITY, "state_dipoles")),
    shown=LevelsShown,
    nothing=lambda answer: "" if len(answer.table) else "no level in this range",
    scaled=False,
    extras=(
        Extra(
            "--j",
            "A:B",
            "First and last J, such as 2:5; or one J",
            _span("j"),
            ("observables.jmax",),
            OBSERVABLES,
            True,
        ),
        Extra(
            "--k", "A:B", "First and last |K|, or Ka (Kc of a near-oblate top); or one K", _span("k"), (), OBSERVABLES
        ),
    ),
    numerics="rotor.quantum.estimates.accuracy:LEVELS",
    accuracy="of the energies",
    start={"molecule": "water", "observables.jmax": 10, "outputs.csv": "levels.csv"},
)
