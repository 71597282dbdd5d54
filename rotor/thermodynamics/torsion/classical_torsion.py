"""A classical gas of molecules with hindered internal rotation: barrier crossings and equipartition.

Molecules are drawn from exp(-H/kT) and propagated by `rotor.classical.internal_rotor`, with overall rotation and torsion coupled. In
equilibrium α' is Gaussian with variance kT/I_red at any α, so that a molecule crosses the maxima α* of V, in either direction, at the rate

    k = √(2kT/π I_red) Σ_α* exp(-V(α*)/kT) / ∮ exp(-V/kT) dα,

the flux of transition-state theory; recrossings count as passages. ⟨p ∂H/∂p⟩ = kT and ⟨L·ω⟩ = 3kT hold for any barrier (equipartition
of momenta); ⟨V⟩ is ½kT only in a harmonic well, and in general ∮ V exp(-V/kT) dα / ∮ exp(-V/kT) dα. Only tops whose rotation does not
change the moments of inertia (threefold axis or higher) are computed. Energies are in u Å²/ps², times in ps.

The step is symplectic and conserves an energy H' near H. With R the largest |H(t) - H(0)| of a molecule in kT, exp(-H/kT) and exp(-H'/kT)
differ by a factor within exp(±R), in the numerator and in the denominator of k: the step changes k by less than k (exp(2R) - 1).
Quantum mechanics changes it by κ = 1 + (ħω*/kT)²/24 + ..., ω*² = -V''(α*)/I_red (E. Wigner, 1932, as in the documentation of RMG-Py,
rmgpy.kinetics.Wigner).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.classical.internal_rotor import TurningTop, turning_motion
from rotor.geometry.rotations import IDENTITY
from rotor.molecules.bond_rotation import BondRotation
from rotor.quantum.bond_torsion import FourierSeries
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.table import Table

ENERGY_PER_MHZ = units.PLANCK_J_S * 1e6 / (units.ATOMIC_MASS_KG * 1e4)  # u Å²/ps²
ENERGY_PER_K = units.BOLTZMANN_J_PER_K / (units.ATOMIC_MASS_KG * 1e4)
HBAR = ENERGY_PER_MHZ * 1e6 / (2 * math.pi)  # u Å²/ps
ROWS = 50  # times of the table
STEP = 0.15  # phase of the fastest angular frequency per step, radian
SYMMETRIC = 0.02  # largest change of the moments over the moment of the top; distorted methyl groups give 0.01
ANGLES = 2 * np.pi * np.arange(4096) / 4096


class Mean(NamedTuple):
    """A mean over molecules and time, and its standard error from the spread of the molecular means."""

    value: float
    error: float


@dataclass(frozen=True, eq=False, repr=False)
class ClassicalTorsion(Table):
    """The gas at several times: energy and potential per molecule (cm⁻¹), and cumulative passages per molecule.

    rate: passages per molecule and ps; its error is from the spread over molecules, because the passages of one molecule are correlated.
    expected_rate: equilibrium flux. equipartition: means in kT. momentum_error: largest change of L in space, relative to its rms.
    largest_energy_error_kt: largest change of the energy of a molecule. tunnelling: κ - 1.
    """

    temperature_k: float
    molecules: int
    step_ps: float
    time_ps: Floats
    energy_cm: Floats
    potential_cm: Floats
    passages: Floats
    rate: Mean
    expected_rate: float
    expected_potential: float
    equipartition: Mapping[str, Mean]
    momentum_error: float
    largest_energy_error_kt: float
    tunnelling: float

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of the rate of passages."""
        rate = self.expected_rate
        return ErrorBudget(
            "passages",
            "a molecule and ps",
            ErrorTerm(rate * self.momentum_error, "largest change of L in space"),
            ErrorTerm(
                rate * math.expm1(2 * self.largest_energy_error_kt), "largest change of the energy of a molecule"
            ),
            ErrorTerm(rate * self.tunnelling, "tunnelling to first order, (ħω/kT)²/24 (Wigner)"),
            ErrorTerm(None, "the potential has no stated error"),
            ErrorTerm(self.rate.error, f"{self.molecules} molecules"),
        )

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """time_ps, energy_cm, potential_cm, passages."""
        return {name: getattr(self, name) for name in ("time_ps", "energy_cm", "potential_cm", "passages")}

    @property
    def energy_error(self) -> float:
        """Largest change of the mean energy, relative to kT."""
        kt_cm = self.temperature_k * units.MHZ_PER_K / units.MHZ_PER_CM
        return float(np.abs(self.energy_cm - self.energy_cm[0]).max()) / kt_cm

    def facts(self) -> dict[str, Any]:
        """The numbers of the gas by their keys in docs/verbs."""
        means = {name: {"value": mean.value, "error": mean.error} for name, mean in self.equipartition.items()}
        return {
            "temperature_k": self.temperature_k, "molecules": self.molecules, "duration_ps": float(self.time_ps[-1]),
            "step_ps": self.step_ps, "passages_per_ps": self.rate.value, "passages_error_per_ps": self.rate.error,
            "passages_expected_per_ps": self.expected_rate, "energy_error_kt": self.energy_error,
            "momentum_error": self.momentum_error, "equipartition_kt": means,
            "potential_expected_kt": self.expected_potential, "errors": self.errors.as_json(),
        }  # fmt: skip


