"""The rotation as spins see it: solved blocks of N, and operators of N contracted to their eigenstates.

Terms that have the same spins, rank and power of N·S share every coefficient of coupling; they are one channel, whose
contracted matrices Σ_terms c ⟨r'‖X^K‖r⟩ between solved blocks are computed once for all F.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.coupled import CoupledBlock, Part
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins import Cosines, CosinesWithN, Rotor, Scheme, SpinTerm

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


class RotorBlock(NamedTuple):
    """States of one N solved together: energies (n,) in MHz, eigenvectors (n, n) in columns over the parts."""

    n: int
    parts: tuple[Part, ...]
    energies_mhz: Floats
    vectors: Floats


class Channel(NamedTuple):
    """Places of the spins that act, the rank, and the powers of N·S1 and, with it, of N²."""

    acting: tuple[int, ...]
    rank: int
    ns: int = 0
    n2: int = 0


@dataclass(frozen=True)
class Piece:
    """An operator of N between two states, with its powers of N² and Nz², times a value in MHz."""

    value: float
    rotor: Rotor
    bra: int
    ket: int
    n2: int
    nz2: int


Channels = dict[Channel, list[Piece]]
Contracted = dict[Channel, Floats]


def rotor_blocks(levels: Levels) -> list[RotorBlock]:
    """The solved blocks of a rotation."""
    return [_rotor_block(block) for block in levels.blocks]


def _rotor_block(block: SolvedBlock | CoupledBlock) -> RotorBlock:
    if isinstance(block, CoupledBlock):
        return RotorBlock(block.j, block.parts, block.energies_mhz, block.vectors)
    return RotorBlock(block.basis.j, (Part(0, block.basis, 0),), block.energies_mhz, block.vectors)


def valued_terms(top: Top, effects: Iterable[QuantumEffect]) -> list[tuple[float, SpinTerm]]:
    """Every spin term of the effects with the value of its parameter times its factor, zeros left out."""
    found = []
    for effect in effects:
        values = effect.parameters(top)
        found += [(values[term.name] * term.factor, term) for term in effect.spin_terms(top)]
    return [(value, term) for value, term in found if value]


def channels_of(terms: Iterable[tuple[float, SpinTerm]], scheme: Scheme) -> Channels:
    """Terms by channel; tensors that differ only in their components are added to one."""
    found: Channels = {}
    for value, term in terms:
        if term.ns and not scheme.spins:
            raise ValueError(f"{term.name}: N·S needs a spin")
        acting = tuple(sorted(scheme.place(name) for name in term.spins))
        channel = Channel(acting, term.rotor.rank, term.ns, term.n2 if term.ns else 0)
        n2 = 0 if term.ns else term.n2
        found.setdefault(channel, []).append(Piece(value, term.rotor, term.bra, term.ket, n2, term.nz2))
    return {channel: _added(pieces) for channel, pieces in found.items()}


def _added(pieces: list[Piece]) -> list[Piece]:
    groups: dict[tuple[object, ...], list[Piece]] = {}
    for piece in pieces:
        groups.setdefault((type(piece.rotor), piece.bra, piece.ket, piece.n2, piece.nz2), []).append(piece)
    out: list[Piece] = []
    for group in groups.values():
        first = group[0]
        if len(group) == 1 or not isinstance(first.rotor, Cosines | CosinesWithN):
            out += group
            continue
        total = sum(piece.value * np.array(piece.rotor.components) for piece in group)  # type: ignore[union-attr]
        rotor = type(first.rotor)(_nested(np.asarray(total)))
        out.append(Piece(1.0, rotor, first.bra, first.ket, first.n2, first.nz2))
    return out


def _nested(array: Floats) -> tuple:  # type: ignore[type-arg]
    return tuple(_nested(row) if row.ndim else float(row) for row in array)


def contracted(up: RotorBlock, low: RotorBlock, pieces: Sequence[Piece], representation: str) -> Floats | None:
    """Σ value ⟨r'‖X‖r⟩ between the states of two blocks, None where nothing acts.

    A piece between different states acts from its ket to its bra; the other way round it is the transposed element, which
    belongs to the other order of the two blocks.
    """
    total: Floats | None = None
    for piece in pieces:
        for left in up.parts:
            for right in low.parts:
                if (left.v, right.v) != (piece.bra, piece.ket):
                    continue
                found = piece.rotor.elements(left.basis, right.basis, representation)
                if found is None or not found.any():
                    continue
                scaled = _powers(piece, left, right) * found
                moved = up.vectors[left.place].T @ scaled @ low.vectors[right.place]
                total = moved if total is None else total + moved
    return total


def _powers(piece: Piece, left: Part, right: Part) -> Floats:
    """value ½(bra + ket) of N^2p, times ½(bra + ket) of Nz^2q."""
    m, n = left.basis.j, right.basis.j
    value = piece.value * ((m * (m + 1.0)) ** piece.n2 + (n * (n + 1.0)) ** piece.n2) / 2
    if not piece.nz2:
        return np.asarray(value)
    bra, ket = left.basis.k.astype(float) ** (2 * piece.nz2), right.basis.k.astype(float) ** (2 * piece.nz2)
    return np.asarray(value * (bra[:, None] + ket) / 2)


def rotor_label(block: RotorBlock) -> list[tuple[int, str]]:
    """State and species of every part."""
    return [(part.v, part.basis.species) for part in block.parts]
