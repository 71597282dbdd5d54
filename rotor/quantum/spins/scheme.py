"""Spins and their coupling terms, as effects declare them, and the coupling scheme N + S1 = J, J + I1 = F1, ... = F.

The scheme has the order of the spins and the names of the sums.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from itertools import accumulate
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.spins.coupling import patterns, patterns_of_three, patterns_of_total, recoupling, recoupling_of_three
from rotor.quantum.spins.operators import EVERY_STATE, Rotor

if TYPE_CHECKING:
    from rotor.tops.top import Top


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


@dataclass(frozen=True)
class Scheme:
    """The spins in the order of coupling, and names of the intermediate sums.

    equivalent: number of last spins (two or three) that are coupled to a total spin first; else 0. conserved: names of sums that count as
    good quantum numbers; elements between their different values are neglected, as in perturbation theory.
    """

    spins: tuple[Spin, ...]
    conserved: frozenset[str] = frozenset()
    twice: tuple[int, ...] = field(init=False)
    equivalent: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        names = [spin.name for spin in self.spins]
        if len(set(names)) < len(names):
            raise ValueError(f"spins {', '.join(names)}: every spin has a name of its own")
        object.__setattr__(self, "twice", tuple(spin.twice for spin in self.spins))
        together = [spin.total for spin in self.spins if spin.total]
        last = self.spins[-max(len(together), 1) :]
        if together and (
            len(together) not in (2, 3) or len({(s.total, s.twice, s.electron) for s in last}) > 1 or last[0].electron
        ):
            raise ValueError(
                "spins that are coupled to a total are two nuclei or three of one size, and the last ones: "
                f"{', '.join(spin.name for spin in self.spins)}"
            )
        object.__setattr__(self, "equivalent", len(together))

    @property
    def total(self) -> int:
        """Twice the sum of all spins."""
        return sum(self.twice)

    def patterns(self, twice_f: int) -> Ints:
        """The coupling patterns N, ..., F of one doubled F, doubled."""
        of = {0: patterns, 2: patterns_of_total, 3: patterns_of_three}[self.equivalent]
        return of(self.twice, twice_f)

    @property
    def one_by_one(self) -> Scheme:
        """The scheme without a total of equivalent spins."""
        return replace(self, spins=tuple(replace(spin, total="") for spin in self.spins)) if self.equivalent else self

    def recoupling(self, twice_f: int) -> tuple[Ints, Floats]:
        """Patterns of one F with spins coupled one by one, and their amplitudes in patterns with a total spin, (one by one, total)."""
        plain = patterns(self.twice, twice_f)
        of = recoupling_of_three if self.equivalent == 3 else recoupling
        return plain, of(self.twice, plain, self.patterns(twice_f))

    def classes(self, patterns: Ints) -> Ints:
        """1 for patterns whose function of two equivalent spins changes sign with their exchange, else 0."""
        if self.equivalent != 2:
            return np.zeros(len(patterns), dtype=np.int64)
        return np.asarray((self.twice[-1] + self.twice[-2] - patterns[:, -2]) // 2 % 2)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantum numbers after each spin: j after electrons, f1, f2, ..., f after the last nucleus.

        >>> Scheme((Spin("S", 1, True), Spin("14N", 2))).names, Scheme((Spin("Cl1", 3), Spin("Cl2", 3))).names
        (('j', 'f'), ('f1', 'f'))
        """
        electrons = [f"j{i + 1}" if i else "j" for i, spin in enumerate(self.spins) if spin.electron]
        nuclei = len(self.spins) - len(electrons)
        sums = [*electrons, *(f"f{i + 1}" for i in range(nuclei - 1)), *(["f"] if nuclei else [])]
        total_names: list[str] = {0: [], 2: ["i_tot", "f"], 3: ["i_sym", "i_tot", "f"]}[self.equivalent]
        return (*sums[: len(sums) - self.equivalent], *total_names)

    @property
    def half(self) -> tuple[bool, ...]:
        """Whether each sum is a half-integer."""
        halves = [bool(total % 2) for total in accumulate(self.twice)]
        last = halves[-1:]
        total_halves = {0: [], 2: [False, *last], 3: [False, sum(self.twice[-3:]) % 2 == 1, *last]}[self.equivalent]
        return (*halves[: len(halves) - self.equivalent], *total_halves)

    @property
    def halves(self) -> frozenset[str]:
        """Names of the sums that are half-integers."""
        return frozenset(name for name, half in zip(self.names, self.half, strict=True) if half)

    def sums_of(self, labels: Ints) -> dict[str, Ints]:
        """The sums of labels (levels, columns as `SolvedBlock.labels`) by name, doubled where they are half-integers."""
        columns = zip(self.names, self.half, labels[:, 4:].T, strict=True)
        return {name: column if half else column // 2 for name, half, column in columns}

    @property
    def conserved_columns(self) -> list[int]:
        """Columns of the patterns that hold conserved sums."""
        return [column for column, name in enumerate(("n", *self.names)) if name in self.conserved]

    def count_of(self, acting: tuple[int, ...]) -> int:
        """Number of equal operators, turned by 120° each, that an operator on these places represents.

        3 if it acts on one of three equivalent spins, else 1.
        """
        return 3 if self.equivalent == 3 and max(acting, default=-1) >= len(self.spins) - 3 else 1

    def place(self, name: str) -> int:
        """The place of a spin in the order of coupling."""
        for place, spin in enumerate(self.spins):
            if spin.name == name:
                return place
        raise ValueError(f"spin {name}: the spins here are {', '.join(spin.name for spin in self.spins) or 'none'}")


class DeclaresSpins(Protocol):
    """An effect as the coupling scheme sees it: `QuantumEffect`, without an import of that module, which imports this one."""

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """Spins of the effect."""

    def conserved_sums(self, top: Top) -> frozenset[str]:
        """Names of sums that count as good quantum numbers."""


def scheme_of(top: Top, effects: Sequence[DeclaresSpins]) -> Scheme:
    """The spins of all effects, each once, electrons first; ValueError if two effects differ in the size of a spin."""
    spins: dict[str, Spin] = {}
    for spin in (spin for effect in effects for spin in effect.spins(top)):
        if spins.setdefault(spin.name, spin) != spin:
            raise ValueError(f"spin {spin.name}: given as {spins[spin.name].twice}/2 and as {spin.twice}/2")
    conserved = frozenset(name for effect in effects for name in effect.conserved_sums(top))
    return Scheme(tuple(sorted(spins.values(), key=lambda spin: not spin.electron)), conserved)
