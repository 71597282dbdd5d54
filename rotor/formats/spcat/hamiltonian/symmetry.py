"""Parameters, or parts of them, that the declared symmetry forbids; SPCAT leaves them out with a warning in its .out file.

An n-fold axis (IAX 6 to 11) allows only Δk - Δl = 0, ±n, .... Operators that connect only levels of unequal nuclear-spin weights are left
out too, and operators between states whose axes differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rotor.formats.spcat.hamiltonian.code_table import TURNS, Symmetry
from rotor.formats.spcat.hamiltonian.l_doubled import Pair
from rotor.formats.spcat.hamiltonian.operators import CodedOperator, as_matrix
from rotor.formats.spcat.hamiltonian.states import SPECIES, StateOptions
from rotor.quantum.spins.scheme import Cosines, CosinesWithN


def l_values(states: Sequence[StateOptions], pairs: Sequence[Pair]) -> dict[int, int]:
    """l of the l-doubled states by number, positive for the state with K l > 0."""
    l_of_state: dict[int, int] = {}
    for pair in pairs:
        size = min(states[pair.first].l_code, states[pair.second].l_code)
        l_of_state |= {pair.first: size, pair.second: -size}
    return l_of_state


def forbidden(
    symmetry: Symmetry, low: StateOptions, high: StateOptions, del_l: int, doubled: bool, spins: Sequence[int] = ()
) -> str:
    """The reason why symmetry forbids an operator between two states, or within one; empty if it is allowed.

    symmetry: of its code. low, high: of the two states; the same twice within one state. del_l: |Δl|, negative where Δk Δl < 0. doubled:
    whether one of the states is l-doubled; the species of its levels are not tested. spins: numbers, from 1, of the spins on which it
    acts.
    """
    if (low.fold, low.i_tot) != (high.fold, high.i_tot):
        return "the axes of the two states differ"
    first = len(low.spins) - 2  # the number of the first of three equivalent spins
    if low.is_threefold(spins):
        among = sorted(spin for spin in spins if spin >= first)
        named = set(among) == {first} or among == [first, first + 1] == sorted(spins)
        return "" if named else "of three equivalent spins the first is named, or the first and the second"
    if low.fold > 2 and (symmetry.delta_k - del_l) % low.fold:
        return f"its Δk - Δl is no multiple of {low.fold}"
    # the last two spins carry the total
    on_total = low.equivalent == 2 and max(spins, default=0) > len(low.spins) - 2
    turns = (0, 1) if on_total else (0,)  # of the function of two equivalent spins
    if not doubled and not any(weights_agree(symmetry.axis, low, high, odd) for odd in turns):
        return "it connects levels of unequal nuclear-spin weights"
    return ""


def exchange_part(axis: str, low: StateOptions, high: StateOptions) -> int:
    """The part of an operator with one of two equivalent spins that connects levels of equal weight: 1 even, -1 odd, 0 both."""
    even, odd = (weights_agree(axis, low, high, turned) for turned in (0, 1))
    return int(even) - int(odd)


def weights_agree(axis: str, low: StateOptions, high: StateOptions, odd_spins: int = 0) -> bool:
    """Whether an operator along an axis connects levels of equal weight.

    axis: its axis, "" for none. low, high: of the two states; the same twice within one state. odd_spins: 1 if it also changes the sign
    of the function of equivalent spins.
    """
    turn = TURNS[axis]
    for species in SPECIES:
        other = (species[0] ^ turn[0], species[1] ^ turn[1])
        ours, theirs = _weights(low, *species), _weights(high, *other, odd_spins)
        agree = bool(set(ours) & set(theirs) - {0}) if low.fold > 2 else ours[0] == theirs[0]
        if agree:
            return True
    return False


@lru_cache(maxsize=4096)
def _weights(state: StateOptions, ka: int, kc: int, odd_spins: int = 0, axes: str = "ac") -> tuple[int, ...]:
    """Weights of A (or B) and of E levels in the Wang block of a species, for K along a or c, or along either of both."""
    ka_array, kc_array = np.array([ka]), np.array([kc])
    if state.fold < 3:
        return (int(state.class_weight(ka_array, kc_array, odd_spins)[0]),)
    along_axis = {"a": ka, "c": kc}
    along = {k: state.block_weights(ka_array, kc_array, np.array([k]))[0] for k in map(along_axis.__getitem__, axes)}
    return tuple(sorted({int(weight) for pair in along.values() for weight in pair}))


SpeciesPairs = frozenset[tuple[str, str]]


def species_pairs(up: StateOptions, low: StateOptions, turned: tuple[bool, bool], axis: str) -> SpeciesPairs | None:
    """Pairs of species of Wang blocks of two states that an operator may connect, those with equal weights; None for all.

    turned: for each state, whether a half turn across the axis changes its sign, as for the second component y of l-doubled states.
    axis: that of K, a or c, by whose parity the weights of an axis of an even fold differ.
    """
    if low.equivalent or up.equivalent:
        return None
    swapped = (
        replace(state, plus=state.minus, minus=state.plus) if flip else state
        for state, flip in zip((up, low), turned, strict=True)
    )
    up_weights, low_weights = (
        {"eo"[ka] + "eo"[kc]: _weights(state, ka, kc, axes=axis) for ka, kc in SPECIES} for state in swapped
    )
    pairs = frozenset((s, t) for s in up_weights for t in low_weights if up_weights[s] == low_weights[t])
    return pairs if len(pairs) < len(up_weights) * len(low_weights) else None


def symmetric_part(operator: CodedOperator, axes: str) -> CodedOperator:
    """The part of Nb² and Nc² (also with a spin) that an axis of more than two folds along z allows, without ΔK = 2."""
    if operator.plain is not None:
        return replace(operator, plain={powers: value for powers, value in operator.plain.items() if powers[2] == 0})
    return _scaled_across(operator, axes, 0.0)


def halved_across(operator: CodedOperator, axes: str) -> CodedOperator:
    """An operator with one of three equivalent spins, with the part of ΔK ≠ 0 halved, as SPCAT defines its code.

    With tensors of the three nuclei that are turned by 120° from one to the next, levels agree with the program's if its parameter with
    ΔK = 1 or 2 is twice that of a single nucleus; with ΔK = 0 both are equal.
    """
    return _scaled_across(operator, axes, 0.5)


def _scaled_across(operator: CodedOperator, axes: str, factor: float) -> CodedOperator:
    """The operator with the parts of its matrix, if it has one, that change K times a factor."""
    if not isinstance(operator.rotor, Cosines | CosinesWithN) or np.ndim(operator.rotor.components) < 2:
        return operator
    x, y, z = ("abc".index(axis) for axis in axes)
    c = np.array(operator.rotor.components, dtype=float)
    along = np.zeros((3, 3))
    along[x, x] = along[y, y] = (c[x, x] + c[y, y]) / 2
    along[x, y] = (c[x, y] - c[y, x]) / 2
    along[y, x], along[z, z] = -along[x, y], c[z, z]
    c = along + factor * (c - along)
    return replace(operator, rotor=type(operator.rotor)(as_matrix(c)))
