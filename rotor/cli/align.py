"""`rotor align`: molecules aligned or oriented by pulses, quantum and classical."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.raman import with_polarizability
from rotor.cli.shared import inputs, pulse_inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.output import (
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

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.alignment.pulse import Pulse
    from rotor.arrays import Floats
    from rotor.table import Table as Columns
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor align OCS --pulse "1e13 W/cm2, 1 ps" --temperature 1 --until 200ps --plot ocs.png --csv ocs.csv
  rotor align --constants "B=6081.492 MHz" --anisotropy 4.04 --pulse "1e13 W/cm2, 50 fs"
  rotor align N2 --pulse "3e13 W/cm2, 0.1 ps" --pulse "3e13 W/cm2, 0.1 ps, 8.38 ps" --temperature 300 --classical 20000
  rotor align OCS --thz "500 kV/cm, 1 ps, 0.3 THz" --observable costheta"""

SHOWN = 12


@dataclass(frozen=True)
class Settings:
    """What the options ask for, in the units of the package."""

    pulses: tuple[Pulse, ...]
    temperature_k: float
    state: dict[str, int] | None
    m: int | None
    times_ps: Floats
    observables: tuple[str, ...]
    tolerance: float
    jmax: int | None
    classical: int
    seed: int


def command(
    context: typer.Context,
    source: str | None = inputs.SOURCE,
    constants: str | None = inputs.CONSTANTS,
    pulse: list[str] | None = pulse_inputs.PULSE,
    switched: list[str] | None = pulse_inputs.SWITCHED,
    kick: list[str] | None = pulse_inputs.KICK,
    pulse_table: str | None = pulse_inputs.PULSE_TABLE,
    thz: list[str] | None = pulse_inputs.THZ,
    polarization: str = pulse_inputs.POLARIZATION,
    temperature: str = typer.Option("1", metavar="T", help="Temperature (K); 0 is the lowest level."),
    state: str | None = typer.Option(
        None, metavar="LIST", help="One level instead of a temperature, such as j=0 or j=1,ka=0,kc=1."
    ),
    m: int | None = typer.Option(None, "--m", metavar="N", help="|M| of that level; by default all alike."),
    until: str | None = typer.Option(None, metavar="T", help="Last time (ps); by default one revival, or 100 ps."),
    start: str | None = typer.Option(None, "--from", metavar="T", help="First time (ps); by default where the pulses begin."),
    points: int = typer.Option(2001, metavar="N", help="How many times."),
    observable: list[str] | None = typer.Option(
        None, metavar="NAME", help="cos2theta (default), costheta, cos2theta_2d, cos2_aZ, cos_bX, ...; repeatable."
    ),
    polarizability: str | None = typer.Option(
        None, metavar="LIST", help="In principal axes: aa,bb,cc[,ab,ac,bc] or parallel,perpendicular (Å³)."
    ),
    anisotropy: str | None = typer.Option(
        None, metavar="X", help="α∥ - α⊥ of a linear or symmetric top (Å³), instead of --polarizability."
    ),
    dipole_abc: str | None = inputs.DIPOLE_ABC,
    tolerance: str = typer.Option("1e-6", metavar="X", help="Of the cosines: steps, J max and populations follow from it."),
    jmax: int | None = typer.Option(None, metavar="N", help="Highest J of the basis; by default what the tolerance needs."),
    classical: int = typer.Option(0, metavar="N", help="Also a classical gas of so many molecules under the same pulses."),
    seed: int = typer.Option(1, metavar="N", help="Of the classical gas."),
    isotope: list[str] | None = inputs.ISOTOPE,
    spin_weights: str | None = inputs.SPIN_WEIGHTS,
    csv: str | None = typer.Option(None, metavar="FILE", help="Write the cosines as CSV."),
    parquet: str | None = typer.Option(None, metavar="FILE", help="Write the cosines as Parquet."),
    plot: str | None = typer.Option(None, metavar="FILE", help="Draw the cosines (.png, .pdf, .svg)."),
    json: str | None = inputs.JSON,
) -> None:
    """Molecules aligned or oriented by pulses of light: cosines against time of a rotational wave packet."""
    inputs.whole("--points", points, 2, 1_000_000)
    inputs.whole("--jmax", jmax, 2)
    inputs.whole("--classical", classical, 0)
    inputs.whole("--seed", seed, 0)
    given_pulses = pulse_inputs.pulses(pulse or [], switched or [], kick or [], pulse_table, thz or [], polarization)
    files = Files()
    files.ask("--csv", csv, (".csv",))
    files.ask("--parquet", parquet, (".parquet",))
    files.ask("--plot", plot, (".png", ".pdf", ".svg"))
    files.ask_json(json)

    given = Input(source, constants, isotope or [], None, dipole_abc, spin_weights)
    top = _with_tensor(inputs.read_top(given), polarizability, anisotropy, given_pulses)
    settings = Settings(
        pulses=given_pulses,
        temperature_k=_temperature(temperature),
        state=None if state is None else inputs.option("--state", state, _state),
        m=m,
        times_ps=_times(top, given_pulses, start, until, points),
        observables=tuple(observable or ["cos2theta"]),
        tolerance=inputs.positive("--tolerance", tolerance, ""),
        jmax=jmax,
        classical=classical,
        seed=seed,
    )
    trace = _trace(top, settings)
    with answering():
        gas = _classical(top, settings)
    table = _joined(trace, gas)
    content = _content(trace, settings, given, context.obj, gas)
    content["files"] = [str(path) for path in files.wanted.values()]
    deliver(
        files,
        _writers(table, trace, gas, content),
        lambda: json_with_rows(table, "trace", content),
        lambda: _show(trace, gas, content),
    )


