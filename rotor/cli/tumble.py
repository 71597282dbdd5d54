"""`rotor tumble`: the free rotation of a molecule or of any rigid body."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.output import Files, Table, Writer, deliver, json_with_rows, show_facts, show_table

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.classical.free.free_motion import FreeMotion
    from rotor.classical.motion import MotionTable
    from rotor.cli.shared.tumble_inputs import Thrown

SHOWN = 11  # rows of the motion in the report

EXAMPLES = """\b
Examples:
  rotor tumble water --plot water.png --gif water.gif
  rotor tumble water --times 0:20ps:401 --csv water.csv
  rotor tumble --moments 0.6,0.8,1.0 --angular-momentum 1.8,0.4,-0.9 --times 0:10:101 --csv out.csv"""


def command(
    context: typer.Context,
    source: str | None = inputs.SOURCE,
    constants: str | None = inputs.CONSTANTS,
    moments: str | None = typer.Option(
        None, metavar="I1,I2,I3", help="Principal moments instead of a molecule (any coherent units); order is kept."
    ),
    angular_momentum: str | None = typer.Option(
        None, metavar="L1,L2,L3", help="At time 0, in principal axes (ħ for a molecule; by default the thermal mean)."
    ),
    temperature: str | None = typer.Option(
        None, metavar="T", help="Of the thermal mean of |L| of a molecule (K; by default 300)."
    ),
    times: str | None = typer.Option(
        None, metavar="GRID", help="start:stop:count or a comma list (ps for a molecule); by default two periods."
    ),
    isotope: list[str] | None = inputs.ISOTOPE,
    csv: str | None = typer.Option(None, metavar="FILE", help="Write the motion as CSV, in full precision."),
    parquet: str | None = typer.Option(None, metavar="FILE", help="Write the motion as Parquet."),
    plot: str | None = typer.Option(None, metavar="FILE", help="Draw the polhodes (.png, .pdf, .svg)."),
    gif: str | None = typer.Option(None, metavar="FILE", help="Animate the motion (.gif; .mp4 with ffmpeg)."),
    json: str | None = inputs.JSON,
) -> None:
    """Free rotation: the exact motion, what it conserves, which axes are stable."""
    from rotor.cli.shared.tumble_inputs import read_thrown, read_times

    files = _files({"--csv": csv, "--parquet": parquet, "--plot": plot, "--gif": gif}, json)
    given = Input(source, constants, isotope or [], None, None, None)
    thrown = read_thrown(given, moments, angular_momentum, temperature)
    asked = read_times(times, thrown.units)
    if gif and asked is not None and asked.min() == asked.max():
        raise ValueError(f"--gif {gif}: a film needs two different times, a first and a last; give more --times")

    motion, table, content = _solve(thrown, asked, context.obj)
    content["files"] = [str(path) for path in files.wanted.values()]
    writers = _writers(thrown, motion, table, content)
    deliver(files, writers, lambda: json_with_rows(table, "motion", content), lambda: _show(thrown, table, content))


def _files(asked: dict[str, str | None], json: str | None) -> Files:
    """The files asked for, each with a suffix that can be made here."""
    files = Files()
    suffixes = {"--plot": (".png", ".pdf", ".svg"), "--gif": (".gif", ".mp4")}
    for name, path in asked.items():
        files.ask(name, path, suffixes.get(name, (name.replace("--", "."),)))
    files.ask_json(json)
    if gif := asked["--gif"]:
        from rotor.plots.animation import check_film

        inputs.option("--gif", gif, check_film)
    return files


def _solve(thrown: Thrown, asked: Floats | None, command: str) -> tuple[FreeMotion, MotionTable, dict[str, Any]]:
    """The motion, its table in the units of print, and everything else that is printed."""
    from rotor.classical.free.free_motion import free_motion
    from rotor.classical.motion import MotionTable, departure, sampled
    from rotor.cli.shared.tumble_inputs import chosen_times

    units = thrown.units
    motion = free_motion(thrown.moments, thrown.momentum)
    times, times_source = (asked, "given (--times)") if asked is not None else chosen_times(motion, units)
    inner = sampled(motion, times / units.time_factor)
    momentum, energy = inner.momentum * units.momentum_factor, inner.energy * units.energy_factor
    table = MotionTable(times, momentum, inner.attitude, energy)
    content = {
        **_about_body(thrown, command),
        **_about_motion(thrown, motion),
        "times_source": times_source,
        "departure": asdict(departure(inner, motion)),
    }
    return motion, table, content


def _about_body(thrown: Thrown, command: str) -> dict[str, Any]:
    import rotor

    units = thrown.units
    if thrown.top is not None:
        from rotor.cli.shared.report import describe

        story = describe(thrown.top, thrown.text, command)
    else:
        story = {
            "rotor_version": rotor.__version__,
            "command": command,
            "input": thrown.text,
            "kind": _kind(thrown.moments),
            "notes": list(thrown.notes),
        }
    return story | {
        "units": {"time": units.time, "angular_momentum": units.angular_momentum, "energy": units.energy},
        "moments": thrown.moments,
        "axes": list(thrown.names),
        "angular_momentum": thrown.momentum * units.momentum_factor,
        "angular_momentum_size": float(math.hypot(*thrown.momentum)) * units.momentum_factor,
        "angular_momentum_source": thrown.momentum_source,
        "temperature_k": thrown.temperature_k,
    }


def _kind(moments: Floats) -> str:
    """Kind of body by exact equality of the moments given."""
    low, middle, high = sorted(moments.tolist())
    if low == 0.0:
        return "linear"
    equal = {(True, True): "spherical", (True, False): "oblate", (False, True): "prolate"}
    return equal.get((low == middle, middle == high), "asymmetric")


def _about_motion(thrown: Thrown, motion: FreeMotion) -> dict[str, Any]:
    from rotor.classical.euler import energy
    from rotor.classical.free.stability import stability

    units, closed = thrown.units, stability(thrown.moments, thrown.momentum)
    distinct = len(set(thrown.moments.tolist())) == 3
    axes = [
        {"axis": name, "moment": moment, "kind": fixed.kind, "rate": fixed.rate / units.time_factor}
        for name, moment, fixed in zip(thrown.names, thrown.moments.tolist(), closed.axes, strict=True)
    ]
    return {
        "energy": float(energy(thrown.momentum, thrown.moments)) * units.energy_factor,
        "motion_kind": _motion_kind(thrown, motion),
        "period": float(motion.period) * units.time_factor,
        "turning_rate": float(motion.turning_rate) / units.time_factor,
        "fixed_axes": axes,
        "separatrix_ratio": closed.separatrix_ratio if distinct else None,
        "growth_rate": closed.growth_rate / units.time_factor,
        "asymptotic_period": closed.asymptotic_period * units.time_factor,
        "chaos": closed.chaos,
    }


def _motion_kind(thrown: Thrown, motion: FreeMotion) -> str:
    if motion.steady:
        return "steady"
    if motion.separatrix:
        return "separatrix"
    return f"about axis {thrown.names[motion.centre_axis]}"


def _writers(thrown: Thrown, motion: FreeMotion, table: MotionTable, content: dict[str, Any]) -> dict[str, Writer]:
    """How each option's file is written, with the provenance that its format can hold."""
    from rotor.cli.shared.output import plain

    units = thrown.units
    label = f"$t$ ({units.time})" if units.time else "$t$"
    kept = ("command", "input", "source", "units", "moments", "angular_momentum", "angular_momentum_source")
    story = {key: plain(content[key]) for key in kept if key in content}

    def rows(path: Path) -> None:
        import rotor

        rotor.write(table, path, settings=story)

    def plot(path: Path) -> None:
        from rotor.plots.polhodes import plot_polhodes

        inner = table.times / units.time_factor
        plot_polhodes(
            motion, inner, path, axis_names=thrown.names, time_label=label, time_factor=units.time_factor,
            title=_heading(thrown), provenance=story,
        )  # fmt: skip

    def film(path: Path) -> None:
        from rotor.plots.animation import animate

        inner = table.times / units.time_factor
        animate(
            motion, inner, path, atoms=thrown.atoms, axis_names=thrown.names, time_unit=units.time,
            time_factor=units.time_factor, provenance=story,
        )  # fmt: skip

    return {
        "--csv": rows,
        "--parquet": rows,
        "--plot": plot,
        "--gif": film,
    }


