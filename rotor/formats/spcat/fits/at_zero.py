"""Parameters at 0 that a fit may leave out of the Hamiltonian: they change no level to first order, and make blocks larger.

A block of states without spins is a set of (state, symmetry under the twofold rotations) that parameters other than 0 connect. A
parameter at 0 between two of these sets moves their levels by its square alone: its derivative is 0 where it starts, and it stays there.
Where levels of two sets coincide, as the two of one K do at high K, round-off would mix them and give it a derivative all the same.
"""

from __future__ import annotations

from collections.abc import Iterable

from rotor.formats.spcat.hamiltonian.codes import Digits, is_held, split_code
from rotor.formats.spcat.hamiltonian.l_doubled import pairs_of
from rotor.formats.spcat.hamiltonian.series import is_constant, is_series
from rotor.formats.spcat.hamiltonian.states import states_of
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.connected import connected_parts

_SYMMETRIES = range(4)  # of the group of twofold rotations; an operator of symmetry s leads from t to s ^ t
_OF_TYP = 20  # TYP 20, 40 and 60 begin the operators of the symmetry of N_a, N_b and N_c
_HIGHEST_TYP = 80

Place = tuple[int, int, int]  # of the two states and the symmetry of an operator


def left_at_zero(file: ParameterFile) -> frozenset[int]:
    """The places of parameters of value 0 that are held, or connect what nothing else connects and so stay at 0."""
    places = _places(file)
    acting = (place for place, p in zip(places, file.parameters, strict=True) if place and p.value)
    known = _sets(acting, len(states_of(file)))
    apart = [place is not None and all(known[a] != known[b] for a, b in _edges(place)) for place in places]
    return frozenset(
        i for i, p in enumerate(file.parameters) if not p.value and (p.constrained or is_held(p) or apart[i])
    )


def stay_at_zero(file: ParameterFile) -> list[str]:
    """Labels of the free ones among them."""
    found = [file.parameters[i] for i in sorted(left_at_zero(file))]
    return [p.label or str(p.code) for p in found if not (p.constrained or is_held(p))]


def _places(file: ParameterFile) -> list[Place | None]:
    """The states and the symmetry of the operator of each parameter of certain states without spins; None of others."""
    states = states_of(file)
    if any(state.spins for state in states) or pairs_of(states):
        return [None] * len(file.parameters)
    return [_place(split_code(parameter.code, len(states)), len(states)) for parameter in file.parameters]


def _place(digits: Digits, states: int) -> Place | None:
    low, high = sorted((digits.v1, digits.v2))
    if is_series(digits) or is_constant(digits) or digits.typ >= _HIGHEST_TYP:
        return None
    return None if high >= states else (low, high, digits.typ // _OF_TYP)


def _sets(places: Iterable[Place], states: int) -> dict[int, int]:
    """The number of the set of each node, 4 v + symmetry."""
    edges = (edge for place in places for edge in _edges(place))
    return {node: i for i, part in enumerate(connected_parts(len(_SYMMETRIES) * states, edges)) for node in part}


def _edges(place: Place) -> list[tuple[int, int]]:
    """The pairs of nodes that an operator connects."""
    low, high, symmetry = place
    return [(len(_SYMMETRIES) * low + one, len(_SYMMETRIES) * high + (one ^ symmetry)) for one in _SYMMETRIES]
