"""Tops in fields against matrices of all |J k M⟩ from QuTiP's Clebsch-Gordan coefficients, carried by scipy's DOP853: several kinds."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from field_matrices import contracted_vectors, rigid, rotation_function, states
from scipy.constants import c, h
from scipy.integrate import solve_ivp

from rotor.alignment.align import align
from rotor.alignment.pulse import DipolePulse, GaussianPulse, elliptical
from rotor.quantum.effects.stark import stark_map
from rotor.tops.top import Top

pytestmark = pytest.mark.slow

RAD_PER_PS = 2 * np.pi * 1e-6  # of 1 MHz
DIPOLE_MHZ = 1e-21 / 299792458 / h * 1e5 * 1e-6  # 1 D, 1 kV/cm
LIGHT_MHZ = 2 * np.pi / c * 1e-30 * 1e4 / h * 1e-6  # 1 Å³, 1 W/cm²
Z, ZZ = np.array([0.0, 0.0, 1.0]), np.diag([0.0, 0.0, 1.0])
ABC = [1, 2, 0]  # x, y, z of Iʳ are b, c, a

Strength = Callable[[float], float]


def components(tensor: np.ndarray) -> dict[int, complex]:
    """T²_q of a symmetric Cartesian tensor."""
    xx, yy, zz, xy, xz, yz = (tensor[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    out = {0: (2 * zz - xx - yy) / np.sqrt(6), 1: -(xz + 1j * yz), -1: xz - 1j * yz}
    return {**out, 2: (xx - yy) / 2 + 1j * xy, -2: (xx - yy) / 2 - 1j * xy}


def contracted_tensors(basis, body: np.ndarray, space: np.ndarray) -> np.ndarray:
    """Σ_FG S_FG α_FG, body along x, y, z of the representation."""
    inner, outer = components(body), components(space)
    total = np.trace(body) * np.trace(space) / 3 * np.eye(len(basis))
    for p, q in ((p, q) for p in outer for q in inner if outer[p] and inner[q]):
        total = total + np.conj(outer[p]) * inner[q] * rotation_function(basis, 2, p, q)
    return total


def square(axis: int, space: int) -> tuple[np.ndarray, np.ndarray]:
    """cos² of an axis of the representation and an axis of space."""
    return np.diag(np.eye(3)[axis]), np.diag(np.eye(3)[space])


def evolved(
    free: np.ndarray,
    acting: Sequence[tuple[np.ndarray, Strength]],
    first: int,
    times: np.ndarray,
    window: tuple[float, float],
    seen: Sequence[np.ndarray],
) -> np.ndarray:
    """⟨O⟩ at times (observables, times) from one basis state, in the interaction picture: DOP853 in the window, phases after it."""
    energies, vectors = np.linalg.eigh(free)
    turn = lambda matrix: vectors.conj().T @ matrix @ vectors  # noqa: E731
    omega, moved, shown = RAD_PER_PS * energies, [(turn(item), f) for item, f in acting], [turn(item) for item in seen]

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        phases = np.exp(1j * omega * t)
        return -1j * phases * sum(RAD_PER_PS * f(t) * (item @ (state / phases)) for item, f in moved)

    start = np.exp(1j * omega * window[0]) * vectors.conj().T[:, first]
    steps = {"rtol": 1e-11, "atol": 1e-13, "max_step": (window[1] - window[0]) / 40}
    solved = solve_ivp(rate, window, start, method="DOP853", dense_output=True, **steps)
    out = []
    for t in times:
        state = np.exp(-1j * omega * t) * (solved.sol(t) if t < window[1] else solved.y[:, -1])
        out.append([float((state.conj() @ item @ state).real) for item in shown])
    return np.array(out).T


def gaussian(size: float, fwhm: float, centre: float = 0.0, thz: float = 0.0, phase: float = 0.0) -> Strength:
    return lambda t: (
        -size * np.exp(-4 * np.log(2) * ((t - centre) / fwhm) ** 2) * np.cos(2 * np.pi * thz * (t - centre) + phase)
    )


DOP853 = 1e-8  # error of the slow solution, at a tolerance of 1e-11 and with the J max of its matrix


def deviation(trace, reference: np.ndarray) -> float:
    """The largest deviation of the cosines beyond the error that the trace states; inf for cosines that hardly move."""
    computed = np.array(list(trace.cosines.values()))
    return np.abs(computed - reference).max() - trace.error_estimate if np.ptp(computed) > 0.01 else np.inf


def test_elliptical_light_on_an_asymmetric_top():
    alpha, axis, basis = np.diag([9.0, 6.0, 4.5]), elliptical(0.5), states(6)
    top = Top.from_constants("A=4700 B=2600 C=1900 MHz").with_polarizability(alpha, "")
    space = np.outer(np.conj(axis), axis).real
    light = contracted_tensors(basis, np.diag(alpha.diagonal()[ABC]), space)
    seen = [contracted_tensors(basis, *square(k, f)) for k, f in ((2, 2), (0, 0), (1, 1))]
    times = np.linspace(-2.8, 40, 87)
    slow = evolved(
        rigid(basis, 2600.0, 1900.0, 4700.0), [(light, gaussian(LIGHT_MHZ * 5e10, 0.8))], 0, times, (-2.8, 2.8), seen
    )
    state, names = {"j": 0, "ka": 0, "kc": 0}, ("cos2_aZ", "cos2_bX", "cos2_cY")
    assert (
        deviation(
            align(top, GaussianPulse(5e10, 0.8, axis=axis), times, state=state, observables=names, tolerance=1e-6), slow
        )
        <= DOP853
    )


def rod_matrices(m: int = 0, k: int = 0, highest: int = 16):
    basis = [state for state in states(highest, linear=not k) if state[1:] == (k, m)]
    return basis, contracted_vectors(basis, Z, Z), contracted_tensors(basis, ZZ, ZZ)


def test_a_terahertz_field_and_a_laser_pulse_at_once():
    basis, cosine, squared = rod_matrices()
    top = Top.from_constants("B=6100 MHz", dipole_abc_debye=(0.7, 0, 0)).with_polarizability(np.diag([4.0, 0, 0]), "")
    acting = [
        (0.7 * cosine, gaussian(DIPOLE_MHZ * 60, 1.5, thz=0.25)),
        (4.0 * squared, gaussian(LIGHT_MHZ * 3e11, 0.5, 1.0)),
    ]
    times = np.linspace(-4.5, 40, 90)
    slow = evolved(rigid(basis, 6100.0, 6100.0, 0.0), acting, 0, times, (-4.5, 4.5), [cosine, squared])
    pulses = [DipolePulse(60.0, 1.5, frequency_thz=0.25), GaussianPulse(3e11, 0.5, 1.0)]
    names = ("costheta", "cos2theta")
    assert deviation(align(top, pulses, times, state={"j": 0}, m=0, observables=names, tolerance=1e-6), slow) <= DOP853


def test_a_long_pulse_near_resonance():
    """40 ps at 2B + 0.03 GHz of CO: J = 0 and 1, slowly turned into each other."""
    basis, cosine, squared = rod_matrices(highest=8)
    top = Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0))
    acting, times = (
        [(0.11 * cosine, gaussian(DIPOLE_MHZ * 30, 40.0, thz=0.1153, phase=0.4))],
        np.linspace(-120, 200, 161),
    )
    slow = evolved(rigid(basis, 57635.968, 57635.968, 0.0), acting, 0, times, (-120, 120), [cosine, squared])
    pulse = DipolePulse(30.0, 40.0, frequency_thz=0.1153, phase_rad=0.4)
    assert (
        deviation(
            align(top, pulse, times, state={"j": 0}, m=0, observables=("costheta", "cos2theta"), tolerance=1e-6), slow
        )
        <= DOP853
    )


def test_a_half_cycle_orients_an_oblate_top_of_m_1():
    """J = 2, K = 1: M = 1 and -1 have opposite K M, and are half each."""
    top, times, parts = (
        Top.from_constants("B=9000 C=4800 MHz", dipole_abc_debye=(0, 0, 1.1)),
        np.linspace(-1.8, 80, 164),
        [],
    )
    for m in (1, -1):
        basis, cosine, squared = rod_matrices(m, 1, 10)
        acting = [(1.1 * cosine, gaussian(DIPOLE_MHZ * 120, 0.6))]
        parts.append(evolved(rigid(basis, 9000.0, 9000.0, 4800.0), acting, 1, times, (-1.8, 1.8), [cosine, squared]))
    names = ("costheta", "cos2theta")
    trace = align(top, DipolePulse(120.0, 0.6), times, state={"j": 2, "k": 1}, m=1, observables=names, tolerance=1e-6)
    assert deviation(trace, np.mean(parts, axis=0)) <= DOP853


@pytest.mark.parametrize("m", [1, 2])
def test_maps_of_m_above_0_beside_a_laser(m):
    """Three dipole components: blocks of complex matrices for M and -M; energies and cosines by rank."""
    dipole, alpha = np.array([1.2, 0.8, 0.5]), np.diag([9.0, 6.0, 4.5])
    top = Top.from_constants("A=8100 B=3900 C=2900 MHz", dipole_abc_debye=tuple(dipole)).with_polarizability(alpha, "")
    stark = stark_map(top, [10.0], j_highest=3, m_values=(m,), intensity_w_per_cm2=2e9, tolerance_mhz=1e-5)
    basis = [state for state in states(12) if state[2] == m]
    fixed = rigid(basis, 3900.0, 2900.0, 8100.0) - LIGHT_MHZ * 2e9 * contracted_tensors(
        basis, np.diag(alpha.diagonal()[ABC]), ZZ
    )
    energies, vectors = np.linalg.eigh(fixed - DIPOLE_MHZ * 10 * contracted_vectors(basis, dipole[ABC], Z))
    cosine = np.einsum("is,ik,ks->s", vectors.conj(), contracted_vectors(basis, Z, Z), vectors).real
    assert set(stark.m.tolist()) == {m}  # of M and -M, which have one energy
    assert stark.energy_mhz == pytest.approx(
        energies[stark.rank], abs=stark.accuracy_mhz + 1e-8
    )  # round-off of QuTiP's sums
    assert stark.cosines["costheta"] == pytest.approx(cosine[stark.rank], abs=1e-9)  # the same
