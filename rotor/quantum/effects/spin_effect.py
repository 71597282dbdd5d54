"""Base class of the effects of spins: parameters (MHz) whose names state spins, powers and vibrational states (`parameter_names`)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Self

from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.spins.operators import EVERY_STATE, Matrix, Rotor
from rotor.quantum.spins.scheme import Spin, SpinTerm
from rotor.tops.parameter_names import ParameterName, parse_name

if TYPE_CHECKING:
    from rotor.tops.top import Top


class Symbol(NamedTuple):
    """Meaning of a symbol: operator of N, factor, number of spins in the name, and whether one spin acts twice (a quadrupole)."""

    rotor: Rotor
    factor: float
    spins: int
    squared: bool = False


@dataclass(frozen=True, eq=False)
class SpinEffect(QuantumEffect):
    """A sum of parameters times operators of N and of spins. values: MHz by name. coupled: the spins, in the order of coupling."""

    values: Mapping[str, float]
    coupled: tuple[Spin, ...]
    symbols: ClassVar[Mapping[str, Symbol]] = {}

    def __post_init__(self) -> None:
        names = {parse_name(name).text: float(value) for name, value in self.values.items()}
        object.__setattr__(self, "values", MappingProxyType(names))
        self.terms  # noqa: B018  checks all names when the effect is made

    def __reduce__(self) -> tuple[type[Self], tuple[dict[str, float], tuple[Spin, ...]]]:
        return type(self), (dict(self.values), self.coupled)

    @cached_property
    def terms(self) -> tuple[SpinTerm, ...]:
        """The operators of all parameters."""
        return tuple(self._term(name) for name in self.values)

    def _term(self, name: str) -> SpinTerm:
        """The operator of a parameter."""
        parts = parse_name(name)
        if parts.symbol not in self.symbols:
            raise ValueError(f"{name}: {self.name} knows {', '.join(self.symbols)}")
        symbol = self.symbols[parts.symbol]
        spin_names = [spin.name for spin in self.coupled]
        if len(parts.spins) != symbol.spins or not set(parts.spins) <= set(spin_names):
            raise ValueError(
                f"{name}: {parts.symbol} belongs to {symbol.spins} of the spins {', '.join(spin_names) or '(none)'}, in round brackets"
            )
        spins = parts.spins * 2 if symbol.squared else parts.spins
        factor = symbol.factor * self.scale(name, parts)
        bra, ket = parts.states or (EVERY_STATE, EVERY_STATE)
        return SpinTerm(name, spins, symbol.rotor, factor, parts.n2, parts.nz2, parts.ns, bra, ket)

    def scale(self, name: str, parts: ParameterName) -> float:
        """A further factor of a term, which depends on its spins."""
        return 1.0

    def parameters(self, top: Top) -> dict[str, float]:
        """The values in MHz."""
        return dict(self.values)

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """The spins that are coupled."""
        return self.coupled

    def spin_terms(self, top: Top) -> tuple[SpinTerm, ...]:
        """The operators of all parameters."""
        return self.terms


def matrix_of(letters: str) -> Matrix:
    """The matrix c_ij along a, b, c of a component: aa, ab (both orders), ab-ba, bb-cc, and iso for the unit matrix.

    >>> matrix_of("ab"), matrix_of("ab-ba")[:2]
    (((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)))
    """
    rows = [[0.0] * 3 for _ in range(3)]
    if letters == "iso":
        rows = [[float(i == k) for k in range(3)] for i in range(3)]
    else:
        for sign, pair in zip((1.0, -1.0), letters.split("-"), strict=False):
            i, k = ("abc".index(letter) for letter in pair)
            rows[i][k] = sign
            if "-" not in letters:
                rows[k][i] = sign
    return tuple(tuple(row) for row in rows)  # type: ignore[return-value]


def traceless_of(letters: str) -> Matrix:
    """The traceless symmetric matrix for a component of 1: aa with -½ for bb and cc, bb-cc with ±½, ab.

    >>> traceless_of("bb-cc")
    ((0.0, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, -0.5))
    """
    plain = matrix_of(letters)
    if "-" in letters:
        return tuple(tuple(value / 2 for value in row) for row in plain)  # type: ignore[return-value]
    if letters[0] != letters[1]:
        return plain
    return tuple(tuple(1.5 * plain[i][k] - 0.5 * (i == k) for k in range(3)) for i in range(3))  # type: ignore[return-value]


TRACELESS = ("aa", "bb-cc", "cc-aa", "bb-aa", "aa-bb", "bb", "cc", "ab", "ac", "bc")
