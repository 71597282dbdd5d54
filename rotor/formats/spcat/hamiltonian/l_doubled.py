"""Degenerate states l = ±L of symmetric tops as two real vibrational states x, y: operators of a file, and labels of levels.

    |l = ±⟩ = (|x⟩ ± i|y⟩)/√2

A file declares the pair by EWT1: the first state has the functions with K l > 0, [|K⟩|+⟩ ± |-K⟩|-⟩]/√2, the second those with K l ≤ 0.
Operators O refer to |k⟩|l⟩ (H. M. Pickett, documentation of SPFIT and SPCAT, "l-doubled states"):

| V1, V2 | elements | over x and y |
|---|---|---|
| the first state twice | O, both l alike | O, O |
| the same, O odd (Na, ...) | O l/L | ⟨x|H|y⟩ = -i O |
| both states | Δl = ±2L, Δk Δl > 0 (V2 < V1), else < 0 | ½ O, -½ O, ⟨x|H|y⟩ = ±(i/2)(O↑ - O↓) |
| another state and the first | Δl = ±L, likewise | O/√2, ±(i/√2)(O↑ - O↓) |
| two first states | O, both l alike | O, O |

O↑ and O↓ are the parts that raise and lower k. Parameters of the second state twice are ignored, as in SPFIT. The parity of a split pair,
which depends on the phase between x and y, is not verified against the program.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.spins.operators import AxialState
from rotor.quantum.spins.parts import assigned
from rotor.quantum.states import Coupling, OperatorOfJ
from rotor.quantum.wang.basis import Part, names_of
from rotor.quantum.wang.j_operators import JOperator, between_blocks, j_z


class Pair(NamedTuple):
    """Numbers of an l-doubled pair: the state with K l > 0 (x here), and the state with K l ≤ 0 (y)."""

    first: int
    second: int


def l_doubled_pairs(states: Sequence[StateOptions]) -> list[Pair]:
    """The l-doubled pairs among the states of a file; ValueError for a state without its partner."""
    pairs, at = [], 0
    while at < len(states):
        state = states[at]
        if not state.l_code:
            at += 1
            continue
        partner = states[at + 1] if at + 1 < len(states) else None
        fold = state.fold
        if partner is None or not partner.l_code or not fold or (state.l_code + partner.l_code) % fold:
            raise ValueError(
                f"EWT of state {state.number}: l-doubled states come in pairs, the next state having n - l of an n-fold axis (IAX 6 to 11)"
            )
        if state.l_code % fold == 0 or 2 * state.l_code % fold == 0:
            raise ValueError(
                f"EWT of state {state.number}: a pair with l = {state.l_code} of a {fold}-fold axis is not of E species; that is read but "
                "not computed yet"
            )
        first, second = (state, partner) if state.l_code <= partner.l_code else (partner, state)
        pairs.append(Pair(first.number, second.number))
        at += 2
    return pairs


class RealPart(NamedTuple):
    """A parameter between two real states: the factor of O, or of i(O↑ - O↓) if `turned`."""

    bra: int
    ket: int
    factor: float
    turned: bool = False


def over_real_states(
    states: tuple[int, int], odd: bool, reversed_: bool, pairs: Sequence[Pair], what: str = "operator"
) -> list[RealPart]:
    """Parts of a parameter over real states, if at least one of its states is l-doubled (table of this module).

    states: numbers, the lower one first. odd: whether the operator changes sign under time reversal. reversed_: whether V2 > V1 in the
    code, Δk Δl < 0. pairs: the l-doubled states of the file. what: kind of operator for messages; an odd "spin operator" between
    different states is not supported.
    Returns: real states, factors and kinds of operator.
    Raises ValueError for operators that symmetry forbids or this package does not support.
    """
    low, high = states
    firsts, seconds = {pair.first: pair for pair in pairs}, {pair.second: pair for pair in pairs}
    sign = -1.0 if reversed_ else 1.0
    if low == high:
        return _within(odd, firsts.get(low))
    if odd and what != "operator":
        raise ValueError(f"an odd {what} between l-doubled states is read but not computed yet")
    if (low in firsts and firsts[low].second == high) or (high in firsts and firsts[high].second == low):
        if odd:
            raise ValueError("an odd operator between l and -l is not invariant under time reversal")
        turned = 0.5 * sign * (1.0 if low in firsts else -1.0)
        return [RealPart(low, low, 0.5), RealPart(high, high, -0.5), RealPart(low, high, turned, True)]
    if low in firsts and high in firsts:
        if odd:
            raise ValueError("an odd operator between two l-doubled states is read but not computed yet")
        return [_ordered(first, second, 1.0) for first, second in zip(firsts[low], firsts[high], strict=True)]
    if low in seconds or high in seconds:
        article = "an" if what == "operator" else "a"
        raise ValueError(
            f"{article} {what} of the state with K l ≤ 0 is read but not computed yet; name the one with K l > 0"
        )
    pair, second = (firsts[low], high) if low in firsts else (firsts[high], low)
    share = 1 / sqrt(2.0)
    return [_ordered(second, pair.first, share), _ordered(second, pair.second, sign * share, True)]


def _ordered(first: int, second: int, factor: float, turned: bool = False) -> RealPart:
    """A real part with the lower number first."""
    # a pair has the lower state first
    return RealPart(min(first, second), max(first, second), factor, turned)


def _within(odd: bool, pair: Pair | None) -> list[RealPart]:
    """Parts of an operator within one state or pair."""
    if pair is None:  # of the second state: passed over
        return []
    x, y = sorted(pair)
    if odd:
        return [RealPart(x, y, -1.0 if x == pair.first else 1.0)]
    return [RealPart(x, x, 1.0), RealPart(y, y, 1.0)]


def _scaled(operator_at: OperatorOfJ, factor: complex) -> OperatorOfJ:
    """factor · O."""
    return lambda j, representation: factor * operator_at(j, representation)


def _turned(operator_at: OperatorOfJ, factor: complex) -> OperatorOfJ:
    """factor (O↑ - O↓)."""

    def operator(j: int, representation: str) -> JOperator:
        bands = operator_at(j, representation).bands
        return JOperator(j, {q: factor * np.sign(q) * band for q, band in bands.items() if q})

    return operator


def couplings_with_pairs(
    name: str, operator_at: OperatorOfJ, odd: bool, states: tuple[int, int], reversed_: bool, pairs: Sequence[Pair]
) -> list[Coupling]:
    """The couplings of `over_real_states` for an operator over |J k⟩, with a factor i if it is odd."""
    return [
        Coupling(name, bra, ket, _turned(operator_at, 1j * factor) if turned else _scaled(operator_at, factor))
        for bra, ket, factor, turned in over_real_states(states, odd, reversed_, pairs)
    ]


# Names of levels


def l_functions(block: SolvedBlock, pairs: Sequence[Pair], representation: str) -> tuple[Floats, Ints]:
    """The functions (n, n), in rows, that label the states of a block, and their labels v, Ka, Kc (n, 3).

    States that are not l-doubled have basis functions, a pair has |K, l⟩ ± |-K, -l⟩ with K l > 0 and with K l < 0. A half turn across the
    axis changes the sign of y; of the two functions with K = 0, the one of y therefore has the other species, Ka + Kc = N + 1.
    """
    if any(isinstance(part.basis, AxialState) for part in block.parts):
        raise ValueError(_UNCOUPLED)
    size = len(block.vectors)
    functions, names = list[Floats](), list[tuple[int, int, int]]()
    second = {pair.first: pair.second for pair in pairs}
    members = {v for pair in pairs for v in pair}
    for part in block.parts:
        for place, (k, ka, kc) in enumerate(zip(part.basis.k.tolist(), *_by_k(part, representation), strict=True)):
            unit_vector = np.zeros(size)
            unit_vector[part.place.start + place] = 1.0
            if part.v not in members:
                functions.append(unit_vector)
                names.append((part.v, ka, kc))
            elif part.v in second:
                for v, function in _functions_with_l(unit_vector, k, part, block.parts, second[part.v], representation):
                    functions.append(function)
                    names.append((v, ka, kc))
            elif k == 0:
                functions.append(unit_vector)
                names.append((part.v, ka + 1, kc) if representation == "IIIl" else (part.v, ka, kc + 1))
    if len(functions) < size:
        raise ValueError(_UNCOUPLED)
    return np.array(functions), np.array(names)


_UNCOUPLED = "l-doubled states without a coupling of their components; give -2Aζ (TYP 20) for them"


def block_names(block: SolvedBlock, pairs: Sequence[Pair], representation: str) -> tuple[Ints, Floats]:
    """Labels and weights of the states of a block."""
    functions, names = l_functions(block, pairs, representation)
    shares = (functions @ block.vectors) ** 2
    function_of_state = assigned(shares, np.ones(len(functions), dtype=np.int64))
    return names[function_of_state], shares[function_of_state, np.arange(len(function_of_state))]


def _by_k(part: Part, representation: str) -> tuple[list[int], list[int]]:
    """Ka and Kc of the functions, whose K rises."""
    ka, kc = names_of(part.basis, representation)
    along = kc if representation == "IIIl" else ka
    order = np.argsort(along, kind="stable")  # stable: both components of one K keep their order
    return ka[order].tolist(), kc[order].tolist()


def _functions_with_l(
    unit_vector: Floats, k: int, part: Part, parts: Sequence[Part], second: int, representation: str
) -> list[tuple[int, Floats]]:
    """(x ± y)/√2 with K l > 0 and with K l < 0, by the sign of ⟨Nz l⟩; x only at K = 0."""
    if k == 0:
        return [(second, unit_vector)]
    operator = -1j * j_z(part.basis.j)  # ⟨x|Nz l|y⟩
    for partner in parts:
        if partner.v == second and partner.basis.sign == -part.basis.sign and k in partner.basis.k.tolist():
            at = partner.basis.k.tolist().index(k)
            element = between_blocks(part.basis, partner.basis, operator).real[part.basis.k.tolist().index(k), at]
            other = np.zeros_like(unit_vector)
            other[partner.place.start + at] = np.sign(element)
            return [(part.v, (unit_vector + other) / sqrt(2.0)), (second, (unit_vector - other) / sqrt(2.0))]
    raise ValueError(_UNCOUPLED)
