"""Reduced elements of operators between solved states of any kind, computed at first use.

The states come from `solve_levels`: Wang blocks, interacting states, F blocks with spins, internal rotation with or without spins. Elements
of molecule-fixed tensors come from `rotor.quantum.reduced`. The magnetic moment is ½ Σ g_ij {Φ_i, N_j} of the rotation in each state, plus
g_I I of the spins.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.fields.operators import Contraction, FieldOperator, Key, Magnet
from rotor.quantum.levels import Connections, Levels, SolvedBlock
from rotor.quantum.moments import Moment
from rotor.quantum.reduced import connections, no_elements, pairs_where

Pair = tuple[int, int]  # numbers of blocks, the higher or equal F first


class ReducedElements:
    """Elements between the blocks of levels.

    Where functions are combined to real ones, operators of odd rank that are even under time reversal are stored without their factor i.
    """

    def __init__(self, levels: Levels) -> None:
        self.levels = levels
        self.blocks: tuple[SolvedBlock, ...] = levels.blocks
        quanta = levels.quanta
        self.states = tuple(np.unique(quanta["v"]).tolist()) if "v" in quanta else (0,)
        self._cache: dict[tuple[Key, Pair], NDArray[Any] | None] = {}
        self._pairs: dict[Key, list[Pair]] = {}
        self._acting: dict[Key, Connections] = {}

    @property
    def representation(self) -> str:
        """Representation of the functions."""
        return str(self.levels.representation)

    @cached_property
    def combined(self) -> list[bool]:
        """Whether the functions of each block are combined to real ones."""
        return [block.combined for block in self.blocks]

    @cached_property
    def paired(self) -> list[bool]:
        """Whether the states of each block represent their mirror images too: K and -K, σ and -σ."""
        return [block.paired for block in self.blocks]

    def connected(self, operator: FieldOperator) -> list[Pair]:
        """Pairs of blocks that an operator connects, each once."""
        if operator.key not in self._pairs:
            self._pairs[operator.key] = list(self._connected(operator))
        return self._pairs[operator.key]

    def _connected(self, operator: FieldOperator) -> Iterator[Pair]:
        """Pairs of blocks between which the operator has elements."""
        number = {block.start: i for i, block in enumerate(self.blocks)}

        def acts(up: SolvedBlock, low: SolvedBlock) -> bool:
            return self.between(operator, number[up.start], number[low.start]) is not None

        if isinstance(operator, Contraction) or self.blocks[0].spins is not None:
            pairs, _ = self._connections(operator)
        else:
            pairs = list(pairs_where(self.blocks, operator.rank, acts))
        for up, low in pairs:
            yield number[up.start], number[low.start]

    def _connections(self, operator: FieldOperator) -> Connections:
        """Pairs of blocks that an operator connects, and the function that returns the elements between them, computed once."""
        if operator.key not in self._acting:
            if isinstance(operator, Magnet):
                self._acting[operator.key] = _magnetic_connections(operator, self.states, self.blocks)
            else:
                tensors = operator.tensors(self.states, self.representation)
                self._acting[operator.key] = connections(self.blocks, tensors) if tensors else ([], no_elements)
        return self._acting[operator.key]

    def between(self, operator: FieldOperator, up: int, low: int) -> NDArray[Any] | None:
        """Elements (n_up, n_low) of a pair of blocks, F' ≥ F; None where all are 0."""
        key = operator.key, (up, low)
        if key not in self._cache:
            self._cache[key] = self._computed(operator, up, low)
        return self._cache[key]

    def _computed(self, operator: FieldOperator, up: int, low: int) -> NDArray[Any] | None:
        """Elements of a pair of blocks, computed anew."""
        first, second = self.blocks[up], self.blocks[low]
        if isinstance(operator, Magnet):
            if second.spins is None:
                moment = self._moment(operator, first, second)
                return moment if moment is not None and moment.any() else None
        elif first.moments is not None:
            return np.asarray(first.moments.reduced(first, second, operator.tensors(self.states, self.representation)))
        elements = self._connections(operator)[1](first, second)
        copies = 2 if first.axial_k else first.components
        return elements / np.sqrt(copies) if copies > 1 else elements  # that of one sign of K, or of one component

    def _moment(self, magnet: Magnet, up: SolvedBlock, low: SolvedBlock) -> Floats | None:
        """Elements of the magnetic moment; None where they are zero."""
        if up.moments is not None:
            _refuse_turning_group()
        if up.axial_k != low.axial_k or abs(up.twice_total - low.twice_total) > 2:
            return None
        return _rotational_moment(magnet.g, up, low, self.representation)


def _refuse_turning_group() -> NoReturn:
    """ValueError for internal rotation in a magnetic field."""
    raise ValueError(
        "internal rotation in a magnetic field is not computed: the turning group adds a moment along its axis, proportional to "
        "<p - rho·P>, which shifts E levels to first order and whose g value is not among the constants; leave its constants "
        "out for the moment of the rotation alone"
    )


def _matrix(g: Floats) -> Any:
    """A matrix as nested tuples."""
    return tuple(tuple(row) for row in g.tolist())


def _magnetic_connections(magnet: Magnet, states: Sequence[int], blocks: Sequence[SolvedBlock]) -> Connections:
    """`connections` of ½ Σ g_ij {Φ_i, N_j} and g_I I of each state, of levels with spins."""
    from rotor.quantum.spins.many_f_lines import connections_of
    from rotor.quantum.spins.moments import spin_moments

    shared = blocks[0].spins.shared
    if blocks[0].spins.rotor.moments is not None:
        _refuse_turning_group()
    scheme, g = shared.scheme, _matrix(magnet.g)
    nuclei = [(name, value / scheme.count_of((scheme.place(name),))) for name, value in magnet.nuclei.items()]
    moments = [Moment(1.0, (v, v), tensor=g) for v in states]
    moments += [Moment(value, (v, v), spin=name) for v in states for name, value in nuclei]
    return connections_of(blocks, spin_moments(shared, moments))


def _rotational_moment(g: Floats, up: SolvedBlock, low: SolvedBlock, representation: str) -> Floats | None:
    """Elements of ½ Σ g_ij {Φ_i, N_j} between solved blocks of the rotation."""
    from rotor.quantum.spins.operators import CosinesWithN

    rotor = CosinesWithN(_matrix(g))

    def between(left: Any, right: Any) -> Floats | None:
        return rotor.elements(left.basis, right.basis, representation) if left.v == right.v else None

    return up.elements(low, between)
