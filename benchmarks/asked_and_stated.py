"""40 scenes of all kinds that ask for an accuracy: asked, stated, actual, and what the next coarser setting would do.

    python benchmarks/asked_and_stated.py [--only NUMBER ...] [--page]

20 scenes are picked by hand, 20 are drawn from the seeds 0 to 19. The actual error is the difference from a calculation a hundred times
finer in every setting, or from a closed form in exact arithmetic (linear tops). "Coarser" is the same request with its setting one step
coarser: a tolerance ten times looser, one J less, half of the molecules; it must miss the accuracy, or be refused, or the scene must
say that nothing is cheaper. benchmarks/results/asked_and_stated.json and docs/validation/asked_and_stated.md are written; --page
measures nothing.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from rotor.scenes.run import run_scene, scene_calculation
from rotor.scenes.scene import parse_scene
from rotor.verbs.common.verb import verb_of

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "asked_and_stated.json"
PAGE = ROOT / "docs" / "validation" / "asked_and_stated.md"
FINER_J, QUANTILE = 12, 2.58

HEAD = """# Asked, stated, actual: 40 scenes

Made by `python benchmarks/asked_and_stated.py`. Scenes 1 to 20 are picked by hand, 21 to 40 are drawn with the seeds 0 to 19. "Stated" is
the numerical error of the result (of a gas the statistical one at its confidence), "actual" its difference from a calculation a hundred
times finer, or from exact arithmetic. "Coarser" is the setting one step coarser with the error that it states; "-" where nothing is
cheaper. Seconds are of the processor, the second of two runs, with the setting that was chosen and with the coarser one.

