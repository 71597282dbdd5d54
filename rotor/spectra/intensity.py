"""Intensities of lines: constants, populations of levels, and the J max that a cut requires.

    I(T) = (8π³/3hc) ν S μ² [exp(-E″/kT) - exp(-E′/kT)] g_I / Q(T)      absorption, integrated, nm² MHz

(H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transf. 60, 883 (1998), eq. 1). Catalogues print log10 I (LGINT) with
8π³/3hc = 4.16231e-5 nm² MHz / (MHz D²); all other intensities use the CODATA 2022 value, 4.16238e-5, which is larger by 1.66e-5 (relative).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.checks import require_whole
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.levels import Levels

if TYPE_CHECKING:
    from rotor.thermodynamics.sums.partition import PartitionFunction
    from rotor.tops.top import Top

LGINT_NM2_MHZ = 4.16231e-5  # 8π³/3hc for MHz and D² as catalogues use it; for LGINT only
EINSTEIN_PER_MHZ3 = 1.1639654e-20  # 64π⁴/3hc³ for MHz and D², CODATA 2022
INTENSITY_NM2_MHZ = EINSTEIN_PER_MHZ3 * units.SPEED_OF_LIGHT_M_PER_S**2 / (8 * math.pi)  # 8π³/3hc = (64π⁴/3hc³) c²/8π

JMAX_DEFAULT_LIMIT = 600
USUAL_CUT = -12.0
MOST_LOG10 = 300  # largest log10 of an intensity that a double holds
SUSPECT_BELOW_MHZ = 100.0  # constants of molecules are larger; a smaller A may lack its unit


def require_cut(min_lgint: float | None) -> None:
    """Raise ValueError for a cut beyond the range of a double; None and -inf mean no cut."""
    if min_lgint is not None and min_lgint != -math.inf and not abs(min_lgint) <= MOST_LOG10:
        raise ValueError(
            f"min_lgint: {min_lgint:g}: expected a number from {-MOST_LOG10} to {MOST_LOG10}, or None for all allowed lines"
        )


def highest_j(
    top: Top,
    dipole_abc: tuple[float, float, float],
    partition: PartitionFunction,
    cut: float,
    jmax: int | None = None,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
) -> int:
    """The J max of a line list: the given one, else the J beyond which all lines are weaker than 10^cut nm² MHz.

    Bounds for a rigid top: the lowest level of each J lies above C J(J+1), the strength of a line is at most (J+1) μ² times the spin
    weight; the frequency is taken as 2A(J+1). A top with a table of energies has lines between its levels alone, so that levels beyond
    both the table and the cut are left out below a given J max too.

    Parameters
    ----------
    top : Top
        Rotational constants and spin weights.
    dipole_abc : (float, float, float)
        Components of μ in debye.
    partition : PartitionFunction
        Temperature of the gas and Q there.
    cut : float
        log10 of nm² MHz; -inf (no cut) uses the usual cut of -12.
    jmax : int, optional
        The given J max.
    effects : sequence of QuantumEffect, optional
        The Hamiltonian.

    Returns
    -------
    int
        Highest J of the levels to solve.

    Raises
    ------
    ValueError
        If none is given and more than J = 600 would be needed.
    """
    table = top.level_table if tuple(effects) == SEMI_RIGID else None
    if jmax is not None and table is None:
        return jmax
    constants = top.rotational_constants_mhz
    a, c = max(x for x in constants if math.isfinite(x)), constants[2]  # a linear molecule has an infinite A
    kt_mhz = partition.temperature_k * units.MHZ_PER_K
    dipole2 = sum(mu * mu for mu in dipole_abc) or 1.0
    weight = max(top.spin_weights.values)
    least = 10.0 ** (USUAL_CUT if math.isinf(cut) else cut)

    for j in range(1, 100_000):
        frequency = 2 * a * (j + 1)
        photon = -math.expm1(-frequency / kt_mhz)
        population = weight * math.exp(-c * j * (j - 1) / kt_mhz) / partition.q
        if j > 1 and LGINT_NM2_MHZ * frequency * (j + 1) * dipole2 * photon * population < least and c * j * j > kt_mhz:
            break
    if jmax is not None and table is not None:
        return min(jmax, max(int(table.quanta["j"].max()), j))
    if j > JMAX_DEFAULT_LIMIT:
        largest_mhz = f"a largest constant of {a:g} MHz is small for a molecule"
        unit = f"; {largest_mhz}: numbers without a unit are MHz; write GHz or cm-1 if that is meant"
        raise ValueError(
            f"lines above 10^{math.log10(least):g} nm² MHz at {partition.temperature_k:g} K reach to J = {j}, more than "
            f"{JMAX_DEFAULT_LIMIT}; give J max, a lower temperature or a higher cut"
            + (unit if a < SUSPECT_BELOW_MHZ else "")
        )
    return j


def population(levels: Levels, partition: PartitionFunction, ground_mhz: float | None = None) -> Floats:
    """The fraction of molecules in each level, per component and M, including its spin weight.

    Parameters
    ----------
    levels : Levels
        Energies and weights.
    partition : PartitionFunction
        Temperature of the gas, and Q there with the same spin weights.
    ground_mhz : float, optional
        Zero of energy for Q; by default the lowest of these levels that exists.

    Returns
    -------
    (levels,) array
        Pure numbers.
    """
    above_k = (levels.energy_mhz - (levels.ground_mhz if ground_mhz is None else ground_mhz)) / units.MHZ_PER_K
    # unphysical levels may lie far below the ground state
    exponent = np.minimum(-above_k / partition.temperature_k, 600.0)
    return np.asarray(levels.weight_per_component / partition.q * np.exp(exponent))


def largest(values: Floats, count: int) -> Ints:
    """Rows of the `count` largest values in falling order; ties in order of rows.

    >>> largest(np.array([1.0, 3.0, 2.0, 3.0]), 3).tolist()
    [1, 3, 2]
    """
    require_whole("count", count, 0)
    if 0 < count < len(values):
        least = np.partition(values, len(values) - count)[len(values) - count]
        rows = np.flatnonzero(values >= least)
    else:
        rows = np.arange(len(values) if count else 0)
    return np.asarray(rows[np.argsort(-values[rows], kind="stable")][:count])


@dataclass(frozen=True)
class IntensityCut:
    """Weakest intensity that counts, with the temperature and populations behind it.

    population: (levels,) intensity per MHz and D² of a line from each lower state, without the photon factor. kt_mhz: kT/h. most_lines:
    TooManyLinesError as soon as more are above the cut.
    """

    population: Floats
    kt_mhz: float
    least: float
    most_lines: float = math.inf

    @property
    def needed(self) -> Floats:
        """ν S (levels,) in MHz D² below which a line from this lower state is too weak for any photon factor."""
        if not self.least:
            return np.zeros(len(self.population))
        with np.errstate(divide="ignore", over="ignore"):  # zero population: no line from that state reaches the cut
            return np.asarray(self.least / self.population)

    def keeps(self, frequency_mhz: Floats, strength: Floats, population: Floats) -> NDArray[np.bool_]:
        """Mask of the lines that are strong enough."""
        scaled = frequency_mhz * strength * population
        return scaled * -np.expm1(-frequency_mhz / self.kt_mhz) >= self.least


def intensity_cut(
    levels: Levels,
    partition: PartitionFunction,
    least_lgint: float,
    ground_mhz: float | None = None,
    most_lines: float = math.inf,
) -> IntensityCut | None:
    """The cut at log10 intensity `least_lgint`.

    Parameters
    ----------
    levels : Levels
        Energies and weights.
    partition : PartitionFunction
        Temperature of the gas and Q there.
    least_lgint : float
        log10 of the weakest intensity in nm² MHz.
    ground_mhz : float, optional
        As in `population`.
    most_lines : float, optional
        Above the cut.

    Returns
    -------
    IntensityCut or None
        None for -inf (no cut).
    """
    if math.isinf(least_lgint):
        return None  # no cut keeps every line
    scaled = LGINT_NM2_MHZ * population(levels, partition, ground_mhz)
    return IntensityCut(scaled, partition.temperature_k * units.MHZ_PER_K, 10.0**least_lgint, most_lines)
