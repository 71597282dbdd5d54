"""Linear and symmetric tops in fields along Z: chains of J for each k and M, in closed form.

With θ between the figure axis and Z, cosθ is the component 00 of D^1, and cos²θ = 1/3 + 2/3 D²_00. Over symmetric-top functions |J k M⟩

    ⟨J' k M'|D^K_q0|J k M⟩ = c(J → J', 0, k) c(J → J', q, M) / √((2J'+1)(2J+1))

with c from `rotor.quantum.operators.symmetric_top_elements`; k = 0 gives the functions of a linear molecule.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldOperator, FieldSpace, FreeLevels, Magnet, along
from rotor.quantum.operators.symmetric_top_elements import coupling_to
from rotor.quantum.solve import solve_levels

if TYPE_CHECKING:
    from rotor.tops.top import Top


def _elements(rank: int, j: Ints, rise: int, k: int, m: int, q: int = 0) -> Floats:
    """⟨J+rise k M+q|D^K_q0|J k M⟩ (n,) of rank K."""
    in_body, in_space = coupling_to(j, rise, rank, 0, k), coupling_to(j, rise, rank, q, m)
    return np.asarray(in_body * in_space / np.sqrt((2 * (j + rise) + 1.0) * (2 * j + 1.0)))


@lru_cache(maxsize=4096)
def cosine_bands(power: int, first: int, last: int, step: int, k: int, m: int) -> tuple[Floats, ...]:
    """The main diagonal and the bands beside it of cosθ, or of cos²θ - 1/3, over J = first, first + step ... last.

    >>> cosine_bands(1, 0, 2, 1, 0, 0)[1].round(6).tolist()  # 1/√3, 2/√15
    [0.57735, 0.516398]
    >>> (1 / 3 + cosine_bands(2, 0, 1, 1, 0, 0)[0]).round(6).tolist()  # 1/3, 3/5
    [0.333333, 0.6]
    """
    size = 1.0 if power == 1 else 2 / 3
    j = np.arange(first, last + 1, step)
    return tuple(size * _elements(power, j[: len(j) - rise // step], rise, k, m) for rise in range(0, power + 1, step))


@dataclass(frozen=True)
class AxialSpace(FieldSpace):
    """States |J k M⟩ of a linear or symmetric top with tensors along its axis, in chains of J of one k, the member of each block.

    axis: 0 if the figure axis is a, 2 if it is c. oriented: whether a vector connects J with J ± 1.
    """

    levels: FreeLevels = field(repr=False)
    jmax: int
    axis: int
    oriented: bool
    magnetic: bool = False

    def blocks(self, m: float) -> list[FieldBlock]:
        """The blocks of M. (k, M) has the energies of (-k, -M); without a dipole also of (-k, M), in a magnetic field only of (-k, M).

        A reversed field exchanges K and -K for K M ≠ 0.
        """
        out: list[FieldBlock] = []
        number = int(m)
        for k, rows in self._rows_by_k.items():
            both_signs = self.oriented and number > 0 and not self.magnetic
            rows = rows[max(abs(number) - abs(k), 0) :]
            if not len(rows) or (k < 0 and not both_signs):
                continue
            copies = (2 if number and not self.magnetic else 1) * (2 if k and not both_signs else 1)
            if self.oriented or k * number:
                out.append(FieldBlock(number, copies, f"k={k}", rows, (k,), self, not k * number))
                continue
            for half in (rows[::2], rows[1::2]):
                if len(half):
                    parity = "odd" if int(self.levels.j[half[0]]) % 2 else "even"
                    out.append(FieldBlock(number, copies, f"k={k} J {parity}", half, (k,), self))
        return out

    @cached_property
    def _rows_by_k(self) -> dict[int, Ints]:
        """Rows of the levels by k."""
        k = self.levels.quanta.get("k", np.zeros(len(self.levels), dtype=np.int64))
        return {int(value): np.flatnonzero(k == value) for value in np.unique(k)}

    def matrix(self, block: FieldBlock, operator: FieldOperator) -> Floats:
        """The operator over the states of a block (n, n), real; a vector has no elements where even and odd J are separate."""
        j, (k,), m, size = block.j, block.members, int(block.m), len(block)
        if isinstance(operator, Magnet):  # g⊥ M + (g∥ - g⊥) k cosθ
            on_diagonal = m * (np.trace(operator.g) - operator.g[self.axis, self.axis]) / 2
            factor = k * along(operator.g, self.axis)
        else:
            on_diagonal = operator.scalar
            factor = along(operator.body, self.axis) * along(operator.space, 2)
        step = int(j[1] - j[0]) if size > 1 else 1
        out = np.zeros(size * size)
        for n, band in enumerate(cosine_bands(operator.rank, int(j[0]), int(j[-1]), step, k, m)):
            out[n : size * (size - n) : size + 1] = out[n * size :: size + 1] = factor * band
        out[:: size + 1] += on_diagonal
        return out.reshape(size, size)

    def between(self, up: FieldBlock, operator: FieldOperator, low: FieldBlock) -> Floats:
        """Elements of T_q of a vector along the axis; the block of k stands for that of -k at M = 0."""
        out, (k,) = np.zeros((len(up), len(low))), up.members
        size = along(operator.body, self.axis) if isinstance(operator, Contraction) else 0.0
        for rise in (-1, 0, 1):
            rows, columns = np.nonzero(up.j[:, None] == low.j + rise)
            out[rows, columns] = size * _elements(1, low.j[columns], rise, k, int(low.m), round(up.m - low.m))
        return out


def axial_levels(top: Top, jmax: int) -> FreeLevels:
    """Levels of a linear or symmetric top by K, then J; K and -K are separate levels."""
    solved = solve_levels(top, jmax)
    j, each = solved.rotational, solved.weight_per_component
    if top.kind == "linear":
        return FreeLevels(j, solved.energy_mhz, {}, each)
    k = np.concatenate([solved.quanta["k"], -solved.quanta["k"][solved.quanta["k"] > 0]])
    row = np.concatenate([np.arange(len(solved)), np.flatnonzero(solved.quanta["k"] > 0)])
    order = np.lexsort((j[row], k))
    return FreeLevels(j[row][order], solved.energy_mhz[row][order], {"k": k[order]}, each[row][order])
