"""Two internal rotors in one frame: products of their torsional functions for each K as the basis of the rotation.

    H = A Pa² + B Pb² + C Pc² + Σ_i [F_i π_i² + ½ V3_i (1 - cos 3α_i)] + F12 (π1 π2 + π2 π1) + ½ V12 (1 - cos 3α1)(1 - cos 3α2)
        + ½ V12s sin 3α1 sin 3α2,                                               π_i = p_i - ρ_i·P

in principal axes, z along a (H. Hartwig and H. Dreizler, Z. Naturforsch. 51a (1996) 923, for one frame of several tops). For each K the
torsion of top i with ρ_iz K is solved, and the products of lowest energy are retained; what ρ has across z acts between them,
p_i with its matrix over these functions. Species are pairs (σ1, σ2); (-σ1, -σ2) has the same energies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.internal_rotation.contracted import ContractedTorsion, Product, Torsion, contracted_torsion
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.species import SpeciesBlocks
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import j_x, j_y, j_z
from rotor.quantum.operators.torsion import cosine, p_alpha, sine
from rotor.quantum.torsion import TorsionalPotential

Pair = tuple[Operator | None, Operator | None]  # operators of both torsions


@dataclass(frozen=True)
class InternalTop:
    """One of two tops: F and V3 in MHz, ρ along a, b, c."""

    f_mhz: float
    v3_mhz: float
    rho_abc: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class ProductTorsion:
    """Products of contracted functions of two tops; retained: (t1, t2) of those that are taken."""

    first: ContractedTorsion
    second: ContractedTorsion
    retained: Ints

    @property
    def sigma(self) -> int:
        """0 where both species are 0, else 1: whether time reversal takes the species to itself."""
        return int(self.first.sigma != 0 or self.second.sigma != 0)

    @property
    def k_max(self) -> int:
        """The largest |K|."""
        return self.first.k_max

    @property
    def count(self) -> int:
        """Products for each K."""
        return len(self.retained)

    @property
    def is_near_free(self) -> bool:
        """Whether one of the tops turns nearly freely."""
        return self.first.is_near_free or self.second.is_near_free

    @cached_property
    def energies(self) -> Floats:
        """Sums of torsional energies (K, products)."""
        return np.asarray(self.first.energies[:, self.retained[:, 0]] + self.second.energies[:, self.retained[:, 1]])

    @cached_property
    def parity(self) -> Ints:
        """Of the products at K = 0 under reversal of both tops."""
        return np.asarray(self.first.parity[self.retained[:, 0]] * self.second.parity[self.retained[:, 1]])

    def tables(self, operator: Any, change: int) -> Floats:
        """⟨K + change, t'|o1 o2|K t⟩ as (K, t', t) of a pair of operators."""
        pair: Pair = (None, None) if operator is None else operator
        left, right = self.first.tables(pair[0], change), self.second.tables(pair[1], change)
        one, two = self.retained[:, 0], self.retained[:, 1]
        return np.asarray(left[:, one[:, None], one] * right[:, two[:, None], two])


@dataclass(frozen=True)
class TwoTops:
    """Constants of a molecule with two internal rotors, MHz: A, B, C of the principal axes, both tops, and what couples them."""

    abc: tuple[float, float, float]
    tops: tuple[InternalTop, InternalTop]
    f12: float = 0.0
    v12: float = 0.0
    v12_sine: float = 0.0

    @property
    def has_plane(self) -> bool:
        """Whether both ρ lie in the plane ab."""
        return not any(top.rho_abc[2] for top in self.tops)

    def blocks(
        self, species: tuple[int, int], jmax: int, *, count: int = 25, each: int = 7, waves: int = 10
    ) -> SpeciesBlocks:
        """The blocks of a species.

        Parameters
        ----------
        species : (int, int)
            σ of both tops: 0, 1 or -1.
        jmax : int
            Highest J.
        count : int, optional
            Products of torsional functions retained for each K, the lowest by energy.
        each : int, optional
            Functions of each top that products are made of.
        waves : int, optional
            k from -waves to waves of each top.

        Returns
        -------
        SpeciesBlocks
        """
        torsions = [
            contracted_torsion(
                Torsion(top.f_mhz, top.rho_abc[0], TorsionalPotential({3: top.v3_mhz})), sigma, jmax, each, waves
            )
            for top, sigma in zip(self.tops, species, strict=True)
        ]
        middle = torsions[0].energies[jmax][:, None] + torsions[1].energies[jmax]
        retained = np.column_stack(np.unravel_index(np.argsort(middle, axis=None, kind="stable")[:count], middle.shape))
        product: Any = ProductTorsion(torsions[0], torsions[1], retained)
        folded = species == (0, 0) and self.has_plane
        return SpeciesBlocks(TorsionRotation(product, 0, jmax, folded), self.terms(species))

    def terms(self, species: tuple[int, int]) -> Mapping[str, tuple[Product, ...]]:
        """Sums of products by coefficient, in the order of `coefficients`."""
        axes = (j_z(), j_x(), j_y())
        p = [p_alpha(sigma) for sigma in species]
        along = [
            _sum([value * axis for value, axis in zip(top.rho_abc, axes, strict=True) if value]) for top in self.tops
        ]
        terms: dict[str, tuple[Product, ...]] = {
            name: (Product(axis @ axis),) for name, axis in zip("ABC", axes, strict=True)
        }
        for i, (top, sigma) in enumerate(zip(self.tops, species, strict=True)):
            square = p_alpha(sigma, 2)
            terms[f"F{i + 1}"] = (
                Product(UNIT, _at(i, square)), Product(-2.0 * along[i], _at(i, p[i])), Product(along[i] @ along[i]),
            )  # fmt: skip
            if not any(top.rho_abc):
                terms[f"F{i + 1}"] = (Product(UNIT, _at(i, square)),)
            terms[f"V3 {i + 1}"] = (Product(UNIT, _at(i, 0.5 * (UNIT - cosine(1)))),)
        hindering = UNIT - cosine(1)
        terms["F12"] = (
            Product(2.0 * UNIT, _both(p[0], p[1])), Product(-2.0 * along[1], _at(0, p[0])), Product(-2.0 * along[0], _at(1, p[1])),
            Product(2.0 * half_anticommutator(along[0], along[1])),
        )  # fmt: skip
        terms["V12"] = (Product(0.5 * UNIT, _both(hindering, hindering)),)
        real_sine = -1j * sine(1)
        terms["V12s"] = (Product(-0.5 * UNIT, _both(real_sine, real_sine)),)
        return terms

    @property
    def coefficients(self) -> Floats:
        """The values of the coefficients, MHz."""
        each = [value for top in self.tops for value in (top.f_mhz, top.v3_mhz)]
        return np.array([*self.abc, *each, self.f12, self.v12, self.v12_sine])


def _sum(operators: list[Operator]) -> Operator:
    return reduce(lambda x, y: x + y, operators, Operator())


def _at(top: int, operator: Operator) -> Any:
    """An operator of one top, the unit operator of the other."""
    return (operator, None) if top == 0 else (None, operator)


def _both(first: Operator, second: Operator) -> Any:
    return (first, second)
