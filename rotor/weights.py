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
CUBIC_IRREPS = ("A1", "A2", "E", "F1", "F2")  # of the rotation group O


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

    @property
    def mean(self) -> float:
        """The weight of one component averaged over many levels: what the classical limit of Q carries."""
        if self.rule == "irrep":
            j = np.arange(12)  # the counts of irreps repeat with J modulo 12
            return float(self.of_spherical(j).sum() / (2 * j + 1).sum())
        return sum(self.values) / len(self.values)

    def of_ka_kc(self, species: str) -> int:
        """Weight of an asymmetric-top level whose parities of Ka and Kc are `species`."""
        if self.rule == "none":
            return 1
        self._require("KaKc", "an asymmetric top")
        return self.values[self.classes.index(species)]

    def of_symmetric(self, j: ArrayLike, k: ArrayLike) -> NDArray[np.int64]:
        """Weights of symmetric-top levels (J, |K|), summed over both signs of K.

        Weights are by K modulo n, of one component; a K doublet counts twice.
        """
        k = np.asarray(k)
        both: NDArray[np.int64] = np.where(k == 0, 1, 2)
        if self.rule == "none":
            return both
        self._require("K", "a symmetric top")
        return np.asarray(both * np.array(self.values, dtype=np.int64)[k % len(self.values)])

    def of_spherical(self, j: ArrayLike) -> NDArray[np.int64]:
        """Weights of a spherical top's levels of each J, summed over the irreps that its 2J+1 components of K hold."""
        j = np.asarray(j)
        if self.rule == "none":
            return np.asarray(2 * j + 1)
        self._require("irrep", "a spherical top")
        counts = _irreps_in_j(j, self.classes)
        total = np.zeros(j.shape, dtype=np.int64)
        for weight, count in zip(self.values, counts, strict=True):
            total += weight * count
        return total

    def of_irrep(self, irrep: str) -> int:
        """Weight of one level of a spherical top, over its 1, 2 or 3 components, by its irrep A1, A2, E, F1 or F2.

        >>> SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3}).of_irrep("F2")
        3
        """
        if irrep not in CUBIC_IRREPS:
            raise ValueError(f"irrep {irrep!r}: known are {', '.join(CUBIC_IRREPS)}")
        if self.rule == "none":
            return {"A": 1, "E": 2, "F": 3}[irrep[0]]
        self._require("irrep", "a spherical top")
        return self.values[self.classes.index(irrep if irrep in self.classes else irrep[0])]

    def of_j(self, j: ArrayLike) -> NDArray[np.int64]:
        """Weights of linear-molecule levels, by parity of J."""
        j = np.asarray(j)
        if self.rule == "none":
            return np.ones(j.shape, dtype=np.int64)
        self._require("J", "a linear molecule")
        return np.asarray(np.array(self.values, dtype=np.int64)[j % 2])

    def _require(self, rule: str, what: str) -> None:
        if self.rule != rule:
            raise ValueError(
                f"spin weights by {self.rule} ({', '.join(self.classes)}) do not fit {what}; "
                f"give {_EXAMPLES[rule]} or none"
            )


def _irreps_in_j(j: NDArray[np.int64], classes: tuple[str, ...]) -> list[NDArray[np.int64]]:
    """How often each irrep of T or O stands in the 2J+1 components of K; E counts pairs, F triples.

    By characters: χ(C3) = 1, 0, -1 for J mod 3; χ(C2) = (-1)^J; χ(C4) = 1, 1, -1, -1 for J mod 4 (Bunker and Jensen,
    table B-2).
    """
    n = 2 * j + 1
    c2, c3 = 1 - 2 * (j % 2), np.array([1, 0, -1])[j % 3]
    if len(classes) == 3:
        return [(n + 3 * c2 + 8 * c3) // 12, (n + 3 * c2 - 4 * c3) // 12, (n - c2) // 4]
    c4 = np.array([1, 1, -1, -1])[j % 4]
    return [
        (n + 8 * c3 + 6 * c2 + 6 * c4 + 3 * c2) // 24,
        (n + 8 * c3 - 6 * c2 - 6 * c4 + 3 * c2) // 24,
        (2 * n - 8 * c3 + 6 * c2) // 24,
        (3 * n - 6 * c2 + 6 * c4 - 3 * c2) // 24,
        (3 * n + 6 * c2 - 6 * c4 - 3 * c2) // 24,
    ]


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
    for irreps in (("A", "E", "F"), CUBIC_IRREPS):
        if names == set(irreps):
            return "irrep", irreps
    by_k = tuple(str(i) for i in range(len(names)))
    if len(names) > 1 and names == set(by_k):
        return "K", by_k
    raise ValueError(
        f"spin weights by {sorted(names)}: no rule has these classes; write " + " or ".join(_EXAMPLES.values())
    )
