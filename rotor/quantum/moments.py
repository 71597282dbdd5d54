"""Moments that make lines besides the dipole of a state: dipoles that depend on the rotation, and magnetic moments.

    electric    Σ_i μ_i φ_pi, times functions of N', N, K', K (Herman-Wallis corrections, Fourier terms of internal rotation), or
                products of one direction cosine with components of N
    magnetic    g μB N_p, g μB S_p of one spin, or g μB Σ_ij c_ij φ_pi S_j (j along the molecule), c symmetric and traceless;
                g μB Σ_ij c_ij ½{φ_pi, N_j}
    of a spin   Σ_q ½{φ_p, N_q} S_q with the part of rank 2 alone, φ = Σ_i μ_i φ_i; i Σ_ij c_ij φ_pi S_j between two states

p is a direction in space, i and j are a, b, c. Electric and magnetic moments do not interfere in a level of good parity: their
strengths are added.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rotor.quantum.spins.operators import Rotor

DEBYE_PER_BOHR_MAGNETON = 0.009274  # as SPCAT has it; 9.2740101e-3 by CODATA 2018


class Moment(NamedTuple):
    """One moment, |v'⟩⟨v| of its states times an operator and, where they differ, its Hermitian conjugate.

    rotor: of rank 1, or the part on |N K⟩ that the vector of a spin multiplies. spin: the name of that spin, "" for none. electric: whether
    it adds to the electric dipole in amplitude; elements are those of i times the moment (`spins.operators`). imaginary: whether elements
    are i times those of a plain dipole within one state: their squares are added.
    """

    value_debye: float
    states: tuple[int, int]
    rotor: Rotor
    spin: str = ""
    electric: bool = True
    imaginary: bool = False

    @property
    def conjugate_sign(self) -> float:
        """What (-1)^(N'-N) times the transpose of the elements is multiplied with in the elements of the conjugate."""
        return -1.0 if self.electric and not self.imaginary else 1.0
