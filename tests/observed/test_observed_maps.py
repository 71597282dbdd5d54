"""Rotational diagrams, cubes and samples of injected sources."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from observed_cases import artificial, injected, rigid

from rotor.observed.cube import fit_cube
from rotor.observed.diagram import rotational_diagram
from rotor.observed.fit import FitChoices, fit_source
from rotor.observed.model.model import Component, Sight, model
from rotor.observed.spectrum import observed_spectrum

GRID = np.concatenate([np.arange(f - 10, f + 10, 0.05) for f in (20e3, 40e3, 60e3, 80e3, 100e3)])


@pytest.mark.parametrize("column", [1e13, 3e15])
def test_diagram_without_noise_gives_back_the_source(column: float) -> None:
    """Thin lines, and lines of τ up to 3, which give a wrong temperature without the correction."""
    true = Component(rigid(), column, 35.0, 0.0, 3.0)
    spectrum = observed_spectrum(GRID, model([true], GRID).brightness_k, noise=1e-5)
    diagram = rotational_diagram(spectrum, [true])
    assert diagram.excitation_k == pytest.approx(
        35.0, rel=5e-3
    )  # lines are integrated over ±1.5 widths: 4e-4 of the area
    assert diagram.column_per_cm2 == pytest.approx(column, rel=5e-3)
    plain = rotational_diagram(spectrum, [true], corrected=False)
    off = abs(plain.excitation_k / 35.0 - 1)
    assert off < 0.05 if column < 1e14 else off > 0.1


def test_errors_of_a_diagram_cover() -> None:
    true = Component(rigid(), 3e14, 35.0, 0.0, 3.0)
    rng = np.random.default_rng(5)
    pulls = []
    for _ in range(60):
        diagram = rotational_diagram(injected([true], GRID, 0.02, rng), [true])
        pulls.append((diagram.excitation_k - 35.0) / diagram.excitation_error_k)
    assert np.std(pulls) == pytest.approx(1.0, abs=0.3)  # 60 draws: 0.09
    assert abs(np.mean(pulls)) < 0.5


def test_blends_are_left_out_and_too_few_lines_are_refused() -> None:
    rng = np.random.default_rng(6)
    two = [artificial(f"s{i}", rng, 100e3, 100.3e3, 8) for i in range(2)]
    grid = np.arange(100e3, 100.3e3, 0.05)
    parts = [Component(one, 1e16, 60.0, 0.0, 4.0) for one in two]
    spectrum = injected(parts, grid, 0.01, rng)
    assert len(rotational_diagram(spectrum, parts)) < 8
    with pytest.raises(ValueError, match="needs two"):
        rotational_diagram(spectrum.where(slice(0, 200)), parts)


def test_cube_of_a_gradient(capsys: pytest.CaptureFixture[str]) -> None:
    """Column density and velocity vary over 4 by 5 pixels, one pixel is empty and one has channels without a number."""
    grid = np.concatenate([np.arange(f - 8, f + 8, 0.1) for f in (20e3, 40e3, 60e3)])
    species = rigid()
    y, x = np.mgrid[0:4, 0:5]
    column, velocity = 1e14 * (1 + 0.3 * x), 0.5 * y - 1.0
    rng = np.random.default_rng(7)
    cube = np.stack(
        [
            [model([Component(species, column[i, j], 30.0, velocity[i, j], 4.0)], grid).brightness_k for j in range(5)]
            for i in range(4)
        ]
    )
    cube = np.moveaxis(cube, -1, 0) + rng.normal(0, 0.01, (len(grid), 4, 5))
    cube[:, 0, 0] = rng.normal(0, 0.01, len(grid))
    cube[5:9, 2, 2] = np.nan
    start = [Component(species, 2e14, 40.0, 0.0, 3.0)]
    found = fit_cube(grid, cube, 0.01, start)
    assert found.fitted.sum() == 19
    assert np.isnan(found.values[:, 0, 0]).all()
    inside = found.fitted
    assert np.abs((found.values[0] - column) / found.errors[0])[inside].max() < 4.5
    assert np.abs((found.values[2] - velocity) / found.errors[2])[inside].max() < 4.5
    with ThreadPoolExecutor(2) as pool:
        assert np.array_equal(fit_cube(grid, cube, 0.01, start, executor=pool).values, found.values, equal_nan=True)
    with pytest.raises(ValueError, match="frequencies for a cube"):
        fit_cube(grid[1:], cube, 0.01, start)


def test_sample_has_the_errors_of_the_fit() -> None:
    pytest.importorskip("emcee")
    from rotor.observed.sampling import sample_source

    true = Component(rigid(), 3e14, 35.0, 0.0, 3.0)
    spectrum = injected([true], GRID[::4], 0.05, np.random.default_rng(8))
    fit = fit_source(spectrum, [true], choices=FitChoices(priors=False))
    sample = sample_source(fit, 400)
    spread = sample.draws.std(axis=0)
    stated = np.array([row["error"] for row in fit.parameters])
    assert np.allclose(
        spread, stated, rtol=0.25
    )  # some hundred independent draws: 5 %, and the posterior is no Gaussian
    assert 0.2 < sample.accepted < 0.9
    assert sample.facts()["draws"] == len(sample)


def test_size_of_a_source_enters_the_diagram() -> None:
    true = Component(rigid(), 1e13, 35.0, 0.0, 3.0, size_arcsec=1.0)
    sight = Sight(beam_arcsec=2.0)
    spectrum = observed_spectrum(GRID, model([true], GRID, sight).brightness_k, noise=1e-6)
    assert rotational_diagram(spectrum, [true], sight=sight).column_per_cm2 == pytest.approx(1e13, rel=5e-3)
