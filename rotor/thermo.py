"""The rotational partition function, summed from the levels and beside it its classical limit.

Q(T) = Σ g_I (2J+1) exp(-E/kT), E from the lowest level that exists, g_I reduced by its common divisor. Classically, with
⟨g_I⟩ the weight averaged over many levels (G. Herzberg, Molecular Spectra and Molecular Structure II, eqs. V,18 and V,27),

    Q = ⟨g_I⟩ kT/hB  (linear),      Q = ⟨g_I⟩ √(π (kT/h)³ / ABC)  (all others).

A vibrational factor multiplies it where vibrational states are given: the same rotational levels in each of them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.quantum.levels import solve_levels

if TYPE_CHECKING:
    from rotor.top import Top

STRIDE = 8  # J are solved by so many at a time
JMAX_LIMIT = 4000


@dataclass(frozen=True)
class PartitionFunction:
    """Q at one temperature: the sum, the J it was summed to, its estimated relative truncation error, how it came."""

    temperature_k: float
    q: float
    jmax: int | None
    relative_error: float
    source: str


@dataclass(frozen=True)
class VibrationalStates:
    """Vibrational states behind a partition function, by their energies above the ground state.

    energies_cm: in cm⁻¹, all above 0. degeneracies: of each, 1 unless given. harmonic: the energies are fundamentals, and
    all their overtones and combinations are added as those of harmonic oscillators; else they are states, each listed.

    Neglected either way: that each state has rotational constants of its own, some per cent of the factor less 1.
    """

    energies_cm: tuple[float, ...]
    degeneracies: tuple[int, ...] = ()
    harmonic: bool = False

    def __post_init__(self) -> None:
        energies = tuple(float(energy) for energy in self.energies_cm)
        degeneracies = tuple(self.degeneracies) or (1,) * len(energies)
        if not energies or not all(math.isfinite(e) and e > 0 for e in energies):
            raise ValueError(
                f"vibrational energies {list(energies)}: finite ones above 0 cm-1 are wanted (not the ground state)"
            )
        if len(degeneracies) != len(energies) or not all(int(g) == g and g > 0 for g in degeneracies):
            raise ValueError(
                f"degeneracies {list(degeneracies)}: a whole number above 0 for each of {len(energies)} energies"
            )
        object.__setattr__(self, "energies_cm", energies)
        object.__setattr__(self, "degeneracies", tuple(int(g) for g in degeneracies))

    @classmethod
    def parse(cls, text: str, harmonic: bool = False) -> VibrationalStates:
        """From a comma list such as "667.4x2, 1388, 2349 cm-1", with x and the degeneracy after an energy; cm⁻¹ by default.

        >>> VibrationalStates.parse("667.4x2,1388,2349 cm-1").degeneracies
        (2, 1, 1)
        """
        items = [_ENERGY.fullmatch(item) for item in text.split(",")]
        if not all(items):
            raise ValueError(
                f"{text!r}: energies such as '667.4x2, 1388, 2349 cm-1' are wanted, x and a degeneracy after each"
            )
        unit = next((item["unit"] for item in reversed(items) if item and item["unit"]), "cm-1")
        mhz = [units.parse_quantity(f"{item['energy']} {item['unit'] or unit}", "MHz") for item in items if item]
        degeneracies = tuple(int(item["times"] or 1) for item in items if item)
        return cls(tuple(x / units.MHZ_PER_CM for x in mhz), degeneracies, harmonic)

    @property
    def text(self) -> str:
        """The energies as they are given, and what they are."""
        energies = (
            f"{e:g}" + (f"x{g}" if g > 1 else "") for e, g in zip(self.energies_cm, self.degeneracies, strict=True)
        )
        return f"{'fundamentals, harmonic,' if self.harmonic else 'states'} {', '.join(energies)} cm-1"

    def factor(self, temperature_k: float) -> float:
        """The factor of Q at a temperature; see `vibrational_partition_function`."""
        return vibrational_partition_function(
            self.energies_cm, self.degeneracies, temperature_k, harmonic=self.harmonic
        )


_ENERGY = re.compile(
    r"\s*(?P<energy>[\d.]+(?:[eE][+-]?\d+)?)\s*(?:[x×]\s*(?P<times>\d+))?\s*(?P<unit>[^\d\s.,x×][^\s,]*)?\s*"
)


def vibrational_partition_function(
    energies_cm: ArrayLike, degeneracies: ArrayLike, temperature_k: float, *, harmonic: bool = False
) -> float:
    """Q of vibration, the ground state counted as 1: Σ g exp(-E/kT) over the states listed, or of harmonic oscillators.

    With `harmonic` the energies are fundamentals and Q = Π (1 - exp(-E/kT))^-g, all overtones among it (G. Herzberg,
    Molecular Spectra and Molecular Structure II, eqs. V,20 and V,21; anharmonicity and what splits overtones neglected).
    energies_cm, degeneracies: (n,). Raises ValueError for a temperature not above 0 K or energies not above 0.

    >>> round(vibrational_partition_function([667.4, 1388.2, 2349.1], [2, 1, 1], 300.0, harmonic=True), 4)  # CO2
    1.0881
    """
    if not (math.isfinite(temperature_k) and temperature_k > 0):
        raise ValueError(f"temperature {temperature_k} K: a temperature is above 0 K")
    given = VibrationalStates(tuple(np.ravel(energies_cm).tolist()), tuple(np.ravel(degeneracies).tolist()))
    occupied = np.exp(-np.array(given.energies_cm) * units.MHZ_PER_CM / (temperature_k * units.MHZ_PER_K))
    g = np.array(given.degeneracies)
    return float(np.prod((1 - occupied) ** -g.astype(float))) if harmonic else float(1 + g @ occupied)


def classical_partition_function(top: Top, temperature_k: float) -> float:
    """Q in the classical limit, with the mean spin weight; about 1 % low for water at 300 K, worse when colder.

    >>> from rotor.top import Top
    >>> round(classical_partition_function(Top.from_constants("B=57635.968 MHz"), 300.0), 2)
    108.46
    """
    kt_mhz = temperature_k * units.MHZ_PER_K
    a, b, c = top.rotational_constants_mhz
    if top.kind == "linear":
        return top.spin_weights.mean * kt_mhz / b
    return top.spin_weights.mean * math.sqrt(math.pi * kt_mhz**3 / (a * b * c))


def partition_function(top: Top, temperature_k: float, relative_error: float = 1e-6) -> PartitionFunction:
    """Q(T) summed over levels until the tail is below `relative_error` of it.

    The tail is estimated by the ratio of the last pairs of J, which falls with J. Raises ValueError for a temperature not
    above 0 K, and where the terms rise again before they have died away: then the distortion constants are used beyond
    their reach, and no sum would mean anything.
    """
    return partition_functions(top, [temperature_k], relative_error)[0]


def partition_functions(
    top: Top, temperatures_k: Iterable[float], relative_error: float = 1e-6
) -> list[PartitionFunction]:
    """Q at several temperatures from one set of levels; see `partition_function`."""
    temperatures = [float(t) for t in temperatures_k]
    for t in temperatures:
        if not (math.isfinite(t) and t > 0):
            raise ValueError(f"temperature {t} K: a temperature is above 0 K")

    terms = _Terms(top)
    return [_summed(terms, t, relative_error) for t in temperatures]


class _Terms:
    """Energies above the lowest existing level, in K, and degeneracies, J by J, solved when first asked for."""

    def __init__(self, top: Top) -> None:
        self._top = top
        self._ground: float | None = None
        self._by_j: list[tuple[np.ndarray, np.ndarray]] = []

    def _solve_more(self) -> None:
        first = len(self._by_j)
        stride = max(STRIDE, first // 4)
        levels = solve_levels(self._top, first + stride - 1, jmin=first, vectors=False)
        exists = levels.weight > 0
        if self._ground is None:
            self._ground = levels.ground_mhz
        kelvin = (levels.energy_mhz - self._ground) / units.MHZ_PER_K
        for j in range(first, first + stride):
            here = exists & (levels.j == j)
            self._by_j.append((kelvin[here], levels.degeneracy[here].astype(float)))

    def at(self, j: int, temperature_k: float) -> float:
        """The sum over the levels of one J; 0 where none of them exists, as for every second J of CO2."""
        while len(self._by_j) <= j:
            self._solve_more()
        kelvin, degeneracy = self._by_j[j]
        return float(degeneracy @ np.exp(-kelvin / temperature_k))


def _summed(terms: _Terms, temperature_k: float, relative_error: float) -> PartitionFunction:
    """The sum, J by J; its tail from pairs of neighbouring J, since spin weights may alternate with J."""
    values: list[float] = []
    total, highest, lowest = 0.0, 0.0, math.inf  # of the pairs, the lowest since the highest
    for j in range(JMAX_LIMIT):
        values.append(terms.at(j, temperature_k))
        total += values[-1]
        if j < 3:
            continue
        pair, before = sum(values[-2:]), sum(values[-4:-2])
        lowest = pair if pair >= highest else min(lowest, pair)
        highest = max(highest, pair)

        if 2 * lowest < pair < highest / 2:
            raise ValueError(
                f"Q({temperature_k:g} K): the sum over levels grows again at J = {j}; the distortion constants are used "
                f"beyond their reach (tail {pair / total:.1e} of Q there); lower the temperature or give Q"
            )
        ratio = pair / before if before else 1.0
        if ratio < 1.0:
            tail = pair * ratio / (1.0 - ratio)
            if tail < relative_error * total:
                source = f"summed from levels to J = {j}, relative error below {relative_error:g}"
                return PartitionFunction(temperature_k, total, j, tail / total, source)
    raise ValueError(f"Q({temperature_k:g} K) needs levels beyond J = {JMAX_LIMIT - 1}; use the classical limit")
