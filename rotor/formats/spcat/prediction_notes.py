"""Notes of a prediction: silent actions of SPCAT with the same files, effects of KNMIN and KNMAX, and errors of SPCAT.

Each number that `as_spcat` changes has a note.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from rotor.formats.spcat.file_model import Group, connected_groups, moments_within_states
from rotor.formats.spcat.hamiltonian.coded_file import CodedFile, coded_file
from rotor.formats.spcat.hamiltonian.dipole_codes import (
    EVEN_ORDER,
    deviates_in_spcat,
    split_dipole,
    split_dipoles,
)
from rotor.formats.spcat.hamiltonian.labels import UNDIAGONALIZED_NOTE
from rotor.formats.spcat.hamiltonian.phases import with_dipoles
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.formats.spcat.solved_groups import SolvedGroup, highest_n
from rotor.formats.spcat.text.int_file import IntensityFile, Request
from rotor.formats.spcat.text.par import Options, ParameterFile, npar_notes
from rotor.quantum.levels import Levels

SAME_MHZ = 1e-6  # round-off of energies
UNSTATED = Options().ewt
SHOWN = 3  # notes of one kind; up to 999 states of a file may have the same


def prediction_notes(
    parameters: ParameterFile,
    intensities: IntensityFile,
    as_spcat: bool,
    full_basis: bool,
    solved: list[SolvedGroup],
) -> Iterator[str]:
    """The notes on the files and on their groups that have levels."""
    coded, groups = coded_file(parameters), [each.group for each in solved]
    highest = highest_n(parameters, intensities.request)
    yield from npar_notes(parameters)
    yield from _abridged(list(coded.left_out), "parameters are left out likewise")
    yield from _abridged(_empty_states(coded), "states have no parameters of their own either")
    yield from _unstated_weights(coded)
    yield from _moment_notes(coded, intensities, as_spcat)
    if any(group.diag < 0 and not group.is_diagonal for group in groups):
        yield UNDIAGONALIZED_NOTE
    if any(state.is_cut for group in groups for state in group.states):
        whole = connected_groups(parameters, intensities, as_spcat=as_spcat, full_basis=True, highest_n=highest)
        yield from _basis_notes(solved, whole, intensities.request)
    yield from _falling_diagonal_notes(groups, parameters.options[0].diag, highest)
    if full_basis:
        yield from _full_basis_notes(coded.states, highest)
    yield from _request_notes(intensities.request, as_spcat)


def _abridged(notes: list[str], further: str) -> list[str]:
    """Notes of one kind: all of them, or the first few and the number of the others."""
    return notes if len(notes) <= SHOWN + 1 else [*notes[:SHOWN], f"{len(notes) - SHOWN} more {further}"]


def _empty_states(coded: CodedFile) -> list[str]:
    """A note for each state beyond the first without parameters of its own, whose levels are those of another state."""
    named = {v for digits in coded.digits for v in digits.states or ()} | coded.members
    shared = any(digits.states is None for digits in coded.digits)
    others = "alone those of all states" if shared else "and no parameter is of all states"
    return [
        f"state {v} has no parameter of its own, not even an energy (V1 = V2 = {v}), {others}; NVIB says that it exists"
        for v in range(1, len(coded.states))
        if v not in named
    ]


def _unstated_weights(coded: CodedFile) -> list[str]:
    """A note on E levels with the weight that SPCAT takes where an option line states none."""
    unstated = [state for state in coded.states if state.has_e_levels and state.e_weight == UNSTATED]
    return [
        f"levels of E species weigh {UNSTATED}, which SPCAT takes where an option line has no EWT; the others weigh "
        f"{max(state.plus, state.minus)}; state EWT if it is not {UNSTATED}"
        for state in unstated[:1]
    ]


def _request_notes(request: Request, as_spcat: bool) -> list[str]:
    """Notes on QROT below 1, which SPCAT replaces by 1, and on a .str file (tens digit of FLAGS), which is not written here."""
    notes = []
    if 0 < request.qrot < 1:
        notes.append(f"QROT = {request.qrot:g} is below 1: {_choice('SPCAT takes 1', as_spcat)}")
    if request.flags // 10 % 10:
        notes.append(
            f"FLAGS = {request.flags} asks for a .str file, which is not written here: the signs of its transition dipoles follow from the "
            "phases of SPCAT's diagonalization; strengths of lines are in --csv and --json"
        )
    return notes


def _choice(program: str, as_spcat: bool) -> str:
    """Text on what SPCAT does, and whether it is reproduced here."""
    return (
        f"{program}, and so do these numbers"
        if as_spcat
        else f"{program}, these numbers do not; --as-spcat has SPCAT's"
    )


def _moment_notes(coded: CodedFile, intensities: IntensityFile, as_spcat: bool) -> list[str]:
    """Notes on dipole lines for which SPCAT deviates from its documentation, and on their phases."""
    count, oblate = len(coded.states), coded.oblate
    missing = [
        f"dipole {dipole.code} is left out, as SPCAT does: state {v} does not exist, NVIB = {count} counts from 0"
        for dipole in intensities.dipoles
        if (v := split_dipole(dipole.code, count).states[1]) >= count
    ]
    notes = _abridged(missing, "dipoles are left out likewise")
    dipoles, others = split_dipoles(intensities.dipoles, count)
    wrong = [str(dipole.code) for dipole, code in others if deviates_in_spcat(code, coded.axes)]
    if wrong:
        lines = f"dipole{'s' if len(wrong) > 1 else ''} {', '.join(dict.fromkeys(wrong))}"
        program = "SPCAT computes another moment than its documentation says (docs/spcat_codes.md)"
        notes.append(f"{lines}: {_choice(program, as_spcat)}")

    within = moments_within_states(dipoles, others, coded)
    phases = with_dipoles(coded.phases, within, oblate, False)
    if phases.odd and with_dipoles(coded.phases, within, oblate, True) != phases:
        program = "SPCAT settles the phases along axes without odd parameters by the dipoles, SPFIT does not"
        notes.append(f"phases: {_choice(program, as_spcat)}")
    # whether electric moments between the same two states are of even and of odd order
    orders = {(states, False) for states in dipoles} | {(c.states, c.typ in EVEN_ORDER) for _, c in others if c.axis}
    unlike = any((states, True) in orders and (states, False) in orders for states, _ in orders if len(set(states)) > 1)
    if phases.between_i and not phases.odd and unlike:
        program = "SPCAT gives moments of even order in angular momenta the other sign beside those of odd order"
        notes.append(f"dipoles between two states: {_choice(program, as_spcat)}")
    return notes


def _basis_notes(solved: Iterable[SolvedGroup], whole: list[Group], request: Request) -> list[str]:
    """A sentence for each group whose basis is cut: levels that KNMIN and KNMAX exclude, and shifts of the others from the whole basis."""
    notes = []
    for group, levels, _ in solved:
        if any(state.is_cut for state in group.states):
            numbers = {state.number for state in group.states}
            others = [other for other in whole if any(state.number in numbers for state in other.states)]
            notes.append(_cut_note(group, levels, others, request))
    return notes


def _cut_note(group: Group, levels_of_file: Levels, whole: list[Group], request: Request) -> str:
    half = sum(group.spins) % 2
    twice_f = 2 * request.fend - half
    levels, count = _energies([(group, levels_of_file)], twice_f)
    all_energies, total = _energies([(other, other.levels((twice_f, twice_f))) for other in whole], twice_f)
    shift = max(
        (abs(energy - all_energies[label]) for label, energy in levels.items() if label in all_energies), default=0.0
    )
    limits = ", ".join(_k_limits(state) for state in group.states if state.is_cut)
    angular = f"F = {twice_f}/2" if half else f"{'F' if group.spins else 'J'} = {twice_f // 2}"
    if not count:
        moved = "no other is there"
    elif shift < SAME_MHZ:
        moved = "the others lie where the whole basis has them"
    else:
        moved = f"the others lie up to {shift:.3g} MHz from where the whole basis has them"
    return (
        f"{limits}: as the file says, other K are left out of the basis; at {angular} these are {total - count} of {total} levels, and "
        f"{moved}; --full-basis has every K"
    )


def _k_limits(state: StateOptions) -> str:
    low = f"KNMIN = {state.kmin}" if state.kmin else ""
    high = f"KNMAX = {state.kmax}" if state.with_all_k().kmax != state.kmax else ""
    return f"{' and '.join(filter(None, (low, high)))} of state {state.number}"


def _energies(solved: Iterable[tuple[Group, Levels]], twice_f: int) -> tuple[dict[tuple[int, ...], float], int]:
    """Energies (MHz) of the existing levels of one F by state and quantum numbers, and their number, counting ±K as two."""
    energies, count = dict[tuple[int, ...], float](), 0
    for group, levels in solved:
        rows = np.flatnonzero((levels.multiplicity == twice_f + 1) & (group.weights(levels) > 0))
        others = [values[rows] for name, values in levels.quanta.items() if name != "v"]
        labels = np.column_stack([group.numbers(levels)[rows], *others])
        energies |= dict(zip(map(tuple, labels.tolist()), levels.energy_mhz[rows].tolist(), strict=True))
        count += int(levels.components[rows].sum())
    return energies, count


def _falling_diagonal_notes(groups: Iterable[Group], diag: int, highest_n: int) -> list[str]:
    """A note if the diagonal of the Hamiltonian falls with K, so that labels by energy (DIAG 0 and 3) differ from those by K.

    With DIAG = 3 it matters for the weights of an axis of threefold or higher symmetry, which follow the K of the label.
    """
    falls = [
        n
        for group in groups
        if diag == 0 or (diag == 3 and any(state.has_e_levels for state in group.states))
        if (n := group.falls_from(highest_n)) is not None
    ]
    said = {
        0: "SPCAT with DIAG = 0 lists diagonal elements there, or names levels by energy; these are eigenvalues, with the K of their "
        "largest share if it is above 1/2",
        3: "where K is mixed, DIAG = 3 names levels by energy, and the weights of A and E levels follow the K of these names; DIAG = 1 "
        "has the K of the largest share",
    }
    where = "the diagonal of the Hamiltonian falls with K (rises, in an oblate basis)"
    return [f"from N = {min(falls)} on {where}: {said[diag]}"] if falls else []


def _full_basis_notes(states: Iterable[StateOptions], highest_n: int) -> list[str]:
    """A note for each ignored KNMIN and KNMAX that would exclude levels up to the highest N."""
    lifted = [state for state in states if state.with_k_to(highest_n).is_cut]
    return [
        f"{_k_limits(state)} is lifted by --full-basis: every K to N is in the basis, which is not what the file says"
        for state in lifted
    ]


MOST_K = 99  # largest K in the quantum numbers of a catalogue


def range_notes(states: Iterable[StateOptions], name: str) -> list[str]:
    """A note for files that are read as a top, whose basis has all K independent of KNMIN and KNMAX."""
    cut = [_k_limits(state) for state in states if state.with_k_to(MOST_K).is_cut]
    if not cut:
        return []
    return [
        f"{', '.join(cut)} in {name}: constants alone are read from it here, and every K to N is in the basis; rotor spectrum FILE.int "
        "keeps to the range of the file"
    ]
