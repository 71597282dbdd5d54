"""SPFIT's own fits: the same constants, standard errors, correlations, rms and lines, from its files as they are."""

from __future__ import annotations

import gzip
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

from rotor.fitting.fit import fit_lines
from rotor.fitting.resampling import bootstrap
from rotor.formats.spcat.file_quanta import quanta_format
from rotor.formats.spcat.fits.fit_input import error_factor, fitted_file, read_fit, spfit_input
from rotor.formats.spcat.fits.fit_states import FileLevels, groups_for_fit, quanta_names
from rotor.formats.spcat.fits.named_fit import publication_rows
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.solved_groups import variance_factor
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.lin import LineList, read_lin
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.estimates.contracted import ContractedLevels

# weighted rms, rms of lines in MHz and of those in cm-1, as SPFIT printed them
FITS = {
    "co_4": (0.90566, 0.012963, None),
    "hcp000": (0.69709, 0.319110, None),
    "h2s": (0.44639, 0.296464, 1.0e-4),
    "csf": (0.85537, 0.000197, None),
    "ar-so2": (2.11681, 0.006229, None),
    "ch3cn_MeCN": (0.90566, 0.018275, 2e-5),
}
STARTS = ("ared6_500_p0p1pct", "ared6_500_p1pct", "ared6_500_p3pct_et1e9", "ared6_500_p5pct_et1e9", "ared6_500_p10pct_et1e9",
          "ared6_5000_p1pct", "formamide_hfs")  # fmt: skip


KINDS = ORACLES / "kinds"


def fitted(par, lin):
    fit_input = spfit_input(par, lin)
    fit = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )
    return fit_input, fit


def text_of(path: Path) -> str:
    return gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text(errors="replace")


def printed_correlations(text: str) -> dict[tuple[int, int], float]:
    tail = text[text.rindex("END OF ITERATION") :]
    return {(int(i), int(j)): float(c) for i, j, c in re.findall(r"\s+(\d+)\s+(\d+)\s+(-?\d\.\d{6})", tail)}


def compare(fit_input, fit, variances, report: str) -> None:
    """Constants within 0.01 σ, errors to 4 digits, correlations to the print, every line counted that SPFIT counted."""
    ours = fitted_file(fit_input, fit, variances=True).parameters
    free = [
        i for i, column in enumerate(fit_input.columns) if column >= 0 and not fit_input.file.parameters[i].constrained
    ]
    for i in free:
        theirs = variances.parameters[i]
        assert abs(ours[i].value - theirs.value) < 0.01 * theirs.error
        assert ours[i].error == pytest.approx(
            theirs.error, rel=1e-6
        )  # nine digits are printed; the issue asks for four

    printed = printed_correlations(report)
    independent = [fit_input.columns[i] for i, p in enumerate(fit_input.file.parameters) if not p.constrained]
    numbers = independent if max(i for i, _ in printed) == len(independent) else [fit_input.columns[i] for i in free]
    for (i, j), value in printed.items():
        a, b = numbers[i - 1], numbers[j - 1]
        if a >= 0 and b >= 0:
            assert fit.statistics.correlations[a, b] == pytest.approx(value, abs=1e-6)  # six digits are printed
    assert fit.used.all()


@pytest.mark.oracle
@pytest.mark.parametrize("name", FITS)
def test_published_fits_come_out_as_spfit_has_them(shared: Path, name: str):
    folder = next((shared / "reference" / "fits").glob(f"*/{name}.par")).parent
    fit_input = read_fit(folder / f"{name}.par")
    fit = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )
    rms, mhz, wavenumbers = FITS[name]
    assert fit.converged, fit.reason
    assert fit.weighted_rms == pytest.approx(rms, abs=6e-6)  # half of the last digit printed
    assert fit.rms_mhz() == pytest.approx(mhz, abs=6e-7)  # the same
    if wavenumbers:
        assert fit.rms_mhz(wavenumber=True) == pytest.approx(wavenumbers, abs=6e-6)  # five decimals are printed
    results = folder / "v2008_results"
    compare(fit_input, fit, read_par(results / f"{name}.var"), text_of(results / f"{name}.fit"))


@pytest.mark.oracle
def test_formaldehyde_has_its_published_rms(shared: Path):
    fit_input = read_fit(shared / "reference" / "fits" / "h2co_cdms" / "ch2o.par")
    fit = fit_lines(fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options)
    assert len(fit.lines) == 274
    assert fit.used.all()
    assert fit.weighted_rms == pytest.approx(0.560, abs=6e-4)  # as published