"""

PULSE = '[[pulses]]\nshape = "gaussian"\npeak = "{peak:g} W/cm2"\nfwhm = {fwhm:g}\n[conditions]\ntemperature = {kelvin:g}\npoints = 201\n'
BODY = "[body]\nmoments = {moments}\nangular_velocity = {omega}\n"
GRAVITY = '[[effects]]\neffect = "gravity about pivot"\nmass = 1.0\ncentre = {centre}\ngravity = [0.0, 0.0, -1.0]\n'
DRAG = '[[effects]]\neffect = "linear drag"\ncoefficients = {drag}\n'
TIMES = '[conditions]\ntimes = "0:{last:g}:21"\n'
EMISSION = (
    '[[molecules]]\nsource = "{name}"\ncolumn = {column:g}\n[conditions]\n'
    'range = "{low:g}:{high:g}GHz"\nexcitation = "{kelvin:g} K"\nwidth = "2 km/s"\n'
)
TORSION = 'molecule = "{name}"\n[observables]\nbond = "1-2"\npotential = "V3={barrier:g} cm-1"\n'
FIT = '[molecule]\nconstants = "B=57000 D=0.1 MHz"\n[lines]\nsource = "l.csv"\n[parameters]\nfree = ["B", "D"]\n'
LINES_OF_CO = (
    "frequency_mhz,error_mhz,j_upper,j_lower\n115271.2018,0.0005,1,0\n230538.0,0.0005,2,1\n345795.9899,0.0005,3,2\n"
    "461040.768,0.0005,4,3\n"
)


ARGON = (
    '[conditions]\nmodel = "argon"\nmolecules = 27\ndensity = 1.2\nsteps = 100\nevery = 1\ntemperature = "90 K"\n'
    '[numerics]\ncutoff = "4 Å"\n'
)
TOP = BODY.format(moments=[1.0, 1.0, 0.5], omega=[0.1, 0.0, 8.0]) + GRAVITY.format(centre=[0.0, 0.0, 1.0])


def named(name: str) -> str:
    return f'molecule = "{name}"\n'


PICKED: tuple[tuple[str, str, str], ...] = (
    ("levels", "1 Hz", named("CO") + "[observables]\njmax = 40\n"),
    ("levels", "1 kHz", named("HCONH2") + "[observables]\njmax = 3\n[effects]\nhyperfine = true\n"),
    ("spectrum", "1 kHz", named("OCS") + '[conditions]\ntemperature = "100 K"\n'),
    ("spectrum", "0.1 %", named("CO")),
    ("raman", "1 kHz", named("N2")),
    ("stark", "1 kHz", named("OCS") + '[conditions]\nfield = "0:100:11"\n'),
    ("stark", "1 MHz", named("H2CO") + '[conditions]\nfield = "0:200:5"\n'),
    ("stark", "1 Hz", named("OCS") + '[conditions]\nfield = "0:20:3"\n'),
    ("zeeman", "1 Hz", named("OCS") + "[magnetic]\ng = [-0.0287]\n[conditions]\nfield = [0.0, 5.0]\n"),
    ("thermo", "0.1 %", named("water") + '[conditions]\ntemperature = "10,100 K"\n'),
    ("thermo", "1e-6", named("CO") + '[conditions]\ntemperature = "5,50 K"\n'),
    ("align", "1e-3", named("OCS") + PULSE.format(peak=1e12, fwhm=0.5, kelvin=2)),
    ("align", "1e-5", named("CO") + PULSE.format(peak=1e13, fwhm=0.1, kelvin=5)),
    ("tumble", "1e-6 rad", BODY.format(moments=[1.0, 2.0, 2.5], omega=[1.0, 2.0, 3.0]) + TIMES.format(last=4)),
    ("tumble", "1e-6 rad", TOP + TIMES.format(last=10)),
    ("gas", "2 K", named("HCl")),
    ("emission", "1 mK", EMISSION.format(name="HCONH2", column=1e15, low=100, high=110, kelvin=50)),
    ("fit", "1 kHz", FIT),
    ("torsion", "1 kHz", TORSION.format(name="C2H6", barrier=1013)),
    ("fluid", "2 K", ARGON),
)  # fmt: skip


def drawn(seed: int) -> tuple[str, str, str]:
    """A scene of a seed."""
    rng = np.random.default_rng([27, 40, seed])
    kinds = ("stark", "thermo", "align", "tumble", "emission", "zeeman", "levels", "torsion", "fit", "stark")
    kind = kinds[seed % len(kinds)]
    if kind == "stark":
        field = 10 ** rng.uniform(0.5, 2.2)
        name = str(rng.choice(["OCS", "HCN", "H2CO", "SO2"]))
        return kind, f"{10 ** int(rng.integers(-3, 4))} kHz", named(name) + f'[conditions]\nfield = "0:{field:g}:5"\n'
    if kind == "zeeman":
        tensor = (
            f"[magnetic]\ng = [{-rng.uniform(0.01, 0.1):.4f}]\n[conditions]\nfield = [0.0, {rng.uniform(1, 10):g}]\n"
        )
        return kind, f"{10 ** int(rng.integers(0, 4))} Hz", named(str(rng.choice(["OCS", "HCN"]))) + tensor
    if kind == "thermo":
        kelvin = 10 ** rng.uniform(0, 2)
        return (
            kind,
            f"{10.0 ** -int(rng.integers(1, 8)):g}",
            (named(str(rng.choice(["CO", "water", "H2CO", "SO2"]))) + f'[conditions]\ntemperature = "{kelvin:g} K"\n'),
        )
    if kind == "align":
        pulse = PULSE.format(peak=10 ** rng.uniform(11, 13), fwhm=10 ** rng.uniform(-1, 0.3), kelvin=rng.uniform(0, 5))
        return kind, f"{10.0 ** -int(rng.integers(2, 6)):g}", named(str(rng.choice(["OCS", "CO", "N2"]))) + pulse
    if kind == "tumble":
        body = BODY.format(moments=sorted(rng.uniform(1, 2, 3).tolist()), omega=(2 * rng.normal(size=3)).tolist())
        force = (
            GRAVITY.format(centre=(0.3 * rng.normal(size=3)).tolist())
            if rng.random() < 0.5
            else DRAG.format(drag=rng.uniform(0.05, 0.3, 3).tolist())
        )
        return kind, f"{10.0 ** -int(rng.integers(2, 9)):g} rad", body + force + TIMES.format(last=rng.uniform(3, 20))
    if kind == "emission":
        low = rng.uniform(80, 200)
        return (
            kind,
            f"{10.0 ** -int(rng.integers(0, 5)):g} K",
            EMISSION.format(
                name=str(rng.choice(["CO", "HCONH2", "H2CO", "SO2"])),
                column=10 ** rng.uniform(13, 17),
                low=low,
                high=low + 10,
                kelvin=rng.uniform(10, 100),
            ),
        )
    if kind == "levels":
        return (
            kind,
            f"{10 ** int(rng.integers(0, 3))} Hz",
            named(str(rng.choice(["CO", "OCS"]))) + f"[observables]\njmax = {int(rng.integers(5, 60))}\n",
        )
    if kind == "torsion":
        return kind, "1 kHz", TORSION.format(name="C2H6", barrier=rng.uniform(50, 2000))
    return kind, f"{10 ** int(rng.integers(-1, 3))} kHz", FIT


@dataclass(frozen=True)
class Measured:
    """One scene. actual: None where no reference is. coarser: setting in words; coarser_error: stated by it, None where it is refused."""

    number: int
    kind: str
    asked: str
    chosen: str
    unit: str
    limit: float
    stated: float
    actual: float
    reference: str
    seconds: float
    coarser: str
    coarser_error: float | None
    coarser_seconds: float | None


Reference = tuple[float, str]


def maximum(value: Any, other: Any) -> float:
    return float(np.nanmax(np.abs(np.asarray(value) - np.asarray(other)), initial=0.0))


def reference_of(scene: Any, result: Any) -> Reference:
    """The actual error, and against what."""
    request, answer = result.request, result.answer
    return _REFERENCES[scene.kind](scene, request, answer)


def _levels(scene: Any, request: Any, answer: Any) -> Reference:
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.request import answer_levels

    levels = answer.table.levels if hasattr(answer, "table") else answer.lines.levels
    if any(effect.spins(request.top) for effect in request.effects):
        exact = answer_levels(replace(request, effects=effects_of(request.top, True, "exact"))).table.levels
        rows = [np.lexsort((table.energy_mhz, table.quanta["f"])) for table in (levels, exact)]
        return maximum(levels.energy_mhz[rows[0]], exact.energy_mhz[rows[1]]), "the exact method"
    assert request.top.kind == "linear"
    constants = {name: Fraction(value) for name, value in request.top.constants.values.items()}
    worst = Fraction(0)
    for j, energy in zip(levels.rotational.tolist(), levels.energy_mhz.tolist(), strict=True):
        x = Fraction(j * (j + 1))
        signs = {"B": 1, "D": -1, "H": 1, "L": 1}
        total = sum(
            (signs[name] * value * x**power for power, name in enumerate("BDHL", 1) if (value := constants.get(name))),
            Fraction(0),
        )
        worst = max(worst, abs(total - Fraction(energy)))
    return float(worst), "exact fractions"


def _intensities(scene: Any, request: Any, answer: Any) -> Reference:
    if scene_calculation(scene).accuracy.unit != "%":
        return _levels(scene, request, answer)
    levels, kelvin = answer.lines.levels, request.temperature_k
    from rotor.quantum.solve import solve_levels
    from rotor.units import MHZ_PER_K

    long = solve_levels(request.top, 400)
    q = float(np.sum(long.weight * long.states * np.exp(-long.energy_mhz / (kelvin * MHZ_PER_K))))
    return 100 * abs(
        answer.lines.q / q - 1
    ), f"a sum over {len(long)} levels instead of those of J up to {int(levels.rotational.max())}"


def _map(scene: Any, request: Any, answer: Any) -> Reference:
    finer = replace(request, tolerance_mhz=1e-9, jmax=answer.states.jmax + FINER_J)
    exact = verb_of(scene.kind).compute(finer)
    return maximum(answer.states.energy_mhz, exact.states.energy_mhz), f"J max {answer.states.jmax + FINER_J}"


def _thermo(scene: Any, request: Any, answer: Any) -> Reference:
    exact = verb_of(scene.kind).compute(replace(request, relative_error=1e-13))
    names = ("q_rot", "energy_j_per_mol", "cv_over_r")
    pairs = [[getattr(result.functions, name) for result in (answer, exact)] for name in names]
    return max(float(np.abs(a / b - 1).max()) for a, b in pairs), "sums to 1e-13"


def _align(scene: Any, request: Any, answer: Any) -> Reference:
    finer = replace(request, tolerance=1e-9, jmax=None)
    exact = verb_of(scene.kind).compute(finer)
    return maximum(answer.trace.cosines["cos2theta"], exact.trace.cosines["cos2theta"]), "a tolerance of 1e-9"


def _tumble(scene: Any, request: Any, answer: Any) -> Reference:
    from rotor.classical.driven import DrivenRequest, driven_motion
    from rotor.classical.step_errors import apart

    if isinstance(request, DrivenRequest):
        return apart(answer.motion, driven_motion(replace(request, step=None, tolerance=1e-14))), "steps to 1e-14"
    return exact_attitude_error(request, answer), "Euler's equations to 25 digits, by Taylor series"


def exact_attitude_error(request: Any, answer: Any) -> float:
    """The largest angle between the attitudes of a free body and those of its equations, solved to 25 digits."""
    import mpmath

    mpmath.mp.dps = 25
    moments = [mpmath.mpf(moment) for moment in request.moments]

    def slopes(_: Any, state: list[Any]) -> list[Any]:
        """dL/dt = L x ω in the body and dq/dt = q ω/2."""
        momentum, (w, x, y, z) = state[:3], state[3:]
        p, q, r = (component / moment for component, moment in zip(momentum, moments, strict=True))
        turning = [
            momentum[1] * r - momentum[2] * q,
            momentum[2] * p - momentum[0] * r,
            momentum[0] * q - momentum[1] * p,
        ]
        half = mpmath.mpf(1) / 2
        return [
            *turning, -half * (x * p + y * q + z * r), half * (w * p + y * r - z * q), half * (w * q + z * p - x * r),
            half * (w * r + x * q - y * p),
        ]  # fmt: skip

    solve = mpmath.odefun(
        slopes, 0, [*map(mpmath.mpf, request.angular_momentum), 1, 0, 0, 0], tol=mpmath.mpf(10) ** -22
    )
    worst = mpmath.mpf(0)
    for time_, computed in zip(answer.table.times.tolist(), answer.table.attitude.tolist(), strict=True):
        true = solve(mpmath.mpf(time_))[3:]
        same = 1 if mpmath.fdot(true, computed) > 0 else -1
        worst = max(
            worst,
            2 * mpmath.sqrt(sum((first - same * other) ** 2 for first, other in zip(true, computed, strict=True))),
        )
    return float(worst)


def _gas(scene: Any, request: Any, answer: Any) -> Reference:
    mean = request.temperature_k * np.mean([degree.mean for degree in answer.test.degrees])
    return abs(float(mean) - request.temperature_k), "equipartition; the stated error holds at a confidence of 0.99"


def _emission(scene: Any, request: Any, answer: Any) -> Reference:
    finer = replace(request, least_depth=1e-3 * request.least_depth)
    exact = verb_of(scene.kind).compute(finer)
    grid = exact.spectrum.frequency_mhz
    interpolated = np.interp(grid, answer.spectrum.frequency_mhz, answer.spectrum.brightness_k)
    return maximum(interpolated, exact.spectrum.brightness_k), "lines of a thousandth of the depth"


def _fit(scene: Any, request: Any, answer: Any) -> Reference:
    from rotor.formats.fits.fit_request import answer_fit

    exact = answer_fit(replace(request, options=replace(request.options, tolerance=1e-13)))
    return maximum(answer.fit.calculated_mhz, exact.fit.calculated_mhz), "a search to 1e-13"


def _torsion(scene: Any, request: Any, answer: Any) -> Reference:
    count = request.vmax + 1
    computed = [
        [answer.torsion.states(sigma, waves)[0][:count] for waves in (answer.waves, 2 * answer.waves)]
        for sigma in range(answer.torsion.fold // 2 + 1)
    ]
    return max(maximum(few, many) for few, many in computed), "twice as many functions"


def _fluid(scene: Any, request: Any, answer: Any) -> Reference:
    from rotor.fluids.numerics import conserved_k

    return conserved_k(answer), "root mean square of every step of the run about the mean"


_REFERENCES: dict[str, Callable[..., Reference]] = {
    "levels": _levels, "spectrum": _intensities, "raman": _levels, "stark": _map, "zeeman": _map, "thermo": _thermo, "align": _align,
    "tumble": _tumble, "gas": _gas, "emission": _emission, "fit": _fit, "torsion": _torsion, "fluid": _fluid,
}  # fmt: skip


def coarser_of(scene: Any, request: Any, answer: Any) -> tuple[str, Any] | None:
    """The request one step coarser, in words; None where nothing is cheaper."""
    if scene.kind in ("stark", "zeeman"):
        jmax = answer.states.jmax - 1
        return f"J max {jmax}", replace(request, jmax=jmax)
    if scene.kind == "align":
        jmax = answer.trace.jmax - 1
        return f"J max {jmax}", replace(request, jmax=jmax)
    if scene.kind == "thermo":
        value = 10 * request.relative_error
        return (f"relative error {value:g}", replace(request, relative_error=value)) if value <= 0.1 else None
    if scene.kind == "emission" and request.least_depth < 1:
        return f"least depth {10 * request.least_depth:g}", replace(request, least_depth=10 * request.least_depth)
    if scene.kind == "fit" and request.options.tolerance < 1:
        value = 10 * request.options.tolerance
        return f"tolerance {value:g}", replace(request, options=replace(request.options, tolerance=value))
    if scene.kind == "tumble" and hasattr(request, "tolerance") and request.tolerance < 1e-3:
        return f"tolerance {10 * request.tolerance:g}", replace(request, tolerance=10 * request.tolerance)
    if scene.kind == "gas":
        return f"{request.molecules // 2} molecules", replace(request, molecules=request.molecules // 2)
    if scene.kind == "fluid":
        step = 1.5 * request.settings.step_fs
        return f"a step of {step:.3g} fs", replace(request, settings=replace(request.settings, step_fs=step))
    return None


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    call()
    start = time.process_time()
    value = call()
    return time.process_time() - start, value


def measured(number: int, kind: str, goal: str, body: str, folder: Path) -> Measured:
    """One scene: run, compared with its reference and with the next coarser setting."""
    accuracy = goal if kind in ("align",) or (not goal[-1].isalpha() and "%" not in goal) else f'"{goal}"'
    (folder / "l.csv").write_text(LINES_OF_CO, encoding="utf-8")
    scene = parse_scene(f'schema = 1\nkind = "{kind}"\naccuracy = {accuracy}\n{body}')
    result = run_scene(scene, folder=folder, out=folder)
    reached = result.reached
    assert reached is not None
    answer_of = verb_of(scene.kind).compute
    seconds, _ = timed(lambda: answer_of(result.request))
    actual, against = reference_of(scene, result)
    coarse = None if "nothing cheaper" in reached.how else coarser_of(scene, result.request, result.answer)
    words, error, coarse_seconds = "-", None, None
    if coarse is not None:
        words, request = coarse
        try:
            coarse_seconds, answer = timed(lambda: answer_of(request))
            error = max(verb_of(kind).load_numerics().goals[reached.unit].error(answer), 0.0)
            if kind == "tumble":
                error = answer.errors.numerical
        except ValueError as reason:
            words += f": refused ({' '.join(str(reason).split())[:70]} ...)"
    return Measured(
        number, kind, goal, reached.how, reached.unit, reached.asked, reached.error, actual, against, seconds, words, error, coarse_seconds
    )  # fmt: skip


def verdict(row: Measured) -> str:
    """What does not hold, in words; empty where all does."""
    faults = []
    if row.actual > row.stated:
        faults.append("actual above stated")
    if row.stated > row.limit:
        faults.append("stated above asked")
    if row.coarser_error is not None and row.coarser_error <= row.limit:
        faults.append("coarser serves")
    return ", ".join(faults)


def page(rows: list[Measured]) -> str:
    lines = [
        "| scene | kind | asked | chosen | stated | actual | against | coarser states | seconds | |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        unit = f" {row.unit}".rstrip()
        coarser = row.coarser if row.coarser_error is None else f"{row.coarser}: {row.coarser_error:.1e}{unit}"
        seconds = f"{row.seconds:.2g}" + ("" if row.coarser_seconds is None else f", {row.coarser_seconds:.2g}")
        errors = f"{row.stated:.1e}{unit} | {row.actual:.1e}{unit}"
        cells = (row.number, row.kind, row.asked, row.chosen, errors, row.reference, coarser, seconds, verdict(row))
        lines.append(f"| {' | '.join(map(str, cells))} |")
    bounds = sum(row.actual <= row.stated for row in rows)
    wasteful = [row for row in rows if "coarser serves" in verdict(row)]
    ratios = [row.stated / max(row.actual, 1e-300) for row in rows if row.actual > 0]
    summary = (
        f"\nStated is above actual in {bounds} of {len(rows)} scenes; the median of stated over actual is {np.median(ratios):.2g}. In "
        f"{len(wasteful)} the next coarser setting would have served"
        + (f": {', '.join(str(row.number) for row in wasteful)}.\n" if wasteful else ".\n")
    )
    return HEAD + "\n".join(lines) + "\n" + summary


def main() -> None:
    import tempfile

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", type=int, nargs="*", default=[])
    parser.add_argument("--page", action="store_true")
    options = parser.parse_args()
    if not options.page:
        scenes = [*PICKED, *(drawn(seed) for seed in range(20))]
        rows = []
        with tempfile.TemporaryDirectory() as folder:
            for number, scene in enumerate(scenes, 1):
                if options.only and number not in options.only:
                    continue
                rows.append(measured(number, *scene, Path(folder)))
                print(rows[-1], verdict(rows[-1]), flush=True)
        if options.only:
            return
        RESULTS.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    content = [Measured(**row) for row in json.loads(RESULTS.read_text(encoding="utf-8"))]
    PAGE.write_text(page(content), encoding="utf-8")


if __name__ == "__main__":
    main()
