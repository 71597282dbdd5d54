"""Two or three internal rotors in principal axes: products of their torsional functions for each K as a basis of the rotation.

    H = A Pa² + B Pb² + C Pc² + Σ_i [F_i π_i² + ½ V3_i (1 - cos 3α_i) + ½ V6_i (1 - cos 6α_i)]
        + Σ_i<j [F_ij (π_i π_j + π_j π_i) + ½ V_ij (1 - cos 3α_i)(1 - cos 3α_j) + ½ V_ijs sin 3α_i sin 3α_j],        π_i = p_i - ρ_i·P

in principal axes, z along a (H. Hartwig and H. Dreizler, Z. Naturforsch. 51a (1996) 923, for one frame of several tops). For each K the
torsion of top i with ρ_iz K is solved, and the products of lowest energy are retained. The components of ρ across z act between them.
Species are σ of each top; those with all signs reversed have the same energies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import combinations
from typing import Any, ClassVar

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.labelled import Basis, rotation_labels
from rotor.quantum.internal_rotation.contracted import WAVES, ContractedTorsion, Product, Torsion, contracted_torsion
from rotor.quantum.internal_rotation.exchange import TURNS, ExchangedTops, exchange_axis
from rotor.quantum.internal_rotation.frames import IN_PLANE, torsional_kinetics
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.species import SpeciesHamiltonian
from rotor.quantum.internal_rotation.terms import AXES, PRINCIPAL, Axes, component_along, products_of
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.torsion import cosine, p_alpha, sine
from rotor.tops.internal_rotation import DEFAULT_FUNCTIONS, PAIRS, sigma_species

EACH = 9  # functions of each top from which products are formed
ALIKE = 1e-4  # largest difference of the directions (radian) and constants (relative) of equivalent tops: five digits of a file
Species = tuple[int, ...]  # σ of each top: 0, 1 or -1


@dataclass(frozen=True)
class InternalTop:
    """One of several tops: F, V3 and V6 in MHz, ρ along a, b, c."""

    f_mhz: float
    v3_mhz: float
    rho_abc: tuple[float, ...]
    v6_mhz: float = 0.0

    @property
    def torsion(self) -> Torsion:
        """The torsional part, which is solved first for each K."""
        return Torsion(self.f_mhz, self.rho_abc[0], {3: self.v3_mhz, 6: self.v6_mhz})


@dataclass(frozen=True, eq=False)
class ProductTorsion:
    """Products of contracted functions of several tops; retained (products, tops): numbers t1, t2 ... of their factors.

    mixing (K, products, functions): sums of the products of each K that are the functions instead; None for the products themselves.
    """

    tops: tuple[ContractedTorsion, ...]
    retained: Ints
    mixing: Floats | None = None

    @property
    def sigma(self) -> int:
        """0 where σ of all tops is 0, else 1: whether time reversal takes the species to itself."""
        return int(any(top.sigma for top in self.tops))

    @property
    def k_max(self) -> int:
        """The largest |K|."""
        return self.tops[0].k_max

    @property
    def count(self) -> int:
        """Products for each K."""
        return len(self.retained)

    @property
    def is_near_free(self) -> bool:
        """Whether one of the tops turns nearly freely."""
        return any(top.is_near_free for top in self.tops)

    @cached_property
    def energies(self) -> Floats:
        """Sums of torsional energies (K, products)."""
        return np.asarray(sum(top.energies[:, t] for top, t in zip(self.tops, self.retained.T, strict=True)))

    @cached_property
    def parity(self) -> Ints:
        """Sign of the products at K = 0 under reversal of all tops."""
        return reduce(np.multiply, [top.parity[t] for top, t in zip(self.tops, self.retained.T, strict=True)])

    def tables(self, operator: Any, change: int) -> Floats:
        """⟨K + change, t'|o1 o2 ...|K t⟩ as (K, t', t) of one operator for each top, None for the unit operator."""
        operators = (None,) * len(self.tops) if operator is None else operator
        factors = (
            top.tables(factor, change)[:, t[:, None], t]
            for top, factor, t in zip(self.tops, operators, self.retained.T, strict=True)
        )
        tables = reduce(np.multiply, factors)
        if self.mixing is None or (operator is None and not change):
            return tables
        target = np.roll(self.mixing, -change, axis=0)  # tables are 0 where K + change is beyond k_max
        return np.asarray(np.swapaxes(target, 1, 2) @ tables @ self.mixing)


@dataclass(frozen=True)
class SeveralTops:
    """Constants (MHz) of a molecule with several internal rotors: A, B, C and distortion in principal axes, the tops, and their coupling.

    between: F12, V12, V12s, and of three tops F13 ...; missing ones are 0. axis: axis of the C2 rotation that exchanges two equivalent
    tops; "" if they are not equivalent.
    """

    rotation: Mapping[str, float]
    tops: tuple[InternalTop, ...]
    between: Mapping[str, float] = field(default_factory=dict)
    axis: str = ""
    frame: ClassVar[Axes] = PRINCIPAL  # z, x, y = a, b, c

    @property
    def species(self) -> Mapping[str, Species]:
        """(σ1, σ2, ...) by name; each stands for (-σ1, -σ2, ...) too, and AE for EA if two tops are equivalent."""
        names = sigma_species(len(self.tops))
        return {name: sigma for name, sigma in names.items() if name != "EA" or not self.axis}

    @property
    def has_plane(self) -> bool:
        """Whether all ρ lie in the plane ab."""
        return not any(abs(top.rho_abc[2]) > IN_PLANE for top in self.tops)

    @property
    def _pairs(self) -> list[tuple[int, int]]:
        """Numbers, from 0, of two tops."""
        return list(combinations(range(len(self.tops)), 2))

    def ground_energies(self, species: Species, k_max: int) -> Floats:
        """Energies (K,) of the lowest product for K from -k_max to k_max, MHz."""
        return np.asarray(sum(top.energies[:, 0] for top in self._torsions(species, k_max, 1, WAVES)))

    def _torsions(self, species: Species, k_max: int, each: int, waves: int) -> list[ContractedTorsion]:
        """Contracted functions of each top."""
        return [
            contracted_torsion(top.torsion, sigma, k_max, each, waves)
            for top, sigma in zip(self.tops, species, strict=True)
        ]

    def blocks(
        self,
        species: Species,
        jmax: int,
        *,
        jmin: int = 0,
        count: int | None = None,
        each: int = EACH,
        waves: int = WAVES,
        needed: Ints | None = None,
    ) -> SpeciesHamiltonian:
        """The blocks of a species, σ = 0, 1 or -1 of each top, with J from `jmin` to `jmax` or, of these, the `needed` ones.

        count: products of torsional functions retained for each K, the lowest by energy; by default 25 of two tops, 60 of three. each:
        functions of each top that products are made of. waves: k of the free functions runs from -waves to waves.
        """
        torsions = self._torsions(species, jmax, each, waves)
        exchanged = bool(self.axis) and species[0] == species[1]
        if exchanged:
            first = torsions[0]
            reversed_k = replace(first, energies=first.energies[::-1], vectors=first.vectors[::-1])
            torsions[1] = first if self.axis == "a" else reversed_k
        sums = reduce(np.add.outer, [torsion.energies[jmax] for torsion in torsions])
        retained = _lowest(sums, count or DEFAULT_FUNCTIONS[len(self.tops)], exchanged)
        product: Any = ProductTorsion(tuple(torsions), retained)
        matrices = self._torsional_matrices(product, species)
        folded = not any(species) and self.has_plane
        if exchanged:
            number = {pair: i for i, pair in enumerate(map(tuple, retained.tolist()))}
            partner = np.array([number[t2, t1] for t1, t2 in retained.tolist()])
            coupling = matrices[:, np.arange(len(partner)), partner]
            lower = np.where(coupling + coupling[::-1] > 0, -1, 1)  # the same for K and -K
            functions: TorsionRotation = ExchangedTops(product, jmin, jmax, folded, self.axis, partner, lower)
        else:
            if not folded:
                product = replace(product, mixing=np.linalg.eigh(matrices)[1])
            functions = TorsionRotation(product, jmin, jmax, folded)
        chosen = None if needed is None else np.isin(functions.labels["J"], needed)
        return SpeciesHamiltonian(functions, self.terms(species), chosen)

    def terms(self, species: Species) -> Mapping[str, tuple[Product, ...]]:
        """Sums of products by coefficient, in the order of `coefficients`."""
        p, along = [p_alpha(sigma) for sigma in species], self._along
        terms: dict[str, tuple[Product, ...]] = {name: products_of(name, 0) for name in self.rotation}
        for i, sigma in enumerate(species):
            square = Product(UNIT, self._acting({i: p_alpha(sigma, 2)}))
            moving = Product(-2.0 * along[i], self._acting({i: p[i]})), Product(along[i] @ along[i])
            terms[f"F{i + 1}"] = (square, *moving) if any(self.tops[i].rho_abc) else (square,)
            for n in (3, 6):
                terms[f"V{n}_{i + 1}"] = (Product(UNIT, self._acting({i: 0.5 * (UNIT - cosine(n // 3))})),)
        hindering, real_sine = UNIT - cosine(1), -1j * sine(1)
        for i, j in self._pairs:
            pair = f"{i + 1}{j + 1}"
            terms[f"F{pair}"] = (
                Product(2.0 * UNIT, self._acting({i: p[i], j: p[j]})),
                Product(-2.0 * along[j], self._acting({i: p[i]})),
                Product(-2.0 * along[i], self._acting({j: p[j]})),
                Product(2.0 * half_anticommutator(along[i], along[j])),
            )
            terms[f"V{pair}"] = (Product(0.5 * UNIT, self._acting({i: hindering, j: hindering})),)
            terms[f"V{pair}s"] = (Product(-0.5 * UNIT, self._acting({i: real_sine, j: real_sine})),)
        return terms

    def _torsional_matrices(self, product: ProductTorsion, species: Species) -> Floats:
        """The torsion of all tops with F_ij π_i π_j, V_ij and V_ijs over the products of each K (K, products, products).

        The products (1, 0) and (0, 1) of similar tops have nearly equal energies, so that even a small coupling mixes them fully; v_t
        would be shared out at random without it.
        """
        rotation, terms = Basis(rotation_labels(product.k_max, product.k_max)), self.terms(species)
        matrices = np.stack([np.diag(energies) for energies in product.energies])
        for name, value in self.between.items():
            for factor in terms[name] if value else ():
                along_k = np.diag(rotation.elements([factor.rotation]).dense()).real
                matrices += value * along_k[:, None, None] * product.tables(factor.torsion, 0)
        return matrices

    def _acting(self, operators: Mapping[int, Operator]) -> Any:
        """Torsional operators by the number of their top as one for each top, None for the unit operator."""
        return tuple(operators.get(i) for i in range(len(self.tops)))

    @property
    def _along(self) -> list[Operator]:
        """ρ_i·P of each top."""
        return [component_along(top.rho_abc) for top in self.tops]

    def slopes_by_rho(self, species: Species) -> dict[str, list[Product]]:
        """∂H/∂ρ_ig = Σ_j F_ij (-2 p_j P_g + {ρ_j·P, P_g}), F_ii = F_i, by the names rho_1a, rho_1b, ..."""
        p, along, slopes = [p_alpha(sigma) for sigma in species], self._along, {}
        f = np.diag([top.f_mhz for top in self.tops])
        for i, j in self._pairs:
            f[i, j] = f[j, i] = self.between.get(f"F{i + 1}{j + 1}", 0.0)
        for i in range(len(self.tops)):
            for letter, axis in zip("abc", AXES, strict=True):
                slopes[f"rho_{i + 1}{letter}"] = [
                    product
                    for j, factor in enumerate(f[i].tolist())
                    for product in (
                        Product(-2.0 * factor * axis, self._acting({j: p[j]})),
                        Product(2.0 * factor * half_anticommutator(along[j], axis)),
                    )
                ]
        return slopes

    @property
    def coefficients(self) -> Floats:
        """The values of the coefficients, MHz."""
        return np.array([*self.values.values()])

    @property
    def values(self) -> dict[str, float]:
        """The coefficients by name, in the order of `terms`."""
        values = dict(self.rotation)
        for i, top in enumerate(self.tops, 1):
            values |= {f"F{i}": top.f_mhz, f"V3_{i}": top.v3_mhz, f"V6_{i}": top.v6_mhz}
        for i, j in self._pairs:
            pair = f"{i + 1}{j + 1}"
            values |= {name: self.between.get(name, 0.0) for name in (f"F{pair}", f"V{pair}", f"V{pair}s")}
        return values

    @property
    def jacobian(self) -> Floats:
        """∂(coefficients)/∂(values)."""
        return np.eye(len(self.coefficients))


def several_tops(rotation: Mapping[str, float], constants: Mapping[str, float]) -> SeveralTops:
    """Model of two or three tops from A, B, C and distortion in principal axes (MHz), and F0_i, delta_i, epsilon_i and the barrier of each.

    With the unit vectors λ_i of the axes, B_g = A, B, C and F0_i = ħ²/2I_αi, eliminating the velocities from T gives

        ρ_i = (λ_ig B_g/F0_i),    F = M⁻¹,    M_ij = δ_ij/F0_i - Σ_g λ_ig λ_jg B_g/(F0_i F0_j),    T = Σ B_g P_g² + Σ_ij F_ij π_i π_j

    (derived from T = ½ω·Iω + Σ I_αi α'_i λ_i·ω + ½Σ I_αi α'_i²; for one top F = F0/(1 - Σ λ_g ρ_g), as `frames` has it). Raises ValueError
    for three tops of which C2 about a principal axis exchanges two.

    >>> tops = {"F0_1": 150e3, "delta_1": 0.5, "V3_1": 9e6, "F0_2": 150e3, "delta_2": 2.6, "V3_2": 9e6}
    >>> model = several_tops({"A": 9000.0, "B": 5000.0, "C": 3400.0}, tops)
    >>> round(model.tops[0].f_mhz), round(model.between["F12"]), round(model.tops[0].rho_abc[0], 6)
    (158782, -6183, 0.052655)
    """
    f, rho = torsional_kinetics(rotation, constants)
    tops = [
        InternalTop(float(f[i, i]), constants[f"V3_{i + 1}"], tuple(rho[i].tolist()), constants.get(f"V6_{i + 1}", 0.0))
        for i in range(len(f))
    ]
    between = {name: value for name, value in constants.items() if name in PAIRS}
    between |= {f"F{i + 1}{j + 1}": float(f[i, j]) for i, j in combinations(range(len(f)), 2)}
    axis = _exchanging(*tops) if len(tops) == 2 else ""
    if axis:
        tops[1] = replace(tops[0], rho_abc=tuple((np.array(TURNS[axis]) * tops[0].rho_abc).tolist()))
    elif len(tops) > 2:
        _refuse_exchange(tops)
    return SeveralTops(rotation, tuple(tops), between, axis)


def _refuse_exchange(tops: list[InternalTop]) -> None:
    """ValueError for three tops of which C2 about an axis exchanges two and leaves the third where it is."""
    for i, j in combinations(range(len(tops)), 2):
        axis = _exchanging(tops[i], tops[j])
        (other,) = (np.array(top.rho_abc) for n, top in enumerate(tops) if n not in (i, j))
        if axis and np.abs(np.array(TURNS[axis]) * other - other).max() < ALIKE * np.linalg.norm(other):
            raise ValueError(
                f"internal rotation of three tops: C2 about {axis} exchanges tops {i + 1} and {j + 1}; spin weights of exchanged tops are "
                "counted for two tops only: lock the third one, or give the constants by which they differ"
            )


def _exchanging(first: InternalTop, second: InternalTop) -> str:
    """The axis of the C2 rotation that exchanges tops of equal constants; "" if there is none."""
    numbers = [np.array([top.f_mhz, top.v3_mhz, top.v6_mhz]) for top in (first, second)]
    if np.abs(numbers[0] - numbers[1]).max() > ALIKE * np.abs(numbers[0]).max() or abs(
        first.v3_mhz - second.v3_mhz
    ) > ALIKE * abs(first.v3_mhz):
        return ""
    rho = [np.array(top.rho_abc) for top in (first, second)]
    size = float(np.linalg.norm(rho[0]))
    return exchange_axis(rho[0] / size, rho[1] / size, ALIKE) if size else ""


def _lowest(energies: Floats, count: int, exchanged: bool) -> Ints:
    """Numbers of the factors of the lowest products (products, tops); equivalent tops retain the partner (t2, t1) of each."""
    factors = np.column_stack(np.unravel_index(np.argsort(energies, axis=None, kind="stable"), energies.shape))
    retained = factors[:count]
    if exchanged and tuple(retained[-1][::-1]) not in set(map(tuple, retained.tolist())):
        retained = np.vstack([retained, retained[-1][::-1]])
    return retained
