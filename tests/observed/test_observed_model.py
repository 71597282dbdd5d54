"""LTE models of observed spectra: limits in closed form, derivatives, and agreement with `rotor.spectra.emission.emission`."""

import math

import numpy as np
import pytest
from observed_cases import rigid

from rotor import units
from rotor.observed.model.model import KM_PER_S, PARAMETERS, Component, Dust, Sight, escape, model, planck_slope
from rotor.observed.model.partition import PartitionTable, top_partition
from rotor.observed.model.species import (
    species_from_lines,
    strength_from_einstein,
    strength_from_lgint,
)
from rotor.spectra.emission.emission import Source, emission, planck_k
from rotor.spectra.lines import line_list
from rotor.tops.top import Top

REST = 115271.202
CO = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11011, 0, 0), name="CO")


def at_centre(component: Component, sight: Sight | None = None, frequency: float = 20e3) -> float:
    seen = np.array([frequency * (1 - component.velocity_km_s / KM_PER_S)])
    return float(model([component], seen, sight).brightness_k[0])


def test_strength_from_einstein_and_from_lgint_agree() -> None:
    lines = line_list(CO, temperature_k=300.0, jmax=20)
    table = top_partition(CO)
    species = species_from_lines(lines, partition=PartitionTable([300.0], [lines.q]))
    from_a = strength_from_einstein(lines.einstein_a_per_s, lines.frequency_mhz, lines.g_upper)
    lower_k = lines.energy_lower_cm * units.MHZ_PER_CM / units.MHZ_PER_K
    from_lgint = strength_from_lgint(lines.lgint, lines.frequency_mhz, lower_k, lines.q)
    assert np.allclose(from_a, species.strength_nm2_mhz, rtol=1e-12)  # the same formula in two forms
    assert np.allclose(from_lgint, species.strength_nm2_mhz, rtol=1e-12)
    assert np.allclose(species.intensity_nm2_mhz(300.0), lines.intensity_nm2_mhz, rtol=1e-12)
    assert table.at(300.0) == pytest.approx(lines.q, rel=1e-9)  # a point of the table


def test_thin_limit_is_column_times_upper_population() -> None:
    """τ « 1: ∫T_B dν = (J(T) - J(bg)) N I, here from N_u A in closed form: ∫τ dν = c² A N_u (e^x - 1)/(8π ν²)."""
    species, t, column = rigid(), 20.0, 1e8
    grid = np.linspace(19999.0, 20001.0, 20001)
    seen = model([Component(species, column, t, 0.0, 5.0)], grid)
    upper_fraction = 3 * math.exp(-2 * 10e3 / units.MHZ_PER_K / t) / species.partition.at(t)
    a = 1.1639654e-20 * 20e3**3 / 3
    c_cm = units.SPEED_OF_LIGHT_M_PER_S * 100
    hz = c_cm**2 * a * column * upper_fraction * math.expm1(20e3 / units.MHZ_PER_K / t) / (8 * math.pi * 20e9**2)
    depth = float(np.sum(seen.optical_depth)) * (2.0 / 20000) * 1e6
    assert depth == pytest.approx(hz, rel=1e-8)
    contrast = planck_k(grid, t) - planck_k(grid, 2.725)
    assert np.allclose(seen.brightness_k, contrast * seen.optical_depth, rtol=1e-8, atol=0)  # τ < 1e-8


def test_thick_limit_is_the_planck_contrast() -> None:
    for t in (5.0, 20.0, 300.0):
        exact = float(planck_k(20e3, t) - planck_k(20e3, 2.725))
        assert at_centre(Component(rigid(), 1e22, t)) == pytest.approx(exact, rel=1e-12)  # e^-τ is 0


def test_rayleigh_jeans_limit() -> None:
    """hν « kT: J(T) = T - hν/2k + (hν/k)²/12T; at 20 GHz and 300 K the next term is below 1e-10."""
    x = 20e3 / units.MHZ_PER_K
    thick = at_centre(Component(rigid(), 1e22, 300.0), Sight(background_k=100.0))
    series = 200.0 + x * x / 12 * (1 / 300.0 - 1 / 100.0)
    assert thick == pytest.approx(series, abs=1e-8)  # (hν/k)⁴/720 T³ is 1e-9


