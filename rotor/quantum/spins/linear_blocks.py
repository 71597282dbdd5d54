"""Matrices ∂H/∂c of each parameter over rotational functions times coupling patterns, of which H is a linear combination,

    ∂H/∂c = Σ_channels c(p', p) ⟨r'|X_c|r⟩,     ∂E_i/∂c = ⟨i|∂H/∂c|i⟩     (Hellmann and Feynman, see `estimates.derivatives`).

States r of a species of internal rotation take the place of functions; for a coefficient of the torsion-rotation the species derives
mixtures Σ_r v_rp |r⟩ of its states, and sums over p.

Elements of the rotation alone come from `basis.state_elements`, all others from `contraction` with basis functions in place of eigenstates.
They are sparse, and tables by row (`many_f`), since functions of one kind have elements at the same places for all N. Fits and derivatives
of levels use these matrices, `estimates.contracted` for large blocks too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.basis.state_elements import StateTerms, blocks_of_terms
from rotor.quantum.blocks.linear_stacks import LinearBlock, WeightedElements, linear_block
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import Levels, Mixtures, SolvedBlock
from rotor.quantum.spins.blocks import Shared, SpinFunctions
from rotor.quantum.spins.contraction import Contracted, Stack, operators_of_stacks, padded_vectors, stacks_of
from rotor.quantum.spins.many_f import Coefficients, Frame, Group, Tables, between, coefficients_by_f, tables_of
from rotor.quantum.spins.many_f_lines import groups_of_blocks
from rotor.quantum.spins.pattern_tables import couplings_by_f
from rotor.quantum.spins.rotor import ALONE, Channels, Piece, parameter_channels
from rotor.quantum.spins.scheme import AxialState
from rotor.quantum.wang.wang_matrix import diagonal_elements

if TYPE_CHECKING:
    from rotor.tops.top import Top


_REACH = 2  # largest difference of N that the operators of a Hamiltonian connect
Kinds = tuple[int, int, int]  # kinds of both blocks and the distance of their rows


class DerivativeElements(NamedTuple):
    """Elements of ∂H/∂c between functions of two kinds of rotational blocks.

    rows, columns: (elements,) functions, as those of the largest block of a kind are counted. values: (table rows, elements, parameters).
    """

    rows: Ints
    columns: Ints
    values: Floats
    parameters: Ints


class ColumnElements(NamedTuple):
    """Elements between two columns of a group, by their places among its rotations.

    twice: 2 where the elements in the other order are left out, else 1. coefficients: (blocks, patterns', patterns). values: (blocks,
    elements, parameters).
    """

    left: int
    right: int
    twice: float
    coefficients: Floats
    of_kinds: DerivativeElements
    values: Floats


@dataclass(frozen=True, eq=False)
class FunctionTables:
    """Elements of all parameters by channel.

    functions: by number of a rotational block, its functions as those of the largest block of its kind are counted. vectors: (table rows,
    functions, states) of solved blocks by kind. channels: coefficients by F, and elements by kinds.
    """

    frame: Frame
    functions: list[Ints]
    vectors: dict[int, Floats]
    channels: list[tuple[Floats, dict[Kinds, DerivativeElements]]]

    def column_elements(self, group: Group, at: Ints) -> Iterator[ColumnElements]:
        """Elements between the columns of blocks of a group; of columns of different kinds or N in one order only."""
        rows_of_f = self.frame.rows_of_f(group.twice_f[at])
        rows = [self.frame.rows_of(group.twice_rows[at], rotation) for rotation in group.rotations]
        places: dict[tuple[int, int], list[int]] = {}
        for place, rotation in enumerate(group.rotations):
            places.setdefault((rotation.kind, rotation.rise), []).append(place)
        for coefficients, by_kinds in self.channels:
            coefficients_of_f = coefficients[rows_of_f]
            for (up, low, step), of_kinds in by_kinds.items():
                twice = 1.0 if up == low and not step else 2.0
                for k, right in enumerate(group.rotations):
                    for i in places.get((up, right.rise + 2 * step), ()) if right.kind == low else ():
                        between = coefficients_of_f[:, group.rotations[i].patterns, right.patterns]
                        yield ColumnElements(i, k, twice, between, of_kinds, of_kinds.values[rows[k]])

    def over_functions(self, group: Group, at: Ints, vectors: Floats) -> list[Floats]:
        """Vectors (blocks, columns, states, n) over functions, (blocks, patterns, functions, n) for each rotation of a group."""
        out = []
        for rotation in group.rotations:
            turned = self.vectors[rotation.kind][self.frame.rows_of(group.twice_rows[at], rotation)]
            states = min(turned.shape[2], vectors.shape[2])
            out.append(np.matmul(turned[:, None, :, :states], vectors[:, rotation.columns, :states]))
        return out


def function_tables(top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], shared: Shared) -> FunctionTables:
    """Elements of parameters over the functions of all rotational blocks of a calculation."""
    frame = shared.frame
    first, last = frame.twice_f[0], frame.twice_f[-1]
    terms = StateTerms.from_effects(top, effects, names, shared.representation)
    if shared.axial:
        stacks = [stack._replace(vectors=None) for stack in shared.stacks]
        functions = [np.zeros(1, dtype=np.int64)] * len(frame.kinds)
        vectors = {kind: np.ones((len(energies), 1, 1)) for kind, energies in frame.energies_mhz.items()}
        rotation = _axial_elements(terms, len(names), stacks, frame)
    else:
        numbers = np.concatenate([stack.numbers for stack in shared.stacks])
        members = [block for stack in shared.stacks for block in stack.blocks]
        blocks = [members[place] for place in np.argsort(numbers).tolist()]
        stacks = stacks_of(blocks, contract=False)
        functions = _functions(stacks, len(blocks))
        vectors = _vectors(stacks, frame)
        rotation = _rotation_elements(terms, len(names), blocks, functions, shared)
    channels = [(couplings_by_f(shared.scheme, ALONE, first, last), rotation)]
    by_parameter = parameter_channels(top, effects, names, shared.scheme)
    channels_of_spins = dict.fromkeys(channel for by_channel in by_parameter for channel in by_channel)
    for rank in {channel.rank for channel in channels_of_spins}:
        pieces = {
            channel: [by_channel.get(channel, []) for by_channel in by_parameter]
            for channel in channels_of_spins
            if channel.rank == rank
        }
        units = dict.fromkeys(_unit(piece) for of_channel in pieces.values() for each in of_channel for piece in each)
        alone = [[unit] for unit in units]
        contracted = operators_of_stacks(stacks, min(_REACH, rank), alone, shared.representation)
        by_unit = dict(zip(units, contracted, strict=True))
        for channel, of_channel in pieces.items():
            elements = _spin_elements(of_channel, by_unit, frame)
            channels.append((couplings_by_f(shared.scheme, channel, first, last), elements))
    return FunctionTables(frame, functions, vectors, channels)


def _functions(stacks: Sequence[Stack], count: int) -> list[Ints]:
    """The functions of each block, as those of the largest block of its kind are counted."""
    out = [np.zeros(0, dtype=np.int64)] * count
    for stack in stacks:
        for place, number in enumerate(stack.numbers.tolist()):
            pieces = [section.rows.start + np.arange(section.parts[place].basis.size) for section in stack.sections]
            out[number] = np.concatenate(pieces)
    return out


def _vectors(stacks: Sequence[Stack], frame: Frame) -> dict[int, Floats]:
    """Eigenvectors of the rotational blocks by kind, (table rows, functions, states)."""
    out = {}
    for stack in stacks:
        vectors = padded_vectors(stack.blocks, stack.sections, stack.sizes)
        out[stack.kind] = np.zeros((len(frame.n_of_rows), *vectors.shape[1:]))
        out[stack.kind][frame.rows[stack.numbers]] = vectors
    return out


def rotation_blocks(terms: StateTerms, count: int, blocks: Sequence[SolvedBlock]) -> list[LinearBlock]:
    """Linear blocks of the rotation alone, `count` parameters, over the functions of rotational blocks."""
    if not isinstance(blocks[0].parts[0].basis, AxialState):
        return blocks_of_terms(terms, count, blocks)
    first, parameters = np.zeros(1, dtype=np.int64), np.arange(count)
    parts = [block.parts[0] for block in blocks]
    v, n, k = np.array([(part.v, part.basis.j, part.basis.axial_k) for part in parts]).T
    rows = _powers_of_axial(terms, count, v, n, k)
    return [LinearBlock(1, first, first, np.ones((1, 1)), row[None], parameters) for row in rows]


def _powers_of_axial(terms: StateTerms, count: int, v: Ints | int, n: Ints, k: Ints) -> Floats:
    """Diagonal elements [N(N+1)]^p K^2q by function and parameter, (functions, count); operators that change K do not contribute."""
    out = np.zeros((len(n), count))
    for state, powers, column, factor in terms.by_power():
        out[:, column] += np.where(v == state, diagonal_elements({powers: factor}, n, k), 0.0)
    return out


def _axial_elements(
    terms: StateTerms, count: int, stacks: Sequence[Stack], frame: Frame
) -> dict[Kinds, DerivativeElements]:
    """Elements of the rotation alone within functions |N K⟩."""
    out, first, parameters = dict[Kinds, DerivativeElements](), np.zeros(1, dtype=np.int64), np.arange(count)
    for stack in stacks:
        assert stack.k is not None
        values = np.zeros((len(frame.n_of_rows), 1, count))
        values[frame.rows[stack.numbers], 0] = _powers_of_axial(terms, count, stack.sections[0].v, stack.n, stack.k)
        out[stack.kind, stack.kind, 0] = DerivativeElements(first, first, values, parameters)
    return out


def _rotation_elements(
    terms: StateTerms, count: int, blocks: Sequence[SolvedBlock], functions: Sequence[Ints], shared: Shared
) -> dict[Kinds, DerivativeElements]:
    """Elements of the rotation alone between Wang functions, with both triangles."""
    frame = shared.frame
    of_kind: dict[int, list[tuple[int, Ints, Ints, LinearBlock]]] = {}
    for number, linear in enumerate(rotation_blocks(terms, count, blocks)):
        places = functions[number][linear.rows], functions[number][linear.columns]
        of_kind.setdefault(frame.kinds[number], []).append((number, *places, linear))
    out = {}
    for kind, linears in of_kind.items():
        size = 1 + max(int(rows.max()) for _, rows, _, _ in linears)
        occurring = np.unique(np.concatenate([rows * size + columns for _, rows, columns, _ in linears]))
        values = np.zeros((len(frame.n_of_rows), len(occurring), count))
        for number, rows, columns, linear in linears:
            at = np.searchsorted(occurring, rows * size + columns)[:, None]
            values[frame.rows[number], at, linear.parameters] = linear.factors @ linear.mix
        parameters = np.flatnonzero(values.any(axis=(0, 1)))
        rows, columns = np.divmod(occurring, size)
        off = np.flatnonzero(rows != columns)
        values = np.concatenate([values, values[:, off]], axis=1)[:, :, parameters]
        places = np.append(rows, columns[off]), np.append(columns, rows[off])
        out[kind, kind, 0] = DerivativeElements(*places, values, parameters)
    return out


def _spin_elements(
    pieces: Sequence[Sequence[Piece]], by_unit: Mapping[Piece, Sequence[Contracted]], frame: Frame
) -> dict[Kinds, DerivativeElements]:
    """Elements of a channel by kinds: those of each operator of N, times ½(N'^2p + N^2p) and the value of each parameter."""
    units = list(dict.fromkeys(_unit(piece) for pieces_of_parameter in pieces for piece in pieces_of_parameter))
    parameters = np.array([column for column, pieces_of_parameter in enumerate(pieces) if pieces_of_parameter])
    alike: dict[Kinds, list[tuple[int, Ints, Contracted]]] = {}
    for place, unit in enumerate(units):
        for entry in by_unit[unit]:
            up, rows = frame.rows[entry.up.numbers[entry.pairs.up]], frame.rows[entry.low.numbers[entry.pairs.low]]
            alike.setdefault((entry.up.kind, entry.low.kind, int(up[0] - rows[0])), []).append((place, rows, entry))
    n, out = frame.n_of_rows.astype(float), {}
    for kinds, members in alike.items():
        left, right = np.nonzero(np.any([entry.matrices.any(axis=0) for _, _, entry in members], axis=0))
        elements = np.zeros((len(n), len(left), len(units)))
        for place, rows, entry in members:
            elements[rows, :, place] = entry.matrices[:, left, right]
        m = n + members[0][2].pairs.rise
        mix = np.zeros((len(n), len(units), len(parameters)))
        for at, column in enumerate(parameters.tolist()):
            for piece in pieces[column]:
                powers = ((m * (m + 1)) ** piece.n2 + (n * (n + 1)) ** piece.n2) / 2
                mix[:, units.index(_unit(piece)), at] += piece.value * powers
        out[kinds] = DerivativeElements(left, right, elements @ mix, parameters)
    return out


def _unit(piece: Piece) -> Piece:
    """A piece with value 1 and no power of N²."""
    return replace(piece, value=1.0, n2=0)


def derivatives(top: Top, levels: Levels, names: Sequence[str], rows: Ints) -> Floats:
    """∂E/∂c (rows, names) of levels with spins, MHz per MHz; ValueError for levels without vectors."""
    if not levels.blocks:
        raise ValueError("these levels have no vectors; solve them with their spins anew")
    if levels.blocks[0].spins.rotor.moments is not None:
        return species_derivatives(top, levels, names)[rows]
    tables = function_tables(top, levels.effects, names, levels.blocks[0].spins.shared)
    out = np.zeros((len(levels) + 1, len(names)))  # the last row takes the padding
    for states in groups_of_blocks(levels.blocks, len(levels)):
        for at, vectors, places in states.runs():
            over_functions = tables.over_functions(states.group, at, vectors)
            total = np.zeros((len(at), vectors.shape[3], len(names)))
            for each in tables.column_elements(states.group, at):
                total[:, :, each.of_kinds.parameters] += each.twice * _slopes(each, over_functions)
            out[places] = total
    return np.asarray(out[:-1][rows])


def _slopes(each: ColumnElements, vectors: Sequence[Floats]) -> Floats:
    """Σ_p'r'pr V_p'r' c(p', p) X_c(r', r) V_pr, (blocks, n, parameters)."""
    bra, ket = vectors[each.left], vectors[each.right]
    blocks, _, functions, n = ket.shape
    moved = np.matmul(each.coefficients, ket.reshape(blocks, -1, functions * n)).reshape(blocks, -1, functions, n)
    weights = bra[:, :, each.of_kinds.rows]
    weights *= moved[:, :, each.of_kinds.columns]
    total = weights[:, 0] if weights.shape[1] == 1 else weights.sum(axis=1)
    return np.asarray(np.matmul(total.transpose(0, 2, 1), each.values))


def linear_blocks_of_spins(
    top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], blocks: Sequence[SolvedBlock]
) -> list[LinearBlock]:
    """Linear blocks of the blocks of one calculation, over basis functions or the functions that exchange allows."""
    tables = function_tables(top, effects, names, blocks[0].spins.shared)
    out = []
    for block in (solved.spins for solved in blocks):
        linear = linear_block(block.parts[-1].place.stop, list(_elements(block, tables)))
        out.append(linear.turned(block.allowed.products.T) if block.allowed else linear)
    return out


