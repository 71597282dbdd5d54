"""Lines of levels with spins by any moments (`rotor.quantum.moments`): their elements between blocks of F.

An electric moment does not act on spins. The magnetic moment of a spin S contains T^0 or T² of the rotation in place of a vector; with L
the rank,

    ⟨p'‖[T^L x S]^1‖p⟩ = m(p', p) ⟨N'‖T^L‖N⟩,     Σ_q T²_pq S_q = -√(5/3) [T² x S]^1_p

(A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 7.1.5; the factor as in `coupling`).
"""

from __future__ import annotations

from collections.abc import Sequence

from rotor.quantum.levels import Levels
from rotor.quantum.moments import Moment
from rotor.quantum.spins.blocks import Shared
from rotor.quantum.spins.contraction import pieces_in_both_orders
from rotor.quantum.spins.coupling import ChainOperator
from rotor.quantum.spins.many_f import Tables, tables_of
from rotor.quantum.spins.many_f_lines import Moments
from rotor.quantum.spins.operators import Cosines
from rotor.quantum.spins.rotor import Piece


def spin_moments(shared: Shared, moments: Sequence[Moment]) -> Moments:
    """Moments between levels with spins; electric and magnetic, real and imaginary ones do not interfere."""
    kinds: dict[tuple[bool, bool], list[tuple[Tables, ChainOperator]]] = {}
    for moment in moments:
        piece = Piece(moment.value_debye, moment.rotor, *moment.states, 0, 0)
        elements = pieces_in_both_orders(shared.stacks, [piece], moment.conjugate_sign, shared.representation)
        place = (shared.scheme.place(moment.spin),) if moment.spin else ()
        acting = ChainOperator(place, moment.rotor.rank, scalar=False)
        tables = tables_of(elements, shared.cache["frame"])
        kinds.setdefault((moment.electric, moment.imaginary), []).append((tables, acting))
    return Moments(1, list(kinds.values()))


def moments_of(
    levels: Levels, dipoles: dict[tuple[int, int], tuple[float, float, float]], moments: Sequence[Moment]
) -> Moments:
    """Dipoles by pairs of states and other moments, for levels with spins; ValueError for levels without."""
    if not levels.blocks or levels.blocks[0].spins is None:
        raise ValueError("moments besides plain dipoles need levels that were solved with spins")
    return spin_moments(levels.blocks[0].spins.shared, with_dipoles(dipoles, moments))


def with_dipoles(
    dipoles: dict[tuple[int, int], tuple[float, float, float]], moments: Sequence[Moment]
) -> tuple[Moment, ...]:
    """All moments: plain dipoles by pairs of states, then the others."""
    plain = [Moment(1.0, states, Cosines(along)) for states, along in dipoles.items() if any(along)]
    return (*plain, *(moment for moment in moments if moment.value_debye))
