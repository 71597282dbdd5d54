"""Constants of principal axes in a fit: what they change in the Hamiltonian beside the coefficient that bears their name.

F, ρ and the angle of ρ of one top, and F_ij and ρ_i of two, follow from A, B, C, F0, delta and epsilon, so that

    dE/dc = ∂E/∂c + Σ_q ∂E/∂q ∂q/∂c,        q = F, ρ, angle;    F1, F2, F12, ρ_1a, ρ_1b ....

∂E/∂q is the expectation value of a term of the Hamiltonian, or of a further operator; ∂q/∂c is a difference of closed forms.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.model import RamModel, model_of_principal_axes
from rotor.quantum.internal_rotation.two_tops import TwoTops, torsional_kinetics

ANGLE = "angle"  # of ρ from the axis a
RELATIVE_STEP, ANGLE_STEP = 1e-5, 1e-5  # of the differences, which are then exact to 1e-10; angles in radians


@dataclass(frozen=True, eq=False)
class ChainRule:
    """Quantities q that follow from the constants c: their names, those of the constants, and ∂q/∂c (quantities, constants)."""

    quantities: tuple[str, ...]
    constants: tuple[str, ...]
    jacobian: Floats

    def slopes(self, names: Sequence[str], direct: Mapping[str, Floats], count: int) -> Floats:
        """dE/dc (count, names) from the slopes (count,) by every coefficient and quantity."""
        none = np.zeros(count)
        total = np.column_stack([direct.get(name, none) for name in names])
        if self.quantities:
            columns = [names.index(name) for name in self.constants]
            total[:, columns] += np.column_stack([direct[name] for name in self.quantities]) @ self.jacobian
        return total


NO_CHAIN = ChainRule((), (), np.zeros((0, 0)))


def chain_rule(model: RamModel | TwoTops, values: Mapping[str, float]) -> ChainRule:
    """How F, ρ and angles of a model follow from constants of principal axes; nothing of constants of the rho-axis frame."""
    if isinstance(model, TwoTops):
        angles = [name for name in values if name.startswith(("F0_", "delta_", "epsilon_"))]
        return _rule(_of_two, values, ["F1", "F2", "F12", *model.slopes_by_rho((0, 0))], [*"ABC", *angles])
    if "F0" not in values:
        return NO_CHAIN
    return _rule(_of_one, values, ["F", "rho", ANGLE], [*"ABC", "F0", "delta"])


def further_operators(model: RamModel | TwoTops, species: str, chain: ChainRule) -> dict[str, list[Product]]:
    """∂H/∂q of the quantities that are no coefficients."""
    if isinstance(model, TwoTops):
        return model.slopes_by_rho(model.species[species])
    return {ANGLE: model.slope_by_angle(model.species[species])} if ANGLE in chain.quantities else {}


def _of_one(values: Mapping[str, float]) -> dict[str, float]:
    model = model_of_principal_axes(values)
    return {"F": model.values["F"], "rho": model.values["rho"], ANGLE: model.angle}


def _of_two(values: Mapping[str, float]) -> dict[str, float]:
    f, rho = torsional_kinetics(values, values)
    along = {f"rho_{i + 1}{letter}": float(rho[i, g]) for i in (0, 1) for g, letter in enumerate("abc")}
    return {"F1": float(f[0, 0]), "F2": float(f[1, 1]), "F12": float(f[0, 1])} | along


def _rule(
    closed_form: Callable[[Mapping[str, float]], Mapping[str, float]],
    values: Mapping[str, float],
    quantities: Sequence[str],
    constants: Sequence[str],
) -> ChainRule:
    """Quantities by constants, with central differences."""
    jacobian = np.zeros((len(quantities), len(constants)))
    for column, name in enumerate(constants):
        step = ANGLE_STEP if name.startswith(("delta", "epsilon")) else RELATIVE_STEP * values[name]
        up, down = (closed_form({**values, name: values[name] + sign * step}) for sign in (1, -1))
        jacobian[:, column] = [(up[q] - down[q]) / (2 * step) for q in quantities]
    return ChainRule(tuple(quantities), tuple(constants), jacobian)
