"""Effects of spins: parameters (MHz) whose names state spins, powers and vibrational states (`parameter_names`).

W. Gordy and R. L. Cook, Microwave Molecular Spectra, 3rd ed., chapters 4.5 and 9; J. M. Brown and T. J. Sears, J. Mol. Spectrosc. 75, 111
(1979) for spin-rotation coupling of electrons.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.spins.scheme import EVERY_STATE, Cosines, CosinesWithN, Matrix, Rotor, Scalar, Spin, SpinTerm
from rotor.tops.constants.parameter_names import ParameterName, parse_name

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
    """A sum of parameters times operators of N and of spins. values: MHz by name. coupled: the spins, in the order of coupling.

    powers_of_n: in the operators, without those that a name adds.
    """

    values: Mapping[str, float]
    coupled: tuple[Spin, ...]
    conserved: ClassVar[frozenset[str]] = frozenset()
    symbols: ClassVar[Mapping[str, Symbol]] = {}
    powers_of_n: ClassVar[int] = 0

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

    def size_mhz(self, top: Top, j: int) -> float:
        """The largest constant times its spins and powers of N."""
        sizes = {spin.name: spin.twice / 2 for spin in self.coupled}
        return max(
            (
                abs(self.values[term.name])
                * math.prod(sizes[name] for name in term.spins)
                * max(j, 1) ** (self.powers_of_n + 2 * (term.n2 + term.nz2))
                for term in self.terms
            ),
            default=0.0,
        )

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


@dataclass(frozen=True, eq=False)
class NuclearQuadrupole(SpinEffect):
    """Quadrupole coupling of any number of nuclei of spin 1 or more with the gradient of the electric field.

        H = Σ_ij χ_ij I_i I_j / (2I(2I-1)),     χ_ij = eQ q_ij along a, b, c, symmetric and traceless

    (Gordy and Cook, eq. 9.9). Parameters: chi_aa, chi_bb-cc (the difference), chi_ab, chi_ac, chi_bc; chi_aa alone is a tensor with
    -½ chi_aa along b and c.

    >>> from rotor.tops.top import Top
    >>> effect = NuclearQuadrupole({"chi_aa(14N)": -4.7, "chi_bb-cc(14N)": 0.2}, (Spin("14N", 2),))
    >>> effect.parameters(Top.from_constants("A=9 B=5 C=4 MHz"))["chi_aa(14N)"]
    -4.7
    """

    name: ClassVar[str] = "nuclear quadrupole"
    symbols: ClassVar[Mapping[str, Symbol]] = {
        f"chi_{letters}": Symbol(Cosines(traceless_of(letters)), 1.0, 1, True) for letters in TRACELESS
    }

    def size_mhz(self, top: Top, j: int) -> float:
        """The largest element of χ, summed over the nuclei; splittings are fractions of it."""
        largest: dict[str, float] = {}
        for name, value in self.values.items():
            spin = parse_name(name).spins[0]
            largest[spin] = max(largest.get(spin, 0.0), abs(value))
        return sum(largest.values())


def quadrupole_of_tensor(spin: Spin, chi_mhz: ArrayLike) -> NuclearQuadrupole:
    """The coupling of one nucleus from its tensor χ (3, 3) in principal axes a, b, c, MHz.

    Raises ValueError unless the tensor is symmetric and traceless within 1e-3 of its largest element; the trace that rounding of published
    elements leaves is removed.

    >>> quadrupole_of_tensor(Spin("35Cl", 3), [[-57.0, 0, 0], [0, 26.4, 0], [0, 0, 30.6]]).values["chi_bb-cc(35Cl)"].__round__(6)
    -4.2
    """
    chi = np.asarray(chi_mhz, dtype=float)
    if chi.shape != (3, 3) or not np.isfinite(chi).all():
        raise ValueError(f"chi({spin.name}) is a (3, 3) tensor of finite numbers in MHz, not {chi.tolist()}")
    largest = float(np.abs(chi).max())
    if np.abs(chi - chi.T).max() > 1e-3 * largest:
        raise ValueError(f"chi({spin.name}) is a symmetric tensor; this one is not: {chi.tolist()}")
    if abs(np.trace(chi)) > 1e-3 * largest:
        raise ValueError(
            f"chi({spin.name}): chi_aa + chi_bb + chi_cc = {np.trace(chi):g} MHz; a quadrupole tensor is traceless, check the elements"
        )
    chi = (chi + chi.T) / 2 - np.eye(3) * np.trace(chi) / 3
    named = {"aa": chi[0, 0], "bb-cc": chi[1, 1] - chi[2, 2], "ab": chi[0, 1], "ac": chi[0, 2], "bc": chi[1, 2]}
    values = {f"chi_{letters}({spin.name})": float(value) for letters, value in named.items() if value}
    return NuclearQuadrupole(values or {f"chi_aa({spin.name})": 0.0}, (spin,))


COMPONENTS = ("iso", "aa", "bb", "cc", "bb-cc", "bb-aa", "ab", "ac", "bc", "ab-ba", "ac-ca", "bc-cb")


def _symbol(letters: str) -> Symbol:
    """Meaning of a component such as ab."""
    return Symbol(CosinesWithN(matrix_of(letters)), 1.0, 1)


@dataclass(frozen=True, eq=False)
class SpinRotation(SpinEffect):
    """Spin-rotation coupling of any number of spins, nuclei (C) and unpaired electrons (ε).

        H = Σ_ij C_ij ½{S_i, N_j},     S_i = Σ_p φ_pi S_p the component of the spin along a, b or c of the molecule

    (for nuclei Gordy and Cook, eq. 9.139, with the sign +I·C·J). Parameters: C_aa, C_bb, C_cc, C_ab (mean of both orders), C_ab-ba (half
    of their difference), C_iso for a scalar C N·S, and the same with eps; gamma is eps_iso. C_bb-cc multiplies S_b N_b - S_c N_c. With
    powers: C_aa_J multiplies ½{N², S_a N_a}. Note the sign: catalogues that define -I·C·J list -C.

    C_ab multiplies ½{S_a, N_b} + ½{S_b, N_a}, C_ab-ba ½{S_a, N_b} - ½{S_b, N_a} = i/2 [N², S_c] (a, b, c in cyclic order), so that the
    element of the tensor with the spin along a is C_ab + C_ab-ba. The difference connects N only with N ± 1: its first order is zero.
    """

    name: ClassVar[str] = "spin-rotation"
    powers_of_n: ClassVar[int] = 1
    symbols: ClassVar[Mapping[str, Symbol]] = {
        f"{letter}_{letters}": _symbol(letters) for letter in ("C", "eps") for letters in COMPONENTS
    } | {"gamma": _symbol("iso")}


@dataclass(frozen=True, eq=False)
class SpinSpin(SpinEffect):
    """Spin-spin coupling: scalar and dipolar coupling of pairs of spins, and of the electrons of a triplet or higher state.

        H = J I1·I2 + Σ_ij T_ij I1_i I2_j,     H = Σ_ij D_ij S_i S_j,     T and D symmetric and traceless along a, b, c

    b_F is J of an electron and a nucleus, Fermi's contact interaction; T of an electron and a nucleus is its dipolar part. lambda is D of
    a linear molecule, 2λ(S_a² - S²/3). Parameters: J(1,2), b_F(S,N), T_aa(1,2), T_bb-cc(1,2), T_ab(1,2), ...; D_aa(S), D_bb-cc(S), ...,
    lambda(S).
    """

    name: ClassVar[str] = "spin-spin"
    symbols: ClassVar[Mapping[str, Symbol]] = (
        {"J": Symbol(Scalar(), 1.0, 2), "b_F": Symbol(Scalar(), 1.0, 2)}
        | {f"T_{letters}": Symbol(Cosines(traceless_of(letters)), 1.0, 2) for letters in TRACELESS}
        | {f"D_{letters}": Symbol(Cosines(traceless_of(letters)), 1.0, 1, True) for letters in TRACELESS}
        | {"lambda": Symbol(Cosines(traceless_of("aa")), 4 / 3, 1, True)}
    )

    def scale(self, name: str, parts: ParameterName) -> float:
        """2S(2S-1) for a spin with itself, by which the quadrupole operator is divided; else 1."""
        if not self.symbols[parts.symbol].squared:
            return 1.0
        twice = next(spin.twice for spin in self.coupled if spin.name == parts.spins[0])
        if twice < 2:
            raise ValueError(f"{name}: a spin of {twice}/2 has no coupling with itself; that needs 1 or more")
        return float(twice * (twice - 1))
