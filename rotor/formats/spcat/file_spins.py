"""The spins of a file's states: the parameter lines that act on them, and what a total spin of equivalent nuclei makes of a line.

With two equivalent spins the part of a line counts that joins levels of one weight; with three some lines have factors of the program.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from rotor.formats.spcat.hamiltonian.codes import NOT_YET
from rotor.formats.spcat.hamiltonian.file_effect import CodedLine
from rotor.formats.spcat.hamiltonian.labels import BY_DIAG
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.formats.spcat.hamiltonian.symmetry import exchange_of, halved_across
from rotor.formats.spcat.text.par import Options
from rotor.quantum.spins.operators import ByElements
from rotor.quantum.spins.terms import Spin


def with_their_spins(lines: list[CodedLine], states: tuple[StateOptions, ...]) -> tuple[list[CodedLine], list[str]]:
    """The lines whose spins SPIND names, and why the others are left out, as SPCAT leaves them out."""
    usable, reasons = list[CodedLine](), list[str]()
    for line in lines:
        why = _missing_spin(line, states)
        if why:
            reasons.append(line.left_out(why))
        else:
            usable.append(line)
    return usable, reasons


def _missing_spin(line: CodedLine, states: tuple[StateOptions, ...]) -> str:
    """Why a spin term can act on none of its states, empty where it can."""
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
    """The number of the last spin that a line is of, 0 where it is of none."""
    return max((*line.operator.spins, 1 if line.operator.ns else 0), default=0)


def of_coupled_spins(
    lines: Iterable[CodedLine], states: Sequence[StateOptions], by_exchange: bool, axes: str
) -> tuple[CodedLine, ...]:
    """The lines of connected states, as they act in functions of the total spin of equivalent nuclei.

    Parameters
    ----------
    lines : iterable of CodedLine
        All lines between these states and within them.
    states : sequence of StateOptions
        The connected states, which have the same spins.
    by_exchange : bool
        Whether levels of one state that differ in the parity of a total spin of two have weights of their own: not in l-doubled ones.
    axes : str
        Those of the basis.

    Returns
    -------
    tuple of CodedLine
        Without those of spins that these states have not.
    """
    first = states[0]
    usable = tuple(line for line in lines if _highest_spin(line) <= len(first.spins))
    if first.equivalent == 2 and by_exchange:
        of = {state.number: state for state in states}
        return tuple(part for line in usable for part in _by_exchange(line, of))
    if first.equivalent == 3:
        return tuple(_of_three(line, len(first.spins), axes) for line in usable)
    return usable


def _by_exchange(line: CodedLine, of: Mapping[int, StateOptions]) -> list[CodedLine]:
    """A line with the part of it that joins levels of one weight; one of all states, which differ in it, is one for each state."""
    if not line.operator.spins:
        return [line]
    if line.states:
        return [line._replace(exchange=exchange_of(line.typ, *(of[v] for v in line.states)))]
    found = {v: exchange_of(line.typ, state, state) for v, state in of.items()}
    if len(set(found.values())) == 1:
        return [line._replace(exchange=next(iter(found.values())))]
    return [line._replace(states=(v, v), exchange=part) for v, part in found.items()]


def _of_three(line: CodedLine, spins: int, axes: str) -> CodedLine:
    """A line with the factors that the program has for three equivalent spins."""
    touches = max(line.operator.spins, default=0) > spins - 3
    if touches and isinstance(line.operator.rotor, ByElements):
        raise ValueError(
            f"parameter {line.code}: a term of higher order or of a series with three equivalent spins {NOT_YET}"
        )
    return line._replace(operator=halved_across(line.operator, axes)) if touches else line


def coupled_spins(state: StateOptions, first: Options) -> tuple[Spin, ...]:
    """The spins of a state in the order of coupling, the last of them to a total where they are equivalent; ValueError for options
    that are not computed with it."""
    others = len(state.spins) - state.equivalent  # which are not coupled to a total
    _check_three(state, others, first)
    return tuple(
        Spin(f"I{place}", twice, total="I_tot" if place > others else "") for place, twice in enumerate(state.spins, 1)
    )


def _check_three(state: StateOptions, others: int, first: Options) -> None:
    """ValueError for options that are not computed with a total spin of three."""
    if state.equivalent < 3:
        return
    if first.diag in BY_DIAG:
        raise ValueError(f"DIAG = {first.diag} with a total spin of three nuclei {NOT_YET}; expected 0 or 3")
    if first.ixx >> (others + 1):
        raise ValueError(f"IXX = {first.ixx}: a total spin of three nuclei that is taken for conserved {NOT_YET}")
