"""Analysis of trajectories: pair distribution, displacement and diffusion, drift; with errors for correlated data.

Paths are arrays (frames, n, 3) in Å of n points, not wrapped into the cell; cells are rectangular, with edges (3,).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats
from rotor.statistics.equipartition import products_over_starts
from rotor.table import Table

YEH_HUMMER_XI = 2.837297  # of a cubic cell; I.-C. Yeh and G. Hummer, J. Phys. Chem. B 108, 15873 (2004), below eq. 12
M2_PER_S = 1e-8  # 1 Å²/ps in m²/s


@dataclass(frozen=True, eq=False, repr=False)
class PairDistribution(Table):
    """r_angstrom: (bins,) middles of shells. g: (bins,). coordination: (bins,) neighbours up to the end of each shell."""

    r_angstrom: Floats
    g: Floats
    coordination: Floats

    @property
    def columns(self) -> dict[str, Floats]:
        """The table by column."""
        return {"r_angstrom": self.r_angstrom, "g": self.g, "coordination": self.coordination}

    def first_peak(self) -> tuple[float, float]:
        """Place and height of the highest value, by the parabola through it and its neighbours."""
        top = int(np.clip(np.argmax(self.g), 1, len(self.g) - 2))
        curve = np.polynomial.Polynomial.fit(self.r_angstrom[top - 1 : top + 2], self.g[top - 1 : top + 2], 2)
        place = float(curve.deriv().roots()[0])
        return place, float(curve(place))


def pair_distribution(path: ArrayLike, edges: ArrayLike, r_max: float, bins: int = 200) -> PairDistribution:
    """g(r) of one kind of points: pairs found in a shell over pairs expected of an ideal gas, n (n - 1)/V times its volume.

    Parameters
    ----------
    path : (frames, n, 3) array
        Positions.
    edges : (3,) array
        Edges of the periodic cell.
    r_max : float
        Largest distance, at most half of the shortest edge.
    bins : int
        Number of shells.

    Returns
    -------
    PairDistribution
        Normalised so that an ideal gas has g = 1 for any n.

    Examples
    --------
    >>> crystal = np.array([[[i, j, k] for i in range(4) for j in range(4) for k in range(4)]], dtype=float)
    >>> shells = pair_distribution(crystal, [4.0, 4.0, 4.0], 1.2, 12)
    >>> round(float(shells.coordination[-1]), 12)  # six nearest neighbours of a simple cubic crystal
    6.0
    """
    from scipy.spatial import cKDTree

    frames, cell = _path(path), np.asarray(edges, dtype=np.float64)
    n = frames.shape[1]
    if n < 2:
        raise ValueError("a pair distribution is one of two points or more")
    if not 0 < r_max <= cell.min() / 2:
        raise ValueError(f"r_max = {r_max}: above 0 and at most half of the shortest edge, {cell.min() / 2:g} Å")
    borders = np.linspace(0.0, r_max, bins + 1)
    counts = np.zeros(bins)
    for points in frames:
        folded = np.minimum(np.mod(points, cell), np.nextafter(cell, 0))
        pairs = cKDTree(folded, boxsize=cell).query_pairs(r_max, output_type="ndarray")
        apart = folded[pairs[:, 0]] - folded[pairs[:, 1]]
        distances = np.linalg.norm(apart - cell * np.round(apart / cell), axis=1)
        counts += np.histogram(distances, borders)[0]
    counts *= 2 / len(frames)
    shells = 4 / 3 * math.pi * np.diff(borders**3)
    expected = n * (n - 1) / float(np.prod(cell)) * shells
    return PairDistribution(0.5 * (borders[1:] + borders[:-1]), counts / expected, np.cumsum(counts) / n)


def mean_square_displacement(path: ArrayLike) -> Floats:
    """⟨|r(t₀ + t) - r(t₀)|²⟩ (frames,) in Å², averaged over points and all starts t₀.

    The sums over starts are correlations, computed by fast Fourier transform (V. Calandrini et al., Collection SFN 12, 201
    (2011), section 3.2). Late times are averages over few starts.

    >>> mean_square_displacement(np.arange(4.0)[:, None, None] * [[[1.0, 0.0, 0.0]]]).round(12).tolist()
    [0.0, 1.0, 4.0, 9.0]
    """
    points = _path(path)
    points = points - points.mean(axis=0)
    frames = len(points)
    starts = frames - np.arange(frames)
    squares = np.sum(points**2, axis=(1, 2))
    before, after = np.cumsum(squares)[::-1], np.cumsum(squares[::-1])[::-1]
    products = products_over_starts(points.reshape(frames, -1))
    return np.asarray((before + after - 2 * products) / (starts * points.shape[1])).clip(min=0.0)


@dataclass(frozen=True)
class Diffusion:
    """value: D in m²/s in the periodic box. error: standard error. corrected: extrapolated to an infinite box, or None."""

    value: float
    error: float
    corrected: float = float("nan")


def diffusion(
    path: ArrayLike, interval_ps: float, window_ps: tuple[float, float] = (2.0, 10.0), blocks: int = 5
) -> Diffusion:
    """Coefficient of self-diffusion from Einstein's relation, ⟨Δr²⟩ = 6 D t, as the slope within a window of times.

    Parameters
    ----------
    path : (frames, n, 3) array
        Unwrapped positions, Å.
    interval_ps : float
        Time between frames.
    window_ps : (float, float)
        First and last time of the slope.
    blocks : int
        Successive parts of the path, each longer than the window, whose mean and standard error are returned.

    Returns
    -------
    Diffusion
        D and its error, after subtraction of the common drift of all points.
    """
    points = _path(path)
    points = points - points.mean(axis=1, keepdims=True)
    parts = np.array_split(points, blocks)
    first, last = (round(t / interval_ps) for t in window_ps)
    if not 0 <= first < last < min(map(len, parts)):
        raise ValueError(
            f"a window of {window_ps[0]:g} to {window_ps[1]:g} ps in {blocks} parts of {len(parts[-1]) * interval_ps:g} ps: "
            "expected longer parts or an earlier window"
        )
    slopes = [_slope(mean_square_displacement(part)[first : last + 1], interval_ps) for part in parts]
    values = np.array(slopes) / 6 * M2_PER_S
    return Diffusion(float(values.mean()), float(values.std(ddof=1) / math.sqrt(blocks)))


def _slope(values: Floats, interval: float) -> float:
    return float(np.polyfit(interval * np.arange(len(values)), values, 1)[0])


def yeh_hummer_correction(
    diffusion: Diffusion, temperature_k: float, viscosity_pa_s: float, edge_angstrom: float
) -> Diffusion:
    """D corrected for the hydrodynamic drag of periodic images, D + ξ kT/(6π η L) for a cubic cell (Yeh and Hummer 2004, eq. 12).

    Parameters
    ----------
    diffusion : Diffusion
        In the periodic cell.
    temperature_k : float
        Temperature.
    viscosity_pa_s : float
        Viscosity of the model, which hardly depends on the box; 0.729e-3 for SPC/E at 298 K (M. A. González and J. L. F. Abascal,
        J. Chem. Phys. 132, 096101 (2010)).
    edge_angstrom : float
        Edge of the cell.

    Returns
    -------
    Diffusion
        With `corrected` set.

    Examples
    --------
    >>> periodic = Diffusion(2.5e-9, 0.0)
    >>> round(yeh_hummer_correction(periodic, 298.15, 0.729e-3, 18.64).corrected * 1e9, 3)
    2.956
    """
    drag = units.BOLTZMANN_J_PER_K * temperature_k / (6 * math.pi * viscosity_pa_s * edge_angstrom * 1e-10)
    return Diffusion(diffusion.value, diffusion.error, diffusion.value + YEH_HUMMER_XI * drag)


def block_errors(series: ArrayLike) -> Floats:
    """Standard errors by repeated averaging of neighbours, (levels,); they reach a plateau once blocks are independent.

    H. Flyvbjerg and H. G. Petersen, J. Chem. Phys. 91, 461 (1989), eqs. 23-27. The last level has eight blocks or more.

    >>> block_errors(np.tile([1.0, -1.0], 16)).round(3).tolist()
    [0.18, 0.0, 0.0]
    """
    values = np.asarray(series, dtype=np.float64)
    errors = []
    while len(values) >= 8:
        errors.append(values.std(ddof=1) / math.sqrt(len(values)))
        even = len(values) // 2 * 2
        values = 0.5 * (values[0:even:2] + values[1:even:2])
    return np.array(errors)


def _path(path: Any) -> Floats:
    points = np.asarray(path, dtype=np.float64)
    if points.ndim != 3 or points.shape[-1] != 3 or not len(points):
        raise ValueError(f"a path of shape {points.shape}: expected (frames, n, 3) with frames > 0")
    return points
