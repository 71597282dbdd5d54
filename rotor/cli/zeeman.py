"""`rotor zeeman`: levels of a molecule in a static magnetic field."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.field_maps import (
    accuracy_fact,
    content_of,
    fields_of,
    refuse_picture_of_one_field,
    table_of_states,
)
from rotor.cli.shared.inputs import Input, json_option, parsed, positive
from rotor.cli.shared.options import file_option, grouped, option
from rotor.cli.shared.output import (
    Files,
    Table,
    Writer,
    deliver,
    json_with_rows,
    show_facts,
    show_table,
)
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.reports.sources import with_sources
from rotor.reports.top_facts import model_facts
from rotor.table import counted

if TYPE_CHECKING:
    from rotor.plots.view import View
    from rotor.quantum.fields.field_map import FieldMap
    from rotor.quantum.fields.zeeman_request import ZeemanAnswer
    from rotor.tops.magnetic import Tensor
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor zeeman --constants "B=6081.492 MHz" --g -0.03 --field 0:5T --plot levels.png --csv levels.csv
  rotor zeeman --constants "A=10 B=6 C=4 GHz" --g 0.6,-0.2,0.3 --magnetisability -3,2,-7 --field 0:20T:41 --states "J<=1"
  rotor zeeman HC3N --g -0.01 --field 0:200G --states "J<=1" --spin-constants "chi_aa(14N)=-4.3 MHz" --plot hc3n.png
  rotor zeeman molecule.toml --field 1T --json -"""

MOST_J = 500  # of the basis: a minute's work for an asymmetric top
NAMES = {
    "fields_tesla": "--field", "j_highest": "--states", "jmax": "--jmax", "tolerance_mhz": "--tolerance",
    "hyperfine": "--hyperfine", "nuclear_g": "--nuclear-g",
}  # fmt: skip  # field of the request -> option
POINTS = 51


@dataclass(frozen=True)
class Options:
    """What is computed."""

    field: str = option(
        "0:5T", metavar="GRID", help="Fields: start:stop[:count], of 51 by default, or a comma list (T, mT or G)."
    )
    states: str = option("J<=2", metavar="TEXT", help="Levels up to this J of the free molecule.")
    g: str | None = option(
        None,
        "--g",
        metavar="LIST",
        help="Rotational g tensor along a, b, c: aa,bb,cc[,ab,ac,bc]; parallel,perpendicular; or g.",
    )
    magnetisability: str | None = option(
        None, metavar="LIST", help="Likewise, with its sign, in 1e-6 erg/(G2 mol); by default left out."
    )
    jmax: int | None = option(None, metavar="N", help="Highest J of the basis; by default what the tolerance needs.")
    tolerance: str = option("1e-6", metavar="E", help="Of the energies (MHz).")
    hyperfine: bool | None = option(
        None,
        "--hyperfine/--no-hyperfine",
        help="With the spins of nuclei; by default where --spin-constants are given.",
    )
    nuclear_g: str | None = option(
        None,
        metavar="LIST",
        help="g = moment/(nuclear magneton x spin) of spins, 14N=0.4038,...; by default of the isotope.",
    )
    workers: int = option(1, metavar="N", help="Processes over which blocks of states are spread.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the map as CSV.")
    parquet: str | None = file_option(".parquet", help="Write the map as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the map (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(
    given=("dipole", "dipole_abc", "spin_weights", "calculator", "hessian", *inputs.STATES), picture=("plot_scale",)
)
def command(context: typer.Context, given: Input, options: Options, outputs: Outputs, picture: ViewOptions) -> None:
    """Levels in a static magnetic field: energies, labels and magnetic moments of every M, with nuclear spins where asked."""
    from rotor.cli.shared.workers import working
    from rotor.quantum.fields.zeeman_request import ZeemanRequest, answer_zeeman

    settings = _settings(options)
    settings["hyperfine"] = given.spin_constants is not None if options.hyperfine is None else options.hyperfine
    files = Files.of(outputs)
    view = view_of(picture, files, "T")
    refuse_picture_of_one_field(files, settings["fields_tesla"])
    top = _with_tensors(inputs.read_top(given), options)
    with inputs.fields_as_options(**NAMES):
        request = ZeemanRequest(top, **settings)
        with working(options.workers, "blocks") as executor:
            answer = answer_zeeman(request, executor)

    content = content_of(answer, given, context.obj)
    content["files"] = files.names
    text = lambda: json_with_rows(answer.states, "states", content)  # noqa: E731
    show = with_sources(
        lambda: _show(answer, content), top, ("constants",), given.sources, lambda: model_facts(content)
    )
    deliver(files, _writers(answer, content, view) | save_scene("zeeman", request, outputs, given), text, show)


