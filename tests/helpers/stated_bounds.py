"""Random requests of every kind with their stated numerical error, the actual one against a full reference, and the stated rounding.

A case is a function of a seed. Angles in rad, energies in MHz, Q relative, cosines as numbers, brightness and temperature in K.
"""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import mpmath
import numpy as np
from exact_rotation import DIGITS, Truth

import rotor
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

FINER_J = 12  # of the reference of a map, beyond the J max of the map
ETHANE = rotor.read("C2H6")
THERMAL = ("q_rot", "energy_j_per_mol", "cv_over_r")


class Case(NamedTuple):
    """stated: of rounding and truncation together. actual: the difference from the reference. floor: rounding of both, as stated."""

    stated: float
    actual: float
    floor: float


def rng_of(kind: int, seed: int) -> np.random.Generator:
    return np.random.default_rng([27, kind, seed])


def random_top(rng: np.random.Generator, linear: float = 0.25, **more) -> Top:
    """A linear top with this probability, else an asymmetric one, with a dipole along axes drawn at random."""
    c = rng.uniform(1e3, 9e3)
    b = c * rng.uniform(1.02, 2.0)
    if rng.random() < linear:
        polarizability = np.diag([6.0, 3.0, 3.0])
        constants, dipole = f"B={b} MHz", (rng.uniform(0.1, 4), 0.0, 0.0)
    else:
        polarizability = np.diag([8.0, 6.0, 3.0])
        present = rng.random(3) < 0.6
        dipole = tuple(np.where(present if present.any() else [True, False, False], rng.uniform(0.1, 4, 3), 0.0))
        constants = f"A={b * rng.uniform(1.02, 4.0)} B={b} C={c} MHz"
    return Top.from_constants(constants, dipole_abc_debye=dipole, polarizability_abc_angstrom3=polarizability, **more)


def driven(seed: int) -> Case:
    """Attitude of a heavy body with drag, against steps to 1e-14."""
    from rotor.classical.driven import DrivenRequest, answer_driven, driven_motion
    from rotor.classical.effects.drag import LinearDrag
    from rotor.classical.effects.gravity import GravityAboutPivot
    from rotor.classical.step_errors import apart

    rng = rng_of(3, seed)
    moments = np.sort(rng.uniform(0.5, 2.0, 3))
    moments[2] = min(moments[2], moments[0] + moments[1])
    weight = GravityAboutPivot(1.0, tuple(0.3 * rng.normal(size=3)), (0.0, 0.0, -1.0))
    drag = LinearDrag(rng.uniform(0.0, 0.3, 3))
    effects = [(weight,), (drag,), (weight, drag)][int(rng.integers(3))]
    times = np.linspace(0.0, 10 ** rng.uniform(0.0, 1.5), int(rng.choice([2, 5, 50])))
    settings = {"tolerance": 10 ** rng.uniform(-12, -3)}
    if effects == (weight,) and rng.random() < 0.5:
        settings = {"step": 10 ** rng.uniform(-2.5, -0.5), "order": int(rng.choice([2, 4, 6]))}
    omega = tuple(2.0 * rng.normal(size=3))
    body = tuple(rng.permutation(moments).tolist())
    request = DrivenRequest(body, tuple(times.tolist()), effects, angular_velocity=omega, **settings)
    answer = answer_driven(request)
    reference = driven_motion(replace(request, step=None, tolerance=1e-14))
    assert answer.errors.numerical is not None
    return Case(answer.errors.numerical, apart(answer.motion, reference), answer.errors.rounding.value)


