"""Levels of the rotation about a bond whose reduced moment changes with the angle: H = p F(α) p + V(α).

F(α) = ħ²/2I_r(α) of the kinetic energy ½ I_r α'² without angular momentum of the whole (`rotor.molecules.bond_rotation`). In
exp(i m α)/√2π, m = s k + σ, with the Fourier coefficients F_q and V_q of exp(i q α),

    ⟨m|H|m'⟩ = m F_(m-m') m' + V_(m-m'),

where s divides the periods of both and σ = 0 ... s - 1 is the species; with a constant F it is `rotor.quantum.torsion` with ρK = 0.
Neglected: the pseudopotential from the determinant of the kinetic matrix (of the order of F times the square of the relative change of
I_r), the coupling with the rotation of the whole, and with other vibrations beyond their relaxation along a scan.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.units import MHZ_PER_CM

if TYPE_CHECKING:
    from rotor.molecules.bond_rotation import BondRotation
    from rotor.molecules.bond_scan import BondScan

SAMPLES = 512  # angles of a turn at which V and F are sampled: exact for terms up to n = 255
MOST_WAVES = 2500  # largest |m|: some seconds for a torsion without symmetry
MARGIN = 1.2, 20  # of the classical |m| at the highest energy: factor, and waves beyond, into the forbidden range


@dataclass(frozen=True, eq=False)
class FourierSeries:
    """f(α) = mean + Σ a_n cos nα + Σ b_n sin nα.

    >>> series = FourierSeries.fitted(np.arange(6) * np.pi / 3, 2 + np.cos(np.arange(6) * np.pi / 3), 1, 2)
    >>> series.values(np.array([0.0, np.pi])).round(9).tolist()
    [3.0, 1.0]
    """

    mean: float
    n: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    cosines: Floats = field(default_factory=lambda: np.zeros(0))
    sines: Floats = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def from_barriers(cls, v: Mapping[int, float], w: Mapping[int, float] = MappingProxyType({})) -> FourierSeries:
        """Σ ½ V_n (1 - cos nα) + Σ ½ W_n sin nα from V and W by n."""
        n = sorted({*v, *w})
        cosines, sines = (np.array([factor * terms.get(i, 0.0) for i in n]) for factor, terms in ((-0.5, v), (0.5, w)))
        return cls(-float(cosines.sum()), np.array(n, dtype=np.int64), cosines, sines)

    @classmethod
    def fitted(
        cls, angles: ArrayLike, values: ArrayLike, period: int, harmonics: int, even_about: float | None = None
    ) -> FourierSeries:
        """Least squares of n = period, 2 period, ..., harmonics · period; of cos n(α - α_0) alone where f is even about an angle α_0."""
        alpha, n = np.asarray(angles, dtype=float), period * np.arange(1, harmonics + 1)
        about = even_about or 0.0
        phases = np.outer(alpha - about, n)
        waves = [np.cos(phases)] if even_about is not None else [np.cos(phases), np.sin(phases)]
        columns = np.hstack([np.ones((len(alpha), 1)), *waves])
        mean, *amplitudes = np.linalg.lstsq(columns, np.asarray(values, dtype=float), rcond=None)[0]
        even, odd = np.append(amplitudes, np.zeros(2 * harmonics - len(amplitudes))).reshape(2, -1)
        cosine, sine = np.cos(n * about), np.sin(n * about)
        return cls(float(mean), n, even * cosine - odd * sine, even * sine + odd * cosine)

    def values(self, angles: ArrayLike) -> Floats:
        """f at angles in radians."""
        phases = np.multiply.outer(np.asarray(angles, dtype=float), self.n)
        return np.asarray(self.mean + np.cos(phases) @ self.cosines + np.sin(phases) @ self.sines)

    def derivative(self, angles: ArrayLike, order: int = 1) -> Floats:
        """The first or second derivative at angles in radians."""
        phases = np.multiply.outer(np.asarray(angles, dtype=float), self.n)
        return np.asarray((np.exp(1j * phases) @ ((1j * self.n) ** order * (self.cosines - 1j * self.sines))).real)

    def extrema(self, sign: float = 1.0) -> Floats:
        """Angles of the minima in a turn, of the maxima with sign -1; refined by Newton's steps."""
        angles = _grid(8 * SAMPLES)
        values = sign * self.values(angles)
        here = angles[(values < np.roll(values, 1)) & (values <= np.roll(values, -1))]
        for _ in range(3):
            curvature = sign * self.derivative(here, 2)
            slope = sign * self.derivative(here)
            step = np.divide(slope, curvature, out=np.zeros_like(slope), where=curvature > 0)
            here = here - np.clip(step, -angles[1], angles[1])
        turned = here % (2 * np.pi)
        return np.sort(np.where(turned > 2 * np.pi - 1e-9, 0.0, turned))


def potential_of_scan(scan: BondScan, rotation: BondRotation) -> FourierSeries:
    """V(α) in MHz by least squares from a scan about a bond, whose angles are not equidistant."""
    period = rotation.symmetry_number(isotopes=False)
    harmonics = most_harmonics(scan.angles, period)
    return FourierSeries.fitted(
        scan.angles, scan.energies_cm * MHZ_PER_CM, period, harmonics, rotation.mirror_angle(False)
    )