@pytest.mark.oracle
@pytest.mark.parametrize("name", STARTS)
def test_starts_up_to_ten_per_cent_off_end_at_spfits_minimum(shared: Path, name: str):
    folder = shared / "reference" / "spfit" / name
    lin = folder / f"{name}.lin"
    lines = read_lin(lin) if lin.exists() else read_lin(gzip.decompress((folder / f"{name}.lin.gz").read_bytes()))
    fit_input, fit = fitted(read_par(folder / f"{name}.par.start"), lines)
    case = json.loads((folder / "case.json").read_text())
    assert fit.converged, fit.reason
    assert fit.weighted_rms == pytest.approx(case["rms_history"][-1][2], abs=6e-6)  # half of the last digit printed
    assert len(fit.minimum.iterations) <= abs(fit_input.file.header.nitr)
    ours = {p.code: p for p in fitted_file(fit_input, fit, variances=True).parameters}
    for parameter in case["parameters"]:
        assert abs(ours[parameter["code"]].value - parameter["truth"]) < 3 * ours[parameter["code"]].error
    compare(fit_input, fit, read_par(folder / f"{name}.var"), text_of(folder / f"{name}.fit.gz"))


@pytest.mark.oracle
def test_the_var_file_is_the_one_that_spfit_writes(shared: Path):
    """V of the correlations too, but for the signs of its columns, which have no bearing."""
    folder = shared / "reference" / "fits" / "h2s"
    fit_input = read_fit(folder / "h2s.par")
    fit = fit_lines(fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options)
    ours, theirs = (
        np.array([float(x) for x in re.findall(r"-?\d+\.\d{7}", rest)])
        for rest in (
            fitted_file(fit_input, fit, variances=True).rest,
            read_par(folder / "v2008_results" / "h2s.var").rest,
        )
    )
    assert len(ours) == 35 * 36 / 2
    assert np.abs(np.abs(ours) - np.abs(theirs)).max() < 3e-7  # seven decimals are printed
    assert error_factor(fit, fit_input.file.header) == 1.0
    assert (
        str(error_factor(fit, replace(fit_input.file.header, frac=0.0))) == "0.0"
    )  # not -0.0, which a file would show


TWO_STATES = b"""two states, one spin
   7  100   20    0    0.0  1.0E+06  1.0 1.0
a  3  2  0  30  0  1  1  1  0  -1  0
        10099  9000.0  1E+36 /A
        20099  3000.0  1E+36 /B
        30099  2500.0  1E+36 /C
           11   700.0  1E+36 /dE
       410001    20.0  1E+36 /Fac
    110010099     3.0  1E+36 /1.5chi_aa
    110040099     0.5  1E-37 /chi_-
"""


def test_the_linear_blocks_are_the_cores_levels_and_derivatives():
    """Two states with a Coriolis term and a quadrupole nucleus: energies as the core has them, slopes by differences."""
    file = read_par(TWO_STATES)
    groups = groups_for_fit(file)
    form = quanta_format(file, groups)
    assert quanta_names(form) == ("n", "ka", "kc", "v", "f")
    labels = np.array(
        [[2, 1, 1, 0, 3], [2, 1, 1, 0, 1], [3, 0, 3, 1, 3], [3, 2, 2, 0, 2], [1, 1, 0, 1, 1], [4, 2, 3, 1, 4]]
    )
    model = FileLevels.from_labels(file, labels)
    values = np.array([p.value for p in file.parameters])
    energies, slopes = model.levels(values)

    from rotor.formats.spcat.file_quanta import listed_quanta

    levels = groups[0].levels((0, 12))
    printed = {
        tuple(q): e for q, e in zip(listed_quanta(groups[0], levels, form).tolist(), levels.energy_mhz, strict=True)
    }
    assert energies == pytest.approx([printed[tuple(label)] for label in labels.tolist()], rel=1e-12)  # round-off
    for i in range(len(values)):
        step = 1e-3 * max(abs(values[i]), 1e-2)
        up, down = (model.levels(values + sign * step * np.eye(len(values))[i])[0] for sign in (1, -1))
        size = np.abs(slopes[:, i]).max()
        assert slopes[:, i] == pytest.approx(
            (up - down) / (2 * step), abs=2e-5 * size
        )  # third derivatives at a step of 1e-3


