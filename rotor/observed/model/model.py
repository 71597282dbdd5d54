"""LTE models of a radio source: optical depths, brightness, and derivatives with respect to all parameters.

Components k (a species in a region of the source) have column density N, excitation temperature T, velocity v and width Δv:

    τ_k(ν) = N_k Σ_i I_i(T_k) φ_i(ν/(1 - v/c))        φ_i a Gaussian at ν_i, full width at half maximum ν_i Δv/c
    T_B(ν) = Σ_layers f [Σ_k τ_k c_k] g(τ),  g(τ) = (1 - e^-τ)/τ,   τ = Σ_k τ_k,   c_k = J_ν(T_k (1 - v/c)) - J_ν(T_bg)

The equation of radiative transfer through a uniform layer (J. G. Mangum and Y. L. Shirley, Publ. Astron. Soc. Pac. 127 (2015) 266)
with the mixed source function S = Σ τ_k J_k/Σ τ_k: components of a layer are mixed, layers lie side by side in
the beam. For a single temperature it is the usual [J(T) - J(T_bg)](1 - e^-τ). Dust in a layer is a further τ_k, a power law of ν, whose
emission is subtracted with the continuum. f = θ_s²/(θ_s² + θ_b²) for a Gaussian source in a Gaussian beam.
Neglected: temperature gradients in a component, scattering, and the width of a channel unless it is given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints, numbers_in_runs
from rotor.checks import require_positive
from rotor.observed.model.species import SpeciesLines
from rotor.spectra.emission.emission import BACKGROUND_K, planck_k

KM_PER_S = units.SPEED_OF_LIGHT_M_PER_S / 1e3
REACH = 3.0  # full widths at half maximum on either side: a Gaussian has fallen to 1.5e-11 of its peak
PARAMETERS = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s", "size_arcsec")
_SERIES = 1e-3  # τ below which g and its derivative come from their series
_LN16 = 4 * math.log(2)


@dataclass(frozen=True)
class Component:
    """A species in a region of the source.

    column_per_cm2: molecules in the line of sight. excitation_k: of rotation. velocity_km_s: radio convention, relative to the frame of
    the spectrum. fwhm_km_s: full width at half maximum. size_arcsec: full width of the source at half maximum; None fills the beam.
    layer: number of the layer; components of a layer absorb one another's light, layers lie side by side.
    Raises ValueError for numbers not above 0, and for a velocity beyond that of light.
    """

    species: SpeciesLines
    column_per_cm2: float
    excitation_k: float
    velocity_km_s: float = 0.0
    fwhm_km_s: float = 1.0
    size_arcsec: float | None = None
    layer: int = 0

    def __post_init__(self) -> None:
        for name in ("column_per_cm2", "excitation_k", "fwhm_km_s", "size_arcsec"):
            if getattr(self, name) is not None:
                require_positive(f"{self.species.name}: {name}", getattr(self, name))
        if not abs(self.velocity_km_s) < KM_PER_S:
            raise ValueError(f"{self.species.name}: velocity_km_s: {self.velocity_km_s:g}: beyond the speed of light")

    @property
    def shift(self) -> float:
        """ν/ν_rest = 1 - v/c."""
        return 1 - self.velocity_km_s / KM_PER_S

    @property
    def seen_k(self) -> float:
        """T_ex (1 - v/c), the apparent temperature of a moving black body at T_ex (`rotor.spectra.emission.emission`)."""
        return self.excitation_k * self.shift


@dataclass(frozen=True)
class Dust:
    """Dust mixed with the gas of all layers: τ_d = depth (ν/reference)^β at a single temperature."""

    depth: float
    temperature_k: float
    reference_mhz: float = 230e3
    beta: float = 1.75

    def optical_depth(self, frequency_mhz: Floats) -> Floats:
        """τ_d (n,)."""
        return np.asarray(self.depth * (frequency_mhz / self.reference_mhz) ** self.beta)


@dataclass(frozen=True)
class Sight:
    """Background, beam, redshift, dust and channels of an observation.

    background_k: observed temperature behind the source; at the source it is higher by 1 + z. beam_arcsec: full width of the beam at
    half maximum, needed if a component has a size. redshift: z of the source; observed frequencies are ν_rest/(1 + z), and the
    brightness is lower by 1 + z. dust: in the layers. channel_mhz: width of a channel over which the model is averaged; None: its centre.
    """

    background_k: float = BACKGROUND_K
    beam_arcsec: float | None = None
    redshift: float = 0.0
    dust: Dust | None = None
    channel_mhz: float | None = None


@dataclass(frozen=True)
class Modelled:
    """Brightness (n,) and optical depth (n,) of a model; by component: optical depths (k, n).

    slopes: (k, 5, n) derivatives of the brightness with respect to the `PARAMETERS` of each component, if requested.
    """

    brightness_k: Floats
    optical_depth: Floats
    depths: Floats
    slopes: Floats | None = field(default=None, repr=False)


def escape(depth: Floats) -> tuple[Floats, Floats]:
    """g(τ) = (1 - e^-τ)/τ and its derivative, (n,) each, to full precision for all τ, also the negative ones of masers.

    >>> [round(float(x), 6) for x in escape(np.array([0.0]))[0]], round(float(escape(np.array([2.0]))[0][0]), 6)
    ([1.0], 0.432332)
    """
    small = np.abs(depth) < _SERIES
    τ = np.where(small, 1.0, depth)
    value = -np.expm1(-τ) / τ
    slope = (np.exp(-τ) - value) / τ
    d = depth
    series = 1 - d / 2 + d**2 / 6 - d**3 / 24 + d**4 / 120
    series_slope = -1 / 2 + d / 3 - d**2 / 8 + d**3 / 30 - d**4 / 144
    return np.where(small, series, value), np.where(small, series_slope, slope)


def beam_filling(size_arcsec: float, beam_arcsec: float) -> float:
    """f = θ_s²/(θ_s² + θ_b²).

    >>> beam_filling(0.5, 0.5)
    0.5
    """
    return size_arcsec**2 / (size_arcsec**2 + beam_arcsec**2)


def planck_slope(frequency_mhz: Floats, temperature_k: float) -> Floats:
    """dJ_ν/dT = x² e^x/(e^x - 1)², x = hν/kT, (n,)."""
    x = frequency_mhz / (units.MHZ_PER_K * temperature_k)
    return np.asarray((x / (2 * np.sinh(x / 2))) ** 2)


def model(
    components: Sequence[Component], grid_mhz: Floats, sight: Sight | None = None, *, slopes: bool = False
) -> Modelled:
    """Brightness temperature of a source without continuum, on a grid of observed frequencies.

    Parameters
    ----------
    components : sequence of Component
    grid_mhz : (n,) array
        Rising frequencies.
    sight : Sight, optional
        Background, beam, redshift, dust and width of a channel.
    slopes : bool, optional
        Whether derivatives are computed.

    Returns
    -------
    Modelled

    Raises
    ------
    ValueError
        For a source size without a beam, components of one layer with different sizes, and temperatures beyond Q(T).
    """
    sight = sight or Sight()
    if sight.channel_mhz is not None:
        return _averaged(components, np.asarray(grid_mhz, dtype=np.float64), sight, slopes)
    grid = np.asarray(grid_mhz, dtype=np.float64) * (1 + sight.redshift)
    depths = [component_depth(component, grid, slopes) for component in components]
    total, τ = np.zeros_like(grid), np.zeros_like(grid)
    derivative = np.zeros((len(components), len(PARAMETERS), len(grid))) if slopes else None
    for members in layers(components):
        brightness, depth = _layer(members, components, depths, grid, sight, derivative)
        total += brightness
        τ += depth
    each = np.array([depth[0] for depth in depths]).reshape(len(components), len(grid))
    scale = 1 / (1 + sight.redshift)
    return Modelled(scale * total, τ, each, None if derivative is None else scale * derivative)


def _averaged(components: Sequence[Component], grid: Floats, sight: Sight, slopes: bool) -> Modelled:
    """The mean over each channel, by Gauss quadrature with four points."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    fine = (grid[:, None] + nodes * (sight.channel_mhz or 0.0) / 2).ravel()
    order = np.argsort(fine, kind="stable")
    inner = model(components, fine[order], replace(sight, channel_mhz=None), slopes=slopes)
    back = np.empty_like(order)
    back[order] = np.arange(len(order))

    def mean(values: Floats) -> Floats:
        spread = values[..., back].reshape(*values.shape[:-1], len(grid), len(nodes))
        return np.asarray(spread @ weights / 2)

    return Modelled(
        mean(inner.brightness_k),
        mean(inner.optical_depth),
        mean(inner.depths),
        None if inner.slopes is None else mean(inner.slopes),
    )


