"""The subjects of docs/accuracy.md: what is swept for each, mostly by the functions behind `rotor accuracy`, and what to choose."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from rotor.classical.integrators import splitting
from rotor.plots.work_precision import Panel, Point
from rotor.requests.knob import Knob, Measure, Setting, Sweep
from rotor.scenes.accuracy_sweep import in_rounds, points_of, sweep, sweeps_of, timed, without_scatter
from rotor.scenes.scene import Scene, make_scene, read_scene

sys.path.insert(0, str(Path(__file__).resolve().parent))

SCENES = Path(__file__).resolve().parents[1] / "examples" / "scenes"
LIMIT_SECONDS = 60.0  # of one knob
INDOLE = {"constants": "A=3877.826 B=1636.047 C=1150.8997 MHz", "dipole_abc": [1.376, 1.40, 0.0]}


@dataclass(frozen=True)
class Subject:
    """One picture. name: of its file. choose: the sentence that tells a user what to choose. panels: what is drawn; made when called,
    with the folder of reference files or None."""

    name: str
    title: str
    what: str
    choose: str
    panels: Callable[[Path | None], list[Panel]]


def curve(scene: Scene, knob: str, error_of: str | None = None) -> list[Point]:
    """The points of one knob of a scene."""
    return next(points for name, _, points in curves(scene, knob) if error_of in (None, name))


def curves(scene: Scene, knob: str) -> list[tuple[str, str, list[Point]]]:
    """The points of one knob of a scene for every error: what it is of, its unit, the points."""
    computed = next(item for item in sweeps_of(scene, SCENES)[0] if item.name == knob)
    rows, against, _, _ = sweep(computed, LIMIT_SECONDS)
    if "time limit" in against:
        raise ValueError(f"{knob}: {against}; the page needs the whole sweep")
    return [(m.of, m.unit, points_of([row for row in rows if row.error_of == m.of])) for m in computed.knob.measures]


def spectra() -> dict[str, Scene]:
    """Lists of lines: a light linear molecule, a heavy asymmetric one, a cold one."""
    complete = {"min_lgint": -12.0}
    return {
        "CO, 300 K": make_scene("spectrum", molecule="CO", observables=complete),
        "SO₂, 300 K": make_scene("spectrum", molecule="SO2", observables={"min_lgint": -8.0}),
        "CH₂OHCHO, 10 K": make_scene(
            "spectrum", molecule="CH2OHCHO", conditions={"temperature": "10 K"}, observables=complete
        ),
    }


def highest_j(_: Path | None) -> list[Panel]:
    return [
        Panel(
            "highest J of a list",
            "integrated intensity (%)",
            {n: curve(scene, "numerics.jmax") for n, scene in spectra().items()},
        )
    ]


def cut(_: Path | None) -> list[Panel]:
    computed = {name: curve(scene, "observables.min_lgint") for name, scene in spectra().items()}
    return [Panel("least intensity in a list, log10(nm² MHz)", "integrated intensity (%)", computed)]


def orders(shared: Path | None) -> list[Panel]:
    """Lines that a laboratory measured, of catalogues, beside the constants up to each order."""
    if shared is None:
        raise ValueError(
            "the orders of distortion are compared with measured lines: give --shared, the folder of reference files"
        )
    return [
        Panel(
            "order of centrifugal distortion",
            "a measured line, median (MHz)",
            {n: measured(n, shared) for n in ("SO2", "H2CS", "HCONH2", "CH3CN")},
        )
    ]


def measured(name: str, shared: Path) -> list[Point]:
    """Median difference from the measured lines of a catalogue inside the range that the constants are held against."""
    import rotor
    from rotor.formats.lines.line_tables import catalogue
    from rotor.formats.molecules.library import library_molecule
    from rotor.formats.spcat.compare import compare
    from rotor.formats.spcat.text.cat import read_cat
    from rotor.quantum.estimates.accuracy import order_of, to_order

    tag = library_molecule(name).catalogue
    paths = (shared / "reference" / folder / f"{tag.tag}.cat.gz" for folder in ("catalogues", "library_lines"))
    reference = read_cat(next(path for path in paths if path.exists()))
    seen = reference.take((reference.tag < 0) & (reference.quanta_upper[:, 0] <= tag.j_max))
    top, jmax = rotor.read(name), int(seen.quanta_upper[:, 0].max())
    points, calls = [], []
    for order in sorted({2, *(order_of(value, top) for value in top.constants.values)}):
        calls.append(partial(rotor.api.line_list, to_order(top, order), jmax=jmax, min_lgint=None, q=1.0))
        lines, seconds, _ = timed(calls[-1])
        comparison = compare(seen, catalogue(lines))
        points.append(Point(f"J^{order}", seconds, float(np.median(np.abs(comparison.differences("frequency_mhz"))))))
    times, _ = in_rounds(calls, [point.seconds for point in points])
    return [replace(point, seconds=seconds) for point, seconds in zip(points, times, strict=True)]


def evened(points: list[Point]) -> list[Point]:
    """The points with their times without what is scatter."""
    times = without_scatter([[point.seconds] for point in points])
    return [replace(point, seconds=seconds) for point, seconds in zip(points, times, strict=True)]


def partition(_: Path | None) -> list[Panel]:
    results = {}
    for name in ("CO", "water", "CH2OHCHO"):
        scene = make_scene("thermo", molecule=name, conditions={"temperature": [10.0, 100.0, 300.0]})
        results[name] = curve(scene, "numerics.relative_error", "Q")
    return [Panel("relative error asked for, at 10, 100 and 300 K", "Q (%)", results)]


def hyperfine(_: Path | None) -> list[Panel]:
    from bench_spins import METHODS, methods

    computed = {
        name: [Point(method, *solver[method], own=method == "exact") for method in METHODS]
        for name, solver in methods(3).items()
    }
    formamide = read_scene(SCENES / "formamide_hyperfine.toml")
    scene = make_scene("levels", molecule=formamide.molecule, effects=formamide.effects, observables={"jmax": 20})
    computed["formamide, N ≤ 20"] = curve(scene, "effects.hyperfine_method")
    return [Panel("method of hyperfine structure", "energy of a level (MHz)", computed, joined=False)]


def stark(_: Path | None) -> list[Panel]:
    results = {}
    for name, molecule in (("OCS", "OCS"), ("indole", INDOLE)):
        scene = make_scene("stark", molecule=molecule, conditions={"field": "0:200kV/cm:21"})
        results[f"{name}, 200 kV/cm"] = curve(scene, "numerics.jmax")
    return [Panel("highest J of the basis, states of J ≤ 2", "energy (MHz)", results)]


def pulse(_: Path | None) -> list[Panel]:
    from bench_alignment import work_precision

    settings = {
        "rotor": ("0.1", "0.01", "0.001", "1e-9", "1e-10"),
        "QuTiP vern7": ("1e-6", "1e-8", "1e-10", "1e-12"),
        "scipy expm_multiply": ("64 steps", "256 steps", "1024 steps", "4096 steps"),
    }
    single = {
        name: evened([Point(s, ms / 1e3, error) for s, (error, ms) in zip(settings[name], points, strict=True)])
        for name, points in work_precision().items()
    }
    thermal = curve(read_scene(SCENES / "ocs_alignment.toml"), "numerics.tolerance")
    return [
        Panel("OCS from J = 0, 50 fs, 4001 times", "⟨cos²θ⟩", single),
        Panel("OCS at 1 K, 1 ps: tolerance", "⟨cos²θ⟩", {"rotor": thermal}),
    ]


def free(_: Path | None) -> list[Panel]:
    from bench_work_precision import curves as methods

    results = {}
    for name, points in methods().items():
        if name.endswith(("order 2", "order 8", "Moser-Veselov 8", "DOP853")) or name.startswith("exact"):
            results[name] = evened([Point("", us * 1e-6, error) for us, error in points])
    return [Panel("after 1000 periods, time of one period", "attitude (rad)", results)]


def driven(_: Path | None) -> list[Panel]:
    complete = {
        "pendulum": "physical_pendulum",
        "gyrostat": "dual_spin_satellite",
        "chaos": "driven_chaos",
    }
    panel = {}
    for name, file in complete.items():
        scene = read_scene(SCENES / f"{file}.toml")
        few = replace_times(scene, 5)
        panel[name] = curve(few, "numerics.tolerance")
    pendulum = replace_times(read_scene(SCENES / "physical_pendulum.toml"), 5)
    splitting.WORTH_LOADING = 0  # short motions too run compiled, so that times differ by their steps alone
    split = {f"order {n}": curve(pendulum, f"numerics.step, order {n}") for n in (2, 4, 6, 8)}
    return [
        Panel("tolerance of a step", "attitude (rad)", panel),
        Panel("step of a splitting, a pendulum", "attitude (rad)", split),
    ]


def replace_times(scene: Scene, points: int) -> Scene:
    """The same motion looked at a few times only: a table with many rows makes the steps short by itself."""

    first, last, _ = scene.content["conditions"]["times"].split(":")
    when = {**scene.content["conditions"], "times": f"{first}:{last}:{points}"}
    return scene.replaced(conditions=when)


def liquid(electrostatics: str) -> Scene:
    """A small box of water."""
    return make_scene(
        "fluid",
        conditions={"model": "spce", "molecules": 216, "steps": 100},
        numerics={"electrostatics": electrostatics},
    )


def fluid_step(_: Path | None) -> list[Panel]:
    return [
        Panel("step (fs), 216 SPC/E molecules", f"{of} ({unit})", {"step": points})
        for of, unit, points in curves(liquid("reaction-field"), "numerics.step")
    ]


def ewald(_: Path | None) -> list[Panel]:
    tolerance = curve(liquid("ewald"), "numerics.ewald_tolerance")
    words = {"ewald": "Ewald's sum", "reaction-field": "a reaction field", "shifted": "shifted charges"}
    return [
        Panel("tolerance of Ewald's sum, 216 SPC/E molecules", "force (%)", {"tolerance": tolerance}),
        *(
            Panel(f"cutoff (Å) of {name}", "force (%)", {"cutoff": curve(liquid(method), f"numerics.cutoff, {method}")})
            for method, name in words.items()
        ),
    ]


def samples(_: Path | None) -> list[Panel]:
    times = {"times": "0:0.5:51"}
    scene = make_scene("gas", molecule="water", observables=times, numerics={"molecules": 10_000})
    knobs = [knob for knob in sweeps_of(scene)[0] if knob.name == "numerics.molecules"]
    panels = []
    for knob in knobs:
        rows, _, _, _ = sweep(knob, LIMIT_SECONDS)
        for m in knob.knob.measures:
            points = points_of([row for row in rows if row.error_of == m.of])
            label = f"{m.of} ({m.unit})" if m.unit else m.of
            panels.append(Panel("molecules of a gas of water, 300 K", label, {"molecules": points}))
    return panels


def fit(_: Path | None) -> list[Panel]:
    """Constants of a fit to 500 synthetic lines from a start 1 % off, after so many iterations, beside a fit with a tolerance of 1e-12."""
    from bench_fit import TRUE, lines_of

    from rotor.fitting.fit import FitOptions, fit_lines
    from rotor.fitting.parameters import parameters
    from rotor.fitting.result import Fit

    lines, rng = lines_of(TRUE, 500, jmax=20), np.random.default_rng(1)
    start = TRUE.replace(**{name: value * (1 + 0.01 * rng.uniform(-1, 1)) for name, value in TRUE.values.items()})
    free_constants = parameters(start, list(TRUE.values))

    def answer(options: FitOptions) -> Fit:
        return fit_lines(lines, start, free_constants, options)

    def error(fit: Fit, reference: Fit) -> float:
        return max(
            abs(fit.constants[name] - reference.constants[name]) / reference.constants.uncertainties[name]
            for name in TRUE.values
        )

    usual = len(answer(FitOptions()).minimum.iterations)
    settings = tuple(
        Setting(str(count), FitOptions(tolerance=1e-12, most_iterations=count), count == usual)
        for count in (1, 3, 5, 6, 7, 8, 9)
    )
    measures = (Measure("constants", "standard errors", error),)
    knob = Sweep(Knob(key="iterations", measures=measures), settings, FitOptions(tolerance=1e-12), "1e-12", answer)
    rows, _, _, _ = sweep(knob, LIMIT_SECONDS)
    return [
        Panel("iterations of a fit, 500 lines, 15 constants", "a constant (standard errors)", {"fit": points_of(rows)})
    ]


SUBJECTS: Sequence[Subject] = (
    Subject(
        "levels",
        "Levels and J max",
        "The energies of one J are eigenvalues of whole blocks: no J max makes them better, and a list loses whole lines only. "
        "The part of the intensity that is left out, beside a J max 1.3 times higher:",
        "Leave `jmax` out: it is chosen from the cut, and then nothing of the intensity above the cut is missing.",
        highest_j,
    ),
    Subject(
        "cut",
        "Cut of a line list",
        "The part of the intensity that all lines below the cut hold together, beside a cut two decades lower.",
        "Each decade of the cut leaves out about a tenth of what the decade before did, and costs nothing to a half more time.",
        cut,
    ),
    Subject(
        "orders",
        "Orders of centrifugal distortion",
        "Constants of the library up to each order, beside lines measured in laboratories, inside the range that "
        "[measured_lines.md](validation/measured_lines.md) names.",
        "Take every order that the constants have, since fewer save milliseconds at the most; rigid constants alone miss these "
        "lines by 0.5 to 5 GHz.",
        orders,
    ),
    Subject(
        "partition",
        "Q(T)",
        "The error of the sum over levels that `relative_error` asks for, beside a sum to 1e-13.",
        "Leave `relative_error` at 1e-6: the error reached is below what is asked for, and more is a matter of milliseconds.",
        partition,
    ),
    Subject(
        "hyperfine",
        "Hyperfine structure: exact or not",
        "Largest error of a level by method, beside the exact one.",
        "Take `exact` with one nucleus, where it costs no more than an approximation; with several nuclei `auto` takes the "
        "cheapest that keeps a tolerance.",
        hyperfine,
    ),
    Subject(
        "stark",
        "Basis of a Stark map",
        "Largest error of an energy in fields up to 200 kV/cm by J max of the basis, beside six J more.",
        "Leave `jmax` out and give a tolerance: from some J on each J more gains one to two digits, and the smallest basis "
        "within the tolerance is chosen.",
        stark,
    ),
    Subject(
        "pulse",
        "Pulse propagation",
        "Largest error of ⟨cos²θ⟩, beside a tolerance a hundred times finer.",
        "Take the tolerance that the use needs and no J max: four digits more cost less than a factor of two in time.",
        pulse,
    ),
    Subject(
        "free",
        "Free tumbling",
        "Attitude of a free asymmetric top by integrators of the package and by scipy; the exact motion after 48,000 periods.",
        "Take the exact motion, as `rotor tumble` does: it is both the most accurate and the cheapest.",
        free,
    ),
    Subject(
        "driven",
        "Driven motion",
        "Attitude of driven bodies, compared at five times with steps to a hundred times finer than the finest.",
        "Give a tolerance rather than a step: three digits more cost about a factor of two. A splitting of order 6 or 8 "
        "needs less time still, where its compiled steps are loaded (they are from 4,000 substeps on).",
        driven,
    ),
    Subject(
        "fluid_step",
        "Step of a fluid",
        "A box followed for 48 fs without a thermostat, beside a step of 0.05 fs.",
        "2 fs conserves the energy of rigid water to 0.4 K for each degree of freedom; half the step has a quarter of the error.",
        fluid_step,
    ),
    Subject(
        "ewald",
        "Ewald's sum and cutoffs",
        "Root mean square error of the forces, beside Ewald's sum to 1e-10; for cutoffs, with Lennard-Jones to half of the box. "
        "A short cutoff of Ewald's sum needs more waves, which cost more than the pairs that it saves.",
        "Take Ewald's sum if forces matter to better than some percent. Its tolerance of 1e-5 is 0.01 % of the force; the reaction "
        "field and shifted charges at 9 Å differ by 3 to 4 %.",
        ewald,
    ),
    Subject(
        "samples",
        "Sample counts",
        "Root mean square error of eight gases for temperature and heat capacity; largest error of one gas for correlation functions.",
        "The error falls with the root of the number: a hundred times more molecules for each digit.",
        samples,
    ),
    Subject(
        "fit",
        "Iterations of a fit",
        "Largest distance of a constant, in its standard errors, from a fit with a tolerance of 1e-12; the ring is where the usual "
        "tolerance of 1e-4 ends.",
        "Leave the tolerance at 1e-4: the last steps of the search are quadratic, and constants are converged far below their errors.",
        fit,
    ),
)
