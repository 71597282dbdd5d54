"""Reorientation and diffusion of the molecules of a run, with the errors of that run.

    C_l(t) = ⟨P_l(u(0)·u(t))⟩,  τ_l = ∫₀^∞ C_l dt,  l = 1, 2           u along the dipole of the model, or along its first bond
    ⟨|r(t) - r(0)|²⟩ = 6 D t                                           in its linear range

(M. P. Allen and D. J. Tildesley, Computer Simulation of Liquids, chapter 2). C_l is integrated up to `WINDOW` of a block and extrapolated
by the exponential of its last half. Means and standard errors come from `BLOCKS` successive blocks. If blocks are not long compared with
τ, or shorter than `LEAST_BLOCK_PS`, the result is missing, with the reason and the length of a run that has it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.analysis import diffusion
from rotor.fluids.summary import Mean
from rotor.geometry import rotations
from rotor.statistics.equipartition import products_over_starts

if TYPE_CHECKING:
    from rotor.fluids.forces.models import RigidModel
    from rotor.fluids.motion.bodies import Bodies

BLOCKS = 5  # few, so that each is long; the standard error of their mean is itself uncertain by a third, 1/√8
WINDOW = 0.5  # fraction of a block up to which correlations are integrated
LEAST_BLOCK_PS = 4.0
FELL_TO = math.exp(-1)  # largest correlation at the end of the window for which the integral is given
MOST_FRAMES = 4096  # of 56 bytes a molecule: 0.2 GB for 1000 molecules
DIFFUSION_FROM_PS = 1.0  # earlier displacements are ballistic or inside the cage of the neighbours, not linear in t
CM2_PER_S = 1e4  # 1 m²/s
SMALL_DIPOLE = 1e-6  # e Å
WHAT = "rotational correlation times and diffusion"


class MotionFrames:
    """Centres (n, 3) and attitudes (n, 4) of a run at equal intervals, which are doubled if there are too many frames."""

    def __init__(self) -> None:
        self.centres: list[Floats] = []
        self.attitudes: list[Floats] = []
        self.stride, self._seen = 1, 0

    def add(self, centres: Floats, attitude: Floats) -> None:
        """Store a frame if its time is due."""
        if self._seen % self.stride == 0:
            self.centres.append(centres.copy())
            self.attitudes.append(attitude.copy())
        self._seen += 1
        if len(self.centres) > MOST_FRAMES:
            self.centres, self.attitudes, self.stride = self.centres[::2], self.attitudes[::2], 2 * self.stride


def reference_axis(model: RigidModel, sites: Floats) -> Floats | None:
    """The unit vector of a model's dipole, or of its first bond without a dipole, in the axes of `sites` (atoms, 3); None for an atom.

    The dipole is expressed by the vectors from the first atom to the others, with coefficients that do not depend on the axes.
    """
    atoms = len(model.symbols)
    if atoms < 2:
        return None
    positions = model.positions_angstrom
    bonds = positions[1:atoms] - positions[0]
    dipole = np.array([site.charge_e for site in model.sites]) @ positions
    if np.linalg.norm(dipole) < SMALL_DIPOLE:
        dipole = bonds[0]
    axis = np.linalg.lstsq(bonds.T, dipole, rcond=None)[0] @ (sites[1:] - sites[0])
    return np.asarray(axis / np.linalg.norm(axis))


def reference_axes(bodies: Bodies, models: Sequence[RigidModel]) -> Floats | None:
    """The axes of all bodies in their principal axes (n, 3); None if a body has none."""
    axes = np.zeros((len(bodies), 3))
    for species in range(len(bodies.names)):
        members = np.flatnonzero(bodies.species == species)
        rows = slice(bodies.starts[members[0]], bodies.starts[members[0] + 1])
        sites = bodies.sites[rows]
        model = next((model for model in models if len(model.symbols) == len(sites)), None)
        axis = None if model is None else reference_axis(model, sites)
        if axis is None:
            return None
        axes[members] = axis
    return axes


def motion_means(frames: MotionFrames, interval_ps: float, axes: Floats | None) -> tuple[list[Mean], str]:
    """τ1, τ2 and D of a run with standard errors, or the reason why they are missing.

    interval_ps: between rows of the run. axes: (n, 3) of all molecules in body axes; None if a molecule has none.
    """
    step = interval_ps * frames.stride
    length = (len(frames.centres) - 1) * step
    if length < BLOCKS * LEAST_BLOCK_PS:
        return (
            [],
            f"{WHAT}: {length:.3g} ps are too short for {BLOCKS} blocks, run {BLOCKS * LEAST_BLOCK_PS:g} ps or more",
        )
    table: list[Mean] = []
    missing: list[str] = []
    if axes is not None:
        turned = rotations.rotate(np.array(frames.attitudes), axes)
        blocks = np.array_split(turned, BLOCKS)
        for order in (1, 2):
            values = [correlation_time(block, step, order) for block in blocks]
            if any(math.isnan(value) for value in values):
                missing.append(_not_decayed(blocks, step, order))
            else:
                table.append(_mean(f"τ{order} of reorientation", "ps", values))
    window = (DIFFUSION_FROM_PS, WINDOW * length / BLOCKS)
    coefficient = diffusion(np.array(frames.centres), step, window, BLOCKS)
    table.append(
        Mean(
            "self-diffusion, in this box",
            "1e-5 cm²/s",
            coefficient.value * CM2_PER_S * 1e5,
            coefficient.error * CM2_PER_S * 1e5,
            BLOCKS,
        )
    )
    return table, "; ".join(missing)


def _not_decayed(blocks: Sequence[Floats], step: float, order: int) -> str:
    """Why τ_l is missing, and the length of a run in whose blocks C_l falls to 1/e."""
    curves = [_in_window(block, order) for block in blocks]
    needed = BLOCKS / WINDOW * max(time_to_fall(curve, step) for curve in curves)
    advice = f"run {math.ceil(needed):.3g} ps or more" if math.isfinite(needed) else "run much longer"
    window = step * (min(map(len, curves)) - 1)
    return (
        f"rotational correlation time τ{order}: in {BLOCKS} blocks C_{order} has not decayed to 1/e within {window:.3g} ps, "
        f"half of a block: {advice}"
    )


def time_to_fall(correlation: Floats, interval: float) -> float:
    """Time at which a correlation function falls to 1/e, by the exponential of its last half; inf if that does not fall.

    >>> round(time_to_fall(np.exp(-np.arange(41) / 100), 0.1), 9)
    10.0
    """
    if correlation.min() <= FELL_TO:
        return interval * int(np.argmax(correlation <= FELL_TO))
    middle = len(correlation) // 2
    slope = math.log(correlation[middle] / correlation[-1]) / (interval * (len(correlation) - 1 - middle))
    end = interval * (len(correlation) - 1)
    return end + math.log(correlation[-1] / FELL_TO) / slope if slope > 0 else math.inf


def _in_window(vectors: Floats, order: int) -> Floats:
    """C_l of a block up to the end of its window."""
    return reorientation(vectors, order)[: max(int(WINDOW * len(vectors)), 2)]


def _mean(quantity: str, unit: str, values: Sequence[float]) -> Mean:
    return Mean(
        quantity, unit, float(np.mean(values)), float(np.std(values, ddof=1) / math.sqrt(len(values))), len(values)
    )


def correlation_time(vectors: Floats, interval: float, order: int) -> float:
    """τ_l of unit vectors (frames, n, 3); nan if C_l stays above 1/e in the window.

    >>> turning = np.array([[[math.cos(t), math.sin(t), 0.0]] for t in np.linspace(0, 40, 2001)])
    >>> math.isnan(correlation_time(np.ones((50, 1, 3)) / math.sqrt(3), 0.1, 1))
    True
    """
    c = _in_window(vectors, order)
    if c.min() > FELL_TO:
        return math.nan
    # stop where noise exceeds the correlation
    last = int(np.argmax(c < 0.05)) or len(c)
    inner = float(np.trapezoid(c[:last], dx=interval))
    tail = c[last // 2 : last]
    slope = (
        -np.polyfit(interval * np.arange(len(tail)), np.log(np.clip(tail, 1e-3, None)), 1)[0] if len(tail) > 2 else 0.0
    )
    return inner + (float(c[last - 1]) / slope if slope > 0 else 0.0)


def reorientation(vectors: Floats, order: int) -> Floats:
    """C_l(t) (frames,) of unit vectors (frames, n, 3), averaged over vectors and starts; P_2(u·u') = 3/2 Σ Q Q', Q = uu - 1/3."""
    if order == 1:
        series, scale = vectors, 1.0
    else:
        series = (vectors[..., :, None] * vectors[..., None, :] - np.eye(3) / 3).reshape(*vectors.shape[:2], 9)
        scale = 1.5
    frames, bodies = series.shape[:2]
    products = sum(products_over_starts(series[..., k]) for k in range(series.shape[-1]))
    return np.asarray(scale * products / ((frames - np.arange(frames)) * bodies))
