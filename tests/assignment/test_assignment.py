"""Constants from peak lists: synthetic spectra with their truth, lists of ../shared, spectra without a molecule, wrong input."""

from __future__ import annotations

import csv
import gzip
import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from assignment_cases import BAND, SECOND, TRUTH, is_right, lines_of, spectrum
from places import SHARED

import rotor
from rotor.assignment.answer import AssignAnswer
from rotor.assignment.assign import answer_assign
from rotor.assignment.peaks.peak_list import PeakList, peak_list, spurs
from rotor.assignment.request import AssignRequest
from rotor.assignment.search.bounds import Bounds
from rotor.assignment.search.rigid_table import PARAMETERS
from rotor.assignment.species.growth import prior_weight
from rotor.formats.lines.assigned_lines import read_assigned_lines, write_assigned_lines

REFERENCE = SHARED / "reference" / "broadband"


@pytest.fixture(scope="module")
def answer() -> AssignAnswer:
    """Of one species among foreign peaks."""
    return answer_assign(AssignRequest(spectrum(), seconds=120))


def test_the_species_is_found_with_its_kind_and_temperature(answer: AssignAnswer) -> None:
    assert answer.word == "certain"
    assert is_right(answer, 0, TRUTH)
    best = answer.species[0]
    assert best.kind == "bc"
    np.testing.assert_allclose(best.dipole_ratio, [0, 1, 0.6], atol=0.15)  # intensities scatter by 20 %
    assert 1.4 <= best.grown.temperature_k <= 2.8  # the grid's neighbours of 2 K


def test_lines_and_what_is_left(answer: AssignAnswer) -> None:
    best = answer.species[0]
    assert len(best.lines) > 60
    assert np.abs(best.refined.fit.difference_mhz).max() < 0.05
    columns = answer.table.columns
    assert (columns["species"] == 1).sum() == len(np.unique(best.peak))
    assert answer.unexplained.sum() > 30  # most of the foreign peaks
    assigned = columns["species"] > 0
    np.testing.assert_allclose(
        columns["residual_mhz"][assigned], (columns["frequency_mhz"] - columns["calculated_mhz"])[assigned], atol=1e-9
    )
    assert np.abs(columns["residual_mhz"][assigned]).max() < 0.05  # ten times the errors of 5 kHz
    assert np.isnan(columns["residual_mhz"][~assigned]).all()


def test_lines_that_look_split_have_a_note(answer: AssignAnswer) -> None:
    """A species took 17 of 131 peaks of a spectrum with 14N, A and E without a word on their neighbours."""
    assert answer.notes == ()  # foreign peaks alone are near by chance
    peaks, best = answer.request.peaks, answer.species[0]
    assigned = np.unique(best.peak)[:20]
    frequency = np.concatenate([peaks.frequency_mhz, peaks.frequency_mhz[assigned] + 1.3])
    height = np.concatenate([peaks.intensity, 0.7 * peaks.intensity[assigned]])
    order = np.argsort(frequency)
    split = peak_list(frequency, height, 0.005, band_mhz=BAND)
    place = np.argsort(order)
    unexplained = np.concatenate([answer.unexplained, np.ones(20, dtype=bool)])[order]
    spurs_of_split = np.zeros(len(split), dtype=bool)
    species = (replace(best, peak=place[best.peak]),)
    (note,) = AssignAnswer(replace(answer.request, peaks=split), species, unexplained, spurs_of_split).notes
    found = re.match(
        r"species 1: (\d+) of its (\d+) peaks have an unassigned peak of similar height within 3 MHz", note
    )
    assert found is not None
    assert 20 <= int(found[1]) < 30
    assert int(found[2]) == len(np.unique(best.peak))
    assert "look split, by internal rotation or nuclear spins" in note


def test_lines_are_ready_for_a_fit(answer: AssignAnswer, tmp_path: Path) -> None:
    """The written lines, read back and fitted, give the same constants."""
    from rotor.fitting.fit import fit_lines
    from rotor.fitting.parameters import parameters

    path = tmp_path / "found.csv"
    write_assigned_lines(answer.species[0].lines, path)
    lines, _ = read_assigned_lines(path, ("j", "ka", "kc"))
    start = answer.species[0].constants
    fitted = fit_lines(lines, start, parameters(start, PARAMETERS))
    assert fitted.converged
    for name in "ABC":
        assert fitted.named[name] == pytest.approx(start[name], abs=3 * start.uncertainties[name])


