"""Spins coupled to the rotation, N + S1 = J, J + I1 = F1, ... = F: levels, line strengths and derivatives.

    H = H_rot + Σ_terms (`operators`)

Levels (`levels`) are solved F by F (`blocks`) over the eigenstates of the rotation (`rotor`), with coefficients of coupling (`coupling`);
`lines` has elements of dipoles between them, and derivatives; `scheme` the spins themselves.
"""

from rotor.quantum.spins.scheme import Scheme, Spin, SpinTerm, scheme_of

__all__ = ["Scheme", "Spin", "SpinTerm", "scheme_of"]
