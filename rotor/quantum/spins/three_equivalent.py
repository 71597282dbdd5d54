"""Levels of each F with three equivalent nuclei about a threefold axis, over the functions that their exchange allows.

A turn by 120° about the axis together with the cyclic exchange of the three spins leaves each function of a molecule unchanged (A1 and A2
of D3; levels of E do not exist). For K = 0, 3, 6, ... these functions are Wang functions W_s(K) times spin functions of species A1 and A2.
For other K they contain the spin functions x and y of species E (`three_spins`),

    [W_s(K) x + o W_-s(K) y]/√2,     o = 1 or -1 as a turn takes W_s(K) to + or -sin(2πK/3) W_-s(K)

(H. M. Pickett, J. Mol. Spectrosc. 228, 659 (2004), in real functions). Between such functions the sum of an operator over the three nuclei
is three times that of the first nucleus, X·I_1, so that the tensor of one nucleus is enough; likewise for the pair of the second and third
nuclei. Operators that are odd under all half turns across the axis may mix A1 with A2, as in a molecule with only the threefold axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.connected import part_numbers
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.spins.blocks import Member, Plan, States, diagonalised
from rotor.quantum.spins.contraction import stacks_of
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.spins.pattern_tables import ROUND_OFF, coefficients_between
from rotor.quantum.spins.rotor import ALONE, Channel, Exist
from rotor.quantum.spins.three_spins import EVEN_E, ODD_E, STEP, Allowed
from rotor.quantum.wang.basis import Part, WangBlock
from rotor.quantum.wang.j_operators import phase
from rotor.tops.operators import axis_order

_ZERO = 1e-12  # smaller elements, relative to the largest, are round-off of sums that cancel
_OF_THE_AXIS = 1e-9  # limit of elements that break the threefold axis, relative to the largest; round-off is smaller


class Row(NamedTuple):
    """Place and labels of a Wang function: number of the solved block, place in it, v, N, K and sign s."""

    block: int
    place: int
    v: int
    n: int
    k: int
    sign: int


@dataclass(frozen=True)
class Functions:
    """The allowed functions of one F, each a sum of two products of a Wang function and a pattern.

    wang, pattern, factor: (n,) row of the Wang function, row of the pattern and factor (the second may be 0) for the first and the second
    product. sub_block: sub-block that labels each function. names, sizes: of all sub-blocks, see `parts.names_of_parts`.
    """

    wang: tuple[Ints, Ints]
    pattern: tuple[Ints, Ints]
    factor: tuple[Floats, Floats]
    sub_block: Ints
    names: Ints
    sizes: Ints


def in_wang_functions(plan: Plan) -> Plan:
    """The plan over Wang functions, since the threefold axis needs K; the rotational Hamiltonian becomes an operator.

    Raises ValueError for a rotation without a threefold axis.
    """
    blocks = []
    vectors = [block.vectors for block in plan.blocks]
    turned = {
        (i, k): [(vectors[i] @ x @ vectors[k].T, channels) for x, channels in operators]
        for (i, k), operators in plan.operators.items()
    }
    for number, block in enumerate(plan.blocks):
        hamiltonian = (block.vectors * block.energies_mhz) @ block.vectors.T
        _check_axis(block, hamiltonian)
        turned.setdefault((number, number), []).append((hamiltonian, [ALONE]))
        blocks.append(SolvedBlock(block.parts, np.diag(hamiltonian).copy(), np.eye(len(hamiltonian))))
    return replace(plan, shared=replace(plan.shared, stacks=stacks_of(blocks)), blocks=blocks, replacement=turned)


def _check_axis(block: SolvedBlock, matrix: Floats) -> None:
    """Raise ValueError if the rotation connects K with K' other than ±K + 3n."""
    k = np.concatenate([_wang(part).k for part in block.parts])
    apart = ((k[:, None] - k) % 3 != 0) & ((k[:, None] + k) % 3 != 0)
    if np.abs(matrix[apart]).max(initial=0.0) > _OF_THE_AXIS * np.abs(matrix).max():
        raise ValueError(
            "three equivalent nuclei lie about a threefold axis, and the constants have none: expected a symmetric top about its a "
            "or c axis, such as B = C"
        )