def test_background_at_the_excitation_temperature_hides_the_lines() -> None:
    assert at_centre(Component(rigid(), 1e15, 20.0), Sight(background_k=20.0)) == 0.0
    assert at_centre(Component(rigid(), 1e15, 20.0), Sight(background_k=50.0)) < 0


def test_one_line_between_thin_and_thick() -> None:
    """τ at the centre in closed form: N I √(4 ln 2/π)/Δν."""
    species, t, column, width = rigid(), 30.0, 3e15, 2.0
    intensity = float(species.intensity_nm2_mhz(t)[0]) * 1e-14
    depth = column * intensity * math.sqrt(4 * math.log(2) / math.pi) / (20e3 * width / KM_PER_S)
    exact = float(planck_k(20e3, t) - planck_k(20e3, 2.725)) * -math.expm1(-depth)
    assert 0.05 < depth < 5
    assert at_centre(Component(species, column, t, 0.0, width)) == pytest.approx(exact, rel=1e-12)


def test_the_same_as_the_emission_of_a_line_list() -> None:
    lines = line_list(CO, temperature_k=20.0, jmax=30)
    species = species_from_lines(lines, partition=PartitionTable([20.0], [lines.q]))
    grid = np.linspace(REST - 5, REST + 5, 4001)
    source = Source(1e17, 20.0, 1.2, velocity_km_s=3.0, filling=1.0)
    mine = model([Component(species, 1e17, 20.0, 3.0, 1.2)], grid)
    assert np.allclose(
        mine.brightness_k, emission(lines, source, grid).brightness_k, atol=1e-9
    )  # beyond 3 widths 1e-11 of the peak


def test_redshift_and_velocity_are_those_of_the_emission_verb() -> None:
    lines = line_list(CO, temperature_k=20.0, jmax=10)
    species = species_from_lines(lines, partition=PartitionTable([20.0], [lines.q]))
    source = Source(1e17, 20.0, 40.0, velocity_km_s=9000.0, redshift=1.5)
    grid = REST * source.frequency_ratio * (1 + np.linspace(-2e-4, 2e-4, 101))
    mine = model([Component(species, 1e17, 20.0, 9000.0, 40.0)], grid, Sight(redshift=1.5))
    assert np.allclose(mine.brightness_k, emission(lines, source, grid).brightness_k, rtol=1e-8)  # round-off of offsets


def test_beam_dilution_and_redshift() -> None:
    full = at_centre(Component(rigid(), 1e22, 50.0))
    sized = Component(rigid(), 1e22, 50.0, size_arcsec=1.0)
    assert at_centre(sized, Sight(beam_arcsec=2.0)) == pytest.approx(full / 5, rel=1e-12)
    grid = np.array([20e3 / 3.0])
    behind = Sight(redshift=2.0)
    at_source = float(
        planck_k(20e3, 50.0) - planck_k(20e3, 3 * 2.725)
    )  # the background of 2.725 K today was 1 + z hotter
    assert model([Component(rigid(), 1e22, 50.0)], grid, behind).brightness_k[0] == pytest.approx(
        at_source / 3, rel=1e-12
    )
    with pytest.raises(ValueError, match="without a beam"):
        at_centre(sized)


def test_mixed_layer_of_equal_temperatures_adds_optical_depths() -> None:
    one = Component(rigid(), 2e15, 30.0)
    both = [Component(rigid(), 0.5e15, 30.0), Component(rigid(), 1.5e15, 30.0)]
    grid = np.linspace(19999.5, 20000.5, 101)
    assert np.allclose(model([one], grid).brightness_k, model(both, grid).brightness_k, rtol=1e-12)
    apart = model([both[0], Component(rigid(), 1.5e15, 30.0, layer=1)], grid).brightness_k
    assert apart.max() > model([one], grid).brightness_k.max()  # side by side they do not hide one another


def test_dust_of_the_same_temperature_hides_lines() -> None:
    """Lines and dust at one temperature: T = (J - J_bg) e^-τd (1 - e^-τ)."""
    t, dust = 40.0, Dust(depth=1.5, temperature_k=40.0, reference_mhz=20e3)
    one = Component(rigid(), 3e15, t)
    bare = at_centre(one)
    assert at_centre(one, Sight(dust=dust)) == pytest.approx(bare * math.exp(-1.5), rel=1e-12)