def layers(components: Sequence[Component]) -> list[Ints]:
    """Numbers of the components of each layer."""
    labels = np.array([component.layer for component in components])
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]


def _layer(
    members: Ints,
    components: Sequence[Component],
    depths: Sequence[Floats],
    grid: Floats,
    sight: Sight,
    derivative: Floats | None,
) -> tuple[Floats, Floats]:
    """Brightness and optical depth of a layer; its derivatives are written into `derivative`."""
    behind = planck_k(grid, sight.background_k * (1 + sight.redshift))
    contrast = [planck_k(grid, components[k].seen_k) - behind for k in members]
    τ = np.sum([depths[k][0] for k in members], axis=0)
    emitted = np.sum([depths[k][0] * c for k, c in zip(members, contrast, strict=True)], axis=0)
    mixed, continuum = τ, np.zeros(1)
    if sight.dust is not None:
        dust, c_dust = sight.dust.optical_depth(grid), planck_k(grid, sight.dust.temperature_k) - behind
        mixed, emitted = τ + dust, emitted + dust * c_dust
        continuum = c_dust * dust * escape(dust)[0]
    g, g_slope = escape(mixed)
    f = _filling(members, components, sight)
    bare = emitted * g - continuum
    if derivative is not None:
        common = emitted * g_slope
        for k, c in zip(members, contrast, strict=True):
            derivative[k, :4] = f * (c * g + common) * depths[k][1:]
            warmer = f * depths[k][0] * g * planck_slope(grid, components[k].seen_k)
            derivative[k, 1] += warmer * components[k].shift
            derivative[k, 2] -= warmer * components[k].excitation_k / KM_PER_S
            if (size := components[k].size_arcsec) is not None:
                derivative[k, 4] = 2 * f * (1 - f) / size * bare
    return f * bare, τ


