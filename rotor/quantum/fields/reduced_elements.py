"""Reduced elements of operators between solved states of any kind, computed at first use.

The states come from `solve_levels`: Wang blocks, interacting states, F blocks with spins, internal rotation with or without spins. Elements
of molecule-fixed tensors come from `rotor.quantum.reduced`. The magnetic moment is ½ Σ g_ij {Φ_i, N_j} of the rotation in each state, plus
g_I I of the spins.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.fields.operators import Contraction, FieldOperator, Key, Magnet
from rotor.quantum.levels import Levels, MomentBlock, SolvedBlock
from rotor.quantum.moments import Moment
from rotor.quantum.reduced import AnyBlock, amplitudes, connected_pairs, pairs_where, wang_amplitudes
from rotor.quantum.tensors import Tensors

if TYPE_CHECKING:
    from rotor.quantum.spins.blocks import Shared
    from rotor.quantum.spins.moments import SpinMoments

Pair = tuple[int, int]  # numbers of blocks, the higher or equal F first


class ReducedElements:
    """Elements between the blocks of levels.

    Where functions are combined to real ones, operators of odd rank that are even under time reversal are stored without their factor i.
    """

    def __init__(self, levels: Levels) -> None:
        self.levels = levels
        self.blocks: tuple[AnyBlock, ...] = levels.blocks
        quanta = levels.quanta
        self.states = tuple(np.unique(quanta["v"]).tolist()) if "v" in quanta else (0,)
        self._cache: dict[tuple[Key, Pair], NDArray[Any] | None] = {}
        self._pairs: dict[Key, list[Pair]] = {}
        self._tensors: dict[Key, Tensors] = {}
        self._moments: dict[Key, SpinMoments] = {}

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

        def acts(up: AnyBlock, low: AnyBlock) -> bool:
            return self.between(operator, number[up.start], number[low.start]) is not None

        if isinstance(operator, Contraction):
            tensors = self._tensors_of(operator)
            pairs = connected_pairs(self.blocks, tensors) if tensors else iter(())
        else:
            pairs = pairs_where(self.blocks, operator.rank, acts)
        for up, low in pairs:
            yield number[up.start], number[low.start]

    def _tensors_of(self, operator: Contraction) -> Tensors:
        """Spherical tensors of a contraction, computed once."""
        if operator.key not in self._tensors:
            self._tensors[operator.key] = operator.tensors(self.states, self.representation)
        return self._tensors[operator.key]

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
            moment = self._moment(operator, first, second)
            return moment if moment is not None and moment.any() else None
        tensors = self._tensors_of(operator)
        if first.alone:
            return wang_amplitudes(first, second, tensors[0, 0])
        if isinstance(first, MomentBlock):
            return first.moments.reduced(first, second, tensors)
        elements = amplitudes(first, second, tensors)
        return elements / np.sqrt(2.0) if self.paired[up] else elements  # that of one sign of K

    def _moment(self, magnet: Magnet, up: AnyBlock, low: AnyBlock) -> Floats | None:
        """Elements of the magnetic moment; None where they are zero."""
        if isinstance(up, MomentBlock):
            raise ValueError(
                "internal rotation in a magnetic field is not computed: the turning group adds a moment along its axis, proportional to "
                "<p - rho·P>, which shifts E levels to first order and whose g value is not among the constants; leave its constants "
                "out for the moment of the rotation alone"
            )
        if up.axial_k != low.axial_k or abs(up.twice_total - low.twice_total) > 2:
            return None
        if isinstance(up, SolvedBlock):
            return _rotational_moment(magnet.g, up, low, self.representation)
        if magnet.key not in self._moments:
            self._moments[magnet.key] = _spin_moments(magnet, self.states, low.shared)
        moment: Floats = self._moments[magnet.key].amplitudes(up, low)
        return moment / np.sqrt(2.0) if up.paired else moment  # that of one sign of K


def _matrix(g: Floats) -> Any:
    """A matrix as nested tuples."""
    return tuple(tuple(row) for row in g.tolist())


def _spin_moments(magnet: Magnet, states: Sequence[int], shared: Shared) -> SpinMoments:
    """½ Σ g_ij {Φ_i, N_j} and g_I I for each state."""
    from rotor.quantum.spins.moments import SpinMoments

    scheme, g = shared.scheme, _matrix(magnet.g)
    nuclei = [(name, value / scheme.count_of((scheme.place(name),))) for name, value in magnet.nuclei.items()]
    moments = [Moment(1.0, (v, v), tensor=g) for v in states]
    moments += [Moment(value, (v, v), spin=name) for v in states for name, value in nuclei]
    return SpinMoments(tuple(moments), scheme, shared.representation)


def _rotational_moment(g: Floats, up: SolvedBlock, low: SolvedBlock, representation: str) -> Floats | None:
    """Elements of ½ Σ g_ij {Φ_i, N_j} between solved blocks of the rotation."""
    from rotor.quantum.spins.operators import CosinesWithN

    rotor = CosinesWithN(_matrix(g))

    def between(left: Any, right: Any) -> Floats | None:
        return rotor.elements(left.basis, right.basis, representation) if left.v == right.v else None

    return up.elements(low, between)
