"""Reduced elements of operators between solved states of any kind, made when first used.

Solved states are those of `solve_levels`: Wang blocks, connected states, F blocks with spins, internal rotation with or without spins.
Elements of tensors fixed in the molecule are those of `rotor.quantum.reduced`. The magnetic moment is ½ Σ g_ij {Φ_i, N_j} of the rotation
in every state, and g_I I of the spins.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.coupled import CoupledBlock, Part
from rotor.quantum.fields.operators import Contraction, FieldOperator, Key, Magnet
from rotor.quantum.levels import Levels, MomentBlock, SolvedBlock
from rotor.quantum.reduced import AnyBlock, amplitudes, connected_pairs, twice_total, wang_amplitudes
from rotor.quantum.tensors import Tensors

Pair = tuple[int, int]  # numbers of blocks, the higher or equal F first


class ReducedElements:
    """Elements between the blocks of levels.

    Those of odd rank that keep their sign under time reversal stand for i times themselves where functions are combined to real ones.
    """

    def __init__(self, levels: Levels) -> None:
        self.levels = levels
        self.blocks: tuple[AnyBlock, ...] = levels.blocks
        quanta = levels.quanta
        self.states = tuple(np.unique(quanta["v"]).tolist()) if "v" in quanta else (0,)
        self._known: dict[tuple[Key, Pair], NDArray[Any] | None] = {}
        self._pairs: dict[Key, list[Pair]] = {}
        self._tensors: dict[Key, Tensors] = {}

    @property
    def representation(self) -> str:
        """That of the functions."""
        return str(self.levels.representation)

    @cached_property
    def combined(self) -> list[bool]:
        """Whether the functions of each block are combined to real ones."""
        return [block.combined if isinstance(block, MomentBlock) else axial_k(block) is None for block in self.blocks]

    @cached_property
    def paired(self) -> list[bool]:
        """Whether the states of each block stand for their mirror images too: K and -K, σ and -σ."""
        return [
            block.components > 1 if isinstance(block, MomentBlock) else bool(axial_k(block)) for block in self.blocks
        ]

    def connected(self, operator: FieldOperator) -> list[Pair]:
        """Pairs of blocks that an operator connects, each once."""
        if operator.key not in self._pairs:
            self._pairs[operator.key] = list(self._connected(operator))
        return self._pairs[operator.key]

    def _connected(self, operator: FieldOperator) -> Iterator[Pair]:
        if isinstance(operator, Contraction):
            tensors = self._tensors_of(operator)
            number = {block.start: i for i, block in enumerate(self.blocks)}
            for up, low in connected_pairs(self.blocks, tensors) if tensors else ():
                yield number[up.start], number[low.start]
            return
        total = [twice_total(block) for block in self.blocks]
        for low, first in enumerate(total):
            for up, second in enumerate(total):
                near = second == first + 2 or (second == first and up >= low)
                if near and self.between(operator, up, low) is not None:
                    yield up, low

    def _tensors_of(self, operator: Contraction) -> Tensors:
        if operator.key not in self._tensors:
            self._tensors[operator.key] = operator.tensors(self.states, self.representation)
        return self._tensors[operator.key]

    def between(self, operator: FieldOperator, up: int, low: int) -> NDArray[Any] | None:
        """Elements (n_up, n_low) of a pair of blocks, F' ≥ F; None where all are 0."""
        key = operator.key, (up, low)
        if key not in self._known:
            self._known[key] = self._made(operator, up, low)
        return self._known[key]

    def _made(self, operator: FieldOperator, up: int, low: int) -> NDArray[Any] | None:
        first, second = self.blocks[up], self.blocks[low]
        if isinstance(operator, Magnet):
            moment = _moment(operator, first, second, self.representation)
            return moment if moment is not None and moment.any() else None
        tensors = self._tensors_of(operator)
        if isinstance(first, SolvedBlock):
            return wang_amplitudes(first, second, tensors[0, 0])
        if isinstance(first, MomentBlock):
            return first.reduced(second, tensors)
        elements = amplitudes(first, second, tensors)
        return elements / np.sqrt(2.0) if self.paired[up] else elements  # that of one sign of K


def axial_k(block: AnyBlock) -> int | None:
    """|K| of a block with spins where K is good, None where functions are those of Wang."""
    if isinstance(block, SolvedBlock | CoupledBlock | MomentBlock):
        return None
    basis = block.parts[0].rotor.parts[0].basis
    return getattr(basis, "axial_k", None)


def _moment(magnet: Magnet, up: AnyBlock, low: AnyBlock, representation: str) -> Floats | None:
    from rotor.quantum.spins.operators import CosinesWithN

    if isinstance(up, MomentBlock):
        raise ValueError("internal rotation in a magnetic field is not computed; leave its constants out")
    if axial_k(up) != axial_k(low):
        return None
    rotor = CosinesWithN(tuple(tuple(row) for row in magnet.g.tolist()))  # type: ignore[arg-type]
    if isinstance(up, SolvedBlock | CoupledBlock):
        return _of_rotation(rotor, up, low, representation)
    return _with_spins(magnet, rotor, up, low, representation)


def _of_rotation(rotor: Any, up: AnyBlock, low: AnyBlock, representation: str) -> Floats | None:
    """Elements of the rotation between solved blocks of it."""
    total: Floats | None = None
    for left in _parts(up):
        for right in _parts(low):
            found = rotor.elements(left.basis, right.basis, representation) if left.v == right.v else None
            if found is not None:
                moved = up.vectors[left.place].T @ found @ low.vectors[right.place]
                total = moved if total is None else total + moved
    return total


def _parts(block: AnyBlock) -> tuple[Any, ...]:
    return (Part(0, block.basis, 0),) if isinstance(block, SolvedBlock) else block.parts


def _with_spins(magnet: Magnet, rotor: Any, up: AnyBlock, low: AnyBlock, representation: str) -> Floats | None:
    from rotor.quantum.spins.blocks import product

    if abs(up.twice_f - low.twice_f) > 2:
        return None
    scheme = low.shared.scheme
    out = np.zeros((up.vectors.shape[0], low.vectors.shape[1]))
    acting = [(None, 1.0), *((scheme.place(name), value) for name, value in magnet.nuclei.items())]
    for place, value in acting:
        t = _coefficients(up, low, place)
        for target in up.parts:
            for source in low.parts:
                if place is None:
                    element = _of_rotation(rotor, target.rotor, source.rotor, representation)
                else:
                    element = np.eye(len(source.rotor.energies_mhz)) if target.number == source.number else None
                if element is not None:
                    factors = value * t[target.patterns, source.patterns]
                    out[target.place] += product(factors, element) @ low.vectors[source.place]
    return np.asarray(up.vectors.T @ out)


def _coefficients(up: AnyBlock, low: AnyBlock, place: int | None) -> Floats:
    """Of the rotation (None) or a spin between the patterns of two F."""
    from rotor.quantum.spins.coupling import moment_coefficients, patterns

    cache, scheme, key = low.shared.cache, low.shared.scheme, ("moment", place, up.twice_f, low.twice_f)
    if key not in cache:
        bra, ket = patterns(scheme.twice, up.twice_f), patterns(scheme.twice, low.twice_f)
        found = moment_coefficients(scheme.twice, 1 if place is None else 0, place, bra, ket)
        if scheme.equivalent:
            found = scheme.recoupling(up.twice_f)[1].T @ found @ scheme.recoupling(low.twice_f)[1]
        cache[key] = found
    coefficients: Floats = cache[key]
    return coefficients