def most_harmonics(angles: Floats, period: int) -> int:
    """Number of Fourier terms for angles in a period: a third of the points, limited by the widest gap."""
    rising = np.sort(angles)
    gaps = np.diff(rising, append=rising[0] + 2 * math.pi / period)
    return max(1, min(len(angles) // 3, int(math.pi / (period * float(gaps.max())))))


@dataclass(frozen=True)
class Well:
    """A minimum of the potential: its angle (radian), V there above the deepest one and the harmonic quantum √(2 F V''), both in MHz."""

    angle: float
    energy_mhz: float
    quantum_mhz: float


@dataclass(frozen=True, eq=False)
class BondTorsion:
    """F(α) and V(α) of a bond in MHz, and the number of equal periods in a turn, `fold`; V counts from its lowest value, `foot_mhz`.

    >>> free = BondTorsion(FourierSeries(150.0), FourierSeries(0.0), 3)
    >>> free.states(1, 9)[0][:2].round(6).tolist()  # F m² of m = 1, -2
    [150.0, 600.0]
    """

    kinetic: FourierSeries
    potential: FourierSeries
    fold: int = 1

    def __post_init__(self) -> None:
        for series, what in ((self.kinetic, "F"), (self.potential, "V")):
            wrong = [int(n) for n in series.n if n % self.fold]
            if wrong:
                raise ValueError(f"{what} has a term n = {wrong[0]}, which is no multiple of the fold {self.fold}")
        if not (self.kinetic.values(_grid()) > 0).all():
            raise ValueError("F is not above 0 at every angle; give more angles of the scan")

    @cached_property
    def foot_mhz(self) -> float:
        """The lowest value of the series of V, from which energies count."""
        lowest = self.potential.values(self.potential.extrema())
        return float(lowest.min()) if len(lowest) else self.potential.mean

    @cached_property
    def _maxima(self) -> Floats:
        """V at its maxima above its foot, 0 without a barrier."""
        highest = self.potential.values(self.potential.extrema(-1.0)) - self.foot_mhz
        return highest if len(highest) else np.zeros(1)

    @property
    def barrier_mhz(self) -> float:
        """Highest less lowest value of V."""
        return float(self._maxima.max())

    @property
    def lowest_barrier_mhz(self) -> float:
        """The lowest maximum of V above its foot; 0 without a barrier."""
        return float(self._maxima.min())

    def sampled(self) -> tuple[Floats, Floats, Floats]:
        """Angles of a whole turn, F and V above its foot there, (SAMPLES,) each."""
        angles = _grid()
        return angles, self.kinetic.values(angles), self.potential.values(angles) - self.foot_mhz

    def wells(self) -> list[Well]:
        """The minima of V in a turn by their angle; none without a barrier."""
        angles = self.potential.extrema()
        v = np.maximum(self.potential.values(angles) - self.foot_mhz, 0.0)
        curvature = np.maximum(self.potential.derivative(angles, 2), 0.0)
        quanta = np.sqrt(2 * self.kinetic.values(angles) * curvature)
        return [Well(*well) for well in zip(angles.tolist(), v.tolist(), quanta.tolist(), strict=True)]

    def waves_for(self, energy_mhz: float) -> int:
        """|m| that holds every state up to an energy above the foot: the classical momentum, and a margin.

        Raises ValueError where it passes MOST_WAVES.
        """
        smallest = float(self.kinetic.values(_grid()).min())
        waves = math.ceil(MARGIN[0] * math.sqrt((energy_mhz + self.barrier_mhz) / smallest)) + MARGIN[1]
        if waves > MOST_WAVES:
            raise ValueError(
                f"the torsion needs functions up to m = {waves}, more than {MOST_WAVES}: a group this heavy is classical here; "
                "give lower temperatures or fewer levels"
            )
        return waves

    def states(self, species: int, waves: int) -> tuple[Floats, NDArray[np.complex128], Ints]:
        """Energies (n,) above the foot, rising, vectors (functions, n) over exp(i m α)/√2π, and m (functions,)."""
        m = species + self.fold * np.arange(-((waves + species) // self.fold), (waves - species) // self.fold + 1)
        _, f, v = self.sampled()
        apart = m[:, None] - m[None, :]
        kinetic, potential = (_elements(values, apart) for values in (f, v))
        energies, vectors = np.linalg.eigh(np.outer(m, m) * kinetic + potential)
        return energies, vectors, m

    def all_energies(self, waves: int) -> Floats:
        """Energies of every species in rising order."""
        return np.sort(np.concatenate([self.states(species, waves)[0] for species in range(self.fold)]))


def _grid(count: int = SAMPLES) -> Floats:
    return 2 * np.pi * np.arange(count) / count


def _elements(values: Floats, apart: Ints) -> NDArray[np.complex128]:
    """Fourier coefficients of sampled values at differences of m; 0 beyond what the samples hold."""
    coefficients = np.fft.fft(values) / len(values)
    held = np.abs(apart) < len(values) // 2
    return np.asarray(np.where(held, coefficients[apart % len(values)], 0.0))
