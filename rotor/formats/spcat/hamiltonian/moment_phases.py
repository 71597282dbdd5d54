"""Moments of a file in the phases of its functions: moments with a factor i between two states, and moments times C2g.

The rule of `phases` counts electric moments within states; it applies to all electric moments between two states, independent of TYP. In
functions with a real Hamiltonian the factor i is a sign that changes with the order of the states.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.formats.spcat.hamiltonian.codes import PLURAL_NOT_YET
from rotor.formats.spcat.hamiltonian.phases import Phases
from rotor.quantum.moments import Moment, Vector


def by_order(
    moments: dict[tuple[int, int], Vector], beside: tuple[Moment, ...], reverse: Sequence[bool]
) -> tuple[dict[tuple[int, int], Vector], tuple[Moment, ...]]:
    """The moments with a factor i for electric ones between two states, and -i for reversed ones among `beside`."""
    if not beside:
        back = {(w, v): (-a, -b, -c) for (v, w), (a, b, c) in moments.items() if v != w}
        return moments | back, ()
    within_states = {states: along for states, along in moments.items() if states[0] == states[1]}
    between = [Moment(1.0, states, along) for states, along in moments.items() if states[0] != states[1]]
    signed = [(moment, False) for moment in between] + list(zip(beside, reverse, strict=True))
    return within_states, tuple(_with_i(moment, back) for moment, back in signed)


def _with_i(moment: Moment, reverse: bool) -> Moment:
    """A moment with the factor i, or -i if reversed."""
    if not moment.electric or moment.states[0] == moment.states[1]:
        return moment
    return moment._replace(value_debye=-moment.value_debye if reverse else moment.value_debye, by_order=True)


def turned_moments(
    moments: dict[tuple[int, int], Vector], beside: tuple[Moment, ...], turned: str, phases: Phases
) -> tuple[dict[tuple[int, int], Vector], tuple[Moment, ...]]:
    """The moments in functions that time reversal with half a turn about an axis leaves as they are: those along it, and the others
    apart, each component by itself.

    moments: plain dipoles by pairs of states. beside: other moments. turned: the axis whose half turn accompanies time reversal; "" if
    there is none. phases: phases that decide which components have the factor i.
    Returns: unchanged plain dipoles; all other moments.
    """
    if any(moment.written or moment.with_i or (moment.along_abc and moment.spin) for moment in beside):
        raise ValueError(
            "moments of second and third order, of a sine and of a spin with operators that are odd under time reversal within one "
            f"state, or PHASE, {PLURAL_NOT_YET}; leave one of them out"
        )
    all_moments = [*(Moment(1.0, states, along) for states, along in moments.items()), *beside]
    plain, others = dict[tuple[int, int], Vector](), list[Moment]()
    for moment in all_moments:
        if moment.along_abc is None:
            others.append(moment)
            continue
        for axis, value in enumerate(moment.along_abc, 1):
            along = (value * (axis == 1), value * (axis == 2), value * (axis == 3))
            ordered = moment.states[0] != moment.states[1] and phases.has_i(axis)
            across = "" if "abc"[axis - 1] == turned else turned
            if value and not across and not ordered and moment in all_moments[: len(moments)]:
                plain[moment.states] = tuple(np.add(along, plain.get(moment.states, (0.0, 0.0, 0.0))).tolist())
            elif value:
                others.append(moment._replace(along_abc=along, turned=across, by_order=ordered))
    return plain, tuple(others)