def _elements(block: SpinFunctions, tables: FunctionTables) -> Iterator[WeightedElements]:
    """Elements of the lower triangle of a block."""
    group, size = block.group, block.parts[-1].place.stop
    at = group.places[block.twice_row]
    functions = np.concatenate([np.tile(tables.functions[part.number], part.repeats) for part in block.parts])
    place = np.full((group.columns, 1 + int(functions.max())), -1)
    place[group.functions[int(group.shapes[at])][0], functions] = np.arange(size)
    for each in tables.column_elements(group, np.array([at])):
        up, low = np.nonzero(each.coefficients[0])
        last = np.maximum(each.of_kinds.rows, each.of_kinds.columns)
        inside = np.flatnonzero(each.values[0].any(axis=1) & (last < place.shape[1]))
        rows = place[group.rotations[each.left].columns.start + up[:, None], each.of_kinds.rows[inside]]
        columns = place[group.rotations[each.right].columns.start + low[:, None], each.of_kinds.columns[inside]]
        factors = each.coefficients[0][up, low][:, None, None] * each.values[0][inside]
        present = (rows >= 0) & (columns >= 0) & ((rows >= columns) | (each.twice > 1))
        places = np.maximum(rows, columns) * size + np.minimum(rows, columns)
        yield WeightedElements(places[present], factors[present], each.of_kinds.parameters)