def spins(seed: int) -> Case:
    """Energies with quadrupolar nuclei by an approximate method, against the exact one, in the order of each F."""
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.request import LevelsRequest, answer_levels

    rng = rng_of(4, seed)
    names = [["14N"], ["35Cl"], ["14N", "D"]][int(rng.integers(3))]
    constants = []
    for name in names:
        size = {"14N": 4.0, "35Cl": 60.0, "D": 0.2}[name]
        aa, difference = size * rng.uniform(-1, 1), size * rng.uniform(-1, 1)
        constants += [f"chi_aa({name})={aa}", f"chi_bb-cc({name})={difference}"]
        if rng.random() < 0.5:
            constants.append(f"chi_ab({name})={size * rng.uniform(-1, 1)}")
    top = replace(random_top(rng, linear=0.0), spin_constants=SpinConstants.parse(" ".join(constants) + " MHz"))
    method, jmax = str(rng.choice(["first-order", "N-diagonal", "auto"])), int(rng.integers(1, 5))
    tolerance = 10 ** rng.uniform(-5, 0)

    def answer(how: str):
        return answer_levels(LevelsRequest(top, jmax=jmax, effects=effects_of(top, True, how, tolerance)))

    computed, exact = answer(method), answer("exact")
    rows = [np.lexsort((item.table.levels.energy_mhz, item.table.levels.quanta["f"])) for item in (computed, exact)]
    energies = [item.table.levels.energy_mhz[row] for item, row in zip((computed, exact), rows, strict=True)]
    floor = computed.errors.rounding.value + exact.errors.rounding.value
    return Case(computed.errors.truncation.value + floor, float(np.abs(energies[0] - energies[1]).max()), floor)


def thermo(seed: int) -> Case:
    """Q, U and C_v at two temperatures, against sums to 1e-13."""
    from rotor.thermodynamics.request import ThermoRequest, answer_thermo

    rng = rng_of(5, seed)
    top = random_top(rng)
    kelvin = tuple(sorted((10 ** rng.uniform(-1.5, 2.0, 2)).tolist()))
    request = ThermoRequest(top, kelvin, relative_error=10 ** rng.uniform(-10, -1))
    answer, exact = answer_thermo(request), answer_thermo(replace(request, relative_error=1e-13))
    pairs = [(getattr(item.functions, name) for item in (answer, exact)) for name in THERMAL]
    actual = max(float(np.abs(computed / true - 1).max()) for computed, true in pairs)
    floor = answer.errors.rounding.value + exact.errors.numerical
    return Case(answer.errors.truncation.value + floor, actual, floor)


def field_map(seed: int) -> Case:
    """Energies in an electric field, against a larger basis."""
    from rotor.quantum.effects.stark import stark_map

    rng = rng_of(6, seed)
    top, j_highest = random_top(rng), int(rng.integers(0, 4))
    fields = np.linspace(0, 10 ** rng.uniform(0, 2.3), int(rng.choice([2, 3, 13, 41])))
    common = {"j_highest": j_highest, "m_values": (int(rng.integers(j_highest + 1)),), "most_at_edge": 1.0}
    states = stark_map(top, fields, tolerance_mhz=10 ** rng.uniform(-6, 3), **common)
    finer = stark_map(top, fields, tolerance_mhz=1e-9, jmax=states.jmax + FINER_J, **common)
    return _of_maps(states, finer)


def magnetic_map(seed: int) -> Case:
    """Energies in a magnetic field, against a larger basis."""
    from rotor.quantum.effects.zeeman import zeeman_map

    rng = rng_of(7, seed)
    top, j_highest = random_top(rng), int(rng.integers(0, 4))
    twice = [0.0, 1.0, 1.0] if top.kind == "linear" else [1.0, 1.0, 1.0]
    g = rng.normal(size=3 if top.kind != "linear" else 1) * 0.3
    tensors = {
        "g": list(g) if len(g) == 3 else [0.0, float(g[0]), float(g[0])],
        "magnetisability": list(-rng.uniform(20, 80) * np.array(twice)),
    }
    fields = np.linspace(0, 10 ** rng.uniform(0, 2.9), int(rng.choice([2, 5, 13])))
    common = {**tensors, "j_highest": j_highest}
    states = zeeman_map(top, fields, tolerance_mhz=10 ** rng.uniform(-6, 3), **common)
    finer = zeeman_map(top, fields, tolerance_mhz=1e-9, jmax=states.jmax + FINER_J, **common)
    return _of_maps(states, finer)


def _of_maps(states, finer) -> Case:
    """The case of the energy whose actual error is the largest part of the stated one."""
    floor = states.round_off_mhz + finer.round_off_mhz + finer.truncation_mhz
    stated, actual = states.truncation_mhz + floor, np.abs(states.energy_mhz - finer.energy_mhz)
    place = np.unravel_index(np.nanargmax(actual / stated), actual.shape)
    return Case(float(stated[place]), float(actual[place]), float(floor[place]))


