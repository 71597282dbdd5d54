"""Derivatives of levels with spins by constants: ∂E_i/∂c = ⟨i|∂H/∂c|i⟩ (Hellmann and Feynman, see `estimates.derivatives`).

∂H/∂c is a sum over channels of coupling coefficients times elements of the rotation, c(p', p) ⟨r'|X_c|r⟩. With V_pr for the state i,

    ∂E_i/∂c = Σ_r'r X_c(r', r) D_i(r', r),     D_i(r', r) = Σ_p'p V_p'r' c(p', p) V_pr.

The density D of a channel is computed once and contracted with all constants. Blocks whose functions differ only in F share arrays
(`many_f`); elements of the rotation are tables by row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, runs_of_similar_size
from rotor.quantum.basis.state_elements import StateTerms, blocks_of_terms
from rotor.quantum.levels import Levels
from rotor.quantum.spins.axial import contracted_operators
from rotor.quantum.spins.blocks import Shared, SpinBlock
from rotor.quantum.spins.contraction import powers_of_stacks
from rotor.quantum.spins.many_f import Frame, Places, RotationColumns, Tables, tables_of
from rotor.quantum.spins.many_f_lines import groups_of_blocks
from rotor.quantum.spins.pattern_tables import couplings_by_f
from rotor.quantum.spins.rotor import ALONE, Channel, Channels, Piece, parameter_channels

if TYPE_CHECKING:
    from rotor.tops.top import Top

_REACH = 2  # largest difference of N that the operators of a Hamiltonian connect
_PADDED = 1 << 21  # largest array of vectors (numbers): 16 MB
_LIKE = 1.5  # largest ratio of sizes of blocks whose vectors share an array


class UnitTables(NamedTuple):
    """Unit elements (N, units, states', states) between two kinds of rotational blocks.

    columns: the parameters that act. mix: (N, parameters, units), the factor of each unit in the derivative by each parameter.
    """

    elements: Floats
    columns: Ints
    mix: Floats


Kinds = tuple[int, int, int]  # kinds of both blocks and N' - N


def derivatives(top: Top, levels: Levels, names: Sequence[str], rows_of_levels: Ints) -> Floats:
    """∂E/∂c (rows, names) of levels with spins, MHz per MHz; ValueError for levels without vectors."""
    if not levels.blocks:
        raise ValueError("these levels have no vectors; solve them with their spins anew")
    shared: Shared = levels.blocks[0].shared
    frame: Frame = shared.cache["frame"]
    out = np.zeros((len(levels) + 1, len(names)))  # the last row takes the padding
    tables = [
        (couplings_by_f(shared.scheme, channel, frame.twice_f[0], frame.twice_f[-1]), elements)
        for channel, elements in _unit_tables(top, levels, names, shared, frame)
    ]
    for states in groups_of_blocks(levels.blocks, len(levels)):
        group = states.group
        for run in runs_of_similar_size([len(block.vectors) for block in states.blocks], _LIKE, most=_PADDED):
            places = np.arange(run.start, run.stop)
            at = states.in_group[places]
            vectors = states.vectors(places)
            total = np.zeros((len(places), len(names), vectors.shape[3]))
            rows_of_f = frame.rows_of_f(group.twice_f[at])
            rows_of_n = [frame.rows_of(group.twice_rows[at], rotation) for rotation in group.rotations]
            for coefficients, elements in tables:
                _add(total, group.rotations, vectors, elements, coefficients[rows_of_f], rows_of_n)
            out[states.rows[run, : vectors.shape[3]]] = total.transpose(0, 2, 1)
    return np.asarray(out[:-1][rows_of_levels])


def _unit_tables(
    top: Top, levels: Levels, names: Sequence[str], shared: Shared, frame: Frame
) -> Iterator[tuple[Channel, dict[Kinds, UnitTables]]]:
    """Elements of all parameters by channel: powers of N, operators of spins, other operators of N."""
    terms = StateTerms.from_effects(top, levels.effects, names, shared.representation)
    yield ALONE, _power_tables(terms, shared, frame)
    by_parameter = parameter_channels(top, levels.effects, names, shared.scheme)
    channels = dict.fromkeys(channel for by_channel in by_parameter for channel in by_channel)
    for rank in {channel.rank for channel in channels}:
        same_rank = [channel for channel in channels if channel.rank == rank]
        yield from zip(same_rank, _spin_tables(by_parameter, same_rank, shared, frame), strict=True)
    if terms.linked:
        linked = [name if column in terms.linked else "" for column, name in enumerate(names)]
        linked_terms = StateTerms.from_effects(top, levels.effects, linked, shared.representation)
        yield ALONE, _link_tables(linked_terms, len(names), terms.linked, levels.blocks, frame)


def _spin_tables(
    by_parameter: Sequence[Channels], channels: Sequence[Channel], shared: Shared, frame: Frame
) -> Iterator[dict[Kinds, UnitTables]]:
    """Spin operators of channels of one rank: one unit for each operator of N, which a parameter multiplies by ½(N'^2p + N^2p)."""
    units = [_units([by_channel.get(channel, []) for by_channel in by_parameter]) for channel in channels]
    reach, alone = min(_REACH, channels[0].rank), [[unit] for units_of_channel in units for unit in units_of_channel]
    contracted = iter(contracted_operators(shared.stacks, reach, alone, shared.representation))
    for channel, units_of_channel in zip(channels, units, strict=True):
        terms = [
            (units_of_channel.index(_unit(piece)), piece, column)
            for column, by_channel in enumerate(by_parameter)
            for piece in by_channel.get(channel, ())
        ]
        columns = sorted({column for _, _, column in terms})
        tables = [tables_of(next(contracted), frame) for _ in units_of_channel]
        by_kinds = {}
        for key, elements in _side_by_side(tables).items():
            n = frame.n_of_rows
            mix, m = np.zeros((len(n), len(columns), len(units_of_channel))), n + key[2]
            for unit, piece, column in terms:
                powers = ((m * (m + 1.0)) ** piece.n2 + (n * (n + 1.0)) ** piece.n2) / 2
                mix[:, columns.index(column), unit] += piece.value * powers
            by_kinds[key] = UnitTables(elements, np.array(columns), mix)
        yield by_kinds


def _unit(piece: Piece) -> Piece:
    """A piece with value 1 and no power of N²."""
    return replace(piece, value=1.0, n2=0)


def _units(pieces: Sequence[Sequence[Piece]]) -> list[Piece]:
    """The distinct operators of N in sums of pieces, without values and powers of N²."""
    return list(dict.fromkeys(_unit(piece) for sum_of_pieces in pieces for piece in sum_of_pieces))


def _side_by_side(tables: Sequence[Tables]) -> dict[Kinds, Floats]:
    """Tables (N, states', states) of several units as (N, units, states', states)."""
    joined: dict[Kinds, Floats] = {}
    for unit, table_of_unit in enumerate(tables):
        for key, table in table_of_unit.items():
            joined.setdefault(key, np.zeros((len(table), len(tables), *table.shape[1:])))[:, unit] = table
    return joined


def _link_tables(
    terms: StateTerms, count: int, linked: Sequence[int], blocks: Sequence[SpinBlock], frame: Frame
) -> dict[Kinds, UnitTables]:
    """Parameters that multiply operators of N other than powers, one unit each."""
    rotors = {part.number: part.rotor for block in blocks for part in block.parts}
    tables: dict[Kinds, Floats] = {}
    linear = blocks_of_terms(terms, count, blocks[0].shared.representation, list(rotors.values()))
    for (number, rotor), block in zip(rotors.items(), linear, strict=True):
        kind, size = frame.kinds[number], block.size
        states = frame.energies_mhz[kind].shape[1]
        table = tables.setdefault((kind, kind, 0), np.zeros((len(frame.n_of_rows), len(linked), states, states)))
        units = [linked.index(parameter) for parameter in block.parameters.tolist()]
        table[frame.rows[number], units, :size, :size] = rotor.vectors.T @ block.matrices() @ rotor.vectors
    mix = np.tile(np.eye(len(linked)), (len(frame.n_of_rows), 1, 1))
    return {key: UnitTables(table, np.array(linked), mix) for key, table in tables.items()}


def _power_tables(state_terms: StateTerms, shared: Shared, frame: Frame) -> dict[Kinds, UnitTables]:
    """Powers N^2p ½[Nz^2q, N₊^2n + N₋^2n]₊: one unit for each (v, q, n), which a parameter multiplies by N^2p."""
    others = state_terms.linked
    terms = [
        ((v, q, n), p, column, factor)
        for v, (p, q, n), column, factor in state_terms.by_power()
        if column not in others
    ]
    units = list(dict.fromkeys(unit for unit, *_ in terms))
    columns = sorted({column for _, _, column, _ in terms})
    n = frame.n_of_rows
    mix = np.zeros((len(n), len(columns), len(units)))
    for unit, p, column, factor in terms:
        mix[:, columns.index(column), units.index(unit)] += factor * (n * (n + 1.0)) ** p
    tables: dict[Kinds, Floats] = {}
    for stack, matrices in powers_of_stacks(shared.stacks, units) if units else ():
        count, states = frame.energies_mhz[stack.kind].shape
        table = tables.setdefault((stack.kind, stack.kind, 0), np.zeros((count, len(units), states, states)))
        table[frame.rows[stack.numbers], :, : matrices.shape[2], : matrices.shape[3]] = matrices
    return {key: UnitTables(elements, np.array(columns), mix) for key, elements in tables.items()}


def _add(
    total: Floats, rotations: Sequence[RotationColumns], vectors: Floats, tables: dict[Kinds, UnitTables],
    coefficients: Floats, rows: Sequence[Places],
) -> None:  # fmt: skip
    """Add the derivatives (blocks, parameters, states) from one channel for blocks of a group.

    coefficients: of the F of these blocks. rows: for each kind of rotational block its rows in the tables.
    """
    for left in rotations:
        for right, rows_of_right in zip(rotations, rows, strict=True):
            key = (left.kind, right.kind, (left.rise - right.rise) // 2)
            if key in tables:
                slopes = _between(vectors, left, right, tables[key], coefficients, rows_of_right)
                twice = (
                    1.0 if left.kind == right.kind and left.rise == right.rise else 2.0
                )  # the other order has no table
                total[:, tables[key].columns] += twice * slopes


def _between(
    vectors: Floats, left: RotationColumns, right: RotationColumns, table: UnitTables, coefficients: Floats,
    places: Places,
) -> Floats:  # fmt: skip
    """Σ_p'r' V_p'r' Σ_pr c(p', p) X_c(r', r) V_pr between two kinds of rotational blocks: (blocks, parameters, states)."""
    elements = table.elements[places]  # (blocks, units, r', r)
    blocks, units, rows, columns = elements.shape
    rows, columns = min(rows, vectors.shape[2]), min(columns, vectors.shape[2])
    elements = elements[:, :, :rows, :columns].reshape(blocks, 1, units * rows, columns)
    bra, ket = vectors[:, left.columns, :rows], vectors[:, right.columns, :columns]
    between = coefficients[:, left.patterns, right.patterns]
    if between.shape[1:] == (1, 1):
        moved = between[:, :, :, None] * ket
    else:
        moved = np.matmul(between, ket.reshape(blocks, ket.shape[1], -1)).reshape(blocks, -1, columns, ket.shape[3])
    products = np.matmul(elements, moved).reshape(blocks, -1, units, rows, moved.shape[3])
    products *= bra[:, :, None]
    slopes = products.sum(axis=(1, 3))
    return np.asarray(np.matmul(table.mix[places], slopes))