def species_derivatives(top: Top, levels: Levels, names: Sequence[str]) -> Floats:
    """∂E/∂c (levels, names) of levels by constants of the spins and of the torsion-rotation."""
    scheme = levels.blocks[0].spins.shared.scheme
    slopes = slopes_by_spins(levels.blocks, parameter_channels(top, levels.effects, names, scheme))
    for block in levels.blocks:
        of_rotation = partial(block.spins.rotor.moments.slopes, names=names)
        slopes[block.start : block.start + len(block.energies_mhz)] += slopes_by_rotation(block, of_rotation)
    return slopes


def slopes_by_rotation(block: SolvedBlock, mixture_slopes: Callable[[Mixtures], Floats]) -> Floats:
    """Derivatives (n, coefficients) by coefficients of the torsion-rotation: those of mixtures of the states of each N."""
    by_patterns = dict[int, list[tuple[SolvedBlock, NDArray[Any]]]]()
    for part in block.spins.parts:
        by_patterns.setdefault(part.patterns.start, []).append((part.rotor, part.rows(block.vectors).swapaxes(0, 1)))
    return np.asarray(sum(mixture_slopes(mixtures) for mixtures in by_patterns.values()))


def slopes_by_spins(blocks: Sequence[SolvedBlock], by_parameter: Sequence[Channels]) -> Floats:
    """Derivatives (states, parameters) of the states of blocks by parameters, from their spin terms."""
    shared: Shared = blocks[0].spins.shared
    frame = shared.frame
    operators = [list(_operators(shared, channels)) for channels in by_parameter]
    number = blocks[-1].start + len(blocks[-1].energies_mhz)
    out = np.zeros((number + 1, len(by_parameter)))  # the last row takes the padding
    for states in groups_of_blocks(blocks, number):
        for at, vectors, rows in states.runs():
            for parameter, terms in enumerate(operators):
                out[rows, parameter] = sum(_expectations(states.group, at, vectors, *term, frame) for term in terms)
    return out[:-1]


def _operators(shared: Shared, channels: Channels) -> Iterator[tuple[Tables, Coefficients]]:
    """Elements of the rotation and coefficients of each channel."""
    frame = shared.frame
    for channel, pieces in channels.items():
        (contracted,) = operators_of_stacks(shared.stacks, channel.rank, [pieces], shared.representation)
        couplings = couplings_by_f(shared.scheme, channel, frame.twice_f[0], frame.twice_f[-1])
        yield tables_of(contracted, frame), coefficients_by_f(couplings, frame)


def _expectations(
    group: Group, at: Ints, vectors: NDArray[Any], tables: Tables, coefficients: Coefficients, frame: Frame
) -> Floats:
    """⟨i|Σ c X|i⟩ (blocks, n) of vectors (blocks, columns, states, n); columns of different N or kind have elements in one order."""
    height, total = vectors.shape[2], np.zeros((len(vectors), vectors.shape[3]))
    for each in between(group, group, at, 0, tables, coefficients, frame, (height, height)):
        bra = vectors[:, each.left.columns, : each.elements.shape[1]].conj()
        expectations = np.einsum("bpsn,bpsn->bn", bra, each.times(vectors)).real
        total += expectations if each.left is each.right else 2 * expectations
    return total
