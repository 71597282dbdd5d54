"""Parameters with value 0 that a fit may leave out: they shift no level to first order, and only enlarge blocks.

A block of states without spins is a set of (state, symmetry under the twofold rotations) that nonzero parameters connect. A parameter
of value 0 between two such sets shifts levels only by its square: its derivative is 0 at the start, and a fit does not move it. If levels
of two sets coincide, as the two of one K do at high K, round-off would mix them and give a spurious derivative.
"""

from __future__ import annotations

from collections.abc import Iterable

from rotor.formats.spcat.hamiltonian.code_table import Digits, Kind
from rotor.formats.spcat.hamiltonian.coded_file import CodedFile, coded_file
from rotor.formats.spcat.hamiltonian.codes import is_held
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.connected import connected_parts

_SYMMETRIES = range(4)  # species of the group of twofold rotations; an operator of symmetry s connects t with s ^ t

Place = tuple[int, int, int]  # the two states and the symmetry of an operator


def left_at_zero(file: ParameterFile) -> frozenset[int]:
    """Places of parameters of value 0 that are held, or that connect otherwise unconnected sets and therefore remain 0."""
    coded = coded_file(file)
    places = _places(coded)
    acting = (place for place, p in zip(places, file.parameters, strict=True) if place and p.value)
    set_of_node = _sets(acting, len(coded.states))
    apart = [place is not None and all(set_of_node[a] != set_of_node[b] for a, b in _edges(place)) for place in places]
    return frozenset(
        i for i, p in enumerate(file.parameters) if not p.value and (p.constrained or is_held(p) or apart[i])
    )


def stay_at_zero(file: ParameterFile) -> list[str]:
    """Labels of the free parameters that remain 0."""
    remaining = [file.parameters[i] for i in sorted(left_at_zero(file))]
    return [p.label or str(p.code) for p in remaining if not (p.constrained or is_held(p))]


def _places(coded: CodedFile) -> list[Place | None]:
    """States and symmetry of the operator of each parameter without spins between definite states; None for others."""
    if any(state.spins for state in coded.states) or coded.pairs:
        return [None] * len(coded.digits)
    return [_place(digits, len(coded.states)) for digits in coded.digits]


def _place(digits: Digits, states: int) -> Place | None:
    """States and symmetry of a code; None with spins or for all states."""
    both = digits.states(states)
    if digits.is_series or digits.is_constant or digits.kind is Kind.LEVEL or both is None or max(both) >= states:
        return None
    return (*both, ("", "a", "b", "c").index(digits.tensor.axis))


def _sets(places: Iterable[Place], states: int) -> dict[int, int]:
    """Number of the connected set of each node, 4 v + symmetry."""
    edges = (edge for place in places for edge in _edges(place))
    return {node: i for i, part in enumerate(connected_parts(len(_SYMMETRIES) * states, edges)) for node in part}


def _edges(place: Place) -> list[tuple[int, int]]:
    """The pairs of nodes that an operator connects."""
    low, high, symmetry = place
    return [
        (len(_SYMMETRIES) * low + species, len(_SYMMETRIES) * high + (species ^ symmetry)) for species in _SYMMETRIES
    ]
