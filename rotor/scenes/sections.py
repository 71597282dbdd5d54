"""The tables of a scene file: molecule, effects, conditions, observables, numerics and outputs, kind by kind.

Each field carries its description, from which templates and the JSON Schema are made. A quantity is a number in the unit that the
description names, or a text with a unit of its own ("300 K"); a grid is a list of numbers or a text ("0:100kV/cm:21").
"""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import field

from rotor.verbs.subjects import molecule_section
from rotor.verbs.tables import Section, said

Quantity = float | str
Grid = list[float] | str


MoleculeSection: Any = molecule_section()


class QuantumEffects(Section, frozen=True):
    """What the Hamiltonian consists of besides the rigid rotor."""

    distortion: Annotated[bool, said("centrifugal distortion, as far as constants are there")] = True
    hyperfine: Annotated[bool | None, said("spins of nuclei; by default where spin_constants are given", True)] = None
    hyperfine_method: Annotated[
        str, said("exact, N-diagonal, first-order, or auto: the cheapest that keeps the tolerance")
    ] = "exact"
    hyperfine_tolerance: Annotated[Quantity, said("how far auto may be off exact lines (MHz)")] = "0.1 kHz"


class VibrationSection(Section, frozen=True):
    """Vibrational states that the partition function counts; one of the two."""

    fundamentals: Annotated[
        str | list[list[float]] | None,
        said("harmonic, with degeneracies (cm⁻¹); or pairs [energy, degeneracy]", "667.4x2,1388,2349"),
    ] = None
    states: Annotated[str | list[list[float]] | None, said("of single states, likewise (cm⁻¹)", "859,520x2")] = None


class BasisNumerics(Section, frozen=True):
    """Knobs; what is left out is chosen."""

    jmax: Annotated[int | None, said("highest J", 40)] = None


class TableOutputs(Section, frozen=True):
    """Files to write."""

    csv: Annotated[str | None, said("the table", "out.csv")] = None
    parquet: Annotated[str | None, said("the table", "out.parquet")] = None
    json: Annotated[str | None, said("the table", "out.json")] = None
    plot: Annotated[str | None, said("picture (.png, .pdf, .svg)", "out.png")] = None


class BodySection(Section, frozen=True):
    """A rigid body instead of a molecule, in any coherent units."""

    moments: Annotated[list[float], said("principal moments of inertia, in any order", [0.3, 0.35, 0.4])]
    units: Annotated[str, said('"SI" (kg m², s, J), or "" for any coherent set')] = ""
    angular_momentum: Annotated[list[float] | None, said("at time 0 in principal axes", [1.8, 0.4, -0.9])] = None
    angular_velocity: Annotated[list[float] | None, said("instead of the angular momentum", [0.1, 15.0, 0.1])] = None
    attitude: Annotated[list[float] | None, said("quaternion, body to space, at time 0", [1.0, 0.0, 0.0, 0.0])] = None


class TumbleNumerics(Section, frozen=True):
    """Knobs of a motion under effects; the free motion is exact."""

    tolerance: Annotated[float, said("of a step, relative to |L| and one radian")] = 1e-10
    step: Annotated[float | None, said("of a splitting, where no torque depends on the angular velocity", 0.01)] = None
    order: Annotated[int, said("of the splitting: 2, 4, 6 or 8")] = 4


class TumbleConditions(Section, frozen=True):
    """How the molecule starts, and when it is looked at."""

    temperature: Annotated[Quantity, said("whose thermal mean |L| is, half a degree off the middle axis (K)")] = "300 K"
    angular_momentum: Annotated[list[float] | None, said("instead, along a, b, c (ħ)", [10.0, 0.1, 0.1])] = None
    times: Annotated[Grid | None, said("ps of a molecule; by default two periods", "0:2:201")] = None


class FluidConditions(Section, frozen=True):
    """The liquid."""

    model: Annotated[str, said("rigid model, such as spce, tip4p2005, argon")] = "spce"
    molecules: Annotated[int | None, said("make a box of so many", 216)] = None
    density: Annotated[float, said("of the box that is made (g/cm³)")] = 0.997
    equilibration: Annotated[
        str, said("thermostat before the run of such a box: auto until stationary, 0 none (ps)")
    ] = "auto"
    box: Annotated[str | None, said("or a file with a box, counted from the scene's folder", "liquid.traj")] = None
    ensemble: Annotated[str, said("nve, langevin or nose-hoover")] = "nve"
    temperature: Annotated[Quantity, said("of the thermostat and of starting velocities (K)")] = "298.15 K"
    friction: Annotated[float, said("of langevin (1/ps)")] = 1.0
    relaxation: Annotated[Quantity, said("time constant of nose-hoover (fs)")] = "100 fs"
    steps: Annotated[int, said("how many steps")] = 1000
    every: Annotated[int, said("steps between rows")] = 10


