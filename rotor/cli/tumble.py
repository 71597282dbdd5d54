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
    from rotor.cli.shared.tumble_inputs import InitialState

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
    from rotor.cli.shared.tumble_inputs import read_initial_state, read_times

    files = _files({"--csv": csv, "--parquet": parquet, "--plot": plot, "--gif": gif}, json)
    given = Input(source, constants, isotope or [], None, None, None)
    state = read_initial_state(given, moments, angular_momentum, temperature)
    asked = read_times(times, state.units)
    if gif and asked is not None and asked.min() == asked.max():
        raise ValueError(f"--gif {gif}: a film needs two different times, a first and a last; give more --times")

    motion, table, content = _solve(state, asked, context.obj)
    content["files"] = [str(path) for path in files.wanted.values()]
    writers = _writers(state, motion, table, content)
    deliver(files, writers, lambda: json_with_rows(table, "motion", content), lambda: _show(state, table, content))


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


def _solve(state: InitialState, asked: Floats | None, command: str) -> tuple[FreeMotion, MotionTable, dict[str, Any]]:
    """The motion, its table in the units of print, and everything else that is printed."""
    from rotor.classical.free.free_motion import free_motion
    from rotor.classical.motion import MotionTable, invariant_drift, sampled
    from rotor.cli.shared.tumble_inputs import chosen_times

    units = state.units
    motion = free_motion(state.moments, state.momentum)
    times, times_source = (asked, "given (--times)") if asked is not None else chosen_times(motion, units)
    inner = sampled(motion, times / units.time_factor)
    momentum, energy = inner.momentum * units.momentum_factor, inner.energy * units.energy_factor
    table = MotionTable(times, momentum, inner.attitude, energy)
    content = {
        **_about_body(state, command),
        **_about_motion(state, motion),
        "times_source": times_source,
        "invariant_drift": asdict(invariant_drift(inner, motion)),
    }
    return motion, table, content


def _about_body(state: InitialState, command: str) -> dict[str, Any]:
    import rotor

    units = state.units
    if state.top is not None:
        from rotor.cli.shared.report import describe

        provenance = describe(state.top, state.text, command)
    else:
        provenance = {
            "rotor_version": rotor.__version__,
            "command": command,
            "input": state.text,
            "kind": _kind(state.moments),
            "notes": list(state.notes),
        }
    return provenance | {
        "units": {"time": units.time, "angular_momentum": units.angular_momentum, "energy": units.energy},
        "moments": state.moments,
        "axes": list(state.names),
        "angular_momentum": state.momentum * units.momentum_factor,
        "angular_momentum_size": float(math.hypot(*state.momentum)) * units.momentum_factor,
        "angular_momentum_source": state.momentum_source,
        "temperature_k": state.temperature_k,
    }


def _kind(moments: Floats) -> str:
    """Kind of body by exact equality of the moments given."""
    low, middle, high = sorted(moments.tolist())
    if low == 0.0:
        return "linear"
    equal = {(True, True): "spherical", (True, False): "oblate", (False, True): "prolate"}
    return equal.get((low == middle, middle == high), "asymmetric")


def _about_motion(state: InitialState, motion: FreeMotion) -> dict[str, Any]:
    from rotor.classical.euler import energy
    from rotor.classical.free.stability import stability

    units, closed = state.units, stability(state.moments, state.momentum)
    distinct = len(set(state.moments.tolist())) == 3
    axes = [
        {"axis": name, "moment": moment, "kind": fixed.kind, "rate": fixed.rate / units.time_factor}
        for name, moment, fixed in zip(state.names, state.moments.tolist(), closed.axes, strict=True)
    ]
    return {
        "energy": float(energy(state.momentum, state.moments)) * units.energy_factor,
        "motion_kind": _motion_kind(state, motion),
        "period": float(motion.period) * units.time_factor,
        "turning_rate": float(motion.turning_rate) / units.time_factor,
        "fixed_axes": axes,
        "separatrix_ratio": closed.separatrix_ratio if distinct else None,
        "growth_rate": closed.growth_rate / units.time_factor,
        "asymptotic_period": closed.asymptotic_period * units.time_factor,
        "chaos": closed.chaos,
    }


def _motion_kind(state: InitialState, motion: FreeMotion) -> str:
    if motion.steady:
        return "steady"
    if motion.separatrix:
        return "separatrix"
    return f"about axis {state.names[motion.centre_axis]}"


