"""LTE fits of injected spectra: what was put in comes out, what was not is reported as not needed."""

from dataclasses import replace

import numpy as np
import pytest
from observed_cases import artificial, injected, rigid

from rotor.observed.fit import FitChoices, column_limit, contributions, fit_source
from rotor.observed.model.model import Component, Sight, model
from rotor.observed.model.partition import PartitionTable
from rotor.observed.spectrum import observed_spectrum
from rotor.observed.start import start_components, velocity_and_width

GRID = np.concatenate([np.arange(f - 20, f + 20, 0.05) for f in (20e3, 40e3, 60e3, 80e3, 100e3)])


def test_a_fit_without_a_start_finds_what_was_injected() -> None:
    true = Component(rigid(), 3e14, 35.0, 7.3, 3.1)
    spectrum = injected([true], GRID, 0.02, np.random.default_rng(1))
    fit = fit_source(spectrum, start_components(spectrum, [true.species]))
    assert fit.minimum.converged
    assert fit.reduced_chi_squared == pytest.approx(1.0, abs=0.08)  # 4000 channels: √(2/4000) is 0.022
    for row in fit.parameters:
        exact = getattr(true, row["parameter"])
        assert abs(row["value"] - exact) < 4 * row["error"], row  # four standard errors: 6e-5 each


@pytest.mark.parametrize("noise", [0.05, 20.0])
def test_a_species_that_shows_nothing_starts_at_a_third_of_the_noise(noise: float) -> None:
    """Whatever the noise is in K: its strongest line would be seen by no one, and the fit can still raise it."""
    spectrum = observed_spectrum(GRID, np.full(len(GRID), -0.2 * noise), noise=noise)
    (start,) = start_components(spectrum, [rigid()], velocity_km_s=0.0, fwhm_km_s=3.0, excitation_k=200.0)
    thin = model([replace(start, column_per_cm2=start.column_per_cm2 * 1e-3)], GRID).brightness_k
    assert 1e3 * np.abs(thin).max() == pytest.approx(noise / 3, rel=0.02)  # of a thin line


def test_errors_are_those_of_repeated_injections() -> None:
    """Standard deviations over 100 spectra against the stated errors: 7 % of statistics."""
    true = Component(rigid(), 3e14, 35.0, 0.0, 3.0)
    rng = np.random.default_rng(2)
    fits = [fit_source(injected([true], GRID, 0.1, rng), [true]) for _ in range(100)]
    values = np.array([fit.values for fit in fits])
    stated = np.array([fit.statistics.errors for fit in fits]).mean(axis=0)
    assert np.allclose(values.std(axis=0), stated, rtol=0.25)  # 3.5 standard deviations of a standard deviation
    assert (np.abs(values.mean(axis=0) - fits[0].variables.values([true])) < 4 * stated / 10).all()


def test_blends_are_fitted_together_and_a_wrong_species_is_not_needed() -> None:
    rng = np.random.default_rng(3)
    species = [artificial(f"species {i}", rng, 100e3, 100.3e3) for i in range(3)]
    grid = np.arange(100e3, 100.3e3, 0.1)
    true = [
        Component(one, 10.0**c, t, 2.0, 2.0) for one, c, t in zip(species[:2], (14.6, 14.8), (40.0, 120.0), strict=True)
    ]
    spectrum = injected(true, grid, 0.02, rng)
    fit = fit_source(
        spectrum,
        start_components(spectrum, species, velocity_km_s=2.0, fwhm_km_s=2.0),
        choices=FitChoices(shared=("velocity_km_s", "fwhm_km_s")),
    )
    needed = {one.species: one for one in contributions(fit)}
    assert [needed[one.name].needed for one in species] == [True, True, False]
    assert needed["species 2"].limit_per_cm2 is not None
    at_limit = replace(
        fit.components[2], column_per_cm2=needed["species 2"].limit_per_cm2, excitation_k=fit.start[2].excitation_k
    )
    alone = model([at_limit], grid).brightness_k / 0.02
    assert (
        2.5 < np.linalg.norm(alone) < 6.0
    )  # 3 standard deviations in all, and up to 3 more where noise looks like the species
    for row in fit.parameters[:2]:
        exact = true[row["components"][0]].column_per_cm2
        low, high = row["interval"]
        assert abs(np.log(row["value"] / exact)) < 3 * np.log(high / row["value"])
        assert high < 2 * low


def test_upper_limit_of_noise_is_three_standard_deviations() -> None:
    """A thin line: N limit/3 is the standard error of N, the noise over the length of the template."""
    component = Component(rigid(), 1e10, 30.0, 0.0, 3.0)
    silent = observed_spectrum(GRID, np.zeros(len(GRID)), noise=0.02)
    template = model([component], GRID).brightness_k / 1e10
    exact = 3 * 0.02 / np.linalg.norm(template)
    assert column_limit(silent, silent.noise, component) == pytest.approx(exact, rel=1e-2)  # τ of 0.01


