"""The classical limit of rotation, its first quantum corrections, and the temperature where it parts from the quantum sum.

Classically, with ⟨g_I⟩ the spin weight averaged over many levels (G. Herzberg, Molecular Spectra and Molecular Structure
II, eqs. V,18 and V,27; ⟨g_I⟩ is the number of nuclear-spin functions over the symmetry number),

    Q = ⟨g_I⟩ kT/hB  (linear),      Q = ⟨g_I⟩ √(π (kT/h)³ / ABC)  (all others),

multiplied by 1 + a/T + b/T² + d T + ... The quantum corrections a and b are the first two terms of the expansion in ħ²: of
a linear molecule (H. P. Mulholland, Proc. Camb. Phil. Soc. 24 (1928) 280)

    a = Θ/3,    b = Θ²/15;

of any other (K. F. Stripp and J. G. Kirkwood, J. Chem. Phys. 19 (1951) 1131), with Θ = hA/k and so on and S the sum over
the different terms that exchanging A, B, C makes,

    a = S[2A - AB/C]/12,    b = S[10A² + 12AB - 12A²B/C + 7A²B²/C²]/480,

which for a spherical top are B/4 and (B/4)²/2. d T is the quartic centrifugal distortion to first order, -⟨H_d⟩/kT, with
H_d a polynomial of classical angular momenta whose components have variances kT/2A, kT/2B, kT/2C (linear: 2D k/B² T).

The logarithm is what is cut off: the corrected Q is the classical one times exp[a/T + (b - a²/2)/T² + d T]. To the order
that is known that is the same, no spurious terms get into the heat capacity, and a spherical top's e^(B/4kT) is all of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.quantum.effects.watson import centrifugal_operators
from rotor.quantum.spherical_top import scalar_and_tensor
from rotor.thermo.level_sums import level_sums
from rotor.tops.operators import AXIAL_REPRESENTATION, REPRESENTATIONS
from rotor.tops.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


SERIES_LIMIT = 0.5  # of the quantum corrections and of dT, above which the corrected limit is not given
# exact for polynomials of fifth order in a normal deviate: nodes and weights of Gauss and Hermite
_NODES = ((-math.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (math.sqrt(3.0), 1 / 6))


@dataclass(frozen=True)
class ClassicalLimit:
    """The classical limit of a top: q = mean_weight · scale · T^(n/2), to be multiplied by 1 + a/T + b/T² + d T.

    degrees: n, 2 for a linear molecule, else 3. scale: in K^(-n/2). a, b, d: in K, K², 1/K; see the module.
    """

    degrees: int
    mean_weight: float
    scale: float
    a: float
    b: float
    d: float

    def q(self, temperatures_k: ArrayLike) -> Floats:
        """Q in the classical limit, (n,)."""
        t = np.asarray(temperatures_k, dtype=np.float64)
        return np.asarray(self.mean_weight * self.scale * t ** (self.degrees / 2))

    def corrected(self, temperatures_k: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Q, U/RT and C_v/R with the corrections, (n,) each; NaN where one of these is more than half of 1.

        With c = b - a²/2: ln(Q/Q_cl) = a/T + c/T² + dT, U/RT = n/2 - a/T - 2c/T² + dT, C_v/R = n/2 + 2c/T² + 2dT.
        """
        t = np.asarray(temperatures_k, dtype=np.float64)
        first, second, distortion = self.a / t, (self.b - self.a**2 / 2) / t**2, self.d * t
        valid = np.max(np.abs([first + second, distortion]), axis=0) < SERIES_LIMIT
        half = np.where(valid, self.degrees / 2, np.nan)
        ln_f = np.where(valid, first + second + distortion, np.nan)
        return self.q(t) * np.exp(ln_f), half - first - 2 * second + distortion, half + 2 * second + 2 * distortion


def classical_limit(top: Top, weights: SpinWeights | None = None) -> ClassicalLimit:
    """The classical limit of a top, with the mean of its spin weights or of others.

    >>> from rotor.tops.top import Top
    >>> limit = classical_limit(Top.from_constants("B=57635.968 MHz"))
    >>> round(3 * limit.a, 4), round(float(limit.q([300.0])[0]), 2)  # Θ in K
    (2.7661, 108.46)
    """
    mean = (weights or top.spin_weights).mean
    a, b, c = rotational_temperatures_k(top)
    if top.kind == "linear":
        return ClassicalLimit(2, mean, 1 / b, b / 3, b**2 / 15, _distortion(top))
    scale = math.sqrt(math.pi / (a * b * c))
    return ClassicalLimit(3, mean, scale, *_stripp_kirkwood(a, b, c), _distortion(top))


def rotational_temperatures_k(top: Top) -> tuple[float, float, float]:
    """Θ = hA/k, hB/k, hC/k of the three axes in K; that of the axis of a linear molecule is infinite.

    >>> from rotor.tops.top import Top
    >>> [round(theta, 2) for theta in rotational_temperatures_k(Top.from_constants("A=835840 B=435352 C=278139 MHz"))]
    [40.11, 20.89, 13.35]
    """
    a, b, c = (x / units.MHZ_PER_K for x in top.rotational_constants_mhz)
    return a, b, c


