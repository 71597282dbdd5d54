"""Bounds of A, B, C, and guesses: numbers, or the conformers of a SMILES by a force field."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.requests.readers import Numbers

PREFIX = "SMILES:"
WORST = 0.03  # largest median relative error of the constants of a geometry that serves as a guess


@dataclass(frozen=True, eq=False)
class Bounds:
    """Least and greatest A, B, C in MHz (3,) each."""

    low: Floats
    high: Floats

    @property
    def array(self) -> Floats:
        """A low, A high, B low, ... (6,)."""
        return np.column_stack([self.low, self.high]).ravel()

    def points(self, kappa: Floats) -> slice:
        """The part of an increasing grid of κ = (2B-A-C)/(A-C) within the bounds; κ increases with B and decreases with A and C."""
        (a, b, c), (a2, b2, c2) = self.low, self.high
        lowest = (2 * b - a2 - c2) / (a2 - c2) if a2 > c2 else -1.0
        highest = (2 * b2 - a - c) / (a - c) if a > c else 1.0
        first, last = np.searchsorted(kappa, [lowest, highest])
        return slice(max(int(first) - 1, 0), min(int(last) + 2, len(kappa)))


def guess_values(guess: Any) -> tuple[float, ...]:
    """A, B, C (MHz) of one or several guesses, concatenated: numbers, or the constants of the conformers of `SMILES:...`."""
    if isinstance(guess, str) and guess.startswith(PREFIX):
        return conformer_constants(guess.removeprefix(PREFIX))
    try:
        values = Numbers("MHz", (), "2458,490,409").read(guess)
    except ValueError:
        values = ()
    if not values or len(values) % 3:
        raise ValueError(f"{guess!r}: expected three numbers for each guess, such as 2458,490,409 (MHz), or SMILES:...")
    return values


def conformer_constants(text: str) -> tuple[float, ...]:
    """A, B, C (MHz) of the conformers of a SMILES within 10 kJ/mol of the lowest, concatenated.

    Raises ValueError if the error of the force field exceeds 3 %, and for a molecule that is not an asymmetric top.
    """
    from rotor.molecules.readers.smiles import NEAR_KJ_PER_MOL, conformers
    from rotor.tops.top import Top

    values = list[float]()
    for conformer in conformers(text):
        if conformer.energy_kj_per_mol > NEAR_KJ_PER_MOL:
            continue
        if conformer.molecule.uncertainty is None or conformer.molecule.uncertainty > WORST:
            raise ValueError(
                f"{PREFIX}{text}: the force field knows the geometry of this molecule to no better than "
                f"{conformer.molecule.uncertainty or 1:.0%}, and a guess is to be right within 3 %; give A, B, C as numbers"
            )
        top = Top.from_molecule(conformer.molecule)
        if top.kind != "asymmetric":
            raise ValueError(f"{PREFIX}{text}: its top is {top.kind}; only asymmetric tops can be looked for")
        values += [float(top.constants[name]) for name in "ABC"]
    return tuple(values)
