"""A box from a lattice becomes a liquid before averages are taken; reorientation and diffusion of the run with their errors."""

import math
import re

import numpy as np
import pytest

from rotor.fluids.equilibration import is_stationary
from rotor.fluids.forces.models import find_model
from rotor.fluids.liquid_motion import MotionFrames, correlation_time, motion_means, reference_axis, reorientation
from rotor.fluids.request import FluidRequest, NewBox, answer_fluid
from rotor.fluids.settings import Settings
from rotor.fluids.summary import series_ratio


def correlated(rng, n, columns, memory=0.8):
    """First-order autoregressive noise of unit variance (n, columns)."""
    x = np.empty((n, columns))
    x[0] = rng.standard_normal(columns)
    for k in range(1, n):
        x[k] = memory * x[k - 1] + math.sqrt(1 - memory**2) * rng.standard_normal(columns)
    return x


def test_stationary_rows_are_told_from_drifting_and_from_cold_ones():
    rng, scale, centre = np.random.default_rng(5), np.array([1.0, 12.0, 12.0]), np.array([-100.0, 300.0, 300.0])
    settled = [centre + scale * correlated(rng, 500, 3) for _ in range(60)]
    assert (
        np.mean([is_stationary(rows, 300.0) for rows in settled]) > 0.8
    )  # five comparisons at 2.5 standard errors: 94 % of good ones
    assert not any(is_stationary(rows + np.linspace(12, 0, 500)[:, None] * [1, 0, 0], 300.0) for rows in settled)
    assert not any(
        is_stationary(rows + np.array([0, 0, -15.0]), 300.0) for rows in settled
    )  # rotation colder than the thermostat
    assert not is_stationary(settled[0][:40], 300.0)  # too few independent rows
    atoms = [np.column_stack([rows[:, :2], np.full(500, np.nan)]) for rows in settled]
    assert np.mean([is_stationary(rows, 300.0) for rows in atoms]) > 0.85


@pytest.mark.slow(seconds=10)
def test_water_from_a_lattice_has_its_temperature_and_equipartition():
    settings = Settings(steps=4000, cutoff_angstrom=6.0, seed=4)
    cold = answer_fluid(FluidRequest(NewBox(64, equilibration_ps=0.0), settings), progress=lambda *_: None)
    warm = answer_fluid(FluidRequest(NewBox(64), settings), progress=lambda *_: None)
    means = {mean.quantity: mean for mean in _means(warm)}
    assert cold.equilibration is None
    assert _means(cold)[1].mean < 270  # as it was: of 298 K
    assert warm.equilibration is not None
    assert warm.equilibration.stationary
    assert warm.equilibration.time_ps >= 10
    assert f"equilibrated for {warm.equilibration.time_ps:.4g} ps" in warm.start
    assert abs(means["temperature"].mean - 298.15) < 10  # σ of the energy of 64 molecules in some ten samples: 4 K
    ratio = means["rotation over translation"]
    assert abs(ratio.mean - 1) < 3 * ratio.error
    assert warm.record.time_ps[0] == 0.0
    assert warm.averaged_share == 1.0
    assert "8 ps are too short" in warm.facts()["motion_reason"]


def _means(answer):
    from rotor.fluids.summary import means

    return means(answer.record, 64, answer.averaged_share)


def test_the_error_of_a_ratio_counts_both_series():
    rng = np.random.default_rng(2)
    spread = [
        series_ratio("r", 300 + 20 * rng.standard_normal(400), 300 + 20 * rng.standard_normal(400)) for _ in range(200)
    ]
    scatter = np.std([estimate.mean for estimate in spread])
    assert np.mean([estimate.error for estimate in spread]) == pytest.approx(scatter, rel=0.15)  # 5 % from 200 draws
    assert scatter == pytest.approx(20 * math.sqrt(2 / 400) / 300, rel=0.15)


