"""Guesses of A, B, C: numbers, or the conformers of a SMILES by a force field."""

from __future__ import annotations

from typing import Any

from rotor.requests.lists import Numbers

PREFIX = "SMILES:"
WORST = 0.03  # largest median relative error of the constants of a geometry that serves as a guess


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
                f"{PREFIX}{text}: rotational constants from the force field are good to "
                f"{conformer.molecule.uncertainty or 1:.0%} only, and a guess needs 3 %; give A, B, C as numbers"
            )
        top = Top.from_molecule(conformer.molecule)
        if top.kind != "asymmetric":
            raise ValueError(f"{PREFIX}{text}: its top is {top.kind}; only asymmetric tops can be looked for")
        values += [float(top.constants[name]) for name in "ABC"]
    return tuple(values)
