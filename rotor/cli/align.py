"""`rotor align`: molecules aligned or oriented by pulses, quantum and classical."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input, json_option, parsed, quantity
from rotor.cli.shared.options import file_option, grouped, option
from rotor.cli.shared.output import (
    Files,
    Table,
    Writer,
    deliver,
    json_with_rows,
    note,
    show_facts,
    show_table,
)
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.polarizability import with_polarizability
from rotor.cli.shared.pulse_inputs import Pulses, pulses_of
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.reports.sources import with_sources
from rotor.reports.top_facts import model_facts
from rotor.table import counted

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.alignment.pulse import Pulse
    from rotor.alignment.request import AlignAnswer
    from rotor.plots.view import View
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor align OCS --pulse "1e13 W/cm2, 1 ps" --temperature 1 --until 200ps --plot ocs.png --csv ocs.csv
  rotor align --constants "B=6081.492 MHz" --anisotropy 4.04 --pulse "1e13 W/cm2, 50 fs"
  rotor align N2 --pulse "3e13 W/cm2, 0.1 ps" --pulse "3e13 W/cm2, 0.1 ps, 8.38 ps" --temperature 300 --classical 20000
  rotor align OCS --thz "500 kV/cm, 1 ps, 0.3 THz" --observable costheta"""

NAMES = {
    "temperature_k": "--temperature", "from_ps": "--from", "until_ps": "--until", "points": "--points", "jmax": "--jmax",
    "classical_molecules": "--classical", "seed": "--seed", "tolerance": "--tolerance",
    "state": "--state", "m": "--m",
}  # fmt: skip  # field of the request -> option


