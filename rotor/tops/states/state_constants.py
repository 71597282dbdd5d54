"""Further vibrational or tunnelling states of a top: their constants, couplings and dipoles.

    E[1] = 23785.9 MHz     B[1] = 298041 MHz      G_c[0,1] = 450 MHz      F_ab[0,1], W[0,1] ...

Names are those of `rotor.quantum.effects.interactions`. State 0 is that of the top's constants, which have no brackets. Each further state
needs E and all its constants; none is taken from state 0.

Symmetry decides which couplings exist between two states: G_c and F_ab transform like a rotation about c, G_a and F_bc like a rotation
about a, G_b and F_ac like a rotation about b, and W is totally symmetric. The product of the species of two states is a single species.
Two kinds of coupling therefore exist together only if every operation of the group has the same character for both.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

from rotor.checks import Renamed
from rotor.frozen import dataclass
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.units import parse_quantity

Vector = tuple[float, float, float]

_ITEM = re.compile(
    r"(?P<name>[A-Za-z][\w-]*\[[^\[\]]*\])\s*=\s*(?P<number>[-+−]?[\d.]+(?:[eEdD][-+]?\d+)?)\s*(?P<unit>[A-Za-z][\w-]*(?![\w\[]))?"
)
_COUPLINGS = re.compile(r"(?:G_(?P<g>[abc])|F_(?P<f>bc|ac|ab)|W)(?:_\w+)?")
_EVEN = {
    "C1": "abc",
    "Ci": "abc",
    "C2v": "",
    "D2": "",
    "D2h": "",
}  # axes of the rotations that are totally symmetric in each group
_EVEN |= {f"{group}({axis})": axis for group in ("C2", "C2h") for axis in "abc"}
_EVEN |= {f"Cs({plane})": axis for plane, axis in (("bc", "a"), ("ac", "b"), ("ab", "c"))}
GROUPS = tuple(_EVEN)


@dataclass(frozen=True, eq=False)
class StateConstants:
    """Constants of further states in MHz, by name with the state in brackets; names, spin weights and dipoles of the states; source.

    names: of all states from 0 on, such as "0+", "0-". weights: spin weights by state (0 included) that differ from the top's.
    dipoles: (μa, μb, μc) in debye by pairs (v', v), within a state or between two. A state without an entry has the top's dipole; a pair
    without an entry has none. symmetry: the group of the states with its plane or axis, such as "C2v" or "Cs(ab)"; "" if not declared.
    uncertainties: in MHz, by name.

    Raises ValueError for names without a state, for a coupling or dipole of a state without constants, and for two couplings that
    the declared symmetry does not allow together.

    >>> StateConstants({"E[1]": 23786.0, "B[1]": 298041.0, "C[1]": 187000.0}).count
    2
    """

    values: Mapping[str, float]
    names: tuple[str, ...] = ()
    weights: Mapping[int, SpinWeights] = field(default_factory=dict)
    dipoles: Mapping[tuple[int, int], Vector] = field(default_factory=dict)
    source: str = ""
    symmetry: str = ""
    uncertainties: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        pairs = {(max(pair), min(pair)): _vector(vector) for pair, vector in self.dipoles.items()}
        tables: dict[str, Mapping[Any, Any]] = {"values": self.values, "uncertainties": self.uncertainties}
        for name, content in (tables | {"weights": self.weights, "dipoles": pairs}).items():
            object.__setattr__(self, name, MappingProxyType(dict(content)))
        for name, error in self.uncertainties.items():
            if name not in self.values or not error >= 0:
                raise ValueError(
                    f"uncertainty {error:g} of {name}: expected a number of at least 0, for a constant with a value"
                )
        self._refuse_unknown_states()
        first_names: dict[tuple[str, tuple[int, ...]], str] = {}
        for name in self.couplings:
            coupling_kind(name)
            first = first_names.setdefault((name.partition("[")[0].strip(), state_numbers(name)), name)
            if first != name:
                raise ValueError(f"{first} and {name} are one coupling; give it once")
        if self.symmetry and self.symmetry not in GROUPS:
            raise ValueError(f"symmetry {self.symmetry!r} of states: expected one of {', '.join(GROUPS)}")
        if self.symmetry:
            self.refuse_couplings(self.symmetry, _EVEN[self.symmetry])

    def __reduce__(self) -> tuple[Any, ...]:
        content = (dict(self.values), self.names, dict(self.weights), dict(self.dipoles), self.source, self.symmetry)
        return type(self), (*content, dict(self.uncertainties))

    @property
    def count(self) -> int:
        """Number of states, state 0 included."""
        return 1 + max((v for states in self._states.values() for v in states), default=0)

    @property
    def couplings(self) -> tuple[str, ...]:
        """The names of the constants that connect two states."""
        return tuple(name for name, states in self._states.items() if len(states) == 2)

    def for_state(self, v: int) -> dict[str, float]:
        """Constants of a state in MHz, E included, by name without brackets.

        >>> StateConstants({"E[1]": 5.0, "B[1]": 3.0}).for_state(1)
        {'E': 5.0, 'B': 3.0}
        """
        return {name.partition("[")[0]: self.values[name] for name in self._names.get((v,), ())}

    of_state = Renamed("for_state")

    def name_of(self, v: int) -> str:
        """The name of a state, or its number if it has no name."""
        return self.names[v] if self.names else str(v)

    def with_dipole(self, before: Vector | None, after: Vector) -> StateConstants:
        """The states after a change of the top's dipole from `before` to `after`; states with another dipole keep it."""
        changed = {pair: after if vector == before else vector for pair, vector in self.dipoles.items()}
        return replace(self, dipoles=changed)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on couplings that exist together only without symmetry, if no symmetry is declared.

        For two kinds of coupling there is a group that allows both, such as Cs(ab) for G_c and W; for three there are only C1 and Ci.

        >>> values = {"E[1]": 5.0, "B[1]": 3.0, "G_b[0,1]": 1.0, "G_c[0,1]": 1.0, "W[0,1]": 1.0}
        >>> StateConstants(values).notes[0].partition(":")[0]
        'G_b[0,1], G_c[0,1] and W[0,1] join the same two states'
        """
        if self.symmetry:
            return ()
        of_pairs: dict[tuple[int, ...], dict[str, str]] = {}
        for name in self.couplings:
            of_pairs.setdefault(self._states[name], {}).setdefault(coupling_kind(name), name)
        notes = []
        for kinds in of_pairs.values():
            if len(kinds) > 2:
                *others, last = kinds.values()
                notes.append(
                    f"{', '.join(others)} and {last} join the same two states: such couplings exist together in C1 and Ci only; where "
                    "the molecule has a symmetry, declare it for the states, and they are refused"
                )
        return tuple(notes)

    @cached_property
    def _states(self) -> dict[str, tuple[int, ...]]:
        return {name: state_numbers(name) for name in self.values}

    @cached_property
    def _names(self) -> dict[tuple[int, ...], list[str]]:
        """Names of the constants by their state or states."""
        out = dict[tuple[int, ...], list[str]]()
        for name, states in self._states.items():
            out.setdefault(states, []).append(name)
        return out

    def _refuse_unknown_states(self) -> None:
        numbers = {0} | {states[0] for states in self._states.values() if len(states) == 1}
        missing = sorted(set(range(self.count)) - numbers)
        if missing:
            name = next(name for name, states in self._states.items() if max(states) >= missing[0])
            raise ValueError(f"{name}: there is no state {missing[0]}; give E[{missing[0]}] and its constants")
        for pair in [*self.dipoles, *((v, v) for v in self.weights)]:
            if not set(pair) <= numbers:
                raise ValueError(
                    f"weights or dipole of state {max(pair)}: there are {self.count} states, counted from 0"
                )
        if self.names and len(self.names) != self.count:
            raise ValueError(f"names of states {', '.join(self.names)}: expected {self.count}, one for each state")
        if self.names and (not all(self.names) or len(set(self.names)) < self.count):
            raise ValueError(
                f"names of states {', '.join(map(repr, self.names))}: expected each once, none of them empty"
            )

    def refuse_couplings(self, group: str, even: str) -> None:
        """Raise ValueError for two couplings of a pair of states if the group allows only one of them.

        even: those of the axes "abc" about which a rotation is totally symmetric in the group.
        """
        taken: dict[tuple[int, ...], tuple[str, str]] = {}
        for name in self.couplings:
            kind = _coupling_class(coupling_kind(name), even)
            first, other = taken.setdefault(self._states[name], (name, kind))
            if kind != other:
                raise ValueError(
                    f"{first} and {name}: two states of a molecule of {group} have one of them or the other; G about two axes and "
                    "W exist together in C1 and Ci only"
                )

    @classmethod
    def parse(cls, text: str, source: str = "") -> StateConstants:
        """States from a text such as "E[1]=23785.9 B[1]=298041 C[1]=187000 W[0,1]=3 MHz".

        An item may have a unit; a unit at the end applies to all items without one; without any unit, numbers are MHz.
        """
        items = list(_ITEM.finditer(text))
        rest = _ITEM.sub("", text).strip(" ,")
        if not items or rest:
            hint = f"; {rest!r} is none" if rest and items else ""
            raise ValueError(
                f"{text!r}: expected constants of states such as E[1]=23785.9 MHz or G_c[0,1]=450 MHz{hint}"
            )
        shared = items[-1]["unit"] or "MHz"
        values: dict[str, float] = {}
        for item in items:
            name = re.sub(r"\s+", "", item["name"])
            if name in values:
                raise ValueError(f"{text!r}: {name} is given twice; leave one out")
            values[name] = parse_quantity(f"{item['number']} {item['unit'] or shared}", "MHz")
        return cls(values, source=source)


def _vector(vector: Any) -> Vector:
    a, b, c = (float(x) for x in vector)
    return a, b, c


def state_numbers(name: str) -> tuple[int, ...]:
    """Numbers of the states in the brackets of a name, in rising order.

    >>> state_numbers("B[1]"), state_numbers("G_c[1,0]")
    ((1,), (0, 1))
    """
    inside = name.partition("[")[2].rstrip("]").split(",")
    if not name.endswith("]") or len(inside) > 2 or not all(part.strip().isdigit() for part in inside):
        raise ValueError(
            f"{name}: expected a constant with its state or states in square brackets, such as B[1] or G_c[0,1]"
        )
    states = tuple(sorted(int(part) for part in inside))
    if states == (0,):
        raise ValueError(f"{name}: state 0 is the top's own, whose constants have no brackets")
    if len(states) == 2 and states[0] == states[1]:
        raise ValueError(f"{name}: a coupling connects two different states")
    return states


def coupling_kind(name: str) -> str:
    """Axis of the rotation that a coupling transforms like; "" for W.

    >>> [coupling_kind(name) for name in ("G_c[0,1]", "F_bc_J[0,1]", "W_pm2[0,1]")]
    ['c', 'a', '']
    """
    match = _COUPLINGS.fullmatch(name.partition("[")[0])
    if not match:
        raise ValueError(f"{name}: couplings of two states are G_a, G_b, G_c, F_bc, F_ac, F_ab and W")
    return match["g"] or {"bc": "a", "ac": "b", "ab": "c"}.get(match["f"] or "", "")


def _coupling_class(kind: str, even: str) -> str:
    """Class of a kind of coupling: kinds that the group does not distinguish share it. Kinds in `even` are totally symmetric."""
    if kind in even:
        return ""
    return "".join(sorted(set("abc") - set(even))) if len(even) == 1 else kind
