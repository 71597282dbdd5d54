"""A magnetic field along Z on the moment that rotation makes: the Zeeman effect of molecules without electron spin.

    H = H0 - μ_N B ½ Σ_ij g_ij (Φ_Zi J_j + J_j Φ_Zi),           μ_N/h = 7.6226 MHz/T

with the rotational g tensor along a, b, c (W. H. Flygare, Chem. Rev. 74, 653 (1974), eq. 8), Φ_Zi the direction cosines and J_j in the
molecule. A linear top has J across its axis alone, so that H = -g μ_N B J_Z and E = E0 - g μ_N B M exactly; a symmetric top has
g⊥ J_Z + (g∥ - g⊥) Φ_Zz J_z. M is good, and M and -M differ. To second order the magnetisability χ acts,

    -½ B² χ_ZZ,          1e-6 erg/(G² mol) = 0.0250607 MHz/T²,

which is some 0.1 MHz/T² for an anisotropy of ten of these units. With effects that have spins, -μ_N B Σ g_I I_Z is added, the shielding
of the nuclei neglected.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.stark import doubled_m
from rotor.quantum.fields.blocks import AxialBlock, AxialSpace, Contraction, FieldBlock, FieldSpace, FreeLevels
from rotor.quantum.fields.direction_cosines import cosine_bands
from rotor.quantum.fields.field_map import FieldMap, field_map
from rotor.quantum.fields.map_request import (
    BlockProblem,
    KnownSpaces,
    MapRequest,
    checked_fields,
    checked_tolerance_mhz,
)
from rotor.quantum.fields.space import axial_levels
from rotor.quantum.fields.wang_blocks import WangBlockInField, WangSpace, coloured_components, wang_space
from rotor.quantum.reduced import wang_amplitudes
from rotor.quantum.tensors import BodyTensor, body_tensor
from rotor.quantum.wang.j_operators import between_blocks, components
from rotor.units import AVOGADRO_PER_MOL, NUCLEAR_MAGNETON_MHZ_PER_T, PLANCK_J_S

if TYPE_CHECKING:
    from rotor.quantum.fields.spin_fields import Magnet, SpinFieldBlock
    from rotor.quantum.levels import SolvedBlock
    from rotor.tops.top import Top

Moment = Callable[[FieldBlock], Floats]  # magnetic moment along Z in the states of a block
HIGHEST_TESLA = 1000.0
DEFAULT_TOLERANCE_MHZ = 1e-6
MHZ_PER_T2 = 1e-11 / (AVOGADRO_PER_MOL * PLANCK_J_S)  # of 1e-6 erg/(G² mol), which is 1e-5 J/(T² mol)
Z = (0.0, 0.0, 1.0)
_PRODUCTS = {"aa": "ee", "bb": "ee", "cc": "ee", "ab": "oe", "ac": "oo", "bc": "eo"}  # change of species by g_ij


def zeeman_map(
    top: Top,
    fields_tesla: ArrayLike,
    g: ArrayLike,
    *,
    magnetisability: ArrayLike | None = None,
    effects: Sequence[QuantumEffect] = (),
    nuclear_g: Mapping[str, float] | None = None,
    j_highest: int = 2,
    jmax: int | None = None,
    tolerance_mhz: float = DEFAULT_TOLERANCE_MHZ,
    executor: Executor | None = None,
) -> FieldMap:
    """Energies of a top against a magnetic field along Z.

    Parameters
    ----------
    top : Top
        Linear, symmetric or asymmetric.
    fields_tesla : (n,)
        Each once, in rising order.
    g : float, (3,) or (3, 3)
        Rotational g tensor along a, b, c; one number or three for a linear top, whose g_aa does nothing.
    magnetisability : (3,) or (3, 3), optional
        χ along a, b, c in 1e-6 erg/(G² mol), with its sign (diamagnetic: negative).
    effects : sequence of QuantumEffect
        The Hamiltonian of a linear or asymmetric top with spins, the semi-rigid ones with them; states are |F M_F⟩ then.
    nuclear_g : mapping, optional
        g = μ/(μ_N I) of nuclei by the names of their spins; those that are left out do not feel the field.
    j_highest : int
        States that belong to free levels up to this J.
    jmax : int, optional
        Of the basis; by default chosen.
    tolerance_mhz : float
        Of energies.
    executor : Executor, optional
        Blocks are spread over it.

    Returns
    -------
    FieldMap
        Columns field_tesla, m (with its sign), rank, energy_mhz, label, moment_nuclear_magnetons (-dE/dB), block, ...

    Raises
    ------
    ValueError
        For a g tensor or a magnetisability that does not have the symmetry of a linear or symmetric top, fields beyond 1000 T, and g
        of nuclei that the effects do not have.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> found = zeeman_map(Top.from_constants("B=6000 MHz"), [0.0, 1.0], -0.03, j_highest=1)
    >>> rows = found.curve("1", 1)
    >>> (found.energy_mhz[rows] - 12000).round(4).tolist()  # 0.03 μ_N B
    [0.0, 0.2287]
    """
    tensor, nuclei = checked_g(top, g), dict(nuclear_g or {})
    if nuclei and not effects:
        raise ValueError("nuclear_g: give the effects that have these spins too")
    square = None if magnetisability is None else Contraction(_axial_tensor(top, magnetisability, "χ"), np.outer(Z, Z))
    contractions = () if square is None else (square,)
    space: Callable[[int], FieldSpace] = partial(_space, top, tensor, contractions)
    moment: Moment = partial(_moment, tensor)
    m_values = tuple(range(-j_highest, j_highest + 1))
    if effects:
        from rotor.quantum.fields.spin_fields import Magnet, spin_field_space

        magnet = Magnet(tensor, nuclei)
        space = partial(spin_field_space, top, effects=tuple(effects), contractions=contractions, magnet=magnet)
        moment = partial(_moment_with_spins, magnet)
        positive = doubled_m(top, effects, None, j_highest)
        m_values = tuple(sorted({*positive, *(-m for m in positive)}))
    request = MapRequest(
        space=KnownSpaces(space),
        problem=partial(_problem, moment, square),
        fields=checked_fields(fields_tesla, "T", HIGHEST_TESLA),
        j_highest=j_highest,
        m_values=m_values,
        tolerance_mhz=checked_tolerance_mhz(tolerance_mhz),
        field_name="field_tesla",
        slope_name="moment_nuclear_magnetons",
        slope_unit_mhz=NUCLEAR_MAGNETON_MHZ_PER_T,
        reach=1 if square is None else 2,
    )
    return field_map(request, jmax, executor)


def checked_g(top: Top, g: ArrayLike) -> Floats:
    """The g tensor (3, 3) along a, b, c; ValueError where it is not finite or does not fit the kind of top."""
    if top.kind == "spherical":
        raise ValueError("a spherical top has an isotropic g: E = E0 - g μ_N B M; no map is needed")
    return _axial_tensor(top, g, "g")


def _axial_tensor(top: Top, given: ArrayLike, name: str) -> Floats:
    """A tensor (3, 3) from one number, three or all of it; ValueError where it does not have the symmetry of the top."""
    array = np.asarray(given, dtype=np.float64)
    tensor = np.diag(np.broadcast_to(array, 3)) if array.ndim < 2 and array.size in (1, 3) else array
    if tensor.shape != (3, 3) or not np.isfinite(tensor).all():
        raise ValueError(f"a {name} tensor is one number, three, or (3, 3), finite; got {array.tolist()}")
    if top.kind != "asymmetric":
        axis = 2 if top.kind == "oblate" else 0
        if not Contraction(tensor, np.outer(Z, Z)).axial_about(axis):
            raise ValueError(
                f"the {name} tensor of a {top.kind} top is symmetric about {'abc'[axis]}; got {tensor.tolist()}"
            )
    return np.array(tensor)


@dataclass(frozen=True)
class _MagneticSpace(FieldSpace):
    """Blocks of one signed M: those of the free space joined where the g tensor connects them."""

    levels: FreeLevels = field(repr=False)
    jmax: int
    free: AxialSpace | WangSpace
    g: Floats = field(repr=False)

    def blocks(self, m: int) -> list[FieldBlock]:
        """Of one signed M; K and -K coincide."""
        if isinstance(self.free, AxialSpace):
            found = AxialSpace(self.levels, self.jmax, self.free.axis, True).blocks(abs(m))
            chains = [one for one in found if isinstance(one, AxialBlock) and one.k >= 0]
            return [AxialBlock(m, one.k, 2 if one.k else 1, 1, one.axis, one.rows, one.space) for one in chains]
        return [
            self.free.block_of(m, 1, members, colours, True)
            for members, colours, _ in coloured_components(*self._graph(abs(m)))
        ]

    def _graph(self, m: int) -> tuple[list[int], list[tuple[int, int, int]]]:
        """Wang blocks with J ≥ m, and pairs that g connects."""
        assert isinstance(self.free, WangSpace)
        solved = self.free.solved
        nodes = [i for i, block in enumerate(solved) if block.basis.j >= m]
        edges = []
        for low in nodes:
            for up in nodes:
                a, b = solved[up].basis, solved[low].basis
                change = "".join("e" if p == q else "o" for p, q in zip(a.species, b.species, strict=True))
                if up != low and 0 <= a.j - b.j <= 1 and change in self._changes:
                    edges.append((up, low, 0))
        here = set(nodes)
        for contraction in self.free.contractions:
            pairs = self.free.connected(contraction)
            edges += [(up, low, 0) for up, low in pairs if up != low and up in here and low in here]
        return nodes, edges

    @cached_property
    def _changes(self) -> set[str]:
        pairs = [(i, j) for i in range(3) for j in range(3) if self.g[i, j]]
        return {_PRODUCTS["".join(sorted("abc"[i] + "abc"[j]))] for i, j in pairs}


def _space(top: Top, g: Floats, contractions: tuple[Contraction, ...], jmax: int) -> FieldSpace:
    if top.kind == "asymmetric":
        free: AxialSpace | WangSpace = wang_space(top, jmax, contractions)
    else:
        free = AxialSpace(axial_levels(top, jmax), jmax, 2 if top.kind == "oblate" else 0, True)
    return _MagneticSpace(free.levels, jmax, free, g)


def _problem(moment: Moment, square: Contraction | None, block: FieldBlock) -> BlockProblem:
    curvature = None if square is None else -0.5 * MHZ_PER_T2 * block.dense(square)
    return BlockProblem(np.diag(block.energies_mhz), -NUCLEAR_MAGNETON_MHZ_PER_T * moment(block), {}, curvature)


def _moment(g: Floats, block: FieldBlock) -> Floats:
    """That of the rotation, in nuclear magnetons (n, n)."""
    return axial_moment(block, g) if isinstance(block, AxialBlock) else _wang_moment(block, g)


def _moment_with_spins(magnet: Magnet, block: FieldBlock) -> Floats:
    return cast("SpinFieldBlock", block).moment(magnet)


def axial_moment(block: AxialBlock, g: Floats) -> Floats:
    """g⊥ M + (g∥ - g⊥) k cosθ over a chain (n, n)."""
    axis = block.axis
    across = (np.trace(g) - g[axis, axis]) / 2
    diagonal, beside = cosine_bands(block.j, block.k, block.m)
    chain = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
    return np.asarray(across * block.m * np.eye(len(block)) + (g[axis, axis] - across) * block.k * chain)


def _wang_moment(block: FieldBlock, g: Floats) -> Floats:
    """½ Σ g_ij (Φ_Zi J_j + J_j Φ_Zi) over the Wang blocks of a top: each product passes through the blocks of the lower J."""
    assert isinstance(block, WangBlockInField)
    space, pairs = block.space, [(i, j) for i in range(3) for j in range(3) if g[i, j]]
    solved = [space.solved[i] for i in block.members]
    edges = np.cumsum([0, *(one.basis.size for one in solved)])
    vectors = [body_tensor(np.eye(3)[i], 1, space.representation) for i in range(3)]
    out = np.zeros((edges[-1], edges[-1]), dtype=np.complex128)
    for column, low in enumerate(solved):
        currents = {j: _current(space, low, "abc"[j]) for _, j in pairs}
        for row, up in enumerate(solved):
            if abs(up.basis.j - low.basis.j) > 1:
                continue
            place = slice(edges[row], edges[row + 1]), slice(edges[column], edges[column + 1])
            for i, j in pairs:
                for middle, moved in currents[j]:
                    out[place] += g[i, j] * _cosines(space, up, middle, vectors[i], block.m) @ moved
    hermitian = (out + out.conj().T) / 2
    return np.ascontiguousarray(hermitian.real)  # time reversal leaves it real in these phases


def _current(space: WangSpace, low: SolvedBlock, axis: str) -> list[tuple[SolvedBlock, NDArray[np.complex128]]]:
    """(block of the same J, J_axis between its states and those of `low`) wherever that is not zero."""
    operator = components(low.basis.j, space.representation)[axis]
    out = []
    for middle in space.solved_of(low.basis.j):
        matrix = middle.vectors.T @ between_blocks(middle.basis, low.basis, operator) @ low.vectors
        if np.abs(matrix).max(initial=0.0) > 0:
            out.append((middle, matrix))
    return out


def _cosines(space: WangSpace, up: SolvedBlock, low: SolvedBlock, tensor: BodyTensor, m: int) -> NDArray[np.complex128]:
    """⟨up, M|Φ_Z|low, M⟩ of a body axis: i times real elements, the conjugate transpose where J' < J."""
    if up.basis.j < low.basis.j:
        return np.asarray(_cosines(space, low, up, tensor, m).conj().T)
    if tensor.between(up.basis, low.basis) is None:
        return np.zeros((up.basis.size, low.basis.size), dtype=np.complex128)
    factor = float(space.space_factor(up.basis.j, low.basis.j, 1)[abs(m)])
    if m < 0 and (up.basis.j + low.basis.j) % 2 == 0:
        factor = -factor
    return np.asarray(1j * factor * wang_amplitudes(up, low, tensor))