def classical_partition_function(top: Top, temperature_k: float) -> float:
    """Q in the classical limit, with the mean spin weight; about 1 % low for water at 300 K, worse when colder.

    >>> from rotor.tops.top import Top
    >>> round(classical_partition_function(Top.from_constants("B=57635.968 MHz"), 300.0), 2)
    108.46
    """
    kt_mhz = temperature_k * units.MHZ_PER_K
    a, b, c = top.rotational_constants_mhz
    if top.kind == "linear":
        return top.spin_weights.mean * kt_mhz / b
    return top.spin_weights.mean * math.sqrt(math.pi * kt_mhz**3 / (a * b * c))


def _stripp_kirkwood(a: float, b: float, c: float) -> tuple[float, float]:
    """Both quantum corrections, in K and K²: sums over the exchanges of the axes, terms that coincide counted once."""
    first = second = 0.0
    for x, y, z in permutations((a, b, c)):
        first += (2 * x - x * y / z) / 2  # each of three terms comes twice
        second += 5 * x**2 + 6 * x * y - 12 * x**2 * y / z + 3.5 * (x * y / z) ** 2
    return first / 12, second / 480


def _distortion(top: Top) -> float:
    """-⟨H_d⟩/kT per T, in 1/K, by quadrature over the normal distribution of the angular momentum."""
    operators = centrifugal_operators(top.constants)
    if top.kind == "spherical":  # the tensor of fourth rank is 0 on average
        operators, _ = scalar_and_tensor(operators)
    quartic = {powers: c for powers, c in operators.items() if sum(powers) == 2}
    variances = _variances(top)
    total = 0.0
    for nodes in product(_NODES, repeat=3):
        x, y, z = (math.sqrt(v) * node for v, (node, _) in zip(variances, nodes, strict=True))
        energy = sum(c * _classical_operator(powers, x, y, z) for powers, c in quartic.items())
        total += math.prod(weight for _, weight in nodes) * energy
    return -total * units.MHZ_PER_K  # at kT of 1 MHz ⟨H_d⟩/kT is `total`, and grows as T


def _variances(top: Top) -> tuple[float, float, float]:
    """1/2A, 1/2B, 1/2C of the axes x, y, z of the operators, in 1/MHz: variances of J/ħ per MHz of kT/h."""
    names = REPRESENTATIONS.get(AXIAL_REPRESENTATION.get(top.kind) or str(top.constants.representation), "bca")
    of_axis = dict(zip("abc", top.rotational_constants_mhz, strict=True))
    x, y, z = (0.5 / of_axis[axis] for axis in names)
    return x, y, z


def _classical_operator(powers: tuple[int, int, int], x: float, y: float, z: float) -> float:
    """J^2p Jz^2q (J₊^2n + J₋^2n), and 1 for the last where n = 0, of a classical angular momentum."""
    p, q, n = powers
    raised = 2 * ((x + 1j * y) ** (2 * n)).real if n else 1.0
    return float((x * x + y * y + z * z) ** p * z ** (2 * q) * raised)


def classical_above_k(top: Top, tolerance: float = 0.01) -> float:
    """The highest temperature at which C_v of the rigid quantum top differs from its classical value by `tolerance` of it.

    Above it the classical n R/2 is good to that; distortion, which both could have, is left out of both. The spin weights
    count, all species in equilibrium. Looked for at 40 temperatures a decade from 0.01 to 10 times the largest finite Θ,
    higher where it differs there, and then bisected to 1e-6. A linear molecule of Θ, its C_v/R being 1 + (Θ/T)²/45 + ..., parts at 1.93 Θ.

    >>> from rotor.tops.top import Top
    >>> round(classical_above_k(Top.from_constants("B=20836.619 MHz")), 2)  # Θ = 1 K
    1.93
    """
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance {tolerance}: expected a part of the classical heat capacity, between 0 and 1")
    rigid, theta = _rigid(top), max(t for t in rotational_temperatures_k(top) if math.isfinite(t))
    classical = classical_limit(rigid).degrees / 2

    def beyond(temperatures: Floats) -> NDArray[np.bool_]:
        sums = level_sums(rigid, [rigid.spin_weights], temperatures, tolerance * 1e-4)[0]
        return np.asarray(np.abs(sums.cv_over_r / classical - 1) > tolerance)

    grid = theta * np.logspace(-2, 1, 121)
    apart = beyond(grid)
    while apart[-20:].any():  # half a decade without a difference is the end
        higher = grid[-1] * np.logspace(0.025, 0.5, 20)
        grid, apart = np.append(grid, higher), np.append(apart, beyond(higher))
    last = np.flatnonzero(apart)[-1]
    low, high = float(grid[last]), float(grid[last + 1])
    while high - low > 1e-6 * low:
        middle = (high + low) / 2
        low, high = (middle, high) if beyond(np.array([middle]))[0] else (low, middle)
    return low


def _rigid(top: Top) -> Top:
    """The same top without distortion."""
    from rotor.tops.top import Top, constants_of_moments

    constants = constants_of_moments(top.moments_u_angstrom2, top.kind)
    return Top.from_constants(constants, spin_weights=top.spin_weights)
