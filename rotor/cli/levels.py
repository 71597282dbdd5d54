"""`rotor levels`: the energy levels of a molecule, as a table and as a term diagram."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_one_of, require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.hyperfine import HyperfineOptions, effects_asked, hyperfine_lines
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import file_option, grouped, option
from rotor.cli.shared.output import (
    ComputationError,
    Files,
    Table,
    Writer,
    answering,
    deliver,
    json_with_rows,
    note,
    show_facts,
    show_table,
)
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.process import one_thread_of_blas
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.reports.line_tables import the_first
from rotor.reports.sources import source_facts

if TYPE_CHECKING:
    from rotor.plots.view import View
    from rotor.quantum.request import LevelsAnswer

COLUMNS = {"MHz": ("energy_mhz", "{:.4f}"), "cm-1": ("energy_cm", "{:.6f}"), "K": ("energy_k", "{:.6f}")}

EXAMPLES = """\b
Examples:
  rotor levels water
  rotor levels water --jmax 4 --unit K --csv water.csv --plot terms.png
  rotor levels CH3CN --k 0:3 --jmax 20 --egy levels.egy
  rotor levels formamide --hyperfine --jmax 3
  rotor levels --constants "A=9.2 B=3 C=2.5 GHz" --j 2:5 --max-energy 10cm-1"""

NAMES = {"jmax": "--jmax", "jmin": "--j", "kmin": "--k", "kmax": "--k", "max_energy_mhz": "--max-energy"}


@dataclass(frozen=True)
class Options:
    """Which levels are computed and shown."""

    j: str | None = option(None, "--j", metavar="A:B", help="First and last J, such as 2:5; or one J.")
    jmax: int | None = option(None, metavar="N", help="Highest J; by default 10.")
    k: str | None = option(
        None, "--k", metavar="A:B", help="First and last |K|, or Ka (Kc of a near-oblate top); or one K."
    )
    max_energy: str | None = option(
        None, metavar="E", help="Highest energy above the lowest level that exists (MHz; 10cm-1, 50K)."
    )
    unit: str = option("cm-1", metavar="UNIT", help="Of the table and the diagram: MHz, cm-1 or K.")
    top_levels: int = option(60, "--top", metavar="N", help="How many of the lowest levels are shown.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write all levels as CSV.")
    parquet: str | None = file_option(".parquet", help="Write all levels as Parquet.")
    egy: str | None = file_option(".egy", help="Write all levels as SPCAT's list (.egy).")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the term diagram (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(given=("dipole", "dipole_abc", "state_dipoles"), picture=("plot_scale",))
def command(
    context: typer.Context,
    given: Input,
    options: Options,
    spins: HyperfineOptions,
    outputs: Outputs,
    picture: ViewOptions,
) -> None:
    """Energy levels: quantum numbers, energies, degeneracies, term diagram."""
    one_thread_of_blas(options.jmax)
    from rotor.quantum.request import LevelsRequest, answer_levels

    require_whole("--top", options.top_levels, 0)
    require_one_of("--unit", options.unit, COLUMNS)
    settings, files = _settings(options), Files.of(outputs)
    view = view_of(picture, files)
    with inputs.fields_as_options(**NAMES):
        top = inputs.read_top(given)
        request = LevelsRequest(top, **settings, effects=effects_asked(top, spins, given.spin_constants))
    with answering():
        answer = answer_levels(request)
    for warning in answer.warnings:
        note(warning)
    if "--plot" in files.paths and not len(answer.table):
        raise ComputationError("--plot: there is no level in this range")

    from rotor.reports.top_facts import begin

    content = {**begin(context.obj, given.text), **answer.facts(), "files": files.names}
    text = lambda: json_with_rows(answer.table, "levels", content)  # noqa: E731
    deliver(
        files,
        _writers(answer, content, options.unit, view) | save_scene("levels", request, outputs, given),
        text,
        lambda: _show(answer, content, options, given.sources),
    )


def _settings(options: Options) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    from rotor.units import parse_quantity

    settings: dict[str, Any] = {}
    if options.j is not None:
        if options.jmax is not None:
            raise ValueError("--j and --jmax: give one of them")
        settings["jmin"], settings["jmax"] = inputs.whole_range("--j", options.j)
    elif options.jmax is not None:
        settings["jmax"] = options.jmax
    if options.k is not None:
        settings["kmin"], settings["kmax"] = inputs.whole_range("--k", options.k)
    if options.max_energy is not None:
        settings["max_energy_mhz"] = inputs.parsed(
            "--max-energy", options.max_energy, lambda text: parse_quantity(text, "MHz")
        )
    return settings


def _writers(answer: LevelsAnswer, content: dict[str, Any], unit: str, view: View) -> dict[str, Writer]:
    import rotor

    provenance = {"command": content["command"], "input": content["input"]}

    def table(path: Path) -> None:
        """The table as a file."""
        rotor.write(answer.table, path, settings=provenance)

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.levels import plot_levels

        plot_levels(answer.table, answer.request.top, path, unit=unit, view=view, provenance=provenance)

    return {"--csv": table, "--parquet": table, "--egy": table, "--plot": draw}


def _show(answer: LevelsAnswer, content: dict[str, Any], options: Options, whole_sources: bool) -> None:
    from rotor.reports import top_facts as report

    print(report.heading(answer.request.top))
    show_facts(_facts(answer, content))
    if len(answer.table) and options.top_levels:
        print()
        show_table(_table(answer, options))
    print()
    show_facts(
        [*source_facts(answer.request.top, ("constants", "spin weights"), whole_sources), *report.model_facts(content)]
    )


def _facts(answer: LevelsAnswer, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.reports import top_facts as report

    top, request = answer.request.top, answer.request
    weights = report.weights_text(content["spin_weights"])
    between = f"= {request.jmin}" if request.jmin == request.jmax else f"from {request.jmin} to {request.jmax}"
    asked = f"{'N' if 'n' in content['quantum_numbers'] else 'J'} {between}"
    if request.kmin is not None or request.kmax is not None:
        asked += f", K from {request.kmin or 0} to {request.jmax if request.kmax is None else request.kmax}"
    if request.max_energy_mhz is not None:
        asked += f", up to {request.max_energy_mhz:g} MHz"
    ground = f"{round(content['ground_mhz'], 4) + 0.0:.4f} MHz above the Hamiltonian's zero"
    return [
        ("constants", report.constants_text(top)),
        ("spin weights", weights),
        *report.states_facts(top)[:1],
        ("levels", f"{len(answer.table)}: {asked}"),
        ("lowest", f"{ground}: energies count from there"),
        *hyperfine_lines(content["hyperfine"]),
    ]


def _table(answer: LevelsAnswer, options: Options) -> Table:
    """The lowest levels, in order of energy."""
    import numpy as np

    from rotor.quantum import quanta

    table = answer.table
    rows = np.argsort(table.energy_mhz, kind="stable")[: options.top_levels]
    name, form = COLUMNS[options.unit]
    energy, columns = getattr(table, name)[rows], table.columns
    labels = table.levels.labels(table.rows[rows])
    cells = [
        (label, form.format(e), str(weight), str(g))
        for label, e, weight, g in zip(
            labels, energy.tolist(), columns["weight"][rows].tolist(), columns["degeneracy"][rows].tolist(), strict=True
        )
    ]
    title = the_first(len(rows), "lowest level") if len(rows) < len(table) else "all levels"
    head = (quanta.headings(table.levels.quanta_names), f"E ({options.unit})", "spin weight", "g")
    return Table(f"{title}, in order of energy", head, cells)
