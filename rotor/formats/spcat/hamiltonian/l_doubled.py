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

O↑ and O↓ are the parts that raise and lower k. The table also holds for the operators of N in spin terms: for a tensor with components
q = ±1 or ±2 only, i(O↑ - O↓) is the tensor turned about z by 90° or 45°, xz becomes yz, and xx - yy becomes xy + yx.
Parameters of the second state twice are ignored, as in SPFIT. The parity of a split pair,
which depends on the phase between x and y, is not verified against the program.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.labels import Functions, places, renamed, wang_functions
from rotor.formats.spcat.hamiltonian.operators import as_matrix
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.operators.rotation import sum_of_powers, weighted
from rotor.quantum.spins.scheme import ByElements, Cosines, CosinesWithN, Rotor, Scalar


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
    states: tuple[int, int], odd: bool, reversed_: bool, pairs: Sequence[Pair], axes: str, what: str = "operator"
) -> list[RealPart]:
    """Parts of a parameter over real states, if at least one of its states is l-doubled (table of this module).

    states: numbers, the lower one first. odd: whether the operator changes sign under time reversal. reversed_: whether V2 > V1 in the
    code, Δk Δl < 0. pairs: the l-doubled states of the file. axes: the axes x, y, z: bca or bac. what: kind of operator for messages; an
    odd "spin operator" between different states is not supported.
    Returns: real states, factors and kinds of operator.
    Raises ValueError for operators that symmetry forbids or this package does not support.
    """
    low, high = states
    firsts, seconds = {pair.first: pair for pair in pairs}, {pair.second: pair for pair in pairs}
    sign = -1.0 if reversed_ else 1.0
    if low == high:
        if low not in firsts:  # of the second state: passed over
            return []
        x, y = sorted(firsts[low])
        # the sign of what is odd is another between states than within a pair of an oblate basis
        sign = -1.0 if (x == low) == (axes[2] == "a") else 1.0
        return [RealPart(x, y, sign)] if odd else [RealPart(x, x, 1.0), RealPart(y, y, 1.0)]
    if odd and what != "operator":
        raise ValueError(f"an odd {what} between l-doubled states is read but not computed yet")
    if (low in firsts and firsts[low].second == high) or (high in firsts and firsts[high].second == low):
        if odd:
            raise ValueError("an odd operator between l and -l is not invariant under time reversal")
        half = 0.5 * sign * (1.0 if low in firsts else -1.0)
        return [RealPart(low, low, 0.5), RealPart(high, high, -0.5), RealPart(low, high, half, True)]
    if low in firsts and high in firsts:
        if odd:
            raise ValueError("an odd operator between two l-doubled states is read but not computed yet")
        return [RealPart(min(pair), max(pair), 1.0) for pair in zip(firsts[low], firsts[high], strict=True)]
    if low in seconds or high in seconds:
        article = "an" if what == "operator" else "a"
        raise ValueError(
            f"{article} {what} of the state with K l ≤ 0 is read but not computed yet; name the one with K l > 0"
        )
    pair, second = (firsts[low], high) if low in firsts else (firsts[high], low)
    components = ((pair.first, 1.0, False), (pair.second, sign, True))
    return [RealPart(min(second, v), max(second, v), factor / sqrt(2.0), turned) for v, factor, turned in components]


def turned_operator(operator: Operator) -> Operator:
    """i(O↑ - O↓)."""
    return weighted(operator, lambda m, n, above, below: 1j * np.sign(above - below))


def turned_rotor(rotor: Rotor, axes: str) -> Rotor | None:
    """i(O↑ - O↓) of a tensor or of powers of N; None if it is zero.

    >>> turned_rotor(Cosines(((0, 0, 0), (0, 1.0, 0), (0, 0, -1.0))), "bca").components  # bb - cc becomes bc + cb
    ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    """
    if isinstance(rotor, Scalar):
        changes_k = any(n for (_, _, n), _ in rotor.operators)
        return ByElements(0, turned_operator(sum_of_powers(dict(rotor.operators)))) if changes_k else None
    if not isinstance(rotor, Cosines | CosinesWithN) or (rotor.rank == 1 and isinstance(rotor, Cosines)):
        return None
    # O↑ raises k about z, for which x and y of an oblate basis, a left-handed frame, change places
    x, y = ("abc".index(axis) for axis in (axes[:2] if axes[2] == "a" else axes[1::-1]))
    c, turn = np.array(rotor.components, dtype=float), np.zeros((3, 3))
    turn[x, y], turn[y, x] = -1.0, 1.0  # by a small angle about z
    turned = turn @ c - c @ turn
    turned[np.ix_((x, y), (x, y))] /= 2  # components that change K by two turn by twice the angle
    if not turned.any():
        return None
    turned += 0.0  # no minus zeros
    return type(rotor)(as_matrix(turned))


# Labels of levels

_UNCOUPLED = "l-doubled states without a coupling of their components; give -2Aζ (TYP 20) for them"


def functions_by_l(block: SolvedBlock, pairs: Sequence[Pair], representation: str) -> Functions:
    """The functions that label the states of a block: |K, l⟩ ± |-K, -l⟩ with K l > 0 and with K l < 0 of a pair, else Wang functions.

    (x ± y)/√2 of one K has K l > 0 if ⟨x|Nz l|y⟩ is positive, which it is for x with Ka + Kc - N + K even. A half turn across the axis
    changes the sign of y; of the two functions with K = 0, the one of y therefore has the other species, Ka + Kc = N + 1.
    """
    if block.axial_k is not None:
        raise ValueError(_UNCOUPLED)
    plain, second_of = wang_functions(block, representation), {pair.first: pair.second for pair in pairs}
    members = {v for pair in pairs for v in pair}
    keys = np.column_stack([plain.names[:, 0], plain.n, plain.k, plain.above, plain.names[:, 3:]]).tolist()
    row_of = {tuple(key): row for row, key in enumerate(keys)}
    names, amplitudes = list[Ints](), list[Floats]()
    for name, amplitude, (v, n, k, above, *pattern) in zip(plain.names, plain.amplitudes, keys, strict=True):
        if v in second_of and k:
            partner = row_of.get((second_of[v], n, k, 1 - above, *pattern))
            if partner is None:
                raise ValueError(_UNCOUPLED)
            other = (-1) ** (k + above) * plain.amplitudes[partner]
            names += [name, np.concatenate([[second_of[v]], name[1:]])]
            amplitudes += [(amplitude + other) / sqrt(2.0), (amplitude - other) / sqrt(2.0)]
        elif v in second_of:
            names.append(np.concatenate([[second_of[v]], name[1:]]))
            amplitudes.append(amplitude)
        elif v not in members or k == 0:
            names.append(
                name + (v in members) * np.eye(len(name), dtype=np.int64)[1 if representation == "IIIl" else 2]
            )
            amplitudes.append(amplitude)
    if len(names) < len(keys):
        raise ValueError(_UNCOUPLED)
    alone = np.arange(len(names))
    return Functions(np.array(names), plain.k, alone, alone, np.array(amplitudes), plain.n)


def named_by_l(levels: Levels, pairs: Sequence[Pair], representation: str) -> Levels:
    """Levels with v of a pair by the sign of K l, and the labels of the function of `functions_by_l` with the largest weight."""
    tables, shares = list[Ints](), list[Floats]()
    for block in levels.blocks:
        functions = functions_by_l(block, pairs, representation)
        at = places(functions, block.energies_mhz, 1)
        tables.append(functions.names[at])
        shares.append(functions.amplitudes[at, np.arange(len(at))] ** 2)
    return renamed(levels, tables, shares)
