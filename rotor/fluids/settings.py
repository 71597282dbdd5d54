"""Settings of a run of a fluid: box, potential, ensemble, length; the same for every engine."""

from __future__ import annotations

import math
from dataclasses import dataclass

ENSEMBLES = ("nve", "langevin", "nose-hoover")
ELECTROSTATICS = ("reaction-field", "ewald", "shifted")


LARGEST = 1e30  # of any number here: its powers are formed


@dataclass(frozen=True)
class Settings:
    """A run, apart from the atoms.

    model: name in `models.MODELS`, or several joined by commas for a mixture. ensemble: nve, langevin or nose-hoover.
    temperature_k: of the thermostat and of the starting velocities. step_fs, steps: of the integrator. every: steps
    between rows of the table. cutoff_angstrom: of Lennard-Jones and of charges in real space. electrostatics:
    reaction-field, ewald (PME in the engines) or shifted. ewald_tolerance: error of a force relative to e²/4πε0 Å², see
    `rotor.fluids.forces.ewald.parameters_for`. friction_per_ps: of Langevin's thermostat. relaxation_fs: time
    constant of Nosé-Hoover chains. seed: of velocities and noise.
    """

    model: str = "spce"
    ensemble: str = "nve"
    temperature_k: float = 298.15
    step_fs: float = 2.0
    steps: int = 1000
    every: int = 10
    cutoff_angstrom: float = 9.0
    electrostatics: str = "reaction-field"
    friction_per_ps: float = 1.0
    relaxation_fs: float = 100.0
    seed: int = 1
    ewald_tolerance: float = 1e-5

    def __post_init__(self) -> None:
        for name in ("temperature_k", "step_fs", "cutoff_angstrom", "friction_per_ps", "relaxation_fs"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value}: expected a number above 0")
            if value > LARGEST:
                raise ValueError(f"{name} = {value}: expected at most {LARGEST:g}; its powers overflow")
        if not 1e-14 < self.ewald_tolerance < 1.0:
            raise ValueError(f"ewald_tolerance = {self.ewald_tolerance}: expected a number between 1e-14 and 1")
        for name, least in (("steps", 0), ("every", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise ValueError(f"{name} = {getattr(self, name)}: expected at least {least}")
        if self.ensemble not in ENSEMBLES:
            raise ValueError(f"{self.ensemble!r} is no ensemble; there are {', '.join(ENSEMBLES)}")
        if self.electrostatics not in ELECTROSTATICS:
            raise ValueError(f"{self.electrostatics!r}: charges are treated by one of {', '.join(ELECTROSTATICS)}")