def allowed_states(
    plan: Plan, patterns: Mapping[int, Ints], exist: Exist | None
) -> tuple[list[Member], Iterator[States]]:
    """The blocks of all F over allowed functions in which a level exists, and their states."""
    members, matrices = list[Member](), list[Floats]()
    for f, patterns_of_f in patterns.items():
        parts = _parts(plan, patterns_of_f)
        rows = _rows(parts)
        functions = _functions(plan, patterns_of_f, parts, rows)
        if not len(functions.sub_block):
            continue
        matrix = _matrix(plan, patterns_of_f, parts, rows, functions)
        for chosen in _connected(matrix, functions.sub_block):
            names, sizes = _names(functions, chosen)
            if exist is None or exist(names).any():
                used, products = _in_products(parts, rows, functions, chosen)
                sub_block = np.unique(functions.sub_block[chosen], return_inverse=True)[1]
                members.append(Member(f, used, names, sizes, Allowed(products, sub_block, names, sizes)))
                matrices.append(matrix[np.ix_(chosen, chosen)])
    solutions = (
        diagonalised([number], (matrix - matrix[0, 0] * np.eye(len(matrix)))[None], matrix[:1, 0])
        for number, matrix in enumerate(matrices)
    )
    return members, solutions


def _parts(plan: Plan, patterns: Ints) -> list[SpinPart]:
    """All solved blocks whose N couples to the F, each with all patterns of its N."""
    parts, start = [], 0
    for number, block in enumerate(plan.blocks):
        pattern_rows = np.flatnonzero(patterns[:, 0] == 2 * block.j)
        if len(pattern_rows):
            stop = start + len(pattern_rows) * len(block.energies_mhz)
            parts.append(
                SpinPart(number, block, slice(int(pattern_rows[0]), int(pattern_rows[-1]) + 1), slice(start, stop))
            )
            start = stop
    return parts


def _rows(parts: list[SpinPart]) -> list[Row]:
    """All Wang functions of the parts, part by part."""
    out = []
    for place, part in enumerate(parts):
        for wang_part in part.rotor.parts:
            basis = _wang(wang_part)
            for at, k in enumerate(basis.k.tolist(), wang_part.place.start):
                out.append(Row(place, at, wang_part.v, basis.j, k, basis.sign))
    return out


def _wang(part: Part) -> WangBlock:
    """The Wang functions of a part; ValueError for a linear molecule."""
    if not isinstance(part.basis, WangBlock):
        raise ValueError("three equivalent nuclei need functions with K and a sign; a linear molecule has none")
    return part.basis


def _functions(plan: Plan, patterns: Ints, parts: list[SpinPart], rows: list[Row]) -> Functions:
    """The allowed functions of one F."""
    partner = {(row.v, row.n, row.k, row.sign): place for place, row in enumerate(rows)}
    row_of = {tuple(pattern): place for place, pattern in enumerate(patterns.tolist())}
    columns: list[tuple[int, int, float, int, int, float, int]] = []
    names: list[Ints] = []
    sizes: list[int] = []
    start = 0
    for part in parts:
        for wang_part in part.rotor.parts:
            basis, along = _wang(wang_part), wang_part.names[:, _along(plan)]
            orientation = 1.0 if phase(basis) == 1.0 else -1.0
            for p in range(part.patterns.start, part.patterns.stop):
                kind = int(patterns[p, -3]) % STEP
                if kind == ODD_E:
                    continue
                for residue in (1, 2) if kind == EVEN_E else (0,):
                    chosen = np.flatnonzero(basis.k % 3 == residue)
                    for at in (chosen + start).tolist():
                        if not residue:
                            columns.append((at, p, 1.0, at, p, 0.0, len(sizes)))
                            continue
                        row, other = rows[at], patterns[p].copy()
                        other[-3] += ODD_E - EVEN_E
                        o = orientation if residue == 1 else -orientation
                        second = partner[row.v, row.n, row.k, -row.sign]
                        columns.append((at, p, sqrt(0.5), second, row_of[tuple(other)], o * sqrt(0.5), len(sizes)))
                    names.append(_names_of_sub_block(wang_part, along % 3 == residue, patterns[p], residue))
                    sizes.append(len(chosen))
            start += basis.size
    table = np.array(columns, dtype=float).reshape(-1, 7)
    places = [table[:, column].astype(np.int64) for column in (0, 3, 1, 4, 6)]
    factors = table[:, 2], table[:, 5]
    return Functions(
        (places[0], places[1]), (places[2], places[3]), factors, places[4], np.concatenate(names), np.array(sizes)
    )


def _along(plan: Plan) -> int:
    """Column of K among v, Ka and Kc: 1 or 2."""
    axis = axis_order(plan.shared.representation)[2]
    if axis == "b":
        raise ValueError(
            f"representation {plan.shared.representation}: the threefold axis is a or c, the z of the basis"
        )
    return 1 if axis == "a" else 2


def _names_of_sub_block(part: Part, chosen: Ints, pattern: Ints, residue: int) -> Ints:
    """v, Ka, Kc and the pattern; in labels x stands for E with K = 3n + 2, y for E with K = 3n + 1."""
    names = part.names[np.asarray(chosen, dtype=bool)]
    named = pattern.copy()
    if residue == 1:
        named[-3] += ODD_E - EVEN_E
    return np.column_stack([names, np.tile(named, (len(names), 1))])


