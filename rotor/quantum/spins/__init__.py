"""Spins coupled to the rotation, N + S1 = J, J + I1 = F1, ... = F: levels, line strengths and derivatives.

Levels (`levels`) are solved F by F (`blocks`) over the eigenstates of the rotation (`rotor`), with the coefficients of `coupling`.
`many_f_lines` has elements of moments between them, `linear_blocks` derivatives, `scheme` the spins and their terms.
"""

from rotor.quantum.spins.scheme import Scheme, Spin, SpinTerm, scheme_of

__all__ = ["Scheme", "Spin", "SpinTerm", "scheme_of"]
