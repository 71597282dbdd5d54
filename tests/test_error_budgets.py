"""Error budgets: five sources of error of a result, each a number or a reason."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.quantum.estimates.beyond import Limit
from rotor.quantum.estimates.budgets import ROUNDING, model_term
from rotor.quantum.request import LevelsRequest, answer_levels
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.spectra.request import SpectrumRequest, answer_spectrum
from rotor.tops.constants import Constants
from rotor.tops.top import Top

EXACT = ErrorTerm(0.0, "exact")
BUDGET = ErrorBudget(
    "energies",
    "MHz",
    ErrorTerm(1e-9, "eigenvalues"),
    ErrorTerm(2e-6, "J max 9"),
    EXACT,
    ErrorTerm(3.0, "B"),
    ErrorTerm(4.0, "64 runs"),
)


def test_the_total_adds_bounds_and_joins_standard_deviations():
    assert BUDGET.numerical == pytest.approx(2.001e-6)
    assert BUDGET.total == pytest.approx(5.0 + 2.001e-6)
    assert replace(BUDGET, data=ErrorTerm(None, "unknown")).total is None


def test_the_largest_term_comes_first_and_json_comes_back():
    assert [name for name, _ in BUDGET.shown()] == ["statistics", "data", "numerical"]
    unknown = replace(BUDGET, model=ErrorTerm(None, "no geometry", "a geometry"))
    assert ErrorBudget.from_json(json.loads(json.dumps(unknown.as_json()))) == unknown
    assert unknown.line().endswith("left out not estimated: no geometry")


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_impossible_errors_are_refused(value):
    with pytest.raises(ValueError, match="expected a finite number of at least 0"):
        ErrorTerm(value, "eigenvalues")
    with pytest.raises(ValueError, match="without its source"):
        ErrorTerm(1.0, "")


def test_a_model_without_sizes_is_not_exact():
    assert model_term([]).value is None
    assert model_term([Limit("electron spin", None, "")]).value is None
    assert model_term([Limit("a", 1.0, ""), Limit("b", 3.0, "")]).value == 4.0


def test_data_are_the_errors_of_the_strong_lines():
    """σ(ν) = 2(J+1) σ(B) of a linear molecule; lines below a tenth of the strongest do not count."""
    top = Top(Constants(B=6000.0, uncertainties={"B": 2.0}), (1.0, 0.0, 0.0))
    answer = answer_spectrum(SpectrumRequest(top, temperature_k=5.0))
    lines = answer.lines
    strong = lines.intensity_nm2_mhz >= 0.1 * lines.intensity_nm2_mhz.max()
    assert answer.errors.data.value == pytest.approx(2.0 * lines.frequency_mhz[strong].max() / 6000.0)
    assert answer.errors.data.value < 2.0 * lines.frequency_mhz.max() / 6000.0
    levels = answer_levels(LevelsRequest(top, jmax=4)).errors
    assert levels.data.value == pytest.approx(2.0 * 20)  # σ(B) J(J+1)


def test_rounding_is_a_bound():
    """Levels of a heavy asymmetric top against the same in extended precision: sums of levels of one J are linear in A, B, C."""
    top = Top.from_constants("A=3000.1 B=1000.3 C=900.7 MHz")
    levels = rotor.api.solve_levels(top, 60)
    for j in (10, 60):
        total = (3000.1 + 1000.3 + 900.7) * j * (j + 1) * (2 * j + 1) / 3  # trace of H over the 2J + 1 states
        assert (
            abs(math.fsum(levels.energy_mhz[levels.quanta["j"] == j].tolist()) - total)
            <= (2 * j + 1) * ROUNDING * np.abs(levels.energy_mhz).max()
        )


def test_spins_by_an_approximate_method_count_in_the_truncation():
    from rotor.quantum.effects.of_top import effects_of

    top = rotor.read("HCN")
    exact, first = (
        answer_levels(LevelsRequest(top, jmax=2, effects=effects_of(top, True, method))).errors
        for method in ("exact", "first-order")
    )
    assert exact.truncation.value == 0.0
    assert first.truncation.value > 0.0
    assert "first-order" in first.truncation.source


def test_an_accuracy_is_compared_with_the_whole_budget(call, folder):
    (folder / "s.toml").write_text(
        'schema = 1\nkind = "spectrum"\nmolecule = "SMILES:CC(Cl)C#N"\naccuracy = "1 kHz"\n[conditions]\ntemperature = "5 K"\n'
    )
    code, out, _ = call("run", "s.toml")
    text = " ".join(out[out.index("accuracy ") :].split())
    assert code == 0
    assert "reached" not in text
    assert text.startswith("accuracy 0.001 MHz: numerical error at most")
    assert "left out about" in text
    assert "(error of the geometry" in text
    assert text.endswith("measured constants would lower it")


@pytest.mark.parametrize("verb", ["spectrum", "levels", "raman"])
def test_report_table_and_json_have_the_same_numbers(call, verb):
    given = ("HCN", "--polarizability", "3,2") if verb == "raman" else ("HCN",)
    code, out, _ = call(verb, *given, "--errors")
    assert code == 0
    budget = ErrorBudget.from_json(json.loads(call(verb, *given, "--json", "-")[1])["errors"])
    joined = " ".join(out.split())
    assert "errors " + budget.line().removeprefix("errors ") in joined
    assert f"model {budget.model.value:.2g} MHz, size, within a factor of 3: {budget.model.source}" in joined
