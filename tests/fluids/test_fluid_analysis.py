"""Analysis of paths against closed forms: ideal gas, crystal, ballistic and Brownian motion, correlated noise."""

import math

import numpy as np
import pytest

from rotor.fluids.analysis import (
    Diffusion,
    block_errors,
    diffusion,
    mean_square_displacement,
    pair_distribution,
    yeh_hummer_correction,
)
from rotor.fluids.record import FluidRecord
from rotor.fluids.summary import conserved, drift_per_ns, series_mean


def test_an_ideal_gas_has_g_of_one_for_any_number() -> None:
    rng = np.random.default_rng(1)
    for n, frames in ((2, 10_000), (40, 300)):
        edges = np.array([9.0, 10.0, 12.0])
        path = rng.uniform(-20, 20, (frames, n, 3)) * edges  # outside the cell: folded
        distribution = pair_distribution(path, edges, 4.5, 9)
        pairs = frames * n * (n - 1) / 2 * 4 / 3 * math.pi * np.diff(np.linspace(0, 4.5, 10) ** 3) / np.prod(edges)
        assert np.all(np.abs(distribution.g - 1) < 4.5 / np.sqrt(pairs))  # Poisson: 4.5 standard errors for 18 shells
        whole = (n - 1) * 4 / 3 * math.pi * 4.5**3 / np.prod(edges)
        assert distribution.coordination[-1] == pytest.approx(whole, rel=4 / math.sqrt(pairs.sum()))  # four errors


def test_shells_of_a_face_centred_crystal() -> None:
    cell = np.array([(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)])
    points = (np.array(list(np.ndindex(4, 4, 4)))[:, None] + cell).reshape(-1, 3) * 3.0
    distribution = pair_distribution(points[None], [12.0] * 3, 4.5, 90)
    for distance, neighbours in ((3 / math.sqrt(2), 12), (3.0, 18), (3 * math.sqrt(1.5), 42)):
        assert distribution.coordination[distribution.r_angstrom > distance + 0.05][0] == neighbours
    assert np.count_nonzero(distribution.g[distribution.r_angstrom < 3.7]) == 3


def test_the_first_peak_is_that_of_the_parabola() -> None:
    distribution = pair_distribution(np.zeros((1, 2, 3)) + [[[0, 0, 0]], [[2.0, 0, 0]]][0], [10.0] * 3, 5.0, 50)
    r = distribution.r_angstrom
    shaped = type(distribution)(r, 3 - (r - 2.7312) ** 2, r)
    assert shaped.first_peak() == pytest.approx((2.7312, 3.0), rel=1e-10)  # a parabola is met to round-off


def test_displacements_of_free_flight_and_against_the_plain_double_loop() -> None:
    rng = np.random.default_rng(2)
    velocity = rng.normal(size=(5, 3))
    flight = np.arange(30)[:, None, None] * velocity
    expected = np.arange(30) ** 2 * np.mean(np.sum(velocity**2, axis=1))
    assert np.allclose(mean_square_displacement(flight), expected, rtol=1e-9, atol=1e-9)  # round-off of the transform
    path = rng.normal(size=(12, 4, 3)).cumsum(axis=0) + 100
    plain = [np.mean([np.sum((path[s + t] - path[s]) ** 2, axis=1) for s in range(12 - t)]) for t in range(12)]
    assert np.allclose(mean_square_displacement(path), plain, rtol=1e-10, atol=1e-10)  # the same sums


def test_displacement_of_ornstein_and_uhlenbeck() -> None:
    # v' = -γ v + noise: ⟨Δr²⟩ = 6 kT/(m γ²) (γt - 1 + exp(-γt)); here kT/m = 1, exact steps
    rng, gamma, dt, n, frames = np.random.default_rng(3), 0.5, 0.02, 400, 1500
    keep = math.exp(-gamma * dt)
    v = rng.normal(size=(n, 3))
    path = np.zeros((frames, n, 3))
    for k in range(1, frames):
        new = keep * v + math.sqrt(1 - keep**2) * rng.normal(size=(n, 3))
        path[k] = path[k - 1] + 0.5 * dt * (v + new)
        v = new
    t = dt * np.arange(frames)
    expected = 6 / gamma**2 * (gamma * t - 1 + np.exp(-gamma * t))
    displacement = mean_square_displacement(path)[25:500:25]
    # 400 points, three directions, 30 time units of about 2: some 15,000 samples at short times, 4,000 at long ones
    assert np.allclose(displacement, expected[25:500:25], rtol=0.06)


