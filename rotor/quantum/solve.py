"""Solves the Hamiltonian that a list of effects adds up to, by the cheapest exact method that holds all its operators.

| operators present | method |
|---|---|
| J^2p alone, any top; J^2p Jz^2q of a symmetric top; the cubic tensor of a spherical top | closed form |
| orthorhombic ones, of an asymmetric or any other nonlinear top | Wang blocks: tridiagonal, else dense |
| any other operator of J, several states | connected Wang blocks (`wang.coupled_levels`) |
| internal rotation | torsion for each K, then blocks of torsion and rotation (`internal_rotation`) |
| tensors coupled to spins | any of these for the rotation, then F blocks (`spins`) |

Energies are eigenvalues of the truncated effective Hamiltonian; nothing is treated to first order, and no operator is dropped:
what a method does not hold is solved by another one, or refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.levels import Levels
from rotor.quantum.tabulated import as_tabulated
from rotor.quantum.wang.rotation import solve_rotation

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top

MOST_LEVELS = 10_000_000  # in one piece: J up to 3161 of an asymmetric top, minutes and gigabytes


def solve_levels(
    top: Top,
    jmax: int,
    *,
    jmin: int = 0,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    vectors: bool = True,
    executor: Executor | None = None,
    below_mhz: float = math.inf,
) -> Levels:
    """All levels of a top with rotational angular momentum from `jmin` to `jmax`.

    Parameters
    ----------
    top : the constants, kind and spin weights
    jmax, jmin : highest and lowest rotational angular momentum
    effects : what the Hamiltonian consists of; the levels remember it
    vectors : False leaves the eigenvectors of an asymmetric top out
    executor : any `concurrent.futures.Executor`; J are spread over it
    below_mhz : without vectors, levels above it may be left out, which is faster; those up to it are all there

    Returns
    -------
    Levels, with the quantum numbers that the case has

    Raises
    ------
    ValueError
        For J below zero, constants that overflow, and operators that no method here holds.

    Notes
    -----
    Energies are true eigenvalues of the effective Hamiltonian; a semi-rigid top with a level table has those of the table
    for the levels in it, with the eigenvectors of the Hamiltonian. Neglected is what the effects do not contain.

    >>> from rotor.tops.top import Top
    >>> levels = solve_levels(Top.from_constants("A=10 B=6 C=4 MHz"), 1)
    >>> levels.energy_mhz.tolist(), levels.quanta["ka"].tolist(), levels.quanta["kc"].tolist()
    ([0.0, 10.0, 16.0, 14.0], [0, 0, 1, 1], [0, 1, 0, 1])
    """
    if jmax < 0 or jmin < 0 or jmin > jmax:
        raise ValueError(f"J from {jmin} to {jmax}: J max must be 0 or more and not below J min")
    _refuse_too_many(top.kind, jmin, jmax)
    effects = tuple(effects)
    if top.states is not None or top.internal_rotation is not None:
        from rotor.quantum.effects.of_top import with_states

        top, effects = with_states(top, effects)
    for effect in effects:
        if effect.resolves_m:
            raise ValueError(
                f"{effect.name}: its levels are labelled by M; expected effects of the free molecule, see `rotor.api.stark_map`"
            )
    for effect in effects:
        levels: Levels | None = effect.solve(top, effects, jmin, jmax, vectors, below_mhz)
        if levels is not None:
            return levels
    if any(effect.spins(top) for effect in effects):
        from rotor.quantum.spins.levels import spin_levels

        return spin_levels(top, effects, jmin, jmax, executor)
    return as_tabulated(top, effects, solve_rotation(top, effects, jmin, jmax, vectors, executor, below_mhz=below_mhz))


def _refuse_too_many(kind: str, jmin: int, jmax: int) -> None:
    """ValueError for a range of J that no machine solves in one piece."""
    count = jmax + 1 - jmin if kind in ("linear", "spherical") else (jmax + 1) ** 2 - jmin**2
    if count > MOST_LEVELS:
        raise ValueError(
            f"J max {jmax}: more than {MOST_LEVELS} levels from J = {jmin} on; ask for fewer, in ranges of J"
        )
