"""The classical limit of rotation with its first quantum corrections, and an estimate of the next ones.

With ⟨g_I⟩ the spin weight averaged over many levels, which is the number of nuclear-spin functions over the symmetry number
(G. Herzberg, Molecular Spectra and Molecular Structure II, eqs. V,18 and V,27),

    Q = ⟨g_I⟩ kT/hB  (linear),      Q = ⟨g_I⟩ √(π (kT/h)³ / ABC)  (all others),

multiplied by 1 + a/T + b/T² + d T + e T² + ... The quantum corrections a and b are the first two terms of the expansion in ħ². For
a linear molecule (H. P. Mulholland, Proc. Camb. Phil. Soc. 24 (1928) 280)

    a = Θ/3,    b = Θ²/15;

for other molecules (K. F. Stripp and J. G. Kirkwood, J. Chem. Phys. 19 (1951) 1131), with A, B, C in K and S the sum over
the distinct terms under permutation of A, B, C,

    a = S[2A - AB/C]/12,    b = S[10A² + 12AB - 12A²B/C + 7A²B²/C²]/480,

which for a spherical top are B/4 and (B/4)²/2. d T is the quartic centrifugal distortion to first order, -⟨H_d⟩/kT, with
H_d a polynomial of classical angular momenta whose components have variances kT/2A, kT/2B, kT/2C (linear: 2D k/B² T).

The series of the logarithm is truncated: the corrected Q is the classical Q times exp[a/T + (b - a²/2)/T² + d T + e T²], with
e T² = -⟨H_6⟩/kT + [⟨H_4²⟩ - ⟨H_4⟩²]/2(kT)², sextic distortion to first order and quartic to second. To the known order this
equals the series of Q, but the heat capacity has no spurious terms, and e^(B/4kT) of a spherical top is complete.

The error is estimated from the next terms. (1) Terms in T⁻³: products of the preceding terms, (Θ_b/T)³/100 (0.0028 for a linear
molecule), and for an asymmetric top with s = A(B - C)²/BC, [As(A + s)/40 + s³/400]/T³. For 60 tops with A/B up to 16 and B/C up
to 8 this estimate is 2.2 to 110 times (median 2.8) the error against sums over levels
(tests/thermodynamics/test_thermo_functions.py). (2) Distortion in T³: f T³, the next cumulants of H_4, H_6 and H_8. (3) Products of
quantum and distortion terms, such as a d, which do not vanish at any T. (4) Spin weights with a period of n levels: the oscillating
remainder of the sum, exp(-π² T/n²Θ) by Poisson's summation, with the largest Θ.
"""

from __future__ import annotations

import math
from itertools import permutations, product
from typing import TYPE_CHECKING, overload

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.effects.watson import centrifugal_operators
from rotor.quantum.wang.spherical_top import scalar_and_tensor
from rotor.thermodynamics.sums.species import weights_in_species
from rotor.tops.constants.operators import AXIAL_REPRESENTATION, REPRESENTATIONS, Operators
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


SERIES_LIMIT = 0.5  # largest size of the quantum corrections and of d T for which the corrected limit is given
_NODES = 7  # Gauss-Hermite points; exact to degree 13 in a normal deviate, and the cube of a quartic has degree 12
_PERIODS = {
    "none": 1,
    "J": 2,
    "KaKc": 2,
    "irrep": 5,
}  # period of the spin weights in levels; the rule "K" has its own modulus