def test_the_same_request_gives_the_same_answer(answer: AssignAnswer) -> None:
    again = answer_assign(answer.request)
    assert json.dumps(again.facts()) == json.dumps(answer.facts())


def test_two_species_in_one_list_are_both_assigned() -> None:
    computed = answer_assign(AssignRequest(spectrum(second=True), species=2, seconds=120))
    assert len(computed.species) == 2
    assert is_right(computed, 0, TRUTH)
    assert is_right(computed, 1, SECOND)
    assert computed.species[1].kind == "a"


PROLATE = {"A": 8636.7, "B": 703.9, "C": 650.8, "DJ": 3e-5, "DJK": 3e-4, "DK": 8e-3, "d1": -2e-6, "d2": -3e-7}
LIGHT = {"A": 6746.8, "B": 4959.3, "C": 3354.3, "DJ": 7.4e-3, "DJK": 1.3e-2, "DK": 3.4e-2, "d1": -2.6e-3, "d2": -5e-5}


def light_and_heavy(height: float = 100.0) -> PeakList:
    """A light c-type top whose distortion moves lines by some MHz, an a-type species, foreign peaks."""
    rng = np.random.default_rng(11)
    f, i = lines_of(LIGHT, (0.0, 0.0, 1.0), height)
    g, j = lines_of(SECOND, (1.0, 0.0, 0.0), 60.0)
    f = np.concatenate([f, g, rng.uniform(*BAND, 20)])
    i = np.concatenate([i, j, rng.random(20) ** (-1 / 0.8)])
    return peak_list(f + 0.004 * rng.normal(size=len(f)), i, 0.004, band_mhz=BAND)


def test_a_light_top_is_found_though_its_lines_are_far_from_rigid() -> None:
    """And it is looked for though the request is for one species: several of the strongest peaks are left without it."""
    computed = answer_assign(AssignRequest(light_and_heavy(), seconds=120))
    assert is_right(computed, 0, LIGHT)
    assert is_right(computed, 1, SECOND)


def test_lines_split_by_different_amounts() -> None:
    """The constants are those of the centres, though single components fit within some 0.1 MHz (these were called certain)."""
    rng = np.random.default_rng(12)
    f, i = lines_of(SECOND | {"A": 4301.0, "B": 2002.7, "C": 1550.5}, (0.9, 0.0, 1.0), 100.0)
    apart, share = 0.8 * rng.uniform(0.0, 1.0, len(f)), rng.uniform(0.4, 0.6, len(f))
    split, heights = np.concatenate([f - apart, f + apart]), np.concatenate([i * share, i * (1 - share)])
    strong = heights > 2.0
    peaks = peak_list(split[strong] + 0.004 * rng.normal(size=strong.sum()), heights[strong], 0.004, band_mhz=BAND)
    computed = answer_assign(AssignRequest(peaks, seconds=120))
    assert computed.species[0].split
    assert is_right(computed, 0, SECOND | {"A": 4301.0, "B": 2002.7, "C": 1550.5})
    assert [component.word for component in computed.species[1:]].count(
        "certain"
    ) == 0  # the other components are no second species


def test_a_guess_is_enough_where_the_search_is_narrow() -> None:
    guess = tuple(TRUTH[name] * factor for name, factor in zip("ABC", (1.02, 0.98, 1.015), strict=True))
    computed = answer_assign(AssignRequest(spectrum(seed=8), guess_mhz=guess, temperature_k=2.0, seconds=120))
    assert is_right(computed, 0, TRUTH)


