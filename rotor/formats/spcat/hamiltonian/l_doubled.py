"""Degenerate states of symmetric tops, l = ±L, as two real vibrational states x, y: operators of a file, and names of levels.

    |l = ±⟩ = (|x⟩ ± i|y⟩)/√2

A file names the pair by EWT1: the first state holds the functions with K l > 0, [|K⟩|+⟩ ± |-K⟩|-⟩]/√2, the second those with
K l ≤ 0. Its operators O are meant over |k⟩|l⟩ (H. M. Pickett, documentation of SPFIT and SPCAT, "l-doubled states"):

| V1, V2 | elements | over x and y |
|---|---|---|
| the first state twice | O, both l alike | O, O |
| the same, O odd (Na, ...) | O l/L | ⟨x|H|y⟩ = -i O |
| both states | Δl = ±2L, Δk Δl > 0 (V2 < V1), else < 0 | ½ O, -½ O, ⟨x|H|y⟩ = ±(i/2)(O↑ - O↓) |
| another state and the first | Δl = ±L, likewise | O/√2, ±(i/√2)(O↑ - O↓) |
| two first states | O, both l alike | O, O |

O↑ and O↓ are the parts that raise and lower k. Parameters of the second state twice are passed over, as in the program. What depends
on the phase between x and y, the parity of a split pair, is not verified against the program.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.quantum.coupled import CoupledBlock, Part
from rotor.quantum.levels import Levels
from rotor.quantum.spins.operators import AxialState, Basis
from rotor.quantum.spins.parts import assigned
from rotor.quantum.states import Coupling, OperatorOfJ
from rotor.quantum.wang.basis import WangBlock, names_of
from rotor.quantum.wang.j_operators import JOperator, between_blocks, j_z


class Pair(NamedTuple):
    """Two states by their numbers: that with K l > 0, which x stands for, and that with K l ≤ 0, y."""

    first: int
    second: int


def pairs_of(states: Sequence[StateOptions]) -> list[Pair]:
    """The l-doubled pairs among the states of a file; ValueError for a state without its partner."""
    found, at = [], 0
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
        found.append(Pair(first.number, second.number))
        at += 2
    return found


def up(operator: JOperator) -> JOperator:
    """The part that raises k."""
    return JOperator(operator.j, {q: band for q, band in operator.bands.items() if q > 0})


def down(operator: JOperator) -> JOperator:
    """The part that lowers k."""
    return JOperator(operator.j, {q: band for q, band in operator.bands.items() if q < 0})


def _scaled(of: OperatorOfJ, factor: complex) -> OperatorOfJ:
    return lambda j, representation: factor * of(j, representation)


def _turned(of: OperatorOfJ, factor: complex) -> OperatorOfJ:
    """factor (O↑ - O↓)."""

    def operator(j: int, representation: str) -> JOperator:
        whole = of(j, representation)
        return factor * (up(whole) - down(whole))

    return operator


def couplings_with_pairs(
    name: str, of: OperatorOfJ, odd: bool, states: tuple[int, int], reversed_: bool, pairs: Sequence[Pair]
) -> list[Coupling]:
    """What a parameter stands for over real states, where one of its states at least is l-doubled.

    Parameters
    ----------
    name : str
        Of the parameter.
    of : callable
        (J, representation) to the operator in |J k⟩, with the factor i where it is odd.
    odd : bool
        Whether the operator changes sign under time reversal.
    states : (int, int)
        Lower number first.
    reversed_ : bool
        V2 > V1 in the code, Δk Δl < 0.
    pairs : sequence of Pair
        The l-doubled states of the file.

    Returns
    -------
    list of Coupling
        As the table at the head of the module.

    Raises
    ------
    ValueError
        For what symmetry or this package does not allow.
    """
    low, high = states
    firsts, seconds = {pair.first: pair for pair in pairs}, {pair.second: pair for pair in pairs}
    sign = -1.0 if reversed_ else 1.0
    if low == high:
        return _within(name, of, odd, firsts.get(low))
    if (low in firsts and firsts[low].second == high) or (high in firsts and firsts[high].second == low):
        if odd:
            raise ValueError("an odd operator between l and -l is not invariant under time reversal")
        x, y = sorted(states)
        turned = _turned(of, 0.5j * sign * (1.0 if x in firsts else -1.0))
        return [
            Coupling(name, x, x, _scaled(of, 0.5)),
            Coupling(name, y, y, _scaled(of, -0.5)),
            Coupling(name, x, y, turned),
        ]
    if low in firsts and high in firsts:
        if odd:
            raise ValueError("an odd operator between two l-doubled states is read but not computed yet")
        return [
            _between(name, firsts[low].first, firsts[high].first, of),
            _between(name, firsts[low].second, firsts[high].second, of),
        ]
    if low in seconds or high in seconds:
        raise ValueError(
            "an operator of the state with K l ≤ 0 is read but not computed yet; name the one with K l > 0"
        )
    pair = firsts[low] if low in firsts else firsts[high]
    other = high if low in firsts else low
    across = _turned(of, 1j * sign / sqrt(2.0))
    return [
        _between(name, other, pair.first, _scaled(of, 1 / sqrt(2.0))),
        _between(name, other, pair.second, across),
    ]


def _between(name: str, one: int, other: int, of: OperatorOfJ) -> Coupling:
    return Coupling(name, min(one, other), max(one, other), of)


def _within(name: str, of: OperatorOfJ, odd: bool, pair: Pair | None) -> list[Coupling]:
    if pair is None:  # of the second state: passed over
        return []
    x, y = sorted(pair)
    if odd:
        return [Coupling(name, x, y, _scaled(of, -1.0 if x == pair.first else 1.0))]
    return [Coupling(name, x, x, of), Coupling(name, y, y, of)]


# Names of levels


def named_by_l(levels: Levels, pairs: Sequence[Pair], representation: str) -> Levels:
    """The same levels with v of a pair by the sign of K l, and Ka, Kc of the function |K, l⟩ ± |-K, -l⟩ with the largest share."""
    labels, mixing = np.empty((len(levels), 3), dtype=np.int64), np.empty(len(levels))
    for block in levels.blocks:
        rows = slice(block.start, block.start + len(block.energies_mhz))
        labels[rows], mixing[rows] = _names_of_block(block, pairs, representation)
    quanta = {**levels.quanta, "v": labels[:, 0], "ka": labels[:, 1], "kc": labels[:, 2]}
    return replace(levels, quanta=quanta, mixing=mixing)


def functions_of_l(block: CoupledBlock, pairs: Sequence[Pair], representation: str) -> tuple[Floats, Ints]:
    """The functions (n, n), in rows, by which the states of a block are called, and their names v, Ka, Kc (n, 3).

    Those of states that are not l-doubled are the basis; of a pair they are |K, l⟩ ± |-K, -l⟩ with K l > 0 and with K l < 0. Half a turn
    across the axis changes the sign of y, so that of the two functions with K = 0 that of y has the other species, Ka + Kc = N + 1.
    """
    return functions_of_parts(block.parts, len(block.vectors), pairs, representation)


def functions_of_parts(
    places: Sequence[tuple[int, Basis, int]], size: int, pairs: Sequence[Pair], representation: str
) -> tuple[Floats, Ints]:
    """The same as `functions_of_l`, of any part of a basis.

    Parameters
    ----------
    places : sequence of (int, WangBlock, int)
        State, Wang block and first place of each part.
    size : int
        Number of functions.
    pairs : sequence of Pair
        l-doubled states.
    representation : str
        Which principal axes are x, y, z.

    Returns
    -------
    functions : (size, size) array
        In rows.
    names : (size, 3) array of int
        v, Ka, Kc.
    """
    functions, names = list[Floats](), list[tuple[int, int, int]]()
    second = {pair.first: pair.second for pair in pairs}
    members = {v for pair in pairs for v in pair}
    parts = [Part(v, _wang(basis), start) for v, basis, start in places]
    for part in parts:
        for place, (k, ka, kc) in enumerate(zip(part.basis.k.tolist(), *_by_k(part, representation), strict=True)):
            own = np.zeros(size)
            own[part.start + place] = 1.0
            if part.v not in members:
                functions.append(own)
                names.append((part.v, ka, kc))
            elif part.v in second:
                for v, function in _of_l(own, k, part, parts, second[part.v], representation):
                    functions.append(function)
                    names.append((v, ka, kc))
            elif k == 0:
                functions.append(own)
                names.append((part.v, ka + 1, kc) if representation == "IIIl" else (part.v, ka, kc + 1))
    if len(functions) < size:
        raise ValueError(_UNCOUPLED)
    return np.array(functions), np.array(names)


_UNCOUPLED = "l-doubled states without a coupling of their components; give -2Aζ (TYP 20) for them"


def _wang(basis: Basis) -> WangBlock:
    if isinstance(basis, AxialState):
        raise ValueError(_UNCOUPLED)
    return basis


def _names_of_block(block: CoupledBlock, pairs: Sequence[Pair], representation: str) -> tuple[Ints, Floats]:
    functions, names = functions_of_l(block, pairs, representation)
    shares = (functions @ block.vectors) ** 2
    of_state = assigned(shares, np.ones(len(functions), dtype=np.int64))
    return names[of_state], shares[of_state, np.arange(len(of_state))]


def _by_k(part: Part, representation: str) -> tuple[list[int], list[int]]:
    """Ka and Kc in the order of the functions, whose K rises."""
    ka, kc = names_of(part.basis, representation)
    along = kc if representation == "IIIl" else ka
    order = np.argsort(along, kind="stable")
    return ka[order].tolist(), kc[order].tolist()


def _of_l(
    own: Floats, k: int, part: Part, parts: Sequence[Part], second: int, representation: str
) -> list[tuple[int, Floats]]:
    """(x ± y)/√2 with K l > 0 and with K l < 0, by the sign of ⟨Nz l⟩; x alone at K = 0."""
    if k == 0:
        return [(second, own)]
    operator = -1j * j_z(part.basis.j)  # ⟨x|Nz l|y⟩
    for partner in parts:
        if partner.v == second and partner.basis.sign == -part.basis.sign and k in partner.basis.k.tolist():
            at = partner.basis.k.tolist().index(k)
            element = between_blocks(part.basis, partner.basis, operator).real[part.basis.k.tolist().index(k), at]
            other = np.zeros_like(own)
            other[partner.start + at] = np.sign(element)
            return [(part.v, (own + other) / sqrt(2.0)), (second, (own - other) / sqrt(2.0))]
    raise ValueError(_UNCOUPLED)