class FluidNumerics(Section, frozen=True):
    """Knobs."""

    step: Annotated[Quantity, said("length of a step (fs)")] = "2 fs"
    cutoff: Annotated[Quantity, said("of Lennard-Jones and of charges in real space (Å)")] = "9 Å"
    electrostatics: Annotated[str, said("reaction-field, ewald or shifted")] = "reaction-field"
    ewald_tolerance: Annotated[float, said("of forces by ewald, relative to e²/4πε0 Å²")] = 1e-5
    seed: Annotated[int, said("of the lattice, the velocities and the noise")] = 1
    threads: Annotated[int, said("threads of the built-in potential, or of the engine")] = 1
    engine: Annotated[str, said("rotor, openmm or lammps")] = "rotor"


class FluidOutputs(Section, frozen=True):
    """Files that grow during the run."""

    csv: Annotated[str | None, said("rows as they come", "run.csv")] = None
    trajectories: Annotated[list[str], said("frames (.traj, .xyz, .extxyz)", ["run.traj"])] = field(
        default_factory=list
    )
    frames_every: Annotated[int | None, said("steps between frames; by default as every", 100)] = None
    checkpoint: Annotated[
        str | None, said("what a run needs to go on; one that is there is gone on from", "run.npz")
    ] = None
    checkpoint_every: Annotated[int, said("steps between checkpoints")] = 1000


class FieldEffects(Section, frozen=True):
    """What the Hamiltonian consists of besides the semi-rigid rotor and the field."""

    hyperfine: Annotated[bool | None, said("spins of nuclei; by default where spin_constants are given", True)] = None


class GaussianSection(Section, frozen=True, tag="gaussian", tag_field="shape"):
    """A Gaussian pulse."""

    peak: Annotated[Quantity, said("peak intensity (W/cm2)")]
    fwhm: Annotated[Quantity, said("full width at half maximum of the intensity (ps)")]
    centre: Annotated[Quantity, said("time of the peak (ps)")] = 0.0
    axis: Annotated[str | list[list[float]], said("z, x, y, circular, elliptical:R, or parts of a unit vector")] = "z"


class SwitchedSection(Section, frozen=True, tag="switched", tag_field="shape"):
    """A pulse that is switched on and off."""

    peak: Annotated[Quantity, said("peak intensity (W/cm2)")]
    rise: Annotated[Quantity, said("(ps)")]
    plateau: Annotated[Quantity, said("(ps)")]
    fall: Annotated[Quantity, said("(ps)")]
    start: Annotated[Quantity, said("(ps)")] = 0.0
    axis: Annotated[str | list[list[float]], said("as of a gaussian pulse")] = "z"


class KickSection(Section, frozen=True, tag="kick", tag_field="shape"):
    """A pulse without duration."""

    fluence: Annotated[Quantity, said("(J/cm2)")]
    time: Annotated[Quantity, said("(ps)")] = 0.0
    axis: Annotated[str | list[list[float]], said("as of a gaussian pulse")] = "z"


class TableSection(Section, frozen=True, tag="table", tag_field="shape"):
    """A pulse given by points."""

    times: Annotated[list[float], said("(ps)")]
    intensities: Annotated[list[float], said("(W/cm2)")]
    axis: Annotated[str | list[list[float]], said("as of a gaussian pulse")] = "z"


class FieldPulseSection(Section, frozen=True, tag="thz", tag_field="shape"):
    """A field on the permanent dipole."""

    peak: Annotated[Quantity, said("(kV/cm)")]
    fwhm: Annotated[Quantity, said("of the envelope (ps)")]
    frequency: Annotated[Quantity, said("(THz)")] = 0.0
    phase: Annotated[float, said("(rad)")] = 0.0
    centre: Annotated[Quantity, said("(ps)")] = 0.0