@dataclass(frozen=True)
class Options:
    """What is computed."""

    temperature: str = option("1", metavar="T", help="Temperature (K); 0 is the lowest level.")
    state: str | None = option(
        None, metavar="LIST", help="One level instead of a temperature, such as j=0 or j=1,ka=0,kc=1."
    )
    m: int | None = option(None, "--m", metavar="N", help="|M| of that level; by default all alike.")
    until: str | None = option(
        None, metavar="T", help="Last time (ps); by default one revival after the pulses, or 100 ps."
    )
    from_: str | None = option(None, "--from", metavar="T", help="First time (ps); by default where the pulses begin.")
    points: int = option(2001, metavar="N", help="How many times.")
    observable: list[str] | None = option(
        None, metavar="NAME", help="cos2theta (default), costheta, cos2theta_2d, cos2_aZ, cos_bX, ...; repeatable."
    )
    polarizability: str | None = option(
        None, metavar="LIST", help="In principal axes: aa,bb,cc[,ab,ac,bc] or parallel,perpendicular (Å³)."
    )
    anisotropy: str | None = option(
        None, metavar="X", help="α∥ - α⊥ of a linear or symmetric top (Å³), instead of --polarizability."
    )
    tolerance: str = option("1e-6", metavar="X", help="Of the cosines: steps, J max and populations follow from it.")
    jmax: int | None = option(None, metavar="N", help="Highest J of the basis; by default what the tolerance needs.")
    classical: int = option(0, metavar="N", help="Also a classical gas of so many molecules under the same pulses.")
    seed: int = option(1, metavar="N", help="Of the classical gas.")
    workers: int = option(1, metavar="N", help="Processes over which blocks of initial states are spread.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the cosines as CSV.")
    parquet: str | None = file_option(".parquet", help="Write the cosines as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the cosines (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(given=("dipole", "calculator", "hessian", "spin_constants", "spins", *inputs.STATES), picture=("plot_scale",))
def command(
    context: typer.Context, given: Input, pulses: Pulses, options: Options, outputs: Outputs, picture: ViewOptions
) -> None:
    """Molecules aligned or oriented by pulses of light: cosines against time of a rotational wave packet."""
    from rotor.alignment.request import AlignRequest, answer_align
    from rotor.cli.shared.workers import working

    acting = pulses_of(pulses)
    settings = _settings(options)
    files = Files.of(outputs)
    view = view_of(picture, files, "ps")
    top = _with_tensor(inputs.read_top(given), options, acting)
    with inputs.fields_as_options(**NAMES):
        request = AlignRequest(top, acting, **settings)
        with working(options.workers, "blocks") as executor:
            answer = answer_align(request, executor)
    if request.state is not None and request.classical_molecules:
        note("the classical gas is at the temperature of --temperature, not in the level of --state")

    content = _content(answer, given, context.obj)
    content["files"] = files.names
    text = lambda: json_with_rows(answer.table, "trace", content)  # noqa: E731
    by_hand = options.polarizability is not None or options.anisotropy is not None
    saved = save_scene("align", request, outputs, given, by_hand)
    deliver(
        files,
        _writers(answer, content, view) | saved,
        text,
        with_sources(
            lambda: _show(answer, content),
            answer.trace.top,
            ("constants", "dipole", "polarizability"),
            given.sources,
            lambda: model_facts(content),
        ),
    )


def _settings(options: Options) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    return {
        "temperature_k": quantity("--temperature", options.temperature, "K"),
        "state": None if options.state is None else parsed("--state", options.state, _state),
        "m": options.m,
        "from_ps": None if options.from_ is None else quantity("--from", options.from_, "ps"),
        "until_ps": None if options.until is None else quantity("--until", options.until, "ps"),
        "points": options.points,
        "observables": tuple(options.observable or ["cos2theta"]),
        "tolerance": quantity("--tolerance", options.tolerance, ""),
        "jmax": options.jmax,
        "classical_molecules": options.classical,
        "seed": options.seed,
    }


def _state(text: str) -> dict[str, int]:
    out: dict[str, int] = {}
    for item in text.split(","):
        name, equals, number = (part.strip() for part in item.partition("="))
        if not equals or not number.isdecimal():
            raise ValueError(f"{item.strip()!r} in {text!r}: expected name=number, such as j=1,ka=0,kc=1")
        out[name.lower()] = int(number)
    return out


def _with_tensor(top: Top, options: Options, pulses: tuple[Pulse, ...]) -> Top:
    """The top with what the pulses act on, from the options where they give it."""
    if options.polarizability is not None and options.anisotropy is not None:
        raise ValueError("--polarizability and --anisotropy: give one of them")
    if options.anisotropy is not None:
        return parsed("--anisotropy", options.anisotropy, lambda text: _with_anisotropy(top, text))
    acts_on = {pulse.acts_on for pulse in pulses}
    if "dipole" in acts_on:
        top = inputs.with_some_dipole(top)
    if options.polarizability is not None or "polarizability" in acts_on:
        top = with_polarizability(top, options.polarizability)
    return top


def _with_anisotropy(top: Top, text: str) -> Top:
    import numpy as np

    from rotor.units import parse_quantity

    if top.kind not in ("linear", "prolate", "oblate"):
        raise ValueError(f"a top of the kind {top.kind} has no single anisotropy; give --polarizability aa,bb,cc")
    tensor = np.zeros((3, 3))
    axis = 2 if top.kind == "oblate" else 0
    tensor[axis, axis] = parse_quantity(text, "Å3")
    return top.with_polarizability(
        tensor, "the anisotropy given (--anisotropy); the mean, which turns nothing, is left out"
    )


def _content(answer: AlignAnswer, given: Input, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.reports.top_facts import begin

    return {**begin(command, given.text), **answer.facts()}


def _writers(answer: AlignAnswer, content: dict[str, Any], view: View) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"]}

    def table(path: Path) -> None:
        """The table as a file."""
        import rotor

        rotor.write(answer.table, path, settings=provenance)

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.alignment import plot_alignment
        from rotor.plots.picture import name_of_top

        trace = answer.trace
        title = ", ".join(filter(None, (name_of_top(trace.top), _ensemble_text(trace))))
        plot_alignment(
            trace,
            path,
            classical=answer.classical,
            title=title,
            view=view,
            provenance={"command": provenance["command"]},
        )

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _ensemble_text(trace: AlignmentTrace) -> str:
    ensemble = trace.ensemble
    if ensemble.chosen is None:
        return f"{ensemble.temperature_k:g} K, {trace.states} states up to J = {ensemble.jmax}"
    level = ", ".join(f"{name} = {value}" for name, value in ensemble.chosen.items())
    return f"level {level}, " + ("all M" if ensemble.m is None else f"|M| = {ensemble.m}")


def _show(answer: AlignAnswer, content: dict[str, Any]) -> None:
    from rotor.reports.top_facts import heading

    trace = answer.trace
    print(heading(trace.top))
    show_facts(_facts(trace, content))
    print()
    rows = []
    for one in content["extremes"]:
        mean = trace.permanent.get(one["name"])
        numbers = f"{one['max']:.6f}", f"{one['max_at_ps']:.3f}", f"{one['min']:.6f}", f"{one['min_at_ps']:.3f}"
        rows.append([one["name"], *numbers, "" if mean is None else f"{mean:.6f}"])
    columns = ("cosine", "max", "at (ps)", "min", "at (ps)", "mean after")
    show_table(Table("", columns, rows, frozenset({"cosine"})))


def _facts(trace: AlignmentTrace, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.reports import top_facts as report

    top = trace.top
    acts_on = {pulse.acts_on for pulse in trace.pulses}
    facts = [("constants", report.constants_text(top))]
    if "dipole" in acts_on:
        facts.append(("dipole", report.dipole_text(top)))
    if "polarizability" in acts_on:
        facts.append(("polarizability", report.tensor_text(top)))
    accuracy = (
        f"{content['error_estimate']:.1e} estimated: steps {trace.step_error:.1e}, leakage {trace.edge_population:.1e}, "
        f"left out {trace.ensemble.left_out:.1e} of the population"
    )
    return [
        *facts,
        ("pulses", "; ".join(_pulse_text(pulse) for pulse in trace.pulses)),
        ("gas", _ensemble_text(trace)),
        ("J max", str(trace.jmax)),
        ("method", f"{trace.method}, {counted(sum(trace.steps), 'step')}"),
        ("accuracy", accuracy),
    ]


def _pulse_text(pulse: Pulse) -> str:
    first, last = pulse.window_ps
    return f"{type(pulse).__name__} on the {pulse.acts_on}, {first:g} to {last:g} ps"
