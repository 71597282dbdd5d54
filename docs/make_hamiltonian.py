"""Draws pictures/hamiltonian.png: a block of two states of formaldehyde's size with a Coriolis coupling, its unit matrices and their sum.

python docs/make_hamiltonian.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from rotor.quantum.basis.state_elements import linear_blocks_of
from rotor.quantum.blocks.linear_stacks import LinearBlock
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

ROTATION = Constants(A=9000.0, B=4200.0, C=3300.0)  # MHz
STATES = "E[1]=60000 A[1]=8900 B[1]=4190 C[1]=3290 G_c[0,1]=900 MHz"
J = 9


def main() -> None:
    """Draws the picture beside this file."""
    top = Top(ROTATION, states=StateConstants.parse(STATES))
    effects = effects_of(top, hyperfine=False)
    levels = solve_levels(top, J, jmin=J, effects=effects)
    values = {name: value for effect in effects for name, value in effect.parameters(top).items()}
    block = linear_blocks_of(top, levels, tuple(values), levels.blocks)[0]
    names, factors = list(values), block.factors @ block.mix
    shown = [names[i] for i in block.parameters]
    terms = ["A", "B", "C", "A[1]", "G_c[0,1]"]
    matrices = [_matrix(block, factors[:, shown.index(name)]) for name in terms]
    whole = _matrix(block, factors @ np.array([values[name] for name in shown]))
    figure, axes = plt.subplots(2, 3, figsize=(6.6, 4.6), constrained_layout=True)
    labels = [f"$O$ of {name}" for name in terms] + ["$H$, the sum of all $c_i O_i$"]
    for axis, matrix, label in zip(
        axes.flat, [*matrices, whole - whole[0, 0] * np.eye(len(whole))], labels, strict=True
    ):
        largest = np.abs(matrix).max()
        axis.imshow(matrix, cmap="RdBu_r", vmin=-largest, vmax=largest)
        axis.set_title(label, fontsize=10)
        axis.set_xticks([])
        axis.set_yticks([])
    for axis in axes[:, 0]:
        axis.set_ylabel(f"Functions of J = {J}: v = 0, v = 1", fontsize=9)
    figure.savefig(Path(__file__).with_name("pictures") / "hamiltonian.png", dpi=160)


def _matrix(block: LinearBlock, elements: np.ndarray) -> np.ndarray:
    """A symmetric matrix from its lower triangle."""
    matrix = np.zeros((block.size, block.size))
    matrix[block.rows, block.columns] = matrix[block.columns, block.rows] = elements
    return matrix


if __name__ == "__main__":
    main()
