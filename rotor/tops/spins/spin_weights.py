"""Nuclear-spin weights of rotational levels: the rule that they follow, and the weight of each class.

Four rules cover every rigid molecule: parity of (Ka, Kc) for asymmetric tops, K modulo n for symmetric tops,
parity of J for linear ones, and the irreducible representation for spherical tops. Weights are stored reduced by
their common divisor, in levels and in Q alike.
"""

from __future__ import annotations

from functools import reduce
from math import gcd

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.checks import Renamed
from rotor.frozen import dataclass

SPECIES = ("ee", "eo", "oe", "oo")  # parities of Ka and Kc
MOST_WEIGHT = 2**53  # weights up to here add up exactly
CUBIC_IRREPS = ("A1", "A2", "E", "F1", "F2")  # of the rotation group O


@dataclass(frozen=True)
class SpinWeights:
    """Nuclear-spin weights of the classes of a rule.

    rule, classes:

    - "none": all levels have weight 1.
    - "KaKc": ee, eo, oe, oo, parities of Ka and Kc.
    - "K": 0 ... n-1, |K| modulo n, the weight of one component of a ±K pair. With twofold axes across the main one
      K = 0 levels alternate with J: "0even" and "0odd" (parity of J) stand for class 0, and a pair with K a multiple
      of n, which holds one level of each, weighs their sum.
    - "J": even, odd, the parity of J.
    - "irrep": A, E, F of the rotation group T; A1, A2, E, F1, F2 of O; A, F1, F2, G, H of I. A degenerate level is
      counted once with its components inside the weight, as in the usual 5:2:3 of CH4.

    >>> SpinWeights.from_mapping({"ee": 10, "eo": 30, "oe": 30, "oo": 10})
    SpinWeights(rule='KaKc', classes=('ee', 'eo', 'oe', 'oo'), values=(1, 3, 3, 1))
    >>> SpinWeights.from_mapping({"0even": 14, "0odd": 6, "1": 11, "2": 9, "3": 14, "4": 9, "5": 11}).symmetric_weights(6, 6)
    array(20)
    """

    rule: str = "none"
    classes: tuple[str, ...] = ("all",)
    values: tuple[int, ...] = (1,)

    @classmethod
    def from_mapping(cls, weights: dict[str, int]) -> SpinWeights:
        """Weights from a mapping by class name, reduced by their common divisor; the names of the classes determine the rule."""
        names = {str(name): weight for name, weight in weights.items()}
        rule, classes = _weight_rule(set(names))
        values = [names[name] for name in classes]
        if any(int(v) != v or v < 0 for v in values) or not any(values):
            raise ValueError(f"spin weights {weights}: expected whole numbers of 0 or more, not all 0")
        divisor = reduce(gcd, (int(v) for v in values))
        return cls(rule, classes, tuple(int(v) // divisor for v in values))

    def to_mapping(self) -> dict[str, int]:
        """The weights by class name, as `from_mapping` takes them; empty for the rule "none"."""
        return {} if self.rule == "none" else dict(zip(self.classes, self.values, strict=True))

    def exchanged(self) -> SpinWeights:
        """The weights of levels with odd total spin of two nuclei: the two classes that a half turn distinguishes are exchanged.

        Raises ValueError for weights that do not follow from a half turn about an axis.

        >>> SpinWeights.from_mapping({"ee": 1, "eo": 1, "oe": 0, "oo": 0}).exchanged().to_mapping()
        {'ee': 0, 'eo': 0, 'oe': 1, 'oo': 1}
        """
        weights = self.to_mapping()
        if self.rule in ("none", "J"):
            return SpinWeights(self.rule, self.classes, self.values[::-1])
        for odd in (("oe", "oo"), ("eo", "oe"), ("eo", "oo")) if self.rule == "KaKc" else ():
            sides = [{w for name, w in weights.items() if (name in odd) == side} for side in (False, True)]
            if len(sides[0]) == len(sides[1]) == 1:
                (even,), (other,) = sides
                return SpinWeights(self.rule, self.classes, tuple(even if n in odd else other for n in self.classes))
        raise ValueError(
            f"spin weights {weights} beside a total spin of two nuclei: expected those of half a turn about one axis, such as ee = eo = 1 "
            "and oe = oo = 0, of levels of even total spin; those of odd total spin have them exchanged"
        )

    def with_pair(self, twice: int) -> SpinWeights:
        """The weights of all nuclei, from these weights without a pair of nuclei of spin i = `twice`/2 that a half turn exchanges.

        Of the (2i+1)² functions of the pair, (i+1)(2i+1) have the parity of the total spin 2i, and i(2i+1) the other parity. Raises
        ValueError as `exchanged`.

        >>> SpinWeights.from_mapping({"even": 1, "odd": 0}).with_pair(1).to_mapping()  # two protons
        {'even': 1, 'odd': 3}
        """
        # bosons (2i even): i + 1 parts of even functions to i of odd ones; fermions the reverse
        even, odd = (twice + 2, twice) if twice % 2 == 0 else (twice, twice + 2)
        both = zip(self.classes, self.values, self.exchanged().values, strict=True)
        return SpinWeights.from_mapping({name: even * weight + odd * other for name, weight, other in both})

    def fits_pair(self, twice: int) -> bool:
        """Whether the weights are those of only two nuclei of spin i = `twice`/2: a ratio of i + 1 to i.

        >>> SpinWeights.from_mapping({"ee": 6, "eo": 6, "oe": 3, "oo": 3}).fits_pair(2)
        True
        """
        divisor = gcd(twice, 2)
        return set(self.values) == {(twice + 2) // divisor, twice // divisor}

    @property
    def mean(self) -> float:
        """Mean weight of a component over many levels; the classical limit of Q contains it."""
        if self.rule == "irrep":
            j = np.arange(60)  # the counts of irreps repeat with J modulo 12 (T, O) or 30 (I)
            return float(self.spherical_weights(j).sum() / (2 * j + 1).sum())
        values = self._by_residue() if self.rule == "K" else self.values
        return float(sum(values) / len(values))

    @property
    def modulus(self) -> int:
        """n of weights by K modulo n."""
        self._require(("K",), "K")
        return len(self.classes) - ("0odd" in self.classes)

    def asymmetric_weight(self, species: str) -> int:
        """Weight of a level of an asymmetric top; species: parities of Ka and Kc."""
        if self.rule == "none":
            return 1
        self._require(("KaKc",), "an asymmetric top")
        return self.values[self.classes.index(species)]

    def symmetric_weights(self, j: ArrayLike, k: ArrayLike, oblate: bool = False) -> NDArray[np.int64]:
        """Weights of symmetric-top levels (J, |K|), summed over both signs of K.

        For weights by parities of (Ka, Kc) (an accidentally symmetric top, or one with only twofold axes), K is Ka, or Kc if `oblate`.
        A pair ±K contains both parities of the other quantum number; K = 0 contains that of J.
        """
        j, k = np.broadcast_arrays(np.asarray(j), np.asarray(k))
        if self.rule == "none":
            return np.asarray(np.where(k == 0, 1, 2))  # both signs of K
        self._require(("K", "KaKc"), "a symmetric top")
        if self.rule == "KaKc":
            table = self._whole_numbers().reshape(2, 2)
            table = table.T if oblate else table
            # a pair ±K has both parities of the other quantum number
            return np.asarray(np.where(k == 0, table[0, j % 2], table[k % 2].sum(axis=-1)))
        doubled = np.rint(2 * self._by_residue()).astype(np.int64)
        alone = self._whole_numbers()[j % 2 if "0odd" in self.classes else np.zeros_like(j)]
        return np.asarray(np.where(k == 0, alone, doubled[k % len(doubled)]))

    def spherical_weights(self, j: ArrayLike) -> NDArray[np.int64]:
        """Weights of the levels J of a spherical top, summed over the irreps in its 2J+1 components of K.

        Weights by K or by parities of (Ka, Kc), of an accidentally spherical top, are summed in the same way.
        """
        j = np.asarray(j)
        if self.rule == "none":
            return np.asarray(2 * j + 1)
        self._require(("irrep", "K", "KaKc"), "a spherical top")
        if self.rule == "irrep":
            counts = irreps_in_j(j, self.classes)
            return np.asarray(np.tensordot(self._whole_numbers(), counts, axes=1))
        sums = [self.symmetric_weights(value, np.arange(value + 1)).sum() for value in j.ravel().tolist()]
        return np.array(sums, dtype=np.int64).reshape(j.shape)

    def irrep_weight(self, irrep: str) -> int:
        """Weight of a level of a spherical top with all its 1, 2 or 3 components, by its irrep A1, A2, E, F1 or F2.

        >>> SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3}).irrep_weight("F2")
        3
        """
        if irrep not in CUBIC_IRREPS:
            raise ValueError(f"irrep {irrep!r}: known are {', '.join(CUBIC_IRREPS)}")
        if self.rule == "none":
            return {"A": 1, "E": 2, "F": 3}[irrep[0]]
        self._require(("irrep",), "a spherical top")
        if "G" in self.classes:
            raise ValueError(
                "spin weights of an icosahedral top do not apply here: a tensor of fourth rank does not split its levels"
            )
        return int(self._whole_numbers()[self.classes.index(irrep if irrep in self.classes else irrep[0])])

    def linear_weights(self, j: ArrayLike) -> NDArray[np.int64]:
        """Weights of linear-molecule levels, by parity of J."""
        j = np.asarray(j)
        if self.rule == "none":
            return np.ones(j.shape, dtype=np.int64)
        self._require(("J",), "a linear molecule")
        return np.asarray(self._whole_numbers()[j % 2])

    of_ka_kc = Renamed("asymmetric_weight")
    of_symmetric = Renamed("symmetric_weights")
    of_spherical = Renamed("spherical_weights")
    of_irrep = Renamed("irrep_weight")
    of_j = Renamed("linear_weights")

    def _by_residue(self) -> NDArray[np.float64]:
        """Weight of a component of a pair with |K| > 0, by |K| modulo n; half of 0even + 0odd for residue 0."""
        values = self._whole_numbers().astype(np.float64)
        return np.concatenate([[values[:2].mean()], values[2:]]) if "0odd" in self.classes else values

    def _whole_numbers(self) -> NDArray[np.int64]:
        if max(self.values) > MOST_WEIGHT:
            raise ValueError(
                f"the largest spin weight has {len(str(max(self.values)))} digits, too many to add up exactly; so many "
                "spins leave the weights alike but for a tiny part: use none"
            )
        return np.array(self.values, dtype=np.int64)

    def _require(self, rules: tuple[str, ...], what: str) -> None:
        if self.rule not in rules:
            raise ValueError(
                f"spin weights by {self.rule} ({', '.join(self.classes)}) do not fit {what}; "
                f"give {_EXAMPLES[rules[0]]} or none"
            )


# Irreps of the rotation groups. A class (n, k, count) has `count` rotations by 2πk/n; an irrep has a character for each class
# (Bunker and Jensen, Molecular Symmetry and Spectroscopy, appendix A). E of the group T is the sum of two conjugate irreps.
# g = (1 + √5)/2.
_G = (1 + 5**0.5) / 2
_IRREPS: dict[tuple[str, ...], tuple[tuple[tuple[int, int, int], ...], tuple[tuple[float, ...], ...]]] = {
    ("A", "E", "F"): (
        ((1, 0, 1), (3, 1, 8), (2, 1, 3)),
        ((1, 1, 1), (2, -1, 2), (3, 0, -1)),
    ),
    ("A1", "A2", "E", "F1", "F2"): (
        ((1, 0, 1), (3, 1, 8), (2, 1, 3), (4, 1, 6), (2, 1, 6)),  # of the twofold ones first those along fourfold axes
        ((1, 1, 1, 1, 1), (1, 1, 1, -1, -1), (2, -1, 2, 0, 0), (3, 0, -1, 1, -1), (3, 0, -1, -1, 1)),
    ),
    ("A", "F1", "F2", "G", "H"): (
        ((1, 0, 1), (5, 1, 12), (5, 2, 12), (3, 1, 20), (2, 1, 15)),
        ((1, 1, 1, 1, 1), (3, _G, 1 - _G, 0, -1), (3, 1 - _G, _G, 0, -1), (4, -1, -1, 1, 0), (5, 0, 0, -1, 1)),
    ),
}
IRREPS = dict(zip("TOI", _IRREPS, strict=True))


def character_table(irreps: tuple[str, ...]) -> tuple[tuple[tuple[int, int, int], ...], tuple[tuple[float, ...], ...]]:
    """Classes of rotations of T, O or I, as (n, k, count) for the angle 2πk/n, and the characters of the irreps.

    >>> character_table(IRREPS["T"])[0]
    ((1, 0, 1), (3, 1, 8), (2, 1, 3))
    """
    return _IRREPS[irreps]


def irreps_in_j(j: NDArray[np.int64], irreps: tuple[str, ...]) -> NDArray[np.int64]:
    """How often each irrep of T, O or I (first axis) occurs in the 2J+1 components of K; a degenerate irrep counts once.

    n = Σ g χ_irrep χ_J / Σ g over the classes of g rotations by the angle 2πk/n, where the character of the 2J+1
    functions, χ_J = sin((2J+1)πk/n)/sin(πk/n), is the same for J + n.

    >>> irreps_in_j(np.arange(4), IRREPS["I"]).T.tolist()
    [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 0, 0, 1], [0, 0, 1, 1, 0]]
    """
    classes, table = _IRREPS[irreps]
    sizes = np.array([size for _, _, size in classes], dtype=np.float64)
    characters = []
    for n, k, _ in classes:
        angle = np.pi * k / n
        # periodic in J: the reduced argument keeps the sine exact at high J
        characters.append(2 * j + 1 if n == 1 else np.sin((2 * (j % n) + 1) * angle) / np.sin(angle))
    counts = np.tensordot(np.array(table) * sizes, np.array(characters, dtype=float), axes=1) / sizes.sum()
    # E of T is a pair of conjugate irreps, whose character counts twice in the sum
    halves = np.array([2 if name == "E" and len(irreps) == 3 else 1 for name in irreps])
    return np.asarray(np.rint(counts / halves.reshape((-1,) + (1,) * np.ndim(j))), dtype=np.int64)


_EXAMPLES = {
    "KaKc": '{"ee": 1, "eo": 3, "oe": 3, "oo": 1}',
    "K": '{"0": 2, "1": 1, "2": 1} (by K modulo 3; "0even" and "0odd" in place of "0" where J matters)',
    "J": '{"even": 1, "odd": 3}',
    "irrep": '{"A": 5, "E": 2, "F": 3}',
}


def _weight_rule(names: set[str]) -> tuple[str, tuple[str, ...]]:
    if names == set(SPECIES):
        return "KaKc", SPECIES
    if names == {"even", "odd"}:
        return "J", ("even", "odd")
    for irreps in IRREPS.values():
        if names == set(irreps):
            return "irrep", irreps
    for by_k in (tuple(map(str, range(len(names)))), ("0even", "0odd", *map(str, range(1, len(names) - 1)))):
        if len(names) > 1 and names == set(by_k):
            return "K", by_k
    examples = " or ".join(_EXAMPLES.values())
    raise ValueError(f"spin weights by {sorted(names)}: no rule has these classes; write {examples}")