def refuse_changing_moments(rotation: BondRotation) -> None:
    """Raise ValueError for a turning group whose rotation changes the moments of inertia."""
    positions, kinetic = rotation.molecule.positions_angstrom, rotation.kinetic_matrix()
    turned = [rotation.kinetic_matrix(rotation.turned_positions(positions, angle)) for angle in (0.7, 1.9, 3.6)]
    change = max(float(np.abs(matrix - kinetic).max()) for matrix in turned) / float(kinetic[3, 3])
    if change > SYMMETRIC:
        raise ValueError(
            f"classical_k: the moments change by {change:.2g} of that of the turning part as it turns; expected a part with a threefold "
            "axis or more behind the bond, such as methyl: name the bond the other way, or another one"
        )


def turning_top(rotation: BondRotation, potential: FourierSeries) -> TurningTop:
    """The body of a molecule with a symmetric top behind its bond; u, Å, ps."""
    kinetic = rotation.kinetic_matrix()
    moments, axes = np.linalg.eigh(kinetic[:3, :3])
    terms = [
        {int(n): factor * float(value) * ENERGY_PER_MHZ for n, value in zip(potential.n, values, strict=True) if value}
        for factor, values in ((-2.0, potential.cosines), (2.0, potential.sines))
    ]
    return TurningTop(moments, axes.T @ kinetic[:3, 3], float(kinetic[3, 3]), *terms)


def passage_rate(body: TurningTop, kt: float) -> float:
    """The equilibrium flux over all maxima of V, in both directions.

    >>> free = TurningTop([8.0, 40.0, 44.0], [1.0, 0.0, 0.0], 3.0, {3: 1e-9})
    >>> round(float(passage_rate(free, 2.0) / (3 / (2 * np.pi) * np.sqrt(4.0 / (np.pi * free.reduced_moment)))), 6)
    1.0
    """
    weight = np.exp(-body.potential(ANGLES) / kt)
    speed = math.sqrt(2 * kt / (math.pi * body.reduced_moment))
    return float(speed * np.exp(-body.potential(_maxima(body)) / kt).sum() / (weight.mean() * 2 * np.pi))


def _maxima(body: TurningTop) -> Floats:
    """Angles of the maxima of V in one turn, on a grid fine enough for a relative error of V of 1e-6."""
    values = body.potential(ANGLES)
    return ANGLES[(values > np.roll(values, 1)) & (values >= np.roll(values, -1))]


def _tunnelling(body: TurningTop, kt: float) -> float:
    """κ - 1 = (ħω*/kT)²/24, averaged over the maxima of V, weighted by their share of the flux."""
    angles = _maxima(body)
    curvature = (body.torque(angles + 1e-4) - body.torque(angles - 1e-4)) / 2e-4  # -V'': to 1e-7 of itself
    return float(
        np.average(HBAR**2 * curvature / body.reduced_moment, weights=np.exp(-body.potential(angles) / kt))
        / (24 * kt**2)
    )