def _temperature(text: str) -> float:
    value = inputs.quantity("--temperature", text, "K")
    if value < 0:
        raise ValueError(f"--temperature: {text!r}: 0 K or more is expected")
    return value


def _state(text: str) -> dict[str, int]:
    out: dict[str, int] = {}
    for item in text.split(","):
        name, equals, number = (part.strip() for part in item.partition("="))
        if not equals or not number.isdecimal():
            raise ValueError(f"{item.strip()!r} in {text!r}: name=number is expected, such as j=1,ka=0,kc=1")
        out[name.lower()] = int(number)
    return out


def _with_tensor(top: Top, polarizability: str | None, anisotropy: str | None, pulses: tuple[Pulse, ...]) -> Top:
    if polarizability is not None and anisotropy is not None:
        raise ValueError("--polarizability and --anisotropy: give one of them")
    if anisotropy is not None:
        if top.kind not in ("linear", "prolate", "oblate"):
            raise ValueError(f"--anisotropy: {top.kind} tops have more than one number; give --polarizability aa,bb,cc")
        across = max(0.0, -inputs.quantity("--anisotropy", anisotropy, "Å3")) + 1.0  # the mean does not count
        return with_polarizability(top, f"{across + inputs.quantity('--anisotropy', anisotropy, 'Å3')!r},{across!r}")
    if polarizability is None and all(pulse.acts_on == "dipole" for pulse in pulses):
        return inputs.with_some_dipole(top)
    return with_polarizability(top, polarizability)


def _times(top: Top, pulses: tuple[Pulse, ...], start: str | None, until: str | None, points: int) -> Floats:
    import numpy as np

    from rotor.alignment.align import revival_period_ps

    begins, ends = min(pulse.window_ps[0] for pulse in pulses), max(pulse.window_ps[1] for pulse in pulses)
    first = begins if start is None else inputs.quantity("--from", start, "ps")
    long = 100.0 if top.kind == "asymmetric" else revival_period_ps(top)
    last = ends + long if until is None else inputs.quantity("--until", until, "ps")
    if not first < last:
        raise ValueError(f"--until: {last:g} ps is not after the first time, {first:g} ps")
    if last < ends:
        raise ValueError(f"--until: {last:g} ps is before the pulses have ended, at {ends:g} ps; give a later time")
    return np.linspace(first, last, points)


def _trace(top: Top, settings: Settings) -> AlignmentTrace:
    from rotor.alignment.align import align

    return align(
        top,
        settings.pulses,
        settings.times_ps,
        temperature_k=0.0 if settings.state is not None else settings.temperature_k,
        state=settings.state,
        m=settings.m,
        observables=settings.observables,
        tolerance=settings.tolerance,
        jmax=settings.jmax,
    )


def _classical(top: Top, settings: Settings) -> dict[str, Floats]:
    """Cosines of the classical gas by name, none where it was not asked for."""
    if not settings.classical:
        return {}
    import numpy as np

    from rotor.alignment.classical import classical_trace

    if settings.state is not None:
        note("the classical gas is at the temperature of --temperature, not in the level of --state")
    return classical_trace(
        top,
        settings.pulses,
        settings.times_ps,
        temperature_k=settings.temperature_k,
        molecules=settings.classical,
        observables=settings.observables,
        rng=np.random.default_rng(settings.seed),
    )


