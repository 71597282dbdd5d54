"""The table of SPFIT's parameter codes: what the digits of a code say of its operator, spins and states.

A code is read in decimal digits, EX FF I2 I1 NS TYP KSQ NSQ V2 V1. TYP gives the tensor, `TABLE`; the spins replace as many N in it;
KSQ, NSQ and NS multiply it by powers of N_z², N² and N·S (half anticommutators); FF and EX multiply its elements by functions of K
(`series`).
(H. M. Pickett, documentation of SPFIT and SPCAT, and J. Mol. Spectrosc. 148, 371 (1991).) No other module knows numbers of TYP.
"""

from __future__ import annotations

from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from rotor.formats.spcat.text.par import ParameterFile
from rotor.frozen import dataclass


class Kind(Enum):
    """How the elements of an operator are written."""

    SCALAR = "1"
    SQUARE = "Na², Nb², Nc²"
    LADDER = "N₊^2n + N₋^2n"
    TENSOR = "a tensor of rank L made of N alone"
    LEVEL = "the energy of one K"
    EULER = "a term, or (odd TYP) a constant, of an Euler series"


@dataclass(frozen=True)
class Row:
    """TYP from `first` to `last`: rank L of the first and its step; the axis of the only half turn that leaves the operators alone.

    Without an axis all half turns about a, b, c do. Tensors of odd rank change sign under time reversal.
    """

    first: int
    last: int
    kind: Kind
    rank: int = 0
    step: int = 0
    axis: str = ""


TABLE = (
    Row(0, 0, Kind.SCALAR),
    Row(1, 3, Kind.SQUARE, 2),
    Row(4, 11, Kind.LADDER, 2, 2),
    Row(12, 19, Kind.TENSOR, 3, 2),
    Row(20, 39, Kind.TENSOR, 1, 1, "a"),
    Row(40, 59, Kind.TENSOR, 1, 1, "b"),
    Row(60, 79, Kind.TENSOR, 1, 1, "c"),
    Row(80, 89, Kind.LEVEL),
    Row(90, 99, Kind.EULER),
)
# a table by TYP: looking it up is faster than searching ranges
_ROW_OF_TYP = tuple(row for row in TABLE for _ in range(row.first, row.last + 1))
_ALONG = {row.axis: row for row in TABLE if row.axis}
LADDERS = next(row for row in TABLE if row.kind is Kind.LADDER)

TURNS = {
    "": (0, 0),
    "a": (0, 1),
    "b": (1, 1),
    "c": (1, 0),
}  # species of an operator along an axis: parities of Ka and Kc that it changes
PAIRS = {"ab": (0, 1), "ac": (0, 2), "bc": (1, 2)}  # two axes of a tensor of rank 2 with another axis
_HARMONICS = 10  # FF from 1 on: so many cosines, as many sines, ...


class Tensor(NamedTuple):
    """A tensor made of N, of this rank and along an axis ("" for none)."""

    rank: int
    axis: str = ""

    @property
    def odd(self) -> bool:
        """Whether time reversal changes its sign."""
        return self.rank % 2 == 1

    def shape(self, z: str) -> tuple[int, bool]:
        """K of the tensor, and whether it is E + E† or (E - E†)/i, by its species (`operators`)."""
        x, y = ("c", "b") if z == "a" else ("a", "b")
        along = {"": "", x: "x", y: "y", z: "z"}[self.axis]
        k = self.rank - (self.rank % 2 if along in ("z", "") else 1 - self.rank % 2)
        return k, along == ("x" if k == self.rank else "y") or (along == "z" and k < self.rank)


class Symmetry(NamedTuple):
    """Symmetry of a code: its axis, whether time reversal changes its sign, its change of K, and whether it is a square Na², Nb², Nc².

    The part of Nb² and Nc² with ΔK = 2 does not count in the change of K.
    """

    axis: str = ""
    odd: bool = False
    delta_k: int = 0
    square: bool = False