PulseSection = GaussianSection | SwitchedSection | KickSection | TableSection | FieldPulseSection


class AlignConditions(Section, frozen=True):
    """The gas, or one level, and the times."""

    temperature: Annotated[Quantity, said("of the gas, 0 for its lowest level (K)")] = "1 K"
    state: Annotated[dict[str, int] | None, said("one level instead", {"j": 1, "ka": 0, "kc": 1})] = None
    m: Annotated[int | None, said("|M| of that level; by default all alike", 0)] = None
    first_time: Annotated[Quantity | None, said("by default where the pulses begin (ps)", "-1 ps")] = None
    last_time: Annotated[Quantity | None, said("by default one revival after the pulses, or 100 ps (ps)", "100 ps")] = (
        None
    )
    points: Annotated[int, said("how many times")] = 2001


class AlignObservables(Section, frozen=True):
    """Which cosines."""

    cosines: Annotated[list[str], said("costheta, cos2theta, cos2theta_2d, cos_aZ, cos2_bX, ...")] = field(
        default_factory=lambda: ["cos2theta"]
    )
    classical_molecules: Annotated[int, said("also a classical gas of so many under the same pulses")] = 0


class AlignNumerics(Section, frozen=True):
    """Knobs."""

    tolerance: Annotated[float, said("of the cosines: steps, J max and populations follow from it")] = 1e-6
    jmax: Annotated[int | None, said("highest J of the basis; by default what the tolerance needs", 30)] = None
    seed: Annotated[int, said("of the classical gas")] = 1


class EmittingMolecule(MoleculeSection, frozen=True):  # type: ignore[misc,call-arg]
    """A molecule of the source; either `source` or `constants`."""

    column: Annotated[float, said("molecules in the line of sight (1/cm²)")] = 1e14
    excitation: Annotated[Quantity | None, said("instead of that of the conditions (K)", "50 K")] = None
    velocity: Annotated[float | None, said("likewise (km/s)", 5.6)] = None
    width: Annotated[float | None, said("likewise (km/s)", 2.0)] = None
    partition: Annotated[str | None, said("Q(T) of a .cat file: a catdir.cat or T=Q pairs", "300=108.87,75=27.46")] = (
        None
    )


class EmissionConditions(Section, frozen=True):
    """The source, and what of it is observed; range or band."""

    excitation: Annotated[Quantity, said("excitation temperature of rotation (K)")] = "100 K"
    background: Annotated[Quantity, said("temperature behind the source, as observed (K)")] = "2.725 K"
    filling: Annotated[float, said("part of the beam that the source fills")] = 1.0
    velocity: Annotated[float, said("receding positive, radio convention (km/s)")] = 0.0
    redshift: Annotated[float, said("of the source; velocities count from there")] = 0.0
    width: Annotated[float, said("full width of the lines at half maximum (km/s)")] = 1.0
    range: Annotated[str | None, said("first and last frequency observed (MHz)", "86:116GHz")] = None
    band: Annotated[str | None, said("a receiver's band instead: ALMA1 to ALMA10", "ALMA6")] = None


class EmissionObservables(Section, frozen=True):
    """Which lines."""

    least_depth: Annotated[float, said("optical depth at the centre below which a line is left out")] = 1e-6


class EmissionOutputs(Section, frozen=True):
    """Files to write."""

    csv: Annotated[str | None, said("the lines", "lines.csv")] = None
    parquet: Annotated[str | None, said("the lines", "lines.parquet")] = None
    json: Annotated[str | None, said("the lines", "lines.json")] = None
    profile_csv: Annotated[str | None, said("T_B and optical depth on a grid", "profile.csv")] = None
    plot: Annotated[str | None, said("picture (.png, .pdf, .svg)", "emission.png")] = None


def __getattr__(name: str) -> Any:
    """The structure of a table of a kind: `RamanConditions` is that of [conditions] of raman."""
    from rotor.scenes.structures import tables_of
    from rotor.verbs.verb import SCENE_VERBS, verb_of

    kind = next((one for one in SCENE_VERBS if name.startswith(one.capitalize())), "")
    tables = tables_of(verb_of(kind)) if kind else {}
    if (table := name.removeprefix(kind.capitalize()).lower()) not in tables:
        raise AttributeError(f"module 'rotor.scenes.sections' has no attribute {name!r}")
    return tables[table]
