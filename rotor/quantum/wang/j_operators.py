"""Operators of the molecule-fixed angular momentum of one J, as bands over |J k⟩: sums, products, powers.

⟨J k+q|O|J k⟩ is stored as {q: (2J+1,) over k = -J ... J}. In the right-handed frame x, y, z of a representation the
components obey the anomalous commutators [Jx, Jy] = -i Jz, and with the phases of |J k⟩

    ⟨k|Jz|k⟩ = k,    ⟨k±1|Jx|k⟩ = ½ √(J(J+1) - k(k±1)),    ⟨k±1|Jy|k⟩ = ±(i/2) √(J(J+1) - k(k±1))

(P. R. Bunker and P. Jensen, Molecular Symmetry and Spectroscopy, 2nd ed., eqs. 10-46 and 10-47, with J_m± = Jx ± iJy, where
J_m∓ raises and lowers k). In a left-handed representation the frame x, -y, z is right-handed, so that Jy changes its sign.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.frozen import dataclass
from rotor.quantum.wang.basis import WangBlock
from rotor.tops.operators import axis_order

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class JOperator:
    """An operator of one J: bands[q] holds ⟨k+q|O|k⟩ over k = -J ... J, (2J+1,) complex, zero where k + q is beyond J."""

    j: int
    bands: dict[int, Complexes]

    def __add__(self, other: JOperator) -> JOperator:
        zero = np.zeros(2 * self.j + 1, dtype=np.complex128)
        orders = {*self.bands, *other.bands}
        return JOperator(self.j, {q: self.bands.get(q, zero) + other.bands.get(q, zero) for q in orders})

    def __mul__(self, factor: complex) -> JOperator:
        return JOperator(self.j, {q: factor * band for q, band in self.bands.items()})

    __rmul__ = __mul__

    def __sub__(self, other: JOperator) -> JOperator:
        return self + (-1.0) * other

    def __matmul__(self, other: JOperator) -> JOperator:
        """The product O P: ⟨k+q+p|O|k+p⟩⟨k+p|P|k⟩ summed over p."""
        size = 2 * self.j + 1
        bands: dict[int, Complexes] = {}
        for p, right in other.bands.items():
            for q, left in self.bands.items():
                if abs(p + q) < size:
                    product = _shifted(left, p) * right
                    bands[p + q] = bands[p + q] + product if p + q in bands else product
        return JOperator(self.j, bands)

    def __pow__(self, exponent: int) -> JOperator:
        result = identity(self.j)
        for _ in range(exponent):
            result = result @ self
        return result

    @property
    def matrix(self) -> Complexes:
        """The full matrix (2J+1, 2J+1), k rising from -J."""
        size = 2 * self.j + 1
        out = np.zeros((size, size), dtype=np.complex128)
        for q, band in self.bands.items():
            columns = np.arange(max(0, -q), min(size, size - q))
            out[columns + q, columns] = band[columns]
        return out


def _shifted(band: Complexes, p: int) -> Complexes:
    """The band at k + p for each k; zero where that is beyond J."""
    out = np.zeros_like(band)
    first, last = max(0, -p), min(len(band), len(band) - p)
    out[first:last] = band[first + p : last + p]
    return out


def identity(j: int) -> JOperator:
    """The unit operator."""
    return JOperator(j, {0: np.ones(2 * j + 1, dtype=np.complex128)})


def anticommutator(left: JOperator, right: JOperator) -> JOperator:
    """O P + P O."""
    return left @ right + right @ left


def j_z(j: int) -> JOperator:
    """Jz, the component along the z of the representation."""
    return JOperator(j, {0: np.arange(-j, j + 1).astype(np.complex128)})


def raising(j: int) -> JOperator:
    """Jx - iJy in the right-handed frame, which raises k by one."""
    k = np.arange(-j, j + 1)
    return JOperator(j, {1: np.sqrt((j * (j + 1.0) - k * (k + 1)).clip(0)).astype(np.complex128)})


def lowering(j: int) -> JOperator:
    """Jx + iJy in the right-handed frame, which lowers k by one."""
    k = np.arange(-j, j + 1)
    return JOperator(j, {-1: np.sqrt((j * (j + 1.0) - k * (k - 1)).clip(0)).astype(np.complex128)})


@lru_cache(maxsize=128)
def components(j: int, representation: str) -> Mapping[str, JOperator]:
    """Ja, Jb, Jc of one J in |J k⟩ of a representation.

    >>> operators = components(2, "IIIr")
    >>> commutator = operators["a"] @ operators["b"] - operators["b"] @ operators["a"]
    >>> bool(abs((commutator + 1j * operators["c"]).matrix).max() < 1e-15)
    True
    """
    up, down = raising(j), lowering(j)
    sense = -1.0 if representation.endswith("l") else 1.0
    along_x, along_y = 0.5 * (up + down), sense * 0.5j * (up - down)
    return MappingProxyType(dict(zip(axis_order(representation), (along_x, along_y, j_z(j)), strict=True)))


def half_turn(j: int, representation: str, axis: str) -> JOperator:
    """C2a, C2b or C2c over |J k⟩, with the characters of `basis` in Wang functions.

    >>> half_turn(1, "Ir", "a").matrix.real.diagonal().tolist(), half_turn(1, "Ir", "b").matrix.real[0].tolist()
    ([-1.0, 1.0, -1.0], [0.0, 0.0, -1.0])
    """
    k = np.arange(-j, j + 1)
    along = axis_order(representation).index(axis)
    if along == 2:
        return JOperator(j, {0: (1.0 - 2.0 * (k % 2)).astype(np.complex128)})
    signs = 1.0 - 2.0 * ((j + along * k) % 2)  # |k⟩ becomes ±|-k⟩
    return JOperator(j, {-2 * int(each): np.where(k == each, signs, 0).astype(np.complex128) for each in k})


def between_species(operator: JOperator, representation: str, pairs: Collection[tuple[str, str]]) -> JOperator:
    """Σ P_s O P_t over pairs of species (s, t), where P_s projects on functions of species s.

    >>> whole = components(2, "Ir")["a"]
    >>> float(abs(between_species(whole, "Ir", [("ee", "ee")]).matrix).max()), len(between_species(whole, "Ir", [("ee", "eo")]).bands)
    (0.0, 9)
    """
    j, matrix = operator.j, operator.matrix
    turns = {axis: half_turn(j, representation, axis).matrix for axis in "ac"}
    unit, sign = np.eye(2 * j + 1), {"e": 1.0, "o": -1.0}
    project = {
        ka + kc: (unit + sign[ka] * turns["a"]) @ (unit + sign[kc] * turns["c"]) / 4 for ka in "eo" for kc in "eo"
    }
    total = sum((project[s] @ matrix @ project[t] for s, t in pairs), np.zeros_like(matrix))
    bands = {}
    for q in range(-2 * j, 2 * j + 1):
        columns = np.arange(max(0, -q), min(2 * j + 1, 2 * j + 1 - q))
        bands[q] = np.zeros(2 * j + 1, dtype=np.complex128)
        bands[q][columns] = total[columns + q, columns]
    return JOperator(j, bands)


def phase(block: WangBlock) -> complex:
    """The factor that makes a Wang function invariant under time reversal: 1, or i where s differs from (-1)^K.

    Over functions with this factor all Hermitian operators that are even under time reversal are real (their matrix over |J k⟩ obeys
    M(-k', -k) = (-1)^(k'-k) M(k', k)*).
    """
    return 1.0 if block.sign == (-1) ** block.first_k else 1j


def between_blocks(up: WangBlock, low: WangBlock, operator: JOperator) -> Complexes:
    """⟨K' s'|O|K s⟩ between two Wang blocks of one J, with the factors of `phase`, (up.size, low.size).

    |K s⟩ = (|K⟩ + s|-K⟩)/√2 for K > 0, |0⟩ for K = 0.
    """
    if len(operator.bands) > _FEW_BANDS:
        return _between_by_full_matrix(up, low, operator.matrix)
    out = np.zeros((up.size, low.size), dtype=np.complex128)
    for q, band in operator.bands.items():
        if (low.first_k + q - up.first_k) % 2 == 0:  # K in steps of 2
            for rows, columns, at, factor in _places(up, low, q):
                out[rows, columns] += band[at] * factor  # a column occurs once
    return out


_FEW_BANDS = 24  # only operators times a half turn across z have more; these have all bands


def _between_by_full_matrix(up: WangBlock, low: WangBlock, matrix: Complexes) -> Complexes:
    """Elements between two Wang blocks from the full matrix over k."""
    sides = []
    for block in (up, low):
        function = np.zeros((len(matrix), block.size))
        places = np.arange(block.size)
        amplitude = np.where(block.k == 0, 1.0, np.sqrt(0.5))
        function[block.j - block.k, places] = block.sign * amplitude
        function[block.j + block.k, places] = amplitude
        sides.append(function)
    return np.asarray(np.conj(phase(up)) * phase(low) * (sides[0].T @ matrix @ sides[1]))


@lru_cache(maxsize=4096)
def _places(up: WangBlock, low: WangBlock, q: int) -> tuple[tuple[Ints, Ints, Ints, Complexes], ...]:
    """For k and for -k: rows and columns between two blocks, places in the band, and factors of the elements of a band."""
    j, k, places = low.j, low.k, []
    turn = np.conj(phase(up)) * phase(low)
    for side in (1, -1):
        columns = np.flatnonzero(k > 0) if side < 0 else np.arange(low.size)
        amplitude = np.where(k[columns] == 0, 1.0, np.sqrt(0.5)) * (low.sign if side < 0 else 1)
        target = side * k[columns] + q
        place = (np.abs(target) - up.first_k) // 2
        inside = (np.abs(target) >= up.first_k) & (place < up.size)
        chosen, goal = columns[inside], target[inside]
        back = np.where(goal == 0, 1.0, np.sqrt(0.5)) * np.where(goal < 0, up.sign, 1)
        if len(chosen):
            places.append((place[inside], chosen, side * k[chosen] + j, turn * amplitude[inside] * back))
    return tuple(places)
