"""Statistical test of equipartition: mean ½ kT and the correct distribution in each degree of freedom.

In a classical canonical ensemble each momentum is normally distributed, so that 2E/kT of a degree of freedom of a molecule follows χ²
with one degree: mean 1, variance 2 (Landau and Lifshitz, Statistical Physics, section 44). For n independent molecules

    Σ 2E/kT  ~  χ²_n                          exactly; gives a two-sided test of each mean;
    z_i, the equivalent normal deviate,       is the deviation of degree i in units of σ;
    Σ_i z_i²  ~  χ²_k                         is a joint test of all k degrees.

The shape of the distribution is tested by the Kolmogorov-Smirnov distance, with Šidák's rule for the smallest probability of k
degrees. The ensemble is accepted if neither test rejects at (1 - confidence)/2 (Bonferroni), so that a correct ensemble is rejected
with a probability of at most 1 - confidence. Failing degrees are identified by Holm's rule.

Frames of a trajectory are correlated. The variance of a mean over F frames is then var g/F, with the statistical inefficiency
g = 1 + 2 Σ ρ(t) of the series of frame means, summed up to t >= 5 g/2 (A. D. Sokal, in Functional Integration, NATO ASI B 361, 131
(1997), section 3.3). Student's distribution replaces the normal one, with F/(5g + 1) degrees of freedom, the precision of g (his
equation 3.19). The effective sample size is 2/spread².
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.geometry.inertia import LINEAR_BELOW, kinetic_energy_by_axis
from rotor.statistics.degrees_of_freedom import rotating_axes
from rotor.table import Table

Groups = list[tuple[str, NDArray[np.int64]]]

WINDOW = 5.0  # window of the sum of correlations, in correlation times
LEAST_INDEPENDENT = 25  # smallest number of frames, in statistical inefficiencies
MOST_FOLLOWED = 256  # molecules whose individual correlations are computed


@dataclass(frozen=True)
class KineticDegrees:
    """Kinetic energies by degree of freedom.

    energies: by name, (n,) for n molecules or (frames, n). counts: number of degrees of freedom of these n energies: n minus the share
    of removed totals.
    """

    energies: Mapping[str, Floats]
    counts: Mapping[str, float]

    @property
    def total(self) -> float:
        """The number of degrees of freedom, that of `rotor.statistics.degrees_of_freedom.count_degrees`."""
        return math.fsum(self.counts.values())


@dataclass(frozen=True)
class DegreeTest:
    """Test of a degree of freedom.

    mean: of 2E/kT, 1 expected. spread: standard deviation of 2E/kT among molecules, √2 expected. mean_spread: expected
    standard deviation of the mean. effective: effective number of independent energies. sigma: deviation of the mean in units of its
    standard deviation. p_value: probability of such a deviation by chance. ks_distance, ks_p_value: comparison with χ²_1.
    """

    name: str
    molecules: int
    frames: int
    mean: float
    spread: float
    mean_spread: float
    effective: float
    sigma: float
    p_value: float
    ks_distance: float
    ks_p_value: float


@dataclass(frozen=True, repr=False)
class Equipartition(Table):
    """Test of all degrees of freedom.

    kt: in the unit of the energies, given or estimated from the data (`kt_fixed`). chi2, chi2_degrees, chi2_p: Σ z². ks_p: of
    the worst distribution. p_value: of both tests together. failing: degrees rejected by Holm's rule.
    """

    kt: float
    kt_fixed: bool
    confidence: float
    degrees: tuple[DegreeTest, ...]
    chi2: float
    chi2_degrees: int
    chi2_p: float
    ks_p: float
    p_value: float
    accepted: bool
    failing: tuple[str, ...] = ()

    @property
    def provenance(self) -> dict[str, Any]:
        """Result of the test for the provenance record."""
        return {
            "accepted": self.accepted,
            "p_value": self.p_value,
            "confidence": self.confidence,
            "kt": self.kt,
            "rows": len(self.degrees),
        }

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """A row for each degree of freedom."""
        names = DegreeTest.__dataclass_fields__
        return {name: np.array([getattr(degree, name) for degree in self.degrees]) for name in names}

    def __str__(self) -> str:
        """A sentence: accepted or not, the test values, and the largest deviation in σ."""
        worst = max(self.degrees, key=lambda degree: abs(degree.sigma))
        word = "accepted" if self.accepted else "rejected"
        named = f"; failing: {', '.join(self.failing)}" if self.failing else ""
        return (
            f"equipartition {word} at {100 * self.confidence:g} % confidence, p = {self.p_value:.3g}: χ² = {self.chi2:.4g} for "
            f"{self.chi2_degrees} degrees (p = {self.chi2_p:.3g}), distributions p = {self.ks_p:.3g}; farthest "
            f"{worst.name}, {worst.sigma:+.2f} σ{named}"
        )


def kinetic_degrees(
    *,
    masses: ArrayLike | None = None,
    velocities: ArrayLike | None = None,
    moments: ArrayLike | None = None,
    momenta: ArrayLike | None = None,
    species: Sequence[str] | None = None,
    momentum_removed: bool = False,
    linear_below: float = LINEAR_BELOW,
) -> KineticDegrees:
    """Energies by degree of freedom of N rigid bodies, for one frame or a trajectory, in any coherent units.

    Parameters
    ----------
    masses, velocities : (N,) array, (N, 3) or (frames, N, 3) array, optional
        Masses and centre-of-mass velocities.
    moments, momenta : (N, 3) array, (N, 3) or (frames, N, 3) array, optional
        Principal moments, and angular momenta in principal axes. Either pair may be left out.
    species : sequence of str, optional
        N names, to test species separately.
    momentum_removed : bool
        Whether the total momentum is held at zero; a species of mass fraction w then has n - w degrees along each direction.
    linear_below : float
        Ratio of a moment to the body's largest below which an axis carries no degree of freedom.

    Returns
    -------
    KineticDegrees
        Energies and counts by name.

    Raises
    ------
    ValueError
        Energy about an axis without a degree of freedom; inconsistent shapes.

    Examples
    --------
    >>> gas = kinetic_degrees(moments=[[0.0, 2.0, 2.0]] * 2, momenta=[[0.0, 1.0, 2.0], [0.0, 2.0, 0.0]])
    >>> {name: energies.tolist() for name, energies in gas.energies.items()}, gas.total
    ({'rotation b': [0.25, 1.0], 'rotation c': [1.0, 0.0]}, 4.0)
    """
    degrees: list[tuple[str, Floats, float]] = []
    if masses is not None and velocities is not None:
        mass, v = np.asarray(masses, dtype=np.float64), np.asarray(velocities, dtype=np.float64)
        _check_shape("velocities", v, len(mass))
        if momentum_removed and len(mass) == 1:
            raise ValueError("a single body without total momentum has no translation; leave its velocity out")
        degrees += _translations(mass, v, _groups(species, len(mass)), momentum_removed)
    if moments is not None and momenta is not None:
        inertia, m = np.asarray(moments, dtype=np.float64), np.asarray(momenta, dtype=np.float64)
        _check_shape("momenta", m, len(inertia))
        degrees += _rotations(inertia, m, _groups(species, len(inertia)), linear_below)
    if not degrees:
        raise ValueError("no degree of freedom: expected masses with velocities, moments with momenta, or both")
    return KineticDegrees({name: values for name, values, _ in degrees}, {name: count for name, _, count in degrees})


def _check_shape(name: str, vectors: Floats, bodies: int) -> None:
    if vectors.ndim not in (2, 3) or vectors.shape[-2:] != (bodies, 3):
        raise ValueError(f"{name} of shape {vectors.shape} for {bodies} bodies: expected (N, 3) or (frames, N, 3)")


def _translations(mass: Floats, v: Floats, groups: Groups, removed: bool) -> list[tuple[str, Floats, float]]:
    """Name, energies and count along x, y, z for each species."""
    degrees = []
    for prefix, rows in groups:
        share = float(mass[rows].sum() / mass.sum()) if removed else 0.0
        for axis, name in enumerate("xyz"):
            energies = 0.5 * mass[rows] * v[..., rows, axis] ** 2
            degrees.append((f"{prefix}translation {name}", energies, len(rows) - share))
    return degrees


def _rotations(inertia: Floats, m: Floats, groups: Groups, linear_below: float) -> list[tuple[str, Floats, float]]:
    """Name, energies and count about each axis of rotation of a species."""
    turns = rotating_axes(inertia, linear_below)
    if np.any(~turns & (m != 0.0)):
        raise ValueError(
            f"a body turns about an axis that has no degree of freedom: its moment is below {linear_below:g} of the body's "
            "largest; set that component of L to 0, or lower linear_below"
        )
    degrees = []
    for prefix, rows in groups:
        for axis, name in enumerate("abc"):
            here = rows[turns[rows, axis]]
            if len(here):
                along = m[..., here, axis]
                energies = kinetic_energy_by_axis(along, along / inertia[here, axis])
                degrees.append((f"{prefix}rotation {name}", energies, float(len(here))))
    return degrees


def equipartition(
    energies: KineticDegrees | Mapping[str, ArrayLike],
    kt: float | None,
    *,
    confidence: float = 0.99,
) -> Equipartition:
    """Test whether kinetic energies are in thermal equilibrium, for each degree of freedom and jointly.

    energies: from `kinetic_degrees`, or by name, (n,) for n independent molecules or (frames, n) for a trajectory (put independent
    frames into one row). kt: expected kT in the unit of the energies; None: estimated from the data, so that only the k - 1
    differences between degrees are tested. confidence: a correct ensemble is rejected with a probability of at most 1 - confidence.

    Raises ValueError for a series too short for its correlation (fewer than 25 statistical inefficiencies). Constant energies, as
    in free flight, are always too short: use a single frame.

    >>> rng = np.random.default_rng(7)
    >>> cold = {"x": rng.chisquare(1, 4000) / 2, "y": 0.9 * rng.chisquare(1, 4000) / 2}
    >>> test = equipartition(cold, 1.0)
    >>> test.accepted, test.failing
    (False, ('y',))
    """
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence}: expected a probability between 0 and 1")
    if kt is not None and not (math.isfinite(kt) and kt > 0.0):
        raise ValueError(f"kT = {kt}: expected a finite energy above 0")
    table = energies if isinstance(energies, KineticDegrees) else _plain(energies)
    data = {name: _checked(name, values) for name, values in table.energies.items()}
    total = math.fsum(table.counts[name] * len(values) for name, values in data.items())
    used = 2.0 * math.fsum(float(values.sum()) for values in data.values()) / total if kt is None else kt
    if not used > 0.0:
        raise ValueError("every kinetic energy is zero: there is no temperature to find from them")
    means = [_ratio_mean(name, 2.0 / used * values, table.counts[name]) for name, values in data.items()]
    means = [_with_deviation(mean, *_expected(means, kt is None)) for mean in means]
    degrees = tuple(_tested(mean, 2.0 / used * data[mean.name]) for mean in means)
    return _family(used, kt is not None, confidence, degrees)


@dataclass(frozen=True)
class _Mean:
    """Mean of 2E/kT, its expected spread, Student's degrees of freedom (None: exact χ² of `count`), and z, p."""

    name: str
    count: float
    mean: float
    spread: float
    student: float | None
    stride: int
    sigma: float = math.nan
    p_value: float = math.nan