def aligned(seed: int) -> Case:
    """cos²θ of a linear gas after a pulse, against a tolerance of 1e-9."""
    from rotor.alignment.pulse import GaussianPulse
    from rotor.alignment.request import AlignRequest, answer_align

    rng = rng_of(8, seed)
    tensor = ((8.0, 0, 0), (0, 4.0, 0), (0, 0, 4.0))
    top = Top.from_constants(f"B={rng.uniform(3e3, 3e4)} MHz", polarizability_abc_angstrom3=tensor)
    pulse = GaussianPulse(10 ** rng.uniform(11, 13.3), 10 ** rng.uniform(-1.5, 0.5))
    request = AlignRequest(
        top,
        (pulse,),
        float(rng.choice([0.0, 1.0, 4.0])),
        until_ps=60.0,
        points=101,
        tolerance=10 ** rng.uniform(-6, -1.5),
    )
    answer, exact = answer_align(request), answer_align(replace(request, tolerance=1e-9))
    actual = float(np.abs(answer.trace.cosines["cos2theta"] - exact.trace.cosines["cos2theta"]).max())
    floor = answer.errors.rounding.value + exact.errors.numerical
    return Case(answer.errors.truncation.value + floor, actual, floor)


def torsion(seed: int) -> Case:
    """Torsional levels of ethane with a barrier drawn at random, against three times as many functions."""
    from rotor.thermodynamics.torsion.request import TorsionRequest, answer_torsion

    rng = rng_of(10, seed)
    barrier = f"V3={10 ** rng.uniform(0, 4)} V6={rng.uniform(-50, 50)} cm-1"
    answer = answer_torsion(TorsionRequest(ETHANE, "1-2", barrier, vmax=int(rng.integers(0, 12))))
    count = answer.request.vmax + 1
    pairs = [
        [answer.torsion.states(item, waves)[0][:count] for waves in (answer.waves, 3 * answer.waves)] for item in (0, 1)
    ]
    actual = max(float(np.abs(few - many).max()) for few, many in pairs)
    floor = 10 * answer.errors.rounding.value  # the reference has nine times the kinetic energy
    return Case(answer.errors.truncation.value + floor, actual, floor)


def emission(seed: int) -> Case:
    """Brightness at the brightest line of CO or of a random top, against lines of any optical depth."""
    from rotor.spectra.emission.emitters import WEAKEST
    from rotor.spectra.emission.request import EmissionRequest, Source, answer_emission

    rng = rng_of(9, seed)
    top = random_top(rng, linear=0.5)
    source = Source(10 ** rng.uniform(12, 17), 10 ** rng.uniform(0.5, 2.0), 10 ** rng.uniform(-0.5, 1.0))
    low = rng.uniform(5e4, 1e5)
    request = EmissionRequest((top,), (source,), (low, low + 2e4), least_depth=10 ** rng.uniform(-6, -1))
    answer, exact = answer_emission(request), answer_emission(replace(request, least_depth=1e-12))
    grid = exact.spectrum.frequency_mhz
    interpolated = np.interp(grid, answer.spectrum.frequency_mhz, answer.spectrum.brightness_k)
    floor = answer.errors.rounding.value + exact.errors.rounding.value
    stated = answer.errors.truncation.value + floor
    uncounted = contrast(answer) * WEAKEST * request.least_depth  # K, of lines so weak that they are not computed
    return Case(stated, float(np.abs(interpolated - exact.spectrum.brightness_k).max(initial=0.0)), floor + uncounted)


def contrast(answer) -> float:
    """Brightness of an opaque layer at the frequency of the error budget, K."""
    from rotor.spectra.emission.emission import contrast_k

    request = answer.request
    frequency = np.mean(request.range_mhz) if answer.peak is None else answer.peak.observed_mhz
    return abs(float(contrast_k(frequency, request.sources[0])))