def test_a_guess_of_a_light_top_among_many_peaks() -> None:
    """Distortion moves its rigid lines by some MHz, and chance peaks lie in such windows."""
    truth = {
        "A": 7253.57,
        "B": 2992.51,
        "C": 2820.16,
        "DJ": 2.1e-3,
        "DJK": -5.9e-3,
        "DK": 0.04,
        "d1": -7.2e-4,
        "d2": -7.5e-5,
    }
    rng, band = np.random.default_rng(3), (18000.0, 26500.0)
    f, i = lines_of(truth, (0.0, 1.0, 0.0), 100.0, 4.6, band)
    f = np.concatenate([f + 0.005 * rng.normal(size=len(f)), rng.uniform(*band, 250)])
    i = np.concatenate([i * np.exp(0.2 * rng.normal(size=len(i))), rng.random(250) ** (-1 / 0.8)])
    computed = answer_assign(
        AssignRequest(peak_list(f, i, 0.005, band_mhz=band), guess_mhz=(7462.8, 2971.0, 2791.8), seconds=120)
    )
    assert computed.word == "certain"
    assert is_right(computed, 0, truth)


@pytest.mark.parametrize(
    ("truth", "dipole"),
    [(SECOND, (1.0, 0.0, 0.0)), (PROLATE, (0.0, 0.0, 1.0))],
)
def test_a_guess_of_a_near_prolate_top(truth: dict[str, float], dipole: tuple[float, float, float]) -> None:
    """Three rigid lines leave A some per cent off; roots are looked for beyond the error of the guess, species are not."""
    f, i = lines_of(truth, dipole, 100.0)
    strong = i > 3.0
    peaks = peak_list(
        f[strong] + 0.004 * np.random.default_rng(2).normal(size=strong.sum()), i[strong], 0.004, band_mhz=BAND
    )
    guess = tuple(truth[name] * factor for name, factor in zip("ABC", (0.975, 0.98, 1.02), strict=True))
    computed = answer_assign(AssignRequest(peaks, guess_mhz=guess, seconds=120))
    assert is_right(computed, 0, truth)
    far = tuple(truth[name] * 1.2 for name in "ABC")
    assert answer_assign(AssignRequest(peaks, guess_mhz=far, seconds=120)).word == "not found"


@pytest.mark.parametrize("step", [0.05, 0.5, 1.0])
def test_points_of_kappa_that_bounds_leave(step: float) -> None:
    """Every top within bounds has its κ between the first and the last point, and few points are left by narrow bounds."""
    kappa = np.linspace(-1, 1, 401)
    centre = np.array([3614.2, 1811.4, 902.9])
    bounds = Bounds(centre * (1 - 0.1 * step), centre * (1 + 0.1 * step))
    part = kappa[bounds.points(kappa)]
    a, b, c = centre[:, None] * np.random.default_rng(1).uniform(1 - 0.1 * step, 1 + 0.1 * step, (3, 2000))
    values = (2 * b - a - c) / (a - c)
    assert (values >= part[0]).all()
    assert (values <= part[-1]).all()
    assert len(part) < 401 * (0.1 + 0.9 * step)


def redrawn(peaks: PeakList, seed: int) -> PeakList:
    """The same intensities at frequencies drawn again within each 200 MHz."""
    rng = np.random.default_rng(seed)
    floor = np.floor(peaks.frequency_mhz / 200) * 200
    f = np.clip(floor + 200 * rng.random(len(peaks)), *peaks.band_mhz)
    return peak_list(f, peaks.intensity, peaks.uncertainty_mhz, band_mhz=peaks.band_mhz)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_redrawn_frequencies_hold_no_species(seed: int) -> None:
    assert answer_assign(AssignRequest(redrawn(spectrum(), seed), seconds=120)).word == "not found"


def test_seconds_end_a_search() -> None:
    """A search among foreign peaks takes seconds; ended by its time it says so, and holds what it has."""
    rng = np.random.default_rng(31)
    peaks = peak_list(np.sort(rng.uniform(*BAND, 300)), rng.random(300) ** (-1 / 0.8), 0.005, band_mhz=BAND)
    short = answer_assign(AssignRequest(peaks, seconds=0.01))
    assert short.ended
    assert short.word == "not found"
    assert short.facts()["ended_by_time"]


def test_two_peaks_hold_no_species() -> None:
    computed = answer_assign(AssignRequest(peak_list([7000.0, 9000.0], [1.0, 2.0])))
    assert computed.word == "not found"
    assert computed.facts()["species"] == []


