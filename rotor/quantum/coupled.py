"""Levels whose Wang blocks are connected: several states, and operators outside orthorhombic symmetry.

Of each J the Wang blocks of all states are the vertices of a graph, whose edges are the operators that connect two of them;
every connected part is one matrix, real in functions with the factors of `j_operators.phase`, and is solved whole. A
level is named after the function of one state and one Wang block, solved by itself, that it overlaps with; names are given one to
one, so that the sum of all these overlaps is largest.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.effect import k_limits_of
from rotor.quantum.levels import Levels, weights_of_levels
from rotor.quantum.one_to_one import one_to_one
from rotor.quantum.states import Coupling, State
from rotor.quantum.wang.basis import WangBlock, limited, names_of, wang_blocks
from rotor.quantum.wang.j_operators import JOperator, between_blocks
from rotor.quantum.wang.wang_matrix import JMatrix, block_bands, scalar_energy
from rotor.tops.operators import Operators

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

NOTHING = 1e-13  # of an operator's largest element: what is smaller between two blocks is round-off of zero


class Part(NamedTuple):
    """The functions of one state v and one Wang block, at `start` ... in a coupled block."""

    v: int
    basis: WangBlock
    start: int

    @property
    def place(self) -> slice:
        """Where the functions stand in the block."""
        return slice(self.start, self.start + self.basis.size)


@dataclass(frozen=True)
class CoupledBlock:
    """Wang blocks of one J solved together: energies (n,) in MHz, rising, eigenvectors (n, n) in columns over the parts.

    labels: (n, 3) v, Ka, Kc of every state. mixing: (n,) its overlap, squared, with the function that names it. Functions
    carry the factor of `j_operators.phase`. start: row of the first state.
    """

    j: int
    parts: tuple[Part, ...]
    energies_mhz: Floats
    vectors: Floats
    labels: Ints
    mixing: Floats
    start: int = 0


@dataclass(frozen=True)
class Model:
    """What a coupled calculation consists of: operators of every state by v, couplings with their values in MHz, and the representation."""

    states: dict[int, Operators]
    couplings: tuple[tuple[float, Coupling], ...]
    representation: str
    limits: dict[int, tuple[int, int]] = field(default_factory=dict)


def model_of(top: Top, effects: tuple[QuantumEffect, ...], operators: Operators, representation: str) -> Model:
    """The states and couplings that the effects bring, beside the operators of the top's own state.

    Parameters
    ----------
    top : Top
        Gives the values of the parameters.
    effects : tuple of QuantumEffect
        What the Hamiltonian consists of.
    operators : Operators
        Coefficients in MHz of the top's own state v = 0, by powers (p, q, n).
    representation : str
        Which principal axes are x, y, z: "Ir", "IIIl", ...

    Returns
    -------
    Model
        Operators by state, couplings with their values in MHz, and limits of K.

    Raises
    ------
    ValueError
        For a coupling to a state that no effect defines, and for two effects that define the same state.
    """
    states, couplings = {0: operators}, []
    for effect in effects:
        values = effect.parameters(top)
        couplings += [(values[coupling.name], coupling) for coupling in effect.couplings(top)]
        couplings += [
            (value, _own_coupling(top, effect, name))
            for name, value in values.items()
            if effect.j_operator(top, name, 1, representation) is not None
        ]
        states |= {state.v: state.operators(values) for state in effect.states(top)}
    extra_states(top, effects)
    for _, coupling in couplings:
        for v in (coupling.bra, coupling.ket):
            if v not in states:
                raise ValueError(f"coupling {coupling.name}: state {v} is not defined; known are {sorted(states)}")
    return Model(states, tuple(couplings), representation, k_limits_of(top, effects))


def _own_coupling(top: Top, effect: QuantumEffect, name: str) -> Coupling:
    def operator(j: int, representation: str) -> JOperator:
        found = effect.j_operator(top, name, j, representation)
        assert found is not None
        return found

    return Coupling(name, 0, 0, operator)


def extra_states(top: Top, effects: tuple[QuantumEffect, ...]) -> list[State]:
    """The states that effects bring; ValueError where two have one number."""
    found = [state for effect in effects for state in effect.states(top)]
    numbers = [0, *(state.v for state in found)]
    if len(set(numbers)) < len(numbers):
        raise ValueError(f"states {numbers}: every state has a number v of its own, and 0 is the top's")
    return found


def coupled_levels(
    top: Top, effects: tuple[QuantumEffect, ...], model: Model, jmin: int, jmax: int, executor: Executor | None = None
) -> Levels:
    """All levels of a coupled calculation, by quantum numbers j, ka, kc and, of several states, v.

    Parameters
    ----------
    top : Top
        Kind, spin weights and constants.
    effects : tuple of QuantumEffect
        What the Hamiltonian consists of; the levels remember it.
    model : Model
        States and couplings, from `model_of`.
    jmin, jmax : int
        Lowest and highest rotational angular momentum.
    executor : Executor, optional
        J are spread over it.

    Returns
    -------
    Levels
        Energies in MHz with eigenvectors, labels and mixing: the squared overlap of each state with the function that
        names it.

    Raises
    ------
    ValueError
        For a Hamiltonian that overflows, a coupling that is not invariant under time reversal, and states that mix
        levels of different spin weight.
    """
    every_j = range(jmin, jmax + 1)
    pieces = [(model, j) for j in every_j]
    solved = (
        executor.map(solve_coupled, *zip(*pieces, strict=True)) if executor else (solve_coupled(*p) for p in pieces)
    )
    blocks = tuple(_placed(block for of_one_j in solved for block in of_one_j))

    labels = np.concatenate([block.labels for block in blocks])
    quanta = {"v": labels[:, 0]} if len(model.states) > 1 else {}
    j = np.repeat([block.j for block in blocks], [len(block.energies_mhz) for block in blocks])
    levels = Levels(
        kind=top.kind,
        representation=model.representation,
        jmax=jmax,
        energy_mhz=np.concatenate([block.energies_mhz for block in blocks]),
        quanta=quanta | {"j": j, "ka": labels[:, 1], "kc": labels[:, 2]},
        multiplicity=2 * j + 1,
        components=np.ones_like(j),
        weight=np.ones_like(j),
        effects=effects,
        blocks=blocks,
        mixing=np.concatenate([block.mixing for block in blocks]),
    )
    weighted = replace(levels, weight=_weights(top, effects, levels))
    _refuse_mixed_weights(weighted)
    return weighted


def _weights(top: Top, effects: tuple[QuantumEffect, ...], levels: Levels) -> Ints:
    weight = weights_of_levels(levels, top.spin_weights)
    for state in extra_states(top, effects):
        if state.spin_weights is not None:
            weight = np.where(levels.quanta["v"] == state.v, weights_of_levels(levels, state.spin_weights), weight)
    return weight


def _refuse_mixed_weights(levels: Levels) -> None:
    """States of one block have one symmetry, so that their nuclear-spin weights are one number.

    The functions of a Wang block of a symmetric top differ in K, and where nothing connects it to another they do not mix.
    """
    for block in levels.blocks:
        if len(block.parts) == 1 and levels.kind in ("prolate", "oblate"):
            continue
        found = levels.weight[block.start : block.start + len(block.energies_mhz)]
        if len(found) and (found != found[0]).any():
            row = block.start + int(np.argmax(found != found[0]))
            raise ValueError(
                f"an effect mixes levels of nuclear-spin weights {found[0]} and {levels.weight[row]} "
                f"({', '.join(levels.quanta)} = {levels.labels(np.array([block.start]))[0].strip()} and "
                f"{levels.labels(np.array([row]))[0].strip()}): symmetry forbids that; check the effect or the spin weights"
            )


def _placed(solved: Iterator[CoupledBlock]) -> Iterator[CoupledBlock]:
    start = 0
    for block in solved:
        yield replace(block, start=start)
        start += len(block.energies_mhz)


def solve_coupled(model: Model, j: int) -> list[CoupledBlock]:
    """The coupled blocks of one J."""
    vertices = [(v, basis) for v in sorted(model.states) for basis in blocks_of_state(model, v, j)]
    edges = _edges(model, vertices, j)
    diagonal = {v: JMatrix(operators, j) for v, operators in model.states.items()}
    scalars = {v: scalar_energy(operators, j) for v, operators in model.states.items()}
    zero = scalars[0]  # taken out of the matrices for the sake of digits
    out = []
    for members in connected_parts(len(vertices), edges):
        parts = parts_of([vertices[i] for i in members])
        matrix = np.zeros((parts[-1].place.stop,) * 2)
        for part in parts:
            matrix[part.place, part.place] = _dense(block_bands(diagonal[part.v], part.basis))
            matrix[part.place, part.place] += (scalars[part.v] - zero) * np.eye(part.basis.size)
        for a, i in enumerate(members):
            for b, k in enumerate(members):
                if (i, k) in edges:
                    matrix[parts[a].place, parts[b].place] += edges[i, k]
        out.append(_solved(j, parts, matrix, zero, model.representation))
    return out


def blocks_of_state(model: Model, v: int, j: int) -> list[WangBlock]:
    whole = wang_blocks(j, model.representation)
    return [part for b in whole if (part := limited(b, *model.limits[v]))] if v in model.limits else whole


def _edges(model: Model, vertices: list[tuple[int, WangBlock]], j: int) -> dict[tuple[int, int], Floats]:
    """What connects two vertices, both ways round, and a vertex with itself; nothing for what round-off alone leaves."""
    found: dict[tuple[int, int], Floats] = {}
    of_state = {v: [i for i, (own, _) in enumerate(vertices) if own == v] for v in model.states}
    for (bra, ket), couplings in _by_states(model.couplings).items():
        operators = [value * coupling.operator(j, model.representation) for value, coupling in couplings]
        whole = operators[0]
        for operator in operators[1:]:
            whole = whole + operator
        largest = max((float(np.abs(band).max(initial=0.0)) for band in whole.bands.values()), default=0.0)
        if not largest:
            continue
        for i in of_state[bra]:
            for k in of_state[ket]:
                up, low = vertices[i][1], vertices[k][1]
                between = between_blocks(up, low, whole)
                if np.abs(between).max() <= NOTHING * largest:
                    continue
                if np.abs(between.imag).max() > NOTHING * largest:
                    _refuse_imaginary(couplings, operators, up, low, largest)
                _add(found, (i, k), between.real)
                if bra != ket:
                    _add(found, (k, i), between.real.T)
    return found


def _by_states(couplings: Iterable[tuple[float, Coupling]]) -> dict[tuple[int, int], list[tuple[float, Coupling]]]:
    """Couplings by the states that they connect."""
    found: dict[tuple[int, int], list[tuple[float, Coupling]]] = {}
    for value, coupling in couplings:
        found.setdefault((coupling.bra, coupling.ket), []).append((value, coupling))
    return found


def _add(found: dict[tuple[int, int], Floats], key: tuple[int, int], matrix: Floats) -> None:
    found[key] = found[key] + matrix if key in found else matrix


def _refuse_imaginary(
    couplings: list[tuple[float, Coupling]], operators: list[JOperator], up: WangBlock, low: WangBlock, largest: float
) -> None:
    """ValueError with the name of the coupling, of those between two states, that has an imaginary element."""
    for (_, coupling), operator in zip(couplings, operators, strict=True):
        if np.abs(between_blocks(up, low, operator).imag).max() > NOTHING * largest:
            raise ValueError(
                f"{coupling.name}: the operator is not invariant under time reversal; an odd power of J is Hermitian and allowed "
                "between two states only, with the factor i"
            )


def connected_parts(count: int, edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """The connected parts of the graph, each in rising order."""
    group = list(range(count))
    for i, k in edges:
        low, high = sorted((group[i], group[k]))
        group = [low if g == high else g for g in group]
    return [[i for i in range(count) if group[i] == g] for g in dict.fromkeys(group)]


def parts_of(members: Sequence[tuple[int, WangBlock]]) -> tuple[Part, ...]:
    starts = accumulate((basis.size for _, basis in members), initial=0)
    return tuple(Part(v, basis, start) for (v, basis), start in zip(members, starts, strict=False))


def _dense(bands: list[Floats]) -> Floats:
    matrix = np.diag(bands[0])
    for n, band in enumerate(bands[1:], 1):
        matrix += np.diag(band, n) + np.diag(band, -n)
    return np.asarray(matrix)


def _solved(j: int, parts: tuple[Part, ...], matrix: Floats, zero: float, representation: str) -> CoupledBlock:
    if not np.isfinite(matrix).all():
        raise ValueError("a block of the Hamiltonian overflows: J max is too high for these constants")
    energies, vectors = np.linalg.eigh(matrix)
    labels, mixing = names_of_states(parts, matrix, vectors, representation)
    return CoupledBlock(j, parts, energies + zero, vectors, labels, mixing)


def names_of_states(
    parts: tuple[Part, ...], matrix: Floats, vectors: Floats, representation: str
) -> tuple[Ints, Floats]:
    """Labels of the states of a coupled block, and their overlaps with the functions that name them.

    A function is a state of one part, solved by itself; names are given one to one so that the sum of the overlaps is
    largest.

    Parameters
    ----------
    parts : tuple of Part
        The state v and the Wang block of each range of functions.
    matrix : (n, n) array
        The Hamiltonian of the block, MHz.
    vectors : (n, n) array
        Its eigenvectors in columns.
    representation : str
        Which principal axes are x, y, z.

    Returns
    -------
    labels : (n, 3) array
        v, Ka, Kc of every state.
    overlaps : (n,) array
        Squared overlaps, from 0 to 1.
    """
    functions = [np.linalg.eigh(matrix[part.place, part.place]).eigenvectors.T @ vectors[part.place] for part in parts]
    overlaps = np.concatenate(functions) ** 2
    of_state = one_to_one(overlaps) if len(parts) > 1 else np.arange(vectors.shape[1])
    return names_of_functions(parts, representation)[of_state], overlaps[of_state, np.arange(vectors.shape[1])]


def names_of_functions(parts: tuple[Part, ...], representation: str) -> Ints:
    """v, Ka, Kc (n, 3) of the states of the parts, each solved by itself, one part behind the other."""
    names = np.empty((parts[-1].place.stop, 3), dtype=np.int64)
    for part in parts:
        names[part.place, 0] = part.v
        names[part.place, 1], names[part.place, 2] = names_of(part.basis, representation)
    return names
