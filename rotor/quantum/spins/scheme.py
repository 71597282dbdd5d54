"""Which spins there are, in which order they are coupled, N + S1 = J, J + I1 = F1, ... = F, and what their sums are called."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Ints
from rotor.quantum.spins.coupling import patterns, patterns_of_total
from rotor.quantum.spins.terms import Spin

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True)
class Scheme:
    """Which spins are coupled, and what the angular momenta on the way to F are called.

    paired: whether the last two are coupled to a total spin first. conserved: names of sums between whose values all elements are left
    out, as in perturbation theory.
    """

    spins: tuple[Spin, ...]
    conserved: frozenset[str] = frozenset()
    twice: tuple[int, ...] = field(init=False)
    paired: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        names = [spin.name for spin in self.spins]
        if len(set(names)) < len(names):
            raise ValueError(f"spins {', '.join(names)}: every spin has a name of its own")
        object.__setattr__(self, "twice", tuple(spin.twice for spin in self.spins))
        together = [spin.total for spin in self.spins if spin.total]
        pair = self.spins[-2:]
        if together and (
            len(together) != 2 or len({(s.total, s.twice, s.electron) for s in pair}) > 1 or pair[0].electron
        ):
            raise ValueError(
                "spins that are coupled to a total are two nuclei of one size, and the last ones: "
                f"{', '.join(spin.name for spin in self.spins)}"
            )
        object.__setattr__(self, "paired", bool(together))

    @property
    def total(self) -> int:
        """Twice the sum of all spins."""
        return sum(self.twice)

    def patterns(self, twice_f: int) -> Ints:
        """The coupling patterns of one F, doubled: N, ..., F."""
        return patterns_of_total(self.twice, twice_f) if self.paired else patterns(self.twice, twice_f)

    def classes(self, every: Ints) -> Ints:
        """Of patterns, 1 where two equivalent spins have a function that changes sign with their exchange, else 0."""
        if not self.paired:
            return np.zeros(len(every), dtype=np.int64)
        return np.asarray((self.twice[-1] + self.twice[-2] - every[:, -2]) // 2 % 2)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantum numbers after each spin: j after electrons, f1, f2, ..., f after the last nucleus.

        >>> Scheme((Spin("S", 1, True), Spin("14N", 2))).names, Scheme((Spin("Cl1", 3), Spin("Cl2", 3))).names
        (('j', 'f'), ('f1', 'f'))
        """
        electrons = [f"j{i + 1}" if i else "j" for i, spin in enumerate(self.spins) if spin.electron]
        nuclei = len(self.spins) - len(electrons)
        sums = [*electrons, *(f"f{i + 1}" for i in range(nuclei - 1)), *(["f"] if nuclei else [])]
        return tuple([*sums[:-2], "i_tot", "f"] if self.paired else sums)

    @property
    def half(self) -> tuple[bool, ...]:
        """Which of them are half-integers."""
        halves = [bool(total % 2) for total in accumulate(self.twice)]
        return tuple([*halves[:-2], False, halves[-1]] if self.paired else halves)

    @property
    def conserved_columns(self) -> list[int]:
        """Columns of the patterns that are conserved."""
        return [column for column, name in enumerate(("n", *self.names)) if name in self.conserved]

    def place(self, name: str) -> int:
        """The place of a spin by its name."""
        for place, spin in enumerate(self.spins):
            if spin.name == name:
                return place
        raise ValueError(f"spin {name}: the spins here are {', '.join(spin.name for spin in self.spins) or 'none'}")


def scheme_of(top: Top, effects: Sequence[QuantumEffect]) -> Scheme:
    """The spins of all effects, each once, electrons first; ValueError where two effects give one of them another size."""
    found: dict[str, Spin] = {}
    for spin in (spin for effect in effects for spin in effect.spins(top)):
        if found.setdefault(spin.name, spin) != spin:
            raise ValueError(f"spin {spin.name}: given as {found[spin.name].twice}/2 and as {spin.twice}/2")
    conserved = frozenset(name for effect in effects for name in effect.conserved_sums(top))
    return Scheme(tuple(sorted(found.values(), key=lambda spin: not spin.electron)), conserved)
