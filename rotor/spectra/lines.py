"""Line lists: which transitions exist, how strong they are, and their columns.

    I(T) = (8π³/3hc) ν g_I S μ² [exp(-E″/kT) - exp(-E′/kT)] / Q(T)      absorption, integrated, nm² MHz
    A    = (64π⁴ν³/3hc³) S μ² / (2J′+1)                                 1/s

(H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transf. 60, 883 (1998), eqs. 1 and 3). S μ² is summed over M and
all components that coincide in the line; g_I is the spin weight of one component, and Q contains the same g_I.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Ints, hold_freed_memory, rising_order
from rotor.checks import require_positive, require_whole
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect, dipoles_by_state
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.budgets import (
    known_covariance,
    level_spread,
    line_errors,
    source_of_errors,
    without_errors,
)
from rotor.quantum.estimates.convergence import warnings_of
from rotor.quantum.labels.quanta import heading
from rotor.quantum.levels import Levels, TransitionTable
from rotor.quantum.solve import solve_levels
from rotor.quantum.tabulated import tabulated_line_errors
from rotor.spectra.intensity import (
    EINSTEIN_PER_MHZ3,
    INTENSITY_NM2_MHZ,
    LGINT_NM2_MHZ,
    highest_j,
    intensity_cut,
    largest,
    population,
    require_cut,
)
from rotor.spectra.transitions.pairs import all_transitions
from rotor.table import counted
from rotor.thermodynamics.sums.partition import PartitionFunction, partition_function
from rotor.thermodynamics.sums.trusted_levels import are_trusted, in_level_table
from rotor.thermodynamics.vibration import VibrationalStates
from rotor.tops.constants.covariance import Covariance
from rotor.tops.facts import without_constants

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top


DEFAULT_MIN_LGINT = -12.0


@dataclass(frozen=True, eq=False, repr=False)
class Lines(TransitionTable):
    """Lines as columns of equal length, rising in frequency unless computed unsorted.

    frequency_mhz, strength_debye2 (S μ², all components): (n,) float64. upper, lower: (n,) int32, rows of `levels`.
    Other columns are computed on demand. min_lgint, range_mhz and jmax are the limits of the list.
    untrusted: number of lines left out because one of their levels is beyond the reach of the constants.
    covariance: of the constants; without it, their uncertainties count if the top states that they are independent.
    """

    top: Top
    levels: Levels
    frequency_mhz: Floats
    strength_debye2: Floats
    upper: NDArray[np.int32]
    lower: NDArray[np.int32]
    temperature_k: float
    min_lgint: float
    range_mhz: tuple[float, float]
    stated_partition: PartitionFunction | None = None
    covariance: Covariance | None = None
    stated_spread: Floats | None = None
    untrusted: int = 0

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @property
    def jmax(self) -> int:
        """The highest J of the levels."""
        return self.levels.jmax

    @cached_property
    def partition(self) -> PartitionFunction:
        """Q(T) of the intensities; summed on first use unless it was given."""
        return self.stated_partition or partition_function(self.top, self.temperature_k, effects=self.levels.effects)

    @property
    def q(self) -> float:
        """The value of Q(T)."""
        return self.partition.q

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Limits of the levels, lines left out, and constants without uncertainty in the errors."""
        uncertain = set(self.covariance_used.names) if self.covariance_used else set()
        with_spins = "(" in "".join(uncertain)
        exact = [name for name in self._parameters if name not in uncertain and ("(" not in name or with_spins)]
        partly = f"errors of frequencies take {', '.join(exact)} as exact: their uncertainty is not known"
        verb = "is" if self.untrusted == 1 else "are"
        beyond = (
            f"{counted(self.untrusted, 'line')} of levels beyond the reach of the distortion constants {verb} left out"
        )
        limits = () if self.tabulated else warnings_of(self.top, self.levels)
        limits += (beyond,) if self.untrusted else ()
        return limits + ((partly,) if uncertain and exact else ())

    @property
    def tabulated(self) -> bool:
        """Whether all lines join levels of the top's table, so that the distortion series does not matter."""
        in_table = in_level_table(self.top, self.levels)
        return in_table is not None and bool(in_table[self.upper].all() and in_table[self.lower].all())

    @cached_property
    def spread(self) -> Floats | None:
        """Contribution of the constants' covariance to each level (`uncertainty.level_spread`); None without a covariance."""
        if self.stated_spread is not None or self.covariance_used is None:
            return self.stated_spread
        return level_spread(self.top, self.levels, self.covariance_used)

    @property
    def covariance_used(self) -> Covariance | None:
        """The given covariance, else that of the top (`uncertainty.known_covariance`)."""
        return self.covariance or known_covariance(self.top, self._parameters)

    @cached_property
    def _parameters(self) -> tuple[str, ...]:
        """Names of all parameters of the levels' effects; a covariance from a fit may have more, such as those of spins."""
        return tuple(dict.fromkeys(name for effect in self.levels.effects for name in effect.parameters(self.top)))

    @property
    def error_mhz(self) -> Floats | None:
        """One standard deviation of each frequency, from uncertainties of the constants or of a level table; None if unknown.

        Neglected: errors of the Hamiltonian. Constants without uncertainty count as exact. nan: a level is not in the table.
        """
        if self.spread is None:
            return tabulated_line_errors(self.top, self.levels, self.upper, self.lower)
        return line_errors(self.spread, self.upper, self.lower)

    @property
    def errors_from(self) -> str | None:
        """Source of the uncertainties in the errors of frequencies; None if there are none."""
        return source_of_errors(self.top, self._parameters, self.covariance)

    @property
    def exact_constants(self) -> list[str]:
        """Constants without an uncertainty, which `error_mhz` takes as exact."""
        return without_errors(self.top, self._parameters, self.covariance)

    @property
    def provenance(self) -> dict[str, Any]:
        """Origin of the lines: the top with its sources, the settings, Q."""
        origin = self.top.provenance
        return (origin if self.levels.has_named_constants else without_constants(origin)) | {
            "errors_from": self.errors_from,
            "temperature_k": self.temperature_k,
            "jmax": self.jmax,
            "min_lgint": self.min_lgint,
            "range_mhz": list(self.range_mhz),
            "q": self.q,
            "q_source": self.partition.source,
            "lines": len(self),
            "warnings": list(self.warnings),
        }

    @property
    def energy_lower_cm(self) -> Floats:
        """E″ in cm⁻¹ above the lowest existing level."""
        return (self.levels.energy_mhz[self.lower] - self.levels.ground_mhz) / units.MHZ_PER_CM

    @property
    def g_upper(self) -> Ints:
        """Degeneracy of the upper state with its spin weight, over all components of the line."""
        return self.levels.degeneracy[self.upper]

    @property
    def intensity_nm2_mhz(self) -> Floats:
        """Integrated absorption I(T) in nm² MHz."""
        lower_population = population(self.levels, self.partition)[self.lower]
        photon = -np.expm1(-self.frequency_mhz / (self.temperature_k * units.MHZ_PER_K))
        return np.asarray(INTENSITY_NM2_MHZ * self.frequency_mhz * self.strength_debye2 * lower_population * photon)

    @property
    def intensity_cm_per_molecule(self) -> Floats:
        """Integrated absorption I(T) in cm/molecule, the unit of infrared lists: cm² times the wavenumber in cm⁻¹."""
        return self.intensity_nm2_mhz / units.NM2_MHZ_PER_CM

    @property
    def lgint(self) -> Floats:
        """log10 of I(T) in nm² MHz, with the value of 8π³/3hc that catalogues use."""
        with np.errstate(divide="ignore"):  # -inf for a line of zero strength
            return np.log10(self.intensity_nm2_mhz * (LGINT_NM2_MHZ / INTENSITY_NM2_MHZ))

    @property
    def einstein_a_per_s(self) -> Floats:
        """Einstein coefficient of spontaneous emission in 1/s, for one component, averaged over M."""
        states = self.levels.states[self.upper]
        return EINSTEIN_PER_MHZ3 * self.frequency_mhz**3 * self.strength_debye2 / states

    def where(self, chosen: NDArray[Any] | slice) -> Lines:
        """The lines selected by a slice, a boolean mask or an array of indices, in its order."""
        return replace(
            self,
            frequency_mhz=self.frequency_mhz[chosen],
            strength_debye2=self.strength_debye2[chosen],
            upper=self.upper[chosen],
            lower=self.lower[chosen],
            stated_partition=self.__dict__.get("partition", self.stated_partition),
            stated_spread=self.__dict__.get("spread", self.stated_spread),
        )

    def sorted(self) -> Lines:
        """The lines in order of rising frequency."""
        if (self.frequency_mhz[1:] >= self.frequency_mhz[:-1]).all():
            return self
        return self.where(rising_order(self.frequency_mhz))

    def strongest(self, count: int) -> Lines:
        """The `count` most intense lines, strongest first."""
        return self.where(largest(self.intensity_nm2_mhz, count))

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns by their names with unit, quantum numbers last (j_upper, ..., kc_lower).

        `error_mhz` is included if the uncertainty of a constant is known.
        """
        names = (
            "frequency_mhz", "lgint", "energy_lower_cm", "g_upper", "einstein_a_per_s", "strength_debye2",
            "intensity_cm_per_molecule",
        )  # fmt: skip
        out: dict[str, NDArray[Any]] = {name: getattr(self, name) for name in names}
        if (error := self.error_mhz) is not None:
            out = {"frequency_mhz": out["frequency_mhz"], "error_mhz": error} | out
        return out | self.levels.quanta_columns(self.upper, "upper") | self.levels.quanta_columns(self.lower, "lower")

    def __getitem__(self, chosen: NDArray[Any] | slice | int) -> Lines:
        """`where` as indexing: lines[mask], lines[:10]; lines[3] is a list of one line."""
        return self.where(np.array([chosen]) if isinstance(chosen, int) else chosen)

    def _title(self) -> str:
        name = self.top.name or "a top"
        extent = f", {self.frequency_mhz.min():.4f} to {self.frequency_mhz.max():.4f} MHz" if len(self) else ""
        return f"{counted(len(self), 'line')} of {name} at {self.temperature_k:g} K, J up to {self.jmax}{extent}"

    def _texts(self, rows: NDArray[np.int64]) -> dict[str, list[str]]:
        selected = self.where(rows)
        names = ["frequency_mhz", "strength_debye2", "energy_lower_cm", "g_upper"]
        if selected.stated_partition is not None:  # a text alone does not trigger the sum of Q
            names.insert(1, "lgint")
        texts = {name: [f"{value:.6g}" for value in getattr(selected, name).tolist()] for name in names}
        texts["frequency_mhz"] = [f"{value:.4f}" for value in selected.frequency_mhz.tolist()]
        label = " ".join(heading(name) for name in self.quanta_names)
        return texts | {
            f"upper {label}": self.levels.labels(selected.upper),
            f"lower {label}": self.levels.labels(selected.lower),
        }


def line_list(
    top: Top,
    *,
    temperature_k: float = 300.0,
    jmax: int | None = None,
    min_lgint: float | None = DEFAULT_MIN_LGINT,
    range_mhz: tuple[float, float] = (0.0, math.inf),
    q: float | None = None,
    vibrational_factor: float = 1.0,
    vibrations: VibrationalStates | None = None,
    covariance: Covariance | None = None,
    sort: bool = True,
    untrusted: bool = False,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    executor: Executor | None = None,
    most_lines: float = math.inf,
) -> Lines:
    """Electric-dipole lines of a top: all transitions that the selection rules allow, within the given limits.

    Parameters
    ----------
    top : Top
        With a dipole in debye.
    temperature_k : float, optional
        Temperature for intensities.
    jmax : int, optional
        Highest J; by default the J beyond which no line reaches `min_lgint`. A table of energies may end before (`highest_j`).
    min_lgint : float or None, optional
        log10 of nm² MHz below which lines are left out; None keeps all lines.
    range_mhz : (float, float), optional
        First and last frequency.
    q : float, optional
        Partition function to use instead of the summed one, spin weights reduced by their common divisor.
    vibrational_factor : float, optional
        Multiplies Q.
    vibrations : VibrationalStates, optional
        States or fundamentals whose factor at this temperature multiplies Q instead.
    covariance : Covariance, optional
        Of the constants, for the errors of frequencies. The default is the stated uncertainties, uncorrelated; fitted ones whose
        correlations are unknown (as in the library) are not used: the errors would be many times too large.
    sort : bool, optional
        Whether to sort by frequency; False leaves the lines in the order of computation.
    untrusted : bool, optional
        Include lines of levels beyond the reach of the distortion constants (`rotor.thermodynamics.sums.trusted_levels`); by
        default these are left out and counted.
    effects : sequence of QuantumEffect, optional
        The Hamiltonian.
    executor, most_lines : Executor, float, optional
        Shares the work over J. With a cut: TooManyLinesError as soon as more lines are above it.

    Returns
    -------
    Lines
        Frequencies in MHz, strengths in D², and the levels behind them.

    Raises
    ------
    ValueError
        If the dipole is not known, for a temperature not above 0, and for J max below 0.

    Notes
    -----
    Neglected: all but electric dipole transitions, dependence of μ on J, and effects that are not in `effects`. For nuclear hyperfine
    structure from the spin constants of the top use `effects=rotor.api.effects_of(top, True)`.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> lines = line_list(Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0)), jmax=2)
    >>> [round(float(f), 3) for f in lines.frequency_mhz]
    [115271.936, 230543.872]
    """
    require_positive("temperature_k", temperature_k, "K")
    require_whole("jmax", jmax, 0)
    require_cut(min_lgint)
    first, last = range_mhz
    if not first < last:
        raise ValueError(f"range_mhz: {first:g} to {last:g} MHz: expected a range that rises")
    dipole = _top_dipole(top)
    hold_freed_memory()
    least = -math.inf if min_lgint is None else min_lgint  # no cut: log10 of 0
    stated = line_partition(top, temperature_k, q, vibrational_factor, vibrations, effects)
    if stated is None and (jmax is None or math.isfinite(least)):
        stated = partition_function(top, temperature_k, effects=effects)
    jmax = highest_j(top, dipole, stated or PartitionFunction.stated(temperature_k, 1.0), least, jmax, effects)
    levels = solve_levels(top, jmax, effects=effects, executor=executor)
    trusted = np.ones(len(levels), dtype=np.bool_) if untrusted else are_trusted(top, levels)
    ground = float(levels.energy_mhz[trusted & (levels.weight > 0)].min(initial=math.inf))  # inf without levels: no cut
    cut = None
    if stated and math.isfinite(ground):
        cut = intensity_cut(levels, stated, least, ground, most_lines)
    others = [moment for effect in levels.effects for moment in effect.other_moments(top)]
    transitions = all_transitions(levels, dipoles_by_state(top, dipole, levels.effects), range_mhz, cut, others)
    inside = None if trusted.all() else trusted[transitions.upper] & trusted[transitions.lower]
    lines = Lines(
        top=top,
        # weight 0: a level of the table without lines
        levels=levels if inside is None else replace(levels, weight=np.where(trusted, levels.weight, 0)),
        frequency_mhz=transitions.frequency_mhz,
        strength_debye2=transitions.strength_debye2,
        upper=transitions.upper,
        lower=transitions.lower,
        temperature_k=temperature_k,
        min_lgint=least,
        range_mhz=range_mhz,
        stated_partition=stated,
        covariance=covariance,
        untrusted=0 if inside is None else int(np.count_nonzero(~inside)),
    )
    if inside is not None:
        lines = lines.where(inside)
    return lines.sorted() if sort else lines


def _top_dipole(top: Top) -> tuple[float, float, float]:
    if top.dipole_abc_debye is None:
        raise ValueError(
            f"the dipole of {top.name or 'this top'} is not known; give one, in principal axes or in the input's frame"
        )
    return top.dipole_abc_debye


def line_partition(
    top: Top,
    temperature_k: float,
    q: float | None,
    vibrational_factor: float,
    vibrations: VibrationalStates | None,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
) -> PartitionFunction | None:
    """The given Q, or the summed Q times a vibrational factor.

    Parameters
    ----------
    top : Top
        Top whose levels are summed.
    temperature_k : float
        Temperature of the gas.
    q : float or None
        The given partition function, if any.
    vibrational_factor : float
        Multiplies Q; 1 for none.
    vibrations : VibrationalStates or None
        States whose factor at this temperature multiplies Q instead.
    effects : sequence of QuantumEffect, optional
        The Hamiltonian.

    Returns
    -------
    PartitionFunction or None
        None if Q is to be summed without a factor.

    Raises
    ------
    ValueError
        For both kinds of vibrational factor at once, and for a Q or factor that is not finite and above 0.
    """
    if vibrations is not None:
        if vibrational_factor != 1.0:
            raise ValueError(f"vibrational factor {vibrational_factor:g} and vibrational energies: give one of them")
        vibrational_factor = vibrations.factor(temperature_k)
    named = f"a vibrational factor of {vibrational_factor:.6g}" + (f" ({vibrations.text})" if vibrations else "")
    for name, value in (("Q", q), ("vibrational factor", vibrational_factor)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} = {value}: expected a finite number above 0")
    if q is not None:
        times = "" if vibrational_factor == 1.0 else f", times {named}"
        return PartitionFunction.stated(temperature_k, q * vibrational_factor, f"given{times}")
    if vibrational_factor == 1.0:
        return None
    summed = partition_function(top, temperature_k, effects=effects)
    source = f"{summed.source}, times {named}"
    return replace(summed, q=summed.q * vibrational_factor, source=source)
