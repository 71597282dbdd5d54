"""Codes of SPFIT/SPCAT read as operators, for the slow independent calculation in `full_matrix.py`.

What each digit means is in Pickett's documentation of the programs ("Documentation for SPFIT and SPCAT", spinv.pdf,
section "Format of the .par file and .var files"), read here anew; nothing of `rotor` is used but the readers of lines.
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from pathlib import Path

from rotor.formats.spcat.text.int_file import IntensityFile, read_int
from rotor.formats.spcat.text.par import ParameterFile, read_par

PROLATE, OBLATE = "bca", "bac"  # axes (x, y, z) in which N± = Nx ± i Ny: Ir and IIIl


@dataclass(frozen=True)
class Term:
    """One parameter: value x operator.

    pair: the two states, lower number first. spins: numbers of the spins, counted from 1, that stand in for N.
    ns: power of N.S1. kind: TYP. k2, n2: powers of Nz² and N². below: V1 < V2 as written, which means ΔK Δl < 0.
    """

    value: float
    pair: tuple[int, int]
    kind: int
    k2: int
    n2: int
    spins: tuple[int, ...] = ()
    ns: int = 0
    below: bool = False


@dataclass(frozen=True)
class State:
    """What an option line says of one state: doubled spins in the order of coupling, K limits, weights, l."""

    spins2: tuple[int, ...]
    k_min: int
    k_max: int
    axis: int
    plus: int
    minus: int
    e_weight: int
    l_code: int
    i_tot: bool


@dataclass(frozen=True)
class Case:
    """A whole input: states, terms, dipoles (pair, axis, value) and the request of the .int file."""

    states: tuple[State, ...]
    terms: tuple[Term, ...]
    dipoles: tuple[tuple[tuple[int, int], str, float], ...]
    oblate: bool
    symmetric: bool
    par: ParameterFile
    intensities: IntensityFile

    @property
    def linear(self) -> bool:
        """Quanta without K."""
        return self.symmetric and all(state.k_max == 0 for state in self.states)


def doubled_spins(spind: int) -> tuple[int, ...]:
    """SPIND's digits, the first spin in the units; with a last digit 0 two digits a spin: 2I for I > 0 up to the last."""
    digits, width = str(abs(spind)), 1
    if digits.endswith("0"):
        digits, width = digits[:-1], 2
    digits = digits.zfill(-(-len(digits) // width) * width)
    sizes = [int(digits[max(end - width, 0) : end]) for end in range(len(digits), 0, -width)]
    while sizes and sizes[-1] <= 1:
        sizes.pop()
    return tuple(size - 1 for size in sizes)


def _state(options, first, swap: bool) -> State:
    weight = abs(options.ewt)
    factor = 100 if first.ewt > 0 else 1000
    l_code, e_weight = divmod(weight, factor) if weight >= factor else (0, weight)
    plus, minus = (options.wtmn, options.wtpl) if swap else (options.wtpl, options.wtmn)
    limit = options.knmax if 0 <= options.knmax <= 359 else 359
    spins = doubled_spins(options.spind)
    return State(spins, options.knmin, limit, abs(options.iax), plus, minus, e_weight, l_code, options.iax < 0)


def _states(par: ParameterFile) -> tuple[State, ...]:
    first = par.options[0]
    vsym = first.vsym if first.vsym > 0 else 0
    digits = str(vsym)[::-1]
    states = []
    for v in range(abs(first.nvib)):
        options = [o for o in par.options[1:] if abs(o.nvib) == v]
        odd = not options and v < len(digits) and int(digits[v]) % 2 == 1
        states.append(_state(options[-1] if options else first, first, odd))
    return tuple(states)


def _term(code: int, value: float, digits: int, count: int) -> list[Term]:
    wild = 10**digits - 1
    rest, v1 = divmod(code, 10**digits)
    rest, v2 = divmod(rest, 10**digits)
    rest, n2 = divmod(rest, 10)
    rest, k2 = divmod(rest, 10)
    rest, kind = divmod(rest, 100)
    rest, ns = divmod(rest, 10)
    rest, i1 = divmod(rest, 10)
    fourier, i2 = divmod(rest, 10)
    if fourier:
        raise ValueError(f"code {code}: Fourier and Euler series are not in this calculation")
    spins = tuple(i for i in (i1, i2) if i)
    pairs = [(v, v) for v in range(count)] if v1 == v2 == wild else [(min(v1, v2), max(v1, v2))]
    return [Term(value, pair, kind, k2, n2, spins, ns, v1 < v2) for pair in pairs if pair[1] < count]


def read_case(folder: Path) -> Case:
    """The case in a folder of the reference files."""
    par = read_par(next(folder.glob("*.var")))
    return case_of(par, read_int(next(folder.glob("*.int"))))


def case_of(par: ParameterFile, intensities: IntensityFile) -> Case:
    """What a .par or .var and an .int file ask for."""
    states = _states(par)
    digits = 1 if len(states) <= 9 else 2 if len(states) <= 99 else 3
    terms = [t for p in par.parameters for t in _term(p.code, p.value, digits, len(states))]
    dipoles = []
    for dipole in intensities.dipoles:
        rest, axis = divmod(dipole.code, 10)
        rest, v1 = divmod(rest, 10**digits)
        kind, v2 = divmod(rest, 10**digits)
        if kind or not axis:
            raise ValueError(f"dipole {dipole.code}: only plain electric dipoles are in this calculation")
        dipoles.append(((min(v1, v2), max(v1, v2)), " abc"[axis], dipole.value))
    first = par.options[0]
    return Case(states, tuple(terms), tuple(dipoles), first.nvib < 0, first.spind < 0, par, intensities)


def unpacked(path: Path) -> bytes:
    """The bytes of a packed file."""
    return gzip.decompress(path.read_bytes())
