"""Corners of fits: N = 0 among large blocks of spins, a-priori values of 0, constants that the lines do not determine.

Errors of lines by SPCAT (compiled from its public source) from the .var files of these fits, A and DK of a symmetric top or energies of
states not determined, are those of the fits with these constants held: 144 and 582 lines, in every printed digit.
"""

from __future__ import annotations

import tomllib
import warnings
from dataclasses import replace

import numpy as np
import pytest
from file_covariance import constants_covariance

import rotor
from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.fit import fit_lines
from rotor.fitting.levels.top_levels import top_levels
from rotor.fitting.parameters import Parameters, parameters
from rotor.fitting.reports.publication import publication_table
from rotor.fitting.resampling import bootstrap
from rotor.fitting.result import Fit, determined_covariance
from rotor.fitting.top_constants import TopConstants
from rotor.formats.fits.fit_request import answer_fit, lines_request, write_fitted_toml
from rotor.formats.lines.assigned_lines import write_assigned_lines
from rotor.formats.spcat.fits.fit_input import fitted_file, spfit_input
from rotor.formats.spcat.fits.named_fit import named_file
from rotor.formats.spcat.hamiltonian.codes import FIXED
from rotor.formats.spcat.solved_groups import variance_factor
from rotor.formats.spcat.text.lin import read_lin
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.estimates import contracted, effect_units
from rotor.quantum.estimates.contracted import ContractedLevels
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

ERROR_MHZ = 0.005
NITROGEN = Top.from_constants(
    "A=9000 B=3000 C=2500 DeltaJ=0.001",
    spin_constants=SpinConstants.parse("chi_aa(14N)=-4 chi_bb-cc(14N)=1.2 chi_ab(14N)=15"),
)
LEVELS = ((0, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0), (2, 0, 2), (2, 1, 2), (2, 1, 1))  # N Ka Kc
SYMMETRIC = Constants(A=9000.0, B=3000.0, DJ=0.001, DJK=0.01)


def with_f(levels: tuple[tuple[int, int, int], ...]) -> np.ndarray:
    """Labels N Ka Kc F of all F with a spin of 1."""
    return np.array([(*level, f) for level in levels for f in range(abs(level[0] - 1), level[0] + 2)])


def nitrogen_lines(constants: TopConstants) -> Assignments:
    """Lines from every level to those of another N or parity with an F beside its own, with normal errors."""
    labels = with_f(LEVELS)
    values = np.array(list(constants.values.values()))
    energies = top_levels(constants, labels).levels(values)[0]
    pairs = [(i, k) for i in range(len(labels)) for k in range(i) if tuple(labels[i, :3]) != tuple(labels[k, :3])]
    up, low = np.array([pair for pair in pairs if abs(labels[pair[0], 3] - labels[pair[1], 3]) < 2]).T
    noise = np.random.default_rng(4).normal(scale=ERROR_MHZ, size=len(up))
    return assignments(constants.quanta, labels[up], labels[low], energies[up] - energies[low] + noise, ERROR_MHZ)


def symmetric_lines() -> Assignments:
    """J+1 ← J of a symmetric top, which know nothing of A and DK."""
    rows = [(j, k) for j in range(12) for k in range(j + 1)]
    j, k = np.array(rows, dtype=float).T
    nu = 2 * (j + 1) * (SYMMETRIC["B"] - SYMMETRIC["DJK"] * k**2) - 4 * SYMMETRIC["DJ"] * (j + 1) ** 3
    noise = np.random.default_rng(5).normal(scale=ERROR_MHZ, size=len(j))
    return assignments(("j", "k"), [(a + 1, b) for a, b in rows], rows, nu + noise, ERROR_MHZ)


def symmetric_fit(free: str) -> Fit:
    start = SYMMETRIC.replace(DK=0.02)
    return fit_lines(symmetric_lines(), start, parameters(start, free.split()))


