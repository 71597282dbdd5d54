"""Fourier and Euler series of SPFIT's files: functions of K, or of N and K, that multiply an operator element by element.

With K', K'' the signed K of an element, between states with ρ' and ρ'' (H. M. Pickett, documentation of SPFIT and SPCAT, "Parameter lines"
and its notes 1, 3, 6 and 11; Euler series: J. Mol. Spectrosc. 233, 174 (2005)):

| field | an element is multiplied by |
|---|---|
| FF = n, 1 to 10 | cos(2π n (ρ'K' + ρ''K'')/2 / 3); n - ½ for n where ρ' and ρ'' have unlike signs; 21 to 30: n = FF - 10, ... |
| FF = 10 + n | the sine of the same; 31 to 40: n = FF - 20, ... |
| FF = 11 to 20, 31 to 40, of K and -K | 0, as the program has it (it follows where the two ρ are one) |
| the same with NOFC | 1 where \\|K' + K''\\|/2 = n (n - ½ where ΔK is odd), else 0; for a sine the sign of K' + K'' |
| EX = n + 1 | ½(f' + f''), f = ((N² - K²)/D)^NSQ (K²/D)^KSQ, D = 1 + a K² + b (N² - K²); f/D but for TYP 0 with EX = 1 and no spin |
| EX with TYP 1 to 3 | the same of each part: K² counts as KSQ + 1, ½N² and -½K² of Nb² and Nc² as NSQ + 1 and KSQ + 1, ¼(N₊² + N₋²) as 1 |
| TYP 90 + 2n | the same of N₊^2n + N₋^2n, f/D for n > 0; TYP 91 with KSQ of 2 to 9: TYP 90 with KSQ + 8 |
| TYP 91, KSQ = NSQ = 0 | the constant ρ of a state |
| TYP 91 + 2n, (KSQ, NSQ) = (1, 0) or (0, 1) | the constants a and b of the series n; here N² is N(N+1) |

G12 changes the sign of an odd n where the smaller |K| is odd. A sine is odd under K -> -K: with it an operator that time reversal leaves
alone is turned around by it and has the factor i, and the reverse.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from math import pi

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.code_table import Digits, Kind, Tensor
from rotor.formats.spcat.hamiltonian.codes import NOT_YET
from rotor.formats.spcat.hamiltonian.operators import CodedOperator, code_operator, imaginary, operator_of
from rotor.formats.spcat.text.par import Options, Parameter
from rotor.frozen import dataclass
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.operators.rotation import Weight, ladders, weighted
from rotor.quantum.spins.scheme import ByElements


@dataclass(frozen=True)
class Series:
    """Constants of the series of a file. rho: by state. a, b: by (series, lower state, higher state). nofc, g12: flags of XOPT."""

    rho: dict[int, float] = field(default_factory=dict)
    a: dict[tuple[int, int, int], float] = field(default_factory=dict)
    b: dict[tuple[int, int, int], float] = field(default_factory=dict)
    nofc: bool = False
    g12: bool = False


def file_series(
    constants: Iterable[tuple[Digits, Parameter]], options: Options, states: int, pairs: Iterable[tuple[int, int]] = ()
) -> Series:
    """The constants of the series of a file.

    constants: parameters that are one, with the fields of their codes. options: first option line, with NOFC and G12. states: number of
    states. pairs: l-doubled states, which share the constants of the one with the lower number.
    Returns: constants; those without a parameter are 0.
    Raises ValueError for a code with TYP 91 to 99 that is not a constant.
    """
    series = Series(nofc=options.nofc, g12=options.g12)
    for d, parameter in constants:
        for pair in [d.states] if d.states else [(v, v) for v in range(states)]:
            _set(series, d, parameter, pair)
    for pair in pairs:
        lower, other = min(pair), max(pair)
        series.rho[other] = series.rho.get(lower, 0.0)
        for values in (series.a, series.b):
            values.update({(n, other, other): values.get((n, lower, lower), 0.0) for n in range(5)})
    return series


def _set(series: Series, d: Digits, parameter: Parameter, pair: tuple[int, int]) -> None:
    """Store the constant of a series."""
    number = d.ladder
    if d.has_spin or d.ff or d.ex:
        raise parameter.refusal("a constant of a series has no spin, no FF and no EX")
    if (d.ksq, d.nsq) == (1, 0):
        series.a[number, *pair] = parameter.value
    elif (d.ksq, d.nsq) == (0, 1):
        series.b[number, *pair] = parameter.value
    elif (number, d.ksq, d.nsq) == (0, 0, 0) and pair[0] == pair[1]:
        series.rho[pair[0]] = parameter.value
    elif (d.typ, d.ksq, d.nsq) != (d.row.last, 0, 0):  # a place holder
        raise parameter.refusal(
            f"TYP {d.typ} with KSQ = {d.ksq}, NSQ = {d.nsq} is no constant of a series; expected "
            "9100 (ρ of one state), 9110 (a) or 9101 (b), and for further series 93, 95, 97, 99 in place of 91"
        )


def coded_operator(d: Digits, axes: str, series: Series, states: tuple[int, int] | None) -> CodedOperator:
    """The operator of a code, with a series by its elements over |J k⟩.

    d: fields of the code. axes: the axes x, y, z: bca or bac. series: the constants of the file. states: states whose constants apply,
    lower first; None for all, which a series cannot have.
    Raises ValueError as `code_operator`, and for two series at once.
    """
    euler = d.kind is Kind.EULER
    if euler and d.spins and d.typ != d.row.first:
        raise ValueError(f"a spin with TYP {d.typ}, which SPCAT passes over: EX with TYP 4 and above has one")
    if sum(map(bool, (d.ff, d.ex, euler, d.kind is Kind.LEVEL))) > 1:
        raise ValueError("a code has one series alone, and no energy of one K (TYP 80 to 89) with it")
    if d.kind is Kind.LEVEL:
        return level_term(d, axes)
    if not d.is_series:
        return code_operator(d, axes)
    if states is None:
        raise ValueError("a term of a series without the constants of its states is read but not computed yet")
    if not d.ff:
        return _euler(d, axes, series, states)
    return _multiplied(code_operator(d.base, axes), k_factor(d.harmonic, d.sine, series, states), d.sine, axes)


def level_term(d: Digits, axes: str, sine: bool = False) -> CodedOperator:
    """The energy of one K, |K| = 10 (TYP - 80) + KSQ; half the difference of the energies of K and -K if it is a sine."""
    if d.ns:
        raise ValueError("a power of N·S of one K is read but not computed yet")

    def factor_for_k(m: Ints, n: Ints, above: Ints, below: Ints) -> Floats:
        chosen = (np.abs(above) == 10 * (d.typ - d.row.first) + d.ksq) & (above == below)
        return np.asarray(chosen * (np.sign(above) if sine else 1.0))

    return _multiplied(code_operator(d.base, axes), factor_for_k, sine, axes)


def k_factor(n: int, sine: bool, series: Series, states: tuple[int, int]) -> Weight:
    """Factor of an element in a Fourier term: a single K with NOFC; ½(K' + K'') for the sine of n = 0, as in the program.

    n: the harmonic. sine: sine or cosine. series: the constants of the file. states: the states of K' and of K''.
    """
    rho = [series.rho.get(v, 0.0) for v in states]
    shifted = n - 0.5 * ((rho[0] < 0) != (rho[1] < 0))  # the size of ρ turns; unlike signs shift n by one half
    up, low = (pi / 3 * shifted * abs(each) for each in rho)

    def factor(m: Ints, n_low: Ints, above: Ints, below: Ints) -> Floats:
        twice, angle = above + below, up * above + low * below
        if sine and n == 0:
            return twice / 2
        if n and series.nofc:  # the mean of both K, rounded up, is n
            return np.where((abs(twice) + 1) // 2 == n, np.sign(twice) if sine else 1.0, 0.0)
        turned = np.where(np.minimum(abs(above), abs(below)) % 2 == 1, -1.0, 1.0) if series.g12 and n % 2 else 1.0
        return np.asarray(turned * (np.where(above == -below, 0.0, np.sin(angle)) if sine else np.cos(angle)))

    return factor


def _euler(d: Digits, axes: str, series: Series, states: tuple[int, int]) -> CodedOperator:
    """The operator of a term of an Euler series."""
    number, ksq = d.euler
    alone = d.kind is Kind.SCALAR and d.ex == 1 and not d.has_spin
    extra = number > 0 if d.kind is Kind.EULER else not alone
    if alone and not (d.ksq or d.nsq):
        raise ValueError("EX = 1 with TYP, KSQ and NSQ of 0 is a constant; an energy has no EX")
    if number > 4:
        raise ValueError(f"EX = {d.ex}: there are five Euler series, EX 1 to 5")
    a, b = (constants.get((number, *states), 0.0) for constants in (series.a, series.b))
    base = code_operator(d.base, axes)
    if base.plain is None:
        return _multiplied(base, _mean(d.nsq, ksq, (a, b), extra), False, axes)
    parts = [
        factor * weighted(ladders(n), _mean(d.nsq + p, ksq + q, (a, b), extra))
        for (p, q, n), factor in base.plain.items()
    ]
    return replace(base, plain=None, of_n=Operator(tuple(each for part in parts for each in part.shifts)))


def _mean(n2: int, k2: int, constants: tuple[float, float], extra: bool) -> Weight:
    """½(f' + f'') with NSQ and KSQ, divided by D once more if `extra`; the mean over both functions keeps the element Hermitian."""
    a, b = constants

    def f(n: Ints, k: Ints) -> Floats:
        square = n * (n + 1.0) - k**2
        below = 1 + a * k**2 + b * square
        return np.asarray((square / below) ** n2 * (k**2 / below) ** k2 / (below if extra else 1.0))

    return lambda m, n, above, below: np.asarray(0.5 * (f(m, above) + f(n, below)))


def _multiplied(base: CodedOperator, factor: Weight, sine: bool, axes: str) -> CodedOperator:
    """An operator times the factor of a series."""
    phase = imaginary(axes, sine)
    whole, odd = 1.0 / phase if base.odd else phase, base.odd != sine
    operator = whole * weighted(base.alone if base.rotor is None else operator_of(base.rotor, axes), factor)
    if base.rotor is None:
        return replace(base, plain=None, of_n=operator, odd=odd)
    return replace(base, rotor=ByElements(base.rotor.rank, operator, odd), odd=odd)


def refuse_within_pairs(d: Digits, states: Sequence[int], doubled: frozenset[int]) -> None:
    """Raise ValueError for l-doubled states with a series of an operator above second order, or along x or y."""
    n_a = d.kind is Kind.TENSOR and d.tensor == Tensor(1, "a")
    supported = d.kind in (Kind.SCALAR, Kind.SQUARE, Kind.LADDER, Kind.EULER) or n_a
    if d.is_series and set(states) & doubled and not supported:
        raise ValueError(f"a series of this operator within l-doubled states {NOT_YET}")
