"""Fourier and Euler series of a parameter file: operators whose elements are multiplied by functions of K.

| code | meaning |
|---|---|
| FF = n, 1 to 10; 10 + n | the operator times cos θ_n; sin θ_n, θ_n = n (π/3) (ρ' K' + ρ K), ρ' K' of the bra, ρ K of the ket |
| FF = 11 to 20, of K and -K | nothing, as in the program: 0 where ρ is one |
| FF = 20 + n; 30 + n | the same with cos θ_(10 + n), sin θ_(10 + n) |
| TYP 91, KSQ = NSQ = 0 | ρ of a state; where those of two states differ in sign, n is n - ½ between them |
| TYP 91, 93, ... with KSQ = 1; NSQ = 1 | a; b of the denominators d = 1 + a K² + b (N(N + 1) - K²) of TYP 90, 92, ... |
| TYP 90; 92, 94, ... | 1; N₊² + N₋², N₊⁴ + N₋⁴, ..., KSQ and NSQ as below; other than TYP 90 over d |
| TYP 91, 93, ... with KSQ > 1 | as TYP 90, 92, ... with KSQ + 8 |
| EX = 1, 2, ... | the operator with its powers as below, over d of TYP 91, 93, ...; TYP 0 with EX = 1 as TYP 90 |
| KSQ, NSQ in an Euler series | (K²/d)^KSQ ((N(N + 1) - K²)/d)^NSQ, the mean of bra and ket |
| TYP 99, KSQ = NSQ = 0 | a place holder, passed over |

(The formulas are those of H. M. Pickett's program as its public C source has them, fields EX, FF and TYP of a code; every row is compared
with levels that it computes.) ρ, a and b are no parameters of a fit, as in SPFIT.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from math import pi

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spcat.codes import Digits, split_code
from rotor.formats.spcat.operators import CodedOperator, operator_of, plain_of_j
from rotor.formats.spcat.text.par import Parameter
from rotor.quantum.states import OperatorOfJ
from rotor.quantum.wang.j_operators import JOperator

NOT_YET = "is read but not computed yet"
_FIRST_OF_SERIES = 90
_RHO, _NOTHING = 91, 99  # with KSQ = NSQ = 0
Weight = Callable[[int, Floats, Floats], Floats]  # of N, K of the bra, K of the ket


@dataclass(frozen=True)
class SeriesConstants:
    """ρ by state; a and b of the denominators by number of the series (0 of TYP 90 and 91) and states, lower first."""

    rho: dict[int, float] = field(default_factory=dict)
    denominators: dict[tuple[int, tuple[int, int]], tuple[float, float]] = field(default_factory=dict)


def is_series(digits: Digits) -> bool:
    """Whether a code is that of a term of a Fourier or Euler series, or of a constant of one."""
    return digits.ex > 0 or digits.ff > 0 or digits.typ >= _FIRST_OF_SERIES


def is_constant(digits: Digits) -> bool:
    """Whether a code is no operator: ρ, a, b, or a place holder."""
    typ, order = digits.typ, (digits.ksq, digits.nsq)
    odd = typ > _FIRST_OF_SERIES and typ % 2 == 1 and digits.ksq <= 1
    alone = not (digits.ex or digits.ff or digits.i1 or digits.i2 or digits.ns)
    return odd and alone and (typ != _NOTHING or order == (0, 0))


def series_constants(parameters: Iterable[Parameter], states: int) -> SeriesConstants:
    """The constants of all series in a file with so many states."""
    wild = {1: 9, 2: 99, 3: 999}[1 if states <= 9 else 2 if states <= 99 else 3]
    made = SeriesConstants()
    for parameter in parameters:
        digits = split_code(parameter.code, states)
        if digits.typ <= _FIRST_OF_SERIES or not is_constant(digits):
            continue
        low, high = sorted((digits.v1, digits.v2))
        pairs = [(v, v) for v in range(states)] if low == wild else [(low, high)]
        for pair in pairs:
            _add(made, digits, pair, parameter.value)
    return made


def _add(made: SeriesConstants, digits: Digits, pair: tuple[int, int], value: float) -> None:
    order, number = (digits.ksq, digits.nsq), (digits.typ - _FIRST_OF_SERIES) // 2
    if digits.typ == _RHO and order == (0, 0) and pair[0] == pair[1]:
        made.rho[pair[0]] = value
    a, b = made.denominators.get((number, pair), (0.0, 0.0))
    if order in ((1, 0), (0, 1)):
        made.denominators[number, pair] = (value, b) if order == (1, 0) else (a, value)


def operator_of_series(
    digits: Digits, axes: str, constants: SeriesConstants, pair: tuple[int, int]
) -> tuple[CodedOperator, int]:
    """The operator of a code of a series between two states, or within one, and the TYP of an operator of its species.

    Parameters
    ----------
    digits : Digits
        Of the code.
    axes : str
        Those at x, y, z (bca or bac).
    constants : SeriesConstants
        Of the file.
    pair : (int, int)
        The states, lower first.

    Returns
    -------
    operator : CodedOperator
        With its elements for each J.
    typ : int
        By which symmetry is judged.

    Raises
    ------
    ValueError
        With the meaning of a code that does not compute.
    """
    if digits.i1 or digits.i2 or digits.ns:
        raise ValueError(f"a term of a Fourier or Euler series with a spin {NOT_YET}")
    if digits.ff and 80 <= digits.typ < _FIRST_OF_SERIES:
        raise ValueError(f"a Fourier term of the energy of one K {NOT_YET}")
    base, weights, typ = _euler(digits, axes, constants, pair)
    odd = base.odd
    if digits.ff:
        sine, weight = _fourier(digits.ff, constants, pair)
        weights = [weight, *weights]
        odd ^= sine
        typ = _with_sine(typ, axes) if sine else typ
    factor = _factor(base.odd, odd, axes)
    return replace(base, plain=None, of_j=_weighted(_elements(base), weights, factor), odd=odd), typ


def _factor(base_odd: bool, odd: bool, axes: str) -> complex:
    """What makes the operator real between states: i (-i in an oblate basis) for what is odd, as operators without sines have."""
    i = 1j if axes[2] == "a" else -1j
    if base_odd == odd:
        return 1.0
    return i if odd else 1.0 / i


def _elements(base: CodedOperator) -> OperatorOfJ:
    return base.of_j or plain_of_j(base.plain or {})


def _weighted(of: OperatorOfJ, weights: list[Weight], factor: complex) -> OperatorOfJ:
    def operator(j: int, representation: str) -> JOperator:
        whole, k = of(j, representation), np.arange(-j, j + 1.0)
        bands = {q: factor * band for q, band in whole.bands.items()}
        for weight in weights:
            bands = {q: band * weight(j, k + q, k) for q, band in bands.items()}
        return JOperator(j, bands)

    return operator


def _fourier(ff: int, constants: SeriesConstants, pair: tuple[int, int]) -> tuple[bool, Weight]:
    """Whether a term is a sine, and cos θ or sin θ."""
    tens, units = divmod(ff - 1, 10)
    sine, n = tens % 2 == 1, units + 1.0 + 10 * (tens // 2)
    rho = [constants.rho.get(v, 0.0) for v in pair]
    if (rho[0] < 0) != (rho[1] < 0):
        n -= 0.5
    bra, ket = (n * pi / 3 * abs(value) for value in rho)

    def weight(_: int, of_bra: Floats, of_ket: Floats) -> Floats:
        angle = bra * of_bra + ket * of_ket
        return np.where(of_bra == -of_ket, 0.0, np.sin(angle)) if sine else np.cos(angle)

    return sine, weight


def _euler(
    digits: Digits, axes: str, constants: SeriesConstants, pair: tuple[int, int]
) -> tuple[CodedOperator, list[Weight], int]:
    """The operator without its Euler series, what multiplies its elements, and the TYP of its species."""
    own = digits.typ >= _FIRST_OF_SERIES
    if not own and not digits.ex:
        return operator_of(digits._replace(ff=0), axes), [], digits.typ
    if digits.ex > 5 or (own and digits.ex):
        raise ValueError(f"an Euler series with EX = {digits.ex} {NOT_YET}")
    if not own and digits.typ >= 80:
        raise ValueError(f"an Euler series of the energy of one K {NOT_YET}")
    number = (digits.typ - _FIRST_OF_SERIES) // 2 if own else digits.ex - 1
    a, b = constants.denominators.get((number, pair), (0.0, 0.0))
    extra = number > 0 or (not own and digits.typ > 0)
    if own:
        typ = 3 + number if number else 0
        powers = digits.nsq, digits.ksq + 8 * (digits.typ % 2)
    else:
        typ, powers = digits.typ, (digits.nsq, digits.ksq)
    base = operator_of(Digits(0, 0, 0, 0, 0, typ, 0, 0, 0, 0), axes)
    if base.of_j is not None:
        return base, [_mean(*powers, a, b, extra)], typ
    parts = [
        _weighted(plain_of_j({(0, 0, n): factor}), [_mean(p + powers[0], q + powers[1], a, b, extra)], 1.0)
        for (p, q, n), factor in (base.plain or {}).items()
    ]
    return replace(base, plain=None, of_j=_summed(parts)), [], typ


def _summed(parts: list[OperatorOfJ]) -> OperatorOfJ:
    def operator(j: int, representation: str) -> JOperator:
        whole = parts[0](j, representation)
        for part in parts[1:]:
            whole = whole + part(j, representation)
        return whole

    return operator


def _mean(n2: int, k2: int, a: float, b: float, extra: bool) -> Weight:
    """½ (f' + f), f = (K²/d)^q ((N(N + 1) - K²)/d)^p, over d once more where `extra`."""

    def of(j: int, k: Floats) -> Floats:
        square = k * k
        d = 1.0 + a * square + b * (j * (j + 1.0) - square)
        found = (square / d) ** k2 * ((j * (j + 1.0) - square) / d) ** n2
        return np.asarray(found / d if extra else found)

    return lambda j, bra, ket: 0.5 * (of(j, bra) + of(j, ket))


def _with_sine(typ: int, axes: str) -> int:
    """The TYP of an operator with the same change of K and the species of it times Nz."""
    along = {"a": 20, "c": 60}[axes[2]]
    if typ < 20:
        return along if typ < 4 else along + 2 * (typ - 3) - 1
    axis, order = divmod(typ, 20)
    z = along // 20
    other = 6 - axis - z  # of a, b, c as 1, 2, 3: the third of two
    return order if axis == z else 20 * other + order
