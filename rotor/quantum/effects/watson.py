"""The semi-rigid Hamiltonian: rigid and centrifugal terms, A and S reductions, all representations.

Each term of an effective Hamiltonian in one vibrational state is c · ½[Jz^2q, J₊^2n + J₋^2n]₊ · J^2p (n = 0:
c · J^2p Jz^2q), so that a Hamiltonian is a table {(p, q, n): c in MHz}. `rotor.quantum.wang.wang_matrix` has the matrix elements,
`rotor.tops.constants.operators` the terms of all names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rotor.quantum.effect import QuantumEffect
from rotor.tops.constants.operators import Operators, added, axis_order, distortion_terms, spelled_powers

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
    if name in table:
        return table[name]
    powers = spelled_powers(name)
    if powers is None:
        raise ValueError(f"{name} has no operator here")
    return {powers: 1.0}


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


def _added(constants: Constants, rigid: bool) -> Operators:
    """Sum of the operators of A, B, C, or of those of distortion."""
    values = constants.values.items()
    return added((operators_of_name(constants, name), value) for name, value in values if (name in "ABC") == rigid)


def rigid_operators(constants: Constants) -> Operators:
    """The terms of A, B, C."""
    return _added(constants, True)


def centrifugal_operators(constants: Constants) -> Operators:
    """The distortion terms in the reduction and representation of the constants, spelled operators included."""
    return _added(constants, False)


class _SemiRigid(QuantumEffect):
    """Constants of the top: A, B, C if `rigid`, else those of distortion."""

    rigid: ClassVar[bool]

    def parameters(self, top: Top) -> dict[str, float]:
        """The constants in MHz, as far as the set has them."""
        return {name: value for name, value in top.constants.values.items() if (name in "ABC") == self.rigid}

    def operators(self, top: Top) -> dict[str, Operators]:
        """∂H/∂c of the constants."""
        return {name: operators_of_name(top.constants, name) for name in self.parameters(top)}


class Rigid(_SemiRigid):
    """The rigid rotor: A, B, C."""

    name = "rigid rotor"
    rigid = True

    def size_mhz(self, top: Top, j: int) -> float:
        """The bound A J(J+1) of the rigid energy."""
        return max(self.parameters(top).values()) * j * (j + 1)


class Centrifugal(_SemiRigid):
    """Centrifugal distortion of all orders of the constants."""

    name = "centrifugal distortion"
    rigid = False

    def size_mhz(self, top: Top, j: int) -> float:
        """The sum of the absolute values of all terms at K = J."""
        x = j * (j + 1.0)
        terms = centrifugal_operators(top.constants).items()
        return float(sum(abs(c) * x**p * float(j) ** (2 * q) * (2 * x**n if n else 1.0) for (p, q, n), c in terms))


SEMI_RIGID: tuple[QuantumEffect, ...] = (Rigid(), Centrifugal())
