"""`rotor tumble`: the free rotation of a molecule or of any rigid body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs, process
from rotor.cli.shared.driven_tumble import Driven, answer_effects, refuse_without_effect
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import file_option, grouped
from rotor.cli.shared.output import Files, Table, Writer, deliver, json_with_rows, show_facts, show_table
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.cli.shared.tumble_inputs import Options, Start, read_start
from rotor.reports.sources import with_sources

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.classical.motion import MotionTable
    from rotor.classical.tumble import TumbleAnswer

SHOWN = 11  # rows of the motion in the report

SMALL = 1e-4  # of the components of a column
EXAMPLES = """\b
Examples:
  rotor tumble water --plot water.png --gif water.gif
  rotor tumble water --times 0:20ps:401 --csv water.csv
  rotor tumble book --plot book.png
  rotor tumble --body wing-nut --omega "0.01,0,20 rad/s" --gif nut.gif
  rotor tumble --moments "0.6,0.8,1.0 kg m2" --omega "0.1,60,0 rpm"
  rotor tumble --moments 0.6,0.8,1.0 --angular-momentum 1.8,0.4,-0.9 --times 0:10:101 --csv out.csv
  rotor tumble book --effect "linear drag coefficients=1e-4,1e-4,1e-4" --times 0:30:301 --csv slowed.csv"""

FEW_TIMES = 10_000  # half a second of plain Python, as long as loading the compiler takes
NAMES = {"moments": "--moments", "angular_momentum": "--angular-momentum", "times": "--times"}


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the motion as CSV, in full precision.")
    parquet: str | None = file_option(".parquet", help="Write the motion as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the polhodes (.png, .pdf, .svg).")
    gif: str | None = file_option(".gif", ".mp4", help="Animate the motion (.gif; .mp4 with ffmpeg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(
    given=(
        "dipole", "dipole_abc", "spin_weights", "spin_constants", "spins", *inputs.STATES, "calculator", "hessian",
        "symmetry_tolerance",
    )
)  # fmt: skip
def command(context: typer.Context, given: Input, options: Options, driven: Driven, outputs: Outputs) -> None:
    """Free rotation: the exact motion, what it conserves, which axes are stable; with --effect a motion under torques."""
    if driven.effect:
        answer_effects(given, options, driven, outputs, context.obj)
        return
    refuse_without_effect(driven)
    files = Files.of(outputs)
    _check_film(outputs.gif)
    start = read_start(given, options)
    asked = start.request.times
    if outputs.gif and asked is not None and min(asked) == max(asked):
        raise ValueError(
            f"--gif {outputs.gif}: a film needs two different times, a first and a last; give more --times"
        )
    from rotor.classical.tumble import answer_tumble

    if asked is None or len(asked) <= FEW_TIMES:
        process.leave_compiler_out()
    answer = answer_tumble(start.request)
    content = _content(start, answer, context.obj)
    content["files"] = files.names
    writers = _writers(start, answer, content) | save_scene(
        "tumble", start.request, outputs, given if start.top is not None else None
    )
    text = lambda: json_with_rows(answer.table, "motion", content)  # noqa: E731
    deliver(
        files,
        writers,
        text,
        with_sources(lambda: _show(start, answer, content), start.top, ("constants",), given.sources),
    )


def _check_film(path: str | None) -> None:
    if path:
        from rotor.plots.animation import check_film

        inputs.parsed("--gif", path, check_film)


def _content(start: Start, answer: TumbleAnswer, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.reports.top_facts import begin, describe

    if start.top is not None:
        about = describe(start.top, start.text, command)
    else:
        about = begin(command, start.text) | {"kind": answer.request.kind, "notes": list(start.notes)}
    return about | answer.facts() | {"temperature_k": start.temperature_k}


def _writers(start: Start, answer: TumbleAnswer, content: dict[str, Any]) -> dict[str, Writer]:
    """How each option's file is written, with the provenance that its format can hold."""
    from rotor.cli.shared.output import plain

    request, motion, table, units = answer.request, answer.motion, answer.table, answer.request.units
    label = f"$t$ ({units.time})" if units.time else "$t$"
    keys = ("command", "input", "source", "units", "moments", "angular_momentum", "angular_momentum_source")
    provenance = {key: plain(content[key]) for key in keys if key in content}

    def rows(path: Path) -> None:
        """The table as a file."""
        import rotor

        rotor.write(table, path, settings=provenance)

    def plot(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.polhodes import plot_polhodes

        inner = table.times / units.time_factor
        plot_polhodes(
            motion, inner, path, axis_names=request.axes, time_label=label, time_factor=units.time_factor,
            title=_picture_title(start), provenance=provenance,
        )  # fmt: skip

    def film(path: Path) -> None:
        """The film as a file."""
        from rotor.plots.animation import animate

        inner = table.times / units.time_factor
        animate(
            motion, inner, path, atoms=start.atoms, axis_names=request.axes, time_unit=units.time,
            time_factor=units.time_factor, provenance=provenance,
        )  # fmt: skip

    return {
        "--csv": rows,
        "--parquet": rows,
        "--plot": plot,
        "--gif": film,
    }


def _heading(start: Start) -> str:
    from rotor.reports.top_facts import KINDS, heading

    if start.top is not None:
        return heading(start.top)
    name = KINDS[start.request.kind].replace("linear molecule", "linear body")
    if start.body is not None:
        return f"{start.body.name}: {name}"
    return f"moments {_numbers(start.request.moments)}: {name}"


def _picture_title(start: Start) -> str:
    from rotor.plots.picture import name_of_top
    from rotor.reports.top_facts import KINDS

    return _heading(start) if start.top is None else f"{name_of_top(start.top)}: {KINDS[start.top.kind]}"


def _show(start: Start, answer: TumbleAnswer, content: dict[str, Any]) -> None:
    print(f"{_heading(start)}, turning freely")
    show_facts(_facts(start, content))
    print()
    show_table(_axes_table(start, content))
    print()
    show_table(_motion_table(start, answer.table))
    from rotor.reports.top_facts import error_facts

    show_facts(error_facts(content))


def _facts(start: Start, content: dict[str, Any]) -> list[tuple[str, str]]:
    units, facts = start.request.units, []
    if start.top is not None:
        a, b, c = start.top.rotational_constants_mhz
        rigid = ", ".join(f"{n} {x:.10g}" for n, x in zip("ABC", (a, b, c), strict=True) if math.isfinite(x))
        facts.append(("rigid top", f"{rigid} MHz, distortion neglected"))
    if start.body is not None:
        facts.append(("body", f"{start.body.text}; assumed sizes"))
    size = f"{content['angular_momentum_size']:.8g}{_unit(units.angular_momentum)}"
    vector = f"({_numbers(content['angular_momentum'])})"
    ratio, growth = content["separatrix_ratio"], content["growth_rate"]
    facts += [
        ("|L|", f"{size}, {vector} in the body: {start.request.source}"),
        ("energy", f"{content['energy']:.10g}{_unit(units.energy)}"),
        ("motion", _motion_text(start, content)),
        ("about L", f"turns by {content['turning_rate']:.8g} rad{_per(units.time)} on average, as space sees it"),
    ]
    if ratio is not None:
        low, _, high = sorted(zip(start.request.moments, start.request.axes, strict=True))
        where = f"|ω{high[1]}/ω{low[1]}| = {ratio:.8g} where L crosses the plane of these two axes"
        facts.append(("separatrix", where))
        facts.append(("growth rate", f"{growth:.8g}{_per(units.time)} off the intermediate axis"))
    facts += [
        ("chaos", content["chaos"]),
        ("times", content["times_source"]),
        ("conserved", _drift_text(content["invariant_drift"])),
    ]
    return facts


def _motion_text(start: Start, content: dict[str, Any]) -> str:
    kind, unit = content["motion_kind"], _unit(start.request.units.time)
    if kind == "steady":
        return "steady: L stands still in the body"
    if kind == "separatrix":
        return "on the separatrix: L runs into the intermediate axis and does not come back"
    period = f"L goes round {kind.removeprefix('about ')} of the body in a period of {content['period']:.10g}{unit}"
    if len(set(start.request.moments)) < 3:
        return period
    middle = sorted(zip(start.request.moments, start.request.axes, strict=True))[1][1]
    return f"{period}; its component along axis {middle} changes sign every half of it"


def _drift_text(drift: dict[str, float]) -> str:
    return (
        f"energy to {drift['energy']:.1e}, |L| to {drift['momentum']:.1e}, L in space to "
        f"{drift['space_momentum']:.1e} of themselves: round-off, at every time asked for"
    )


def _axes_table(start: Start, content: dict[str, Any]) -> Table:
    """What becomes of a spin about each axis."""
    fates = {
        "stable": "a push oscillates",
        "unstable": "a push grows",
        "neutral": "a push drifts",
        "none": "no rotation about it",
    }
    rate, moment = (
        f"rate (rad{_per(start.request.units.time)})",
        "moment" + _bracket(start.request.units.moment),
    )
    rows = [
        (a["axis"], f"{a['moment']:.8g}", a["kind"], f"{a['rate']:.8g}", fates[a["kind"]])
        for a in content["fixed_axes"]
    ]
    title = "spin about each axis, at this |L|"
    return Table(title, ("axis", moment, "kind", rate, ""), rows, frozenset({"axis", "kind", ""}))


def _motion_table(start: Start, table: MotionTable) -> Table:
    """Some rows of the motion, evenly chosen."""
    units, count = start.request.units, len(table)
    rows = sorted({round(i * (count - 1) / (SHOWN - 1)) for i in range(SHOWN)}) if count > SHOWN else range(count)
    columns = [
        f"t{_bracket(units.time)}",
        *(f"L{name}{_bracket(units.angular_momentum)}" for name in start.request.axes),
    ]
    columns += ["qw", "qx", "qy", "qz"]
    data = list(table.columns.values())[: len(columns)]
    cells = [
        [f"{column[i]:.6g}" if k == 0 else _component(column[i], column) for k, column in enumerate(data)] for i in rows
    ]
    title = "the motion" if len(cells) == count else f"the motion, {len(cells)} of {count} times"
    return Table(title, columns, cells)


def _numbers(values: Any) -> str:
    return ", ".join(f"{x:.8g}" for x in values)


def _unit(name: str) -> str:
    return f" {name}" if name else ""


def _per(name: str) -> str:
    return f"/{name}" if name else " per time"


def _bracket(name: str) -> str:
    return f" ({name})" if name else ""


def _component(value: float, column: Floats) -> str:
    """Six decimals, or six digits where the whole column is so small that decimals would show nothing (SI units of molecules)."""
    largest = float(max(abs(column.min()), abs(column.max())))
    return f"{value:.6g}" if 0 < largest < SMALL else f"{round(value, 6) + 0.0:.6f}"
