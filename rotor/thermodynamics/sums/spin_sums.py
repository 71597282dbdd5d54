"""Sums over levels with spin splittings: over split levels if the splittings matter, otherwise as a product.

    Q = Σ_rot e^(-E/kT) Σ_F (2F+1) e^(-δ_F/kT),      Σ_F (2F+1) δ_F = 0 for a traceless coupling.

With x = δ/kT of the largest splitting, Q is Π(2I+1) Q_rot within a relative error x²/2, and U/RT and C_v/R are those of the rotation
within x² (for C_v, a Schottky anomaly). If this exceeds the requested error, the split levels are summed. Energies always count from the
lowest split level. With an unpaired electron the split levels are always summed (`spin_factor`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import weights_of_levels
from rotor.quantum.solve import solve_levels
from rotor.thermodynamics.sums.classical_limit import populated_j
from rotor.thermodynamics.sums.level_sums import LevelSums, Progress, level_sums, lowest_level_k
from rotor.thermodynamics.sums.spin_factor import rotational_sum
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


_NONE_OF_J_0 = {
    "nuclear quadrupole",
    "spin-rotation",
    "hyperfine method",
}  # effects that shift J = 0 in second order only


@dataclass(frozen=True)
class SpinSums:
    """Sums for each set of spin weights.

    splitting_mhz: the largest size of the couplings. split: (n,), whether split levels were summed at a temperature.
    """

    sums: list[LevelSums]
    splitting_mhz: float
    split: NDArray[np.bool_]


def spin_sums(
    top: Top,
    weights: Sequence[SpinWeights],
    temperatures_k: Floats,
    relative_error: float,
    effects: Sequence[QuantumEffect],
    progress: Progress | None = None,
    *,
    energies: bool = True,
    refuse: bool = True,
) -> SpinSums:
    """Q, U/RT and C_v/R of levels with spins, for several sets of spin weights.

    Parameters
    ----------
    top : Top
    weights : sequence of SpinWeights
    temperatures_k : (n,) array
        Above 0 K.
    relative_error : float
        Largest error of Q, U and C_v.
    effects : sequence of QuantumEffect
        Effects in the Hamiltonian, including spins.
    progress : callable, optional
    energies : bool
    refuse : bool
        As in `level_sums`.

    Returns
    -------
    SpinSums

    Raises
    ------
    ValueError
        As in `level_sums`.
    """
    plain = rotational_sum(top, effects)
    size = splitting_mhz(top, effects, float(temperatures_k.max()))
    plainly: dict[str, Any] = {"progress": progress, "energies": energies, "refuse": refuse}
    settings = plainly | {"effects": effects}
    if plain.is_original:
        sums = level_sums(top, weights, temperatures_k, relative_error, **settings)
        return SpinSums(sums, size, np.ones(len(temperatures_k), dtype=np.bool_))
    weights_of_rotation = weights if plain.weights is None else [plain.weights]
    rotation = level_sums(top, weights_of_rotation, temperatures_k, relative_error, effects=plain.effects, **plainly)
    ground = _lowest_split_k(top, weights, rotation, effects, size, relative_error / 10)
    product = [
        times_functions(sums, plain.functions, lowest, size, plain.first_order)
        for sums, lowest in zip(rotation, ground, strict=True)
    ]
    split = np.any(
        [
            _worst(sums, energies) > _worst(spinless, energies) + relative_error
            for sums, spinless in zip(product, rotation, strict=True)
        ],
        axis=0,
    )
    if not split.any():
        return SpinSums(product, size, split)
    summed = level_sums(top, weights, temperatures_k[split], relative_error, **settings)
    return SpinSums(
        [_placed(whole, split, corrected) for whole, corrected in zip(product, summed, strict=True)], size, split
    )


def _lowest_split_k(
    top: Top,
    weights: Sequence[SpinWeights],
    rotation: list[LevelSums],
    effects: Sequence[QuantumEffect],
    size_mhz: float,
    share: float,
) -> list[float]:
    """E/k of the lowest split level for each set of weights.

    J = 0 and 1 suffice if no rigid level of J = 2 is within twice the size of the couplings of the ground level; J = 0 suffices if it
    exists and no J = 1 is that close. Couplings χ and C shift J = 0 only in second order, V²/ΔE; a shift below `share` of kT is ignored.
    """
    ground_mhz, least = max(sums.ground_k for sums in rotation) * units.MHZ_PER_K, min(top.rotational_constants_mhz)
    reach = ground_mhz + 2 * size_mhz
    if top.states is not None or len(weights) > 1 or 6 * least < reach:
        return lowest_level_k(top, weights, effects)
    alone = 2 * least > max(reach, 2 * ground_mhz)
    coldest_mhz = rotation[0].temperatures_k.min() * units.MHZ_PER_K
    second_order = {effect.name for effect in effects if effect.spins(top)} <= _NONE_OF_J_0
    if alone and second_order and size_mhz**2 / (2 * least) < share * coldest_mhz:
        return [rotation[0].ground_k]
    levels = solve_levels(top, 0 if alone else 1, effects=tuple(effects), vectors=False)
    exists = weights_of_levels(levels, weights[0]) > 0
    return [float(levels.energy_mhz[exists].min()) / units.MHZ_PER_K]


def splitting_mhz(top: Top, effects: Sequence[QuantumEffect], temperature_k: float) -> float:
    """The sum of the sizes of all spin couplings at the most populated J."""
    j = max(populated_j(top, temperature_k), 1)
    return sum(effect.size_mhz(top, j) for effect in effects if effect.spins(top))


def times_functions(
    rotation: LevelSums, functions: int, ground_k: float, size_mhz: float, first_order: bool = False
) -> LevelSums:
    """The sums without spins times the number of spin functions, from the lowest split level, with error bounds for the splittings.

    Parameters
    ----------
    rotation : LevelSums
        Sums without spins.
    functions : int
        Number of spin functions, Π(2I+1).
    ground_k : float
        Lowest split level over k, K.
    size_mhz : float
        The largest splitting.
    first_order : bool
        Whether the mean shift of a rotational level does not vanish.

    Returns
    -------
    LevelSums
    """
    above, x2 = (rotation.ground_k - ground_k) / rotation.temperatures_k, _squared(size_mhz, rotation.temperatures_k)
    shift = np.sqrt(x2) if first_order else np.zeros_like(x2)
    energy = rotation.energy_over_rt + above
    with np.errstate(divide="ignore", over="ignore"):  # if the rotation is frozen, C_v is due to the spins alone
        return replace(
            rotation,
            ground_k=ground_k,
            q=functions * rotation.q * np.exp(-above),
            energy_over_rt=energy,
            error_q=rotation.error_q + shift + x2 / 2,
            error_energy=rotation.error_energy + _over(shift + x2, energy),
            error_cv=rotation.error_cv + _over(x2, rotation.cv_over_r),
        )


def _squared(size_mhz: float, temperatures_k: Floats) -> Floats:
    return np.asarray((size_mhz / (units.MHZ_PER_K * temperatures_k)) ** 2)


def _over(x2: Floats, value: Floats) -> Floats:
    """Relative change by the splittings; 0 without splittings."""
    return np.asarray(np.divide(x2, value, out=np.zeros_like(x2), where=x2 > 0))


def _worst(sums: LevelSums, energies: bool) -> Floats:
    errors = [sums.error_q, sums.error_energy, sums.error_cv]
    return np.asarray(np.max(errors if energies else errors[:1], axis=0))


def _placed(whole: LevelSums, where: NDArray[np.bool_], parts: LevelSums) -> LevelSums:
    """The sums with those at selected temperatures replaced."""
    columns = {}
    for name in ("q", "energy_over_rt", "cv_over_r", "jmax", "error_q", "error_energy", "error_cv"):
        columns[name] = getattr(whole, name).copy()
        columns[name][where] = getattr(parts, name)
    return replace(whole, **columns)
