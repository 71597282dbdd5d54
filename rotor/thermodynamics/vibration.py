"""Vibrational states of a gas: contributions to partition function, energy and heat capacity.

The states are either listed, or fundamentals of harmonic oscillators with all overtones. All states are given the same rotational
levels. Energies count from the vibrational ground state.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats
from rotor.statistics.degrees_of_freedom import vibrational_degrees

if TYPE_CHECKING:
    from rotor.tops.top import Top

LEAST_CM = 1e-3  # lowest vibrational energy; avoids overflow of kT/E


@dataclass(frozen=True)
class VibrationalStates:
    """Vibrational states of a partition function, by their energies above the ground state.

    energies_cm: in cm⁻¹, each at least 0.001. degeneracies: default 1. harmonic: the energies are fundamentals, and all overtones and
    combinations are added as those of harmonic oscillators; otherwise the energies are a list of states.

    The dependence of the rotational constants on the state is neglected, an error of some per cent of (factor - 1).
    """

    energies_cm: tuple[float, ...]
    degeneracies: tuple[int, ...] = ()
    harmonic: bool = False

    def __post_init__(self) -> None:
        energies = tuple(float(energy) for energy in self.energies_cm)
        degeneracies = tuple(self.degeneracies) or (1,) * len(energies)
        if not energies or not all(math.isfinite(e) and e >= LEAST_CM for e in energies):
            raise ValueError(
                f"vibrational energies {list(energies)}: expected finite ones of {LEAST_CM:g} cm-1 or more (not the ground state)"
            )
        if len(degeneracies) != len(energies) or not all(int(g) == g and g > 0 for g in degeneracies):
            raise ValueError(
                f"degeneracies {list(degeneracies)}: a whole number above 0 for each of {len(energies)} energies"
            )
        object.__setattr__(self, "energies_cm", energies)
        object.__setattr__(self, "degeneracies", tuple(int(g) for g in degeneracies))

    @classmethod
    def parse(cls, text: str, harmonic: bool = False) -> VibrationalStates:
        """Parse a comma list such as "667.4x2, 1388, 2349 cm-1", with x and the degeneracy after an energy; cm⁻¹ by default.

        >>> VibrationalStates.parse("667.4x2,1388,2349 cm-1").degeneracies
        (2, 1, 1)
        """
        items = [_ENERGY.fullmatch(item) for item in text.split(",")]
        if not all(items):
            raise ValueError(
                f"{text!r}: expected energies such as '667.4x2, 1388, 2349 cm-1', x and a degeneracy after each"
            )
        unit = next((item["unit"] for item in reversed(items) if item and item["unit"]), "cm-1")
        energies = (units.parse_quantity(f"{item['energy']} {item['unit'] or unit}", "cm-1") for item in items if item)
        degeneracies = tuple(int(item["times"] or 1) for item in items if item)
        return cls(tuple(energies), degeneracies, harmonic)

    @property
    def text(self) -> str:
        """The energies as given, described as fundamentals or states."""
        energies = (
            f"{e:g}" + (f"x{g}" if g > 1 else "") for e, g in zip(self.energies_cm, self.degeneracies, strict=True)
        )
        return f"{'fundamentals, harmonic,' if self.harmonic else 'states'} {', '.join(energies)} cm-1"

    @overload
    def factor(self, temperature_k: float) -> float: ...

    @overload
    def factor(self, temperature_k: ArrayLike) -> float | Floats: ...

    def factor(self, temperature_k: ArrayLike) -> float | Floats:
        """The vibrational factor of Q at one temperature or an array; see `vibrational_partition_function`."""
        return vibrational_partition_function(
            self.energies_cm, self.degeneracies, temperature_k, harmonic=self.harmonic
        )


def missing_fundamentals(top: Top, vibrations: VibrationalStates | None) -> tuple[str, ...]:
    """A note if fewer fundamentals are given than a molecule of known nuclei has vibrations.

    Raises ValueError for more of them than that.
    """
    if vibrations is None or not vibrations.harmonic or top.molecule is None:
        return ()
    linear = top.kind == "linear"
    count = vibrational_degrees(len(top.molecule.nuclei), linear)
    given = sum(vibrations.degeneracies)
    has = f"{given} given, but {top.molecule.formula} has 3N - {5 if linear else 6} = {count} vibrations"
    if given > count:
        raise ValueError(f"fundamentals: {has}; overtones are counted already, other states go into a list of states")
    turning = 0 if top.internal_rotation is None else top.internal_rotation.tops  # torsions are among the levels
    if given >= count - turning:
        return ()
    return (
        f"fundamentals: {has}: Q is without the others; a degenerate vibration counts with its degeneracy, as 667.4x2",
    )


_ENERGY = re.compile(
    r"\s*(?P<energy>[\d.]+(?:[eE][+-]?\d+)?)\s*(?:[x×]\s*(?P<times>\d+))?\s*(?P<unit>[^\d\s.,x×][^\s,]*)?\s*"
)


@overload
def vibrational_partition_function(
    energies_cm: ArrayLike, degeneracies: ArrayLike, temperature_k: float, *, harmonic: bool = False
) -> float: ...


@overload
def vibrational_partition_function(
    energies_cm: ArrayLike, degeneracies: ArrayLike, temperature_k: ArrayLike, *, harmonic: bool = False
) -> float | Floats: ...


def vibrational_partition_function(
    energies_cm: ArrayLike, degeneracies: ArrayLike, temperature_k: ArrayLike, *, harmonic: bool = False
) -> float | Floats:
    """Vibrational Q relative to the ground state: Σ g exp(-E/kT) over the listed states, or that of harmonic oscillators.

    With `harmonic` the energies are fundamentals and Q = Π (1 - exp(-E/kT))^-g, which includes all overtones.

    Parameters
    ----------
    energies_cm : (n,) array
        Energies above the ground state in cm⁻¹.
    degeneracies : (n,) array of int
        Degeneracy of each state or fundamental.
    temperature_k : float or (...) array
        Above 0 K.
    harmonic : bool, optional
        Whether the energies are fundamentals of harmonic oscillators.

    Returns
    -------
    float or (...) array
        A number for one temperature, an array of the same shape for an array.

    Raises
    ------
    ValueError
        For a temperature not above 0 K or energies not above 0.

    Notes
    -----
    G. Herzberg, Molecular Spectra and Molecular Structure II, eqs. V,20 and V,21. Neglected in the harmonic form:
    anharmonicity, including the splitting of overtones.

    Examples
    --------
    >>> round(vibrational_partition_function([667.4, 1388.2, 2349.1], [2, 1, 1], 300.0, harmonic=True), 4)  # CO2
    1.0881
    """
    temperatures = np.asarray(temperature_k, dtype=np.float64)
    for t in temperatures.ravel().tolist():
        if not (math.isfinite(t) and t > 0):
            raise ValueError(f"temperature {t} K: a temperature is above 0 K")
    states = VibrationalStates(tuple(np.ravel(energies_cm).tolist()), tuple(np.ravel(degeneracies).tolist()))
    occupied = np.exp(-np.array(states.energies_cm) * units.MHZ_PER_CM / (temperatures[..., None] * units.MHZ_PER_K))
    g = np.array(states.degeneracies, dtype=np.float64)
    q = np.prod((1 - occupied) ** -g, axis=-1) if harmonic else 1 + occupied @ g
    return np.asarray(q) if temperatures.ndim else float(q)


def vibrational_functions(states: VibrationalStates, temperatures_k: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """ln Q, U/RT and C_v/R of vibration at many temperatures, (n,) each.

    With x = E/kT and p the thermal weight of a state: U/RT = ⟨x⟩, C_v/R = ⟨x²⟩ - ⟨x⟩². An oscillator has, in closed form,
    ln Q = -ln(1 - e⁻ˣ), U/RT = x/(eˣ - 1), C_v/R = x² eˣ/(eˣ - 1)² (A. Einstein, Ann. Phys. 327 (1907) 180, eq. 8). Where
    eˣ would overflow they are 0.

    >>> mode = VibrationalStates((100.0,), harmonic=True)
    >>> [round(float(v[0]), 4) for v in vibrational_functions(mode, [1000.0])]  # C_v/R near 1 - x²/12
    [2.0099, 0.9298, 0.9983]
    """
    t = np.asarray(temperatures_k, dtype=np.float64)
    x = np.array(states.energies_cm) * units.MHZ_PER_CM / (t[:, None] * units.MHZ_PER_K)
    g, occupied = np.array(states.degeneracies, dtype=np.float64), np.exp(-x)
    if states.harmonic:
        quanta = occupied / -np.expm1(-x)
        return -np.log1p(-occupied) @ g, (x * quanta) @ g, (x * x * quanta * (1 + quanta)) @ g
    more = occupied @ g
    first, second = (x * occupied) @ g / (1 + more), (x * x * occupied) @ g / (1 + more)
    return np.log1p(more), first, second - first**2