def fitted(seed: int) -> Case:
    """Constants fitted to noisy lines of an asymmetric top with a loose tolerance, in standard errors, against one of 1e-12."""
    from rotor.fitting.budgets import constants_budget
    from rotor.fitting.fit import FitOptions, fit_lines
    from rotor.fitting.parameters import parameters

    lines, start, names = fit_problem(rng_of(12, seed))
    free = parameters(start, names)
    tolerance = 10 ** rng_of(13, seed).uniform(-5, 0)
    fit = fit_lines(lines, start, free, FitOptions(tolerance=tolerance, poor_rms=1e9))
    exact = fit_lines(lines, start, free, FitOptions(tolerance=1e-12, poor_rms=1e9))
    budget, reference = constants_budget(fit), constants_budget(exact)
    floor = budget.rounding.value + reference.numerical
    actual = float(np.abs((fit.values - exact.values) / exact.errors).max())
    return Case(budget.truncation.value + floor, actual, floor)


def fit_problem(rng: np.random.Generator):
    """Lines of J up to 8 of a top with distortion, with noise of 10 kHz to 1 MHz; constants that are off by a percent; names to fit."""
    from rotor.fitting.assignment import assignments
    from rotor.tops.constants.constants import Constants

    c = rng.uniform(1e3, 5e3)
    b = c * rng.uniform(1.05, 1.6)
    true = {"A": b * rng.uniform(1.3, 4.0), "B": b, "C": c, "DeltaJ": 1e-3 * rng.uniform(0.2, 2.0)}
    top = Top.from_constants(Constants(**true), dipole_abc_debye=(1.0, 1.0, 0.0))
    lines = rotor.api.line_list(top, jmax=8, temperature_k=20.0)
    rows = rng.choice(len(lines), size=min(40, len(lines)), replace=False)
    names = ("j", "ka", "kc")
    labels = [
        np.array([lines.levels.quanta[name][states[rows]] for name in names]).T for states in (lines.upper, lines.lower)
    ]
    sigma = 10 ** rng.uniform(-2, 0)
    frequency = lines.frequency_mhz[rows] + sigma * rng.normal(size=len(rows))
    start = Constants(**{name: value * (1 + 0.01 * rng.normal()) for name, value in true.items()})
    return assignments(names, *labels, frequency, sigma), start, list(true)


def fluid(seed: int) -> Case:
    """Conserved energy of argon about its mean by the rows that are recorded, against every step of the same run."""
    from rotor.fluids.request import FluidRequest, NewBox, answer_fluid
    from rotor.fluids.settings import Settings

    rng = rng_of(11, seed)
    interval = int(rng.choice([1, 2, 5, 10]))
    settings = Settings(
        model="argon", temperature_k=rng.uniform(50, 200), step_fs=rng.uniform(5, 40), steps=20 * interval, every=interval,
        cutoff_angstrom=4.0, seed=seed,
    )  # fmt: skip
    request = FluidRequest(NewBox(27, rng.uniform(0.8, 1.4), 0.1), settings)
    answer, exact = answer_fluid(request), answer_fluid(replace(request, settings=replace(settings, every=1)))
    stated, actual = (item.errors.truncation.value for item in (answer, exact))
    return Case(stated, actual, answer.errors.rounding.value)