def _heading(thrown: Thrown) -> str:
    from rotor.cli.shared.report import KINDS, heading

    if thrown.top is not None:
        return heading(thrown.top)
    name = KINDS[_kind(thrown.moments)].replace("linear molecule", "linear body")
    return f"moments {_numbers(thrown.moments)}: {name}"


def _show(thrown: Thrown, table: MotionTable, content: dict[str, Any]) -> None:
    print(f"{_heading(thrown)}, turning freely")
    show_facts(_facts(thrown, content))
    print()
    show_table(_axes_table(thrown, content))
    print()
    show_table(_motion_table(thrown, table))


def _facts(thrown: Thrown, content: dict[str, Any]) -> list[tuple[str, str]]:
    units, facts = thrown.units, []
    if thrown.top is not None:
        from rotor.cli.shared.report import with_source

        a, b, c = thrown.top.rotational_constants_mhz
        rigid = ", ".join(f"{n} {x:.10g}" for n, x in zip("ABC", (a, b, c), strict=True) if math.isfinite(x))
        facts.append(("rigid top", with_source(f"{rigid} MHz, distortion neglected", thrown.top.source)))
    size = f"{content['angular_momentum_size']:.8g}{_unit(units.angular_momentum)}"
    vector = f"({_numbers(content['angular_momentum'])})"
    ratio, growth = content["separatrix_ratio"], content["growth_rate"]
    facts += [
        ("|L|", f"{size}, {vector} in the body: {thrown.momentum_source}"),
        ("energy", f"{content['energy']:.10g}{_unit(units.energy)}"),
        ("motion", _motion_text(thrown, content)),
        ("about L", f"turns by {content['turning_rate']:.8g} rad{_per(units.time)} on average, as space sees it"),
    ]
    if ratio is not None:
        low, _, high = sorted(zip(thrown.moments.tolist(), thrown.names, strict=True))
        where = f"|ω{high[1]}/ω{low[1]}| = {ratio:.8g} where L crosses the plane of these two axes"
        facts.append(("separatrix", where))
        facts.append(("growth rate", f"{growth:.8g}{_per(units.time)} off the intermediate axis"))
    facts += [
        ("chaos", content["chaos"]),
        ("times", content["times_source"]),
        ("kept", _kept_text(content["departure"])),
    ]
    return facts


