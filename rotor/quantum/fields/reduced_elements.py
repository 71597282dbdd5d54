"""Reduced elements of operators between solved states of any kind, computed at first use.

The states come from `solve_levels`: Wang blocks, interacting states, F blocks with spins, internal rotation with or without spins. Elements
of molecule-fixed tensors come from `rotor.quantum.reduced`. The magnetic moment is ½ Σ g_ij {Φ_i, N_j} of the rotation in each state, plus
g_I I of the spins.
"""

from __future__ import annotations

from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rotor.quantum.effect import Moment
from rotor.quantum.fields.blocks import Contraction, FieldOperator, Key, Magnet
from rotor.quantum.levels import Connections, Levels, SolvedBlock
from rotor.quantum.reduced import connections, no_elements

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
        self._cache: dict[tuple[Key, Pair], NDArray[Any]] = {}
        self._acting: dict[Key, Connections] = {}

    @property
    def representation(self) -> str:
        """Representation of the functions."""
        return str(self.levels.representation)

    def connected(self, operator: FieldOperator) -> list[Pair]:
        """Pairs of blocks that an operator connects, each once."""
        number = {block.start: i for i, block in enumerate(self.blocks)}
        return [(number[up.start], number[low.start]) for up, low in self._connections(operator)[0]]

    def _connections(self, operator: FieldOperator) -> Connections:
        """Pairs of blocks that an operator connects, and the function that returns the elements between them, computed once."""
        if operator.key not in self._acting:
            if isinstance(operator, Magnet):
                self._acting[operator.key] = self._magnetic_connections(operator)
            else:
                tensors = operator.tensors(self.states, self.representation)
                self._acting[operator.key] = connections(self.blocks, tensors) if tensors else ([], no_elements)
        return self._acting[operator.key]

    def between(self, operator: FieldOperator, up: int, low: int) -> NDArray[Any]:
        """Elements (n_up, n_low) of a connected pair of blocks, F' ≥ F."""
        key = operator.key, (up, low)
        if key not in self._cache:
            self._cache[key] = self._computed(operator, self.blocks[up], self.blocks[low])
        return self._cache[key]

    def _computed(self, operator: FieldOperator, up: SolvedBlock, low: SolvedBlock) -> NDArray[Any]:
        """Elements of a pair of blocks, computed anew."""
        if up.moments is not None and isinstance(operator, Contraction):
            return np.asarray(up.moments.reduced(up, low, operator.tensors(self.states, self.representation)))
        elements = self._connections(operator)[1](up, low)
        copies = 2 if up.axial_k else up.components
        return elements / np.sqrt(copies) if copies > 1 else elements  # that of one sign of K, or of one component

    def _magnetic_connections(self, magnet: Magnet) -> Connections:
        """`connections` of ½ Σ g_ij {Φ_i, N_j} in each state, and of g_I I of the spins."""
        from rotor.quantum.spins.contraction import operators_of_stacks, stacks_of
        from rotor.quantum.spins.many_f_lines import connections_of, connections_of_stacks, spin_moments
        from rotor.quantum.spins.rotor import Piece
        from rotor.quantum.spins.scheme import EVERY_STATE, CosinesWithN, Scalar

        first = self.blocks[0]
        if first.moments is not None or (first.spins is not None and first.spins.rotor.moments is not None):
            _refuse_turning_group()
        rotation, states = CosinesWithN(_matrix(magnet.g)), (EVERY_STATE, EVERY_STATE)
        if first.spins is None:
            piece = Piece(1.0, rotation, *states, 0, 0)
            (contracted,) = operators_of_stacks(stacks_of(self.blocks), 1, [[piece]], self.representation)
            return connections_of_stacks(self.blocks, contracted)
        scheme = first.spins.shared.scheme
        moments = [Moment(1.0, states, rotation, electric=False)]
        for name, value in magnet.nuclei.items():
            share = value / scheme.count_of((scheme.place(name),))
            moments.append(Moment(share, states, Scalar(), name, electric=False))
        return connections_of(self.blocks, spin_moments(first.spins.shared, moments))


def _refuse_turning_group() -> NoReturn:
    """ValueError for internal rotation in a magnetic field."""
    raise ValueError(
        "internal rotation in a magnetic field is not computed: the turning group adds a moment along its axis, proportional to "
        "<p - rho·P>, which shifts E levels to first order and whose g value is not among the constants; leave its constants "
        "out for the moment of the rotation alone"
    )


def _matrix(g: NDArray[Any]) -> Any:
    """A matrix as nested tuples."""
    return tuple(tuple(row) for row in g.tolist())
