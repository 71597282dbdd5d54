"""Moments that make lines besides the dipole of a state: dipoles that depend on the rotation, and magnetic moments.

    electric    Σ_i μ_i φ_pi, with half anticommutators or commutators of N² and Nz² (Herman-Wallis corrections)
    written     any operator, such as Σ c N_i ... φ_pk ... N_l, products of one direction cosine with components of N
    magnetic    g μB N_p, g μB S_p of one spin, or g μB Σ_ij c_ij φ_pi S_j (j along the molecule), c symmetric and traceless;
                g μB Σ_ij c_ij ½{φ_pi, N_j}
    of a spin   Σ_q ½{φ_p, N_q} S_q with the part of rank 2 alone, φ = Σ_i μ_i φ_i; i Σ_ij c_ij φ_pi S_j between two states

p is a direction in space, i and j are a, b, c. Electric and magnetic moments do not interfere in a level of good parity: their
strengths are added.
"""

from __future__ import annotations

from typing import NamedTuple

from rotor.quantum.operators.algebra import Operator

DEBYE_PER_BOHR_MAGNETON = 0.009274  # as SPCAT has it; 9.2740101e-3 by CODATA 2018

Vector = tuple[float, float, float]
Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


class Written(NamedTuple):
    """A moment as an operator, from the second of its states to the first: ⟨N'K'‖M‖N K⟩, or, of one with a spin, of the part on |N K⟩.

    electric: whether it is a part of the electric dipole.
    """

    operator: Operator
    electric: bool


class Moment(NamedTuple):
    """One moment between two states v', v, or of one.

    value_debye: what it is multiplied with. along_abc: μ of an electric moment, None of a magnetic one. powers: of an electric one, ""
    none, "J" ½{N², }, "JJ" ½{N⁴, }, "K" ½{Nz², }, "[J]" ½[N², ], "[[J]]" ¼[N², [N², ]].
    spin: of a magnetic moment, the spin's name, "" the rotation. tensor: c of a magnetic moment that is not isotropic. cosine: of an
    electric one α', α of the two states where an element is multiplied by cos(α'K' + αK), a Fourier term of internal rotation.
    written: a moment of another form, in place of all these but `spin`. Of a spin: along_abc is half of {φ, N} of rank 2 with the spin,
    with_i stands for the factor i of a tensor with the spin, from the second of the states to the first.
    turned: of an electric one the axis g, where it stands for C2g times itself, i times what it is in functions of other phases; by_order:
    whether it has the factor i from the higher state to the lower one, -i the other way round.
    """

    value_debye: float
    states: tuple[int, int] = (0, 0)
    along_abc: Vector | None = None
    powers: str = ""
    spin: str = ""
    tensor: Matrix | None = None
    cosine: tuple[float, float] | None = None
    written: Written | None = None
    with_i: bool = False
    turned: str = ""
    by_order: bool = False

    @property
    def imaginary(self) -> bool:
        """Whether its elements are imaginary where those of a plain dipole within one state are real: their squares add up."""
        return bool(self.turned) != self.by_order

    @property
    def electric(self) -> bool:
        """Whether it is a part of the electric dipole, or adds to one in amplitude."""
        return self.along_abc is not None or self.with_i or (self.written is not None and self.written.electric)
