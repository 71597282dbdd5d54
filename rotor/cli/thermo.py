"""`rotor thermo`: partition function, energy, entropy and heat capacity of rotation, and of the ideal gas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import gas_layer, inputs
from rotor.cli.shared.gas_layer import Vibration
from rotor.cli.shared.hyperfine import HyperfineOptions, effects_asked
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import file_option, grouped, option
from rotor.cli.shared.output import (
    Files,
    Table,
    Writer,
    answering,
    deliver,
    json_with_rows,
    show_facts,
    show_table,
    sum_progress,
)
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.process import one_thread_of_blas
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.reports.sources import with_sources

if TYPE_CHECKING:
    from rotor.plots.view import View
    from rotor.thermodynamics import ThermoFunctions
    from rotor.thermodynamics.request import ThermoAnswer

SHOWN = 25  # rows of the table in the report

EXAMPLES = """\b
Examples:
  rotor thermo water
  rotor thermo water --temperature 10:1000K:100 --csv water.csv --plot water.png
  rotor thermo HCN --hyperfine --temperature 0.0001,0.001,0.01,0.1,1
  rotor thermo H2 --species ortho --temperature 5:300K:60 --plot ortho.png
  rotor thermo water --gas --pressure 1bar --vibration 1595,3657,3756 --temperature 298.15"""

NAMES = {"species": "--species", "temperatures_k": "--temperature", "pressure_bar": "--pressure"}


@dataclass(frozen=True)
class Options:
    """What is computed."""

    temperature: str | None = option(
        None, metavar="GRID", help="Temperatures: 10:1000K:100 or 10,20,50 K; by default some from 5 to 1000 K."
    )
    species: str = option(
        "equilibrium", metavar="NAME", help="equilibrium, normal (frozen), para, ortho, or a class of the spin weights."
    )
    gas: bool = option(False, "--gas", help="Functions of the ideal gas too, with translation.")
    pressure: str | None = option(None, metavar="P", help="Of the ideal gas (bar; by default 1); with --gas.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the table as CSV, in full precision.")
    parquet: str | None = file_option(".parquet", help="Write the table as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the heat capacity (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(given=("dipole", "dipole_abc", "state_dipoles", "calculator", "hessian"))
def command(
    context: typer.Context,
    given: Input,
    options: Options,
    spins: HyperfineOptions,
    vibration: Vibration,
    outputs: Outputs,
    picture: ViewOptions,
) -> None:
    """Rotational partition function, energy, entropy and heat capacity, quantum and classical."""
    one_thread_of_blas()
    from rotor.reports.top_facts import model_facts
    from rotor.thermodynamics.request import ThermoRequest, answer_thermo

    settings = _settings(options, vibration)
    files = Files.of(outputs)
    view = view_of(picture, files, "K")
    with inputs.fields_as_options(**NAMES):
        top = inputs.read_top(given)
        request = ThermoRequest(top, **settings, effects=effects_asked(top, spins, given.spin_constants))
    with answering():
        answer = answer_thermo(request, sum_progress())
        content = _content(answer, given, context.obj)
    content["files"] = files.names
    text = lambda: json_with_rows(answer.functions, "functions", content)  # noqa: E731
    deliver(
        files,
        _writers(answer, content, view) | save_scene("thermo", request, outputs, given),
        text,
        with_sources(
            lambda: _show(answer.functions, content),
            answer.functions.top,
            ("constants", "spin weights"),
            given.sources,
            lambda: model_facts(content),
        ),
    )


def _settings(options: Options, vibration: Vibration) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    if options.pressure is not None and not options.gas:
        raise ValueError("--pressure: is that of the ideal gas; give --gas too")
    settings: dict[str, Any] = {"species": options.species, "vibrations": gas_layer.vibrations_of(vibration)}
    if options.temperature is not None:
        settings["temperatures_k"] = tuple(inputs.temperatures("--temperature", options.temperature))
    if options.gas:
        settings["pressure_bar"] = inputs.positive("--pressure", options.pressure or "1", "bar")
    return settings


def _content(answer: ThermoAnswer, given: Input, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.reports.top_facts import begin

    return {**begin(command, given.text), **answer.facts()}


def _writers(answer: ThermoAnswer, content: dict[str, Any], view: View) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"]}

    def table(path: Path) -> None:
        """The table as a file."""
        import rotor

        rotor.write(answer.functions, path, settings=provenance)

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.heat_capacity import Panel, curve_temperatures, plot_heat_capacity
        from rotor.plots.picture import name_of_top
        from rotor.thermodynamics.request import answer_thermo

        request = answer.request
        grid = tuple(curve_temperatures(answer.functions.temperature_k).tolist())
        smooth = answer_thermo(replace(request, temperatures_k=grid, pressure_bar=None)).functions
        label = "quantum" if request.species == "equilibrium" else f"quantum, {request.species}"
        title = name_of_top(request.top) if view.title is None else view.title
        plot_heat_capacity([Panel(title, {label: smooth})], path, view=view, provenance=provenance)

    return {
        "--csv": table,
        "--parquet": table,
        "--plot": draw,
    }


def _show(functions: ThermoFunctions, content: dict[str, Any]) -> None:
    from rotor.reports.top_facts import heading

    print(heading(functions.top))
    show_facts(_facts(functions, content))
    print()
    show_table(_rotation_table(functions))
    if functions.gas is not None:
        print()
        show_table(_gas_table(functions))
    print()


def _facts(functions: ThermoFunctions, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.reports import top_facts as report

    top = functions.top
    corrections = content["classical_corrections"]
    series = " ".join(
        f"{'-' if value < 0 else '+'} {abs(value):.6g}{unit}"
        for value, unit in zip(corrections.values(), ("/T", "/T²", " T", " T²"), strict=True)
        if value
    )
    return [
        ("constants", report.constants_text(top)),
        *report.weights_facts(top, content["spin_weights"]),
        *(one for one in report.states_facts(top) if not one[1].startswith("dipole")),
        ("species", _species_text(functions, content)),
        ("Θ_rot", _theta_text(content["rotational_temperatures_k"])),
        ("classical Q", _onset_text(content["classical_tolerance"], content["classical_above_k"])),
        ("corrected", f"classical Q times exp of the logarithm of 1 {series}, to that order"),
        ("sums", f"{_summed_to(content['jmax'])}, Q, U and C_v to {content['relative_error']:.0e} of themselves"),
        *_spin_facts(content["hyperfine"]),
        ("vibration", content["vibrations"] or "left out: no states given"),
    ]


def _spin_facts(used: dict[str, Any] | None) -> list[tuple[str, str]]:
    """How many functions of spins Q counts, and where their splittings are in it."""
    if used is None:
        return []
    up_to, size = used["summed_up_to_k"], f"splittings of {used['splitting_mhz']:.2g} MHz"
    where = "too small to change them" if up_to is None else f"summed level by level up to {up_to:g} K"
    return [("hyperfine", f"Q counts {used['spin_functions']:.6g} functions of the spins; {size}, {where}")]


def _onset_text(tolerance: float, above_k: float | None) -> str:
    if above_k is None:
        return f"where it is good to {tolerance:.0%} of C_v is not known: no sum over levels reaches so far"
    return f"good to {tolerance:.0%} of C_v above {above_k:.4g} K (rigid top, equilibrium)"


def _summed_to(jmax: int) -> str:
    return f"to J = {jmax} at most" if jmax >= 0 else "none: classical with corrections"


def _species_text(functions: ThermoFunctions, content: dict[str, Any]) -> str:
    text = functions.species
    if functions.fractions:
        text += ", frozen: " + ", ".join(f"{name} {x:.4g}" for name, x in functions.fractions.items())
    others = [name for name in content["species_known"] if name != functions.species]
    return text + (f"; there are {', '.join(others)} too" if others else "; all levels are of one species")


def _theta_text(theta: Sequence[float]) -> str:
    known = [f"{name} {value:.6g}" for name, value in zip("ABC", theta, strict=True) if math.isfinite(value)]
    return ", ".join(known) + " K"


def _rows(functions: ThermoFunctions) -> list[int]:
    count = len(functions)
    return sorted({round(i * (count - 1) / (SHOWN - 1)) for i in range(SHOWN)}) if count > SHOWN else list(range(count))


def _rotation_table(functions: ThermoFunctions) -> Table:
    rows = _rows(functions)
    columns = ("T (K)", "Q", "Q classical", "Q corrected", "U (J/mol)", "S (J/mol K)", "Cv/R", "classical", "corrected")
    formats = ("{:g}", "{:.6g}", "{:.6g}", "{:.6g}", "{:.6g}", "{:.6g}", "{:.6f}", "{:.1f}", "{:.6f}")
    data = list(functions.columns.values())[: len(columns)]
    cells = [
        [form.format(x[i]) if math.isfinite(x[i]) else "-" for form, x in zip(formats, data, strict=True)] for i in rows
    ]
    few = "" if len(rows) == len(functions) else f", {len(rows)} of {len(functions)} temperatures"
    return Table(f"rotation{few}; U from the lowest level, S with nuclear spin as the weights count it", columns, cells)


def _gas_table(functions: ThermoFunctions) -> Table:
    gas = functions.gas
    assert gas is not None  # asked for by the caller
    data = (gas.cp_j_per_mol_k, gas.entropy_j_per_mol_k, gas.enthalpy_j_per_mol, gas.gibbs_j_per_mol_k)
    columns = ("T (K)", "Cp (J/mol K)", "S (J/mol K)", "H-H(0) (J/mol)", "-(G-H(0))/T (J/mol K)")
    cells = [[f"{functions.temperature_k[i]:g}", *(f"{x[i]:.3f}" for x in data)] for i in _rows(functions)]
    spin = f"R ln {functions.spin_factor:.6g} of nuclear spin left out of S and G"
    return Table(f"ideal gas at {gas.pressure_bar:g} bar, {gas.mass_u:.6f} u; {spin}", columns, cells)
