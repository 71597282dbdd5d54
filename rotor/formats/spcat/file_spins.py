"""Spins of a file's states: parameter lines that act on them, and their form with a total spin of equivalent nuclei.

With two equivalent spins only the part of a line acts that connects levels of equal weight; with three, lines may have a factor of SPCAT.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from rotor.formats.spcat.hamiltonian.codes import NOT_YET
from rotor.formats.spcat.hamiltonian.file_effect import CodedLine
from rotor.formats.spcat.hamiltonian.labels import BY_DIAG
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.formats.spcat.hamiltonian.symmetry import exchange_part, halved_across
from rotor.formats.spcat.text.par import Options
from rotor.quantum.spins.operators import ByElements
from rotor.quantum.spins.scheme import Spin


def with_their_spins(lines: list[CodedLine], states: tuple[StateOptions, ...]) -> tuple[list[CodedLine], list[str]]:
    """The lines whose spins occur in SPIND, and why others are left out, as in SPCAT."""
    usable, reasons = list[CodedLine](), list[str]()
    for line in lines:
        why = _missing_spin(line, states)
        if why:
            reasons.append(line.left_out(why))
        else:
            usable.append(line)
    return usable, reasons


def _missing_spin(line: CodedLine, states: tuple[StateOptions, ...]) -> str:
    """The reason why a spin term acts on none of its states; empty if it acts."""
    spins = line.operator.spins
    needed = _highest_spin(line)
    concerned = states if line.states is None else [states[v] for v in line.states]
    count = max if line.states is None else min
    have = count(len(state.spins) for state in concerned)
    if needed > have:
        return f"spin {needed} is not among the {have} that SPIND names"
    if len(spins) == 2 and spins[0] == spins[1]:
        largest = count(state.spins[spins[0] - 1] if len(state.spins) >= spins[0] else 0 for state in concerned)
        return (
            "" if largest > 1 else f"spin {spins[0]} is {largest}/2, and a spin of 1/2 or less has no quadrupole moment"
        )
    return ""


def _highest_spin(line: CodedLine) -> int:
    """The highest number of the spins of a line; 0 without spins."""
    return max((*line.operator.spins, 1 if line.operator.ns else 0), default=0)


def coupled_spin_lines(
    lines: Iterable[CodedLine], states: Sequence[StateOptions], by_exchange: bool, axes: str
) -> tuple[CodedLine, ...]:
    """The lines of connected states in functions of the total spin of equivalent nuclei.

    lines: all lines between these states and within them. states: the connected states, which have the same spins. by_exchange: whether
    levels of a state with even and odd total spin of two nuclei have different weights; not for l-doubled states. axes: axes x, y, z of
    the basis.
    Returns: lines without those of spins that these states do not have.
    """
    first = states[0]
    usable = tuple(line for line in lines if _highest_spin(line) <= len(first.spins))
    if first.equivalent == 2 and by_exchange:
        state_of = {state.number: state for state in states}
        return tuple(part for line in usable for part in _by_exchange(line, state_of))
    if first.equivalent == 3:
        return tuple(_with_threefold_factors(line, len(first.spins), axes) for line in usable)
    return usable


def _by_exchange(line: CodedLine, state_of: Mapping[int, StateOptions]) -> list[CodedLine]:
    """A line restricted to the part that connects levels of equal weight, with one line for each state if this part differs."""
    if not line.operator.spins:
        return [line]
    if line.states:
        return [line._replace(exchange=exchange_part(line.symmetry.axis, *(state_of[v] for v in line.states)))]
    part_by_state = {v: exchange_part(line.symmetry.axis, state, state) for v, state in state_of.items()}
    if len(set(part_by_state.values())) == 1:
        return [line._replace(exchange=next(iter(part_by_state.values())))]
    return [line._replace(states=(v, v), exchange=part) for v, part in part_by_state.items()]


def _with_threefold_factors(line: CodedLine, spins: int, axes: str) -> CodedLine:
    """A line with SPCAT's factors for three equivalent spins."""
    # only terms that touch the three equivalent spins change
    touches = max(line.operator.spins, default=0) > spins - 3
    if touches and isinstance(line.operator.rotor, ByElements):
        raise ValueError(
            f"parameter {line.code}: a term of higher order or of a series with three equivalent spins {NOT_YET}"
        )
    return line._replace(operator=halved_across(line.operator, axes)) if touches else line


def coupled_spins(state: StateOptions, first: Options) -> tuple[Spin, ...]:
    """The spins of a state in the order of coupling, equivalent last ones with a total; ValueError for unsupported options."""
    others = len(state.spins) - state.equivalent  # spins without a total
    _check_three(state, others, first)
    return tuple(
        Spin(f"I{place}", twice, total="I_tot" if place > others else "") for place, twice in enumerate(state.spins, 1)
    )


def _check_three(state: StateOptions, others: int, first: Options) -> None:
    """Raise ValueError for options that are not supported with a total spin of three."""
    if state.equivalent < 3:
        return
    if first.diag in BY_DIAG:
        raise ValueError(f"DIAG = {first.diag} with a total spin of three nuclei {NOT_YET}; expected 0 or 3")
    if first.ixx >> (others + 1):
        raise ValueError(f"IXX = {first.ixx}: a total spin of three nuclei that is taken for conserved {NOT_YET}")
