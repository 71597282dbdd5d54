"""`rotor thermo`: partition function, energy, entropy and heat capacity of rotation, and of the ideal gas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import gas_layer as layer
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
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

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rotor.thermo import ThermoFunctions, VibrationalStates
    from rotor.tops.top import Top

TEMPERATURES_K = (
    5.0,
    10.0,
    20.0,
    50.0,
    100.0,
    150.0,
    200.0,
    298.15,
    300.0,
    400.0,
    500.0,
    600.0,
    700.0,
    800.0,
    900.0,
    1000.0,
)
SHOWN = 25  # rows of the table in the report
CLASSICAL_TOLERANCE = 0.01  # of the classical heat capacity, where quantum and classical are said to part

EXAMPLES = """\b
Examples:
  rotor thermo water
  rotor thermo water --temperature 10:1000K:100 --csv water.csv --plot water.png
  rotor thermo H2 --species ortho --temperature 5:300K:60 --plot ortho.png
  rotor thermo water --gas --pressure 1bar --vibration 1595,3657,3756 --temperature 298.15"""


def command(
    context: typer.Context,
    source: str | None = inputs.SOURCE,
    constants: str | None = inputs.CONSTANTS,
    temperature: str | None = typer.Option(
        None, metavar="GRID", help="Temperatures: 10:1000K:100 or 10,20,50 K; by default some from 5 to 1000 K."
    ),
    species: str = typer.Option(
        "equilibrium", metavar="NAME", help="equilibrium, normal (frozen), para, ortho, or a class of the spin weights."
    ),
    isotope: list[str] | None = inputs.ISOTOPE,
    spin_weights: str | None = inputs.SPIN_WEIGHTS,
    symmetry_tolerance: str | None = inputs.SYMMETRY_TOLERANCE,
    vibration: str | None = layer.VIBRATION,
    vibrational_states: str | None = layer.VIBRATIONAL_STATES,
    gas: bool = typer.Option(False, "--gas", help="Functions of the ideal gas too, with translation."),
    pressure: str | None = typer.Option(None, metavar="P", help="Of the ideal gas (bar; by default 1); with --gas."),
    csv: str | None = typer.Option(None, metavar="FILE", help="Write the table as CSV, in full precision."),
    parquet: str | None = typer.Option(None, metavar="FILE", help="Write the table as Parquet."),
    plot: str | None = typer.Option(None, metavar="FILE", help="Draw the heat capacity (.png, .pdf, .svg)."),
    json: str | None = inputs.JSON,
) -> None:
    """Rotational partition function, energy, entropy and heat capacity, quantum and classical."""
    temperatures = TEMPERATURES_K if temperature is None else inputs.temperatures("--temperature", temperature)
    if pressure is not None and not gas:
        raise ValueError("--pressure: is that of the ideal gas; give --gas too")
    pressure_bar = inputs.positive("--pressure", pressure or "1", "bar") if gas else None
    states = layer.vibrations(vibration, vibrational_states)
    files = _files(csv, parquet, plot, json)
    given = Input(source, constants, isotope or [], None, None, spin_weights, symmetry_tolerance=symmetry_tolerance)
    top = inputs.read_top(given)
    _refuse(top, species, gas)

    with answering():
        functions = _functions(top, temperatures, species, states, pressure_bar)
        content = _content(functions, given, context.obj)
    content["files"] = [str(path) for path in files.wanted.values()]
    text = lambda: json_with_rows(functions, "functions", content)  # noqa: E731
    deliver(files, _writers(functions, content), text, lambda: _show(functions, content))


def _files(csv: str | None, parquet: str | None, plot: str | None, json: str | None) -> Files:
    files = Files()
    files.ask("--csv", csv, (".csv",))
    files.ask("--parquet", parquet, (".parquet",))
    files.ask("--plot", plot, (".png", ".pdf", ".svg"))
    files.ask_json(json)
    return files


def _refuse(top: Top, species: str, gas: bool) -> None:
    """What this top cannot be asked for."""
    from rotor.thermo import species_names

    known = species_names(top)
    if species not in known:
        only = "; its levels are all of one nuclear-spin species" if len(known) == 1 else ""
        raise ValueError(f"--species: {species!r}: {top.name or 'this top'} has {', '.join(known)}{only}")
    if gas and top.mass_u is None:
        raise ValueError("--gas: the mass is not known, since bare constants have none; give a molecule")


def _functions(
    top: Top,
    temperatures: ArrayLike,
    species: str,
    vibrations: VibrationalStates | None,
    pressure_bar: float | None,
) -> ThermoFunctions:
    from rotor.thermo import thermodynamic_functions

    return thermodynamic_functions(
        top,
        temperatures,
        species=species,
        vibrations=vibrations,
        pressure_bar=pressure_bar,
        progress=sum_progress(),
    )


def _content(functions: ThermoFunctions, given: Input, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.cli.shared.report import describe
    from rotor.thermo import classical_above_k, classical_limit, rotational_temperatures_k, species_names

    top, limit = functions.top, classical_limit(functions.top)
    gas, vibrations = functions.gas, functions.vibrations
    return {
        **describe(top, given.text, command),
        "rotational_temperatures_k": rotational_temperatures_k(top),
        "classical_above_k": classical_above_k(top, CLASSICAL_TOLERANCE),
        "classical_tolerance": CLASSICAL_TOLERANCE,
        "classical_corrections": {"a_k": limit.a, "b_k2": limit.b, "d_per_k": limit.d, "e_per_k2": limit.e},
        "species": functions.species,
        "species_known": species_names(top),
        "fractions": dict(functions.fractions),
        "symmetry_number_counted": functions.symmetry_number,
        "spin_factor": functions.spin_factor,
        "jmax": int(functions.jmax.max()),
        "relative_error": float(functions.relative_error.max()),
        "vibrations": vibrations.text if vibrations is not None else None,
        "pressure_bar": gas.pressure_bar if gas is not None else None,
    }


def _writers(functions: ThermoFunctions, content: dict[str, Any]) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"]}

    def table(path: Path) -> None:
        import rotor

        rotor.write(functions, path, settings=provenance)

    def draw(path: Path) -> None:
        from rotor.plots.heat_capacity import Panel, curve_temperatures, name_of, plot_heat_capacity

        smooth = _functions(
            functions.top, curve_temperatures(functions.temperature_k), functions.species, functions.vibrations, None
        )
        label = "quantum" if functions.species == "equilibrium" else f"quantum, {functions.species}"
        plot_heat_capacity([Panel(name_of(functions.top), {label: smooth})], path, provenance=provenance)

    return {
        "--csv": table,
        "--parquet": table,
        "--plot": draw,
    }


def _show(functions: ThermoFunctions, content: dict[str, Any]) -> None:
    from rotor.cli.shared.report import heading

    print(heading(functions.top))
    show_facts(_facts(functions, content))
    print()
    show_table(_rotation_table(functions))
    if functions.gas is not None:
        print()
        show_table(_gas_table(functions))


def _facts(functions: ThermoFunctions, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.cli.shared import report

    top = functions.top
    weights = report.weights_text(content["spin_weights"])
    corrections = content["classical_corrections"]
    series = " ".join(
        f"{'-' if value < 0 else '+'} {abs(value):.6g}{unit}"
        for value, unit in zip(corrections.values(), ("/T", "/T²", " T", " T²"), strict=True)
        if value
    )
    return [
        ("constants", report.with_source(report.constants_text(top), top.source)),
        ("spin weights", report.with_source(weights, top.weights_source)),
        ("species", _species_text(functions, content)),
        ("Θ_rot", _theta_text(content["rotational_temperatures_k"])),
        (
            "classical Q",
            f"good to {CLASSICAL_TOLERANCE:.0%} of C_v above {content['classical_above_k']:.4g} K (rigid top, equilibrium)",
        ),
        ("corrected", f"classical Q times exp of the logarithm of 1 {series}, to that order"),
        ("sums", f"{_summed_to(content['jmax'])}, Q, U and C_v to {content['relative_error']:.0e} of themselves"),
        ("vibration", content["vibrations"] or "left out: no states given"),
    ]


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


def _summed_to(jmax: int) -> str:
    return f"to J = {jmax} at most" if jmax >= 0 else "none: classical with corrections"
