"""`raman`: rotational Raman lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotor.reports import top_facts
from rotor.reports.line_tables import first_rows_title, labelled_rows, states_text
from rotor.reports.screen import Part, record_table
from rotor.spectra.raman.request import RamanAnswer, RamanRequest, answer_raman
from rotor.verbs.common.molecule import DIPOLE, REFINEMENT, with_known_polarizability
from rotor.verbs.common.outputs import Report, picture, tables
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import LinesShown, Verb

EXAMPLES = """\
  rotor raman N2
  rotor raman CO2 --laser 488 --temperature 500 --csv co2.csv --plot co2.png
  rotor raman HCN --polarizability 3.9,2.0 --temperature 10 --hyperfine
  rotor raman --constants "B=1.98958 cm-1" --polarizability 2.22,1.53 --spin-weights even=2,odd=1"""


def _facts(answer: RamanAnswer, record: Mapping[str, Any]) -> list[tuple[str, str]]:
    lines, top, least = answer.lines, answer.lines.top, record["min_relative"]
    count = f"{len(lines)}, together {record['band_cross_section_cm2_per_sr']:.4g} cm²/sr" if len(lines) else "none"
    return [
        ("constants", top_facts.constants_text(top)),
        ("polarizability", top_facts.tensor_text(top)),
        ("anisotropy", f"{record['anisotropy_angstrom3']:.6g} Å³"),
        *top_facts.weights_facts(top, record["spin_weights"]),
        *top_facts.states_facts(top)[:1],
        ("temperature", f"{lines.temperature_k:g} K"),
        ("laser", f"{lines.laser_nm:g} nm in vacuum"),
        ("Q", top_facts.q_text(lines.partition, record["q"]["classical"])),
        ("J max", f"{lines.jmax}: {record['jmax_source']}"),
        ("cut", "none: every allowed line" if least is None else f"{least:g} of the strongest"),
        *top_facts.hyperfine_lines(record["hyperfine"]),
        ("lines", count),
    ]


def _table(answer: RamanAnswer, report: Report) -> Part:
    """The strongest lines in order of shift, or why there are none."""
    lines = answer.lines
    if not len(lines):
        return f"no lines: {answer.why_no_lines}\n"
    selected = lines.where(report.content["strongest"])
    digits = 6 if "f" in lines.quanta_names else 4  # hyperfine shifts are about 1e-5 cm⁻¹
    columns = {
        "shift (cm-1)": f"{{shift_cm:.{digits}f}}",
        "dσ/dΩ (cm²/sr)": "{cross_section_cm2_per_sr:.4e}",
        "λ (nm)": "{wavelength_nm:.4f}",
        "E (cm-1)": f"{{energy_initial_cm:.{digits}f}}",
        "g": "{g_initial}",
        "S (Å⁶)": "{strength_angstrom6:.5g}",
        "from": "{from}",
        "to": "{to}",
    }
    records = labelled_rows(selected, {"from": selected.initial, "to": selected.final})
    title = first_rows_title(len(selected), len(lines), "strongest line")
    return record_table(f"{title}, in order of shift {states_text(lines)}", columns, records)


def results(answer: Any) -> dict[str, Any]:
    """The strongest line and Q, for a sweep."""
    lines = answer.lines
    strongest = lines.cross_section_cm2_per_sr.argmax()
    return {
        "lines": len(lines),
        "strongest_cm": lines.shift_cm[strongest],
        "strongest_cm2_per_sr": lines.cross_section_cm2_per_sr[strongest],
        "q": lines.partition.q,
    }


VERB = Verb(
    name="raman",
    about="Rotational Raman lines: Stokes and anti-Stokes shifts and their cross sections.",
    examples=EXAMPLES,
    small_blocks=True,
    request=RamanRequest,
    answer=lambda request, work: answer_raman(request, work.executor),
    table=lambda answer: answer.lines,
    results=results,
    rows="lines",
    show=top_facts.report_on_top(_facts, _table, sources=("constants", "polarizability", "spin weights")),
    outputs=(*tables("all lines", "lines"), picture("Draw the lines", "lines.png")),
    subject=OneMolecule(
        (*DIPOLE, "anisotropy", "state_dipoles", *REFINEMENT),
        lambda top, reading, entries: with_known_polarizability(top, reading),
    ),
    shown=LinesShown,
    content=lambda answer, shown: {"strongest": answer.strongest(shown.top_lines)},
    nothing=lambda answer: f"no lines: {answer.why_no_lines}" if answer.why_no_lines else "",
    drawn="cm-1",
    numerics="rotor.spectra.numerics:RAMAN",
    accuracy="of the shifts, or of the cross sections of each line and of all together (%)",
    start={"molecule": "N2", "conditions.temperature": "300 K", "outputs.csv": "raman.csv"},
)
