"""Rotational Raman lines: Stokes and anti-Stokes shifts of all allowed transitions, and their cross sections.

    dσ/dΩ = (7/45) (2π ν_s)⁴ S (g_I/Q) exp(-E_i/kT),     ν_s = ν_laser - shift, in cm⁻¹

is the power scattered by one line per molecule, steradian and unit of irradiance, in cm²/sr. The laser is linearly polarised and
observed at right angles to its polarisation (which includes backscattering), with both polarisations of the scattered light
together; 4/7 of the light has the laser's polarisation, 3/7 the perpendicular one. It follows from the invariant γ² of randomly oriented
molecules, (45 a² + 4 γ²)/45 and 3 γ²/45 (D. A. Long, The Raman Effect, 2002, chapter 5; C. M. Penney, R. L. St. Peters and
M. Lapp, J. Opt. Soc. Am. 64, 712 (1974), who measured it for N2, O2 and CO2). S is defined in `raman_strengths`; its sum over
final states is (2J+1) γ². A photon count goes with ν_laser ν_s³ instead of ν_s⁴.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.convergence import warnings_of
from rotor.quantum.levels import Levels, TransitionTable
from rotor.quantum.solve import solve_levels
from rotor.spectra.intensity import JMAX_DEFAULT_LIMIT
from rotor.spectra.lines import line_partition
from rotor.spectra.raman.strengths import RamanTransitions, anisotropy_squared, raman_transitions
from rotor.thermodynamics.sums.partition import PartitionFunction, partition_function
from rotor.thermodynamics.vibration import VibrationalStates

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.components import Tensor
    from rotor.tops.top import Top


ANGSTROM6_IN_CM6 = 1e-48
NM_PER_CM = 1e7
LEAST_LASER_NM = 50.0  # shorter waves ionize every molecule; a smaller number is mostly in another unit
DEFAULT_LASER_NM = 532.0  # the doubled line of a Nd:YAG laser
DEFAULT_MIN_RELATIVE = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class RamanLines(TransitionTable):
    """Raman lines as columns of equal length, rising in shift.

    shift_mhz: (n,) laser frequency minus scattered frequency, positive for Stokes lines. strength_angstrom6: (n,) S over all
    components, equal for both directions. initial, final: (n,) rows of `levels`. weight: (n,) spin weight of one component.
    laser_nm: wavelength in vacuum. min_relative: cross section, relative to the strongest line, below which lines were left out.
    Other columns are computed on demand.
    """

    top: Top
    levels: Levels
    shift_mhz: Floats
    strength_angstrom6: Floats
    initial: Ints
    final: Ints
    weight: Floats
    temperature_k: float
    laser_nm: float
    min_relative: float
    partition: PartitionFunction

    def __len__(self) -> int:
        return len(self.shift_mhz)

    @property
    def jmax(self) -> int:
        """The highest J of the levels."""
        return self.levels.jmax

    @property
    def provenance(self) -> dict[str, Any]:
        """Origin of the lines: the top with its sources, the settings, Q."""
        return self.top.provenance | {
            "polarizability_abc_angstrom3": self.top.polarizability_abc_angstrom3,
            "polarizability_source": self.top.polarizability_source,
            "temperature_k": self.temperature_k,
            "laser_nm": self.laser_nm,
            "jmax": self.jmax,
            "min_relative": self.min_relative or None,
            "q": self.partition.q,
            "q_source": self.partition.source,
            "lines": len(self),
            "warnings": list(self.warnings),
        }

    @property
    def shift_cm(self) -> Floats:
        """Raman shift in cm⁻¹, Stokes lines positive."""
        return self.shift_mhz / units.MHZ_PER_CM

    @property
    def scattered_cm(self) -> Floats:
        """Wavenumber of the scattered light, cm⁻¹."""
        return NM_PER_CM / self.laser_nm - self.shift_cm

    @property
    def wavelength_nm(self) -> Floats:
        """Wavelength of the scattered light in vacuum, nm."""
        return NM_PER_CM / self.scattered_cm

    @property
    def energy_initial_cm(self) -> Floats:
        """Energy of the initial state in cm⁻¹ above the lowest existing level."""
        return (self.levels.energy_mhz[self.initial] - self.levels.ground_mhz) / units.MHZ_PER_CM

    @property
    def g_initial(self) -> Ints:
        """Degeneracy of the initial state with its spin weight, over all its components."""
        return self.levels.degeneracy[self.initial]

    @property
    def cross_section_cm2_per_sr(self) -> Floats:
        """Differential cross section dσ/dΩ (n,) in cm²/sr per molecule of the gas."""
        energy_k = (self.levels.energy_mhz[self.initial] - self.levels.ground_mhz) / units.MHZ_PER_K
        population = self.weight * np.exp(-energy_k / self.temperature_k) / self.partition.q
        photon = (2 * math.pi * self.scattered_cm) ** 4  # (2π ν)⁴ of the scattered light
        # 7/45 γ² for polarizations that are not resolved
        return 7 / 45 * photon * self.strength_angstrom6 * ANGSTROM6_IN_CM6 * population

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Limits of the levels."""
        return warnings_of(self.top, self.levels)

    def where(self, chosen: NDArray[Any] | slice) -> RamanLines:
        """The lines selected by a slice, a boolean mask or an array of indices, in its order."""
        names = ("shift_mhz", "strength_angstrom6", "initial", "final", "weight")
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns by their names with unit, quantum numbers last (j_initial, ..., kc_final)."""
        names = (
            "shift_cm", "cross_section_cm2_per_sr", "wavelength_nm", "energy_initial_cm", "g_initial", "strength_angstrom6",
        )  # fmt: skip
        out: dict[str, NDArray[Any]] = {name: getattr(self, name) for name in names}
        return (
            out | self.levels.quanta_columns(self.initial, "initial") | self.levels.quanta_columns(self.final, "final")
        )


def raman_lines(
    top: Top,
    *,
    temperature_k: float = 300.0,
    laser_nm: float = DEFAULT_LASER_NM,
    jmax: int | None = None,
    min_relative: float | None = DEFAULT_MIN_RELATIVE,
    q: float | None = None,
    vibrations: VibrationalStates | None = None,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    executor: Executor | None = None,
) -> RamanLines:
    """Rotational Raman lines of a top: all transitions that its polarizability allows, within the given limits.

    Parameters
    ----------
    top : Top
        With `polarizability_abc_angstrom3` at the wavelength of the laser.
    temperature_k : float
        Temperature of the gas.
    laser_nm : float
        Wavelength in vacuum.
    jmax : int, optional
        Highest J; by default the J beyond which no line reaches `min_relative`.
    min_relative : float, optional
        Cross section, relative to the strongest line, below which lines are left out; None keeps all lines.
    q : float, optional
        Partition function to use instead of the summed one, spin weights reduced by their common divisor.
    vibrations : VibrationalStates, optional
        States or fundamentals whose factor multiplies Q.
    effects : sequence of QuantumEffect, optional
        The Hamiltonian.
    executor : Executor, optional
        Shares the work over J.

    Returns
    -------
    RamanLines
        Stokes and anti-Stokes lines, rising in shift.

    Raises
    ------
    ValueError
        For an unknown polarizability, a temperature or wavelength not above 0, a cut not between 0 and 1, a J max below 0.

    Notes
    -----
    Neglected: dependence of the polarizability on J (0.2 % per J for H2, less for all others) and on the wavelength,
    lines in excited vibrational states, electron spin (lines of O2 are triplets, resolved at 0.1 cm⁻¹ only for the lowest N).

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=2 cm-1", polarizability_abc_angstrom3=((2.2, 0, 0), (0, 1.5, 0), (0, 0, 1.5)))
    >>> raman_lines(rod, jmax=3).shift_cm.round(6).tolist()  # 4B(J + 3/2) = 12, 20
    [-20.0, -12.0, 12.0, 20.0]
    """
    _refuse_nonsense(temperature_k, laser_nm, min_relative)
    tensor, least = _polarizability(top), min_relative or 0.0
    if jmax is None:
        jmax = jmax_for_raman(top, temperature_k, min_relative or DEFAULT_MIN_RELATIVE)

    levels = solve_levels(top, jmax, effects=effects, executor=executor)
    transitions = raman_transitions(levels, tensor, top.spin_weights)
    partition = line_partition(top, temperature_k, q, 1.0, vibrations, effects) or partition_function(
        top, temperature_k, effects=effects
    )
    lines = _both_ways(top, levels, transitions, temperature_k, laser_nm, least, partition)
    lines = lines.where(lines.scattered_cm > 0)
    if len(lines) and least:
        section = lines.cross_section_cm2_per_sr
        lines = lines.where(section >= least * section.max())
    # stable: shifts that coincide keep the order of levels
    return lines.where(np.argsort(lines.shift_mhz, kind="stable"))


def _polarizability(top: Top) -> Tensor:
    """The polarizability in Å³; zero for a spherical top without one, since its isotropic part has no rotational lines."""
    if top.polarizability_abc_angstrom3 is not None:
        return top.polarizability_abc_angstrom3
    if top.kind == "spherical":
        zero = (0.0, 0.0, 0.0)
        return zero, zero, zero
    raise ValueError(f"the polarizability of {top.name or 'this top'} is not known; give one, in principal axes")


def _refuse_nonsense(temperature_k: float, laser_nm: float, min_relative: float | None) -> None:
    if not (math.isfinite(temperature_k) and temperature_k > 0):
        raise ValueError(f"temperature {temperature_k} K: a temperature is above 0 K")
    if not (math.isfinite(laser_nm) and laser_nm > 0):
        raise ValueError(f"laser wavelength {laser_nm} nm: expected a finite number above 0")
    if min_relative is not None and not 0 < min_relative < 1:
        raise ValueError(f"cut {min_relative} of the strongest line: expected a number between 0 and 1, or None")


def _both_ways(
    top: Top,
    levels: Levels,
    transitions: RamanTransitions,
    temperature_k: float,
    laser_nm: float,
    least: float,
    partition: PartitionFunction,
) -> RamanLines:
    """A Stokes line from the lower state of each pair and an anti-Stokes line from the upper one."""
    shift = levels.energy_mhz[transitions.upper] - levels.energy_mhz[transitions.lower]
    return RamanLines(
        top=top,
        levels=levels,
        shift_mhz=np.concatenate([shift, -shift]),
        strength_angstrom6=np.tile(transitions.strength_angstrom6, 2),
        initial=np.concatenate([transitions.lower, transitions.upper]),
        final=np.concatenate([transitions.upper, transitions.lower]),
        weight=np.tile(transitions.weight, 2),
        temperature_k=temperature_k,
        laser_nm=laser_nm,
        min_relative=least,
        partition=partition,
    )


def band_cross_section(lines: RamanLines) -> float:
    """dσ/dΩ summed over all lines, Stokes and anti-Stokes, in cm²/sr.

    For many levels of a linear molecule it tends to (3/4) (7/45) (2π ν)⁴ γ²; the remaining quarter is Rayleigh scattering.
    """
    return float(lines.cross_section_cm2_per_sr.sum())


def jmax_for_raman(top: Top, temperature_k: float, min_relative: float) -> int:
    """The J beyond which all lines of a rigid top are weaker than `min_relative` of the strongest.

    A line from J has S ≤ (2J+1) γ² and an energy above C J(J+1); the strongest has at least 0.05 (2J+1) γ² of the most
    populated level of energy below A J(J+1). Raises ValueError if more than J = 600 would be needed.
    """
    a, _, c = top.rotational_constants_mhz
    kt_mhz, heaviest = temperature_k * units.MHZ_PER_K, max(top.spin_weights.values)
    a = top.rotational_constants_mhz[1] if math.isinf(a) else a  # a linear molecule has an infinite A
    # (2J + 1) exp(-B J(J + 1)/kT) is largest near J = √(kT/2B)
    populated = max(1.0, math.sqrt(kt_mhz / (2 * a)) * math.exp(-0.5))
    j = 2
    # a Boltzmann factor of J - 2, from which an S line starts
    while heaviest * (2 * j + 1) * math.exp(-c * j * (j - 3) / kt_mhz) > 0.05 * min_relative * populated:
        j += 1
        if j > JMAX_DEFAULT_LIMIT:
            raise ValueError(
                f"Raman lines above {min_relative:g} of the strongest at {temperature_k:g} K reach beyond J = "
                f"{JMAX_DEFAULT_LIMIT}; give J max, a lower temperature or a higher cut"
            )
    return j


def anisotropy_angstrom3(top: Top) -> float:
    """γ of a top's polarizability in Å³: |α∥ - α⊥| for an axial tensor, 0 for a spherical top; ValueError if unknown."""
    return math.sqrt(anisotropy_squared(_polarizability(top)))
