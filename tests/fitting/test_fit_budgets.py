"""Error budgets of fits: constants in standard errors, predicted frequencies in MHz, with a confidence that is met."""

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtri, stdtrit
from stated_bounds import fit_problem

from rotor.fitting.assignment import assignments
from rotor.fitting.budgets import NORMAL, confidence_text, constants_budget, predictions_budget, student_quantile
from rotor.fitting.fit import fit_lines
from rotor.fitting.parameters import parameters
from rotor.tops.constants.constants import Constants

CO = Constants(B=57635.968, D=0.1835)


def co_lines(rng, sigma=0.01, count=8):
    j = np.arange(count)
    true = 2 * CO["B"] * (j + 1) - 4 * CO["D"] * (j + 1) ** 3
    return true, assignments(("j",), (j + 1)[:, None], j[:, None], true + sigma * rng.normal(size=count), sigma)


def test_the_confidence_is_met():
    """Constants and predictions of 300 fits within 1.96 standard errors, as often as 95 % within four standard deviations."""
    inside, predicted = [], []
    for seed in range(300):
        true, lines = co_lines(np.random.default_rng([27, seed]))
        fit = fit_lines(lines, CO, parameters(CO, ["B", "D"]))
        inside.append(np.abs(fit.values - [CO["B"], CO["D"]]) <= 1.96 * fit.errors)
        predicted.append(np.abs(fit.calculated_mhz - true) <= 1.96 * fit.calculated_errors_mhz)
    within = 4 * math.sqrt(0.05 * 0.95 / 300)
    assert np.mean(inside) == pytest.approx(0.95, abs=within)
    assert np.mean(predicted) == pytest.approx(0.95, abs=within)
    assert "1.96 times this, 2.45 times" in constants_budget(fit).data.source  # Student's t of 6 degrees of freedom


def test_constants_and_predictions_have_the_same_terms():
    fit = fit_lines(co_lines(np.random.default_rng(1))[1], CO, parameters(CO, ["B", "D"]))
    constants, lines = constants_budget(fit), predictions_budget(fit)
    sigma = fit.calculated_errors_mhz.max()
    assert (constants.unit, lines.unit) == ("standard errors", "MHz")
    assert lines.data.value == pytest.approx(sigma)
    assert lines.truncation.value == pytest.approx(sigma * constants.truncation.value)
    assert constants.statistics.value == pytest.approx(1 / math.sqrt(2 * fit.degrees_of_freedom))
    assert constants.model.value == lines.model.value == 0.0
    assert constants.model.source.startswith(
        f"no misfit: reduced chi {fit.reduced_chi:.3g}; its scatter would hide one"
    )
    assert "left out" not in lines.line()


def test_a_model_that_misses_the_lines_is_the_largest_error():
    """B alone for lines with distortion."""
    rigid = Constants(B=57635.968)
    fit = fit_lines(co_lines(np.random.default_rng(2))[1], rigid, parameters(rigid, ["B"]))
    assert next(iter(dict(constants_budget(fit).shown()))) == "left out"
    assert constants_budget(fit).model.value == pytest.approx(fit.reduced_chi, rel=1e-3)


def test_a_misfit_is_stated_where_it_is_significant():
    """Of 300 fits of the right model one in 40 by chance; with lines off by 1.5 errors more, in most."""
    stated = {0.0: [], 1.5: []}
    for extra, terms in stated.items():
        for seed in range(300):
            rng = np.random.default_rng([28, seed])
            lines = co_lines(rng, count=30)[1]
            off = replace(lines, frequency_mhz=lines.frequency_mhz + 0.01 * extra * rng.normal(size=30))
            budget = predictions_budget(fit_lines(off, CO, parameters(CO, ["B", "D"])))
            terms.append(budget.model.value)
    assert (
        np.mean(np.array(stated[0.0]) > 0) < 0.07
    )  # χ² of 28 degrees of freedom is above its mean by two deviations in 3.6 %
    assert np.mean(np.array(stated[1.5]) > 0) > 0.95
    assert np.median(stated[1.5]) == pytest.approx(0.015, rel=0.2)  # MHz


def test_what_nothing_checks_is_not_estimated():
    """As many lines as constants; and a constant that no line depends on."""
    lines = co_lines(np.random.default_rng(3), count=2)[1]
    budget = constants_budget(fit_lines(lines, CO, parameters(CO, ["B", "D"])))
    assert budget.model.value is None
    assert budget.statistics.value is None
    assert budget.data.value == 1.0
    assert confidence_text(0).endswith("within 1.96 times this")
    alone = co_lines(np.random.default_rng(3), count=1)[1]
    with pytest.raises(ValueError, match="free"):
        fit_lines(alone, CO, parameters(CO, ["B", "D"]))


def test_the_interval_of_students_t_is_that_of_scipy_as_printed():
    assert pytest.approx(ndtri(0.975), rel=1e-15) == NORMAL  # round-off
    for free in (*range(1, 300), 5_000, 10**6):
        assert f"{student_quantile(free):.3g}" == f"{stdtrit(free, 0.975):.3g}"


def test_a_fit_loads_no_scipy(tmp_path):
    """Loading it takes longer than most fits."""
    (tmp_path / "co.csv").write_text(
        "j_upper,j_lower,frequency_mhz,error_mhz\n1,0,115271.2,0.1\n2,1,230538.0,0.1\n3,2,345796.0,0.1\n"
    )
    command = ["fit", str(tmp_path / "co.csv"), "--constants", "B=57636 D=0.18 MHz", "--free", "B,D"]
    code = f"import sys; from rotor.cli import run; assert run({command!r}) == 0; assert 'scipy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL, cwd=tmp_path)


def test_a_fit_that_begins_at_its_result_stays_there():
    """Predictions move by no more than their stated numerical errors."""
    lines, start, names = fit_problem(np.random.default_rng(5))
    fit = fit_lines(lines, start, parameters(start, names))
    again = fit_lines(lines, fit.constants, parameters(fit.constants, names))
    moved = np.abs(again.calculated_mhz - fit.calculated_mhz)
    assert moved.max() <= predictions_budget(fit).numerical + predictions_budget(again).numerical
    assert predictions_budget(fit).rounding.value < 1e-6
