"""Torsional functions for each K as a basis of the rotation: two-step diagonalisation for one internal rotor.

In the rho-axis frame the kinetic coupling of a top with the rotation acts along z alone, so that the torsion

    h(K, σ) = F (p - ρK)² + ½ V3 (1 - cos 3α) + ½ V6 (1 - cos 6α)

is solved for each K first (E. Herbst, J. K. Messer, F. C. De Lucia and P. Helminger, J. Mol. Spectrosc. 108 (1984) 42, the two-step
diagonalisation). Its lowest n_v functions |K t⟩ are retained, and a term R ⊗ o of the rotation and the torsion becomes

    ⟨J K' t'|R o|J K t⟩ = ⟨J K'|R|J K⟩ Σ_m'm ⟨K' t'|m'⟩⟨m'|o|m⟩⟨m|K t⟩.

Truncation to n_v functions is the only approximation; energies are upper bounds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.labelled import Basis
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.torsion import torsional_states

# reduced barrier: between a torsion of 20 cm-1 (1.7) and methyl groups behind a barrier (17 and more)
NEARLY_FREE = 5.0
WAVES = 10  # free functions have k from -WAVES to WAVES


class Product(NamedTuple):
    """An operator of the rotation times an operator of the torsion (None: unit), which acts on the labels k of exp i(3k + σ)α."""

    rotation: Operator
    torsion: Operator | None = None


Terms = Mapping[str, Sequence[Product]]  # each name multiplies a sum of products


@dataclass(frozen=True, eq=False)
class Torsion:
    """Torsional Hamiltonian that is solved first: F in MHz, ρ, and V_n in MHz by n."""

    f_mhz: float
    rho: float
    barriers: Mapping[int, float]

    @property
    def is_near_free(self) -> bool:
        """Whether the reduced barrier s = 4 V3/9F is so low that E levels are named by signed K."""
        return 4 * abs(self.barriers.get(3, 0.0)) < 9 * NEARLY_FREE * self.f_mhz


@dataclass(frozen=True, eq=False)
class ContractedTorsion:
    """The lowest torsional functions of one species for each K.

    sigma: the species. k_max: the largest |K|. k_waves: labels k of the free functions. energies (K, n_v) in MHz and vectors (K, k, n_v)
    start at K = -k_max; for σ = 0 their phases obey ⟨-k|-K t⟩ = ⟨k|K t⟩. parity (n_v,): for σ = 0 the sign of each function of K = 0
    under this reversal; 0 for other species.
    """

    sigma: int
    k_max: int
    k_waves: Ints
    energies: Floats
    vectors: Floats
    parity: Ints
    is_near_free: bool

    @property
    def count(self) -> int:
        """n_v, the number of functions for each K."""
        return int(self.energies.shape[1])

    def tables(self, operator: Operator | None, change: int) -> Floats:
        """⟨K + change, t'|o|K t⟩ as (K, t', t), zero where K + change is beyond k_max."""
        if operator is None and not change:
            return np.broadcast_to(np.eye(self.count), (len(self.energies), self.count, self.count))
        tables = np.zeros((len(self.energies), self.count, self.count))
        first, last = max(0, -change), len(tables) - max(0, change)
        source = self.vectors[first:last]
        if operator is not None:
            source = self._matrix(operator) @ source
        tables[first:last] = np.swapaxes(self.vectors[first + change : last + change], 1, 2) @ source
        return tables

    def _matrix(self, operator: Operator) -> Floats:
        matrix = Basis({"k": self.k_waves}).elements([operator]).dense()
        if np.iscomplexobj(matrix):
            raise ValueError(
                "an operator of the torsion is complex: give it with the factor i that its rotation takes away"
            )
        return matrix


def contracted_torsion(torsion: Torsion, sigma: int, k_max: int, count: int, waves: int = WAVES) -> ContractedTorsion:
    """The lowest `count` torsional functions of one species for each K from -k_max to k_max.

    sigma: 0, or 1 for the E species of a threefold top (-1 has the same energies with K reversed). waves: the free functions are
    exp i(3k + σ)α with k from -waves to waves.
    """
    waves_k, shifts = np.arange(-waves, waves + 1), torsion.rho * np.arange(-k_max, k_max + 1, dtype=float)
    if count > len(waves_k):
        raise ValueError(f"n_v = {count}: expected at most {len(waves_k)}, the number of free-rotor functions")
    energies, vectors = torsional_states(torsion.f_mhz, torsion.barriers, shifts, sigma, waves)
    parity = np.zeros(energies.shape[1], dtype=np.int64)
    if sigma == 0:
        vectors[:k_max] = vectors[:k_max:-1, ::-1]
        energies[k_max], vectors[k_max], parity = _states_of_parity(energies[k_max], vectors[k_max])
    return ContractedTorsion(
        sigma, k_max, waves_k, energies[:, :count], vectors[:, :, :count], parity[:count], torsion.is_near_free
    )


def _states_of_parity(energies: Floats, vectors: Floats) -> tuple[Floats, Floats, Ints]:
    """Energies, vectors (k, t) and parities under k → -k; each parity is solved apart, as levels of both may coincide."""
    size = len(vectors)
    half = size // 2
    matrix = (vectors * energies) @ vectors.T
    pairs = np.eye(size)[:, half + 1 :] * np.sqrt(0.5)
    even = np.column_stack([np.eye(size)[:, half], pairs + pairs[::-1]])
    halves = []
    for functions, sign in ((even, 1), (pairs - pairs[::-1], -1)):
        eigenvalues, states = np.linalg.eigh(functions.T @ matrix @ functions)
        halves.append((eigenvalues, functions @ states, np.full(len(eigenvalues), sign)))
    joined, states, parity = (np.concatenate(piece, axis=-1) for piece in zip(*halves, strict=True))
    order = np.argsort(joined, kind="stable")
    return joined[order], states[:, order], parity[order]