def _groups(species: Sequence[str] | None, n: int) -> Groups:
    """Prefix of the names and rows of each species, in order of appearance."""
    if species is None:
        return [("", np.arange(n))]
    if len(species) != n:
        raise ValueError(f"{len(species)} names of species for {n} bodies")
    labels = np.asarray(species)
    return [(f"{name}: ", np.flatnonzero(labels == name)) for name in dict.fromkeys(species)]


def _plain(energies: Mapping[str, ArrayLike]) -> KineticDegrees:
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in energies.items()}
    if not arrays:
        raise ValueError("no degree of freedom was given")
    return KineticDegrees(arrays, {name: float(values.shape[-1]) for name, values in arrays.items() if values.ndim})


def _checked(name: str, values: ArrayLike) -> Floats:
    """The energies as (frames, n)."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim not in (1, 2) or array.size == 0 or not np.isfinite(array).all() or (array < 0.0).any():
        raise ValueError(
            f"{name}: energies of shape {array.shape}: expected (n,) or (frames, n), finite and not negative"
        )
    return np.atleast_2d(array)


def _ratio_mean(name: str, ratios: Floats, count: float) -> _Mean:
    """The mean over molecules and frames, with its expected statistical spread."""
    if len(ratios) == 1:
        return _Mean(name, count, float(ratios.sum()) / count, math.sqrt(2.0 / count), None, 1)
    series = ratios.sum(axis=1) / count
    inefficiency = statistical_inefficiency(
        ratios[:, :MOST_FOLLOWED] * (ratios.shape[1] / count), mean=1.0, variance=2.0
    )
    g = statistical_inefficiency(series[:, None])
    if len(series) < LEAST_INDEPENDENT * max(inefficiency, g):
        raise ValueError(
            f"{name}: {len(series)} frames are too few for energies that are correlated over {max(inefficiency, g):.3g} of them; "
            f"{math.ceil(LEAST_INDEPENDENT * max(inefficiency, g))} would be enough, or a single frame"
        )
    spread = math.sqrt(float(series.var(ddof=1)) * g / len(series))
    return _Mean(
        name, count, float(series.mean()), spread, len(series) / (WINDOW * g + 1.0), math.ceil(2.0 * inefficiency)
    )


def products_over_starts(series: Floats) -> Floats:
    """Σ x(t₀) x(t₀ + t) of series (frames, n) over starts t₀ and columns, (frames,), by fast Fourier transform.

    >>> products_over_starts(np.array([[1.0], [2.0], [3.0]])).round(12).tolist()
    [14.0, 8.0, 3.0]
    """
    from scipy.fft import irfft, next_fast_len, rfft

    size = next_fast_len(2 * len(series))
    return np.asarray(irfft(np.sum(np.abs(rfft(series, size, axis=0)) ** 2, axis=1), size)[: len(series)])


def statistical_inefficiency(series: ArrayLike, mean: float | None = None, variance: float | None = None) -> float:
    """g = 1 + 2 Σ ρ(t) of series (frames, n), correlations averaged over the n columns; at least 1.

    mean, variance: expected values; by default those of the data, with a separate mean for each column. The sum ends
    at t >= 5 g/2 (Sokal's automatic window), or at the end of the series.

    >>> rng = np.random.default_rng(1)
    >>> 0.9 < statistical_inefficiency(rng.normal(size=(20000, 1))) < 1.1
    True
    """
    x = np.asarray(series, dtype=np.float64)
    x = x - (x.mean(axis=0) if mean is None else mean)
    frames = len(x)
    correlation = products_over_starts(x) / (x.shape[1] * (frames - np.arange(frames)))
    scale = correlation[0] if variance is None else variance
    if not scale > 0.0:
        return float(frames)  # constant series
    g = 2.0 * np.cumsum(correlation / scale) - correlation[0] / scale
    ends = np.flatnonzero(np.arange(frames) >= 0.5 * WINDOW * g)
    return max(1.0, float(g[ends[0]])) if len(ends) else float(frames)


def _expected(means: Sequence[_Mean], from_data: bool) -> tuple[float, float]:
    """The expected mean and its variance: exactly 1, or the common mean of all degrees."""
    if not from_data:
        return 1.0, 0.0
    if len(means) < 2:
        raise ValueError("without a temperature there must be two degrees of freedom or more to compare")
    weights = np.array([1.0 / mean.spread**2 for mean in means])
    return float(weights @ [mean.mean for mean in means] / weights.sum()), float(1.0 / weights.sum())


def _with_deviation(mean: _Mean, expected: float, variance: float) -> _Mean:
    """z and two-sided p from χ² if it is exact, otherwise from Student's or the normal distribution."""
    from scipy.special import gammainc, gammaincc, ndtr, ndtri, stdtr

    off = (mean.mean - expected) / math.sqrt(mean.spread**2 - variance)
    if mean.student is not None:
        tail = float(stdtr(mean.student, -abs(off)))
    elif variance > 0.0:
        tail = float(ndtr(-abs(off)))
    else:
        half, x = 0.5 * mean.count, 0.5 * mean.count * mean.mean
        low, high = float(gammainc(half, x)), float(gammaincc(half, x))
        tail, off = min(low, high), math.copysign(_wilson_hilferty(mean), low - high)
    sigma = math.copysign(-float(ndtri(tail)), off) if tail > 0.0 else off
    return replace(mean, sigma=sigma, p_value=min(1.0, 2.0 * tail))


def _wilson_hilferty(mean: _Mean) -> float:
    """|z| of a χ² whose probability underflows (E. B. Wilson and M. M. Hilferty, PNAS 17, 684 (1931))."""
    share = 2.0 / (9.0 * mean.count)
    return abs(math.cbrt(mean.mean) - (1.0 - share)) / math.sqrt(share)


def _tested(mean: _Mean, ratios: Floats) -> DegreeTest:
    n = ratios.shape[1]
    distance, ks_p = _kolmogorov_smirnov(ratios[:: mean.stride].ravel() * (n / mean.count))
    return DegreeTest(
        mean.name, n, len(ratios), mean.mean, float(ratios.std()), mean.spread, 2.0 / mean.spread**2, mean.sigma,
        mean.p_value, distance, ks_p,
    )  # fmt: skip


def _kolmogorov_smirnov(ratios: Floats) -> tuple[float, float]:
    """Largest distance of the sample from χ²_1, F(x) = erf √(x/2), and its probability.

    The asymptotic law with Stephens's (√n + 0.12 + 0.11/√n) D is accurate to 1e-3 for n >= 5 (J. R. Statist. Soc. B 32, 115
    (1970)).
    """
    from scipy.special import erf, kolmogorov

    n = len(ratios)
    law = erf(np.sqrt(0.5 * np.sort(ratios)))
    rank = np.arange(n) / n
    distance = float(max(np.max(law - rank), np.max(rank + 1.0 / n - law)))
    return distance, float(kolmogorov((math.sqrt(n) + 0.12 + 0.11 / math.sqrt(n)) * distance))


def _family(kt: float, kt_fixed: bool, confidence: float, degrees: tuple[DegreeTest, ...]) -> Equipartition:
    from scipy.special import gammaincc

    free = len(degrees) if kt_fixed else len(degrees) - 1
    sigmas = np.array([degree.sigma for degree in degrees])
    chi2 = float(np.sum(sigmas**2)) if kt_fixed else _homogeneity(degrees)
    chi2_p = float(gammaincc(0.5 * free, 0.5 * chi2))
    smallest = min(degree.ks_p_value for degree in degrees)
    ks_p = -math.expm1(len(degrees) * math.log1p(-smallest)) if smallest < 1.0 else 1.0
    p_value = min(1.0, 2.0 * min(chi2_p, ks_p))
    failing = _holm(degrees, 1.0 - confidence)
    accepted = p_value > 1.0 - confidence
    return Equipartition(
        kt, kt_fixed, confidence, degrees, chi2, free, chi2_p, ks_p, p_value, accepted, () if accepted else failing
    )


def _homogeneity(degrees: Sequence[DegreeTest]) -> float:
    """Σ (m_i - m)²/s_i² about the weighted mean m; χ² with k - 1 degrees if all means are equal."""
    means = np.array([degree.mean for degree in degrees])
    weights = np.array([1.0 / degree.mean_spread**2 for degree in degrees])
    return float(weights @ (means - weights @ means / weights.sum()) ** 2)


def _holm(degrees: Sequence[DegreeTest], alpha: float) -> tuple[str, ...]:
    """Names rejected by S. Holm's rule (Scand. J. Statist. 6, 65 (1979)) among all means and distributions."""
    tests = sorted((p, degree.name) for degree in degrees for p in (degree.p_value, degree.ks_p_value))
    rejected: list[str] = []
    for rank, (p, name) in enumerate(tests):
        if p > alpha / (len(tests) - rank):
            break
        rejected.append(name)
    return tuple(degree.name for degree in degrees if degree.name in rejected)
