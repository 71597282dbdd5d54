"""Electronic states of a gas: their part of its energy, entropy and heat capacity.

    q = Σ g exp(-E/kT),     g = 2S + 1 for the spin, times 2 where Λ is not 0

(G. Herzberg, Molecular Spectra and Molecular Structure I, chapter VIII,2). A molecule with an odd number of electrons has S of at least ½.
If the Hamiltonian contains constants of the electron spin, the rotational Q already counts the spin functions with their splittings, and
nothing is added here. All states are given the same rotational levels.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule

_STATE = re.compile(
    r"\s*(?P<times>\d+)\s*(?:@\s*(?P<energy>[\d.]+(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.,@][^\s,]*)?)?\s*"
)


@dataclass(frozen=True)
class ElectronicStates:
    """Degeneracies of electronic states and their energies (cm⁻¹) above the lowest, which comes first with energy 0.

    source: origin of the data.
    """

    degeneracies: tuple[int, ...] = (1,)
    energies_cm: tuple[float, ...] = (0.0,)
    source: str = ""

    def __post_init__(self) -> None:
        whole = all(int(g) == g and g > 0 for g in self.degeneracies)
        finite = all(math.isfinite(e) and e >= 0 for e in self.energies_cm)
        if not self.degeneracies or len(self.degeneracies) != len(self.energies_cm) or not (whole and finite):
            raise ValueError(
                f"electronic states {list(self.degeneracies)} at {list(self.energies_cm)} cm-1: expected whole numbers above 0, each with "
                "an energy of 0 or more"
            )
        if self.energies_cm[0] != 0:
            raise ValueError(
                f"electronic states: the first is the lowest, with energy 0; got {self.energies_cm[0]:g} cm-1"
            )

    @classmethod
    def parse(cls, text: str) -> ElectronicStates:
        """From a list such as "2, 2@121.1 cm-1": degeneracies, with an energy (cm⁻¹) after @ for all but the lowest.

        >>> ElectronicStates.parse("2,2@121.1").energies_cm
        (0.0, 121.1)
        """
        items = [_STATE.fullmatch(item) for item in text.split(",")]
        if not all(items):
            raise ValueError(f"{text!r}: expected degeneracies such as '3', or with energies '2,2@121.1cm-1'")
        levels = [item for item in items if item]
        energies = (
            units.parse_quantity(f"{item['energy']} {item['unit'] or 'cm-1'}", "cm-1") if item["energy"] else 0.0
            for item in levels
        )
        return cls(tuple(int(item["times"]) for item in levels), tuple(energies), "given")

    @property
    def listed(self) -> str:
        """Degeneracies and energies as `parse` takes them."""
        pairs = zip(self.degeneracies, self.energies_cm, strict=True)
        return ", ".join(f"{g}@{e!r} cm-1" if e else str(g) for g, e in pairs)

    @property
    def text(self) -> str:
        """Degeneracies and energies, and the source."""
        return f"electronic degeneracy {self.listed}" + (f" ({self.source})" if self.source else "")

    def functions(self, temperatures_k: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """ln q, U/RT and C_v/R at many temperatures, (n,) each.

        >>> [round(float(x[0]), 4) for x in ElectronicStates((3,)).functions([300.0])]  # ln 3
        [1.0986, 0.0, 0.0]
        """
        t = np.asarray(temperatures_k, dtype=np.float64)
        x = np.array(self.energies_cm) * units.MHZ_PER_CM / (t[:, None] * units.MHZ_PER_K)
        weights = np.array(self.degeneracies) * np.exp(-x)
        q = weights.sum(axis=1)
        first, second = (weights * x).sum(axis=1) / q, (weights * x * x).sum(axis=1) / q
        return np.log(q), first, second - first**2


def electronic_states(molecule: Molecule | None) -> ElectronicStates:
    """The spin degeneracy of a molecule: its multiplicity if known, otherwise 2 for an odd number of electrons and 1 for an even."""
    if molecule is None:
        return ElectronicStates()
    if molecule.multiplicity is not None:
        return ElectronicStates((molecule.multiplicity,), source="multiplicity of the molecule")
    electrons = sum(nucleus.element_number for nucleus in molecule.nuclei) - molecule.charge
    if electrons % 2:
        return ElectronicStates((2,), source="odd number of electrons: a doublet at least")
    return ElectronicStates()