def test_n_of_0_among_large_blocks(monkeypatch):
    """Of the contraction with all functions inside, which is exact, the levels and derivatives are those of whole blocks."""
    constants, labels = TopConstants(NITROGEN, True), with_f(LEVELS)
    values = np.array(list(constants.values.values()))
    energies, slopes = top_levels(constants, labels).levels(values)
    monkeypatch.setattr(effect_units, "_LARGE", 0)
    monkeypatch.setattr(contracted, "_WIDE", np.inf)
    model = top_levels(constants, labels)
    assert not model.tracked
    assert [type(part.blocks) for part in model.others] == [ContractedLevels]
    computed, derivatives = model.levels(values)
    assert computed == pytest.approx(energies, abs=1e-6)  # TOLERANCE_MHZ of the contraction
    assert derivatives == pytest.approx(slopes, abs=1e-6)  # likewise, of numbers up to 10


def test_an_a_priori_value_of_0_stays(folder):
    """χ_ab of 15 MHz a priori 0 ± 0.05: at 0 no line depends on it to first order, so that SPFIT says 0(0.05)."""
    write_assigned_lines(nitrogen_lines(TopConstants(NITROGEN, True)), "lines.csv")
    top = replace(NITROGEN, spin_constants=SpinConstants.parse("chi_aa(14N)=-4 chi_bb-cc(14N)=1.2 chi_ab(14N)=0"))
    free = ["A", "B", "C", "chi_aa(14N)", "chi_bb-cc(14N)", "chi_ab(14N)"]
    known = lines_request("lines.csv", top, free, priors_mhz={"chi_ab(14N)": 0.05})
    assert known.parameters.start[-1] == known.parameters.expected[-1] == 0.0
    fit = answer_fit(replace(known, options=replace(known.options, poor_rms=1e9))).fit
    assert abs(fit.values[-1]) < 1e-6
    assert fit.errors[-1] == pytest.approx(0.05, rel=1e-3)  # derivatives at 1e-30 MHz are round-off
    unknown = lines_request("lines.csv", top, free)
    assert unknown.parameters.start[-1] != 0.0
    answer = answer_fit(unknown).fit
    assert abs(abs(answer.values[-1]) - 15) < 4 * answer.errors[-1]


def test_a_new_start_leaves_a_priori_values_where_they_are():
    start = Constants(B=3000.0, D=0.0012)
    j = np.arange(8)
    nu = 2 * 3000.0 * (j + 1) - 4 * 0.001 * (j + 1) ** 3
    lines = assignments(("j",), (j + 1)[:, None], j[:, None], nu, ERROR_MHZ)
    free = parameters(start, ["B", "D"], priors_mhz={"D": 1e-6})  # the lines alone: 2e-6
    fit = fit_lines(lines, start, free)
    assert abs(fit.values[1] - 0.0012) > 1e-6  # the lines draw it away
    again: Parameters = free.moved(fit.values)
    assert again.expected.tolist() == [fit.values[0], 0.0012]
    assert fit_lines(lines, start, again).values == pytest.approx(fit.values, rel=1e-9)  # where either search ends
    values, _ = bootstrap(fit, 20, np.random.default_rng(2))
    assert abs(values[:, 1].mean() - fit.values[1]) < 1e-5


def test_the_var_file_holds_what_is_not_determined():
    fit, held = symmetric_fit("A B DJ DJK DK"), symmetric_fit("B DJ DJK")
    assert len(fit.statistics.undetermined) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        file, other = (named_file(result, "", variances=True) for result in (fit, held))
    errors = {p.code: p.error for p in file.parameters}
    assert errors[1000] == errors[2000] == FIXED
    assert "nan" not in file.rest
    names = ("B", "DJ", "DJK")
    ours, theirs = (constants_covariance(named).of(names) for named in (file, other))
    assert ours.names == theirs.names == names
    assert np.sqrt(np.diag(ours.matrix_mhz2)) == pytest.approx(held.errors, rel=1e-6)  # 7 decimals of correlations
    assert ours.correlations == pytest.approx(theirs.correlations, abs=1e-6)  # likewise
    assert all(p.error == 1e36 for p in named_file(fit, "", variances=False).parameters)


def state_lines(constants: TopConstants) -> Assignments:
    """Lines within each of three states that nothing couples, which know nothing of their energies."""
    labels = np.array([(*level, v) for v in range(3) for level in LEVELS])
    energies = top_levels(constants, labels).levels(np.array(list(constants.values.values())))[0]
    pairs = [(i, k) for i in range(len(labels)) for k in range(i) if labels[i, 3] == labels[k, 3]]
    up, low = np.array(pairs).T
    noise = np.random.default_rng(6).normal(scale=ERROR_MHZ, size=len(up))
    return assignments(constants.quanta, labels[up], labels[low], energies[up] - energies[low] + noise, ERROR_MHZ)