def test_a_table_names_the_states_of_parameters_also_where_one_option_line_stands_for_all():
    file = read_par(TWO_STATES)
    labels = np.array([[2, 1, 1, 0, 3, 1, 1, 0, 0, 2, -32768, -32768]])
    read = spfit_input(file, LineList(labels, np.array([20000.0]), np.array([0.1]), np.ones(1)))
    held = replace(read, columns=(-1,) * len(file.parameters))
    rows = [(row.name, row.states) for row in publication_rows(held, fit=None)]
    assert rows == [
        ("A", "all"),
        ("B", "all"),
        ("C", "all"),
        ("dE", "1"),
        ("Fac", "0, 1"),
        ("1.5chi_aa", "all"),
        ("chi_-", "all"),
    ]


def test_labels_follow_their_states_where_energies_cross():
    """Levels of one F block change their order as A grows; the labelled one stays the same function."""
    file = read_par(TWO_STATES)
    labels = np.array([[3, 0, 3, 0, 3], [2, 2, 1, 0, 3], [4, 0, 4, 0, 3]])
    model = FileLevels.from_labels(file, labels)
    values = np.array([p.value for p in file.parameters])
    energies, _ = model.levels(values)
    moved = values.copy()
    moved[0] = 30000.0
    after, slopes = model.levels(moved)
    assert energies[1] < energies[2]
    assert after[1] > after[2]  # they have crossed
    assert slopes[1, 0] > 3.5  # still K = 2: ∂E/∂A = K²
    assert abs(slopes[2, 0]) < 0.5  # still K = 0


def test_levels_that_a_file_does_not_have_are_refused():
    with pytest.raises(ValueError, match=r"there is no level 2 1 1 0 9 \(n, ka, kc, v, f\)"):
        FileLevels.from_labels(read_par(TWO_STATES), np.array([[2, 1, 1, 0, 9]]))
    with pytest.raises(ValueError, match="there is no level 2 1 1 5 2"):
        FileLevels.from_labels(read_par(TWO_STATES), np.array([[2, 1, 1, 5, 2]]))


@pytest.mark.oracle
@pytest.mark.parametrize(
    "name", [pytest.param(fit, marks=pytest.mark.slow) if fit == "ch3cn_MeCN" else fit for fit in FITS]
)
def test_errors_of_predicted_lines_are_those_of_spcat(shared: Path, name: str):
    """From errors and correlations of the .var: one state, several states, spins; hyperfine components too."""
    results = next((shared / "reference" / "fits").glob(f"*/{name}.par")).parent / "v2008_results"
    prediction = predict(
        read_par(results / f"{name}.var"), read_int(results.parent / f"{name}.int"), as_spcat=True
    ).catalogue
    theirs = read_cat(results / f"{name}.cat")

    def labels(catalogue):
        return np.concatenate([catalogue.quanta_upper, catalogue.quanta_lower], axis=1).tolist()

    ours = dict(zip(map(tuple, labels(prediction)), prediction.error_mhz.tolist(), strict=True))
    predicted = [
        (ours[tuple(q)], e) for q, e, t in zip(labels(theirs), theirs.error_mhz, theirs.tag, strict=True) if t > 0
    ]
    assert len(predicted) > 60
    for mine, other in predicted:
        if other < 999:  # larger ones are printed as 999.9999
            assert mine == pytest.approx(other, abs=5.1e-5, rel=2e-6)  # four decimals; seven of the correlations


def test_correlations_that_do_not_fit_the_parameters_are_refused():
    file = read_par(TWO_STATES.replace(b"1E+36", b"1E-03"))
    assert variance_factor(read_par(TWO_STATES)) is None
    assert variance_factor(file).shape == (7, 6)
    with pytest.raises(ValueError, match="4 correlations stand at the end"):
        variance_factor(replace(file, rest="".join(f"{x:10.7f}" for x in (1, 0, 1, 0)) + "\n"))
    with pytest.raises(ValueError, match="correlations of 2 parameters"):
        variance_factor(replace(file, rest="".join(f"{x:10.7f}" for x in (1, 0, 1)) + "\n"))