def _writers(state: InitialState, motion: FreeMotion, table: MotionTable, content: dict[str, Any]) -> dict[str, Writer]:
    """How each option's file is written, with the provenance that its format can hold."""
    from rotor.cli.shared.output import plain

    units = state.units
    label = f"$t$ ({units.time})" if units.time else "$t$"
    kept = ("command", "input", "source", "units", "moments", "angular_momentum", "angular_momentum_source")
    provenance = {key: plain(content[key]) for key in kept if key in content}

    def rows(path: Path) -> None:
        import rotor

        rotor.write(table, path, settings=provenance)

    def plot(path: Path) -> None:
        from rotor.plots.polhodes import plot_polhodes

        inner = table.times / units.time_factor
        plot_polhodes(
            motion, inner, path, axis_names=state.names, time_label=label, time_factor=units.time_factor,
            title=_heading(state), provenance=provenance,
        )  # fmt: skip

    def film(path: Path) -> None:
        from rotor.plots.animation import animate

        inner = table.times / units.time_factor
        animate(
            motion, inner, path, atoms=state.atoms, axis_names=state.names, time_unit=units.time,
            time_factor=units.time_factor, provenance=provenance,
        )  # fmt: skip

    return {
        "--csv": rows,
        "--parquet": rows,
        "--plot": plot,
        "--gif": film,
    }


def _heading(state: InitialState) -> str:
    from rotor.cli.shared.report import KINDS, heading

    if state.top is not None:
        return heading(state.top)
    name = KINDS[_kind(state.moments)].replace("linear molecule", "linear body")
    return f"moments {_numbers(state.moments)}: {name}"


def _show(state: InitialState, table: MotionTable, content: dict[str, Any]) -> None:
    print(f"{_heading(state)}, turning freely")
    show_facts(_facts(state, content))
    print()
    show_table(_axes_table(state, content))
    print()
    show_table(_motion_table(state, table))


def _facts(state: InitialState, content: dict[str, Any]) -> list[tuple[str, str]]:
    units, facts = state.units, []
    if state.top is not None:
        from rotor.cli.shared.report import with_source

        a, b, c = state.top.rotational_constants_mhz
        rigid = ", ".join(f"{n} {x:.10g}" for n, x in zip("ABC", (a, b, c), strict=True) if math.isfinite(x))
        facts.append(("rigid top", with_source(f"{rigid} MHz, distortion neglected", state.top.source)))
    size = f"{content['angular_momentum_size']:.8g}{_unit(units.angular_momentum)}"
    vector = f"({_numbers(content['angular_momentum'])})"
    ratio, growth = content["separatrix_ratio"], content["growth_rate"]
    facts += [
        ("|L|", f"{size}, {vector} in the body: {state.momentum_source}"),
        ("energy", f"{content['energy']:.10g}{_unit(units.energy)}"),
        ("motion", _motion_text(state, content)),
        ("about L", f"turns by {content['turning_rate']:.8g} rad{_per(units.time)} on average, as space sees it"),
    ]
    if ratio is not None:
        low, _, high = sorted(zip(state.moments.tolist(), state.names, strict=True))
        where = f"|ω{high[1]}/ω{low[1]}| = {ratio:.8g} where L crosses the plane of these two axes"
        facts.append(("separatrix", where))
        facts.append(("growth rate", f"{growth:.8g}{_per(units.time)} off the intermediate axis"))
    facts += [
        ("chaos", content["chaos"]),
        ("times", content["times_source"]),
        ("kept", _drift_text(content["invariant_drift"])),
    ]
    return facts


def _motion_text(state: InitialState, content: dict[str, Any]) -> str:
    kind, unit = content["motion_kind"], _unit(state.units.time)
    if kind == "steady":
        return "steady: L stands still in the body"
    if kind == "separatrix":
        return "on the separatrix: L runs into the intermediate axis and does not come back"
    period = f"L goes round {kind.removeprefix('about ')} of the body in a period of {content['period']:.10g}{unit}"
    if len(set(state.moments.tolist())) < 3:
        return period
    middle = sorted(zip(state.moments.tolist(), state.names, strict=True))[1][1]
    return f"{period}; its component along axis {middle} changes sign every half of it"


def _drift_text(drift: dict[str, float]) -> str:
    return (
        f"energy to {drift['energy']:.1e}, |L| to {drift['momentum']:.1e}, L in space to "
        f"{drift['space_momentum']:.1e} of themselves: round-off, at every time asked for"
    )


def _axes_table(state: InitialState, content: dict[str, Any]) -> Table:
    """What becomes of a spin about each axis."""
    fates = {
        "stable": "a push oscillates",
        "unstable": "a push grows",
        "neutral": "a push drifts",
        "none": "no rotation about it",
    }
    rate, moment = f"rate (rad{_per(state.units.time)})", "moment" + (" (u Å²)" if state.top is not None else "")
    rows = [
        (a["axis"], f"{a['moment']:.8g}", a["kind"], f"{a['rate']:.8g}", fates[a["kind"]])
        for a in content["fixed_axes"]
    ]
    title = "spin about each axis, at this |L|"
    return Table(title, ("axis", moment, "kind", rate, ""), rows, frozenset({"axis", "kind", ""}))


def _motion_table(state: InitialState, table: MotionTable) -> Table:
    """Some rows of the motion, evenly chosen."""
    units, count = state.units, len(table)
    rows = sorted({round(i * (count - 1) / (SHOWN - 1)) for i in range(SHOWN)}) if count > SHOWN else range(count)
    columns = [f"t{_bracket(units.time)}", *(f"L{name}{_bracket(units.angular_momentum)}" for name in state.names)]
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
