"""Levels of each F with three equivalent nuclei about a threefold axis, over the functions that their exchange allows.

A turn by 120° about the axis together with the cyclic exchange of the three spins leaves each function of a molecule unchanged (A1 and A2
of D3; levels of E do not exist). For K = 0, 3, 6, ... these functions are Wang functions W_s(K) times spin functions of species A1 and A2.
For other K they contain the spin functions x and y of species E (`coupling`),

    [W_s(K) x + o W_-s(K) y]/√2,     o = 1 or -1 as a turn takes W_s(K) to + or -sin(2πK/3) W_-s(K)

(H. M. Pickett, J. Mol. Spectrosc. 228, 659 (2004), in real functions). Between such functions the sum of an operator over the three nuclei
is three times that of the first nucleus, X·I_1, so that the tensor of one nucleus is enough; likewise for the pair of the second and third
nuclei. Operators that are odd under all half turns across the axis may mix A1 with A2, as in a molecule with only the threefold axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import sqrt

import numpy as np

from rotor.arrays import Floats, Ints, symmetric_from_lower
from rotor.quantum.blocks.connected import part_numbers
from rotor.quantum.spins.blocks import Members, Plan, States, blocks_of_f, diagonalised
from rotor.quantum.spins.coupling import EVEN_E, ODD_E, STEP, Allowed
from rotor.quantum.spins.many_f import Frame, groups_of, hamiltonians
from rotor.quantum.spins.parts import PartColumns, SpinPart
from rotor.quantum.spins.rotor import Exist, wang_functions
from rotor.quantum.wang.basis import Part, phase
from rotor.tops.constants.operators import axis_order

_ZERO = 1e-12  # smaller elements, relative to the largest, are round-off of sums that cancel


def allowed_states(
    plan: Plan, frame: Frame, patterns: Mapping[int, Ints], exist: Exist | None
) -> tuple[Members, Iterator[States]]:
    """The blocks of all F over allowed functions in which a level exists, and their states."""
    all_f, columns = blocks_of_f(plan, patterns)
    wholes = [(f, columns.block_parts(number)) for number, f in enumerate(all_f.tolist())]
    allowed = [_allowed(plan, patterns[f], parts) for f, parts in wholes]
    found = dict[int, Floats]()
    grouped = groups_of(all_f, columns, frame)
    sizes = [(len(each.products),) for each in allowed]
    for numbers, matrices in hamiltonians(plan.scheme, plan.contracted, frame, grouped, sizes, np.zeros(len(wholes))):
        for number, matrix in zip(numbers, symmetric_from_lower(np.tril(matrices)), strict=True):
            found[number] = allowed[number].products.T @ matrix @ allowed[number].products
    members, solved = list[tuple[int, tuple[SpinPart, ...], Allowed]](), list[Floats]()
    for number in sorted(found):
        functions, matrix = allowed[number], found[number]
        for chosen in _connected(matrix, functions.sub_block) if len(matrix) else ():
            parts, block = _part_of(wholes[number][1], functions, chosen)
            if exist is None or exist(block.names).any():
                members.append((wholes[number][0], parts, block))
                solved.append(matrix[np.ix_(chosen, chosen)])
    solutions = (
        diagonalised([number], (matrix - matrix[0, 0] * np.eye(len(matrix)))[None], matrix[:1, 0])
        for number, matrix in enumerate(solved)
    )
    return _columns(plan, members), solutions


def _columns(plan: Plan, members: Sequence[tuple[int, tuple[SpinPart, ...], Allowed]]) -> Members:
    """Blocks, by their doubled F, parts and functions, as columns."""
    allowed = [functions for _, _, functions in members]
    counts = np.array([(len(each.names), len(each.sizes)) for each in allowed], dtype=np.int64).reshape(-1, 2).T
    tables = ([each.names for each in allowed], [each.sizes for each in allowed])
    names, sizes = (np.concatenate(table) if table else np.zeros((0, 4), dtype=np.int64) for table in tables)
    parts = PartColumns.from_parts(plan.blocks, [parts for _, parts, _ in members])
    return Members(
        np.array([f for f, *_ in members], dtype=np.int64), parts, names, sizes, counts[0], counts[1], allowed
    )


def _allowed(plan: Plan, patterns: Ints, parts: Sequence[SpinPart]) -> Allowed:
    """The allowed functions of one F, each one product of a Wang function and a pattern or the sum of two."""
    row_of = {tuple(pattern): row for row, pattern in enumerate(patterns.tolist())}
    wang = [(part, wang_part, wang_functions(wang_part)) for part in parts for wang_part in part.rotor.parts]
    partner = {
        (wang_part.v, basis.j, k, basis.sign): (part, at)
        for part, wang_part, basis in wang
        for at, k in enumerate(basis.k.tolist(), wang_part.place.start)
    }
    columns, sub_block, names, sizes = list[list[tuple[int, float]]](), list[int](), list[Ints](), list[int]()
    for part, wang_part, basis in wang:
        along, orientation = wang_part.names[:, _along(plan)], 1.0 if phase(basis) == 1.0 else -1.0
        for row in range(part.patterns.start, part.patterns.stop):
            kind = int(patterns[row, -3]) % STEP
            for residue in () if kind == ODD_E else (1, 2) if kind == EVEN_E else (0,):
                chosen = np.flatnonzero(basis.k % 3 == residue)
                for at in chosen.tolist():
                    first = _product(part, wang_part.place.start + at, row)
                    if residue:
                        other = patterns[row].copy()
                        other[-3] += ODD_E - EVEN_E
                        o = orientation if residue == 1 else -orientation
                        second = *partner[wang_part.v, basis.j, int(basis.k[at]), -basis.sign], row_of[tuple(other)]
                        columns.append([(first, sqrt(0.5)), (_product(*second), o * sqrt(0.5))])
                    else:
                        columns.append([(first, 1.0)])
                sub_block += [len(sizes)] * len(chosen)
                names.append(_names_of_sub_block(wang_part, along % 3 == residue, patterns[row], residue))
                sizes.append(len(chosen))
    products = np.zeros((parts[-1].place.stop, len(columns)))
    for column, entries in enumerate(columns):
        for place, factor in entries:
            products[place, column] = factor
    labels = np.concatenate(names) if names else np.zeros((0, 3 + patterns.shape[1]), dtype=np.int64)
    return Allowed(products, np.array(sub_block, dtype=np.int64), labels, np.array(sizes, dtype=np.int64))


def _product(part: SpinPart, function: int, pattern: int) -> int:
    """Place of the product of a Wang function of a part and a pattern."""
    return int(part.place.start + (pattern - part.patterns.start) * len(part.rotor.energies_mhz) + function)


def _along(plan: Plan) -> int:
    """Column of K among v, Ka and Kc: 1 or 2."""
    axis = axis_order(plan.representation)[2]
    if axis == "b":
        raise ValueError(f"representation {plan.representation}: the threefold axis is a or c, the z of the basis")
    return 1 if axis == "a" else 2


def _names_of_sub_block(part: Part, chosen: Ints, pattern: Ints, residue: int) -> Ints:
    """v, Ka, Kc and the pattern; in labels x stands for E with K = 3n + 2, y for E with K = 3n + 1."""
    names = part.names[np.asarray(chosen, dtype=bool)]
    named = pattern.copy()
    if residue == 1:
        named[-3] += ODD_E - EVEN_E
    return np.column_stack([names, np.tile(named, (len(names), 1))])


def _connected(matrix: Floats, sub_block: Ints) -> list[Ints]:
    """The functions of each connected part of the matrix; sub-blocks are not divided."""
    scale = float(np.abs(matrix - np.diag(np.diag(matrix))).max(initial=0.0))
    i, k = np.nonzero(np.abs(matrix) > _ZERO * scale)
    count = int(sub_block.max()) + 1
    part_of_function = part_numbers(count, sub_block[i], sub_block[k])[sub_block]
    return [np.flatnonzero(part_of_function == part) for part in np.unique(part_of_function)]


def _part_of(parts: Sequence[SpinPart], functions: Allowed, chosen: Ints) -> tuple[tuple[SpinPart, ...], Allowed]:
    """The parts that these functions contain, and the functions over products of these parts."""
    products, subs = functions.products[:, chosen], np.unique(functions.sub_block[chosen])
    stops = np.cumsum(functions.sizes)
    names = [functions.names[stops[sub] - functions.sizes[sub] : stops[sub]] for sub in subs]
    used, rows, start = list[SpinPart](), list[Floats](), 0
    for part in parts:
        if products[part.place].any():
            rows.append(products[part.place])
            used.append(part._replace(place=slice(start, start + len(rows[-1]))))
            start += len(rows[-1])
    sub_block = np.unique(functions.sub_block[chosen], return_inverse=True)[1]
    return tuple(used), Allowed(np.concatenate(rows), sub_block, np.concatenate(names), functions.sizes[subs])
