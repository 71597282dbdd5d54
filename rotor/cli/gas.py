"""`rotor gas`: a classical gas of free molecules, tested for equipartition; its correlation functions."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import file_option, grouped, option
from rotor.cli.shared.output import Files, Table, Writer, deliver, json_text, rows_of, show_facts, show_table
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.reports.sources import with_sources
from rotor.reports.top_facts import left_out_facts

if TYPE_CHECKING:
    from rotor.classical.gas.ensembles import Correlations
    from rotor.plots.view import View
    from rotor.thermodynamics.classical_gas import GasAnswer, GasRequest

SHOWN = 11  # rows of the correlation functions in the report

EXAMPLES = """\b
Examples:
  rotor gas water --molecules 20000 --temperature 300 --seed 7 --json -
  rotor gas OCS --times 0:5:201 --csv ocs.csv --plot ocs.png"""

NAMES = {
    "molecules": "--molecules", "temperature_k": "--temperature", "seed": "--seed", "confidence": "--confidence",
    "times_ps": "--times",
}  # fmt: skip  # field of the request -> option


@dataclass(frozen=True)
class Options:
    """What is drawn and moved."""

    molecules: int = option(20_000, metavar="N", help="How many are drawn.")
    temperature: str = option("300", metavar="T", help="Temperature (K).")
    seed: int = option(1, metavar="N", help="Of the random numbers.")
    confidence: str = option("0.99", metavar="X", help="Of the test of equipartition.")
    times: str | None = option(
        None, metavar="GRID", help="Of the correlation functions: start:stop:count or a comma list (ps)."
    )


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the correlation functions as CSV.")
    parquet: str | None = file_option(".parquet", help="Write the correlation functions as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the test and the functions (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(
    given=("spin_weights", "spin_constants", "spins", *inputs.STATES, "calculator", "hessian", "symmetry_tolerance"),
    picture=("plot_scale",),
)
def command(context: typer.Context, given: Input, options: Options, outputs: Outputs, picture: ViewOptions) -> None:
    """A classical gas of free molecules: equipartition, correlation functions."""
    from rotor.thermodynamics.classical_gas import GasRequest, settling_times_ps

    settings, files = _settings(options), Files.of(outputs)
    view = view_of(picture, files, "ps")
    top = inputs.read_top(given)
    with inputs.fields_as_options(**NAMES):
        request = GasRequest(top, **settings)
    if request.times_ps is None and files.paths.keys() & {"--csv", "--parquet", "--plot"}:
        request = replace(request, times_ps=settling_times_ps(top, request.temperature_k))
    answer = _answer(request)
    content = _content(answer, given, context.obj)
    content["files"] = files.names
    deliver(
        files,
        _writers(answer, content, view) | save_scene("gas", request, outputs, given),
        lambda: json_text(content),
        with_sources(
            lambda: _show(answer, content),
            answer.request.top,
            ("constants",),
            given.sources,
            lambda: left_out_facts(content["left_out"]),
        ),
    )


def _settings(options: Options) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    from rotor.thermodynamics.classical_gas import MOST_MOLECULES

    require_whole("--molecules", options.molecules, 2, MOST_MOLECULES)
    require_whole("--seed", options.seed, 0)
    return {
        "molecules": options.molecules,
        "temperature_k": inputs.positive("--temperature", options.temperature, "K"),
        "seed": options.seed,
        "confidence": inputs.quantity("--confidence", options.confidence, ""),
        "times_ps": inputs.times("--times", options.times, "ps"),
    }


def _answer(request: GasRequest) -> GasAnswer:
    """The answer, with a bar on a terminal while the correlation functions are computed."""
    from concurrent.futures import ThreadPoolExecutor

    from rotor.thermodynamics.classical_gas import answer_gas

    if request.times_ps is None:
        return answer_gas(request)
    with ThreadPoolExecutor(os.cpu_count()) as pool, progress(request.molecules, "molecules") as advance:
        return answer_gas(request, pool, advance)


@contextmanager
def progress(total: int, what: str) -> Iterator[Callable[[int], object] | None]:
    """What advances a bar on standard error; None where that is no terminal."""
    import sys

    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TextColumn(what), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.advance(task, done)


def _content(answer: GasAnswer, given: Input, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.reports.top_facts import begin

    curves = answer.correlations
    rows = None if curves is None else rows_of(curves)
    return {**begin(command, given.text), **answer.facts(), "correlation": rows}


def _writers(answer: GasAnswer, content: dict[str, Any], view: View) -> dict[str, Writer]:
    keys = (
        "command", "input", "source", "temperature_k", "molecules", "seed", "vector_source", "tensor_source",
    )  # fmt: skip
    provenance = {key: content[key] for key in keys}

    def table(path: Path) -> None:
        """The table as a file."""
        import rotor

        rotor.write(answer.correlations, path, settings=provenance)

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.gas import plot_gas
        from rotor.plots.picture import name_of_top

        title = f"{name_of_top(answer.request.top)}, {content['temperature_k']:g} K, {content['molecules']:,} molecules"
        plateau = content["c1_plateau"]
        plot_gas(answer.test, answer.correlations, path, title=title, plateau=plateau, view=view, provenance=provenance)

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _show(answer: GasAnswer, content: dict[str, Any]) -> None:
    from rotor.reports.top_facts import heading

    curves = answer.correlations
    print(f"{heading(answer.request.top)}, a classical gas")
    show_facts(_facts(answer, content))
    print()
    show_table(_degrees_table(content))
    if curves is not None:
        print()
        show_table(_curves_table(curves))


def _facts(answer: GasAnswer, content: dict[str, Any]) -> list[tuple[str, str]]:
    top, test = answer.request.top, answer.test
    a, b, c = top.rotational_constants_mhz
    rigid = ", ".join(f"{n} {x:.10g}" for n, x in zip("ABC", (a, b, c), strict=True) if math.isfinite(x))
    count = content["degrees_of_freedom"]
    drawn = f"{content['molecules']} molecules at {content['temperature_k']:g} K, seed {content['seed']}"
    left_out = "" if top.mass_u is not None else "; translations are left out, as the mass is not known"
    facts = [
        ("rigid top", f"{rigid} MHz, distortion neglected"),
        ("drawn", f"{drawn}; moved freely for {content['tested_at_ps']:.4g} ps, exactly"),
        ("degrees", f"{count['translation']} translations, {count['rotation']} rotations a molecule{left_out}"),
        ("test", str(test)),
    ]
    if content["correlation"] is not None:
        facts += [("C1", f"of {content['vector_source']}"), ("C2", f"of {content['tensor_source']}")]
        start = content["short_time_per_ps2"]
        begins = f"C1 as 1 - {0.5 * start['c1']:.5g} t², C2 as 1 - {0.5 * start['c2']:.5g} t² (t in ps)"
        facts.append(("closed forms", f"{begins}; C1 ends at {content['c1_plateau']:.5g}"))
    return facts


def _degrees_table(content: dict[str, Any]) -> Table:
    rows = [
        [
            d["name"], f"{d['energy_cm']:.4f}", f"{d['expected_cm']:.4f}", f"{d['mean']:.5f}", f"{d['mean_spread']:.5f}",
            f"{d['sigma']:+.2f}", f"{d['p_value']:.3g}", f"{d['spread']:.4f}", f"{d['ks_p_value']:.3g}",
        ]
        for d in content["degrees"]
    ]  # fmt: skip
    columns = ("degree", "E (cm-1)", "½kT", "2E/kT", "±", "σ", "p", "spread", "p (KS)")
    return Table(
        "mean kinetic energy by degree; spread √2 = 1.4142 expected", columns, rows, left=frozenset({"degree"})
    )


def _curves_table(curves: Correlations) -> Table:
    count = len(curves)
    rows = sorted({round(i * (count - 1) / (SHOWN - 1)) for i in range(SHOWN)}) if count > SHOWN else range(count)
    columns = ("t (ps)", *list(curves.columns)[1:])
    data = list(curves.columns.values())
    cells = [[f"{data[0][i]:.4g}", *(f"{column[i]:.5f}" for column in data[1:])] for i in rows]
    few = "" if len(cells) == count else f", {len(cells)} of {count} times"
    return Table(f"correlation functions{few}", columns, cells)