def _mean_potential(body: TurningTop, kt: float) -> float:
    """⟨V⟩ above the lowest point, by quadrature."""
    above = body.potential(ANGLES) - body.potential(ANGLES).min()
    return float(np.average(above, weights=np.exp(-above / kt)))


def _wells_below(angle: Floats, maxima: Floats) -> Floats:
    """Number of maxima between 0 and each unwrapped angle."""
    turns = np.floor(angle / (2 * np.pi))
    return np.asarray(turns * len(maxima) + np.searchsorted(maxima, angle - 2 * np.pi * turns))


def _step(body: TurningTop, kt: float) -> float:
    """The time step: STEP over the fastest of torsion in its well, rotation of the top and overall rotation."""
    stiffest = float(np.abs(np.gradient(body.torque(ANGLES), ANGLES)).max())
    squares = (stiffest / body.reduced_moment, 4 * kt / body.reduced_moment, 4 * kt / float(body.rest_moments[0]))
    return STEP / math.sqrt(max(squares))


def classical_torsion(
    body: TurningTop, temperature_k: float, duration_ps: float, molecules: int, seed: int
) -> ClassicalTorsion:
    """Sample a gas at a temperature and propagate it.

    Parameters
    ----------
    body : TurningTop
        u, Å, ps, as `turning_top` makes it.
    temperature_k, duration_ps : float
    molecules : int
        Sample size.
    seed : int
        Seed of the random numbers.

    Returns
    -------
    ClassicalTorsion
    """
    kt, rng = ENERGY_PER_K * temperature_k, np.random.default_rng(seed)
    state = body.thermal(kt, molecules, rng=rng)
    attitude: Floats = np.broadcast_to(IDENTITY, (molecules, 4)).copy()
    maxima, floor = _maxima(body), float(body.potential(ANGLES).min())
    step, row = _step(body, kt), duration_ps / ROWS
    times = np.linspace(0.0, row, max(2, math.ceil(row / (2 * step))) + 1)
    rows, passages = [_sampled(body, *state)], [np.zeros(molecules)]
    start, moved = state[0], 0.0
    for _ in range(ROWS):
        motion = turning_motion(body, *state, times, step, attitude)
        passages.append(np.abs(np.diff(_wells_below(motion.angle, maxima), axis=0)).sum(axis=0))
        state, attitude = (motion.momentum[-1], motion.p[-1], motion.angle[-1]), motion.attitude[-1]
        moved = max(moved, float(np.abs(motion.momentum_in_space[-1] - start).max()))
        rows.append(_sampled(body, *state))
    samples = np.array(rows)  # (times, quantities, molecules)
    samples[:, :2] -= floor
    means = samples[:, 1:].mean(axis=0) / kt
    errors = means.std(axis=1) / math.sqrt(molecules)
    rates = np.sum(passages, axis=0) / duration_ps
    factors = {"potential": 1.0, "torsion": 1.0, "rotation": 3.0}
    to_cm = 1 / (ENERGY_PER_MHZ * units.MHZ_PER_CM)
    return ClassicalTorsion(
        temperature_k,
        molecules,
        float(times[1]) / math.ceil(float(times[1]) / step - 1e-9),
        np.linspace(0.0, duration_ps, ROWS + 1),
        samples[:, 0].mean(axis=1) * to_cm,
        samples[:, 1].mean(axis=1) * to_cm,
        np.cumsum(np.mean(passages, axis=1)),
        Mean(float(rates.mean()), float(rates.std()) / math.sqrt(molecules)),
        passage_rate(body, kt),
        _mean_potential(body, kt) / kt,
        {
            name: Mean(float(m.mean()) / f, float(e) / f)
            for (name, f), m, e in zip(factors.items(), means, errors, strict=True)
        },
        moved / float(np.sqrt(np.mean(start**2))),
        float(np.abs(samples[:, 0] - samples[0, 0]).max()) / kt,
        _tunnelling(body, kt),
    )


def _sampled(body: TurningTop, momentum: Floats, p: Floats, angle: Floats) -> Floats:
    """H, V, p ∂H/∂p and L·ω (quantities, molecules)."""
    rotation = np.sum(momentum * body.angular_velocity(momentum, p), axis=1)
    return np.array(
        [body.energy(momentum, p, angle), body.potential(angle), p * body.angle_rate(momentum, p), rotation]
    )
