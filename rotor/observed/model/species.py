"""Lines of a species independent of excitation: frequency, strength without population, lower energy.

    I_i(T) = S_i [exp(-E″/kT) - exp(-E′/kT)] / Q(T),       S_i = (8π³/3hc) ν g_I S μ² = c² A g_u / (8π ν²)

(H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transf. 60, 883 (1998), eqs. 1 to 3). S_i follows from LGINT, from an Einstein
coefficient or from a line strength. It does not depend on temperature, so that an excitation temperature can be fitted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.observed.model.partition import PartitionTable, top_partition
from rotor.spectra.intensity import INTENSITY_NM2_MHZ, LGINT_NM2_MHZ
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.spectra.lines import Lines

CATALOGUE_K = 300.0  # temperature of LGINT in catalogues of JPL and CDMS
# c²/8π in nm² MHz for A in 1/s and ν in MHz: 1e18 nm²/m², 1e-18
_A_TO_STRENGTH = units.SPEED_OF_LIGHT_M_PER_S**2 / (8 * math.pi)


@dataclass(frozen=True, eq=False, repr=False)
class SpeciesLines(Table):
    """Lines of a species, (n,) each, rising in frequency.

    strength_nm2_mhz: S_i (see the module). energy_lower_k: E″/k. g_upper: degeneracy. error_mhz: one standard deviation of each frequency,
    0 if unknown. upper, lower: quantum numbers as text, or empty. partition: Q(T). source: source of the lines. identity: tag, formula,
    InChIKey and the like, if known.
    """

    name: str
    frequency_mhz: Floats
    strength_nm2_mhz: Floats
    energy_lower_k: Floats
    g_upper: Floats
    partition: PartitionTable
    error_mhz: Floats
    upper: NDArray[np.str_]
    lower: NDArray[np.str_]
    source: str = ""
    identity: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @property
    def energy_upper_k(self) -> Floats:
        """E′/k (n,)."""
        return self.energy_lower_k + self.frequency_mhz / units.MHZ_PER_K

    @property
    def einstein_a_per_s(self) -> Floats:
        """Einstein coefficient of spontaneous emission (n,), 8π ν² S_i/(c² g_u)."""
        return self.strength_nm2_mhz * self.frequency_mhz**2 / (_A_TO_STRENGTH * self.g_upper)

    @property
    def columns(self) -> dict[str, Any]:
        """Columns by name."""
        numbers = (
            "frequency_mhz",
            "error_mhz",
            "strength_nm2_mhz",
            "energy_lower_k",
            "energy_upper_k",
            "g_upper",
            "einstein_a_per_s",
        )
        return {name: getattr(self, name) for name in (*numbers, "upper", "lower")}

    @property
    def provenance(self) -> dict[str, Any]:
        """Name, source and identity of the species."""
        return {"name": self.name, "source": self.source, **self.identity, "rows": len(self)}

    def intensity_nm2_mhz(self, temperature_k: float) -> Floats:
        """I_i(T) (n,), integrated absorption with stimulated emission."""
        return self.strength_nm2_mhz * self.population(temperature_k)

    def population(self, temperature_k: float) -> Floats:
        """[exp(-E″/kT) - exp(-E′/kT)]/Q(T), (n,)."""
        photon = -np.expm1(-self.frequency_mhz / (units.MHZ_PER_K * temperature_k))
        return np.asarray(np.exp(-self.energy_lower_k / temperature_k) * photon / self.partition.at(temperature_k))

    def where(self, chosen: NDArray[Any] | slice) -> SpeciesLines:
        """The lines selected by a slice, a mask or an array of indices."""
        names = ("frequency_mhz", "strength_nm2_mhz", "energy_lower_k", "g_upper", "error_mhz", "upper", "lower")
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})

    def between(self, first_mhz: float, last_mhz: float) -> SpeciesLines:
        """The lines in a range of frequencies."""
        first, last = np.searchsorted(self.frequency_mhz, (first_mhz, last_mhz))
        return self.where(slice(int(first), int(last)))


def species_lines(
    name: str,
    frequency_mhz: ArrayLike,
    strength_nm2_mhz: ArrayLike,
    energy_lower_k: ArrayLike,
    g_upper: ArrayLike,
    partition: PartitionTable,
    *,
    error_mhz: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    lower: ArrayLike | None = None,
    source: str = "",
    identity: dict[str, Any] | None = None,
) -> SpeciesLines:
    """Lines of a species from columns (n,) in any order, sorted by frequency; ValueError for columns of different length.

    >>> q = PartitionTable(np.array([10.0, 300.0]), np.array([3.97, 108.79]))
    >>> co = species_lines("CO", [115271.2], strength_from_einstein([7.203e-8], [115271.2], [3]), [0.0], [3], q)
    >>> round(float(np.log10(co.intensity_nm2_mhz(300.0)[0])), 3)  # LGINT at 300 K
    -5.01
    """
    frequency = np.asarray(frequency_mhz, dtype=np.float64)
    order = np.argsort(frequency, kind="stable")
    blank = np.full(len(frequency), "")

    def column(values: ArrayLike | None, otherwise: NDArray[Any]) -> NDArray[Any]:
        filled = otherwise if values is None else np.asarray(values)
        if filled.shape != frequency.shape:
            raise ValueError(f"{name}: a column of shape {filled.shape} for {len(frequency)} lines")
        return filled[order]

    return SpeciesLines(
        name=name,
        frequency_mhz=frequency[order],
        strength_nm2_mhz=column(strength_nm2_mhz, blank).astype(np.float64),
        energy_lower_k=column(energy_lower_k, blank).astype(np.float64),
        g_upper=column(g_upper, blank).astype(np.float64),
        partition=partition,
        error_mhz=column(error_mhz, np.zeros(len(frequency))).astype(np.float64),
        upper=column(upper, blank),
        lower=column(lower, blank),
        source=source,
        identity=identity or {},
    )


def strength_from_einstein(einstein_a_per_s: ArrayLike, frequency_mhz: ArrayLike, g_upper: ArrayLike) -> Floats:
    """S_i = c² A g_u/(8π ν²) in nm² MHz."""
    a, frequency = np.asarray(einstein_a_per_s, dtype=np.float64), np.asarray(frequency_mhz, dtype=np.float64)
    return np.asarray(_A_TO_STRENGTH * a * np.asarray(g_upper) / frequency**2)


def strength_from_lgint(
    lgint: ArrayLike, frequency_mhz: ArrayLike, energy_lower_k: ArrayLike, q: float, temperature_k: float = CATALOGUE_K
) -> Floats:
    """S_i in nm² MHz from log10 I of a catalogue at the temperature of Q; the catalogues' 8π³/3hc is replaced by that of CODATA."""
    frequency, energy = np.asarray(frequency_mhz, dtype=np.float64), np.asarray(energy_lower_k, dtype=np.float64)
    photon = -np.expm1(-frequency / (units.MHZ_PER_K * temperature_k))
    scaled = 10.0 ** np.asarray(lgint, dtype=np.float64) * q * (INTENSITY_NM2_MHZ / LGINT_NM2_MHZ)
    return np.asarray(scaled * np.exp(energy / temperature_k) / photon)


def species_from_lines(lines: Lines, name: str | None = None, partition: PartitionTable | None = None) -> SpeciesLines:
    """A computed line list as a species; Q(T) is summed from the levels unless `partition` has it."""
    labels = [[" ".join(text.split()) for text in lines.levels.labels(rows)] for rows in (lines.upper, lines.lower)]
    weight = lines.levels.weight_per_component[lines.lower]
    errors = lines.error_mhz
    return species_lines(
        name or lines.top.name or "top",
        lines.frequency_mhz,
        INTENSITY_NM2_MHZ * lines.frequency_mhz * lines.strength_debye2 * weight,
        lines.energy_lower_cm * units.MHZ_PER_CM / units.MHZ_PER_K,
        lines.g_upper,
        partition or top_partition(lines.top),
        error_mhz=None if errors is None else np.nan_to_num(errors, nan=0.0),
        upper=np.array(labels[0], dtype=np.str_),
        lower=np.array(labels[1], dtype=np.str_),
        source=lines.top.source or "computed",
    )
