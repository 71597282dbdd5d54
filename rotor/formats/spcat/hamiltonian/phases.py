"""Phases of basis functions: which operators along a, b, c a file has within one state, odd or even under time reversal θ.

In functions that θ leaves as they are the operators of even order are real (Na², {Nb, Nc}) and those of odd order imaginary (Na, Nb Nc Na).
Where a file has an odd operator within one state the Hamiltonian is real in other functions, those that θ C2g leaves as they are,
C2g being half a turn about one axis g of a, b, c:

    |f⟩ → |f⟩ where C2g = 1,  i|f⟩ where C2g = -1:      O → O where C2g leaves O alone,   O → i C2g O where it changes the sign of O

so that with g = b odd operators along a and c (Na, Nc) and even ones along b ({Na, Nc}) are real, and the others are imaginary. SPFIT
and SPCAT choose for each axis apart which of the two are real: within states by the more frequent kind of a file's parameters, or by
PHASE of XOPT = 1 along x + 2 along y + 4 along z where odd ones are (PHASE = 8: none is), x, y, z = c, b, a in the prolate basis and
a, b, c in the oblate one. Those of the other kind are left out. Between two states those of the other kind have the factor i.

(H. M. Pickett, documentation of SPFIT and SPCAT, "XOPT"; the rule for the more frequent kind found with the program.)
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from rotor.formats.spcat.hamiltonian.code_types import axis_of, is_odd_type
from rotor.formats.spcat.hamiltonian.codes import Digits, split_code, state_digits
from rotor.formats.spcat.hamiltonian.series import harmonic, is_constant, symmetry_type
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.states import OperatorOfJ
from rotor.quantum.wang.j_operators import JOperator, half_turn

AXES_OF_PHASE = {False: "cba", True: "abc"}  # by whether the basis is oblate: of PHASE 1, 2, 4


class Kind(NamedTuple):
    """Of an operator: the axis along which it is, "" of one in orthorhombic symmetry, and whether θ changes its sign."""

    axis: str
    odd: bool


def kind_of(d: Digits, oblate: bool) -> Kind:
    """The kind of a code.

    >>> from rotor.formats.spcat.hamiltonian.codes import split_code
    >>> [kind_of(split_code(code), False) for code in (200_000, 11_000_400_000)]  # a sine times Nb is even and along c
    [Kind(axis='a', odd=True), Kind(axis='c', odd=False)]
    """
    sine = bool(d.ff) and harmonic(d.ff)[0]
    commutator = d.i1 == 0 and d.i2 > 0
    return Kind(axis_of(symmetry_type(d, oblate)), (is_odd_type(d.typ) != sine) != commutator)


class Phases(NamedTuple):
    """Of a file: the axes along which operators within one state are odd, those of which that is settled, and whether a plain dipole
    between two states has the factor i along an axis that is not among the odd ones, and none along those, or the reverse."""

    odd: frozenset[str]
    settled: frozenset[str]
    between_i: bool = False

    def has_i(self, axis: int) -> bool:
        """Whether a dipole between states along a (1), b (2) or c (3) has the factor i."""
        return ("abc"[axis - 1] in self.odd) != self.between_i


def phases_of(file: ParameterFile, states: int, doubled: frozenset[int]) -> Phases:
    """By PHASE of XOPT, else odd are those axes along which more parameters are odd than even.

    A parameter of all states counts once for each, one whose value is 0 too; those of l-doubled states have no part in it.
    """
    first = file.options[0]
    oblate = first.nvib < 0
    if first.phase:
        odd = frozenset(axis for bit, axis in enumerate(AXES_OF_PHASE[oblate]) if first.phase >> bit & 1)
        return Phases(odd, frozenset("abc"))
    more: dict[str, int] = {}
    wild = 10 ** state_digits(states) - 1
    for parameter in file.parameters:
        d = split_code(parameter.code, states)
        own = len(set(range(states)) - doubled) if d.v1 == wild else int(d.v1 < states and d.v1 not in doubled)
        kind = kind_of(d, oblate)
        if d.v1 == d.v2 and own and kind.axis and not is_constant(d):
            more[kind.axis] = more.get(kind.axis, 0) + (own if kind.odd else -own)
    return Phases(frozenset(axis for axis, count in more.items() if count > 0), frozenset(more))


def with_dipoles(phases: Phases, dipoles: Iterable[tuple[int, bool]], oblate: bool, as_spcat: bool) -> Phases:
    """The phases of dipoles between states too, by those within states.

    Parameters
    ----------
    phases : Phases
        Of the parameters.
    dipoles : iterable of (int, bool)
        Of the dipoles within states: their axis, 1 to 3, and whether they are commutators with N².
    oblate : bool
        Whether z is the c axis.
    as_spcat : bool
        Whether phases along axes that are not settled are those that leave most dipoles real, as the program has it in SPCAT alone.

    Returns
    -------
    Phases
        With `between_i`.
    """
    axes, given = AXES_OF_PHASE[oblate], list(dipoles)
    least, found = len(given), (phases.odd, False)
    for number in range(8 if as_spcat else 1):
        flipped = frozenset(axis for bit, axis in enumerate(axes) if number >> bit & 1)
        odd = phases.odd ^ flipped
        real = sum(("abc"[axis - 1] in odd) != commutator for axis, commutator in given)
        left = min(real, len(given) - real)
        if not flipped & phases.settled and (left < least or not number):
            least, found = left, (odd, real < len(given) - real)
    return Phases(found[0], phases.settled, not found[1])


def turned_axis(used: Iterable[str], odd: frozenset[str]) -> str:
    """The axis g whose half turn goes with θ, "" where θ alone does, for operators along the axes used of which some are odd.

    Raises ValueError where no half turn fits: the Hamiltonian is complex in every choice of phases.

    >>> turned_axis("a", frozenset("a")), turned_axis("ac", frozenset("a")), turned_axis("a", frozenset("ac"))
    ('c', 'c', 'b')
    """
    axes = sorted(set(used) - {""})
    for g in sorted(
        ("", "c", "b", "a"), key=lambda g: odd != odd_of_turned(g)
    ):  # first that which fits the axes not used too
        if all((axis in odd) == (g not in ("", axis)) for axis in axes):
            return g
    along = ", ".join(f"{axis} {'odd' if axis in odd else 'even'}" for axis in axes)
    raise ValueError(
        f"operators along {along} under time reversal: no phases of the basis make all of them real. That is read but not computed; "
        "leave out those along one axis"
    )


def odd_of_turned(g: str) -> frozenset[str]:
    """The axes along which odd operators are real where time reversal goes with half a turn about g.

    >>> sorted(odd_of_turned("b")), sorted(odd_of_turned(""))
    (['a', 'c'], [])
    """
    return frozenset("abc") - {g} if g else frozenset()


def half_turned(of: OperatorOfJ, axis: str, odd: bool) -> OperatorOfJ:
    """What stands for an operator O that C2g turns around, in functions that θ C2g leaves as they are.

    Of an odd O, given as i O, it is i C2g O; of an even one, which has the factor i between two states, i C2g i O = -C2g O.
    """

    def operator(j: int, representation: str) -> JOperator:
        return (1.0 if odd else -1.0) * (half_turn(j, representation, axis) @ of(j, representation))

    return operator