@pytest.mark.parametrize("ties", [[], ["E[2] = 2*E[1]", "C = B - 500"]])
def test_the_var_file_holds_what_is_not_determined_of_states(ties):
    """The energies, alone and with what follows them, beside a pair that does follow."""
    states = StateConstants.parse("E[1]=1000 E[2]=2000 A[1]=8990 B[1]=3003 C[1]=2501 A[2]=8980 B[2]=3006 C[2]=2502 MHz")
    start = TopConstants(Top.from_constants("A=9000 B=3000 C=2500", states=states), False)
    lines = state_lines(start)
    known = ["A", "B", "A[1]", "B[1]", "C[1]", "B[2]"] if ties else ["A", "B", "C", "A[1]", "B[1]", "C[1]", "B[2]"]
    held = fit_lines(lines, start, parameters(start, known, ties=ties[1:]))
    fit = fit_lines(lines, start, parameters(start, [*known, "E[1]", *(["E[2]"] if not ties else [])], ties=ties))
    assert {combination.text for combination in fit.statistics.undetermined} == ({"E[1]"} if ties else {"E[1]", "E[2]"})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        file, other = (named_file(result, "", variances=True) for result in (fit, held))
    assert {p.error for p in file.parameters if p.code in (11, 22)} == {FIXED}
    assert covariance_by_code(file) == pytest.approx(covariance_by_code(other), rel=1e-4, abs=1e-12)  # of 7 decimals


def test_the_var_file_of_spfits_input_holds_what_is_not_determined(folder):
    states = StateConstants.parse("E[1]=1000 A[1]=8990 B[1]=3003 C[1]=2501 E[2]=2000 A[2]=8980 B[2]=3006 C[2]=2502 MHz")
    start = TopConstants(Top.from_constants("A=9000 B=3000 C=2500", states=states), False)
    fit = fit_lines(state_lines(start), start, parameters(start, ["A", "B", "C", "E[1]"]))
    write_assigned_lines(fit.lines, "case.lin")
    fit_input = spfit_input(named_file(fit, "", variances=False), read_lin("case.lin", 4))
    other = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )
    ours, theirs = named_file(fit, "", variances=True), fitted_file(fit_input, other, variances=True)
    assert [p.error for p in theirs.parameters if p.code == 11] == [FIXED]
    assert covariance_by_code(theirs) == pytest.approx(covariance_by_code(ours), rel=1e-4, abs=1e-12)  # of 7 decimals


def covariance_by_code(file: ParameterFile) -> dict[tuple[int, int], float]:
    """The covariance of the parameters, MHz², by pairs of codes."""
    factor, codes = variance_factor(file), [p.code for p in file.parameters]
    matrix = factor @ factor.T
    return {(a, b): matrix[i, k] for i, a in enumerate(codes) for k, b in enumerate(codes) if i >= k and matrix[i, k]}


def test_the_table_tells_held_from_not_determined():
    text = publication_table(symmetric_fit("A B DJ DJK"))
    row = {line.split()[0]: line for line in text.splitlines() if line.strip()}
    assert "(not determined)" in row["A"]
    assert "(held)" in row["DK"]
    assert "nan" not in text
    assert "inf" not in text


def test_the_covariance_of_the_others_is_written(folder):
    fit, held = symmetric_fit("A B DJ DJK"), symmetric_fit("B DJ DJK")
    computed = determined_covariance(fit.parameters, fit.statistics)
    assert computed.matrix_mhz2 == pytest.approx(held.covariance.matrix_mhz2, rel=1e-6)
    write_assigned_lines(symmetric_lines(), "lines.csv")
    answer = answer_fit(lines_request("lines.csv", Top.from_constants(SYMMETRIC), ["A", "B", "DJ", "DJK"]))
    write_fitted_toml(answer, "fitted.toml")
    content = tomllib.loads((folder / "fitted.toml").read_text())
    assert content["covariance"]["names"] == ["B", "DJ", "DJK"]
    assert "not determined by these lines and left at the start: A" in content["constants"]["source"]
    assert content["constants"]["A"] == 9000.0
    assert rotor.read("fitted.toml").covariance.names == ("B", "DJ", "DJK")
