"""Options of each state in a .par file: spins, range of K, weights, and labels of levels.

The first line sets the defaults of all states. If VSYM is negative another line follows with the differences for the state |NVIB|
(H. M. Pickett, documentation of SPFIT and SPCAT, "line 3, option information").
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.formats.spcat.hamiltonian.code_table import file_codes
from rotor.formats.spcat.hamiltonian.codes import NOT_YET
from rotor.formats.spcat.text.par import Options, ParameterFile
from rotor.frozen import dataclass

SPECIES = ((0, 0), (1, 0), (1, 1), (0, 1))  # A, Bx, By, Bz by the parities of K along the axis of the basis and across
_NUMBER = np.array([[0, 3], [1, 2]])


class Fold(NamedTuple):
    """K - l modulo n of the levels of A or B species and of E species that have weights, for a top with an n-fold axis."""

    n: int
    alone: int
    paired: tuple[int, ...]


FOLDS = {
    4: Fold(2, 0, ()), 5: Fold(2, 1, ()), 6: Fold(3, 0, (1, 2)), 7: Fold(4, 0, (1, 3)), 8: Fold(4, 2, ()),
    9: Fold(5, 0, (1, 2, 3, 4)), 10: Fold(6, 0, (2, 4)), 11: Fold(6, 3, (1, 5)),
}  # fmt: skip  # by IAX


ALL_K = 10**6  # a KNMAX without effect
MOST_SPINS = 9


def odd_under(iax: int, ka: Ints | int, kc: Ints | int) -> Ints | int:
    """1 for levels that the half turn of IAX 1, 2, 3 (about a, b, c), or across the axis of IAX 4 to 11, changes in sign, else 0."""
    return {1: ka, 3: kc}.get(iax, ka + kc) % 2


@dataclass(frozen=True)
class StateOptions:
    """Options of one state: doubled spins in the order of coupling, range of K, axis and weights, weight of E levels, l.

    i_tot: whether the last two spins (three with a threefold axis) are coupled to a total first.
    """

    number: int
    spins: tuple[int, ...]
    kmin: int
    kmax: int
    iax: int
    plus: int
    minus: int
    e_weight: int
    l_code: int
    i_tot: bool

    @property
    def fold(self) -> int:
        """n of the n-fold axis of the weights, 0 for weights of a half turn."""
        return FOLDS[self.iax].n if self.iax in FOLDS else 0

    @property
    def has_e_levels(self) -> bool:
        """Whether the weights tell levels of E species from others."""
        return self.iax in FOLDS and bool(FOLDS[self.iax].paired) and self.equivalent < 3

    @property
    def equivalent(self) -> int:
        """Number of last spins that are coupled to a total first: 0, 2 or 3."""
        return (3 if self.fold == 3 else 2) if self.i_tot else 0

    def is_threefold(self, spins: Sequence[int]) -> bool:
        """Whether an operator with these spins, numbered from 1, acts on one of three equivalent ones."""
        return self.equivalent == 3 and max(spins, default=0) > len(self.spins) - 3

    @property
    def linear(self) -> bool:
        """Whether the basis has only K = 0."""
        return self.kmin == self.kmax == 0

    @property
    def has_fixed_k(self) -> bool:
        """Whether K is a quantum number of the state, such as l of a bending state of a linear molecule."""
        return self.kmin == self.kmax

    @property
    def is_cut(self) -> bool:
        """Whether KNMIN or KNMAX excludes K from a basis of several K."""
        return not self.has_fixed_k and (self.kmin > 0 or self.kmax < ALL_K)

    def with_all_k(self) -> StateOptions:
        """The state with all K up to N in its basis, unless it has a single K."""
        return self if self.has_fixed_k else replace(self, kmin=0, kmax=ALL_K)

    def with_k_to(self, highest_n: int) -> StateOptions:
        """The state with all K if its KNMAX excludes no level up to the highest N; equal bases then compare as equal."""
        return self if self.has_fixed_k or self.kmax < highest_n else replace(self, kmax=ALL_K)

    def weights(self, ka: Ints, kc: Ints, k: Ints, odd_spins: Ints | int = 0) -> Ints:
        """Nuclear-spin weight of one component of levels, as in the file; zero or less for a level that does not exist.

        ka, kc (n,): labels. k (n,): K along the axis of the basis. odd_spins (n,): odd if a half turn across the axis changes the sign of
        the function of equivalent spins, which exchanges the two weights.
        Returns: WTPL, WTMN or EWT, by the axis of the file.
        """
        weight = self.class_weight(ka, kc, odd_spins)
        fold = FOLDS.get(self.iax)
        if fold is None or self.equivalent == 3:  # with their spins all levels are of A species
            return weight
        class_of = (k - self.l_code) % fold.n
        # pairs that turn into each other under the axis have the weight of E
        paired = np.where(np.isin(class_of, fold.paired) & self._has_e(weight), self.e_weight, 0)
        return np.where(class_of == fold.alone, weight, paired)

    def _has_e(self, weight: Ints) -> NDArray[np.bool_]:
        """Whether E levels exist in Wang blocks of this weight.

        For a threefold axis blocks of weight 0 are left out entirely, so that half of the E levels are listed, with twice their weight."""
        return np.asarray((weight > 0) | (self.fold != 3))

    def odd_spins(self, quanta: Mapping[str, Ints]) -> Ints | int:
        """Odd for levels with odd I_tot of two equivalent spins, or functions of species A2 of three."""
        return np.asarray(quanta["i_sym"] % 6 == 1, dtype=np.int64) if self.equivalent == 3 else quanta.get("i_tot", 0)

    def class_weight(self, ka: Ints, kc: Ints, odd_spins: Ints | int = 0) -> Ints:
        """WTPL or WTMN by the parities of Ka and Kc, (n,), without E levels."""
        return np.where((odd_under(self.iax, ka, kc) + odd_spins) % 2 == 0, self.plus, self.minus)

    def block_weights(self, ka: Ints, kc: Ints, k: Ints) -> Ints:
        """Weights of the A (or B) and of the E levels in the Wang block of a level, (n, 2), for an n-fold axis; 0 if there are none."""
        fold, class_weight = FOLDS[self.iax], np.where((ka + kc) % 2 == 0, self.plus, self.minus)
        steps = np.arange(0, 2 * fold.n, 2)  # K that stand in one Wang block, modulo n
        classes = (k[:, None] - self.l_code + steps) % fold.n
        alone = (classes == fold.alone).any(axis=1)
        # which names both kinds of blocks of a 4-fold axis
        paired = np.isin(classes, fold.paired).any(axis=1) | (self.iax == 7)
        return np.stack(
            [np.where(alone, class_weight, 0), np.where(paired & self._has_e(class_weight), self.e_weight, 0)], axis=1
        )

    def is_e(self, k: Ints) -> NDArray[np.bool_]:
        """Whether levels are of E species; their K has no sign."""
        fold = FOLDS.get(self.iax)
        if fold is None or fold.n < 3 or self.equivalent == 3:
            return np.zeros(np.shape(k), dtype=bool)
        return np.asarray((k - self.l_code) % fold.n % (fold.n / 2) != 0)


def doubled_spins(spind: int) -> tuple[int, ...]:
    """2I of the spins in SPIND, whose last digit belongs to the spin coupled first; with a last digit 0 each spin has two digits.

    A leading digit 1 is a spin of size 0, a placeholder that adds a quantum number but no splitting.

    >>> doubled_spins(44), doubled_spins(-32), doubled_spins(1), doubled_spins(-1080), doubled_spins(61), doubled_spins(161)
    ((3, 3), (1, 2), (), (7,), (0, 5), (0, 5))
    """
    digits, width = str(abs(spind)), 1
    if digits.endswith("0") and len(digits) > 1:
        digits, width = digits[:-1], 2
    sizes = [int(digits[max(end - width, 0) : end]) for end in range(len(digits), 0, -width)]
    while sizes and sizes[-1] <= 1:  # spins of 0 at the end stand for none
        sizes.pop()
    return tuple(size - 1 for size in sizes)


def file_states(file: ParameterFile) -> tuple[StateOptions, ...]:
    """The options of all states; ValueError for an unsupported axis of weights or l-doubled states."""
    first = file.options[0]
    return tuple(_state(v, state_options(file, v), first) for v in range(file.states))


def state_options(file: ParameterFile, v: int) -> Options:
    """The option line of a state, else the first line, in which the digits of VSYM mark states with exchanged weights."""
    first = file.options[0]
    stated = [line for line in file.options[1:] if abs(line.nvib) == v]
    if stated:
        return stated[-1]
    digits = str(max(first.vsym, 0))[::-1]
    # digits of VSYM count states from the right
    swapped = not file.options[1:] and v < len(digits) and int(digits[v]) % 2 == 1
    return replace(first, wtpl=first.wtmn, wtmn=first.wtpl) if swapped else first


def options_alone(file: ParameterFile, v: int) -> Options:
    """The option line of a state as that of a file with this state alone and without spins."""
    first = file.options[0]
    sign, kind = (-1 if negative else 1 for negative in (first.oblate, first.by_k))
    return replace(state_options(file, v), nvib=sign, spind=kind, vsym=0, text="")


def _state(v: int, line: Options, first: Options) -> StateOptions:
    """The options of a state from its line and the first line."""
    factor = 100 if first.ewt >= 0 else 1000
    code, weight = divmod(abs(line.ewt), factor)  # EWT has two or three digits for the weight, by its sign
    iax, spins = abs(line.iax), doubled_spins(line.spind)
    if iax not in (0, 1, 2, 3, *FOLDS):
        raise ValueError(f"IAX = {line.iax} of state {v}: expected an axis or fold of weights, 1 to 11")
    if len(spins) > MOST_SPINS:
        raise ValueError(f"SPIND = {line.spind} of state {v} names {len(spins)} spins: expected at most {MOST_SPINS}")
    if line.iax < 0:
        _check_total(v, line, spins, (code % 10, weight))
    kmax = line.knmax if 0 <= line.knmax <= 359 else 359  # 359 is SPCAT's largest K
    return StateOptions(
        v,
        spins,
        line.knmin,
        max(kmax, line.knmin),
        iax,
        line.wtpl,
        line.wtmn,
        weight,
        code % 10,
        line.iax < 0 and len(spins) > 1,
    )


def _check_total(v: int, line: Options, spins: tuple[int, ...], e_species: tuple[int, int]) -> None:
    """Raise ValueError for an unsupported total spin: not of two or three spins, of unequal spins, or with levels of E species."""
    fold = FOLDS[-line.iax].n if -line.iax in FOLDS else 2
    together = f"IAX = {line.iax} of state {v} couples {'two' if fold == 2 else 'three'} spins to a total"
    ewt = f"EWT = {line.ewt} of state {v}"
    reasons = {
        f"IAX = {line.iax} of state {v}: a total spin of {fold} equivalent nuclei {NOT_YET}": fold > 3,
        f"{together}; SPIND = {line.spind} names {len(spins)}": fold == 3 and len(spins) < 3,
        f"{together}; they are of several sizes in SPIND = {line.spind}": len(spins) > 1
        and len(set(spins[-fold:])) > 1,
        f"{ewt}: an l-doubled state with a total spin of three nuclei {NOT_YET}": fold == 3 and e_species[0],
        f"{ewt}: with a total spin of three nuclei levels of E species do not exist; their weight is 0": (
            fold == 3 and e_species[1]
        ),
    }
    for reason, applies in reasons.items():
        if applies:
            raise ValueError(reason)


def species_numbers(ka: Ints | int, kc: Ints | int, oblate: bool) -> Ints:
    """Places in `SPECIES` of levels with these labels, where c instead of a is the axis of an oblate basis."""
    return np.asarray(_NUMBER[(kc % 2, ka % 2) if oblate else (ka % 2, kc % 2)])


def is_odd(ka: Ints, kc: Ints) -> NDArray[np.bool_]:
    """Whether levels have a species that SPCAT counts as odd: Ba and Bc, Ka + Kc odd."""
    return np.asarray((ka + kc) % 2 == 1)


def is_single_state(parameters: ParameterFile) -> bool:
    """Whether a file has one state and no spin."""
    first = parameters.options[0]
    return abs(first.nvib) == 1 and len(parameters.options) == 1 and not doubled_spins(first.spind)


def is_plain(parameters: ParameterFile) -> bool:
    """Whether a file has one state, no spin and operators of orthorhombic symmetry, so that its constants have names."""
    first = parameters.options[0]
    if not is_single_state(parameters) or first.knmin != 0 or first.iax not in (0, 1, 2, 3, 6, 9) or first.ixx:
        return False
    if first.by_k and first.knmax and first.wtpl != first.wtmn:  # the two levels of one K weigh differently
        return False
    if min(first.wtpl, first.wtmn) < 0 or (first.iax in FOLDS and first.wtpl != first.wtmn):
        return False
    digits = file_codes(parameters)
    mixed = len(frozenset().union(*(d.reductions for d in digits))) > 1  # terms of both reductions
    return all(d.has_name for d in digits) and not mixed