class Digits(NamedTuple):
    """The fields of a code, and the number of states of its file, on which the number of digits and the code of all states depend."""

    ex: int = 0
    ff: int = 0
    i2: int = 0
    i1: int = 0
    ns: int = 0
    typ: int = 0
    ksq: int = 0
    nsq: int = 0
    v2: int = 0
    v1: int = 0
    state_count: int = 1

    @property
    def text(self) -> str:
        """The fields that are not 0."""
        return ", ".join(
            f"{name.upper()} = {value}" for name, value in zip(self._fields[:10], self, strict=False) if value
        )

    @property
    def row(self) -> Row:
        """The row of TYP."""
        return _ROW_OF_TYP[self.typ]

    @property
    def kind(self) -> Kind:
        """How elements are written."""
        return self.row.kind

    @property
    def tensor(self) -> Tensor:
        """Rank and axis of TYP."""
        return Tensor(self.row.rank + self.row.step * (self.typ - self.row.first), self.row.axis)

    @property
    def square_axis(self) -> str:
        """The axis of Na², Nb² or Nc²."""
        return "abc"[self.typ - self.row.first]

    @property
    def ladder(self) -> int:
        """n of N₊^2n + N₋^2n, of a TYP or an Euler series; 0 for other kinds."""
        if self.kind is Kind.EULER:
            return (self.typ - self.row.first) // 2
        return self.tensor.rank // 2 if self.kind is Kind.LADDER else 0

    @property
    def spins(self) -> tuple[int, ...]:
        """Places of the spins that the code names, from 1."""
        return tuple(place for place in (self.i1, self.i2) if place)

    @property
    def has_spin(self) -> bool:
        """Whether the code names a spin or a power of N·S."""
        return bool(self.spins or self.ns)

    @property
    def projects_spin(self) -> bool:
        """Whether NS stands for N_z S_z with a power of N·S."""
        return self.ns >= SPIN_ALONG_Z

    @property
    def is_energy(self) -> bool:
        """Whether the code is the energy of a state."""
        return not any(self[:8])

    @property
    def is_orthorhombic(self) -> bool:
        """Whether the operator is a power of N, Na², Nb², Nc² or N₊, which all half turns leave alone, without spins and series."""
        plain = self.kind in (Kind.SCALAR, Kind.SQUARE, Kind.LADDER)
        return plain and not (self.has_spin or self.ff or self.ex)

    @property
    def has_name(self) -> bool:
        """Whether the operator is one of the lowest state, or of all, that may have a named constant."""
        return self.is_orthorhombic and not self.is_energy and self.states in ((0, 0), None)

    @property
    def in_lowest_state(self) -> int:
        """The code of the operator in the lowest state of a file with few states."""
        return join_code(self._replace(v1=0, v2=0, state_count=1))

    @property
    def is_constant(self) -> bool:
        """Whether the code names a constant of a series, which is not an operator and is not fitted."""
        return self.kind is Kind.EULER and self._is_second_of_pair and self.ksq < 2

    @property
    def is_series(self) -> bool:
        """Whether the code names a term of a series."""
        return bool(self.ff or self.ex) or (self.kind is Kind.EULER and not self.is_constant)

    @property
    def euler(self) -> tuple[int, int]:
        """Number of the Euler series of the code, and its power of K²."""
        if self.kind is Kind.EULER:
            return self.ladder, self.ksq + 8 * self._is_second_of_pair
        return self.ex - 1, self.ksq

    @property
    def base(self) -> Digits:
        """The code of the operator whose elements a series, or the choice of one K, multiplies."""
        if self.kind is Kind.LEVEL:
            return self._replace(typ=0, ksq=0, ff=0)
        if self.kind is Kind.EULER:
            return self._replace(ex=0, ksq=0, nsq=0, typ=ladder_typ(self.ladder))
        return self._replace(ex=0, ksq=0, nsq=0) if self.ex else self._replace(ff=0)

    @property
    def _is_second_of_pair(self) -> bool:
        return (self.typ - self.row.first) % 2 == 1

    @property
    def sine(self) -> bool:
        """Whether FF is a sine."""
        # harmonics come in alternate runs of cosines and sines
        return self.ff > 0 and (self.ff - 1) // _HARMONICS % 2 == 1

    @property
    def harmonic(self) -> int:
        """The harmonic n of FF.

        >>> [split_code(ff * 10**9).harmonic for ff in (1, 10, 11, 20, 21, 31)]
        [1, 10, 1, 10, 11, 11]
        """
        return self.ff - _HARMONICS * (((self.ff - 1) // _HARMONICS + 1) // 2)

    @property
    def reductions(self) -> frozenset[str]:
        """The reduction of Watson that alone has the operator: A if K² multiplies N₊² + N₋², S if K changes by more than two."""
        if self.kind is not Kind.LADDER:
            return frozenset()
        return frozenset("S") if self.ladder > 1 else frozenset("A" if self.ksq else "")

    @lru_cache(maxsize=4096)  # noqa: B019  of tuples, which hold nothing else
    def symmetry(self, oblate: bool) -> Symmetry:
        """The symmetry of the operator with its series; a sine is along z and odd under time reversal.

        >>> codes = (1_000_040_000, 11_000_000_000, 11_000_200_000, 200_000, 920_000)
        >>> [split_code(code).symmetry(False)[:3] for code in codes]
        [('', False, 2), ('a', True, 0), ('', False, 0), ('a', True, 0), ('', False, 2)]
        """
        z, tensor, sine = "c" if oblate else "a", self.tensor, self.sine
        odd = self.kind is Kind.TENSOR and tensor.odd
        delta_k = tensor.shape(z)[0] if self.kind is Kind.TENSOR else 2 * self.ladder
        commutator = self.i1 == 0 and self.i2 > 0
        axis = axis_product(tensor.axis, z) if sine else tensor.axis
        return Symmetry(axis, (odd != sine) != commutator, delta_k, self.kind is Kind.SQUARE and not sine)

    @property
    def states(self) -> tuple[int, int] | None:
        """The two states of the code, lower first; None for all states."""
        low, high = sorted((self.v1, self.v2))
        return None if low == all_states_digit(self.state_count) else (low, high)

    @property
    def is_place_holder(self) -> bool:
        """Whether the code stands between a state and all (9, 99, 999)."""
        return (self.v1 == all_states_digit(self.state_count)) != (self.v2 == all_states_digit(self.state_count))

    @property
    def missing_state(self) -> int | None:
        """The number of a state that does not exist; None if both do."""
        high = max(self.v1, self.v2)
        return high if self.state_count <= high != all_states_digit(self.state_count) else None


SPIN_ALONG_Z = 5  # NS from here on: N_z S_z in place of the 1 of TYP 0


def axis_product(first: str, second: str) -> str:
    """The axis of a product of two operators along axes.

    >>> axis_product("a", "b"), axis_product("a", "a"), axis_product("", "c")
    ('c', '', 'c')
    """
    axes = ("", "a", "b", "c")
    return axes[axes.index(first) ^ axes.index(second)]


def ladder_typ(n: int) -> int:
    """TYP of N₊^2n + N₋^2n, of 1 for n = 0."""
    return LADDERS.first + n - 1 if n else 0  # TYP 4 begins with n = 1


def square_typ(axis: str) -> int:
    """TYP of Na², Nb², Nc²."""
    return next(row.first for row in TABLE if row.kind is Kind.SQUARE) + "abc".index(axis)


def typ_across(letters: str) -> int:
    """TYP of NbNc + NcNb, ... by two axes."""
    return _ALONG[axis_product(letters[0], letters[1])].first + 1


TYPES_BETWEEN = (  # interactions of two states without spins, by name
    {f"G_{axis}": _ALONG[axis].first for axis in "abc"}
    | {f"F_{letters}": typ_across(letters) for letters in PAIRS}
    | {"W": 0}
    | {f"W_pm{2 * n}": ladder_typ(n) for n in (1, 2, 3)}
)


def state_digits(states: int) -> int:
    """Number of digits of V1 and of V2 in a code: one up to 9 states, two up to 99, else three."""
    return 1 if states <= 9 else 2 if states <= 99 else 3  # the digits of V1 and V2 grow with the number of states


def all_states_digit(states: int) -> int:
    """The V1 and V2 that stand for all states: 9, 99 or 999."""
    return int(10 ** state_digits(states)) - 1  # 9, 99 or 999: the largest number of that many digits stands for all


@lru_cache(maxsize=4096)  # a file is looked through for states, phases, series and operators
def split_code(code: int, states: int = 1) -> Digits:
    """The fields of a code in a file with this number of vibrational states.

    >>> split_code(110010099)
    Digits(ex=0, ff=0, i2=1, i1=1, ns=0, typ=1, ksq=0, nsq=0, v2=9, v1=9, state_count=1)
    """
    left, fields = code, []
    for width in (state_digits(states), state_digits(states), 1, 1, 2, 1, 1, 1, 2, 1):
        left, digits = divmod(left, 10**width)
        fields.append(digits)
    if left or code < 0:
        raise ValueError(
            f"parameter code {code}: a code has at most {10 + 2 * state_digits(states)} digits and no sign"
        )
    return Digits._make([*reversed(fields), states])


def file_codes(file: ParameterFile) -> tuple[Digits, ...]:
    """The fields of the code of each parameter of a file."""
    return tuple(split_code(parameter.code, file.states) for parameter in file.parameters)


def join_code(digits: Digits) -> int:
    """The code with these fields, the inverse of `split_code`."""
    widths = (1, 2, 1, 1, 1, 2, 1, 1, state_digits(digits.state_count), state_digits(digits.state_count))
    code = 0
    for value, width, name in zip(digits, widths, Digits._fields, strict=False):
        if not 0 <= value < 10**width:
            raise ValueError(f"{name.upper()} = {value} does not fit {width} digit{'s' if width > 1 else ''} of a code")
        code = code * 10**width + value
    return code