def test_source_size_is_fitted_where_lines_are_thick() -> None:
    true = Component(rigid(), 3e15, 35.0, 0.0, 3.0, size_arcsec=0.6)
    sight = Sight(beam_arcsec=1.0)
    spectrum = injected([true], GRID, 0.02, np.random.default_rng(4), sight)
    start = Component(rigid(), 1e15, 50.0, 0.0, 3.0, size_arcsec=1.0)
    free = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s", "size_arcsec")
    fit = fit_source(spectrum, [start], sight, FitChoices(free=free))
    assert fit.components[0].size_arcsec == pytest.approx(0.6, rel=0.03)
    assert fit.components[0].excitation_k == pytest.approx(35.0, rel=0.05)


def test_undetermined_temperature_is_said() -> None:
    """One thin line determines N and T only together."""
    true = Component(rigid(lines=1), 1e12, 35.0, 0.0, 3.0)
    grid = np.arange(19990.0, 20010.0, 0.05)
    spectrum = injected([true], grid, 1e-4, np.random.default_rng(7))
    fit = fit_source(spectrum, [true])
    rows = {row["parameter"]: row for row in fit.parameters}
    assert rows["velocity_km_s"]["determined"]
    assert not rows["excitation_k"]["determined"] or rows["excitation_k"]["error"] > 0.5 * rows["excitation_k"]["value"]


def test_velocity_and_width_by_correlation() -> None:
    true = Component(rigid(), 3e14, 35.0, -42.0, 4.0)
    spectrum = injected([true], GRID, 0.05, np.random.default_rng(8))
    velocity, width = velocity_and_width(spectrum, [true.species])
    assert velocity == pytest.approx(-42.0, abs=2.0)
    assert 2.0 <= width <= 8.0


def test_mistakes_are_named() -> None:
    spectrum = injected([Component(rigid(), 3e14, 35.0)], GRID, 0.05, np.random.default_rng(9))
    far = artificial("far", np.random.default_rng(1), 5e5, 6e5)
    with pytest.raises(ValueError, match="far: no lines from"):
        fit_source(spectrum, [Component(far, 1e14, 30.0)])
    with pytest.raises(ValueError, match="needs brightness in K"):
        fit_source(
            observed_spectrum([1.0, 2.0], [1.0, 2.0], noise=1.0, unit="Jy/beam"), [Component(rigid(), 1e14, 30.0)]
        )
    with pytest.raises(ValueError, match="known are column_per_cm2"):
        fit_source(spectrum, [Component(rigid(), 1e14, 30.0)], choices=FitChoices(free=("colour",)))


def test_a_temperature_at_the_end_of_its_partition_function_holds_up_no_other() -> None:
    """The table of one of two species ends below its temperature: that one stays at the end, the other comes out as injected."""
    cut = replace(
        rigid(), partition=PartitionTable([2.0, 5.0, 10.0], [rigid().partition.at(t) for t in (2.0, 5.0, 10.0)])
    )
    end = cut.partition.range_k[1]
    other = artificial("other", np.random.default_rng(5), 20e3 - 15, 20e3 + 15)
    true = [Component(rigid(), 3e14, 90.0, 0.0, 3.0), Component(other, 1e14, 60.0, 0.0, 3.0)]
    spectrum = injected(true, GRID, 0.02, np.random.default_rng(4))
    start = [Component(cut, 1e14, end, 0.4, 2.5), Component(other, 5e13, 40.0, 0.4, 2.5)]
    fit = fit_source(spectrum, start)
    assert fit.minimum.converged
    held = fit.parameters_of(0)["excitation_k"]
    assert held["value"] == pytest.approx(end, rel=1e-9)
    assert not held["determined"]
    assert fit.components[0].velocity_km_s == pytest.approx(0.0, abs=0.1)
    assert fit.components[0].column_per_cm2 > 1.1e14  # the start was far below


def test_a_temperature_comes_back_from_the_end_of_its_partition_function() -> None:
    """Started at the end, or outside of it as far as a first step goes: the fit of the middle of the table."""
    species = rigid()
    end = species.partition.range_k[1]
    spectrum = injected([Component(species, 3e14, 300.0, 0.0, 3.0)], GRID, 0.002, np.random.default_rng(6))
    fit = fit_source(spectrum, [Component(species, 2e15, end, 0.1, 3.0)])
    assert fit.minimum.converged
    row = fit.parameters_of(0)["excitation_k"]
    assert abs(row["value"] - 300.0) < 4 * row["error"]