def test_isotopologues_of_a_geometry() -> None:
    """13C species of a chain, from a geometry with all bonds 0.5 % too long."""
    from rotor.molecules.molecule import Molecule
    from rotor.tops.isotopes.isotopologues import isotopologues

    x = np.array(
        [
            [0.0, 0, 0],
            [1.5, 0, 0],
            [2.2, 1.3, 0.1],
            [1.5, 2.5, 0.3],
            [0.1, 2.5, -0.4],
            [-0.7, 1.3, 0.4],
            [3.6, 1.4, 0.3],
        ]
    )
    molecule = Molecule(("C", "C", "C", "O", "C", "C", "O"), x)
    parent = rotor.Top.from_molecule(molecule)
    singles = [
        isotopologue
        for isotopologue in isotopologues(parent, min_abundance=5e-3)[1:]
        if len(isotopologue.substituted) == 1
    ]
    distortion = {"DJ": 2e-5, "DJK": 1e-4, "DK": 1e-3, "d1": -3e-6, "d2": -2e-7}
    rng = np.random.default_rng(4)
    f, i = [], []
    for top, height in [(parent, 2000.0), *((single.top, 22.0) for single in singles)]:
        truth = {name: top.constants[name] for name in "ABC"} | distortion
        frequency, intensity = lines_of(truth, (1.0, 0.6, 0.0), height)
        f.append(frequency)
        i.append(intensity)
    f, i = np.concatenate(f), np.concatenate(i)
    strong = i > 6.0
    peaks = peak_list(f[strong] + 0.004 * rng.normal(size=strong.sum()), i[strong], 0.004, band_mhz=BAND)
    longer = Molecule(molecule.symbols, 1.005 * x)
    request = AssignRequest(peaks, molecule=longer, isotopologues=True, seconds=120)
    computed = answer_assign(request)
    assert is_right(computed, 0, {name: parent.constants[name] for name in "ABC"})
    right = 0
    for component in computed.species[1:]:
        names = [single for single in singles if single.label == component.isotopologue]
        off = [component.constants[name] - names[0].top.constants[name] for name in "ABC"]
        right += bool((np.abs(off) < 5 * np.array([component.constants.uncertainties[name] for name in "ABC"])).all())
    assert right == len(computed.species) - 1  # none is wrong
    assert right >= 0.8 * len(singles)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (([7000.0], [1.0]), "1 peak: constants need more"),
        (([7.0, 9.0], [1.0, 1.0]), "if they are in GHz, multiply by 1000"),
        (([7000.0, 9000.0], [1.0, -1.0]), "row 2: intensity is -1"),
        (([7000.0, np.nan], [1.0, 1.0]), "row 2: frequency_mhz is nan"),
        (([7000.0, 9000.0], [1.0]), "two columns of equal length"),
    ],
)
def test_wrong_peaks_are_refused(columns: tuple[list[float], list[float]], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        peak_list(*columns)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"species": 0}, "species: 0: expected a whole number"),
        ({"guess_mhz": (1.0, 2.0, 3.0)}, "expected A > B > C > 0"),
        ({"isotopologues": True}, "a geometry of the first species is needed"),
        ({"low_mhz": (9e4, 1.0, 1.0)}, "expected 0 < low < high"),
    ],
)
def test_wrong_requests_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        AssignRequest(peak_list([7000.0, 9000.0], [1.0, 1.0]), **settings)  # type: ignore[arg-type]


def test_spurs_are_multiples_of_a_clock() -> None:
    rng = np.random.default_rng(3)
    real = rng.uniform(6000, 18000, 300)
    comb = 50.0 * rng.choice(np.arange(121, 359), 8, replace=False)
    peaks = peak_list(np.concatenate([real, comb]), np.ones(308))
    computed = peaks.frequency_mhz[spurs(peaks)]
    assert set(comb) <= set(computed)
    assert len(computed) <= 10
    assert not spurs(peak_list(real, np.ones(300))).any()


def test_a_gap_in_the_band_is_seen() -> None:
    peaks = spectrum()
    cut = peaks.where((peaks.frequency_mhz < 11000) | (peaks.frequency_mhz > 14000))
    cut = replace(cut, stated_windows=None)
    assert len(cut.windows) == 2
    assert cut.windows[0, 1] == pytest.approx(11000, abs=200)
    assert is_right(answer_assign(AssignRequest(cut, seconds=120)), 0, TRUTH)