def test_channel_average_has_the_area_of_the_line() -> None:
    one = Component(rigid(), 1e12, 30.0, 0.0, 1.0)
    fine = np.arange(19999.0, 20001.0, 0.001)
    coarse = np.arange(19999.0, 20001.0, 0.05)  # width of the line 0.067 MHz
    exact = model([one], fine).brightness_k.sum() * 0.001
    mean = model([one], coarse, Sight(channel_mhz=0.05)).brightness_k
    assert mean.sum() * 0.05 == pytest.approx(exact, rel=1e-5)  # four Gauss points in 0.75 of a width
    assert mean.max() < 0.95 * model([one], fine).brightness_k.max()


@pytest.mark.parametrize("dust", [None, Dust(0.4, 60.0, 20e3)])
def test_derivatives_against_differences(dust: Dust | None) -> None:
    grid = np.linspace(39990.0, 40010.0, 400)
    sight = Sight(background_k=5.0, beam_arcsec=1.0, dust=dust)
    start = [
        {"column_per_cm2": 2e15, "excitation_k": 25.0, "velocity_km_s": 1.0, "fwhm_km_s": 8.0, "size_arcsec": 0.7}
    ] * 2
    start[1] = start[1] | {"column_per_cm2": 5e15, "excitation_k": 60.0, "velocity_km_s": -4.0}

    def brightness(values: list[dict[str, float]]) -> np.ndarray:
        return model([Component(rigid(), **one) for one in values], grid, sight).brightness_k

    slopes = model([Component(rigid(), **one) for one in start], grid, sight, slopes=True).slopes
    assert slopes is not None
    for k in range(2):
        for number, name in enumerate(PARAMETERS[:4]):
            h = 1e-5 * max(abs(start[k][name]), 1.0)
            up, down = [list(start), list(start)]
            up[k], down[k] = start[k] | {name: start[k][name] + h}, start[k] | {name: start[k][name] - h}
            difference = (brightness(up) - brightness(down)) / (2 * h)
            assert (
                np.abs(slopes[k, number] - difference).max() < 1e-5 * np.abs(difference).max()
            )  # h² of the differences
    moved = [[one | {"size_arcsec": 0.7 + h} for one in start] for h in (1e-5, -1e-5)]
    difference = (brightness(moved[0]) - brightness(moved[1])) / 2e-5
    assert np.abs(slopes[0, 4] - difference).max() < 1e-6 * np.abs(difference).max()


def test_escape_is_smooth_where_its_series_ends() -> None:
    h = 1e-6
    for depth in (1e-3, -1e-3, 0.0, 5.0):
        around = np.array([depth - h, depth, depth + h])
        value, slope = escape(around)
        assert (value[2] - value[0]) / (2 * h) == pytest.approx(slope[1], abs=1e-9)  # round-off over h
    assert escape(np.array([1e5]))[0][0] == pytest.approx(1e-5)


def test_planck_slope() -> None:
    nu = np.array([20e3, 400e3])
    assert np.allclose(planck_slope(nu, 10.0), (planck_k(nu, 10.001) - planck_k(nu, 9.999)) / 0.002, rtol=1e-7)


def test_partition_table_between_and_beyond() -> None:
    t = np.array([10.0, 100.0, 300.0])
    table = PartitionTable(t, 2.0 * t**1.5)
    assert table.at(55.0) == pytest.approx(2.0 * 55.0**1.5, rel=1e-12)  # a power law is a straight line
    assert table.at(500.0) == pytest.approx(2.0 * 500.0**1.5, rel=1e-12)
    assert table.slope(500.0) == pytest.approx(1.5)
    with pytest.raises(ValueError, match="known from 5 to 600 K"):
        table.at(700.0)
    with pytest.raises(ValueError, match="rising"):
        PartitionTable(t[::-1], t)


def test_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="column_per_cm2"):
        Component(rigid(), -1.0, 10.0)
    with pytest.raises(ValueError, match="single size"):
        model(
            [Component(rigid(), 1e15, 10.0, size_arcsec=s) for s in (1.0, 2.0)],
            np.array([20e3]),
            Sight(beam_arcsec=1.0),
        )
