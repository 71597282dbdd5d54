"""Derivatives of levels by constants of principal axes, which enter the Hamiltonian also through F, ρ and angles.

F, ρ and the direction of ρ of one top, and F_ij and ρ_i of several, follow from A, B, C, F0, delta and epsilon, so that

    dE/dc = ∂E/∂c + Σ_q ∂E/∂q ∂q/∂c,        q = F, ρ, tilts of ρ;    F1, F2, F12, ρ_1a, ρ_1b ....

∂E/∂q is the expectation value of a term of the Hamiltonian or of a further operator; ∂q/∂c is a central difference of closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.frames import torsional_kinetics
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.internal_rotation.several_tops import SeveralTops
from rotor.quantum.internal_rotation.terms import Axes

TILT = "tilt "  # prefix of x or y: the angle by which ρ turns towards this axis of its frame
RELATIVE_STEP, ANGLE_STEP = 1e-5, 1e-5  # steps (angles in radians) at which central differences are exact to 1e-10


@dataclass(frozen=True, eq=False)
class ChainRule:
    """Jacobian ∂q/∂c (quantities, constants) of the quantities q that follow from the constants c, and the names of both."""

    quantities: tuple[str, ...]
    constants: tuple[str, ...]
    jacobian: Floats

    def slopes(self, names: Sequence[str], direct: Mapping[str, Floats], count: int) -> Floats:
        """dE/dc (count, names) from `direct`, the slopes (count,) by each coefficient and quantity at fixed others."""
        none = np.zeros(count)
        total = np.column_stack([direct.get(name, none) for name in names])
        here = [i for i, name in enumerate(self.constants) if name in names]
        if here:
            columns = [names.index(self.constants[i]) for i in here]
            by_quantity = np.column_stack([direct[name] for name in self.quantities])
            total[:, columns] += by_quantity @ self.jacobian[:, here]
        return total


NO_CHAIN = ChainRule((), (), np.zeros((0, 0)))


def chain_rule(model: RamModel | SeveralTops, values: Mapping[str, float]) -> ChainRule:
    """Dependence of F, ρ and angles on constants of principal axes; empty for constants of the rho-axis frame."""
    if isinstance(model, SeveralTops):
        angles = [name for name in values if name.startswith(("F0_", "delta_", "epsilon_"))]
        kinetic = [*kinetics_of_tops(values)]
        return _rule(kinetics_of_tops, values, kinetic, [*"ABC", *angles])
    if "F0" not in values:
        return NO_CHAIN
    angles = [name for name in ("delta", "epsilon") if name in values]
    closed_form = partial(kinetics_of_one_top, frame=model.frame)
    return _rule(closed_form, values, ["F", "rho", f"{TILT}x", f"{TILT}y"], [*"ABC", "F0", *angles])


def further_operators(model: RamModel | SeveralTops, species: str, chain: ChainRule) -> dict[str, list[Product]]:
    """∂H/∂q of the quantities that are not coefficients of the Hamiltonian."""
    if isinstance(model, SeveralTops):
        slopes = model.slopes_by_rho(model.species[species])
        return {q: slopes[q] for q in chain.quantities if q in slopes}
    sigma = model.species[species]
    return {q: model.slope_by_tilt(q.removeprefix(TILT), sigma) for q in chain.quantities if q.startswith(TILT)}


def kinetics_of_one_top(values: Mapping[str, float], frame: Axes) -> dict[str, float]:
    """F, ρ and the tilts of ρ of one top from z of a frame."""
    f, (rho,) = torsional_kinetics(values, values)
    z, x, y = frame.matrix @ rho
    tilts = {f"{TILT}x": math.atan2(x, z), f"{TILT}y": math.atan2(y, z)}
    return {"F": float(f[0, 0]), "rho": float(np.linalg.norm(rho)), **tilts}


def kinetics_of_tops(values: Mapping[str, float]) -> dict[str, float]:
    """F_i, F_ij and the components of ρ_i of several tops."""
    f, rho = torsional_kinetics(values, values)
    named = {f"F{i + 1}": float(f[i, i]) for i in range(len(f))}
    named |= {f"F{i + 1}{j + 1}": float(f[i, j]) for i, j in combinations(range(len(f)), 2)}
    return named | {f"rho_{i + 1}{letter}": float(rho[i, g]) for i in range(len(f)) for g, letter in enumerate("abc")}


def _rule(
    closed_form: Callable[[Mapping[str, float]], Mapping[str, float]],
    values: Mapping[str, float],
    quantities: Sequence[str],
    constants: Sequence[str],
) -> ChainRule:
    """Jacobian of closed forms by central differences, of quantities that a constant changes: ρ may stay in a plane."""
    jacobian = np.zeros((len(quantities), len(constants)))
    for column, name in enumerate(constants):
        step = ANGLE_STEP if name.startswith(("delta", "epsilon")) else RELATIVE_STEP * values[name]
        up, down = (closed_form({**values, name: values[name] + sign * step}) for sign in (1, -1))
        jacobian[:, column] = [(up[q] - down[q]) / (2 * step) for q in quantities]
    moved = np.flatnonzero(jacobian.any(axis=1)).tolist()
    return ChainRule(tuple(quantities[row] for row in moved), tuple(constants), jacobian[moved])
