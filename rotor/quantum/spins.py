"""Spins coupled to the rotation, N + S1 = J, J + I1 = F1, ... = F: which there are, what their sums are called, and the levels.

    H = H_rot + Σ_terms (`rotor.quantum.spin_operators`)

Levels are solved F by F (`spin_blocks`) over the eigenstates of the rotation (`spin_rotor`), with coefficients of coupling
(`spin_coupling`); `spin_lines` has elements of dipoles between them, and derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING

from rotor.arrays import Floats, Ints
from rotor.quantum.spin_operators import SpinTerm

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.quantum.levels import Levels
    from rotor.quantum.reduced import Tensors
    from rotor.quantum.spin_blocks import SpinBlock
    from rotor.tops.top import Top

__all__ = [
    "Scheme",
    "Spin",
    "SpinTerm",
    "scheme_of",
    "spin_amplitudes",
    "spin_blocks_connected",
    "spin_derivatives",
    "spin_levels",
]


@dataclass(frozen=True)
class Spin:
    """One spin: its name, as parameters have it, twice its size (2I, a whole number), and whether it is an electron's.

    Spins are coupled in the order in which effects first name them, electrons' before nuclei's.
    """

    name: str
    twice: int
    electron: bool = False

    def __post_init__(self) -> None:
        if self.twice < 1 or self.twice != int(self.twice):
            raise ValueError(f"spin {self.name}: 2I = {self.twice}; twice a spin is a whole number, 1 or more")


@dataclass(frozen=True)
class Scheme:
    """Which spins are coupled, and what the angular momenta on the way to F are called."""

    spins: tuple[Spin, ...]
    twice: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        names = [spin.name for spin in self.spins]
        if len(set(names)) < len(names):
            raise ValueError(f"spins {', '.join(names)}: every spin has a name of its own")
        object.__setattr__(self, "twice", tuple(spin.twice for spin in self.spins))

    @property
    def total(self) -> int:
        """Twice the sum of all spins."""
        return sum(self.twice)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantum numbers after each spin: j after electrons, f1, f2, ..., f after the last nucleus.

        >>> Scheme((Spin("S", 1, True), Spin("14N", 2))).names, Scheme((Spin("Cl1", 3), Spin("Cl2", 3))).names
        (('j', 'f'), ('f1', 'f'))
        """
        electrons = [f"j{i + 1}" if i else "j" for i, spin in enumerate(self.spins) if spin.electron]
        nuclei = len(self.spins) - len(electrons)
        return (*electrons, *(f"f{i + 1}" for i in range(nuclei - 1)), *(["f"] if nuclei else []))

    @property
    def half(self) -> tuple[bool, ...]:
        """Which of them are half-integers."""
        return tuple(bool(total % 2) for total in accumulate(self.twice))

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
    return Scheme(tuple(sorted(found.values(), key=lambda spin: not spin.electron)))


def spin_levels(
    top: Top, effects: tuple[QuantumEffect, ...], jmin: int, jmax: int, executor: Executor | None = None
) -> Levels:
    """All levels of a top with spins whose label has N from `jmin` to `jmax`, by (v), n, k or ka and kc, j, f1, ... f.

    Every F that such an N reaches is solved with all its N, so that nothing is left out of a block.
    """
    from rotor.quantum.spin_blocks import levels_of_f

    total = scheme_of(top, effects).total
    first = max(2 * jmin - total, total % 2)
    return levels_of_f(top, effects, range(first, 2 * jmax + total + 1, 2), (jmin, jmax), executor)


def spin_derivatives(top: Top, levels: Levels, names: Sequence[str], rows: Ints) -> Floats:
    """∂E/∂c of levels with spins, (rows, names)."""
    from rotor.quantum.spin_lines import derivatives

    return derivatives(top, levels, names, rows)


def spin_amplitudes(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> Floats:
    """Real reduced elements between all states of two blocks, (n_up, n_low)."""
    from rotor.quantum.spin_lines import amplitudes

    return amplitudes(up, low, tensors)


def spin_blocks_connected(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> bool:
    """Whether the tensors have an element between two blocks."""
    from rotor.quantum.spin_lines import connected

    return connected(up, low, tensors)
