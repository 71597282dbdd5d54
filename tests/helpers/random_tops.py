"""The Hamiltonians of `random_hamiltonians` as tops and effects of the package."""

from __future__ import annotations

from typing import Any

from random_hamiltonians import Case

import rotor
from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.spin_effect import SpinRotation, quadrupole_of_tensor
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.spins import Spin
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.top import Top


def top_and_effects(case: Case) -> tuple[Top, tuple[Any, ...]]:
    """The top of a random Hamiltonian, and its effects."""
    constants = rotor.Constants(**dict(zip("ABC", case.abc[0], strict=True)), reduction="A", representation="Ir")
    together = bool(case.kv_per_cm) and not case.spins
    settings = {"vt_max": 12, "functions": 14} if together else {"vt_max": 4}
    turning = InternalRotationConstants(case.torsion, "RAM", **settings) if case.torsion else None
    quadrupole = quadrupole_of_tensor(Spin("N", 2), case.chi)
    names = {f"C_{x}{y}(H)": case.c["abc".index(x), "abc".index(y)] for x, y in ("aa", "bb", "cc", "ab", "ac", "bc")}
    top = Top.from_constants(constants, dipole_abc_debye=tuple(case.dipole), internal_rotation=turning)
    effects: tuple[Any, ...] = effects_of(top, False) if turning else SEMI_RIGID
    if case.spins:
        effects = (*effects, quadrupole, SpinRotation(names, (Spin("H", 1),)))
    if len(case.abc) == 2:
        values = {
            "E[1]": case.origin,
            "W[0,1]": case.fermi,
            "G_c[0,1]": case.coriolis,
            "F_ab[0,1]": case.f_ab,
        }
        values |= dict(zip(("A[1]", "B[1]", "C[1]"), case.abc[1], strict=True))
        effects = (*effects, InteractingStates(values, {}, {(0, 1): tuple(case.between), (1, 1): tuple(case.dipole)}))
    return top, effects
