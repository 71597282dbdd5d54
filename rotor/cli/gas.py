"""`rotor gas`: a classical gas of free molecules, tested for equipartition; its correlation functions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.output import Files, Table, Writer, deliver, json_text, rows_of, show_facts, show_table

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.classical.gas.ensembles import Correlations, Ensemble
    from rotor.statistics.equipartition import Equipartition
    from rotor.tops.top import Top

MOST_MOLECULES = 10_000_000
MOST_TIMES = 100_000
DEFAULT_TIMES = 101
SETTLED = 12.0  # root mean square turns, in radians, after which the correlation functions are shown no further
TESTED_AT_PS = 10.0
SHOWN = 11  # rows of the correlation functions in the report

EXAMPLES = """\b
Examples:
  rotor gas water --molecules 20000 --temperature 300 --seed 7 --json -
  rotor gas OCS --times 0:5:201 --csv ocs.csv --plot ocs.png"""


@dataclass(frozen=True)
class Settings:
    """What the options ask for; times in ps, None: no correlation functions."""

    molecules: int
    temperature_k: float
    seed: int
    confidence: float
    times_ps: Floats | None


@dataclass(frozen=True)
class Probes:
    """What C1 and C2 are of, and where that is from."""

    vector: Floats
    vector_source: str
    tensor: Floats
    tensor_source: str


def command(
    context: typer.Context,
    source: str | None = inputs.SOURCE,
    constants: str | None = inputs.CONSTANTS,
    molecules: int = typer.Option(20_000, metavar="N", help="How many are drawn."),
    temperature: str = typer.Option("300", metavar="T", help="Temperature (K)."),
    seed: int = typer.Option(1, metavar="N", help="Of the random numbers."),
    confidence: str = typer.Option("0.99", metavar="X", help="Of the test of equipartition."),
    times: str | None = typer.Option(
        None, metavar="GRID", help="Of the correlation functions: start:stop:count or a comma list (ps)."
    ),
    isotope: list[str] | None = inputs.ISOTOPE,
    dipole: str | None = inputs.DIPOLE,
    dipole_abc: str | None = inputs.DIPOLE_ABC,
    csv: str | None = typer.Option(None, metavar="FILE", help="Write the correlation functions as CSV."),
    parquet: str | None = typer.Option(None, metavar="FILE", help="Write the correlation functions as Parquet."),
    plot: str | None = typer.Option(None, metavar="FILE", help="Draw the test and the functions (.png, .pdf, .svg)."),
    json: str | None = inputs.JSON,
) -> None:
    """A classical gas of free molecules: equipartition, correlation functions."""
    inputs.whole("--molecules", molecules, 2, MOST_MOLECULES)
    inputs.whole("--seed", seed, 0)
    kelvin, sure = inputs.positive("--temperature", temperature, "K"), _confidence(confidence)
    asked = _times(times)
    files = Files()
    files.ask("--csv", csv, (".csv",))
    files.ask("--parquet", parquet, (".parquet",))
    files.ask("--plot", plot, (".png", ".pdf", ".svg"))
    files.ask_json(json)
    given = Input(source, constants, isotope or [], dipole, dipole_abc, None)
    top = inputs.read_top(given)
    probes = _probes(top)
    if asked is None and (csv or parquet or plot):
        asked = _settling_times(top, kelvin, probes)
    settings = Settings(molecules, kelvin, seed, sure, asked)

    gas, test = _tested(top, settings)
    curves = None if asked is None else _correlations(top, settings, probes)
    content = _content(top, given, context.obj, settings, gas, test, probes, curves)
    content["files"] = [str(path) for path in files.wanted.values()]
    writers = _writers(top, test, curves, content)
    deliver(files, writers, lambda: json_text(content), lambda: _show(top, test, curves, content))


def _confidence(text: str) -> float:
    value = inputs.quantity("--confidence", text, "")
    if not 0.0 < value < 1.0:
        raise ValueError(f"--confidence: {text!r}: a probability between 0 and 1 is wanted")
    return value


def _times(text: str | None) -> Floats | None:
    """The times asked for in ps."""
    if text is None:
        return None
    from rotor.cli.shared.tumble_inputs import Units, read_times

    times = read_times(text, Units(time="ps"))
    if times is not None and len(times) > MOST_TIMES:
        raise ValueError(f"--times: {text!r}: at most {MOST_TIMES} times in one run; ask for fewer")
    return times


def _probes(top: Top) -> Probes:
    """The dipole and the polarizability where they are known and turn, else the figure axis."""
    import numpy as np

    axis = 2 if top.kind == "oblate" else 0
    vector, vector_source = np.eye(3)[axis], f"axis {'abc'[axis]}, as there is no dipole that is known"
    if top.dipole_abc_debye is not None and any(top.dipole_abc_debye):
        vector, vector_source = np.array(top.dipole_abc_debye), "the dipole"
        vector = vector / np.linalg.norm(vector)
    tensor, tensor_source = np.outer(vector, vector), f"the second Legendre polynomial of {vector_source.split(',')[0]}"
    known = top.polarizability_abc_angstrom3
    if known is not None:
        alpha = np.array(known)
        if np.linalg.norm(alpha - np.trace(alpha) / 3 * np.eye(3)) > 1e-6 * np.linalg.norm(alpha):
            tensor, tensor_source = alpha, "the anisotropic polarizability"
    return Probes(vector, vector_source, tensor, tensor_source)


def _kt(temperature_k: float) -> float:
    from rotor.units import EV_PER_K

    return EV_PER_K * temperature_k


def _settling_times(top: Top, temperature_k: float, probes: Probes) -> Floats:
    import numpy as np

    from rotor.classical.gas.correlations import short_time
    from rotor.units import ASE_TIME_PS

    start = short_time(top.moments_u_angstrom2, _kt(temperature_k), probes.vector, probes.tensor)
    return np.linspace(0.0, SETTLED / math.sqrt(max(start.m2, start.n2 / 3)) * ASE_TIME_PS, DEFAULT_TIMES)


def _tested(top: Top, settings: Settings) -> tuple[Ensemble, Equipartition]:
    """The gas, drawn and moved, and the verdict on it."""
    import numpy as np

    from rotor.classical.gas.ensembles import thermal_ensemble
    from rotor.statistics.equipartition import equipartition
    from rotor.units import ASE_TIME_PS

    kt, rng = _kt(settings.temperature_k), np.random.default_rng(settings.seed)
    start = thermal_ensemble(top.moments_u_angstrom2, kt, settings.molecules, rng=rng, mass=top.mass_u)
    gas = start.moved(_tested_at(settings) / ASE_TIME_PS)
    return gas, equipartition(gas.kinetic, kt, confidence=settings.confidence)


def _tested_at(settings: Settings) -> float:
    return TESTED_AT_PS if settings.times_ps is None else float(settings.times_ps.max())


def _correlations(top: Top, settings: Settings, probes: Probes) -> Correlations:
    """C1 and C2, times in ps, of molecules of their own (another stream of the same seed)."""
    import os
    from concurrent.futures import ThreadPoolExecutor

    import numpy as np

    from rotor.classical.gas.ensembles import free_gas_correlations
    from rotor.units import ASE_TIME_PS

    times = settings.times_ps
    assert times is not None  # asked for by the caller
    rng = np.random.default_rng([settings.seed, 1])
    with ThreadPoolExecutor(os.cpu_count()) as pool, progress(settings.molecules, "molecules") as told:
        curves = free_gas_correlations(
            top.moments_u_angstrom2, _kt(settings.temperature_k), times / ASE_TIME_PS, vector=probes.vector,
            tensor=probes.tensor, molecules=settings.molecules, rng=rng, executor=pool, progress=told,
        )  # fmt: skip
    return replace(curves, times=times)


@contextmanager
def progress(total: int, what: str) -> Iterator[Callable[[int], object] | None]:
    """A bar on standard error that is told how many are done; None where it is no terminal."""
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


def _content(
    top: Top,
    given: Input,
    command: str,
    settings: Settings,
    gas: Ensemble,
    test: Equipartition,
    probes: Probes,
    curves: Correlations | None,
) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.cli.shared.report import describe
    from rotor.statistics.degrees_of_freedom import count_degrees
    from rotor.units import CM_PER_EV

    one = count_degrees([top.moments_u_angstrom2])
    ends = {"energy_cm": 0.5 * test.kt * CM_PER_EV, "expected_cm": 0.5 * test.kt * CM_PER_EV}
    return {
        **describe(top, given.text, command),
        "temperature_k": settings.temperature_k,
        "molecules": settings.molecules,
        "seed": settings.seed,
        "confidence": settings.confidence,
        "degrees_of_freedom": {
            "translation": one.translation,
            "rotation": one.rotation,
            "total": one.total,
            "gas": round(gas.kinetic.total),
        },
        "tested_at_ps": _tested_at(settings),
        "accepted": test.accepted,
        "p_value": test.p_value,
        "chi2": test.chi2,
        "chi2_degrees": test.chi2_degrees,
        "chi2_p": test.chi2_p,
        "ks_p": test.ks_p,
        "failing": list(test.failing),
        "degrees": [asdict(d) | ends | {"energy_cm": ends["expected_cm"] * d.mean} for d in test.degrees],
        **_about_curves(top, settings, probes, curves),
    }


def _about_curves(top: Top, settings: Settings, probes: Probes, curves: Correlations | None) -> dict[str, Any]:
    names = ("vector_abc", "vector_source", "tensor_source", "short_time_per_ps2", "c1_plateau", "correlation")
    if curves is None:
        return dict.fromkeys(names)
    from rotor.classical.gas.correlations import plateau, short_time
    from rotor.units import ASE_TIME_PS

    moments = top.moments_u_angstrom2
    start = short_time(moments, _kt(settings.temperature_k), probes.vector, probes.tensor)
    per_ps2 = {"c1": start.m2 / ASE_TIME_PS**2, "c2": start.n2 / ASE_TIME_PS**2}
    kept = plateau(moments, probes.vector)
    values = (probes.vector, probes.vector_source, probes.tensor_source, per_ps2, kept, rows_of(curves))
    return dict(zip(names, values, strict=True))


def _writers(top: Top, test: Equipartition, curves: Correlations | None, content: dict[str, Any]) -> dict[str, Writer]:
    kept = (
        "command", "input", "source", "temperature_k", "molecules", "seed", "vector_source", "tensor_source",
    )  # fmt: skip
    provenance = {key: content[key] for key in kept}

    def table(path: Path) -> None:
        import rotor

        rotor.write(curves, path, settings=provenance)

    def draw(path: Path) -> None:
        from rotor.plots.gas import plot_gas

        title = f"{_name(top)}, {content['temperature_k']:g} K, {content['molecules']:,} molecules"
        plot_gas(test, curves, path, title=title, plateau=content["c1_plateau"], provenance=provenance)

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _name(top: Top) -> str:
    from rotor.cli.shared.report import formula_of

    return top.name or formula_of(top) or f"{top.kind} top"


def _show(top: Top, test: Equipartition, curves: Correlations | None, content: dict[str, Any]) -> None:
    from rotor.cli.shared.report import heading

    print(f"{heading(top)}, a classical gas")
    show_facts(_facts(top, test, content))
    print()
    show_table(_degrees_table(content))
    if curves is not None:
        print()
        show_table(_curves_table(curves))


def _facts(top: Top, test: Equipartition, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.cli.shared.report import with_source

    a, b, c = top.rotational_constants_mhz
    rigid = ", ".join(f"{n} {x:.10g}" for n, x in zip("ABC", (a, b, c), strict=True) if math.isfinite(x))
    count = content["degrees_of_freedom"]
    drawn = f"{content['molecules']} molecules at {content['temperature_k']:g} K, seed {content['seed']}"
    left_out = "" if top.mass_u is not None else "; translations are left out, as the mass is not known"
    facts = [
        ("rigid top", with_source(f"{rigid} MHz, distortion neglected", top.source)),
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
