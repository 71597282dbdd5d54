"""Real functions under time reversal.

Time reversal θ takes a labelled function to ε times another, θ|a⟩ = ε_a |a'⟩ with θ² = 1. The functions

    |a +) = φ (|a⟩ + θ|a⟩)/√2,    |a -) = i φ (|a⟩ - θ|a⟩)/√2,    φ = i^J,

for a function that is its own partner φ|a⟩ where ε = 1 and iφ|a⟩ where ε = -1, are unchanged by θ but for φ. Every scalar that θ leaves
alone, and every molecule-fixed tensor of even rank of this kind, has real reduced elements between them; tensors of odd rank (a dipole)
are i times real, and both are exchanged for operators that change sign under θ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.elements import Elements, merged
from rotor.quantum.basis.labelled import Basis
from rotor.quantum.operators.algebra import Labels, Operator

TimeReversal = Callable[[Labels], tuple[dict[str, Ints], Floats]]  # labels -> labels that change, and signs ε


@dataclass(frozen=True, eq=False)
class RealFunctions:
    """The functions |a ±) of a basis, in the order of its rows: the pair a, a' stands at the rows of a (+) and a' (-).

    labels: those of a, the partner that comes later in the basis; "s" is 1 for (+) and -1 for (-).
    """

    basis: Basis
    labels: dict[str, Ints]
    _functions: Ints
    _factors: NDArray[Any]

    def __len__(self) -> int:
        return len(self.basis)

    def elements(self, operators: Sequence[Operator]) -> Elements:
        """Elements of operators between the real functions."""
        return self.transformed(self.basis.elements(operators))

    def transformed(self, plain: Elements) -> Elements:
        """Elements between the real functions, of elements between those of the basis."""
        pieces = []
        for a in (0, 1):
            for b in (0, 1):
                factor = self._factors[a, plain.rows].conj() * self._factors[b, plain.columns]
                acts = np.flatnonzero(factor)
                rows, columns = self._functions[a, plain.rows[acts]], self._functions[b, plain.columns[acts]]
                pieces.append((rows, columns, plain.values[:, acts] * factor[acts]))
        rows, columns, values = (np.concatenate(piece, axis=-1) for piece in zip(*pieces, strict=True))
        return merged(plain.count, rows, columns, values)


def real_functions(basis: Basis, reversal: TimeReversal) -> RealFunctions:
    """The real functions of a basis under a time reversal, with the phases i^J of `rotor.quantum.tensors`."""
    changed, sign = reversal(basis.labels)
    rows = np.arange(len(basis))
    partner = basis.rows({**basis.labels, **changed})
    if (partner < 0).any():
        raise ValueError("real functions: time reversal leads out of the basis")
    later, alone = rows >= partner, rows == partner
    phase = 1j ** (np.asarray(basis.labels.get("J", np.zeros(len(basis), dtype=np.int64))) % 4)
    half = 1 / np.sqrt(2)
    plus = np.where(alone, np.where(sign > 0, 1.0, 1.0j), half * np.where(later, 1.0, sign))
    minus = np.where(alone, 0.0, 1j * half * np.where(later, 1.0, -sign))
    representative = np.where(later, rows, partner)
    labels = {name: column[representative] for name, column in basis.labels.items()}
    labels["s"] = np.where(later, np.where(alone & (sign < 0), -1, 1), -1)
    functions = np.stack([representative, np.where(later, partner, rows)])
    return RealFunctions(basis, labels, functions, np.stack([plus, minus]) * phase)


def rotation_reversal(labels: Labels) -> tuple[dict[str, Ints], Floats]:
    """Time reversal of |J K⟩, of further labels that it leaves alone, and of a free rotor's k: K, k to -K, -k with (-1)^K."""
    changed = {name: -labels[name] for name in ("K", "k") if name in labels}
    return changed, np.where(labels["K"] % 2, -1.0, 1.0)
