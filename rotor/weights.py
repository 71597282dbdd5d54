"""Nuclear-spin weights of rotational levels: which rule they follow and what each class weighs.

Four rules cover every rigid molecule: parity of (Ka, Kc) for asymmetric tops, K modulo n for symmetric tops,
parity of J for linear ones, and the irreducible representation for spherical tops. Weights are kept reduced by
their common divisor, in levels and in Q alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from math import gcd

import numpy as np
from numpy.typing import ArrayLike, NDArray

SPECIES = ("ee", "eo", "oe", "oo")  # parities of Ka and Kc


@dataclass(frozen=True)
class SpinWeights:
    """Weights of the classes of one rule.

    rule: "none", "KaKc" (classes ee, eo, oe, oo), "K" (classes 0 ... n-1: K modulo n), "J" (classes even, odd) or
    "irrep" (A, E, F of the rotation group T; or A1, A2, E, F1, F2 of the group O).
    An E level is counted once with its two components inside the weight, as in the usual 5:2:3 of CH4.

    >>> SpinWeights.from_mapping({"ee": 10, "eo": 30, "oe": 30, "oo": 10})
    SpinWeights(rule='KaKc', classes=('ee', 'eo', 'oe', 'oo'), values=(1, 3, 3, 1))
    """

    rule: str = "none"
    classes: tuple[str, ...] = ("all",)
    values: tuple[int, ...] = (1,)

    @classmethod
    def from_mapping(cls, weights: dict[str, int]) -> SpinWeights:
        """Weights by class name, reduced by their common divisor; the names tell the rule."""
        names = {str(name): weight for name, weight in weights.items()}
        rule, classes = _rule_of(set(names))
        values = [names[name] for name in classes]
        if any(int(v) != v or v < 0 for v in values) or not any(values):
            raise ValueError(f"spin weights {weights}: whole numbers of 0 or more, not all 0, are wanted")
        divisor = reduce(gcd, (int(v) for v in values))
        return cls(rule, classes, tuple(int(v) // divisor for v in values))

    def to_mapping(self) -> dict[str, int]:
        """The weights by class name, as `from_mapping` takes them; empty for the rule "none"."""
        return {} if self.rule == "none" else dict(zip(self.classes, self.values, strict=True))

    def of_ka_kc(self, species: str) -> int:
        """Weight of an asymmetric-top level whose parities of Ka and Kc are `species`."""
        if self.rule == "none":
            return 1
        self._require("KaKc", "an asymmetric top")
        return self.values[self.classes.index(species)]

    def of_k(self, k: ArrayLike) -> NDArray[np.int64]:
        """Weights of symmetric-top levels with the given |K|, one component of the K doublet each."""
        k = np.asarray(k)
        if self.rule == "none":
            return np.ones(k.shape, dtype=np.int64)
        self._require("K", "a symmetric top")
        return np.array(self.values, dtype=np.int64)[k % len(self.values)]

    def of_j(self, j: ArrayLike) -> NDArray[np.int64]:
        """Weights of linear-molecule levels, or of a spherical top's levels summed over the irreps in each J.

        For a spherical top the number is the weight times the number of levels: of 2J+1 components of K,
        how many spin-weighted ones exist.
        """
        j = np.asarray(j)
        if self.rule == "none":
            return np.ones(j.shape, dtype=np.int64)
        self._require("J", "a linear molecule")
        return np.array(self.values, dtype=np.int64)[j % 2]

    def _require(self, rule: str, what: str) -> None:
        if self.rule != rule:
            raise ValueError(
                f"spin weights by {self.rule} ({', '.join(self.classes)}) do not fit {what}; "
                f"give {_EXAMPLES[rule]} or none"
            )


_EXAMPLES = {
    "KaKc": '{"ee": 1, "eo": 3, "oe": 3, "oo": 1}',
    "K": '{"0": 2, "1": 1, "2": 1} (by K modulo 3)',
    "J": '{"even": 1, "odd": 3}',
    "irrep": '{"A": 5, "E": 2, "F": 3}',
}


def _rule_of(names: set[str]) -> tuple[str, tuple[str, ...]]:
    if names == set(SPECIES):
        return "KaKc", SPECIES
    if names == {"even", "odd"}:
        return "J", ("even", "odd")
    for irreps in (("A", "E", "F"), ("A1", "A2", "E", "F1", "F2")):
        if names == set(irreps):
            return "irrep", irreps
    by_k = tuple(str(i) for i in range(len(names)))
    if len(names) > 1 and names == set(by_k):
        return "K", by_k
    raise ValueError(f"spin weights by {sorted(names)}: no rule has these classes; write " + " or ".join(_EXAMPLES.values()))
