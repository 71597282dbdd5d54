"""Levels of a molecule with internal rotors and nuclear spins.

The torsion-rotation levels r of a species with v_t ≤ vt_max take the place of the eigenstates of the rotation in `rotor.quantum.spins`,

    ⟨r' p'|H|r p⟩ = E_r δ + Σ_channels c(p', p) ⟨r'‖X‖r⟩,    ⟨r'‖X‖r⟩ = Σ V*_r',J'K't' ⟨J'K'‖X‖J K⟩⟨K't'|K t⟩ V_r,J K t,

(A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, chapter 7, for c; the overlaps of torsional functions are exact for every K).
Reduced elements of A are real; those of E are real where a mirror plane contains ρ, complex otherwise. Elements with states of
v_t > vt_max are neglected. They move levels by χ²/ΔE: below 1e-4 MHz for χ of 20 MHz and torsional states 100 cm⁻¹ apart.

Derivatives by coefficients of the torsion-rotation are expectation values: ∂E/∂c = Σ_p ⟨Ψ_p|O_c|Ψ_p⟩, Ψ_p = Σ_r v_rp V_r of each coupling
pattern p.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Ints
from rotor.quantum.internal_rotation.levels import (
    Columns,
    joined_levels,
    refuse_axes,
    torsion_rotation_levels,
    turning_tops,
)
from rotor.quantum.internal_rotation.rho_axis_tensors import REPRESENTATION
from rotor.quantum.internal_rotation.several_tops import SeveralTops
from rotor.quantum.levels import Levels, SolvedBlock, placed
from rotor.quantum.spins.blocks import rotor_plan
from rotor.quantum.spins.levels import solved_blocks, within_n
from rotor.quantum.spins.rotor import Terms, valued_terms
from rotor.quantum.spins.scheme import Cosines, CosinesWithN, Scheme, SpinTerm, scheme_of
from rotor.quantum.wang.basis import Part
from rotor.tops.internal_rotation import InternalRotationConstants

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


def hyperfine_levels(
    top: Top, constants: InternalRotationConstants, effects: tuple[QuantumEffect, ...], nmin: int, nmax: int
) -> Levels:
    """Levels with nuclear spins whose N is from `nmin` to `nmax`, labelled by species, vt, n, ka, kc, f1, ... f (half-integers doubled).

    Raises ValueError for electron spins, total spins of like nuclei, and constants with powers of N.
    """
    refuse_axes(top)
    scheme, model = scheme_of(top, effects), turning_tops(top, constants)
    refuse_unlike_nuclei(scheme, (term for effect in effects for term in effect.spin_terms(top)))
    if isinstance(model, SeveralTops) and model.axis and len(scheme.spins) > 1:
        raise ValueError(
            "spins of several nuclei beside equivalent tops: their exchange is not computed; leave one of them out"
        )
    terms = valued_terms(top, effects)
    all_f = scheme.reached_f(nmin, nmax)  # neighbouring N are solved too, since spins mix them in
    free = torsion_rotation_levels(top, constants, effects, max(0, nmin - scheme.total), nmax + scheme.total)
    names = np.column_stack([np.arange(len(free)), free.quanta["ka"], free.quanta["kc"]])
    coupled = coupled_blocks(free.blocks, names, scheme, terms, all_f)
    blocks = tuple(placed(within_n(block, (nmin, nmax)) for block in coupled))
    columns = {"components": free.components, "weight": free.weight, **free.quanta}
    labels = np.concatenate([block.labels for block in blocks])
    piece: Columns = {("n" if name == "j" else name): column[labels[:, 0]] for name, column in columns.items()}
    piece |= scheme.sums_of(labels) | {"multiplicity": labels[:, -1] + 1}
    energies = np.concatenate([block.energies_mhz for block in blocks])
    return joined_levels(top, effects, nmax, [piece], energies, blocks, scheme.halves)


def coupled_blocks(
    free: Iterable[SolvedBlock], names: Ints, scheme: Scheme, terms: Terms, all_f: Sequence[int]
) -> list[SolvedBlock]:
    """The blocks of all doubled F in `all_f` by their first torsion-rotation level, then F.

    names: of each torsion-rotation level (levels, 3), the first columns of the labels that its states get.
    """
    rotors = []
    for block in sorted(free, key=lambda block: block.j):
        states = range(len(block.energies_mhz))
        parts = tuple(Part(0, block.basis, i, names[block.start + i : block.start + i + 1]) for i in states)
        rotors.append(replace(block, parts=parts))
    solved = solved_blocks(rotor_plan(rotors, REPRESENTATION, scheme, terms), all_f)
    solved.sort(key=lambda block: (min(part.rotor.start for part in block.spins.parts), block.twice_total))
    return [replace(block, components=block.spins.rotor.components) for block in solved]


def refuse_unlike_nuclei(scheme: Scheme, terms: Iterable[SpinTerm]) -> None:
    """ValueError for electrons, total spins, and terms that are no tensors of one nucleus."""
    for spin in scheme.spins:
        if spin.electron or spin.total:
            raise ValueError(
                f"spin {spin.name} beside internal rotation: electrons and total spins are not supported; give single nuclei"
            )
    for term in terms:
        powers = term.n2 or term.nz2 or term.ns
        if not isinstance(term.rotor, Cosines | CosinesWithN) or powers or len(set(term.spins)) != 1:
            raise ValueError(
                f"{term.name} beside internal rotation: only quadrupole and spin-rotation tensors of one nucleus are supported"
            )