def case_of(number: int) -> tuple[PeakList, dict[str, object]]:
    """A list of ../shared and its truth."""
    path = REFERENCE / f"case_{number:03d}.csv.gz"
    if not path.exists():
        pytest.skip("no ../shared/reference/broadband beside the checkout")
    with gzip.open(path, "rt") as text:
        rows = np.array(list(csv.reader(text))[1:], dtype=float)
    truth = json.loads((REFERENCE / "truth" / f"case_{number:03d}.json").read_text())
    return peak_list(*rows.T, band_mhz=tuple(map(float, truth["range_mhz"]))), truth


@pytest.mark.oracle
@pytest.mark.parametrize("number", [7, 19, 39])
def test_lists_of_shared(number: int) -> None:
    peaks, truth = case_of(number)
    computed = answer_assign(AssignRequest(peaks, seconds=120))
    assert is_right(computed, 0, truth["species"][0])  # type: ignore[index]


@pytest.mark.oracle
@pytest.mark.slow
def test_all_lists_of_shared() -> None:
    """The strongest species of at least 90 % of the lists with a signal-to-noise ratio of 100, none confidently wrong."""
    right, total = 0, 0
    for number in range(1, 41):
        peaks, truth = case_of(number)
        if truth["signal_to_noise"] < 100:  # type: ignore[operator]
            continue
        total += 1
        computed = answer_assign(AssignRequest(peaks, seconds=120))
        mains = [component for component in truth["species"] if "isotopologue_of" not in component]  # type: ignore[attr-defined]
        right += any(is_right(computed, n, mains[0]) for n in range(len(computed.species)))
    assert right >= 0.9 * total


def test_conformers_of_a_smiles_as_guesses() -> None:
    """Two conformers whose constants are some per cent off those of the force field, each found near its own guess."""
    from rotor.assignment.guesses import guess_values

    values = np.array(guess_values("SMILES:CCOC(=O)C=C")).reshape(-1, 3)
    assert len(values) >= 2
    off = np.array([[1.02, 0.985, 0.99], [0.98, 1.015, 1.01]])
    truths = [dict(SECOND, **dict(zip("ABC", row, strict=True))) for row in values[:2] * off]
    lines = [lines_of(truth, (1.0, 0.7, 0.0), height) for truth, height in zip(truths, (100.0, 40.0), strict=True)]
    rng = np.random.default_rng(21)
    f, i = (
        np.concatenate([*(pair[k] for pair in lines), part])
        for k, part in ((0, rng.uniform(*BAND, 40)), (1, np.full(40, 3.0)))
    )
    strong = i > 2.0
    peaks = peak_list(f[strong] + 0.004 * rng.normal(size=strong.sum()), i[strong], 0.004, band_mhz=BAND)
    request = AssignRequest(peaks, guess_mhz=tuple(values.ravel().tolist()), species=2, seconds=120)
    assert [len(guess.guess_mhz or ()) for guess in request.each_guess] == [3] * len(values)
    computed = answer_assign(request)
    assert len(computed.species) == 2
    assert is_right(computed, 0, truths[0])
    assert is_right(computed, 1, truths[1])


@pytest.mark.parametrize(
    ("guess", "message"),
    [
        ("SMILES:C1CC", "cannot be read"),
        ("SMILES:C=C=C=O", "force field are good to 20% only"),
        ("SMILES:CC#N", "only asymmetric tops"),
        ("2458,490", "expected three numbers"),
        ("abc", "abc"),
    ],
)
def test_wrong_guesses_are_refused(guess: str, message: str) -> None:
    from rotor.assignment.guesses import guess_values

    with pytest.raises(ValueError, match=message):
        guess_values(guess)


def test_what_is_known_beforehand_weighs_as_its_standard_errors() -> None:
    """Of A, B, C 5 %, or the spread of the field; of distortion the sizes that are given."""
    sizes, constants = np.array([1e-3, 2e-3, 3e-3, 4e-5, 5e-6]), np.array([9000.0, 3000.0, 2500.0])
    for spread, errors in ((None, 0.05 * constants), (np.array([30.0, 2.0, 1.0]), [30.0, 2.0, 1.0])):
        covariance = np.linalg.inv(prior_weight(SimpleNamespace(spread=spread), constants, sizes))  # type: ignore[arg-type]
        assert np.allclose(np.sqrt(np.diag(covariance)), [*errors, *sizes], rtol=1e-12)
