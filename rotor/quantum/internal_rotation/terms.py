"""Operators of a molecule with one internal rotor in the rho-axis frame, by the names of their constants.

    H = A Pz² + B Px² + C Py² + D_ab {Pz, Px} + D_bc {Px, Py} + D_ac {Pz, Py} + F (p - ρPz)² + ½V3 (1 - cos 3α) + ½V6 (1 - cos 6α) + ...

with z, x, y = a, b, c, {u, v} = uv + vu, and A *beside* F (p - ρPz)². Distortion constants are Watson's of the A reduction, -ΔJ P⁴ ...

| names | operator | | names | operator |
|---|---|---|---|---|
| V3, V6, V9 | ½(1 - cos 3α), ... | | D3ac, D3bc | ½{Pa, Pc} sin 3α, ½{Pb, Pc} sin 3α |
| Fm, rhom | p⁴, p³ Pa | | FJ, FK | p² P², p² Pa² |
| V3J, V3K | P²(1 - cos 3α), Pa²(1 - cos 3α) | | Fbc, Fab | p² (Pb² - Pc²), ½{Pa, Pb} p² |
| V3bc, V3ab | (Pb² - Pc²)(1 - cos 3α), ½{Pa, Pb}(1 - cos 3α) | | rhoJ, rhoK | p Pa P², p Pa³ |
| DabJ, DabK | ½P²{Pa, Pb}, ½{Pa³, Pb} | | rhobc, rhoab | ½{Pa, Pb² - Pc²} p, ½{Pa², Pb} p |

(L. Margulès, R. A. Motiyenko, V. V. Ilyushin, J. C. Guillemin, Astron. Astrophys. 579 (2015) A46, table 1; names and operators as
there and in table A.1 of Astron. Astrophys. 2024, aa49918-24.) Any other term is spelled as its operator, like `J2Jz2Jpm2p2cos3`: the
powers of P, Pz, of the ladder P₊ⁿ + P₋ⁿ (n steps of K; `Jmi` is i(P₊ⁿ - P₋ⁿ)), of p, and cos 3kα or sin 3kα, factors that do not
commute as ½{ , }.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.checks import did_you_mean, first_names
from rotor.quantum.basis.labelled import Basis, rotation_labels
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.frames import frame_along
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import j_squared, j_x, j_y, j_z, ladder, sum_of_powers
from rotor.quantum.torsion import cosine, p_alpha, sine
from rotor.tops.constants.operators import Operators, distortion_terms
from rotor.tops.internal_rotation import BARRIERS, NAMED, SPELLED

AXES = (j_z(), j_x(), j_y())  # P along z, x, y; along a, b, c in principal axes
MOST_STEPS = 4  # J whose elements show the phase of operators with up to eight steps of K


@dataclass(frozen=True)
class Axes:
    """Components of P along a, b, c, as operators in the frame whose z is along ρ. rows: the axes z, x, y of that frame along a, b, c."""

    rows: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    @classmethod
    def along(cls, rho_abc: ArrayLike) -> Axes:
        """The axes of the rho-axis frame of ρ along a, b, c."""
        return cls._of(frame_along(rho_abc))

    @classmethod
    def _of(cls, matrix: Floats) -> Axes:
        return cls(tuple(map(tuple, matrix.tolist())))

    @property
    def matrix(self) -> Floats:
        """The cosines (z, x, y; a, b, c)."""
        return np.array(self.rows)

    @property
    def normal(self) -> str:
        """The axis a, b or c along y, across a plane that contains ρ; "" if y is along none of them."""
        others = np.flatnonzero(np.array(self.rows[2]))
        return "abc"[others[0]] if len(others) == 1 else ""

    def turned(self, towards: str, angle: float) -> Axes:
        """The axes after z has turned towards x or y by an angle (radians)."""
        cosine, sine = np.cos(angle), np.sin(angle)
        z, x, y = self.matrix
        if towards == "x":
            return self._of(np.array([cosine * z + sine * x, cosine * x - sine * z, y]))
        return self._of(np.array([cosine * z + sine * y, x, cosine * y - sine * z]))

    def component(self, letter: str) -> Operator:
        """Pa, Pb or Pc from Pz, Px, Py."""
        return component_along(row["abc".index(letter)] for row in self.rows)

    def distortion(self, operators: Operators) -> Operator:
        """Σ c P^2p ½[Pa^2q, P₊^2n + P₋^2n]₊ over a table {(p, q, n): c}, P± = Pb ∓ i Pc stepping along a."""
        if self == PRINCIPAL:
            return sum_of_powers(operators)
        a, b, c = (self.component(letter) for letter in "abc")
        up, down = b - 1j * c, b + 1j * c
        total = Operator()
        for (p, q, n), factor in operators.items():
            axial = a ** (2 * q)
            steps = half_anticommutator(axial, up ** (2 * n) + down ** (2 * n)) if n else axial
            total = total + factor * (j_squared(p) @ steps)
        return total


PRINCIPAL = Axes()


def component_along(vector: Iterable[float]) -> Operator:
    """The scalar product of P with a vector along z, x, y."""
    return sum((x * axis for x, axis in zip(vector, AXES, strict=True) if x), Operator())


def products_of(name: str, sigma: int, axes: Axes = PRINCIPAL) -> tuple[Product, ...]:
    """The operator that a constant multiplies, for the species σ, as a sum of products; ValueError for an unknown name.

    axes: the axes of A, B, C and of the letters in the name.

    >>> len(products_of("V3bc", 0)), len(products_of("FJ", 1))
    (1, 1)
    """
    table = _named(sigma, axes)
    if name in table:
        return (table[name],)
    distortion = distortion_terms("asymmetric", "S") | distortion_terms("asymmetric", "A")
    if name in distortion:
        return (Product(axes.distortion(distortion[name])),)
    if name in BARRIERS:
        return (Product(UNIT, 0.5 * (UNIT - cosine(int(name[1:]) // 3))),)
    match = SPELLED.fullmatch(name)
    if not name or match is None:
        accepted = ("A", "B", "C", "F", "rho", *BARRIERS, *NAMED, *distortion)
        raise ValueError(
            f"{name!r} is no term of internal rotation: known are {first_names(accepted)}, and operators such as J2p2 or "
            f"Jz1p1cos3{did_you_mean(name, accepted)}"
        )
    if axes != PRINCIPAL:
        raise ValueError(f"{name}: terms that are spelled as operators belong to the rho-axis frame")
    return (_spelled(match, sigma),)


@lru_cache(maxsize=8)
def _named(sigma: int, axes: Axes) -> Mapping[str, Product]:
    """Operators of the table of this module."""
    a, b, c = (axes.component(letter) for letter in "abc")
    plane = b @ b - c @ c
    p, p2 = p_alpha(sigma), p_alpha(sigma, 2)
    hindering = UNIT - cosine(1)
    ab = half_anticommutator(a, b)
    return {
        "A": Product(a @ a),
        "B": Product(b @ b),
        "C": Product(c @ c),
        "Dab": Product(2.0 * ab),
        "Dbc": Product(2.0 * half_anticommutator(b, c)),
        "Dac": Product(2.0 * half_anticommutator(a, c)),
        "Fm": Product(UNIT, p_alpha(sigma, 4)),
        "rhom": Product(a, p_alpha(sigma, 3)),
        "V3J": Product(j_squared(), hindering),
        "V3K": Product(a @ a, hindering),
        "V3bc": Product(plane, hindering),
        "V3ab": Product(ab, hindering),
        "D3ac": Product(1j * half_anticommutator(a, c), -1j * sine(1)),
        "D3bc": Product(1j * half_anticommutator(b, c), -1j * sine(1)),
        "FJ": Product(j_squared(), p2),
        "FK": Product(a @ a, p2),
        "Fbc": Product(plane, p2),
        "Fab": Product(ab, p2),
        "rhoJ": Product(j_squared() @ a, p),
        "rhoK": Product(a**3, p),
        "rhobc": Product(half_anticommutator(a, plane), p),
        "rhoab": Product(half_anticommutator(a @ a, b), p),
        "DabJ": Product(j_squared() @ ab),
        "DabK": Product(half_anticommutator(a**3, b)),
    }


@lru_cache(maxsize=256)
def is_real(name: str, axes: Axes = PRINCIPAL) -> bool:
    """Whether the operator of a constant is real in |J K⟩|K t⟩."""
    rotations = [product.rotation for product in products_of(name, 0, axes)]
    return not np.iscomplexobj(Basis(rotation_labels(MOST_STEPS)).elements(rotations).values)


def torsional_products(sigma: int) -> dict[str, tuple[Product, ...]]:
    """Operators that F, -2Fρ and Fρ² multiply in F (p - ρPz)²."""
    return {
        "F": (Product(UNIT, p_alpha(sigma, 2)),),
        "F rho": (Product(-2.0 * j_z(), p_alpha(sigma)),),
        "F rho²": (Product(j_z(2)),),
    }


def _spelled(match: re.Match[str], sigma: int) -> Product:
    """The operator that a spelled name stands for."""
    rotation, torsion = _rotation(match), _torsion(match, sigma)
    if match["wave"] == "sin":
        return Product(1j * rotation, -1j * torsion) if torsion is not None else Product(rotation)
    return Product(rotation, torsion)


def _rotation(match: re.Match[str]) -> Operator:
    """The rotational factor of a spelled name."""
    p, z, n = (int(match[key] or 0) for key in ("j", "z", "n"))
    if match["z"] == "":
        z = 1
    if p % 2:
        raise ValueError(f"{match.string}: powers of P are even, J2, J4, ...; Pz is Jz")
    radial = j_squared(p // 2) if p else UNIT
    axial = j_z(z) if z else UNIT
    if not n:
        return radial @ axial
    factor = 1j if match["kind"] == "mi" else 1.0
    steps = factor * (ladder(n) + (-1.0 if match["kind"] == "mi" else 1.0) * ladder(-n))
    return radial @ (half_anticommutator(axial, steps) if z else steps)


def _torsion(match: re.Match[str], sigma: int) -> Operator | None:
    """The torsional factor of a spelled name; None for the unit operator."""
    factors: Sequence[Operator] = []
    if match["p"] is not None:
        factors = [p_alpha(sigma, int(match["p"] or 1))]
    if match["wave"]:
        multiple = int(match["multiple"])
        if multiple % 3:
            raise ValueError(f"{match.string}: a threefold top has cos 3kα and sin 3kα")
        factors = [*factors, (cosine if match["wave"] == "cos" else sine)(multiple // 3)]
    return reduce(half_anticommutator, factors) if factors else None
