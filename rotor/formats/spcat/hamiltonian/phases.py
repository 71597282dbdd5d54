"""Phases of basis functions, which decide whether odd or even operators (under time reversal θ) are real within one state.

In functions invariant under θ, operators of even order are real (Na², {Nb, Nc}) and those of odd order imaginary (Na, Nb Nc Na). If a file
has an odd operator within one state, the Hamiltonian is real in other functions, those invariant under θ C2g, with C2g a half turn about
one axis g of a, b, c:

    |f⟩ → |f⟩ where C2g = 1,  i|f⟩ where C2g = -1:      O → O where C2g leaves O alone,   O → i C2g O where it changes the sign of O

With g = b, odd operators along a and c (Na, Nc) and even ones along b ({Na, Nc}) are real, all others imaginary. SPFIT and SPCAT choose
the real kind separately for each axis: within states the more frequent kind of the parameters, or by PHASE of XOPT, the sum of 1 (x),
2 (y), 4 (z) for axes with real odd operators (PHASE = 8: none); x, y, z = c, b, a in the prolate basis and a, b, c in the oblate one.
Operators of the other kind are left out within states, and have the factor i between two states.

(H. M. Pickett, documentation of SPFIT and SPCAT, "XOPT"; the rule for the more frequent kind found with the program.)

The rule counts electric moments within states; it applies to all electric moments between two states, independent of TYP. In functions
with a real Hamiltonian the factor i is a sign that changes with the order of the states.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from rotor.formats.spcat.hamiltonian.code_table import Digits
from rotor.formats.spcat.hamiltonian.codes import PLURAL_NOT_YET
from rotor.formats.spcat.text.par import Options
from rotor.quantum.effect import Moment
from rotor.quantum.spins.scheme import BySpecies, Cosines, Vector
from rotor.quantum.wang.basis import SpeciesFactors, half_turn

AXES_OF_PHASE = {False: "cba", True: "abc"}  # axes of PHASE 1, 2, 4; the key is whether the basis is oblate


class Phases(NamedTuple):
    """Phases of a file.

    odd: axes along which odd operators within one state are real. settled: axes for which that is decided. The last field decides whether
    a plain dipole between two states has the factor i along the axes that are not odd, or along the odd ones."""

    odd: frozenset[str]
    settled: frozenset[str]
    between_i: bool = False


def read_phases(options: Options, codes: Iterable[Digits], states: int, doubled: frozenset[int]) -> Phases:
    """The phases by PHASE of XOPT; without it an axis is odd if more parameters along it are odd than even.

    A parameter of all states counts once for each state, even if its value is 0. Parameters of l-doubled states do not count.
    """
    oblate = options.oblate
    if options.phase:
        odd = frozenset(axis for bit, axis in enumerate(AXES_OF_PHASE[oblate]) if options.phase >> bit & 1)
        return Phases(odd, frozenset("abc"))
    more: dict[str, int] = {}
    for d in codes:
        concerned = range(states) if d.states is None else [d.v1] * (d.v1 < states)
        count = len(set(concerned) - doubled)
        kind = d.symmetry(oblate)
        if d.v1 == d.v2 and count and kind.axis and not d.is_constant:
            more[kind.axis] = more.get(kind.axis, 0) + (count if kind.odd else -count)
    return Phases(frozenset(axis for axis, count in more.items() if count > 0), frozenset(more))


def with_dipoles(phases: Phases, dipoles: Iterable[tuple[int, bool]], oblate: bool, as_spcat: bool) -> Phases:
    """Phases that include dipoles between states, from the dipoles within states.

    phases: phases of the parameters. dipoles: for each dipole within a state, the axis (1 to 3) and whether it is a commutator with N².
    oblate: whether z is the c axis. as_spcat: whether phases along undecided axes make most dipoles real, as SPCAT (but not SPFIT)
    chooses them.
    """
    axes, within_states = AXES_OF_PHASE[oblate], list(dipoles)
    least, best = len(within_states), (phases.odd, False)
    for number in range(8 if as_spcat else 1):
        flipped = frozenset(axis for bit, axis in enumerate(axes) if number >> bit & 1)
        odd = phases.odd ^ flipped
        real = sum(("abc"[axis - 1] in odd) != commutator for axis, commutator in within_states)
        left = min(real, len(within_states) - real)  # an i in front of all moments exchanges real and imaginary ones
        if not flipped & phases.settled and (left < least or not number):
            least, best = left, (odd, real < len(within_states) - real)
    return Phases(best[0], phases.settled, not best[1])


def turned_axis(used: Iterable[str], odd: frozenset[str]) -> str:
    """The axis g whose half turn accompanies θ ("" for θ alone), for operators along the used axes, of which `odd` are odd.

    Raises ValueError if no half turn fits: the Hamiltonian is then complex for any phases.

    >>> turned_axis("a", frozenset("a")), turned_axis("ac", frozenset("a")), turned_axis("a", frozenset("ac"))
    ('c', 'c', 'b')
    """
    axes = sorted(set(used) - {""})
    # the axis that fits unused axes too is preferred
    for g in sorted(("", "c", "b", "a"), key=lambda g: odd != turned_odd_axes(g)):
        if all((axis in odd) == (g not in ("", axis)) for axis in axes):
            return g
    along = ", ".join(f"{axis} {'odd' if axis in odd else 'even'}" for axis in axes)
    raise ValueError(
        f"operators along {along} under time reversal: no phases of the basis make all of them real. That is read but not computed; "
        "leave out those along one axis"
    )


def turned_odd_axes(g: str) -> frozenset[str]:
    """The axes along which odd operators are real if a half turn about g accompanies time reversal.

    >>> sorted(turned_odd_axes("b")), sorted(turned_odd_axes(""))
    (['a', 'c'], [])
    """
    return frozenset("abc") - {g} if g else frozenset()


def half_turned(axis: str, odd: bool) -> SpeciesFactors:
    """What represents an operator O that changes sign under C2g, in functions invariant under θ C2g, multiplied with O.

    For an odd O, passed as i O, it is i C2g O; for an even one, with a factor i between two states, i C2g i O = -C2g O.
    """
    return half_turn(axis, 1.0 if odd else -1.0)


def by_order(
    moments: dict[tuple[int, int], Vector], beside: tuple[Moment, ...], reverse: Sequence[bool]
) -> tuple[dict[tuple[int, int], Vector], tuple[Moment, ...]]:
    """The moments with a factor i for electric ones between two states, and -i for reversed ones among `beside`."""
    if not beside:
        back = {(w, v): (-a, -b, -c) for (v, w), (a, b, c) in moments.items() if v != w}
        return moments | back, ()
    within_states = {states: along for states, along in moments.items() if states[0] == states[1]}
    between = [Moment(1.0, states, Cosines(along)) for states, along in moments.items() if states[0] != states[1]]
    signed = [(moment, False) for moment in between] + list(zip(beside, reverse, strict=True))
    return within_states, tuple(
        moment
        if not moment.electric or moment.states[0] == moment.states[1]
        else _in_phases(moment._replace(value_debye=-moment.value_debye) if back else moment, True)
        for moment, back in signed
    )


def _in_phases(moment: Moment, by_order: bool, turned: str = "") -> Moment:
    """An electric moment with the factor i, -i in the other order of its states, where `by_order`, and with a half turn C2g.

    turned: the axis g. With C2g a moment is i times what it is in functions of other phases; together i² = -1.
    """
    rotor = BySpecies(moment.rotor, half_turn(turned), False) if turned else moment.rotor  # type: ignore[arg-type]
    back = by_order and (moment.states[0] < moment.states[1]) == bool(turned)
    value = -moment.value_debye if back else moment.value_debye
    return moment._replace(value_debye=value, rotor=rotor, imaginary=bool(turned) != by_order)


def turned_moments(
    moments: dict[tuple[int, int], Vector], beside: Sequence[tuple[Moment, str]], turned: str, phases: Phases
) -> tuple[dict[tuple[int, int], Vector], tuple[Moment, ...]]:
    """The moments in functions that time reversal with half a turn about an axis leaves as they are: those along it, and the others
    apart, each component by itself.

    moments: plain dipoles by pairs of states. beside: other moments with their species under half turns: "a", "b", "c", "" if none changes
    their sign. turned: the axis whose half turn accompanies time reversal; "" if there is none. phases: phases that decide which components
    have the factor i.
    Returns: unchanged plain dipoles; all other moments.
    """
    if any(species and not moment.electric for moment, species in beside):
        raise ValueError(
            "magnetic moments that a half turn changes (SYM 0 with TYP 8 or 12) with operators that are odd under time reversal within one "
            f"state, or PHASE, {PLURAL_NOT_YET}; leave one of them out"
        )
    plain, others = dict[tuple[int, int], Vector](), list[Moment]()
    for states, along in moments.items():
        for axis, value in zip("abc", along, strict=True):
            alone = (value * (axis == "a"), value * (axis == "b"), value * (axis == "c"))
            moment = _turned(Moment(1.0, states, Cosines(alone)), axis, turned, phases)
            if value and moment.rotor == Cosines(alone) and not moment.imaginary:
                plain[states] = tuple(np.add(alone, plain.get(states, (0.0, 0.0, 0.0))).tolist())
            elif value:
                others.append(moment)
    magnetic = [moment for moment, _ in beside if not moment.electric]
    return plain, (
        *magnetic,
        *others,
        *(_turned(moment, species, turned, phases) for moment, species in beside if moment.electric),
    )


def _turned(moment: Moment, species: str, turned: str, phases: Phases) -> Moment:
    """A moment of a species in functions that time reversal with a half turn leaves as they are."""
    between = moment.states[0] != moment.states[1]
    has_i = between and (species in phases.odd) != phases.between_i
    return _in_phases(moment, has_i, "" if species in ("", turned) else turned)
