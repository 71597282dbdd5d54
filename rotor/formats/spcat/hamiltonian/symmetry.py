"""What the symmetry that option lines declare forbids: such parameters, or parts of them, SPCAT leaves out with a warning in its .out.

An n-fold axis (IAX 6 to 11) allows Δk - Δl = 0, ±n, ... only. Operators that connect levels of unequal nuclear-spin weights alone
are left out too, and so are those between states whose axes differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rotor.formats.spcat.hamiltonian.code_types import TURNS, axis_of, delta_k
from rotor.formats.spcat.hamiltonian.l_doubled import Pair
from rotor.formats.spcat.hamiltonian.operators import CodedOperator
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.quantum.spins.operators import Cosines, CosinesWithN, Matrix

_SPECIES = ((0, 0), (0, 1), (1, 1), (1, 0))  # A, Ba, Bb, Bc by parities of Ka and Kc


def l_values(states: Sequence[StateOptions], pairs: Sequence[Pair]) -> dict[int, int]:
    """l of the l-doubled states by number: that of the state with K l > 0 is positive."""
    found: dict[int, int] = {}
    for pair in pairs:
        size = min(states[pair.first].l_code, states[pair.second].l_code)
        found |= {pair.first: size, pair.second: -size}
    return found


def forbidden(
    typ: int, low: StateOptions, high: StateOptions, del_l: int, oblate: bool, doubled: bool, spins: Sequence[int] = ()
) -> str:
    """Why an operator between two states, or within one, has no elements; nothing where it has some.

    Parameters
    ----------
    typ : int
        TYP of its code.
    low, high : StateOptions
        Of the two states; the same twice within one state.
    del_l : int
        |Δl|, negative where Δk Δl < 0.
    oblate : bool
        Whether z is the c axis.
    doubled : bool
        Whether one of the states is l-doubled: the species of such levels are not looked at.
    spins : sequence of int, optional
        Numbers of the spins that it acts on, from 1.

    Returns
    -------
    str
        The reason.
    """
    if (low.fold, low.i_tot) != (high.fold, high.i_tot):
        return "the axes of the two states differ"
    first = len(low.spins) - 2  # the number of the first of three equivalent spins
    if low.equivalent == 3 and max(spins, default=0) >= first:
        among = sorted(spin for spin in spins if spin >= first)
        named = set(among) == {first} or among == [first, first + 1] == sorted(spins)
        return "" if named else "of three equivalent spins the first is named, or the first and the second"
    if low.fold > 2 and (delta_k(typ, oblate) - del_l) % low.fold:
        return f"its Δk - Δl is no multiple of {low.fold}"
    on_total = low.equivalent == 2 and max(spins, default=0) > len(low.spins) - 2
    turns = (0, 1) if on_total else (0,)  # of the function of two equivalent spins
    if not doubled and not any(some_weights_agree(typ, low, high, odd) for odd in turns):
        return "it connects levels of unequal nuclear-spin weights"
    return ""


def exchange_of(typ: int, low: StateOptions, high: StateOptions) -> int:
    """The part of an operator with one of two equivalent spins that joins levels of one weight: 1 the even one, -1 the odd one, 0 both."""
    even, odd = (some_weights_agree(typ, low, high, turned) for turned in (0, 1))
    return int(even) - int(odd)


def some_weights_agree(typ: int, low: StateOptions, high: StateOptions, odd_spins: int = 0) -> bool:
    """Whether an operator by its TYP (20, 40, 60: of the species of Na, Nb, Nc) joins levels of one weight.

    Parameters
    ----------
    typ : int
        TYP of its code.
    low, high : StateOptions
        Of the two states; the same twice within one state.
    odd_spins : int, optional
        1 where it changes the sign of the function of equivalent spins too.

    Returns
    -------
    bool
        Whether two such levels have one weight.
    """
    turn = TURNS[axis_of(typ)]
    for species in _SPECIES:
        other = (species[0] ^ turn[0], species[1] ^ turn[1])
        ours, theirs = _weights(low, *species), _weights(high, *other, odd_spins)
        agree = bool(set(ours) & set(theirs) - {0}) if low.fold > 2 else ours[0] == theirs[0]
        if agree:
            return True
    return False


@lru_cache(maxsize=4096)
def _weights(state: StateOptions, ka: int, kc: int, odd_spins: int = 0) -> tuple[int, ...]:
    """Of A (or B) and of E levels in the Wang block of a species, whichever axis K is along."""
    one, other = np.array([ka]), np.array([kc])
    if state.fold < 3:
        return (int(state.class_weight(one, other, odd_spins)[0]),)
    along = {int(k): state.block_weights(one, other, np.array([k]))[0] for k in (ka, kc)}
    return tuple(sorted({int(weight) for found in along.values() for weight in found}))


SpeciesPairs = frozenset[tuple[str, str]]


def species_pairs(up: StateOptions, low: StateOptions, turned: tuple[bool, bool]) -> SpeciesPairs | None:
    """The species of Wang blocks of two states between which there are elements, those whose levels have the same weights; None for all.

    turned: of each state, whether half a turn across the axis changes its sign: of l-doubled states the second component, y.
    """
    if low.equivalent or up.equivalent:
        return None
    own, other = (_by_species(state, flip) for state, flip in zip((up, low), turned, strict=True))
    found = frozenset((s, t) for s in own for t in other if own[s] == other[t])
    return found if len(found) < len(own) * len(other) else None


def _by_species(state: StateOptions, turned: bool) -> dict[str, tuple[int, ...]]:
    swapped = replace(state, plus=state.minus, minus=state.plus) if turned else state
    return {"eo"[ka] + "eo"[kc]: _weights(swapped, ka, kc) for ka, kc in _SPECIES}


def symmetric_part(operator: CodedOperator, axes: str) -> CodedOperator:
    """Of Nb² and Nc², with a spin or without, the part that an axis of more than two folds along z leaves: without ΔK = 2."""
    if operator.plain is not None:
        return replace(operator, plain={powers: value for powers, value in operator.plain.items() if powers[2] == 0})
    return operator if not _is_matrix(operator) else _scaled_across(operator, axes, 0.0)


def halved_across(operator: CodedOperator, axes: str) -> CodedOperator:
    """An operator with one of three equivalent spins, its part with ΔK ≠ 0 halved: that is what its code stands for in SPCAT.

    With the tensors of the three nuclei, turned by 120° from one to the next, levels agree with the program's where the value of its
    parameter with ΔK = 1 or 2 is twice that of a nucleus coupled by itself; with ΔK = 0 it is the same.
    """
    return operator if not _is_matrix(operator) else _scaled_across(operator, axes, 0.5)


def _is_matrix(operator: CodedOperator) -> bool:
    return isinstance(operator.rotor, Cosines | CosinesWithN) and np.ndim(operator.rotor.components) == 2


def _scaled_across(operator: CodedOperator, axes: str, factor: float) -> CodedOperator:
    """The operator with the parts of its matrix that change K times a factor."""
    assert isinstance(operator.rotor, Cosines | CosinesWithN)
    x, y, z = ("abc".index(axis) for axis in axes)
    c = np.array(operator.rotor.components, dtype=float)
    along = np.zeros((3, 3))
    along[x, x] = along[y, y] = (c[x, x] + c[y, y]) / 2
    along[x, y] = (c[x, y] - c[y, x]) / 2
    along[y, x], along[z, z] = -along[x, y], c[z, z]
    c = along + factor * (c - along)
    components: Matrix = tuple(tuple(float(value) for value in row) for row in c)  # type: ignore[assignment]
    return replace(operator, rotor=type(operator.rotor)(components))
