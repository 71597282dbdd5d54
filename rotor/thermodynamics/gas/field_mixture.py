"""Thermal mixtures of states in a static field: populations, mean orientation and alignment, mean dipole along the field.

Two mixtures are available: a gas in equilibrium in the field, and a beam that was in equilibrium without field and entered the field
adiabatically, so that each state has the population of its free level. In equilibrium the mean dipole is kT ∂lnQ/∂E; for kT far above
the rotational energies it approaches μ times the Langevin function, coth x - 1/x with x = μE/kT.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.checks import require_between, require_choice, require_positive
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.stark import checked_direction, stark_map
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.fields.block_states import BlockStates
from rotor.quantum.fields.field_map import FieldMap
from rotor.table import Table
from rotor.thermodynamics.sums.level_sums import lowest_level_k
from rotor.thermodynamics.sums.partition import partition_function
from rotor.units import MHZ_PER_K

if TYPE_CHECKING:
    from rotor.tops.top import Top

POPULATIONS = ("equilibrium", "adiabatic")
MOST_J = 60


class Populations(NamedTuple):
    """by_block: populations of single states, (fields, states) for each block. q: Q at each field (fields,), from the lowest free level."""

    by_block: list[Floats]
    q: Floats


def populations_in_field(
    top: Top,
    solved: Sequence[BlockStates],
    temperature_k: float,
    populations: str,
    effects: Sequence[QuantumEffect] = (),
) -> Populations:
    """Populations of the states of blocks that together contain all M.

    Parameters
    ----------
    top : Top
        Constants and spin weights.
    solved : sequence of BlockStates
        Energies (f, states) in MHz of each block at the same fields.
    temperature_k : float
        Temperature of the gas.
    populations : str
        "adiabatic": each state has the population of its free level; otherwise equilibrium in the field.
    effects : sequence of QuantumEffect, optional
        The Hamiltonian of a top with spins.

    Returns
    -------
    Populations
        (f, states) of each block, and Q (f,).

    Notes
    -----
    In equilibrium Q is that of the free top plus the change of the given states in the field. The shifts of higher states are
    neglected; their sum over M is 0 to second order.
    """
    kt = temperature_k * MHZ_PER_K
    ground = lowest_level_k(top, [top.spin_weights])[0] * MHZ_PER_K
    if effects:
        levels = solved[0].block.levels
        ground = float(levels.energy_mhz[levels.weight > 0].min())
    free, factors = [], []
    for block in solved:
        levels = block.block.levels
        weight = levels.weight[block.rows]
        free.append(
            np.broadcast_to(weight * np.exp(-(levels.energy_mhz[block.rows] - ground) / kt), block.energies.shape)
        )
        factors.append(weight * np.exp(-(block.energies - ground) / kt))
    q = np.full(len(solved[0].energies), partition_function(top, temperature_k, effects=tuple(effects) or SEMI_RIGID).q)
    if populations == "adiabatic":
        return Populations([factor / q[:, None] for factor in free], q)
    for block, before, now in zip(solved, free, factors, strict=True):
        q = q + block.block.copies * (now - before).sum(axis=1)
    return Populations([factor / q[:, None] for factor in factors], q)


@dataclass(frozen=True, eq=False, repr=False)
class FieldMixture(Table):
    """Means of a thermal mixture as functions of the field.

    field_kv_per_cm: (n,). energy_mhz: above the lowest free level. mu_eff_debye: mean dipole along the field. cosines: by name (n,).
    left_out: population above the states in the map, taken as isotropic. states: number of states, degenerate copies included.
    """

    temperature_k: float
    populations: str
    field_kv_per_cm: Floats
    energy_mhz: Floats
    mu_eff_debye: Floats
    cosines: dict[str, Floats]
    q: Floats
    left_out: float
    states: int
    j_highest: int
    map: FieldMap

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """field_kv_per_cm, energy_mhz, mu_eff_debye, the cosines, q."""
        start = {"field_kv_per_cm": self.field_kv_per_cm, "energy_mhz": self.energy_mhz}
        return {**start, "mu_eff_debye": self.mu_eff_debye, **self.cosines, "q": self.q}

    @property
    def provenance(self) -> dict[str, Any]:
        """Temperature, populations, what is left out, and the provenance of the map."""
        return {
            "temperature_k": self.temperature_k,
            "populations": self.populations,
            "left_out": self.left_out,
            "states": self.states,
            "j_highest": self.j_highest,
            **self.map.provenance,
        }


def field_mixture(
    top: Top,
    fields_kv_per_cm: ArrayLike,
    temperature_k: float,
    *,
    populations: str = "equilibrium",
    left_out: float = 1e-3,
    intensity_w_per_cm2: float = 0.0,
    direction: Sequence[float] = (0.0, 0.0, 1.0),
    tolerance_mhz: float = 1e-2,
    executor: Executor | None = None,
) -> FieldMixture:
    """Mean energy, dipole and cosines of a thermal mixture of states against a static field.

    Parameters
    ----------
    top : Top
        With `dipole_abc_debye`.
    fields_kv_per_cm : (n,)
        Fields, strictly increasing.
    temperature_k : float
        Temperature of the mixture.
    populations : str
        "equilibrium" in the field, or "adiabatic": populations of the free top, carried into the field.
    left_out : float
        Population of the free top that may lie above the highest J of the map.
    intensity_w_per_cm2, direction : optional
        As in `stark_map`.
    tolerance_mhz : float
        Tolerance of the energies.
    executor : Executor, optional
        Runs the blocks in parallel.

    Returns
    -------
    FieldMixture

    Raises
    ------
    ValueError
        As `stark_map`; and if states above J = 60 would be needed.

    Notes
    -----
    The population above the map is taken as isotropic; its energy is neglected.

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> round(float(field_mixture(rod, [0.0, 30.0], 1.0).cosines["costheta"][1]), 4)
    0.1512
    """
    require_positive("temperature_k", temperature_k, "K")
    require_between("left_out", left_out, 1e-9, 0.5)
    require_choice("populations", populations, POPULATIONS)
    checked_direction(direction)
    j, q, ground = _followed_j(top, temperature_k, left_out)
    states = stark_map(
        top,
        fields_kv_per_cm,
        j_highest=j,
        intensity_w_per_cm2=intensity_w_per_cm2,
        direction=direction,
        tolerance_mhz=tolerance_mhz,
        executor=executor,
    )
    return _means(states, temperature_k, populations, (j, q, ground))


def _followed_j(top: Top, temperature_k: float, left_out: float) -> tuple[int, float, float]:
    """The J that leaves less than `left_out` of the population of the free top above it; Q; the lowest energy in MHz."""
    from rotor.quantum.solve import solve_levels

    q = partition_function(top, temperature_k).q
    ground = lowest_level_k(top, [top.spin_weights])[0] * MHZ_PER_K
    levels = solve_levels(top, MOST_J, vectors=False)
    each = levels.degeneracy * np.exp(-(levels.energy_mhz - ground) / (temperature_k * MHZ_PER_K))
    by_j = np.cumsum(np.bincount(levels.rotational, each, MOST_J + 1)) / q
    enough = np.flatnonzero(by_j >= 1 - left_out)
    if not len(enough):
        raise ValueError(
            f"{temperature_k:g} K: {1 - by_j[-1]:.2g} of the population is above J = {MOST_J}, which is as far as states in a field are "
            "followed; take a lower temperature or a larger share to leave out"
        )
    return int(enough[0]), float(q), float(ground)


def _means(
    states: FieldMap, temperature_k: float, populations: str, free_top: tuple[int, float, float]
) -> FieldMixture:
    j, q_free, ground = free_top
    kt, count = temperature_k * MHZ_PER_K, len(states.fields)
    shape = (-1, count)
    energy, copies = states.energy_mhz.reshape(shape), states.copies.reshape(shape)
    weight = copies * states.weight.reshape(shape)
    before = weight * np.exp(-(states.free_mhz.reshape(shape) - ground) / kt)
    now = weight * np.exp(-(energy - ground) / kt)
    if populations == "adiabatic":
        share, q = before / q_free, np.full(count, q_free)
    else:
        q = q_free + (now - before).sum(axis=0)
        share = now / q
    rest = 1 - share.sum(axis=0)

    def mean(values: Floats, isotropic: float) -> Floats:
        return np.asarray((share * values.reshape(shape)).sum(axis=0) + rest * isotropic)

    isotropic = {"costheta": 0.0, "cos2theta": 1 / 3}
    return FieldMixture(
        temperature_k=temperature_k,
        populations=populations,
        field_kv_per_cm=states.fields,
        energy_mhz=mean(energy - ground, 0.0),
        mu_eff_debye=mean(states.slope, 0.0),
        cosines={name: mean(values, isotropic[name]) for name, values in states.cosines.items()},
        q=q,
        left_out=float(rest.max()),
        states=int(copies[:, 0].sum()),
        j_highest=j,
        map=states,
    )
