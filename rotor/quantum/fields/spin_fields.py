"""States of a top with nuclear (or electron) spins in a field along Z: the levels of every F, each with its M_F.

The spins are coupled first, with every effect of the list, and their levels are what the field mixes. An operator of rank K
that is fixed in the molecule or made of N and spins has, between them,

    ⟨F'τ'M|T^K_0|F τ M⟩ = (-1)^(F'-M) (F' K F; -M 0 M) ⟨F'τ'‖T^K‖F τ⟩

(R. N. Zare, Angular Momentum, 1988, eq. 5.14), the reduced elements those of `rotor.quantum.spins`. Nothing is taken as small: where the
field is strong the spins come apart by themselves, as long as N max is high enough. M_F is given doubled to `SpinSpace.blocks`.

Magnetic field: -μ_N B [½ Σ g_ij {Φ_Zi, N_j} + Σ_spins g_I I_Z], the shielding of the nuclei neglected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldSpace, FreeLevels
from rotor.quantum.fields.wang_blocks import coloured_components
from rotor.quantum.spins import scheme_of
from rotor.quantum.spins.blocks import SpinBlock, product
from rotor.quantum.spins.coupling import moment_coefficients, patterns
from rotor.quantum.spins.levels import spin_levels
from rotor.quantum.spins.lines import amplitudes
from rotor.quantum.spins.operators import AxialState, CosinesWithN
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.tensors import BodyTensor, body_tensor
from rotor.quantum.wigner import three_j

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

Z = (0.0, 0.0, 1.0)
Tensors = dict[tuple[int, int], BodyTensor]
Reduced = Callable[[SpinBlock, SpinBlock], NDArray[Any] | None]


@dataclass(frozen=True)
class SpinFreeLevels(FreeLevels):
    """Levels with spins: j is N; half-integer quanta are stored doubled, `halves` names them."""

    halves: frozenset[str] = frozenset()

    def label(self, row: int) -> str:
        """Quantum numbers of a row as text, N first, F last: `1 0 1 3/2`."""
        texts = [str(int(self.j[row]))]
        for name, values in self.quanta.items():
            value = int(values[row])
            texts.append(f"{value}/2" if name in self.halves else str(value))
        return " ".join(texts)


@dataclass(frozen=True)
class Magnet:
    """What a magnetic field acts on: the rotational g tensor (3, 3) along a, b, c, and g of nuclei by the names of the spins."""

    g: Floats
    nuclei: Mapping[str, float]


@dataclass(frozen=True)
class SpinFieldBlock(FieldBlock):
    """States |F τ M⟩ of the solved blocks `members`, of one M_F."""

    m: float
    twice_m: int
    species: str
    copies: int
    members: tuple[int, ...]
    rows: Ints = field(repr=False)
    space: SpinSpace = field(repr=False)

    @property
    def even_in_field(self) -> bool:
        """Where K is good and neither it nor M is 0, a reversed field exchanges K and -K."""
        return not (axial_k_of(self) and self.twice_m)

    @property
    def label(self) -> str:
        """Which block it is."""
        return self.species

    @property
    def levels(self) -> FreeLevels:
        """The levels of the space."""
        return self.space.levels

    def matrix(self, contraction: Contraction) -> NDArray[Any]:
        """The contraction over the states (n, n), Hermitian; real where K is good, and for tensors."""
        out = self._filled(contraction.rank, self.space.reduced(contraction))
        out[np.diag_indices(len(out))] += contraction.scalar
        return np.ascontiguousarray(out.real) if not out.imag.any() else out

    def moment(self, magnet: Magnet) -> Floats:
        """½ Σ g_ij {Φ_Zi, N_j} + Σ g_I I_Z over the states (n, n), real symmetric."""
        return np.ascontiguousarray(self._filled(1, self.space.magnetic(magnet)).real)

    def _filled(self, rank: int, reduced: Reduced) -> NDArray[np.complex128]:
        solved = [self.space.solved[i] for i in self.members]
        edges = np.cumsum([0, *(len(one.energies_mhz) for one in solved)])
        out = np.zeros((edges[-1], edges[-1]), dtype=np.complex128)
        for i, first in enumerate(solved):
            for k, second in enumerate(solved[: i + 1]):
                (a, up), (b, low) = sorted(((i, first), (k, second)), key=lambda one: (-one[1].twice_f, -one[0]))
                factor = _in_space(up.twice_f, low.twice_f, rank, self.twice_m)
                found = reduced(up, low) if factor else None
                if found is None:
                    continue
                rows, columns = slice(edges[a], edges[a + 1]), slice(edges[b], edges[b + 1])
                out[rows, columns] += factor * found
                if a != b:
                    out[columns, rows] += factor * found.conj().T
        return out


def _in_space(twice_up: int, twice_low: int, rank: int, twice_m: int) -> float:
    """(-1)^(F'-M) (F' K F; -M 0 M) of doubled F and M.

    >>> round(_in_space(2, 0, 1, 0), 6)  # 1/√3 but for the sign
    0.57735
    """
    if not abs(twice_up - twice_low) <= 2 * rank <= twice_up + twice_low or abs(twice_m) > min(twice_up, twice_low):
        return 0.0
    symbol = float(three_j(twice_up / 2, rank, twice_low / 2, -twice_m / 2, 0, twice_m / 2))
    return -symbol if (twice_up - twice_m) // 2 % 2 else symbol


@dataclass(frozen=True)
class SpinSpace(FieldSpace):
    """Solved F blocks with N up to J max and everything that will act on them; `magnet` makes M and -M differ."""

    levels: SpinFreeLevels = field(repr=False)
    jmax: int
    representation: str
    solved: tuple[SpinBlock, ...] = field(repr=False)
    contractions: tuple[Contraction, ...]
    magnet: Magnet | None = None

    def blocks(self, m: int) -> list[FieldBlock]:
        """Connected sets of F blocks, for a doubled M_F: of ±M in an electric field, M ≥ 0, and of M in a magnetic one."""
        nodes = [i for i, block in enumerate(self.solved) if block.twice_f >= abs(m)]
        edges = [(a, b, 0) for a, b in self._edges(nodes, m)]
        out: list[FieldBlock] = []
        for members, _, _ in coloured_components(nodes, edges):
            k = axial_k(self.solved[members[0]]) or 0
            both = 2 if k else 1
            if self.magnet is not None:
                out.append(self._block(m, both, members))
            elif k and m:  # (K, M) is like (-K, -M)
                out += [self._block(m, both, members), self._block(-m, both, members)]
            else:
                out.append(self._block(m, both * (2 if m else 1), members))
        return out

    def _block(self, twice_m: int, copies: int, members: list[int]) -> SpinFieldBlock:
        solved = [self.solved[i] for i in members]
        rows = np.concatenate([np.arange(one.start, one.start + len(one.energies_mhz)) for one in solved])
        k = axial_k(solved[0])
        first = min(members)
        name = f"k={k}" if k is not None else f"from F block {first}"
        m = twice_m / 2 if twice_m % 2 else twice_m // 2
        return SpinFieldBlock(m, twice_m, name, copies, tuple(members), rows, self)

    def _edges(self, nodes: list[int], twice_m: int) -> Iterator[tuple[int, int]]:
        acting = [(one.rank, self.reduced(one)) for one in self.contractions]
        if self.magnet is not None:
            acting.append((1, self.magnetic(self.magnet)))
        for place, i in enumerate(nodes):
            for k in nodes[: place + 1]:
                up, low = sorted((self.solved[i], self.solved[k]), key=lambda one: -one.twice_f)
                for rank, reduced in acting:
                    if _in_space(up.twice_f, low.twice_f, rank, twice_m) and reduced(up, low) is not None:
                        yield i, k
                        break

    @cached_property
    def _known(self) -> dict[Any, Any]:
        return {}

    def _once(self, key: Any, up: SpinBlock, low: SpinBlock, make: Callable[[], NDArray[Any]]) -> NDArray[Any] | None:
        """Elements made once for all M; None where all are 0."""
        place = (key, up.start, low.start)
        if place not in self._known:
            found = make()
            self._known[place] = found if np.abs(found).max(initial=0.0) > 0 else None
        found_: NDArray[Any] | None = self._known[place]
        return found_

    def reduced(self, contraction: Contraction) -> Reduced:
        """Reduced elements of a contraction: of a vector i times real over Wang functions, real where K is good."""
        key = (contraction.body.tobytes(), contraction.rank)
        tensors = self._known.setdefault(
            key, {(0, 0): body_tensor(contraction.body, contraction.rank, self.representation)}
        )
        size = _along_z(contraction)

        def make(up: SpinBlock, low: SpinBlock) -> NDArray[Any]:
            if axial_k(up) != axial_k(low):
                return np.zeros((len(up.energies_mhz), len(low.energies_mhz)))
            found = amplitudes(up, low, tensors)
            if axial_k(up) is not None:
                return found / np.sqrt(2.0) if axial_k(up) else found  # that of one sign of K
            return 1j * found if contraction.rank % 2 else found

        def scaled(up: SpinBlock, low: SpinBlock) -> NDArray[Any] | None:
            found = self._once(key, up, low, lambda: make(up, low))
            return None if found is None else size * found

        return scaled

    def magnetic(self, magnet: Magnet) -> Reduced:
        """Reduced elements of the magnetic moment, real."""
        return lambda up, low: self._once("magnet", up, low, lambda: _moment(self, magnet, up, low))


def _along_z(contraction: Contraction) -> float:
    space = contraction.space
    if contraction.rank == 1:
        return float(space[2])
    return float((2 * space[2, 2] - space[0, 0] - space[1, 1]) / np.sqrt(6))


def axial_k(block: SpinBlock) -> int | None:
    """|K| of a block where K is good, None where functions are those of Wang."""
    basis = block.parts[0].rotor.parts[0].basis
    return basis.axial_k if isinstance(basis, AxialState) else None


def axial_k_of(block: SpinFieldBlock) -> int | None:
    """|K| of the states of a block of the field, None where functions are those of Wang."""
    return axial_k(block.space.solved[block.members[0]])


def _moment(space: SpinSpace, magnet: Magnet, up: SpinBlock, low: SpinBlock) -> Floats:
    scheme = low.shared.scheme
    out = np.zeros((up.vectors.shape[0], low.vectors.shape[1]))
    if abs(up.twice_f - low.twice_f) <= 2:
        rotor = CosinesWithN(tuple(tuple(row) for row in magnet.g.tolist()))  # type: ignore[arg-type]
        acting = [(None, 1.0), *((scheme.place(name), value) for name, value in magnet.nuclei.items())]
        for place, value in acting:
            t = _coefficients(space, up, low, place)
            for target in up.parts:
                for source in low.parts:
                    element = (
                        _of_rotor(rotor, target, source, space.representation)
                        if place is None
                        else _same(target, source)
                    )
                    if element is not None:
                        own = product(value * t[target.patterns, source.patterns], element)
                        out[target.place] += own @ low.vectors[source.place]
    return np.asarray(up.vectors.T @ out)


def _coefficients(space: SpinSpace, up: SpinBlock, low: SpinBlock, place: int | None) -> Floats:
    key = ("patterns", place, up.twice_f, low.twice_f)
    if key not in space._known:
        scheme = low.shared.scheme
        bra, ket = patterns(scheme.twice, up.twice_f), patterns(scheme.twice, low.twice_f)
        found = moment_coefficients(scheme.twice, 1 if place is None else 0, place, bra, ket)
        if scheme.equivalent:
            found = scheme.recoupling(up.twice_f)[1].T @ found @ scheme.recoupling(low.twice_f)[1]
        space._known[key] = found
    out: Floats = space._known[key]
    return out


def _same(target: SpinPart, source: SpinPart) -> Floats | None:
    return np.eye(len(source.rotor.energies_mhz)) if target.number == source.number else None


def _of_rotor(rotor: CosinesWithN, target: SpinPart, source: SpinPart, representation: str) -> Floats | None:
    total: Floats | None = None
    for left in target.rotor.parts:
        for right in source.rotor.parts:
            found = rotor.elements(left.basis, right.basis, representation) if left.v == right.v else None
            if found is not None:
                moved = target.rotor.vectors[left.place].T @ found @ source.rotor.vectors[right.place]
                total = moved if total is None else total + moved
    return total


def spin_field_space(
    top: Top,
    jmax: int,
    effects: Sequence[QuantumEffect],
    contractions: Sequence[Contraction],
    magnet: Magnet | None = None,
) -> SpinSpace:
    """The space of a top with the spins of its effects, N up to `jmax`, for fields along Z.

    Parameters
    ----------
    top : Top
        Constants, kind and spin weights.
    jmax : int
        The highest N.
    effects : sequence of QuantumEffect
        The Hamiltonian without the field, spins among it.
    contractions : sequence of Contraction
        Tensors of the molecule that the field acts on.
    magnet : Magnet, optional
        What a magnetic field acts on.

    Returns
    -------
    SpinSpace
        Solved levels and everything that will act on them.

    Raises
    ------
    ValueError
        For effects without spins, with several states, for fields at an angle, for a g of a nucleus that has no spin
        here, and for a symmetric top with tensors that do not have its axis.
    """
    scheme = scheme_of(top, tuple(effects))
    if not scheme.spins:
        raise ValueError("these effects have no spins; leave them out for a top without spins in a field")
    if any(effect.states(top) for effect in effects):
        raise ValueError("a top with several states in a field is not solved; give the effects of one state")
    if not all(one.along_z for one in contractions):
        raise ValueError("a top with spins is solved in fields along Z alone; leave out the angle")
    axis = {"prolate": 0, "oblate": 2}.get(top.kind)
    acting = contractions if magnet is None else (*contractions, Contraction(magnet.g, np.outer(Z, Z)))
    if axis is not None and not all(one.axial_about(axis) for one in acting):
        raise ValueError("a symmetric top with spins is solved with tensors that have its axis")
    unknown = set(magnet.nuclei) - {spin.name for spin in scheme.spins} if magnet is not None else set()
    if unknown:
        raise ValueError(
            f"g of {', '.join(sorted(unknown))}: the spins of these effects are {', '.join(spin.name for spin in scheme.spins)}"
        )
    solved = spin_levels(top, tuple(effects), 0, jmax)
    quanta = {name: column for name, column in solved.quanta.items() if name != "n"}
    free = SpinFreeLevels(
        solved.rotational, solved.energy_mhz, quanta, solved.weight_per_component, frozenset(solved.halves)
    )
    return SpinSpace(free, jmax, str(solved.representation), solved.blocks, tuple(contractions), magnet)
