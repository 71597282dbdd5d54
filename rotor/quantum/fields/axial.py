"""Linear and symmetric tops in fields along Z: chains of J for each k and M, in closed form.

With θ between the figure axis and Z, over symmetric-top functions |J k M⟩,

    ⟨J-1 k M|cosθ|J k M⟩ = √[(J²-k²)(J²-M²)] / (J √(4J²-1)),     ⟨J k M|cosθ|J k M⟩ = kM / (J(J+1))

(C. H. Townes and A. L. Schawlow, Microwave Spectroscopy, 1955, table 4.4; Condon-Shortley phases in space, ⟨J k±1|Jx ∓ iJy|J k⟩
positive in the molecule). k = 0 gives the functions of a linear molecule. cos²θ is the square of a matrix of cosθ with one more J, which
makes it exact for the requested J.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldOperator, FieldSpace, FreeLevels, Magnet, along
from rotor.quantum.solve import solve_levels
from rotor.quantum.symmetric_top_elements import coupling, space_factor

if TYPE_CHECKING:
    from rotor.tops.top import Top


def cosine_bands(j: Ints, k: int, m: int) -> tuple[Floats, Floats]:
    """Diagonal (n,) and the band beside it (n-1,) of cosθ over successive J ≥ max(|k|, |M|).

    >>> cosine_bands(np.arange(3), 0, 0)[1].round(6).tolist()  # 1/√3, 2/√15
    [0.57735, 0.516398]
    """
    j = j.astype(np.float64)
    diagonal = k * m / np.where(j > 0, j * (j + 1), 1.0)
    up = j[1:]
    return diagonal, np.sqrt((up**2 - k * k) * (up**2 - m * m) / (4 * up**2 - 1)) / up


def cosine_squared_bands(j: Ints, k: int, m: int) -> tuple[Floats, Floats, Floats]:
    """The diagonals of cos²θ with ΔJ = 0 (n,), 1 (n-1,) and 2 (n-2,) over successive J ≥ max(|k|, |M|).

    >>> cosine_squared_bands(np.arange(2), 0, 0)[0].round(6).tolist()  # 1/3, 3/5
    [0.333333, 0.6]
    """
    longer = np.append(j, j[-1] + 1)
    d, b = cosine_bands(longer, k, m)
    below = np.concatenate([[0.0], b[:-1]])  # J - 1 to J; zero for the first J
    return d[:-1] ** 2 + below**2 + b**2, (b * (d[:-1] + d[1:]))[:-1], (b[:-1] * b[1:])[:-1]


@lru_cache(maxsize=4096)
def _cosines(power: int, first: int, last: int, k: int, m: int) -> tuple[Floats, ...]:
    """Bands of cosθ (power 1) or cos²θ (power 2) over J = first ... last."""
    return (cosine_bands if power == 1 else cosine_squared_bands)(np.arange(first, last + 1), k, m)


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

    def dense(self, block: FieldBlock, operator: FieldOperator) -> Floats:
        """The operator over the states of a block (n, n), real; a vector has no elements where even and odd J are separate."""
        if isinstance(operator, Magnet):
            return self._moment(block, operator.g)
        size = len(block)
        out = np.zeros(size * size)
        for n, band in enumerate(self._bands(block, operator)):
            out[n : size * (size - n) : size + 1] = out[n * size :: size + 1] = band
        return out.reshape(size, size)

    def _bands(self, block: FieldBlock, contraction: Contraction) -> list[Floats]:
        """Diagonals of the matrix over a block, the main one first; at most three."""
        size = along(contraction.body, self.axis) * along(contraction.space, 2)
        j, (k,), m = block.j, block.members, int(block.m)
        first, apart = max(abs(k), abs(m)), len(j) > 1 and int(j[1] - j[0]) == 2
        skip = int(j[0]) - first
        bands = _cosines(contraction.rank, first, int(j[-1]), k, m)
        if contraction.rank == 1:
            return [] if apart else [size * band[skip:] for band in bands]
        d, next_j, second_j = (band[skip:] for band in bands)
        main = contraction.scalar + size * (d[:: 2 if apart else 1] - 1 / 3)
        return [main, size * second_j[::2]] if apart else [main, size * next_j, size * second_j]

    def between(self, up: FieldBlock, operator: FieldOperator, low: FieldBlock) -> Floats:
        """Elements of T_q of a vector along the axis; the block of k stands for that of -k at M = 0."""
        out = np.zeros((len(up), len(low)))
        place, (k,) = {int(j): row for row, j in enumerate(up.j)}, up.members
        size = along(operator.body, self.axis) if isinstance(operator, Contraction) else 0.0
        for column, j in enumerate(low.j.tolist()):
            for above in (j - 1, j, j + 1):
                if above in place:
                    in_body = float(coupling(j, above, 1, 0, k))
                    in_space = space_factor(2 * above, 2 * j, 1, low.twice_m, round(up.m - low.m))
                    out[place[above], column] = size * in_body * in_space
        return out

    def _moment(self, block: FieldBlock, g: Floats) -> Floats:
        """The magnetic moment g⊥ M + (g∥ - g⊥) k cosθ."""
        across, (k,), m = (np.trace(g) - g[self.axis, self.axis]) / 2, block.members, int(block.m)
        diagonal, beside = cosine_bands(block.j, k, m)
        chain = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
        return np.asarray(across * m * np.eye(len(block)) + (g[self.axis, self.axis] - across) * k * chain)


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