def _motion_text(thrown: Thrown, content: dict[str, Any]) -> str:
    kind, unit = content["motion_kind"], _unit(thrown.units.time)
    if kind == "steady":
        return "steady: L stands still in the body"
    if kind == "separatrix":
        return "on the separatrix: L runs into the intermediate axis and does not come back"
    period = f"L goes round {kind.removeprefix('about ')} of the body in a period of {content['period']:.10g}{unit}"
    if len(set(thrown.moments.tolist())) < 3:
        return period
    middle = sorted(zip(thrown.moments.tolist(), thrown.names, strict=True))[1][1]
    return f"{period}; its component along axis {middle} changes sign every half of it"


def _kept_text(departure: dict[str, float]) -> str:
    return (
        f"energy to {departure['energy']:.1e}, |L| to {departure['momentum']:.1e}, L in space to "
        f"{departure['space_momentum']:.1e} of themselves: round-off, at every time asked for"
    )


def _axes_table(thrown: Thrown, content: dict[str, Any]) -> Table:
    """What becomes of a spin about each axis."""
    fates = {
        "stable": "a push oscillates",
        "unstable": "a push grows",
        "neutral": "a push drifts",
        "none": "no rotation about it",
    }
    rate, moment = f"rate (rad{_per(thrown.units.time)})", "moment" + (" (u Å²)" if thrown.top is not None else "")
    rows = [
        (a["axis"], f"{a['moment']:.8g}", a["kind"], f"{a['rate']:.8g}", fates[a["kind"]])
        for a in content["fixed_axes"]
    ]
    title = "spin about each axis, at this |L|"
    return Table(title, ("axis", moment, "kind", rate, ""), rows, frozenset({"axis", "kind", ""}))


def _motion_table(thrown: Thrown, table: MotionTable) -> Table:
    """Some rows of the motion, evenly chosen."""
    units, count = thrown.units, len(table)
    rows = sorted({round(i * (count - 1) / (SHOWN - 1)) for i in range(SHOWN)}) if count > SHOWN else range(count)
    columns = [f"t{_bracket(units.time)}", *(f"L{name}{_bracket(units.angular_momentum)}" for name in thrown.names)]
    columns += ["qw", "qx", "qy", "qz"]
    data = list(table.columns.values())[: len(columns)]
    cells = [
        [f"{column[i]:.6g}" if k == 0 else f"{round(column[i], 6) + 0.0:.6f}" for k, column in enumerate(data)]
        for i in rows
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