def test_rotational_diffusion_has_its_times():
    """Small random turns at a rate D: C_l = exp(-l (l+1) D t), so τ1 = 1/2D and τ2 = 1/6D (P. Debye's model)."""
    rng, rate, step, frames = np.random.default_rng(8), 0.25, 0.02, 4000
    u = rng.standard_normal((300, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    path = np.empty((frames, 300, 3))
    for k in range(frames):
        path[k] = u
        u = u + math.sqrt(2 * rate * step) * np.cross(rng.standard_normal((300, 3)), u)
        u /= np.linalg.norm(u, axis=1, keepdims=True)
    assert correlation_time(path, step, 1) == pytest.approx(1 / (2 * rate), rel=0.06)  # 300 vectors for 40 times τ
    assert correlation_time(path, step, 2) == pytest.approx(1 / (6 * rate), rel=0.06)
    slow = sum((path[0] * path[k]).sum(axis=1).mean() for k in (0,))
    assert slow == pytest.approx(1.0, abs=1e-12)


def test_reorientation_of_steady_rotors_is_a_cosine():
    t = np.arange(200) * 0.1
    u = np.stack([np.cos(t), np.sin(t), np.zeros_like(t)], axis=-1)[:, None, :]
    assert reorientation(u, 1) == pytest.approx(np.cos(t), abs=1e-12)
    assert reorientation(u, 2) == pytest.approx(1.5 * np.cos(t) ** 2 - 0.5, abs=1e-12)


@pytest.mark.parametrize(("name", "along"), [("spce", (0, 0, 1)), ("tip4p-2005", (0, 0, 1)), ("trappe-n2", None)])
def test_axes_of_models(name, along):
    model = find_model(name)
    sites = model.positions_angstrom[: len(model.symbols)]
    turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    bond = sites[1] - sites[0]
    expected = np.array(along, dtype=float) if along else bond / np.linalg.norm(bond)
    axis = reference_axis(model, (sites - sites.mean(axis=0)) @ turn.T)
    assert abs(axis @ (turn @ expected)) == pytest.approx(1.0, abs=1e-9)
    assert reference_axis(find_model("argon"), np.zeros((1, 3))) is None


def test_motion_of_a_run_from_its_frames():
    """Turns and steps drawn at known rates: the errors of five blocks cover the truth."""
    rng, frames, n, step = np.random.default_rng(3), MotionFrames(), 100, 0.05
    from rotor.geometry import rotations

    centres, attitude = np.zeros((n, 3)), rotations.uniform(n, rng=rng)
    for _ in range(2000):
        frames.add(centres, attitude)
        centres = centres + math.sqrt(2 * 0.23 * step) * rng.standard_normal((n, 3))  # D = 0.23 Å²/ps
        attitude = rotations.multiply(attitude, rotations.exp(math.sqrt(2 * 0.2 * step) * rng.standard_normal((n, 3))))
    table, reason = motion_means(frames, step, np.tile([0.0, 0.0, 1.0], (n, 1)))
    assert reason == ""
    for mean, truth in zip(table, (1 / 0.4, 1 / 1.2, 2.3), strict=True):  # ps, ps, 1e-5 cm²/s
        assert mean.error < 0.1 * truth
        assert abs(mean.mean - truth) < 4 * mean.error + 0.03 * truth  # τ within its window, steps of 0.14 rad
    assert motion_means(frames, 1e-3, None)[1].startswith(
        "rotational correlation times and diffusion: 2 ps are too short"
    )


def test_a_run_too_short_for_a_correlation_time_names_the_length_that_has_it():
    """τ1 = 8 ps: C_1 of the slowest of five blocks falls to 1/e in about 8 ps, so the length named is five blocks of about twice that."""
    short, reason = _turned_for(30.0)
    assert [mean.quantity for mean in short] == ["τ2 of reorientation", "self-diffusion, in this box"]
    words = re.fullmatch(
        r"rotational correlation time τ1: in 5 blocks C_1 has not decayed to 1/e within 2.95 ps, half of a block: run (\d+) ps or more",
        reason,
    )
    assert words, reason
    length = float(words[1])
    assert length == pytest.approx(80.0, rel=0.3)
    longer, reason = _turned_for(length)
    assert (longer[0].quantity, reason) == ("τ1 of reorientation", "")


def _turned_for(length_ps: float, step: float = 0.05, tau1: float = 8.0):
    """τ1, τ2 and D of 200 bodies that turn at random."""
    from rotor.geometry import rotations

    rng, frames, n = np.random.default_rng(5), MotionFrames(), 200
    attitude = rotations.uniform(n, rng=rng)
    for _ in range(round(length_ps / step) + 1):
        frames.add(rng.standard_normal((n, 3)), attitude)
        attitude = rotations.multiply(attitude, rotations.exp(math.sqrt(step / tau1) * rng.standard_normal((n, 3))))
    return motion_means(frames, step, np.tile([0.0, 0.0, 1.0], (n, 1)))
