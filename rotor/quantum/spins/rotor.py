"""Solved blocks of the rotation to which spins are coupled, and channels of the spin terms.

Terms with the same spins, rank and power of N·S share all coupling coefficients. They form one channel, whose contracted matrices
Σ_terms c ⟨r'‖X^K‖r⟩ between solved blocks are computed once for all F.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import repeat
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.effect import couplings_of, k_limits_of
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.spins.scheme import EVERY_STATE, AxialState, Rotor, Scheme, SpinTerm, is_axial, scheme_of, summed
from rotor.quantum.tabulated import as_tabulated
from rotor.quantum.wang.basis import Part, WangBlock
from rotor.quantum.wang.coupled_levels import names_of_functions
from rotor.quantum.wang.rotation import hamiltonian, solve_rotation

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

Exist = Callable[[Ints], NDArray[np.bool_]]  # whether levels with these labels exist


class Channel(NamedTuple):
    """Places of the acting spins, the rank, and the powers of N·S1 and, with it, of N².

    exchange: for two equivalent spins, 1 is half the sum of the operator and its exchanged form, -1 half the difference; else 0.
    """

    acting: tuple[int, ...]
    rank: int
    ns: int = 0
    n2: int = 0
    exchange: int = 0


ALONE = Channel((), 0)
_OF_THE_AXIS = 1e-9  # limit of elements that break the threefold axis, relative to the largest; round-off is smaller


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
Terms = list[tuple[float, SpinTerm]]


def solved_rotor(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    terms: Terms,
    nmin: int,
    nmax: int,
    executor: Executor | None,
    exist: Exist | None = None,
) -> tuple[list[SolvedBlock], str]:
    """The solved blocks of the rotation from N = `nmin` to `nmax`, and the representation of their functions.

    A symmetric top whose terms are all axial has functions |N K⟩, one in each block; those for which `exist` is false are left out,
    unless it is false for all.
    """
    if top.kind in ("prolate", "oblate") and _all_axial(top, effects, terms):
        levels = as_tabulated(top, effects, solve_rotation(top, effects, nmin, nmax, False, executor))
        v, k = levels.quantum("v"), levels.quanta["k"]
        chosen = np.ones(len(levels), dtype=bool) if exist is None else _existing(v, k, exist, scheme_of(top, effects))
        blocks = _axial_blocks(v[chosen], levels.rotational[chosen], k[chosen], levels.energy_mhz[chosen])
        return blocks, "Ir" if top.kind == "prolate" else "IIIr"
    levels = as_tabulated(top, effects, solve_rotation(top, effects, nmin, nmax, True, executor, in_blocks=True))
    representation = str(levels.representation)
    if "ka" not in levels.quanta or not levels.blocks[0].alone:
        return [_named(b, names_of_functions(b.parts, representation)) for b in levels.blocks], representation
    # labels of states in order of energy, as labels of functions are
    names = np.column_stack([np.zeros(len(levels), dtype=np.int64), levels.quanta["ka"], levels.quanta["kc"]])
    return [_named(block, names[block.start :]) for block in levels.blocks], representation


def _all_axial(top: Top, effects: tuple[QuantumEffect, ...], terms: Terms) -> bool:
    """Whether all operators of a symmetric top leave K good."""
    axis = "a" if top.kind == "prolate" else "c"
    if k_limits_of(top, effects) or any(n for _, _, n in hamiltonian(top, effects)):
        return False
    scheme = scheme_of(top, effects)
    if scheme.equivalent == 3:  # total spin states of three nuclei need Wang functions
        return False
    channels = channels_of(terms, scheme)  # C_bb and C_cc are axial together where they are equal
    if not all(is_axial(piece.rotor, axis) for pieces in channels.values() for piece in pieces):
        return False
    return not couplings_of(top, effects, "Ir") and not (
        top.states is None and any(effect.states(top) for effect in effects)
    )


def _existing(v: Ints, k: Ints, exist: Exist, scheme: Scheme) -> NDArray[np.bool_]:
    """Which functions |N K⟩ exist by their v and K; all of them if none does."""
    labels = np.zeros((len(v), 4 + len(scheme.twice)), dtype=np.int64)
    labels[:, 0], labels[:, 1] = v, k
    existing = exist(labels)
    return existing if existing.any() else np.ones(len(v), dtype=bool)


def _axial_blocks(v: Ints, n: Ints, k: Ints, energies_mhz: Floats) -> list[SolvedBlock]:
    """A block of one function for each level; their arrays are views of shared ones."""
    names, vector = np.column_stack([v, k, np.zeros_like(k)]), np.ones((1, 1))
    functions = map(AxialState, n.tolist(), k.tolist())
    parts = map(Part, v.tolist(), functions, repeat(0), names[:, None])
    return [SolvedBlock((part,), energy, vector) for part, energy in zip(parts, energies_mhz[:, None], strict=True)]


def _named(block: SolvedBlock, names: Ints) -> SolvedBlock:
    """A solved block whose parts have the names (size, 3) of their functions."""
    parts = tuple(Part(part.v, part.basis, part.start, names[part.place]) for part in block.parts)
    return SolvedBlock(parts, block.energies_mhz, block.vectors)


def valued_terms(top: Top, effects: Iterable[QuantumEffect]) -> Terms:
    """Spin terms of the effects with values in MHz (parameter times factor), without zeros.

    Raises ValueError for a quadrupole coupling of a spin of 1/2.
    """
    weighted = []
    for effect in effects:
        values, twice = effect.parameters(top), {spin.name: spin.twice for spin in effect.spins(top)}
        for term in effect.spin_terms(top):
            if (
                values[term.name]
                and len(term.spins) == 2
                and term.spins[0] == term.spins[1]
                and twice[term.spins[0]] < 2
            ):
                raise ValueError(
                    f"parameter {term.name.partition('#')[0]}: spin {term.spins[0]} of 1/2 has no quadrupole moment; that needs a spin of "
                    "1 or more"
                )
            weighted.append((values[term.name] * term.factor, term))
    return [(value, term) for value, term in weighted if value]


def channels_of(terms: Terms, scheme: Scheme) -> Channels:
    """Pieces by channel; operators that differ only in their components are added to one."""
    groups: dict[tuple[Any, ...], list[tuple[float, Rotor]]] = {}
    for value, term in terms:
        acting = tuple(sorted(scheme.place(name) for name in term.spins))
        channel = Channel(acting, term.rotor.rank, term.ns, term.n2 if term.ns else 0)
        for part, sign in _by_exchange(channel, scheme):
            key = (part, term.bra, term.ket, 0 if term.ns else term.n2, term.nz2)
            groups.setdefault(key, []).append((sign * value, term.rotor))
    channels: Channels = {}
    for (channel, *where), members in groups.items():
        channels.setdefault(channel, []).extend(Piece(value, rotor, *where) for value, rotor in summed(members))
    return channels


def parameter_channels(
    top: Top, effects: Iterable[QuantumEffect], names: Sequence[str], scheme: Scheme
) -> list[Channels]:
    """Spin part of ∂H/∂c for each named parameter, by channel."""
    terms: dict[str, Terms] = {name: [] for name in names}
    for term in (term for effect in effects for term in effect.spin_terms(top)):
        if term.name in terms:
            terms[term.name].append((term.factor, term))
    return [channels_of(terms[name], scheme) for name in names]


def _by_exchange(channel: Channel, scheme: Scheme) -> list[tuple[Channel, float]]:
    """Parts of a channel that keep or change the symmetry of two equivalent spins, ½(A + B) ± ½(A - B); for three spins, see `scheme`."""
    if not scheme.equivalent:
        return [(channel, 1.0)]
    if channel.ns and len(scheme.spins) == scheme.equivalent:
        raise ValueError("powers of N·S1 are those of a spin that is coupled before the equivalent ones")
    b = len(scheme.spins) - 1
    if scheme.equivalent == 3:
        return [(_channel_of_three_spins(channel, b - 2), float(scheme.count_of(channel.acting)))]
    a = b - 1
    if set(channel.acting) >= {a, b} or not set(channel.acting) & {a, b}:
        return [(channel._replace(exchange=1), 1.0)]
    first = channel._replace(acting=tuple(sorted(a if place == b else place for place in channel.acting)))
    return [(first._replace(exchange=1), 1.0), (first._replace(exchange=-1), -1.0 if b in channel.acting else 1.0)]


def _channel_of_three_spins(channel: Channel, first: int) -> Channel:
    """The channel of the first of three equivalent spins, or of the pair opposite to it: the second and the third."""
    among = tuple(place for place in channel.acting if place >= first)
    if set(among) <= {first}:
        return channel
    if among == (first, first + 1) and channel.acting == among:
        return channel._replace(acting=(first + 1, first + 2))
    raise ValueError(
        "terms of three equivalent spins name the first of them, or the first and the second: a turn by 120° gives the others"
    )


def acts(piece: Piece, left: int, right: int) -> bool:
    """Whether a piece acts from the state `right` to the state `left`."""
    return left == right if piece.bra == EVERY_STATE else (left, right) == (piece.bra, piece.ket)


def in_wang_functions(blocks: Sequence[SolvedBlock]) -> tuple[list[SolvedBlock], list[Floats]]:
    """Blocks of the rotation over Wang functions, since the threefold axis needs K, and their Hamiltonians without the diagonal.

    Raises ValueError for a rotation without a threefold axis.
    """
    functions, hamiltonians = list[SolvedBlock](), list[Floats]()
    for block in blocks:
        hamiltonian = (block.vectors * block.energies_mhz) @ block.vectors.T
        _check_axis(block, hamiltonian)
        functions.append(SolvedBlock(block.parts, np.diag(hamiltonian).copy(), np.eye(len(hamiltonian))))
        hamiltonians.append(hamiltonian - np.diag(np.diag(hamiltonian)))
    return functions, hamiltonians


def _check_axis(block: SolvedBlock, matrix: Floats) -> None:
    """Raise ValueError if the rotation connects K with K' other than ±K + 3n."""
    k = np.concatenate([wang_functions(part).k for part in block.parts])
    apart = ((k[:, None] - k) % 3 != 0) & ((k[:, None] + k) % 3 != 0)
    if np.abs(matrix[apart]).max(initial=0.0) > _OF_THE_AXIS * np.abs(matrix).max():
        raise ValueError(
            "three equivalent nuclei lie about a threefold axis, and the constants have none: expected a symmetric top about its a "
            "or c axis, such as B = C"
        )


def wang_functions(part: Part) -> WangBlock:
    """The Wang functions of a part; ValueError for a linear molecule."""
    if not isinstance(part.basis, WangBlock):
        raise ValueError("three equivalent nuclei need functions with K and a sign; a linear molecule has none")
    return part.basis