def _joined(trace: AlignmentTrace, gas: dict[str, Floats]) -> Columns:
    """The trace as a table, with columns of the classical gas where there is one."""
    from rotor.table import Table as Columns

    class Joined(Columns):
        @property
        def columns(self) -> dict[str, Floats]:
            return {**trace.columns, **{f"{name}_classical": values for name, values in gas.items()}}

        @property
        def facts(self) -> dict[str, Any]:
            return trace.facts

    return Joined()


def _content(
    trace: AlignmentTrace, settings: Settings, given: Input, command: str, gas: dict[str, Floats]
) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.cli.shared.report import describe

    return {
        **describe(trace.top, given.text, command),
        **trace.facts,
        "windows_ps": [list(pulse.window_ps) for pulse in trace.pulses],
        "populated_jmax": trace.ensemble.jmax,
        "error_estimate": trace.error_estimate,
        "permanent": trace.permanent,
        "extremes": [_extremes(name, trace.t_ps, values) for name, values in trace.columns.items() if name != "t_ps"],
        "classical_molecules": settings.classical,
        "classical_extremes": [_extremes(name, trace.t_ps, values) for name, values in gas.items()],
        "times": len(trace.t_ps),
    }


def _extremes(name: str, times: Floats, values: Floats) -> dict[str, Any]:
    import numpy as np

    high, low = int(np.argmax(values)), int(np.argmin(values))
    return {
        "name": name,
        "max": float(values[high]),
        "max_at_ps": float(times[high]),
        "min": float(values[low]),
        "min_at_ps": float(times[low]),
    }


def _writers(table: Columns, trace: AlignmentTrace, gas: dict[str, Floats], content: dict[str, Any]) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"]}

    def write(path: Path) -> None:
        import rotor

        rotor.write(table, path, settings=provenance)

    def draw(path: Path) -> None:
        from rotor.plots.alignment import plot_alignment

        title = ", ".join(filter(None, (trace.top.name, _ensemble_text(trace))))
        plot_alignment(trace, path, classical=gas, title=title, provenance={"command": provenance["command"]})

    return {"--csv": write, "--parquet": write, "--plot": draw}


def _ensemble_text(trace: AlignmentTrace) -> str:
    ensemble = trace.ensemble
    if ensemble.chosen is None:
        return f"{ensemble.temperature_k:g} K, {trace.states} states up to J = {ensemble.jmax}"
    level = ", ".join(f"{name} = {value}" for name, value in ensemble.chosen.items())
    return f"level {level}, " + ("all M" if ensemble.m is None else f"|M| = {ensemble.m}")


def _show(trace: AlignmentTrace, gas: dict[str, Floats], content: dict[str, Any]) -> None:
    from rotor.cli.shared.report import heading

    print(heading(trace.top))
    show_facts(_facts(trace, content))
    print()
    rows = [
        [one["name"] + suffix, f"{one['max']:.6f}", f"{one['max_at_ps']:.3f}", f"{one['min']:.6f}", f"{one['min_at_ps']:.3f}", mean]
        for suffix, list_of, means in (("", content["extremes"], True), (" (classical)", content["classical_extremes"], False))
        for one in list_of
        for mean in [f"{trace.permanent[one['name']]:.6f}" if means else ""]
    ]
    columns = ("cosine", "max", "at (ps)", "min", "at (ps)", "mean after")
    show_table(Table("", columns, rows, frozenset({"cosine"})))


def _facts(trace: AlignmentTrace, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.cli.shared import report

    top = trace.top
    pulses = "; ".join(_pulse_text(pulse) for pulse in trace.pulses)
    accuracy = (
        f"{content['error_estimate']:.1e} estimated: steps {trace.step_error:.1e}, leakage {trace.edge_population:.1e}, "
        f"left out {trace.ensemble.left_out:.1e} of the population"
    )
    return [
        ("constants", report.with_source(report.constants_text(top), top.source)),
        ("polarizability", report.with_source(report.tensor_text(top), top.polarizability_source)),
        ("pulses", pulses),
        ("gas", _ensemble_text(trace)),
        ("J max", str(trace.jmax)),
        ("method", f"{trace.method}, {sum(trace.steps)} steps"),
        ("accuracy", accuracy),
    ]


def _pulse_text(pulse: Pulse) -> str:
    first, last = pulse.window_ps
    what = {"dipole": "on the dipole", "polarizability": "on the polarizability"}[pulse.acts_on]
    return f"{type(pulse).__name__} {what}, {first:g} to {last:g} ps"
