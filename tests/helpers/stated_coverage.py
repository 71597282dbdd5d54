"""How often intervals from stated standard deviations cover the truth: of data (constants, dipoles, lines) and of samples.

Each entry of `COVERED` gives, for a seed, departures from the truth in stated standard deviations.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

DRAWS, CONFIDENCE, DEVIATIONS = 300, 0.95, 1.96
CO = Constants(B=57635.968, D=0.1835)
ROD = Constants(A=20000.0, B=6000.0, C=5000.0, uncertainties={"A": 20.0, "B": 0.5, "C": 0.5})
Departures = Callable[[int], list[float]]


def covered(name: str, draws: int = DRAWS) -> np.ndarray:
    """Which of the draws are within the interval of 95 %."""
    return np.concatenate([np.abs(COVERED[name](seed)) <= DEVIATIONS for seed in range(draws)])


def gas_temperature(seed: int) -> list[float]:
    """Of 100 molecules."""
    from rotor.thermodynamics.gas.classical_gas import GasRequest, answer_gas

    answer = answer_gas(GasRequest(Top(Constants(A=10e3, B=6e3, C=4e3)), molecules=100, seed=seed))
    departure = 300.0 * (np.mean([degree.mean for degree in answer.test.degrees]) - 1.0)
    return [departure / answer.errors.statistics.value]


def gas_curves(seed: int) -> list[float]:
    """C1 and C2 of 1000 linear molecules at one time, against their closed forms."""
    from rotor import units
    from rotor.classical.gas.correlations import linear_curves
    from rotor.thermodynamics.gas.classical_gas import GasRequest, answer_gas

    top, late = Top(CO, (0.1, 0.0, 0.0)), 0.3
    answer = answer_gas(GasRequest(top, molecules=1000, seed=seed, times_ps=(late,)))
    curves, moment = answer.correlations, top.moments_u_angstrom2[2]
    first, second = (float(item[0]) for item in linear_curves([late / units.ASE_TIME_PS], moment, answer.request.kt))
    departures = [(curves.c1[0] - first) / curves.c1_error[0], (curves.c2[0] - second) / curves.c2_error[0]]
    return [float(departure) for departure in departures]


@cache
def fitted(seed: int) -> tuple[list[float], list[float]]:
    """Departures of the constants and of the predicted lines of CO."""
    from rotor.fitting.assignment import assignments
    from rotor.fitting.fit import fit_lines
    from rotor.fitting.parameters import parameters

    j, sigma = np.arange(8), 0.01
    true = 2 * CO["B"] * (j + 1) - 4 * CO["D"] * (j + 1) ** 3
    frequency = true + sigma * np.random.default_rng([27, seed]).normal(size=len(j))
    fit = fit_lines(assignments(("j",), (j + 1)[:, None], j[:, None], frequency, sigma), CO, parameters(CO, ["B", "D"]))
    constants = (fit.values - [CO["B"], CO["D"]]) / fit.errors
    return constants.tolist(), ((fit.calculated_mhz - true) / fit.calculated_errors_mhz).tolist()


def moved(seed: int) -> Top:
    """A rod whose constants are drawn with their standard deviations."""
    rng = np.random.default_rng([27, 1, seed])
    drawn = {name: value + ROD.uncertainties[name] * rng.normal() for name, value in ROD.values.items()}
    return Top(Constants(**drawn), (1.0, 0.5, 0.0))


def energies(seed: int) -> list[float]:
    """Of the level that the constants leave most uncertain; J up to 5."""
    from rotor.quantum.request import LevelsRequest, answer_levels

    answer, place = least_known_level()
    other = answer_levels(LevelsRequest(moved(seed), jmax=5))
    departure = other.table.levels.energy_mhz[place] - answer.table.levels.energy_mhz[place]
    return [float(departure / answer.errors.data.value)]


@cache
def least_known_level():
    from rotor.quantum.estimates.budgets import known_covariance, level_errors
    from rotor.quantum.request import LevelsRequest, answer_levels

    top = Top(ROD, (1.0, 0.5, 0.0))
    answer = answer_levels(LevelsRequest(top, jmax=5))
    spread = level_errors(top, answer.table.levels, known_covariance(top, ("A", "B", "C")))
    return answer, int(np.argmax(spread))


def partition(seed: int) -> list[float]:
    """Q at 30 K, relative."""
    from rotor.thermodynamics.request import answer_thermo

    answer = cached_partition()
    other = answer_thermo(replace(answer.request, top=moved(seed)))
    return [float(np.log(other.functions.q_rot[0] / answer.functions.q_rot[0]) / answer.errors.data.value)]


@cache
def cached_partition():
    from rotor.thermodynamics.request import ThermoRequest, answer_thermo

    return answer_thermo(ThermoRequest(Top(ROD, (1.0, 0.5, 0.0)), (30.0,)))


DIPOLE = (2.0, 1.0, 0.0)


def stark_energies(seed: int) -> list[float]:
    """Of the state that an estimated dipole moves most, in 10 kV/cm."""
    from rotor.quantum.effects.stark import ESTIMATED_DIPOLE_D

    answer = stark_answer(1.0)
    place = np.nanargmax(np.abs(answer.states.field * answer.states.slope))
    relative = ESTIMATED_DIPOLE_D / np.linalg.norm(DIPOLE)
    other = stark_answer(1 + relative * np.random.default_rng([27, 2, seed]).normal())
    departure = other.states.energy_mhz.ravel()[place] - answer.states.energy_mhz.ravel()[place]
    return [float(departure / answer.errors.data.value)]


@cache
def stark_answer(scale: float):
    from rotor.quantum.effects.stark import StarkRequest, answer_stark

    constants = Constants(**ROD.values, uncertainties=dict.fromkeys(ROD.values, 1e-9))
    dipole = tuple(scale * item for item in DIPOLE)
    return answer_stark(StarkRequest(Top(constants, dipole, dipole_source="estimate"), (0.0, 10.0), j_highest=1))


COVERED: dict[str, Departures] = {
    "temperature of a gas of 100 molecules": gas_temperature,
    "C1 and C2 of a gas of 1000 molecules": gas_curves,
    "fitted constants": lambda seed: fitted(seed)[0],
    "predicted frequencies of a fit": lambda seed: fitted(seed)[1],
    "energies, by uncertain constants": energies,
    "Q, by uncertain constants": partition,
    "energies in a field, by an estimated dipole": stark_energies,
}