def _filling(members: Ints, components: Sequence[Component], sight: Sight) -> float:
    """Beam dilution of a layer."""
    sizes = {components[k].size_arcsec for k in members}
    if len(sizes) > 1:
        raise ValueError(
            f"components of one layer with sizes {sorted(map(str, sizes))}: a layer has a single size; put "
            "components of different sizes into different layers"
        )
    size = sizes.pop()
    if size is None:
        return 1.0
    if sight.beam_arcsec is None:
        raise ValueError(f"a source size of {size:g} arcsec without a beam: state beam_arcsec")
    return beam_filling(size, sight.beam_arcsec)


def component_depth(component: Component, grid_mhz: Floats, slopes: bool = False) -> Floats:
    """τ of a component on a rising grid (1, n); with `slopes` also its derivatives with respect to N, T, v, Δv (5, n).

    With u = (ν - ν_c)/w:  ∂τ/∂N = τ/N;  ∂I/∂T from the exponents and Q;  ∂φ/∂ν_c and ∂φ/∂w of a Gaussian, both ν_c and w moving with v.
    """
    shift = component.shift
    margin = 1 + REACH * component.fwhm_km_s / KM_PER_S
    lines = component.species.between(grid_mhz[0] / shift / margin, grid_mhz[-1] / shift * margin)
    centre = lines.frequency_mhz * shift
    width = centre * component.fwhm_km_s / KM_PER_S
    line, channel = _windows(grid_mhz, centre, REACH * width)
    t = component.excitation_k
    area = component.column_per_cm2 * units.NM2_IN_CM2 * lines.intensity_nm2_mhz(t)
    u = (grid_mhz[channel] - centre[line]) / width[line]
    peak = area * math.sqrt(_LN16 / math.pi) / (width / shift)  # absorption is integrated in the frame of the gas
    depth = peak[line] * np.exp(-_LN16 * u * u)

    def collected(values: Floats) -> Floats:
        return np.asarray(np.bincount(channel, values, minlength=len(grid_mhz)), dtype=np.float64)

    τ = collected(depth)
    if not slopes:
        return τ[None]
    square = 2 * _LN16 * u * u
    by_temperature = collected(depth * _log_slope(lines, t)[line])
    # d/dv: dν_c = -ν_i/c dv, dw/w = dν_c/ν_c; ∂lnφ/∂ν_c = 2·4ln2 u/w, ∂lnφ/∂lnw = 2·4ln2 u², the area in the frame of the gas
    moved = -(2 * _LN16 * u / width[line] * centre[line] + square) / (shift * KM_PER_S)
    widened = (square - 1) / component.fwhm_km_s
    return np.array(
        [τ, τ / component.column_per_cm2, by_temperature, collected(depth * moved), collected(depth * widened)]
    )


def _log_slope(lines: SpeciesLines, temperature_k: float) -> Floats:
    """d ln I/dT of each line: E″/kT² - (x/T)/(e^x - 1) - (d ln Q/d ln T)/T, x = hν/kT."""
    x = lines.frequency_mhz / (units.MHZ_PER_K * temperature_k)
    photon = x / np.expm1(x)
    return np.asarray(
        (lines.energy_lower_k / temperature_k - photon - lines.partition.slope(temperature_k)) / temperature_k
    )


def _windows(grid: Floats, centre: Floats, reach: Floats) -> tuple[Ints, Ints]:
    """Pairs of lines and channels within the reach of the lines, (m,) each."""
    first = np.searchsorted(grid, centre - reach)
    count = np.searchsorted(grid, centre + reach) - first
    return numbers_in_runs(count, first)
