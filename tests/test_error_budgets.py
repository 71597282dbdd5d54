"""Error budgets: five sources of error of a result, each a number or a reason."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.quantum.estimates.beyond import Limit
from rotor.quantum.estimates.budgets import ROUNDING, model_term
from rotor.quantum.estimates.limits import every_limit, populated_j
from rotor.quantum.request import LevelsRequest, answer_levels
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.spectra.request import SpectrumRequest, answer_spectrum
from rotor.thermodynamics.request import ThermoRequest, answer_thermo
from rotor.thermodynamics.vibration import VibrationalStates
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


VERBS = {
    "spectrum": ("HCN",),
    "levels": ("HCN",),
    "raman": ("HCN", "--polarizability", "3,2"),
    "stark": ("OCS", "--field", "0:20kV/cm:3"),
    "zeeman": ("OCS", "--g=-0.0287", "--field", "0:1T:3"),
    "thermo": ("CO", "--temperature", "20,100", "--vibration", "2143"),
}


@pytest.mark.parametrize("verb", VERBS)
def test_report_table_and_json_have_the_same_numbers(call, verb):
    code, out, _ = call(verb, *VERBS[verb], "--errors")
    assert code == 0
    budget = ErrorBudget.from_json(json.loads(call(verb, *VERBS[verb], "--json", "-")[1])["errors"])
    joined = " ".join(out.split())
    assert "errors " + budget.line().removeprefix("errors ") in joined
    size = f"{budget.model.value:.2g} {budget.unit}".rstrip()
    assert f"model {size}, size, within a factor of 3: {budget.model.source}" in joined


def test_a_static_field_polarizes_as_light_of_its_intensity_does():
    """½ α F² is the energy in light of the intensity c ε0 F², whose field is F in the root mean square."""
    from rotor.quantum.effects.stark import MHZ_ANGSTROM3_W_PER_CM2
    from rotor.quantum.fields.budgets import MHZ_PER_ANGSTROM3

    w_per_cm2 = units.SPEED_OF_LIGHT_M_PER_S * units.VACUUM_PERMITTIVITY_F_PER_M * 1e10 * 1e-4
    assert math.isclose(MHZ_PER_ANGSTROM3, MHZ_ANGSTROM3_W_PER_CM2 * w_per_cm2, rel_tol=1e-9)  # digits of ε0


def test_the_error_of_an_estimated_dipole_is_that_of_the_energies():
    """Against energies with a dipole that is larger by a thousandth."""
    from rotor.quantum.fields.budgets import ESTIMATED_DIPOLE_D
    from rotor.quantum.fields.stark_request import StarkRequest, answer_stark

    def energies(scale):
        dipole = tuple(scale * x for x in (1.0, 0.5, 0.0))
        top = Top(Constants(A=20000.0, B=6000.0, C=5000.0), dipole, dipole_source="estimate from charges")
        return answer_stark(StarkRequest(top, (0.0, 20.0), j_highest=1))

    answer = energies(1.0)
    moved = np.abs(energies(1.001).states.energy_mhz - energies(0.999).states.energy_mhz).max() / 0.002
    sigma = moved * ESTIMATED_DIPOLE_D / math.hypot(1.0, 0.5)
    assert answer.errors.data.value is None  # the constants have no uncertainties
    assert f"{sigma:.2g} MHz" in answer.errors.data.source


def test_maps_state_their_bounds_and_the_unknown_moments():
    from rotor.quantum.fields.stark_request import StarkRequest, answer_stark

    answer = answer_stark(StarkRequest(rotor.read("OCS"), (0.0, 50.0)))
    assert answer.errors.numerical == pytest.approx(answer.states.accuracy_mhz, rel=0.5)
    assert answer.errors.numerical >= answer.states.accuracy_mhz
    assert answer.errors.data.source.startswith("the dipole has no stated uncertainty; constants: covariance of B")
    free = answer_stark(StarkRequest(rotor.read("OCS"), (0.0,)))
    assert free.errors.data.value > 0.0
    assert "polarization" not in free.errors.model.source


@pytest.mark.parametrize(
    ("kind", "constants"), [("linear", {"B": 6000.0}), ("asymmetric", {"A": 20000.0, "B": 6000.0, "C": 5000.0})]
)
def test_the_data_of_q_are_its_derivatives(kind, constants):
    """Against Q with each constant moved by its standard deviation; an asymmetric top at 300 K is classical within 1 %."""
    sigma = {name: 0.001 * value for name, value in constants.items()}

    def partition(**moved):
        top = Top(Constants(**(constants | moved), uncertainties=sigma), (1.0, 0.0, 0.0))
        return answer_thermo(ThermoRequest(top, (300.0,)))

    assert partition().request.top.kind == kind
    shifts = [
        np.log(partition(**{n: constants[n] + sigma[n]}).functions.q_rot / partition().functions.q_rot) for n in sigma
    ]
    assert partition().errors.data.value == pytest.approx(math.hypot(*(float(x[0]) for x in shifts)), rel=0.01)


def test_the_model_of_q_is_the_error_of_the_geometry():
    """Q of a bent molecule goes as (ABC)^-1/2: a geometry that is off by r makes it wrong by 3r/2."""
    top = rotor.read("SMILES:CC(Cl)C#N")
    relative = top.molecule.uncertainty
    with_vibration = answer_thermo(ThermoRequest(top, (300.0,), vibrations=VibrationalStates.parse("200")))
    limits = {one.name: one.size_mhz for one in every_limit(top, populated_j(top, 300.0), with_vibration.effects)}
    share = limits["error of the geometry"] / sum(size for size in limits.values() if size)
    assert with_vibration.errors.model.value * share == pytest.approx(1.5 * relative, rel=0.5)
    assert answer_thermo(ThermoRequest(top, (300.0,))).errors.model.source == "vibration is left out"


def test_numerical_errors_of_q_are_bounds():
    """Against sums to 1e-12."""
    top = Top.from_constants("A=20000 B=6000 C=5000 MHz")
    for relative_error in (1e-2, 1e-4, 1e-6):
        answer = answer_thermo(ThermoRequest(top, (3.0, 30.0), relative_error=relative_error))
        exact = answer_thermo(ThermoRequest(top, (3.0, 30.0), relative_error=1e-12))
        actual = np.abs(answer.functions.q_rot / exact.functions.q_rot - 1).max()
        assert 0.0 < actual <= answer.errors.numerical <= 2 * relative_error