@dataclass(frozen=True)
class ClassicalLimit:
    """The classical limit of a top: q = mean_weight · scale · T^(n/2), to be multiplied by 1 + a/T + b/T² + d T + e T².

    degrees: n, 2 for a linear molecule, else 3. scale: in K^(-n/2). a, b, d, e, f: in K, K², 1/K, 1/K², 1/K³; see
    the module. theta_k: the largest finite and the middle rotational temperature. asymmetry_k: A(B - C)²/BC in K. period: of the spin
    weights. states: for each state its weight relative to that of `mean_weight`, and its energy over k in K.
    """

    degrees: int
    mean_weight: float
    scale: float
    a: float
    b: float
    d: float
    e: float = 0.0
    f: float = 0.0
    theta_k: tuple[float, float] = (0.0, 0.0)
    asymmetry_k: float = 0.0
    period: int = 1
    states: tuple[tuple[float, float], ...] = ((1.0, 0.0),)

    def q(self, temperatures_k: ArrayLike) -> Floats:
        """Q in the classical limit, (n,)."""
        t = np.asarray(temperatures_k, dtype=np.float64)
        return np.asarray(self.mean_weight * self.scale * t ** (self.degrees / 2) * self.state_sums(t)[0])

    def state_sums(self, t: Floats) -> tuple[Floats, Floats, Floats]:
        """Σ w e⁻ˣ over the states with x = E/kT, and mean and variance of x, (n,) each; 1, 0, 0 for a single state."""
        share, energy = np.array(self.states).T
        x = energy / np.asarray(t)[..., None]
        terms = share * np.exp(-x)
        total = terms.sum(axis=-1)
        mean = (terms * x).sum(axis=-1) / total
        return total, mean, (terms * x * x).sum(axis=-1) / total - mean**2

    def corrected(self, temperatures_k: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Q, U/RT and C_v/R with the corrections, (n,) each; NaN if a correction exceeds 0.5.

        With c = b - a²/2: ln(Q/Q_cl) = a/T + c/T² + dT + eT², U/RT = n/2 - a/T - 2c/T² + dT + 2eT²,
        C_v/R = n/2 + 2c/T² + 2dT + 6eT².
        """
        t = np.asarray(temperatures_k, dtype=np.float64)
        first, second = self.a / t, (self.b - self.a**2 / 2) / t**2
        fourth, sixth = self.d * t, self.e * t**2
        valid = np.max(np.abs([first + second, fourth, sixth]), axis=0) < SERIES_LIMIT
        half = np.where(valid, self.degrees / 2, np.nan)
        ln_f = np.where(valid, first + second + fourth + sixth, np.nan)
        _, mean, spread = self.state_sums(t)
        energy = half - first - 2 * second + fourth + 2 * sixth + mean
        return self.q(t) * np.exp(ln_f), energy, half + 2 * second + 2 * fourth + 6 * sixth + spread

    def errors(self, temperatures_k: ArrayLike) -> Floats:
        """Estimated relative errors (3, n) of the corrected Q, U/RT and C_v/R: the next terms, see the module.

        A term c Tᵐ of ln Q contributes m c Tᵐ to U/RT and m(m + 1) c Tᵐ to C_v/R.

        >>> from rotor.tops.top import Top
        >>> limit = classical_limit(Top.from_constants("B=1 GHz"))
        >>> bool(limit.errors([300.0])[0, 0] < 1e-12)
        True
        """
        t = np.asarray(temperatures_k, dtype=np.float64)
        first, second = np.abs(self.a / t), np.abs((self.b - self.a**2 / 2) / t**2)
        high, middle = self.theta_k
        asymmetry = self.asymmetry_k
        asymmetric_part = high * asymmetry * (high + asymmetry) / 40 + asymmetry**3 / 400
        cubic = first**3 + first * second + (middle**3 / 100 + asymmetric_part) / t**3
        cubed, mixed = np.abs(self.f) * t**3, 4 * first * np.abs(self.d * t)
        exponent = math.pi**2 * t / (self.period**2 * max(high, 1e-300))
        repeats = 10 * np.sqrt(1 + t / max(high, 1e-300)) * np.exp(-np.minimum(exponent, 700.0))
        absolute = np.array(
            [
                cubic + cubed + mixed + repeats,
                3 * cubic + 3 * cubed + mixed + exponent * repeats,
                6 * cubic + 12 * cubed + 2 * mixed + exponent**2 * repeats,
            ]
        )
        return np.asarray(absolute / np.array([1.0, self.degrees / 2, self.degrees / 2])[:, None])


def classical_limit(top: Top, weights: SpinWeights | None = None) -> ClassicalLimit:
    """The classical limit of a top for all its levels, or for the species with the given spin weights.

    >>> from rotor.tops.top import Top
    >>> limit = classical_limit(Top.from_constants("B=57635.968 MHz"))
    >>> round(3 * limit.a, 4), round(float(limit.q([300.0])[0]), 2)  # Θ in K
    (2.7661, 108.46)
    """
    by_state = _weights_by_state(top, weights)
    populated = next((state for state in by_state if state.mean), by_state[0])
    a, b, c = rotational_temperatures_k(top)
    period = (
        max(int(name) for name in populated.classes if name.isdecimal()) + 1
        if populated.rule == "K"
        else _PERIODS[populated.rule]
    )
    states = _shares(top, by_state, populated.mean)
    if top.kind == "linear":
        return ClassicalLimit(
            2, populated.mean, 1 / b, b / 3, b**2 / 15, *_distortion(top), (b, b), 0.0, period, states
        )
    scale = math.sqrt(math.pi / (a * b * c))
    corrections = (*_stripp_kirkwood(a, b, c), *_distortion(top))
    return ClassicalLimit(3, populated.mean, scale, *corrections, (a, b), a * (b - c) ** 2 / (b * c), period, states)


def _weights_by_state(top: Top, weights: SpinWeights | None) -> list[SpinWeights]:
    """The spin weights of each state (its own, or those of the top), with 0 for classes outside the species."""
    whole = weights or top.spin_weights
    if top.states is None:
        return [whole]
    stated = [top.states.weights.get(v) for v in range(top.states.count)]
    return [
        whole
        if weights_of_state is None
        else weights_of_state
        if weights is None
        else weights_in_species(weights_of_state, weights)
        for weights_of_state in stated
    ]


def _shares(top: Top, by_state: list[SpinWeights], mean: float) -> tuple[tuple[float, float], ...]:
    """For each state, its classical Q relative to a state of weight `mean` with the top's A, B, C; and its energy over k in K."""
    if top.states is None:
        return ((1.0, 0.0),)
    names = ("B", "B") if top.kind == "linear" else ("A", "B", "C")
    first = top.rotational_constants_mhz
    volume = math.prod(first["ABC".index(name)] for name in names)
    shares = [(by_state[0].mean / mean, 0.0)]
    for v in range(1, top.states.count):
        constants = top.states.for_state(v)
        axes = [constants.get(name, constants["B"]) for name in names]
        shares.append(
            (by_state[v].mean / mean * math.sqrt(volume / math.prod(axes)), constants.get("E", 0.0) / units.MHZ_PER_K)
        )
    return tuple(shares)


def rotational_temperatures_k(top: Top) -> tuple[float, float, float]:
    """Θ = hA/k, hB/k, hC/k of the three axes in K; that of the axis of a linear molecule is infinite.

    >>> from rotor.tops.top import Top
    >>> [round(theta, 2) for theta in rotational_temperatures_k(Top.from_constants("A=835840 B=435352 C=278139 MHz"))]
    [40.11, 20.89, 13.35]
    """
    a, b, c = (x / units.MHZ_PER_K for x in top.rotational_constants_mhz)
    return a, b, c


@overload
def classical_partition_function(top: Top, temperature_k: float) -> float: ...


@overload
def classical_partition_function(top: Top, temperature_k: ArrayLike) -> float | Floats: ...


def classical_partition_function(top: Top, temperature_k: ArrayLike) -> float | Floats:
    """Q in the classical limit, with the mean spin weight; about 1 % low for water at 300 K, worse when colder.

    A scalar temperature gives a scalar, an array an array of the same shape.

    >>> from rotor.tops.top import Top
    >>> round(classical_partition_function(Top.from_constants("B=57635.968 MHz"), 300.0), 2)
    108.46
    """
    q = classical_limit(top).q(temperature_k)
    return q if np.ndim(temperature_k) else float(q)


def _stripp_kirkwood(a: float, b: float, c: float) -> tuple[float, float]:
    """Both quantum corrections, in K and K²: sums over permutations of the axes, equal terms counted once."""
    first = second = 0.0
    for x, y, z in permutations((a, b, c)):
        first += (2 * x - x * y / z) / 2  # the six permutations give each of three terms twice
        second += 5 * x**2 + 6 * x * y - 12 * x**2 * y / z + 3.5 * (x * y / z) ** 2
    return first / 12, second / 480


def _distortion(top: Top) -> tuple[float, float, float]:
    """d, e, f in 1/K, 1/K², 1/K³: cumulants of H_d over the normal distribution of the angular momentum at kT/h = 1 MHz."""
    operators = centrifugal_operators(top.constants)
    if not operators:
        return 0.0, 0.0, 0.0
    first = operators  # the fourth-rank tensor of a spherical top averages to 0
    if top.kind == "spherical":
        first, _ = scalar_and_tensor(operators)
    # Gauss-Hermite nodes by the method of Golub and Welsch
    nodes, vectors = np.linalg.eigh(np.diag(np.sqrt(np.arange(1.0, _NODES)), -1))
    weight = np.array([math.prod(p) for p in product((vectors[0] ** 2).tolist(), repeat=3)])
    points = np.array(list(product(nodes.tolist(), repeat=3))).T * np.sqrt(_variances(top))[:, None]
    energies = [_classical_energy(first, order, *points) for order in (2, 3, 4)]
    h4, h6 = energies[:2] if first is operators else (_classical_energy(operators, order, *points) for order in (2, 3))
    means = [weight @ energy for energy in energies]
    h4, h6 = h4 - weight @ h4, h6 - weight @ h6
    second = weight @ h4**2 / 2 - means[1]
    third = weight @ (h4 * h6) - weight @ h4**3 / 6 - means[2]
    kelvin = units.MHZ_PER_K  # ⟨H_4⟩/kT grows as T, ⟨H_6⟩/kT as T², ⟨H_8⟩/kT as T³
    return float(-means[0] * kelvin), float(second * kelvin**2), float(third * kelvin**3)


def _classical_energy(operators: Operators, order: int, x: Floats, y: Floats, z: Floats) -> Floats:
    """The terms of this order in J², (points,) in MHz."""
    terms = [c * _classical_operator(powers, x, y, z) for powers, c in operators.items() if sum(powers) == order]
    return np.sum(terms, axis=0) if terms else np.zeros(len(x))


def _variances(top: Top) -> tuple[float, float, float]:
    """1/2A, 1/2B, 1/2C of the axes x, y, z of the operators, in 1/MHz: variances of J/ħ per MHz of kT/h."""
    names = REPRESENTATIONS.get(AXIAL_REPRESENTATION.get(top.kind) or str(top.constants.representation), "bca")
    constant_of_axis = dict(zip("abc", top.rotational_constants_mhz, strict=True))
    x, y, z = (0.5 / constant_of_axis[axis] for axis in names)
    return x, y, z


def _classical_operator(powers: tuple[int, int, int], x: Floats, y: Floats, z: Floats) -> Floats:
    """J^2p Jz^2q (J₊^2n + J₋^2n), and 1 for the last where n = 0, of classical angular momenta."""
    p, q, n = powers
    raised = 2 * ((x + 1j * y) ** (2 * n)).real if n else 1.0
    return np.asarray((x * x + y * y + z * z) ** p * z ** (2 * q) * raised)


def populated_j(top: Top, temperature_k: float) -> int:
    """The most populated J at a temperature: √(kT/2B) - ½ for a linear top, √(kT/B) - ½ for others with B the mean of B and C.

    >>> from rotor.tops.top import Top
    >>> populated_j(Top.from_constants("B=57635.968 MHz"), 300.0)
    7
    """
    _, b, c = top.rotational_constants_mhz
    ratio = temperature_k * units.MHZ_PER_K / ((b + c) / 2)
    return max(1, round(math.sqrt(ratio / 2 if top.kind == "linear" else ratio) - 0.5))


def typical_j(top: Top, temperature_k: float, listed: Ints, jmax: int) -> int:
    """The J at which effects on lines are compared: the most populated J, or the highest of the listed lines if that is lower.

    listed: J of the lines. jmax: of the levels, for a list without lines.
    """
    return min(populated_j(top, temperature_k), max(int(listed.max()) if len(listed) else jmax, 1))
