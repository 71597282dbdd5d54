"""Trusted levels of an effective Hamiltonian, and replacements for the others in sums.

Distortion constants are valid up to some J and K; beyond, their polynomial turns over and gives levels that no molecule has. A level is
not trusted if its energy is less than 0.6 or more than 2 times the rigid energy. If a level is too low, labels within its J are wrong,
and no level of that J is trusted. Untrusted levels are replaced by those with quartic distortion only; if these fail by the same rule, by
rigid levels with quartic distortion to first order. The lowest possible energy is lower by the quartic part once more. Rigid levels
are solved only if the estimate A Ka² + C Kc² + B (J(J+1) - Ka² - Kc²) does not suffice.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.effects.watson import SEMI_RIGID, centrifugal_operators, to_order
from rotor.quantum.levels import Levels, energies_like
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.spherical_top import scalar_and_tensor
from rotor.tops.constants.operators import REPRESENTATIONS

if TYPE_CHECKING:
    from rotor.tops.top import Top

TRUSTED = (0.6, 2.0)  # range of energy over rigid energy for a trusted level
GROUND_J = 10  # the lowest level of all states has at most this J
LOWEST = 0.4  # of the rigid energy: lower bound of a distorted level


def rigid_energies_mhz(top: Top, levels: Levels) -> Floats:
    """A Ka² + B (J(J+1) - Ka² - Kc²) + C Kc² of all levels in MHz; exact for a symmetric top without distortion.

    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("A=9 B=3 MHz")
    >>> from rotor.quantum.solve import solve_levels
    >>> levels = solve_levels(top, 20)
    >>> bool(np.allclose(rigid_energies_mhz(top, levels), levels.energy_mhz))
    True
    """
    a, b, c = top.rotational_constants_mhz
    along_a, along_c = _squared_labels(top, levels)
    finite = a if np.isfinite(a) else 0.0  # a linear top has no K
    return np.asarray(b * _j_squared(levels) + (finite - b) * along_a + (c - b) * along_c)


def _j_squared(levels: Levels) -> Floats:
    return np.asarray(levels.rotational * (levels.rotational + 1.0))


def _squared_labels(top: Top, levels: Levels) -> tuple[Floats, Floats]:
    """Ka² and Kc² of all levels, (n,) each; 0 for a quantum number that the kind of top lacks."""
    quanta, none = levels.quanta, np.zeros(len(levels))
    if "kc" in quanta:
        return quanta["ka"] ** 2.0, quanta["kc"] ** 2.0
    if "k" not in quanta:
        return none, none
    k2 = quanta["k"] ** 2.0
    return (none, k2) if top.kind == "oblate" else (k2, none)


def trusted_energies_mhz(top: Top, levels: Levels) -> tuple[Floats, Floats]:
    """Energies (n,) with untrusted ones replaced, and lower bounds (n,) of these; MHz."""
    energy, rigid = levels.energy_mhz, rigid_energies_mhz(top, levels)
    if not centrifugal_operators(top.constants) or not _untrusted(levels, energy, rigid).any():
        return energy, energy
    rigid, quartic = _simpler_mhz(top, levels, rigid)
    wrong = _untrusted(levels, energy, rigid)
    failed = _untrusted(levels, quartic, rigid)
    first, size = _first_order_quartic_mhz(top, levels)
    estimate = np.clip(np.where(failed, rigid + first, quartic), TRUSTED[0] * rigid, TRUSTED[1] * rigid)
    lowest = np.maximum(estimate - np.where(failed, size, np.abs(quartic - rigid)), LOWEST * rigid)
    return np.where(wrong, estimate, energy), np.where(wrong, lowest, energy)


def are_trusted(top: Top, levels: Levels, ground_mhz: float | None = None) -> NDArray[np.bool_]:
    """Which levels (n,) are trusted; all levels of a rigid top.

    With a level table, trusted levels are those in the table. With spins, those whose rotational level is trusted without spins. With
    further states, those of J without a level below the ground level (`ground_mhz` if the levels do not include low J).
    """
    if "irrep" in levels.quanta or "species" in levels.quanta or not centrifugal_operators(top.constants):
        return np.ones(len(levels), dtype=np.bool_)
    if "v" in levels.quanta:
        return _above_the_ground(levels, ground_mhz)
    if "n" in levels.quanta:
        return _trusted_by_rotation(top, levels)
    if (tabulated := in_level_table(top, levels)) is not None:
        return tabulated
    rigid = rigid_energies_mhz(top, levels)
    if not _untrusted(levels, levels.energy_mhz, rigid).any():
        return np.ones(len(levels), dtype=np.bool_)
    return ~_untrusted(levels, levels.energy_mhz, _simpler_mhz(top, levels, rigid)[0])


def _above_the_ground(levels: Levels, ground_mhz: float | None) -> NDArray[np.bool_]:
    """Which levels belong to a J without a level below the ground, which is the lowest level of low J or `ground_mhz`."""
    low = levels.rotational <= GROUND_J
    ground = levels.energy_mhz[low].min() if low.any() else ground_mhz
    if ground is None:
        return np.ones(len(levels), dtype=np.bool_)
    fallen = levels.energy_mhz < ground
    return ~np.isin(levels.rotational, levels.rotational[fallen])


def _trusted_by_rotation(top: Top, levels: Levels) -> NDArray[np.bool_]:
    """Which levels with spins (n,) belong to a trusted rotational level; solved without spins only if energies look wrong."""
    # N = 0 has no distortion; spins may move it up or down
    energy = np.where(levels.rotational > 0, levels.energy_mhz, 0.0)
    if top.level_table is None and not _untrusted(levels, energy, rigid_energies_mhz(top, levels)).any():
        return np.ones(len(levels), dtype=np.bool_)
    bare = replace(top, spin_constants=None)
    rotation = solve_levels(bare, int(levels.rotational.max()), jmin=int(levels.rotational.min()), vectors=False)
    names = {name: levels.quanta[name] for name in ("ka", "kc", "k") if name in rotation.quanta}
    return np.asarray(are_trusted(bare, rotation)[rotation.rows_of(j=levels.quanta["n"], **names)])


def in_level_table(top: Top, levels: Levels) -> NDArray[np.bool_] | None:
    """Which levels (n,) have energies from the top's level table; None without a table, or with effects beyond it.

    A molecule has a table because its distortion series does not converge, so its other levels are not trusted.
    """
    if top.level_table is None or tuple(levels.effects) != SEMI_RIGID:
        return None
    return np.asarray(top.level_table.rows_of(levels.quanta) >= 0)


def _untrusted(levels: Levels, energy: Floats, rigid: Floats) -> NDArray[np.bool_]:
    low, high = energy < TRUSTED[0] * rigid, energy > TRUSTED[1] * rigid
    return np.asarray(high | np.isin(levels.rotational, levels.rotational[low]))


def _simpler_mhz(top: Top, levels: Levels, rigid: Floats) -> tuple[Floats, Floats]:
    """Energies (n,) in MHz of the rigid top and with quartic distortion, in the order of the levels."""
    if top.kind != "asymmetric":
        return rigid, rigid + _first_order_quartic_mhz(top, levels)[0]
    jmin, jmax = int(levels.rotational.min()), int(levels.rotational.max())
    simpler = (solve_levels(to_order(top, order), jmax, jmin=jmin, vectors=False) for order in (2, 4))
    plain, quartic = (energies_like(levels, solved) for solved in simpler)
    return plain, quartic


def _first_order_quartic_mhz(top: Top, levels: Levels) -> tuple[Floats, Floats]:
    """The diagonal quartic terms (n,) in MHz with K² of the label for Jz², and the sum of their absolute values."""
    squared = _j_squared(levels)
    k2 = _k_squared(top, levels, squared)
    operators = centrifugal_operators(top.constants)
    if top.kind == "spherical":
        operators, _ = scalar_and_tensor(operators)
    value, size = np.zeros(len(k2)), np.zeros(len(k2))
    for (p, q, n), c in operators.items():
        if p + q + n == 2:
            term = c * squared ** (p + n) * k2**q  # elements of J₊² are at most J(J+1)
            value += np.zeros(len(k2)) if n else term
            size += np.abs(term)
    return value, size


def _k_squared(top: Top, levels: Levels, squared: Floats) -> Floats:
    """K² along the z of the representation, from the labels."""
    along_a, along_c = _squared_labels(top, levels)
    if top.kind != "asymmetric":
        return np.asarray(along_a + along_c)
    z = REPRESENTATIONS[str(top.constants.representation)][2]
    return np.asarray({"a": along_a, "c": along_c}.get(z, np.maximum(squared - along_a - along_c, 0.0)))
