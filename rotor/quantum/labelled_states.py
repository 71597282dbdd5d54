"""Labelled levels of states without spins, for parameters that change: linear blocks of connected Wang blocks.

Labels are J, v, Ka, Kc. Nothing is solved to find them: which block a label lies in follows from J, v and the parities of Ka and Kc,
and which state it is from the names that its block has at the start. Only blocks with a label are made.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.basis.state_elements import StateElements, StateTerms, Vertex
from rotor.quantum.coupled_levels import names_of_functions, names_of_states
from rotor.quantum.effect import QuantumEffect, k_limits_of
from rotor.quantum.label_tracking import Follows, NamedBlock, NamedFunctions, Naming, TrackedLevels, tracked_blocks
from rotor.quantum.wang.basis import blocks_within, parts_of
from rotor.quantum.wang.rotation import representation_of

if TYPE_CHECKING:
    from rotor.tops.top import Top


def labelled_states(
    top: Top,
    effects: Sequence[QuantumEffect],
    names: Sequence[str],
    labels: Ints,
    values_mhz: Floats,
    naming: Naming | None = None,
) -> TrackedLevels:
    """The blocks in which labels J, v, Ka, Kc (n, 4) lie, for any values of the named parameters; states are named at `values_mhz`.

    naming: how the states of connected Wang blocks get their names; by overlaps by default, see `names_of_states`. Raises ValueError for a
    Hamiltonian that is not finite, or not invariant under time reversal.
    """
    representation, limits, named = representation_of(top), k_limits_of(top, effects), naming or by_overlaps
    rows_of_j = {j: np.flatnonzero(labels[:, 0] == j) for j in distinct(labels[:, 0][labels[:, 0] >= 0]).tolist()}
    states = sorted({0, *(state.v for effect in effects for state in effect.states(top))})
    vertices = {
        j: [(v, block) for v in states for block in blocks_within(j, representation, limits.get(v))] for j in rows_of_j
    }
    terms = StateTerms.from_effects(top, effects, names, representation)
    elements = StateElements(terms, len(names), vertices)
    blocks, inside = list[NamedBlock](), list[Ints]()
    for j, rows in sorted(rows_of_j.items(), reverse=True):
        here = elements.at(j)
        classes = {(int(v), "eo"[ka % 2] + "eo"[kc % 2]) for _, v, ka, kc in labels[rows].tolist()}
        for members in here.connected:
            members_here = [vertices[j][i] for i in members]
            if {(v, block.species) for v, block in members_here} & classes:
                blocks.append((here.block(members), named(members_here, representation)))
                inside.append(rows)

    return tracked_blocks(
        names, blocks, len(labels), lambda number, _: (inside[number], labels[inside[number], 1:]), values_mhz
    )


def by_overlaps(blocks: Sequence[Vertex], representation: str) -> NamedFunctions:
    """Names of states by their overlaps with those of each Wang block by itself."""
    parts = parts_of(blocks)
    sub_blocks = np.repeat(np.arange(len(parts)), [part.basis.size for part in parts])

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        if len(parts) == 1:
            return names_of_functions(parts, representation)
        return names_of_states(parts, matrix, vectors, representation)[0]  # of the matrix the lower triangle is read

    return NamedFunctions(sub_blocks, namer, Follows.MOSTLY)
