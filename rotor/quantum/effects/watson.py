"""The semi-rigid Hamiltonian: rigid and centrifugal terms, A and S reductions, all representations.

Each term of an effective Hamiltonian in one vibrational state is c · ½[Jz^2q, J₊^2n + J₋^2n]₊ · J^2p (n = 0:
c · J^2p Jz^2q), so that a Hamiltonian is a table {(p, q, n): c in MHz}. `rotor.quantum.wang.wang_matrix` has the matrix elements,
`rotor.tops.constants.operators` the terms of all names.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rotor.quantum.effect import QuantumEffect
from rotor.tops.constants.operators import Operators, Powers, added, axis_order, distortion_terms, spelled_powers

if TYPE_CHECKING:
    from rotor.tops.constants.constants import Constants
    from rotor.tops.top import Top


def operators_by_name(constants: Constants) -> dict[str, Operators]:
    """∂H/∂c of the constants c by name; H is their sum times the constants.

    >>> from rotor.tops.constants.constants import Constants
    >>> operators_by_name(Constants(A=9.0, B=3.0, C=2.0))["C"]
    {(1, 0, 0): 0.5, (0, 1, 0): -0.5, (0, 0, 1): -0.25}
    """
    return {name: operators_of_name(constants, name) for name in constants.values}


def operators_of_name(constants: Constants, name: str) -> Operators:
    """∂H/∂c of a constant by its name, whether or not it has a value in the set.

    >>> from rotor.tops.constants.constants import Constants
    >>> operators_of_name(Constants(A=9.0, B=3.0, C=2.0, reduction="A"), "DeltaJ")
    {(2, 0, 0): -1.0}
    """
    table = _rigid_terms(constants) | distortion_terms(constants.kind, constants.reduction)
    return table[name] if name in table else {_powers(name): 1.0}


def order_of_constant(name: str, constants: Constants) -> int:
    """Power of J in the operator of a constant: 2 for A, 4 for DeltaJ."""
    return max(2 * sum(powers) for powers in operators_of_name(constants, name))


def to_order(top: Top, order: int) -> Top:
    """A top without the constants whose operators have a higher power of J."""
    constants = top.constants
    above = {
        name: None for name in constants.values if name not in "ABC" and order_of_constant(name, constants) > order
    }
    return top.with_constants(constants.replace(**above))


def _powers(name: str) -> Powers:
    """Powers (p, q, n) of a name that spells its operator."""
    powers = spelled_powers(name)
    if powers is None:
        raise ValueError(f"{name} has no operator here")
    return powers


def _rigid_terms(constants: Constants) -> dict[str, Operators]:
    """Operators of A, B, C in ½(Bx+By) J² + [Bz - ½(Bx+By)] Jz² + ¼(Bx-By)(J₊² + J₋²), axes by the representation.

    A linear or spherical top has only the first term; z is a in a prolate and c in an oblate symmetric top. Of two equal constants only B
    counts.
    """
    if constants.kind in ("linear", "spherical"):
        return {"A": {}, "C": {}, "B": {(1, 0, 0): 1.0}}
    if constants.kind in ("prolate", "oblate"):
        along, equal = ("A", "C") if constants.kind == "prolate" else ("C", "A")
        return {along: {(0, 1, 0): 1.0}, "B": {(1, 0, 0): 1.0, (0, 1, 0): -1.0}, equal: {}}
    x, y, z = (axis.upper() for axis in axis_order(str(constants.representation)))
    return {
        z: {(0, 1, 0): 1.0},
        x: {(1, 0, 0): 0.5, (0, 1, 0): -0.5, (0, 0, 1): 0.25},
        y: {(1, 0, 0): 0.5, (0, 1, 0): -0.5, (0, 0, 1): -0.25},
    }


def _added(constants: Constants, names: Iterable[str]) -> Operators:
    """Sum of the operators of these constants."""
    return added((operators_of_name(constants, name), constants.values[name]) for name in names)


def rigid_operators(constants: Constants) -> Operators:
    """The terms of A, B, C."""
    return _added(constants, [name for name in constants.values if name in "ABC"])


def centrifugal_operators(constants: Constants) -> Operators:
    """The distortion terms in the reduction and representation of the constants, spelled operators included."""
    return _added(constants, [name for name in constants.values if name not in "ABC"])


class Rigid(QuantumEffect):
    """The rigid rotor: A, B, C."""

    name = "rigid rotor"

    def parameters(self, top: Top) -> dict[str, float]:
        """A, B, C in MHz, as far as the set has them."""
        return {name: value for name, value in top.constants.values.items() if name in "ABC"}

    def operators(self, top: Top) -> dict[str, Operators]:
        """∂H/∂A, ∂H/∂B, ∂H/∂C."""
        return {name: terms for name, terms in operators_by_name(top.constants).items() if name in "ABC"}

    def size_mhz(self, top: Top, j: int) -> float:
        """The bound A J(J+1) of the rigid energy."""
        return max(self.parameters(top).values()) * j * (j + 1)


class Centrifugal(QuantumEffect):
    """Centrifugal distortion of all orders of the constants."""

    name = "centrifugal distortion"

    def parameters(self, top: Top) -> dict[str, float]:
        """The distortion constants in MHz."""
        return {name: value for name, value in top.constants.values.items() if name not in "ABC"}

    def operators(self, top: Top) -> dict[str, Operators]:
        """∂H/∂c of the distortion constants."""
        return {name: terms for name, terms in operators_by_name(top.constants).items() if name not in "ABC"}

    def size_mhz(self, top: Top, j: int) -> float:
        """The sum of the absolute values of all terms at K = J."""
        x = j * (j + 1.0)
        terms = centrifugal_operators(top.constants).items()
        return float(sum(abs(c) * x**p * float(j) ** (2 * q) * (2 * x**n if n else 1.0) for (p, q, n), c in terms))


SEMI_RIGID: tuple[QuantumEffect, ...] = (Rigid(), Centrifugal())