@pytest.mark.parametrize("name", ["o2", "oc33s"])
def test_fits_of_a_triplet_and_of_a_bent_state_come_out_as_spfit_has_them(tmp_path, name):
    """A .var of SPFIT as the start, each free constant 1e-6 off: ties, an a-priori error of 1e-19, an energy from zero (N = -1)."""
    folder = KINDS / name
    theirs = read_par(folder / f"{name}.var")
    parameters, factor = [], 1.0
    for p in theirs.parameters:
        fixed = p.error == 1e-19
        factor = factor if p.constrained else 1.0 if fixed else 1 + 1e-6
        parameters.append(
            replace(p, value=p.value * factor, error=1e-19 if fixed else 1e-37 if p.constrained else 1e36)
        )
    start = replace(theirs, parameters=tuple(parameters), rest="")
    lines = read_lin(folder / f"{name}.lin", len(quanta_names(quanta_format(start, groups_for_fit(start)))))
    fit_input, fit = fitted(start, lines)
    assert fit.converged, fit.reason
    assert fit.used.all()
    ours = fitted_file(fit_input, fit, variances=True)
    for mine, other in zip(ours.parameters, theirs.parameters, strict=True):
        assert abs(mine.value - other.value) < 0.01 * other.error  # the limit
        assert mine.error == pytest.approx(other.error, rel=1e-6)  # derivatives at a step of less than 0.01 of an error
    mine, other = (np.array([float(x) for x in re.findall(r"-?\d+\.\d{7}", row.rest)]) for row in (ours, theirs))
    if len(other):  # the samples of the package have them only where a prediction needs them
        assert np.abs(np.abs(mine) - np.abs(other)).max() < 1e-6  # seven decimals are printed
    whole = np.flatnonzero(fit.lines.from_zero)
    assert len(whole) == (name == "o2")


@pytest.mark.slow
@pytest.mark.oracle
def test_a_radical_with_three_protons_ends_at_spfits_minimum():
    """Where SPFIT ends when its iterations go on: 22 parameters, total spin of two protons, ten quantum numbers, blends, ties."""
    fit_input = read_fit(KINDS / "h2coh" / "fit.par", KINDS / "h2coh" / "fit.lin")
    fit = fit_lines(fit_input.lines, None, fit_input.parameters, fit_input.options, model=fit_input.model)
    assert fit.converged, fit.reason
    assert fit.used.all()
    assert fit.weighted_rms == pytest.approx(0.71369, abs=5e-6)  # five decimals are printed
    ours, theirs = (
        fitted_file(fit_input, fit, variances=True).parameters,
        read_par(KINDS / "h2coh" / "fit.var").parameters,
    )
    compared = 0
    for mine, other in zip(ours, theirs, strict=True):
        if not other.constrained and other.error > 1e-30:
            assert abs(mine.value - other.value) < 1e-4 * other.error  # the search ends at 1e-4
            assert mine.error == pytest.approx(
                other.error, rel=1e-5
            )  # it changes by 3.6e-4 within 0.0044 standard errors
            compared += 1
    assert compared == 22


def test_lines_of_a_file_with_spins_are_drawn_anew():
    """The bootstrap with the file's own levels; a-priori errors of 1e18 MHz are none."""
    folder = KINDS / "oc33s"
    theirs = read_par(folder / "oc33s.var")
    parameters = tuple(replace(p, error=1e-19 if p.error == 1e-19 else 1e18) for p in theirs.parameters)
    fit_input, fit = fitted(replace(theirs, parameters=parameters, rest=""), read_lin(folder / "oc33s.lin", 3))
    assert fit.degrees_of_freedom == 23 - 7
    _, spread = bootstrap(fit, 12, np.random.default_rng(1), model=fit_input.model)
    assert spread[0] < 1e-15  # held by its a-priori error
    ratio = spread[1:] / fit.scaled_errors[1:]
    assert 0.3 < np.median(ratio) < 3.0  # deviations of 12 samples are good to a fifth, 23 lines to another


@pytest.mark.slow
@pytest.mark.oracle
def test_levels_of_two_chlorines_and_two_states_are_spfits():
    """ClClO2 with all spins: blocks of some 1,000 functions, F below 0, frequencies as SPFIT prints them."""
    fit_input = read_fit(KINDS / "clclo2_spins" / "clclo2.par")
    model = fit_input.model(np.unique(np.concatenate([fit_input.lines.upper, fit_input.lines.lower]), axis=0))
    assert isinstance(model.whole.others[0].blocks, ContractedLevels)
    labels, places = np.unique(
        np.concatenate([fit_input.lines.upper, fit_input.lines.lower]), axis=0, return_inverse=True
    )
    energies, _ = model.levels(fit_input.parameters.to_constants(fit_input.parameters.start))
    calculated = (
        energies[places.reshape(-1)[: len(fit_input.lines)]] - energies[places.reshape(-1)[len(fit_input.lines) :]]
    )
    assert len(labels) > 100
    assert calculated == pytest.approx(fit_input.lines.frequency_mhz, abs=1e-5)  # five decimals are printed
