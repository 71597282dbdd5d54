"""Spins and their coupling terms, as effects declare them."""

from __future__ import annotations

from dataclasses import dataclass

from rotor.quantum.spins.operators import (
    EVERY_STATE,
    Rotor,
)


@dataclass(frozen=True)
class Spin:
    """One spin: its name in parameters, twice its size (2I, an integer), and whether it is an electron spin.

    A spin of size 0 is a placeholder: it adds a quantum number but no splitting.

    Spins are coupled in the order in which effects first name them, electrons before nuclei. total: two or three nuclei with an equal
    name here, such as "I", are equivalent. They are coupled to a total spin first, which is coupled last. Terms of three equivalent nuclei
    name only the first, or the first and the second (see `three_equivalent`).
    """

    name: str
    twice: int
    electron: bool = False
    total: str = ""

    def __post_init__(self) -> None:
        if self.twice < 0 or self.twice != int(self.twice):
            raise ValueError(f"spin {self.name}: 2I = {self.twice}; twice a spin is a whole number, 0 or more")


@dataclass(frozen=True)
class SpinTerm:
    """The operator that a parameter multiplies: `factor` times X^K(N) · W^K of the spins.

    name: name of the parameter. spins: none, one (its vector), one twice (its quadrupole, T²(I, I)/(2I(2I-1))) or two (their product,
    coupled to the rank of `rotor`). n2, nz2: powers of N² and Nz². ns: power of N·S1. bra, ket: the states v that it connects; where they
    differ the conjugate is added, and an operator that is odd under time reversal has a factor i.
    """

    name: str
    spins: tuple[str, ...]
    rotor: Rotor
    factor: float = 1.0
    n2: int = 0
    nz2: int = 0
    ns: int = 0
    bra: int = EVERY_STATE
    ket: int = EVERY_STATE

    def __post_init__(self) -> None:
        expected = {0: (0,), 1: (1,), 2: (0, 2)}.get(len(self.spins), ())
        if self.rotor.rank not in expected or (len(set(self.spins)) < len(self.spins) and self.rotor.rank != 2):
            raise ValueError(
                f"{self.name}: {len(self.spins)} spins {self.spins} cannot close an operator of rank {self.rotor.rank}"
            )
        if self.rotor.odd and self.bra == self.ket:
            raise ValueError(
                f"{self.name}: time reversal changes its sign; such an operator connects different states only"
            )
