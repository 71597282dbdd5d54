"""Settings of a run of a fluid: box, potential, ensemble, length; the same for every engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Custom, Quantity, Text, Whole

ENSEMBLES = ("nve", "langevin", "nose-hoover")
ELECTROSTATICS = ("reaction-field", "ewald", "shifted")


def _read_model(text: Any) -> str:
    from rotor.fluids.forces.models import find_model

    for name in str(text).split(","):
        find_model(name.strip())
    return str(text)


LARGEST = 1e30  # powers of larger settings overflow


@dataclass(frozen=True)
class Settings:
    """Settings of a run, without the atoms.

    model: name in `models.MODELS`, or several joined by commas for a mixture. ensemble: nve, langevin or nose-hoover.
    temperature_k: of the thermostat and of the starting velocities. step_fs, steps: of the integrator. every: steps
    between rows of the table. cutoff_angstrom: of Lennard-Jones and of charges in real space. electrostatics:
    reaction-field, ewald (PME in external engines) or shifted. ewald_tolerance: error of a force relative to e²/4πε0 Å², see
    `rotor.fluids.forces.ewald.parameters_for`. friction_per_ps: of the Langevin thermostat. relaxation_fs: time
    constant of Nosé-Hoover chains. seed: of velocities and noise.
    """

    model: str = declared(
        "spce",
        Custom(_read_model, metavar="NAME"),
        "Rigid model; several joined by commas",
        "conditions.model",
        common=True,
    )
    ensemble: str = declared(
        "nve", Text(ENSEMBLES, "NAME"), "nve, langevin or nose-hoover", "conditions.ensemble", common=True
    )
    temperature_k: float = declared(
        298.15,
        Quantity("K", above=0, metavar="T"),
        "Temperature of the thermostat and of the initial velocities (K)",
        "conditions.temperature",
        common=True,
    )
    step_fs: float = declared(
        2.0, Quantity("fs", above=0, most=LARGEST, metavar="T"), "Length of a step (fs)", "numerics.step", common=True
    )
    steps: int = declared(1000, Whole(0), "Number of steps", "conditions.steps", common=True)
    every: int = declared(10, Whole(1), "Steps between rows", "conditions.every", common=True)
    cutoff_angstrom: float = declared(
        9.0,
        Quantity("Å", above=0, most=LARGEST, metavar="R"),
        "Cutoff of Lennard-Jones and of real-space Coulomb forces (Å)",
        "numerics.cutoff",
    )
    electrostatics: str = declared(
        "reaction-field", Text(ELECTROSTATICS, "NAME"), "reaction-field, ewald or shifted", "numerics.electrostatics"
    )
    friction_per_ps: float = declared(
        1.0, Quantity("1/ps", above=0, most=LARGEST, metavar="F"), "Friction of langevin (1/ps)", "conditions.friction"
    )
    relaxation_fs: float = declared(
        100.0,
        Quantity("fs", above=0, most=LARGEST, metavar="T"),
        "Time constant of nose-hoover (fs)",
        "conditions.relaxation",
    )
    seed: int = declared(1, Whole(0), "Seed of the lattice, the velocities and the noise", "numerics.seed")
    ewald_tolerance: float = declared(
        1e-5,
        Quantity(above=1e-14, below=1),
        "Error of forces by ewald, relative to e²/4πε0 Å²",
        "numerics.ewald_tolerance",
    )

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def removed_degrees(self) -> int:
        """Degrees of freedom of the total momentum, which only langevin changes."""
        return 0 if self.ensemble == "langevin" else 3
