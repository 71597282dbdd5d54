"""Error budgets: five sources of error of a result, each a number or a reason."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.alignment.budgets import cosine_model_error
from rotor.classical.free.free_motion import free_motion
from rotor.classical.tumble import TumbleRequest, answer_tumble
from rotor.geometry.rotations import distance
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.budgets import model_term
from rotor.quantum.estimates.limits import Limit
from rotor.quantum.estimates.splittings import line_components
from rotor.quantum.request import LevelsRequest, answer_levels
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm, size_text
from rotor.spectra.emission.budget import steepness
from rotor.spectra.request import SpectrumRequest, answer_spectrum
from rotor.thermodynamics.request import ThermoRequest, answer_thermo
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_constants import SpinConstants
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


def test_what_rounding_hides_is_not_printed_and_a_reason_stands_once():
    hidden = replace(BUDGET, model=ErrorTerm(9e-10, "a shift"), data=EXACT, statistics=EXACT)
    assert hidden.line() == "errors of energies: numerical 2e-06 MHz"
    assert replace(hidden, model=ErrorTerm(1.1e-9, "a shift")).line().endswith("left out about 1.1e-09 MHz (a shift)")
    unknown = ErrorTerm(None, "no moments")
    several = replace(hidden, rounding=unknown, model=unknown, data=unknown)
    assert several.line() == "errors of energies: numerical, left out, data not estimated: no moments"


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
    assert "data 1.6 GHz is larger (estimated constants: estimated errors of A, B, C" in text
    assert text.endswith("measured constants would lower it")


VERBS = {
    "spectrum": ("HCN",),
    "levels": ("HCN",),
    "raman": ("HCN", "--polarizability", "3,2"),
    "stark": ("OCS", "--field", "0:20kV/cm:3"),
    "zeeman": ("OCS", "--g=-0.0287", "--field", "0:1T:3"),
    "thermo": ("CO", "--temperature", "20,100", "--vibration", "2143"),
    "align": ("CO", "--polarizability", "2.3,1.8", "--pulse", "1e13 W/cm2, 0.1 ps", "--temperature", "5"),
    "emission": ("CO", "--range", "115:116GHz", "--excitation", "20", "--column", "1e16"),
    "gas": ("HCl", "--molecules", "500"),
    "tumble": ("water",),
    "fluid": (
        "argon",
        "--model",
        "argon",
        "--molecules",
        "27",
        "--density",
        "1.2",
        "--cutoff",
        "4",
        "--steps",
        "20",
        "--every",
        "2",
    ),
}


@pytest.mark.parametrize("verb", VERBS)
def test_report_table_and_json_have_the_same_numbers(call, verb):
    table = () if verb == "tumble" else ("--errors",)  # tumble has the line alone
    code, out, _ = call(verb, *VERBS[verb], *table)
    assert code == 0
    budget = ErrorBudget.from_json(json.loads(call(verb, *VERBS[verb], "--json", "-")[1])["errors"])
    joined = " ".join(out.split())
    assert "errors " + budget.line().removeprefix("errors ") in joined
    if table:
        size = f"{budget.model.value or 0:.2g} {budget.unit}".rstrip()
        text = "not estimated" if budget.model.value is None else f"{size}, size, within a factor of 3"
        assert f"model {text}: {budget.model.source}" in joined


def test_a_static_field_polarizes_as_light_of_its_intensity_does():
    """½ α F² is the energy in light of the intensity c ε0 F², whose field is F in the root mean square."""
    from rotor.quantum.effects.stark import MHZ_ANGSTROM3_W_PER_CM2, MHZ_PER_ANGSTROM3

    w_per_cm2 = units.SPEED_OF_LIGHT_M_PER_S * units.VACUUM_PERMITTIVITY_F_PER_M * 1e10 * 1e-4
    assert math.isclose(MHZ_PER_ANGSTROM3, MHZ_ANGSTROM3_W_PER_CM2 * w_per_cm2, rel_tol=1e-9)  # digits of ε0


def test_the_error_of_an_estimated_dipole_is_that_of_the_energies():
    """Against energies with a dipole that is larger by a thousandth."""
    from rotor.quantum.effects.stark import ESTIMATED_DIPOLE_D, StarkRequest, answer_stark

    def energies(scale):
        dipole = tuple(scale * x for x in (1.0, 0.5, 0.0))
        top = Top(Constants(A=20000.0, B=6000.0, C=5000.0), dipole, dipole_source="estimate from charges")
        return answer_stark(StarkRequest(top, (0.0, 20.0), j_highest=1))

    answer = energies(1.0)
    moved = np.abs(energies(1.001).states.energy_mhz - energies(0.999).states.energy_mhz).max() / 0.002
    sigma = moved * ESTIMATED_DIPOLE_D / math.hypot(1.0, 0.5)
    assert answer.errors.data.value is None  # the constants have no uncertainties
    assert size_text(sigma, "MHz") in answer.errors.data.source


def test_maps_state_their_bounds_and_the_unknown_moments():
    from rotor.quantum.effects.stark import StarkRequest, answer_stark

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


def test_the_error_of_q_of_a_geometry_is_that_of_its_constants():
    """Q of a bent molecule goes as (ABC)^-1/2: constants that are off by r each, alone, make it wrong by √3 r/2."""
    top = rotor.read("SMILES:CC(Cl)C#N")
    answer = answer_thermo(ThermoRequest(top, (300.0,)))
    assert answer.errors.data.value == pytest.approx(math.sqrt(3) / 2 * top.molecule.uncertainty, rel=1e-3)
    assert answer.errors.data.source == "estimated errors of A, B, C"
    assert answer.errors.model.source == "vibration is left out"


def test_numerical_errors_of_q_are_bounds():
    """Against sums to 1e-12."""
    top = Top.from_constants("A=20000 B=6000 C=5000 MHz")
    for relative_error in (1e-2, 1e-4, 1e-6):
        answer = answer_thermo(ThermoRequest(top, (3.0, 30.0), relative_error=relative_error))
        exact = answer_thermo(ThermoRequest(top, (3.0, 30.0), relative_error=1e-12))
        actual = np.abs(answer.functions.q_rot / exact.functions.q_rot - 1).max()
        assert 0.0 < actual <= answer.errors.numerical <= 2 * relative_error


def test_the_errors_of_cosines_are_bounds():
    """Against the same cosines with a tolerance of 1e-9; and phases after a time against constants that are off."""
    from rotor.alignment.pulse import GaussianPulse
    from rotor.alignment.request import AlignRequest, answer_align

    def cosines(b=6000.0, tolerance=1e-9):
        top = Top.from_constants(f"B={b} MHz", polarizability_abc_angstrom3=((8, 0, 0), (0, 4, 0), (0, 0, 4)))
        return answer_align(
            AlignRequest(top, (GaussianPulse(1e13, 0.05),), 2.0, tolerance=tolerance, until_ps=80.0, points=301)
        )

    exact = cosines()
    for tolerance in (1e-2, 1e-4):
        answer = cosines(tolerance=tolerance)
        actual = np.abs(answer.trace.cosines["cos2theta"] - exact.trace.cosines["cos2theta"]).max()
        assert actual <= answer.errors.numerical <= 3 * tolerance
    shifted = np.abs(cosines(6000.6).trace.cosines["cos2theta"] - exact.trace.cosines["cos2theta"]).max()
    j = max(exact.trace.ensemble.jmax, 1)
    left_out = cosine_model_error(exact.trace, [Limit("error of B", 0.6 * 2 * (j + 1), "")])
    assert shifted / 3 <= left_out.value <= 3 * shifted


def test_the_slope_of_a_line_is_bounded():
    """1 - exp(-τ0 exp(-4 ln 2 x²)) against its steepest slope on a grid, thin to thick."""
    x = np.linspace(-4, 4, 40_001)
    for depth in (1e-6, 0.1, 1.0, 3.0, 100.0, 1e6):
        slope = np.abs(np.gradient(-np.expm1(-depth * np.exp(-4 * math.log(2) * x**2)), x)).max()
        assert slope <= steepness(depth) * (1 + 1e-6) <= 3 * slope  # of the differences of the grid


def test_brightness_moves_as_its_budget_says():
    """A line whose frequency is off by a tenth of its width, seen at one frequency, against the shift that the budget allows."""
    from rotor.spectra.emission.request import EmissionRequest, Source, answer_emission

    def answer(b):
        co = Top.from_constants(f"B={b} MHz", dipole_abc_debye=(0.11011, 0, 0), name="CO")
        return answer_emission(EmissionRequest((co,), (Source(1e16, 20.0, 1.0),), (115.2e3, 115.4e3)))

    here, width = answer(57635.968), 115272.0 * 1.0 / 299792.458
    away = answer(57635.968 + 0.05 * width)
    grid = here.spectrum.frequency_mhz
    moved = np.abs(
        np.interp(grid, away.spectrum.frequency_mhz, away.spectrum.brightness_k) - here.spectrum.brightness_k
    ).max()
    opaque = here.peak.brightness_k / -math.expm1(-here.peak.optical_depth)
    assert moved <= 0.1 * opaque * steepness(here.peak.optical_depth) <= 3 * moved
    assert here.errors.numerical <= 1e-4 * here.peak.brightness_k


@pytest.mark.parametrize(
    ("name", "range_mhz", "width"),
    [
        ("HCN", (88e3, 89e3), 1.0),
        ("HCN", (88e3, 89e3), 30.0),
        ("HCN", (265e3, 266e3), 1.0),
        ("CH3CN", (18e3, 19e3), 10.0),
    ],
)
def test_a_quadrupole_that_is_left_out_takes_brightness_from_the_centre(name, range_mhz, width):
    """At the centre of the brightest line, against the whole calculation with spins: the size holds within a factor of 1.5."""
    from rotor.spectra.emission.emission import emission
    from rotor.spectra.emission.request import EmissionRequest, Source, answer_emission

    source, top = Source(1e14, 20.0, width), rotor.read(name)
    answer = answer_emission(EmissionRequest((top,), (source,), range_mhz))
    split = answer_emission(EmissionRequest((top,), (source,), range_mhz, effects=(effects_of(top, True),)))
    there = emission(split.emitted[0], source, [answer.peak.observed_mhz]).brightness_k[0]
    lost = answer.peak.brightness_k - float(there)
    assert lost / 1.5 < answer.errors.model.value < 1.5 * lost + 1e-3 * answer.peak.brightness_k
    assert "nuclear quadrupole" in answer.errors.model.source


def test_the_quadrupole_of_a_line_of_high_j_is_inside_its_width():
    """HC3N 10 - 9 at 1 km/s: its strong components are 0.02 MHz apart, the width is 0.3 MHz."""
    from rotor.spectra.emission.request import EmissionRequest, Source, answer_emission

    answer = answer_emission(EmissionRequest((rotor.read("HC3N"),), (Source(1e14, 100.0, 1.0),), (80e3, 100e3)))
    assert answer.errors.model.value < 0.05 * answer.peak.brightness_k


def test_components_of_a_line_have_their_mean_at_its_centre():
    for twice_spin, upper, lower, k in ((2, 1, 0, 0), (3, 4, 3, 2), (5, 5, 5, 3), (7, 2, 3, 1)):
        shifts, parts = line_components(twice_spin, upper, lower, k)
        assert parts @ shifts == pytest.approx(0.0, abs=1e-14)


def test_the_temperature_of_a_gas_scatters_as_stated():
    """Temperatures of 200 gases: their standard deviation against the stated one, and the coverage of the confidence."""
    from rotor.thermodynamics.gas.classical_gas import GasRequest, answer_gas

    top, computed = Top.from_constants("A=10 B=6 C=4 GHz"), []
    for seed in range(200):
        answer = answer_gas(GasRequest(top, molecules=100, seed=seed, confidence=0.9))
        computed.append(300.0 * np.mean([degree.mean for degree in answer.test.degrees]) - 300.0)
    stated = answer.errors.statistics.value
    assert np.std(computed) == pytest.approx(stated, rel=0.2)  # four standard errors of a deviation of 200
    assert "within 1.64 times" in answer.errors.statistics.source
    assert abs(np.mean(np.abs(computed) <= 1.645 * stated) - 0.9) < 4 * math.sqrt(0.9 * 0.1 / 200)


def test_the_steps_of_a_fluid_are_counted_about_the_mean():
    from rotor.fluids.budgets import temperature_budget
    from rotor.fluids.record import FluidRecord
    from rotor.fluids.settings import Settings
    from rotor.fluids.summary import Mean

    total = np.array([1.0, 1.3, 1.1, 1.4])
    flat = np.full(4, 300.0)
    record = FluidRecord(np.arange(4.0), total, total, total, total, flat, flat, flat, flat)
    budget = temperature_budget(record, Settings(every=1), 6.0, 1, [Mean("temperature", "K", 300.0, 5.0, 4.0)])
    assert budget.truncation.value == pytest.approx(2 * 0.2 / (6 * units.EV_PER_K))
    assert "about its mean" in budget.truncation.source
    sparse = temperature_budget(record, Settings(), 6.0, 1, [Mean("temperature", "K", 300.0, 5.0, 4.0)])
    assert sparse.truncation.value > budget.truncation.value  # steps between the rows
    assert budget.statistics.value == 5.0
    few = Mean("temperature", "K", 300.0, math.nan, math.nan)
    assert temperature_budget(record, Settings(), 6.0, 1, [few]).statistics.value is None


SEPARATRIX = ((1.0, 2.0, 3.0), (1.0, 0.3, math.sqrt(3.0) * (1 + 1e-13)))


def test_attitudes_are_within_their_bound():
    """A symmetric top against its body angle (1/I1 - 1/I3) L3 t, and a body near the separatrix against powers of one period."""
    answer = answer_tumble(TumbleRequest((1.0, 1.0, 2.0), (0.375, 0.0, 0.875), times=(0.0, 2.0**20)))
    cosine = answer.table.momentum[-1, 0] / 0.375
    spin = 2.0**20 * 0.875 * 0.5  # exact in binary
    assert cosine == pytest.approx(math.cos(spin), abs=answer.errors.rounding.value)
    assert answer.errors.rounding.value < 1e-14


def test_the_phase_of_flips_follows_from_the_last_digits():
    """Periods of bodies whose data differ by one unit in the last place, against the stated error of the phase."""
    from rotor.classical.free.budget import flip_phase_error

    for moments, momentum in (SEPARATRIX, ((1.0, 2.0, 3.0), (1.0, 0.3, 1.8))):
        answer = answer_tumble(TumbleRequest(moments, momentum, times=(0.0, 1e3)))
        period, moved = float(answer.motion.period), 0.0
        for place in range(3):
            others = [list(moments), list(momentum)]
            for numbers in others:
                original, numbers[place] = numbers[place], math.nextafter(numbers[place], 9.0)
                other = answer_tumble(TumbleRequest(tuple(others[0]), tuple(others[1]), times=(0.0,)))
                moved = max(moved, abs(float(other.motion.period) - period))
                numbers[place] = original
        stated = flip_phase_error(period, 1e3, answer.stability.growth_rate)
        actual = 2 * math.pi * 1e3 * moved / period**2
        assert actual / 3 <= stated <= 3 * actual


@pytest.mark.parametrize("moments", [(1.0, 2.0, 2.5), (1.0, 2.0, 2.0), (0.0, 2.0, 2.0)])
def test_errors_of_moments_move_the_attitude_as_drawn_moments_do(moments):
    from rotor.classical.free.budget import moments_error

    rng, momentum, relative = np.random.default_rng(2), [0.0, 1.2, 0.9], np.array([2e-6, 1e-6, 1e-6])
    motion, squares = free_motion(moments, momentum), []
    for _ in range(400):
        drawn = np.array(moments) * (1 + relative * rng.normal(size=3))
        drawn = np.where(np.array(moments) == moments[1], drawn[1], drawn)  # equal moments stay equal
        squares.append(float(distance(free_motion(drawn, momentum).at([40.0])[1][0], motion.at([40.0])[1][0])) ** 2)
    assert moments_error(motion, 40.0, relative) == pytest.approx(math.sqrt(np.mean(squares)), rel=0.12)


def test_a_tumbling_molecule_has_the_error_of_its_constants():
    """ω = 4πB L/ħ of a linear molecule: 6 MHz, 20 ħ and 1 ps; without an error of B there is no estimate."""
    given = rotor.tumble(constants="B=6000.0(60) MHz", angular_momentum=[0, 20, 0], times="0,1")
    assert given.errors.data.value == pytest.approx(4 * math.pi * 6e6 * 20 * 1e-12, rel=1e-3)
    assert rotor.tumble(constants="B=6000 MHz").errors.data.value is None
    assert (
        rotor.tumble("SMILES:CCO", times="0,1000").errors.data.value == math.pi
    )  # good to 1.2 %: lost after some turns


def test_a_scene_near_the_separatrix_runs(call, folder):
    """1 - k² of about 1e-13 and t = 1e13: right about L; what cannot be known there, the phase of the flips, is said."""
    moments, momentum = SEPARATRIX
    (folder / "s.toml").write_text(
        f'schema = 1\nkind = "tumble"\naccuracy = "1e-6 rad"\n[body]\nmoments = {list(moments)}\n'
        f"angular_momentum = {list(momentum)}\n[conditions]\ntimes = [0.0, 1e13]\n"
    )
    for verb in ("plan", "run"):
        code, out, err = call(verb, "s.toml")
        assert code == 0, err
    assert "numerical error at most 7.2e-15 rad" in " ".join(out.split())
    free = answer_tumble(TumbleRequest(moments, momentum, times=(0.0, 1e13)))
    assert free.errors.data.source.startswith("the phase of the flips is not known")
    assert answer_tumble(TumbleRequest(moments, momentum, times=(0.0, 10.0))).errors.data.source.startswith("moments")


RIGID = '[molecule]\nconstants = "B=6000(1) D=0.001 MHz"\n[observables]\njmax = 3\n'


@pytest.mark.parametrize(
    ("body", "accuracy", "says"),
    [
        (RIGID, '{ total = "100 MHz" }', ""),
        (
            RIGID,
            '{ total = "1 MHz" }',
            "accuracy.total: 1 MHz cannot be given: the total is 12 MHz; data 12 MHz is larger",
        ),
        (RIGID, '"1 kHz"', ""),
        (
            'molecule = "SMILES:CC(Cl)C#N"\n',
            '{ total = "1 MHz" }',
            "is larger (estimated constants: estimated errors of A, B, C, uncorrelated",
        ),
        (RIGID, '{ totl = "1 MHz" }', "totl"),
    ],
)
def test_the_accuracy_of_the_total_is_refused_where_it_cannot_be_given(call, folder, body, accuracy, says):
    """σ(E) of J = 3 is 12 σ(B)."""
    text = f'schema = 1\nkind = "levels"\naccuracy = {accuracy}\n' + body + '[outputs]\ncsv = "l.csv"\n'
    (folder / "s.toml").write_text(text)
    code, _, err = call("run", "s.toml")
    assert code == (2 if says else 0), err
    assert says in " ".join(err.split())
    assert (folder / "l.csv").exists() == (not says)


def test_the_electron_spin_of_oxygen_has_a_size():
    """λ of a triplet, 59.5 GHz, within a factor of 3 of the splitting of N = 1 that the spin constants make."""
    answer = answer_levels(LevelsRequest(rotor.read("O2"), jmax=3))
    sizes = {limit["name"]: limit["size_mhz"] for limit in answer.facts()["limits"]}
    spins = SpinConstants.parse("lambda(S)=59501.3 gamma(S)=-252.6 MHz", "S=1")
    split = Top.from_constants("B=43100.44 MHz", spin_constants=spins)
    levels = rotor.api.solve_levels(split, 1, effects=effects_of(split, True))
    widest = np.ptp(levels.energy_mhz[levels.rotational == 1])
    assert widest / 3 <= sizes["electron spin"] <= 3 * widest
    assert answer.errors.model.value > 5e4


DRIVEN = (
    'schema = 1\nkind = "tumble"\n[body]\nmoments = [1.0, 2.0, 2.5]\nangular_velocity = [1.0, 2.0, 3.0]\n[[effects]]\n'
    'effect = "linear drag"\ncoefficients = [0.1, 0.1, 0.1]\n[conditions]\ntimes = "0:5:6"\n'
)


def test_a_driven_motion_has_a_budget(call, folder):
    """Its total is refused, since its model and data are not estimated, in the words of `run`, by `plan` as well."""
    (folder / "s.toml").write_text(DRIVEN)
    code, out, _ = call("run", "s.toml")
    assert code == 0
    assert "errors" in out
    (folder / "t.toml").write_text(
        DRIVEN.replace('kind = "tumble"\n', 'kind = "tumble"\naccuracy = { total = "1e-6 rad" }\n')
    )
    code, _, err = call("run", "t.toml")
    assert code == 2
    assert (
        "accuracy.total: 1e-06 rad cannot be given: left out not estimated: a rigid body under the effects"
        in " ".join(err.split())
    )


def test_steps_that_are_not_made_a_second_time_are_not_estimated(monkeypatch):
    from rotor.classical import step_errors
    from rotor.classical.driven import DrivenRequest, answer_driven
    from rotor.classical.effects.drag import LinearDrag

    monkeypatch.setattr(step_errors, "MOST_STEPS", 3)
    request = DrivenRequest(
        (1.0, 2.0, 2.5), (0.0, 5.0), (LinearDrag([0.1, 0.1, 0.1]),), angular_velocity=(1.0, 2.0, 3.0)
    )
    term = answer_driven(request).errors.truncation
    assert term.value is None
    assert "not made a second time" in term.source


def test_fixed_steps_longer_than_the_times_are_apart_have_an_error():
    """A quarter of such a step makes the same motion: shorter ones are compared."""
    from rotor.classical.driven import DrivenRequest, answer_driven, driven_motion
    from rotor.classical.effects.gravity import GravityAboutPivot
    from rotor.classical.step_errors import apart

    weight = GravityAboutPivot(1.0, (0.1, 0.2, 0.3), (0.0, 0.0, -1.0))
    times = tuple(np.linspace(0.0, 3.0, 61).tolist())
    request = DrivenRequest((1.0, 1.5, 2.0), times, (weight,), angular_velocity=(2.0, 1.0, -1.0), step=0.3)
    answer = answer_driven(request)
    actual = apart(answer.motion, driven_motion(replace(request, step=None, tolerance=1e-14)))
    assert 1e-12 < actual <= answer.errors.truncation.value < 3 * actual
