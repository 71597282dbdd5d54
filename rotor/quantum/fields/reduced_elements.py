"""Reduced elements of operators between solved states of any kind, computed at first use.

The states come from `solve_levels`: Wang blocks, interacting states, F blocks with spins, internal rotation with or without spins. Elements
of molecule-fixed tensors come from `blocks.reduced`. The magnetic moment is ½ Σ g_ij {Φ_i, N_j} of the rotation in each state, plus
g_I I of the spins.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.quantum.blocks.reduced import connections, no_elements
from rotor.quantum.effect import Moment
from rotor.quantum.fields.blocks import Contraction, FieldOperator, Key, Magnet
from rotor.quantum.levels import Connections, Levels

Pair = tuple[int, int]  # numbers of blocks, the higher or equal F first


class ReducedElements:
    """Elements between the blocks of levels.

    Where functions are combined to real ones, operators of odd rank that are even under time reversal are stored without their factor i.
    """

    def __init__(self, levels: Levels) -> None:
        self.levels, self.blocks, self.representation = levels, levels.blocks, str(levels.representation)
        quanta = levels.quanta
        self.states = tuple(np.unique(quanta["v"]).tolist()) if "v" in quanta else (0,)
        self._cache: dict[tuple[Key, Pair], NDArray[Any]] = {}
        self._acting: dict[Key, Connections] = {}

    def connected(self, operator: FieldOperator) -> list[Pair]:
        """Pairs of blocks that an operator connects, each once."""
        number = {block.start: i for i, block in enumerate(self.blocks)}
        return [(number[up.start], number[low.start]) for up, low in self._connections(operator)[0]]

    def _connections(self, operator: FieldOperator) -> Connections:
        """Pairs of blocks that an operator connects, and the function that returns the elements between them, computed once."""
        if operator.key not in self._acting:
            if isinstance(operator, Magnet):
                acting = self._magnetic_connections(operator)
            else:
                tensors = operator.tensors(self.states, self.representation)
                acting = connections(self.blocks, tensors) if tensors else ([], no_elements)
            self._acting[operator.key] = acting
        return self._acting[operator.key]

    def between(self, operator: FieldOperator, first: int, second: int) -> NDArray[Any]:
        """Elements (n_up, n_low) of a connected pair of blocks, F' ≥ F."""
        key = operator.key, (first, second)
        if key in self._cache:
            return self._cache[key]
        up, low = self.blocks[first], self.blocks[second]
        if up.moments is not None and isinstance(operator, Contraction):
            elements = up.moments.reduced(up, low, operator.tensors(self.states, self.representation))
        else:  # those of one sign of K, or of one component
            copies = 2 if up.axial_k else up.components
            elements = self._connections(operator)[1](up, low) / np.sqrt(copies)
        self._cache[key] = np.asarray(elements)
        return self._cache[key]

    def _magnetic_connections(self, magnet: Magnet) -> Connections:
        """`connections` of ½ Σ g_ij {Φ_i, N_j} in each state, and of g_I I of the spins."""
        from rotor.quantum.spins.contraction import operators_of_stacks, stacks_of
        from rotor.quantum.spins.many_f_lines import connections_of, connections_of_stacks, spin_moments
        from rotor.quantum.spins.rotor import Piece
        from rotor.quantum.spins.scheme import EVERY_STATE, CosinesWithN, Scalar

        first = self.blocks[0]
        if first.moments is not None or (first.spins is not None and first.spins.rotor.moments is not None):
            raise ValueError(
                "internal rotation in a magnetic field is not computed: the turning group adds a moment along its axis, proportional "
                "to <p - rho·P>, which shifts E levels to first order and whose g value is not among the constants; leave its "
                "constants out for the moment of the rotation alone"
            )
        g: Any = tuple(map(tuple, magnet.g.tolist()))
        rotation, states = CosinesWithN(g), (EVERY_STATE, EVERY_STATE)
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
