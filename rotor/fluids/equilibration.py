"""Equilibration of a box that starts from a lattice: a thermostat until energy and temperatures are stationary.

The box is run with a Langevin thermostat. After 1, 1.5, 2.25, ... times `SHORTEST_PS` the last half of the time is tested: potential
energy and both temperatures must show no trend (means of the two quarters differ by less than `LIMIT` standard errors of correlated
data, `rotor.statistics.equipartition.statistical_inefficiency`), and both temperatures must agree with the thermostat within the same
limit. For a run at constant energy the momenta are then scaled once, so that the energy equals the mean of that half. The temperature
then agrees with the thermostat within the error of the mean, not only within the fluctuations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.checks import RunStopped
from rotor.fluids.initial_box import at_rest
from rotor.fluids.run import Progress, make_dynamics, ns_per_day
from rotor.fluids.settings import Settings
from rotor.fluids.summary import series_mean
from rotor.units import EV_PER_K

if TYPE_CHECKING:
    from ase import Atoms

    from rotor.fluids.motion.dynamics import RigidDynamics

SHORTEST_PS, GROWTH, LONGEST_PS = 10.0, 1.5, 100.0
FRICTION_PER_PS = 5.0  # momenta are forgotten in 0.2 ps, well inside the shortest equilibration
ROW_FS = 20.0
LIMIT = 2.5  # standard errors
LEAST_SAMPLES = 5.0  # smallest number of independent values in a quarter
_NEW_STREAM = 20  # stream of random numbers, separate from that of the run


@dataclass(frozen=True)
class Equilibration:
    """Result of an equilibration.

    time_ps: length. stationary: whether the test was passed within `LONGEST_PS`. temperature_k, rotation_over_translation: means of the
    last half.
    """

    time_ps: float
    stationary: bool
    temperature_k: float
    rotation_over_translation: float

    @property
    def text(self) -> str:
        """The equilibration in words."""
        judged = "then stationary" if self.stationary else "not stationary yet: run longer before averages are taken"
        return f"equilibrated for {self.time_ps:.4g} ps under langevin ({FRICTION_PER_PS:g}/ps), {judged}"


def equilibration_range(time_ps: float | None) -> tuple[float, float]:
    """The shortest and the longest time (ps) of an equilibration of this length; None until the box is stationary."""
    return (SHORTEST_PS, LONGEST_PS) if time_ps is None else (time_ps, time_ps)


def equilibrate(
    atoms: Atoms, settings: Settings, time_ps: float | None = None, progress: Progress = lambda *_: None
) -> Equilibration:
    """Bring a box to the temperature of its settings, in place.

    Parameters
    ----------
    atoms : ase.Atoms
        Molecules with a calculator; missing momenta are drawn.
    settings : Settings
        Model, temperature, step and ensemble of the run that follows.
    time_ps : float, optional
        Length. Default: until the box is stationary.
    progress : callable, optional
        As for `run_fluid`.

    Returns
    -------
    Equilibration
    """
    bath = replace(
        settings, ensemble="langevin", friction_per_ps=FRICTION_PER_PS, seed=_other_seed(settings.seed), steps=0
    )
    dynamics = make_dynamics(atoms, bath)
    longest = LONGEST_PS if time_ps is None else time_ps
    rows: list[list[float]] = []
    aim = min(SHORTEST_PS, longest)
    dynamics.wrench()  # a failure at the first step is an error of the box
    while True:
        try:
            _advance(dynamics, bath, aim, rows, progress, longest)
        except (ValueError, FloatingPointError) as error:
            raise RunStopped(f"{error} (step {dynamics.nsteps + 1} of the equilibration)") from error
        stationary = is_stationary(np.array(rows), settings.temperature_k)
        if aim >= longest or (stationary and time_ps is None):
            break
        aim = min(aim * GROWTH, longest)
    half = np.array(rows)[len(rows) // 2 :]
    if settings.ensemble == "nve":
        _set_energy(atoms, dynamics, float(half[:, 3].mean()), settings.temperature_k)
    temperature = float(half[:, 1].mean()), float(half[:, 2].mean())
    count = dynamics.degrees.translation, dynamics.degrees.rotation
    return Equilibration(
        dynamics.nsteps * settings.step_fs * 1e-3,
        stationary,
        float(np.average(temperature, weights=count)) if count[1] else temperature[0],
        temperature[1] / temperature[0] if count[1] else math.nan,
    )


def is_stationary(rows: Floats, temperature_k: float) -> bool:
    """Whether potential energy and temperatures of translation and rotation, columns of (n, 3 or more), have settled in the last half."""
    half = rows[len(rows) // 2 :]
    first, second = half[: len(half) // 2], half[len(half) // 2 :]
    for k, target in enumerate((None, temperature_k, temperature_k)):
        if not np.isfinite(half[:, k]).all():
            continue  # rotations of atoms
        early, late = (series_mean("", "", part[:, k]) for part in (first, second))
        if not min(early.effective_samples, late.effective_samples) >= LEAST_SAMPLES:
            return False
        spread = math.hypot(early.error, late.error)
        if abs(early.mean - late.mean) > LIMIT * spread:
            return False
        if target is not None and abs((early.mean + late.mean) / 2 - target) > LIMIT * spread / 2:
            return False
    return True


def _advance(
    dynamics: RigidDynamics,
    settings: Settings,
    time_ps: float,
    rows: list[list[float]],
    progress: Progress,
    longest_ps: float,
) -> None:
    """Propagate to a time, with a row every `ROW_FS`: potential energy, both temperatures, total energy."""
    import time

    steps_per_row = max(round(ROW_FS / settings.step_fs), 1)
    steps, started, before = round(time_ps * 1e3 / settings.step_fs), time.perf_counter(), dynamics.nsteps
    while dynamics.nsteps < steps:
        dynamics.step()
        dynamics.nsteps += 1
        if dynamics.nsteps % steps_per_row == 0:
            heat, energy = dynamics.temperatures(), float(dynamics.atoms.get_potential_energy())
            rows.append([energy, heat.translation_k, heat.rotation_k, energy + dynamics.kinetic().total_ev])
            seconds = time.perf_counter() - started
            most = round(longest_ps * 1e3 / settings.step_fs)
            progress(dynamics.nsteps, most, ns_per_day(settings, dynamics.nsteps - before, seconds))


def _set_energy(atoms: Atoms, dynamics: RigidDynamics, energy_ev: float, temperature_k: float) -> None:
    """Remove the total momentum, and scale the momenta to the energy minus that of the total momentum (3/2 kT)."""
    bodies, state = dynamics.bodies, dynamics.state
    atoms.set_momenta(bodies.momenta(at_rest(bodies, state.momentum), state.angular, state.attitude))
    requested = energy_ev - 1.5 * EV_PER_K * temperature_k - float(atoms.get_potential_energy())
    kinetic = float(atoms.get_kinetic_energy())
    if requested > 0 and kinetic > 0:
        atoms.set_momenta(atoms.get_momenta() * math.sqrt(requested / kinetic))


def _other_seed(seed: int) -> int:
    """A seed for noise that is independent of the run."""
    return int(np.random.SeedSequence([seed, _NEW_STREAM]).generate_state(1)[0])
