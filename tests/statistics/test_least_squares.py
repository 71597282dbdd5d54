"""The search and the statistics of least squares against closed forms and plain linear algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor.statistics.least_squares import minimise
from rotor.statistics.regression import regression


def straight_line(rng, scales):
    """A linear problem with columns of very different size: design, data of unit error, exact parameters."""
    design = rng.normal(size=(40, len(scales))) * scales
    exact = rng.normal(size=len(scales)) / scales
    return design, design @ exact + rng.normal(size=40), exact


def linear(design, data):
    return lambda p: (data - design @ p, design)


@given(seed=st.integers(0, 2**31), decades=st.integers(0, 15))
def test_a_linear_problem_takes_one_step_whatever_the_units(seed, decades):
    rng = np.random.default_rng(seed)
    design, data, _ = straight_line(rng, np.array([1.0, 10.0**decades, 10.0**-decades]))
    minimum = minimise(linear(design, data), np.zeros(3))
    scaled = design / np.linalg.norm(design, axis=0)
    expected = np.linalg.lstsq(scaled, data)[0] / np.linalg.norm(design, axis=0)
    assert minimum.converged
    assert len(minimum.iterations) == 1
    assert minimum.parameters == pytest.approx(expected, rel=1e-8)  # round-off times the condition of random columns


def rosenbrock(p):
    r = np.array([10 * (0 - (p[1] - p[0] ** 2)), 0 - (1 - p[0])])
    return r, np.array([[-20 * p[0], 10.0], [-1.0, 0.0]])


def test_a_curved_valley_is_followed_to_its_end():
    minimum = minimise(rosenbrock, np.array([-1.2, 1.0]))
    assert minimum.converged
    assert minimum.parameters == pytest.approx(
        [1.0, 1.0], abs=1e-3
    )  # tolerance 1e-4 of the standard errors, 1 and 2 here


def test_it_does_not_say_that_it_has_converged_when_it_has_not():
    cut = minimise(rosenbrock, np.array([-1.2, 1.0]), most_iterations=1)
    assert not cut.converged
    assert cut.status == "too many iterations"
    assert "not converged after 1 iteration" in cut.reason

    def downhill_forever(p):  # the Jacobian has the wrong sign: every step leads up
        r, j = rosenbrock(p)
        return r, -j

    stalled = minimise(downhill_forever, np.array([-1.2, 1.0]))
    assert stalled.status == "stalled"


def test_a_search_at_the_edge_of_the_model_has_not_converged():
    """Steps out of the model say nothing of how χ² bends: 5.7 standard errors are left there."""

    def bounded(p):
        if p[0] < 0:
            raise ValueError("p0 is below 0")
        return np.array([p[0] + 5.0, p[1] - 3.0, 0.1]), np.array([[-1.0, 0.0], [0.0, -1.0], [0.0, 0.0]])

    assert not minimise(bounded, np.array([0.5, 0.0])).converged


@pytest.mark.parametrize(("seed", "start"), [(2, 1.0), (6, 1.0), (11, 1e4), (17, 1e4)])
def test_a_square_that_should_be_negative_ends_at_zero_and_a_wrong_slope_does_not(seed, start):
    """p₁² is best below 0: χ² bends upwards about p₁ = 0, where the slope by p₁ is none; residuals have the round-off of a spectrum.

    From 1e4 the column of p₁ was so long that only dampings far below the usual ones still move it."""
    rng, x = np.random.default_rng(seed), np.linspace(0, 1, 50)
    data = 3 * x - 0.3 * x**2 + rng.normal(size=50)

    def residuals(p, sign=1.0):
        noise = 1e-8 * np.sin(1e9 * (p[0] + p[1]) + np.arange(50))
        return data - p[0] * x - p[1] ** 2 * x**2 + noise, sign * np.stack([x, 2 * p[1] * x**2], axis=1)

    minimum = minimise(residuals, np.array([2.0, start]))
    assert minimum.converged
    assert "χ² allows none" in minimum.reason
    assert abs(minimum.parameters[1]) < 1e-3  # (1e-3)² is 1e-5 of its standard error of about 0.6
    assert minimum.parameters[0] == pytest.approx(
        (data @ x) / (x @ x), abs=1e-3
    )  # the fit without p₁; its error is 0.2
    assert not minimise(lambda p: residuals(p, -1.0), np.array([2.0, start])).converged


def test_an_interrupt_leaves_the_best_point():
    def stop(iteration):
        if iteration.taken and iteration.number > 1:
            raise KeyboardInterrupt

    minimum = minimise(rosenbrock, np.array([-1.2, 1.0]), progress=stop)
    start = np.sum(rosenbrock(np.array([-1.2, 1.0]))[0] ** 2)
    assert minimum.status == "interrupted"
    assert np.sum(minimum.residuals**2) < start


def test_a_step_out_of_bounds_is_shortened():
    def logarithm(p):
        if p[0] <= 0:
            raise ValueError("the logarithm of nothing")
        return np.array([-2.0 - np.log(p[0])]), np.array([[1 / p[0]]])

    minimum = minimise(logarithm, np.array([1.0]))
    assert minimum.converged
    assert minimum.parameters[0] == pytest.approx(np.exp(-2.0), rel=1e-4)  # the tolerance of the search


def test_covariance_leverages_and_dfbetas_are_those_of_the_normal_equations():
    rng = np.random.default_rng(1)
    design, data, _ = straight_line(rng, np.array([1.0, 50.0, 1e-3]))
    regressed = regression(design, ["a", "b", "c"])
    assert regressed.covariance == pytest.approx(
        np.linalg.inv(design.T @ design), rel=1e-9
    )  # a well-conditioned design
    hat = design @ np.linalg.inv(design.T @ design) @ design.T
    assert regressed.leverages == pytest.approx(np.diag(hat), abs=1e-12)  # round-off
    solution = np.linalg.lstsq(design, data)[0]
    moved = regressed.dfbetas(data - design @ solution)
    for left_out in (0, 7, 39):
        rest = np.arange(40) != left_out
        without = np.linalg.lstsq(design[rest], data[rest])[0]
        spread = np.sqrt(np.sum((data[rest] - design[rest] @ without) ** 2) / (39 - 3))
        assert moved[left_out] == pytest.approx(
            (solution - without) / (spread * regressed.errors), rel=1e-8
        )  # round-off


def test_standard_errors_are_the_scatter_of_repeated_fits():
    rng = np.random.default_rng(3)
    design = rng.normal(size=(30, 2)) * [1.0, 1e4]
    errors = regression(design, ["a", "b"]).errors
    computed = np.array([np.linalg.lstsq(design, rng.normal(size=30))[0] for _ in range(4000)])
    assert computed.std(axis=0) / errors == pytest.approx(
        1.0, abs=0.045
    )  # four standard errors of a σ from 4000 samples


def test_what_is_not_determined_is_named():
    rng = np.random.default_rng(2)
    design = rng.normal(size=(20, 4))
    design[:, 1] = 0.0
    design[:, 3] = -3.0 * design[:, 2]
    regressed = regression(design, ["A", "DK", "B", "C"])
    assert {combination.text for combination in regressed.undetermined} == {"DK", "C + 1 B"}
    assert np.isfinite(regressed.errors).tolist() == [True, False, False, False]
    assert regressed.condition == np.inf
    assert regressed.rank == 2


def test_a_column_of_round_off_is_no_information():
    design = np.column_stack([np.ones(5), 1e-9 * np.array([1.0, -1, 1, -1, 1])])
    assert np.isfinite(regression(design, ["B", "A"]).errors).all()
    blind = regression(design, ["B", "A"], np.array([0.0, 1e-8]))
    assert [combination.text for combination in blind.undetermined] == ["A"]


def test_a_parameter_whose_column_is_round_off_is_not_moved():
    rng = np.random.default_rng(5)
    design = np.column_stack([np.ones(30), 1e-14 * rng.normal(size=30)])
    data = 3.0 + rng.normal(size=30)
    minimum = minimise(linear(design, data), np.array([0.0, 7.0]), floor=np.array([0.0, 1e-10]))
    assert minimum.converged
    assert minimum.parameters[1] == 7.0
    assert minimum.parameters[0] == pytest.approx(data.mean(), rel=1e-12)  # round-off


def test_a_narrow_curved_valley_is_followed_to_its_end():
    """r = (300 (y - x²), 1 - x): an undamped step leaves the valley, and one with λ = 1e-4 hardly moves."""

    def valley(p):
        x, y = p
        return np.array([300 * (y - x * x), 1 - x]), np.array([[600 * x, -300.0], [1.0, 0.0]])

    minimum = minimise(valley, np.array([-1.2, 1.0]), most_iterations=700)
    assert minimum.converged
    assert minimum.parameters == pytest.approx([1.0, 1.0], abs=1e-6)  # of a step below 1e-4 standard errors at rms 0


@pytest.mark.parametrize("start", [0.0, 0.5, 1.0, -3.0])
@pytest.mark.parametrize("slope", [1e2, 1e4, 1e6, 1e9])
def test_a_kink_is_no_minimum(slope, start):
    """Beyond p = 1 one residual rises steeply, as where two levels exchange their names: χ² has its lowest point there, and a slope."""
    rng, x = np.random.default_rng(1), np.linspace(0, 1, 30)
    noise = 0.1 * rng.normal(size=30)

    def kinked(p):
        r = (5 - p[0]) * x + noise
        r[3] += slope * max(p[0] - 1, 0.0)
        return r, x[:, None].copy()

    minimum = minimise(kinked, np.array([start]))
    assert not minimum.converged
    assert minimum.distance > 10  # standard errors that seem to be left


def test_a_long_curved_valley_takes_a_few_steps():
    """Steps along the tangent leave it at once; with what they did not foresee the way follows the bend."""

    def valley(p):
        x, y = p
        return np.array([300 * (y - x * x), 1 - x]), np.array([[600 * x, -300.0], [1.0, 0.0]])

    minimum = minimise(valley, np.array([-1.2, 1.0]))
    assert minimum.converged
    assert len(minimum.iterations) < 5  # 393 without it