def free_body(rng: np.random.Generator) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Ascending moments and an angular momentum, one in five within 1e-9 of the unstable axis."""
    moments = np.sort(10 ** rng.uniform(-1, 1, 3))
    rates = rng.normal(size=3)
    if rng.random() < 0.2:
        rates[[0, 2]] *= 1e-9
    return tuple(moments.tolist()), tuple((moments * rates).tolist())


def tumble(seed: int) -> Case:
    """Attitude of a free body after up to 1e6 units of time, its axes in any cyclic order, against the closed form to 50 digits."""
    from rotor.classical.tumble import TumbleRequest, answer_tumble

    rng = rng_of(14, seed)
    moments, momentum = free_body(rng)
    times, shift = (0.0, 10 ** rng.uniform(-1, 6)), int(rng.integers(3))
    turned = [tuple(np.roll(numbers, shift).tolist()) for numbers in (moments, momentum)]
    answer = answer_tumble(TumbleRequest(*turned, times=times))
    with mpmath.workdps(DIGITS):
        true = Truth(moments, momentum).at(times[1])[1]
        scalar, *vector = answer.table.attitude[-1].tolist()
        actual = angle_apart(true, (scalar, *np.roll(vector, -shift).tolist()))
    return Case(answer.errors.numerical, actual, answer.errors.rounding.value)


def angle_apart(true, computed) -> float:
    """The angle between two attitudes, rad; the difference of quaternions that are close is half of it."""
    same = 1 if mpmath.fdot(true, computed) > 0 else -1
    return float(2 * mpmath.sqrt(sum((first - same * other) ** 2 for first, other in zip(true, computed, strict=True))))


def gas(seed: int) -> Case:
    """C1 and C2 of a few molecules against the closed form to 50 digits, or their temperature against exact sums, by turns."""
    from rotor.thermodynamics.gas.classical_gas import GasRequest, answer_gas

    rng = rng_of(15, seed)
    top, kelvin, count = random_top(rng, linear=0.0), 10 ** rng.uniform(0.5, 3), int(rng.integers(2, 6))
    times = (0.0, 10 ** rng.uniform(-1, 3)) if seed % 2 else None
    answer = answer_gas(GasRequest(top, count, kelvin, seed, times_ps=times))
    actual = temperature_apart(answer) if times is None else curves_apart(answer)
    return Case(answer.errors.numerical, actual, answer.errors.rounding.value)


def temperature_apart(answer) -> float:
    """Departure of the temperature from that of the molecules as they were drawn, summed as fractions, K."""
    from rotor.classical.gas.ensembles import thermal_ensemble

    request = answer.request
    top, rng = request.top, np.random.default_rng(request.seed)
    start = thermal_ensemble(top.moments_u_angstrom2, request.kt, request.molecules, rng=rng, mass=top.mass_u)
    moments = [Fraction(item) for item in top.moments_u_angstrom2]
    rows = start.momentum.tolist()
    energy = sum(Fraction(part) ** 2 / moment for row in rows for part, moment in zip(row, moments, strict=True))
    true = energy / (3 * request.molecules * Fraction(request.kt))
    computed = np.mean([degree.mean for degree in answer.test.degrees])
    return request.temperature_k * abs(float(Fraction(float(computed)) - true))


def curves_apart(answer) -> float:
    """Largest departure of C1 and C2 from those of the same molecules by their exact motion."""
    from rotor import units
    from rotor.classical.gas.ensembles import Probe, thermal_momenta

    request, probes = answer.request, answer.probes
    moments, curves = request.top.moments_u_angstrom2, answer.correlations
    (source,) = np.random.default_rng([request.seed, 1]).spawn(1)
    momenta, probe = (
        thermal_momenta(moments, request.kt, request.molecules, rng=source),
        Probe.from_tensors(probes.vector, probes.tensor),
    )
    with mpmath.workdps(DIGITS):
        late = mpmath.mpf(request.times_ps[1]) / mpmath.mpf(units.ASE_TIME_PS)
        vector = mpmath.matrix(probe.vector.tolist())
        tensor = mpmath.matrix((probe.axes.T @ np.diag(probe.beta) @ probe.axes).tolist())
        first = second = mpmath.mpf(0)
        for momentum in momenta:
            turn = matrix_of(Truth(tuple(moments), tuple(momentum)).at(late)[1])
            first += (vector.T * turn * vector)[0]
            rotated = turn * tensor * turn.T
            second += sum(tensor[i, k] * rotated[i, k] for i in range(3) for k in range(3))
        count = request.molecules
        return float(max(abs(first / count - float(curves.c1[1])), abs(second / count - float(curves.c2[1]))))


def matrix_of(quaternion):
    """The rotation of a unit quaternion, scalar first, to all digits."""
    w, x, y, z = quaternion
    return mpmath.matrix([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


CASES: dict[str, Callable[[int], Case]] = {
    "driven": driven, "spins": spins, "thermo": thermo, "field_map": field_map, "magnetic_map": magnetic_map, "aligned": aligned,
    "emission": emission, "torsion": torsion, "fluid": fluid, "fitted": fitted, "tumble": tumble, "gas": gas,
}  # fmt: skip
