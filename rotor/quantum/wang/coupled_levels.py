"""Interacting states: levels of all states v whose Wang blocks couplings connect.

Of each J the Wang blocks of all states are the vertices of a graph, whose edges are the operators that connect two of them;
every connected part is one matrix, real in functions with the factors of `wang.basis.phase`, and is solved whole. A
level is named after the function of one state and one Wang block, solved by itself, that it overlaps with; names are given one to
one, so that the sum of all these overlaps is largest. The matrices are those of `basis.state_elements`, which fits and derivatives have
too, with one parameter: H itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.basis.state_elements import Link, StateElements, StateTerms
from rotor.quantum.effect import Coupling, QuantumEffect, couplings_of, k_limits_of
from rotor.quantum.levels import Levels, SolvedBlock, levels_of_blocks, placed
from rotor.quantum.wang.basis import Part, blocks_within, names_of, parts_of
from rotor.tops.constants.operators import Operators

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top


@dataclass(frozen=True)
class Model:
    """What a coupled calculation consists of: operators of every state by v, sums of couplings times their values in MHz, limits of K."""

    states: dict[int, Operators]
    links: list[Link]
    representation: str
    limits: dict[int, tuple[int, int]] = field(default_factory=dict)


def model_of(top: Top, effects: tuple[QuantumEffect, ...], operators: Operators, representation: str) -> Model:
    """The states and couplings that the effects bring, beside the operators of the top's own state v = 0.

    Raises ValueError for a coupling to a state that no effect defines, and for two effects that define the same state.
    """
    states, alike = {0: operators}, dict[object, list[tuple[float, Coupling]]]()
    for effect in effects:
        values = effect.parameters(top)
        for coupling in couplings_of(top, [effect], representation):
            key = coupling.bra, coupling.ket, coupling.factors
            alike.setdefault(key, []).append((values[coupling.name], coupling))
        states |= {state.v: state.operators(values) for state in effect.states(top)}
    numbers = [0, *(state.v for effect in effects for state in effect.states(top))]
    if len(set(numbers)) < len(numbers):
        raise ValueError(f"states {numbers}: every state has a number v of its own, and 0 is the top's")
    links = [Link.from_couplings(couplings) for couplings in alike.values()]
    for link in links:
        for v in (link.bra, link.ket):
            if v not in states:
                name = link.couplings[0].name
                raise ValueError(f"coupling {name}: state {v} is not defined; known are {sorted(states)}")
    return Model(states, links, representation, k_limits_of(top, effects))


def coupled_levels(
    top: Top, effects: tuple[QuantumEffect, ...], model: Model, jmin: int, jmax: int, executor: Executor | None = None
) -> Levels:
    """All levels of a coupled calculation, by quantum numbers j, ka, kc and, of several states, v; J are spread over `executor`.

    Raises ValueError for a Hamiltonian that overflows, a coupling that is not invariant under time reversal, and states that mix levels of
    different spin weight.
    """
    all_j = range(jmin, jmax + 1)
    solved = (
        executor.map(partial(solve_coupled, model), [[j] for j in all_j]) if executor else [solve_coupled(model, all_j)]
    )
    blocks = tuple(placed(block for blocks_of_piece in solved for block in blocks_of_piece))

    labels = np.concatenate([block.labels for block in blocks])
    quanta = {"v": labels[:, 0]} if len(model.states) > 1 else {}
    j = np.repeat([block.j for block in blocks], [len(block.energies_mhz) for block in blocks])
    quanta |= {"j": j, "ka": labels[:, 1], "kc": labels[:, 2]}
    levels = levels_of_blocks(top, effects, blocks, quanta, jmax, model.representation)
    _refuse_mixed_weights(levels)
    return levels


def _refuse_mixed_weights(levels: Levels) -> None:
    """States of one block have one symmetry, so that their nuclear-spin weights are one number.

    The functions of a Wang block of a symmetric top differ in K, and where nothing connects it to another they do not mix.
    """
    for block in levels.blocks:
        if len(block.parts) == 1 and levels.kind in ("prolate", "oblate"):
            continue
        weights = levels.weight[block.start : block.start + len(block.energies_mhz)]
        if len(weights) and (weights != weights[0]).any():
            row = block.start + int(np.argmax(weights != weights[0]))
            raise ValueError(
                f"an effect mixes levels of nuclear-spin weights {weights[0]} and {levels.weight[row]} "
                f"({', '.join(levels.quanta)} = {levels.labels(np.array([block.start]))[0].strip()} and "
                f"{levels.labels(np.array([row]))[0].strip()}): symmetry forbids that; check the effect or the spin weights"
            )


def solve_coupled(model: Model, all_j: Sequence[int]) -> list[SolvedBlock]:
    """The coupled blocks of some J, in the order of J."""
    limits, frame = model.limits, model.representation
    vertices = {
        j: [(v, b) for v in sorted(model.states) for b in blocks_within(j, frame, limits.get(v))] for j in all_j
    }
    operators = [(v, 0, operators) for v, operators in model.states.items()]
    terms = StateTerms.from_operators(model.states, operators, [(0, link) for link in model.links])
    elements = StateElements(terms, 1, vertices)
    by_j: dict[int, list[SolvedBlock]] = {}
    for j in sorted(all_j, reverse=True):
        here = elements.at(j)
        # the part that is one number for J: taken out of the matrices for the sake of digits
        zero = float(here.mix[terms.first[0], 0])
        here.mix[list(terms.first.values())] -= zero
        by_j[j] = []
        for members in here.connected:
            parts = parts_of([vertices[j][i] for i in members])
            rows, columns, units, values = here.lower_triangle(members)
            matrix = np.zeros((parts[-1].place.stop,) * 2)
            np.add.at(matrix, (rows, columns), values * here.mix[units, 0])
            if not np.isfinite(matrix).all():
                raise ValueError("a block of the Hamiltonian overflows: J max is too high for these constants")
            energies, vectors = np.linalg.eigh(matrix)  # reads the lower triangle
            labels, mixing = names_of_states(parts, matrix, vectors, model.representation)
            by_j[j].append(SolvedBlock(parts, energies + zero, vectors, labels=labels, mixing=mixing))
    return [block for j in all_j for block in by_j[j]]


def names_of_states(
    parts: tuple[Part, ...], matrix: Floats, vectors: Floats, representation: str
) -> tuple[Ints, Floats]:
    """v, Ka, Kc (n, 3) of the states of a coupled block, and their squared overlaps (n,) with the functions that name them.

    A function is a state of one part, solved by itself; names are given one to one so that the sum of the overlaps is largest.
    """
    functions = [np.linalg.eigh(matrix[part.place, part.place]).eigenvectors.T @ vectors[part.place] for part in parts]
    overlaps = np.concatenate(functions) ** 2
    function_of_state = match_names(overlaps) if len(parts) > 1 else np.arange(vectors.shape[1])
    return names_of_functions(parts, representation)[function_of_state], overlaps[
        function_of_state, np.arange(vectors.shape[1])
    ]


def names_of_functions(parts: tuple[Part, ...], representation: str) -> Ints:
    """v, Ka, Kc (n, 3) of the states of the parts, each solved by itself, one part behind the other."""
    names = np.empty((parts[-1].place.stop, 3), dtype=np.int64)
    for part in parts:
        names[part.place, 0] = part.v
        names[part.place, 1], names[part.place, 2] = names_of(part.basis, representation)
    return names


def match_names(overlaps: Floats) -> Ints:
    """Which function names each state: (n,) rows of `overlaps` (functions, states), each once, their sum largest.

    Where every state has a function of its own that it overlaps with most, that is the answer. For the few others shortest paths in the
    graph of functions and states move names to where the sum loses least (H. W. Kuhn, Naval Res. Logist. Q. 2 (1955) 83; with
    potentials as J. Edmonds and R. M. Karp, J. ACM 19 (1972) 248).

    >>> match_names(np.array([[0.9, 0.8, 0.0], [0.1, 0.2, 0.3], [0.0, 0.0, 0.7]])).tolist()
    [0, 1, 2]
    """
    clear = overlaps.argmax(axis=0)
    count = len(clear)
    if len(set(clear.tolist())) == count:
        return np.asarray(clear)
    loss = overlaps.max(axis=0)[None, :] - overlaps  # never below 0
    potential = np.zeros(count)  # of the functions; of the states the largest overlap is taken off above
    state_of_function, function_of_state = np.full(count, -1), np.full(count, -1)
    for state, function in enumerate(clear.tolist()):
        if state_of_function[function] < 0:
            state_of_function[function], function_of_state[state] = state, function
    lifted = np.zeros(count)  # potentials of the states
    for state in np.flatnonzero(function_of_state < 0).tolist():
        _augmented(state, loss, potential, lifted, state_of_function, function_of_state)
    return function_of_state


def _augmented(
    state: int, loss: Floats, potential: Floats, lifted: Floats, state_of_function: Ints, function_of_state: Ints
) -> None:
    """One more state has a name, by the way of least loss; the arrays are changed."""
    count = len(function_of_state)
    distance, before = np.full(count, np.inf), np.full(count, -1)
    done = np.zeros(count, dtype=bool)
    here, least, seen = state, 0.0, [state]
    while True:
        ways = least + loss[:, here] - lifted[here] - potential
        shorter = ~done & (ways < distance)
        distance[shorter], before[shorter] = ways[shorter], here
        function = int(np.where(done, np.inf, distance).argmin())
        least = float(distance[function])
        done[function] = True
        if state_of_function[function] < 0:
            break
        here = int(state_of_function[function])
        seen.append(here)
    reached = [int(function_of_state[function_seen]) for function_seen in seen[1:]]
    potential[reached] += distance[reached] - least
    lifted[seen] += least - np.array([0.0, *distance[reached]])
    while True:
        previous = int(before[function])
        state_of_function[function] = previous
        function, function_of_state[previous] = int(function_of_state[previous]), function
        if previous == state:
            return