def _matrix(plan: Plan, patterns: Ints, parts: list[SpinPart], rows: list[Row], functions: Functions) -> Floats:
    """The Hamiltonian over allowed functions, Σ_channels c(p', p) X(r', r)."""
    total = np.zeros((len(functions.sub_block), len(functions.sub_block)))
    by_channel: dict[Channel, list[tuple[int, int, Floats]]] = {}
    for i, up in enumerate(parts):
        for k, low in enumerate(parts):
            for element, channels in plan.operators.get((up.number, low.number), ()):
                for channel in channels:
                    by_channel.setdefault(channel, []).append((i, k, element))
    starts = np.cumsum([0, *(len(part.rotor.energies_mhz) for part in parts)])
    for channel, elements in by_channel.items():
        rotor = np.zeros((len(rows), len(rows)))
        for i, k, element in elements:
            rotor[starts[i] : starts[i + 1], starts[k] : starts[k + 1]] += element
            if i != k:  # c(p', p) = (-1)^(N'-N) c(p, p'), and the product is symmetric
                turned = (-1.0) ** (parts[i].rotor.j - parts[k].rotor.j) * element.T
                rotor[starts[k] : starts[k + 1], starts[i] : starts[i + 1]] += turned
        coupling = _coupling(plan, channel, patterns)
        for r, p, c in zip(functions.wang, functions.pattern, functions.factor, strict=True):
            for s, q, d in zip(functions.wang, functions.pattern, functions.factor, strict=True):
                total += np.outer(c, d) * coupling[np.ix_(p, q)] * rotor[np.ix_(r, s)]
    return (total + total.T) / 2


def _coupling(plan: Plan, channel: Channel, patterns: Ints) -> Floats:
    """The coefficients of a channel without round-off, which times rotational energies would connect states of different symmetry."""
    if channel == ALONE:
        return np.eye(len(patterns))
    values = coefficients_between(plan.shared.scheme, channel, patterns, patterns)
    return np.where(np.abs(values) > ROUND_OFF, values, 0.0)


def _connected(matrix: Floats, sub_block: Ints) -> list[Ints]:
    """The functions of each connected part of the matrix; sub-blocks are not divided."""
    scale = float(np.abs(matrix - np.diag(np.diag(matrix))).max(initial=0.0))
    i, k = np.nonzero(np.abs(matrix) > _ZERO * scale)
    count = int(sub_block.max()) + 1
    part_of_function = part_numbers(count, sub_block[i], sub_block[k])[sub_block]
    return [np.flatnonzero(part_of_function == part) for part in np.unique(part_of_function)]


def _names(functions: Functions, members: Ints) -> tuple[Ints, Ints]:
    """Labels of the sub-blocks of these functions, and number of levels of each."""
    subs = np.unique(functions.sub_block[members])
    stops = np.cumsum(functions.sizes)
    names = [functions.names[stops[sub] - functions.sizes[sub] : stops[sub]] for sub in subs]
    return np.concatenate(names), functions.sizes[subs]


def _in_products(
    parts: list[SpinPart], rows: list[Row], functions: Functions, members: Ints
) -> tuple[tuple[SpinPart, ...], Floats]:
    """The parts that these functions contain, and the functions in columns over products of rotational state and pattern."""
    table = np.array([(row.block, row.place) for row in rows])
    halves = [(table[r[members]], p[members], c[members]) for r, p, c in _halves(functions)]
    used = np.unique(np.concatenate([place[c != 0.0, 0] for place, _, c in halves]))
    out, start = [], 0
    base = np.zeros((len(parts), 3), dtype=np.int64)  # start, first pattern, size of the solved block
    for i in used.tolist():
        part, size = parts[i], parts[i].place.stop - parts[i].place.start
        out.append(part._replace(place=slice(start, start + size)))
        base[i] = start, part.patterns.start, len(part.rotor.energies_mhz)
        start += size
    products = np.zeros((start, len(members)))
    for place, p, c in halves:
        chosen = np.flatnonzero(c)
        at = base[place[chosen, 0]]
        products[at[:, 0] + (p[chosen] - at[:, 1]) * at[:, 2] + place[chosen, 1], chosen] = c[chosen]
    return tuple(out), products


def _halves(functions: Functions) -> list[tuple[Ints, Ints, Floats]]:
    """Rows of the Wang function and of the pattern, and factors, for the first and the second product."""
    return list(zip(functions.wang, functions.pattern, functions.factor, strict=True))
