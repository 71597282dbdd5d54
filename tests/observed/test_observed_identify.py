"""Identification: species that are there are named, those that are not are left out, lines of unknown species are listed."""

from dataclasses import replace

import numpy as np
import pytest
from observed_cases import artificial, injected

from rotor.observed.identification.identify import chance_matches, identify
from rotor.observed.identification.selection import IdentifyChoices
from rotor.observed.model.model import Component
from rotor.observed.spectrum import observed_spectrum
from rotor.observed.start import velocity_and_width

GRID = np.arange(230e3, 230.6e3, 0.25)


@pytest.fixture(scope="module")
def case() -> tuple:
    """Twenty candidates, three of them in a spectrum at -7 km/s, and one species that is no candidate."""
    rng = np.random.default_rng(11)
    candidates = [artificial(f"s{i}", rng, 230e3, 230.6e3, int(rng.integers(4, 20))) for i in range(20)]
    taken = np.sort(np.concatenate([one.frequency_mhz for one in candidates]))
    gap = int(np.argmax(np.diff(taken)))  # a line that none of the candidates has
    stranger = artificial("stranger", rng, taken[gap : gap + 2].mean() - 0.1, taken[gap : gap + 2].mean() + 0.1, 1)
    parts = [
        (candidates[2], 3e16, 60.0),
        (candidates[7], 4e15, 30.0),
        (candidates[11], 2e16, 150.0),
        (stranger, 3e16, 60.0),
    ]
    true = [Component(one, column, t, -7.0, 3.0) for one, column, t in parts]
    return injected(true, GRID, 0.05, rng), candidates, stranger


def test_species_and_unidentified_lines(case: tuple) -> None:
    spectrum, candidates, stranger = case
    found = identify(spectrum, candidates)
    assert set(found.names) == {"s2", "s7", "s11"}
    assert found.velocity_km_s == pytest.approx(-7.0, abs=0.5)
    strangest = stranger.frequency_mhz[0] * (1 + 7.0 / 299792.458)
    assert [one.frequency_mhz for one in found.unidentified] == pytest.approx([strangest], abs=0.5)
    signals = [one.signal for one in found.species]
    assert signals == sorted(signals, reverse=True)
    assert all(one.visible >= 0.6 * one.expected for one in found.species)
    facts = found.facts()
    assert facts["candidates"] == 20
    assert len(facts["species"]) == 3


def test_species_with_many_lines_are_no_chance(case: tuple) -> None:
    found = identify(*case[:2])
    assert all(evidence.chance < 1e-3 and not evidence.uncertain for evidence in found.species if evidence.visible > 5)
    assert any(evidence.visible > 5 for evidence in found.species)


def test_chance_matches_are_those_of_random_positions() -> None:
    """2000 candidates with 4 lines at random channels, 15 % of which have a signal: as many with 2 or more as the formula says."""
    rng = np.random.default_rng(5)
    hits = (rng.random((2000, 4)) < 0.15).sum(axis=1)
    expected = chance_matches(2, 4, 0.15, 2000)
    assert abs((hits >= 2).sum() - expected) < 4 * np.sqrt(expected)


def test_chance_matches_of_thousands_of_lines_are_finite() -> None:
    """The binomial coefficients of more than 1029 lines are beyond doubles: half of all lines are seen by chance in half of the cases."""
    assert chance_matches(2001, 4001, 0.5, 20) == pytest.approx(10.0)  # by symmetry
    assert chance_matches(0, 4001, 0.5, 20) == 20.0


def test_noise_alone_needs_nothing(case: tuple) -> None:
    _, candidates, _ = case
    silent = observed_spectrum(GRID, np.random.default_rng(3).normal(0, 0.05, len(GRID)), noise=0.05)
    found = identify(silent, candidates, choices=IdentifyChoices(velocity_km_s=0.0, fwhm_km_s=3.0))
    assert found.names == []
    assert found.unidentified == ()


def test_velocity_of_many_species(case: tuple) -> None:
    spectrum, candidates, _ = case
    velocity, width = velocity_and_width(spectrum, candidates)
    assert velocity == pytest.approx(-7.0, abs=0.5)
    assert width in (2.0, 4.0)


def test_candidates_outside_the_range_are_refused(case: tuple) -> None:
    spectrum, _, _ = case
    far = artificial("far", np.random.default_rng(1), 5e5, 6e5)
    with pytest.raises(ValueError, match="none of 1 candidates"):
        identify(spectrum, [far])
    with pytest.raises(ValueError, match="for a file in GHz give --axis-unit GHz"):
        identify(replace(spectrum, frequency_mhz=spectrum.frequency_mhz / 1e3), [far])


@pytest.mark.parametrize("seed", [6, 8])  # 6 ran away
def test_a_forest_of_other_species_is_no_line_of_a_candidate(seed: int) -> None:
    """One band of 4746 km/s at -1956 km/s, with none of its lines seen, was the species that a spectrum needed."""
    rng = np.random.default_rng(seed)
    forest = artificial("forest", rng, 230e3, 230.6e3, 60)
    candidates = [artificial(f"s{i}", rng, 230e3, 230.6e3, 2) for i in range(3)]
    spectrum = injected([Component(forest, 3e17, 100.0, -7.0, 3.0)], GRID, 0.05, rng)
    found = identify(spectrum, candidates, choices=IdentifyChoices(velocity_km_s=-7.0, fwhm_km_s=3.0))
    for evidence in found.species:
        assert evidence.expected > 0
        assert abs(evidence.component.velocity_km_s + 7.0) < 15.0
        assert evidence.component.fwhm_km_s < 15.0