def _settings(options: Options) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    require_whole("--jmax", options.jmax, 0, MOST_J)
    return {
        "fields_tesla": parsed("--field", options.field, lambda text: fields_of(text, "T", POINTS)),
        "j_highest": parsed("--states", options.states, inputs.highest_j),
        "jmax": options.jmax,
        "tolerance_mhz": positive("--tolerance", options.tolerance, "MHz"),
        "nuclear_g": None if options.nuclear_g is None else parsed("--nuclear-g", options.nuclear_g, _named),
    }


def _named(text: str) -> dict[str, float]:
    out: dict[str, float] = {}
    for item in text.split(","):
        name, equals, number = (part.strip() for part in item.partition("="))
        try:
            out[name] = float(number)
        except ValueError:
            equals = ""
        if not name or not equals:
            raise ValueError(f"{item.strip()!r} in {text!r}: expected spin=number, such as 14N=0.4038")
    return out


def _with_tensors(top: Top, options: Options) -> Top:
    """The top with the tensors given, else those of its file."""
    from rotor.tops.magnetic import MagneticTensors

    chi = None
    if options.magnetisability is not None:
        chi = parsed("--magnetisability", options.magnetisability, lambda text: _tensor(top, text))
    if options.g is not None:
        g = parsed("--g", options.g, lambda text: _tensor(top, text))
        return replace(
            top, magnetic=MagneticTensors(g, chi, "given (--g, --magnetisability)" if chi else "given (--g)")
        )
    if top.magnetic is None:
        raise ValueError(
            "the rotational g tensor is not known: give --g aa,bb,cc (principal axes), parallel,perpendicular of a symmetric "
            "top, or the one g of a linear top"
        )
    return top if chi is None else replace(top, magnetic=replace(top.magnetic, magnetisability=chi))


def _tensor(top: Top, text: str) -> Tensor:
    from rotor.tops.magnetic import tensor_for

    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{text!r}: expected numbers between commas, such as 0.6,-0.2,0.3") from None
    return tensor_for(top.kind, numbers)


def _writers(answer: ZeemanAnswer, content: dict[str, Any], view: View) -> dict[str, Writer]:
    provenance = {name: content[name] for name in ("command", "input", "g_abc", "magnetisability_abc", "nuclear_g")}

    def table(path: Path) -> None:
        """The table as a file."""
        import rotor

        rotor.write(answer.states, path, settings=provenance)

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.picture import name_of_top
        from rotor.plots.zeeman import plot_zeeman

        title, made_by = name_of_top(answer.request.top), {"command": provenance["command"]}
        spins = len(answer.request.spin_g)
        plot_zeeman(answer.states, path, title=title, spins=spins, view=view, provenance=made_by)

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _show(answer: ZeemanAnswer, content: dict[str, Any]) -> None:
    from rotor.reports.top_facts import heading

    print(heading(answer.request.top))
    show_facts(_facts(answer, content))
    print()
    show_table(_table(answer.states))


def _table(states: FieldMap) -> Table:
    """The first states, by M and block."""
    first, last = states.fields[0], states.fields[-1]

    def row(rows: slice) -> list[str]:
        """One row of the printed table."""
        at, end = rows.start, rows.stop - 1
        numbers = (states.energy_mhz[at], states.energy_mhz[end], states.slope[end])
        return [str(states.label[at]), f"{states.m[at]:g}", *(f"{round(value, 6) + 0.0:.6f}" for value in numbers)]

    names = ("state", "M", f"E at {first:g} T (MHz)", f"E at {last:g} T (MHz)", "moment there (μ_N)")
    return table_of_states(states, names, row)


def _facts(answer: ZeemanAnswer, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.reports import top_facts as report

    first, last, count = content["field_tesla"]
    facts = [
        ("constants", report.constants_text(answer.request.top)),
        ("g", _tensor_text(content["g_abc"])),
        ("field", f"{first:g} to {last:g} T along Z, {counted(count, 'value')}"),
    ]
    if content["magnetisability_abc"] is not None:
        facts.append(("magnetisability", f"{_tensor_text(content['magnetisability_abc'])} 1e-6 erg/(G² mol)"))
    if content["nuclear_g"]:
        facts.append(("g of spins", ", ".join(f"{name} {value:g}" for name, value in content["nuclear_g"].items())))
    return [*facts, accuracy_fact(content)]


def _tensor_text(tensor: Tensor) -> str:
    (aa, ab, ac), (_, bb, bc), (_, _, cc) = tensor
    mixed = [f"{name} {value:g}" for name, value in (("ab", ab), ("ac", ac), ("bc", bc)) if value]
    return ", ".join([f"aa {aa:g}", f"bb {bb:g}", f"cc {cc:g}", *mixed])