def test_brownian_points_diffuse_as_they_were_made_to() -> None:
    rng, d, dt = np.random.default_rng(4), 0.25, 0.1  # Å²/ps
    path = np.cumsum(rng.normal(size=(4000, 100, 3)) * math.sqrt(2 * d * dt), axis=0)
    wind = path + np.arange(4000)[:, None, None] * [0.3, 0.0, 0.0]
    transport = diffusion(wind, dt, (1.0, 4.0))
    assert transport.value == pytest.approx(
        d * 1e-8 * 99 / 100, abs=4 * transport.error
    )  # the centre of 100 points is taken out
    assert 0 < transport.error < 0.05 * transport.value
    with pytest.raises(ValueError, match="longer parts or an earlier window"):
        diffusion(wind[:200], dt, (1.0, 4.0))


def test_endless_box_adds_the_drag_of_images() -> None:
    computed = yeh_hummer_correction(Diffusion(2e-9, 1e-10), 300.0, 1e-3, 20.0)
    by_hand = 2.837297 * 1.380649e-23 * 300 / (6 * math.pi * 1e-3 * 20e-10)
    assert computed.corrected - computed.value == pytest.approx(by_hand, rel=1e-12)  # one formula, typed twice
    assert by_hand == pytest.approx(0.3117e-9, rel=1e-3)  # by a pocket calculator


def test_errors_of_correlated_noise_by_blocks_and_by_inefficiency() -> None:
    # x' = a x + noise of variance 1 - a²: the mean of n has variance (1 + a)/(1 - a)/n
    rng, a, n = np.random.default_rng(5), 0.9, 2**15
    noise = rng.normal(size=n) * math.sqrt(1 - a * a)
    x = np.empty(n)
    x[0] = rng.normal()
    for k in range(1, n):
        x[k] = a * x[k - 1] + noise[k]
    exact = math.sqrt((1 + a) / (1 - a) / n)
    levels = block_errors(x)
    assert levels[0] < 0.3 * exact  # neighbours taken for independent
    assert np.max(levels[6:9]) == pytest.approx(exact, rel=0.2)  # 64 to 512 in a block, 64 blocks: an error of 9 %
    assert series_mean("x", "", x).error == pytest.approx(exact, rel=0.15)  # n/19 = 1700 samples, window 45


def test_drift_is_the_slope_and_white_noise_has_its_textbook_error() -> None:
    t = np.linspace(0, 500, 2001)  # ps
    rng = np.random.default_rng(6)
    slope, error = drift_per_ns(t, 3.0 + 0.7 * t / 1000 + 0.01 * rng.normal(size=2001))
    assert error == pytest.approx(0.01 / (math.sqrt(2001) * 0.5 / math.sqrt(12)), rel=0.15)  # σ/(√n s_t)
    assert slope == pytest.approx(0.7, abs=4 * error)
    assert drift_per_ns(t, 2.0 * t)[0] == pytest.approx(2000.0, rel=1e-9)
    assert math.isnan(drift_per_ns([0.0, 1.0], [0.0, 1.0])[1])  # a line through two points leaves no scatter


def test_the_drift_of_correlated_energies_is_zero_within_its_error() -> None:
    rng, deviations = np.random.default_rng(3), []
    for _ in range(200):
        energy = np.convolve(rng.normal(size=1020), np.ones(21) / 21, mode="valid")  # no drift, correlated over 21 rows
        _, drift, error = conserved(FluidRecord(np.arange(1000) * 0.02, *[energy] * 8))
        deviations.append(drift / error)
    assert 0.8 < np.std(deviations) < 1.3  # 4 to 5 where rows are taken for independent


@pytest.mark.parametrize(("call", "message"), [
    (lambda: pair_distribution(np.zeros((3, 3)), [1.0] * 3, 0.5), "a path of shape"),
    (lambda: pair_distribution(np.zeros((1, 1, 3)), [1.0] * 3, 0.5), "two points or more"),
    (lambda: pair_distribution(np.zeros((1, 2, 3)), [4.0, 5.0, 6.0], 2.1), "at most half of the shortest edge, 2 Å"),
])  # fmt: skip
def test_what_is_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
