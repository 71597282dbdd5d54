"""`rotor accuracy`: errors of settings beside closed forms and orders of methods, the time limit, the command."""

from __future__ import annotations

import inspect
import json
import math
import re
import time
from dataclasses import dataclass, replace
from importlib import import_module

import numpy as np
import pytest
from places import PROJECT

from rotor.quantum.estimates.accuracy import energies_like, to_order
from rotor.requests.accuracy import read_accuracy
from rotor.requests.field import all_fields
from rotor.requests.fill import Entries
from rotor.requests.knob import Choice, Knob, Measure, Setting, Sweep
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Growth, Run
from rotor.scenes import accuracy_sweep
from rotor.scenes.accuracy_sweep import Row, WorkPrecision, panels_of, sweep, sweeps_of, work_precision
from rotor.scenes.scene import make_scene, write_scene
from rotor.verbs import SCENE_VERBS
from rotor.verbs.common.verb import verb_of


def errors(table: WorkPrecision, knob: str, of: str | None = None) -> dict[str, float]:
    return {row.setting: row.error for row in table.rows if row.knob == knob and of in (None, row.error_of)}


def test_orders_of_distortion_of_a_linear_molecule():
    """Without D the highest level is off by D (J(J+1))² - H (J(J+1))³, without H by that last term."""
    rod = {"constants": "B=6000 D=1e-3 H=1e-10 MHz"}
    table = work_precision(make_scene("levels", molecule=rod, observables={"jmax": 20}))
    deviations, x = errors(table, "effects.distortion"), 20 * 21
    assert deviations["order J^2"] == pytest.approx(1e-3 * x**2 - 1e-10 * x**3, rel=1e-9)  # round-off of 2.5e6 MHz
    assert deviations["order J^4"] == pytest.approx(1e-10 * x**3, rel=1e-4)  # likewise, of 7e-3 MHz
    assert deviations["order J^6"] == 0.0
    assert [row.own for row in table.rows] == [False, False, True]


def test_truncated_tops_have_the_constants_up_to_an_order():
    import rotor

    top = rotor.read("SO2")
    assert {len(name) for name in to_order(top, 2).constants.values} == {1}  # A, B, C
    assert set(to_order(top, 4).constants.values) == {"A", "B", "C", "DeltaJ", "DeltaJK", "DeltaK", "deltaJ", "deltaK"}
    assert dict(to_order(top, 99).constants.values) == dict(top.constants.values)


def test_energies_are_matched_by_quantum_numbers():
    import rotor
    from rotor.quantum.solve import solve_levels

    top = rotor.Top.from_constants("A=9 B=5 C=3 GHz")
    few, many = solve_levels(top, 4), solve_levels(top, 7)
    assert np.array_equal(energies_like(few, many), few.energy_mhz)
    other_way = energies_like(many, few)
    assert np.isnan(other_way[many.rotational > 4]).all()
    assert np.array_equal(other_way[many.rotational <= 4], many.energy_mhz[many.rotational <= 4])


JET = {"temperature": "2 K"}


def test_lines_lose_intensity_by_a_cut_and_by_j_max():
    rod = {"constants": "B=6000 D=0.001 MHz", "dipole_abc": [1, 0, 0]}
    seen = {"min_lgint": "none"}
    table = work_precision(
        make_scene("spectrum", molecule=rod, conditions=JET, observables=seen, numerics={"jmax": 12})
    )
    for knob in ("numerics.jmax", "observables.min_lgint"):
        lost = list(errors(table, knob).values())
        assert lost == sorted(lost, reverse=True)
        assert lost[0] > 1e-3 > lost[-1]
    # at 2 K levels of J > 12 hold exp(-hB 156/kT) of all: 1e-9 % is left
    assert errors(table, "numerics.jmax")["12"] < 1e-6


def test_methods_of_hyperfine_structure():
    spins = {
        "constants": "A=54000 B=6030 C=5445 MHz",
        "dipole_abc": [1, 0, 0],
        "spin_constants": "chi_aa(35Cl)=-57 chi_bc(35Cl)=20 MHz",
    }
    scene = make_scene("levels", molecule=spins, observables={"jmax": 3})
    deviations = errors(work_precision(scene), "effects.hyperfine_method")
    assert deviations["exact"] == 0.0 < deviations["N-diagonal"] <= deviations["first-order"] < deviations["left out"]
    assert deviations["left out"] == pytest.approx(
        57 / 4, rel=1e-6
    )  # J = 1 and I = 3/2 are shifted by χ_aa/4; second order


def test_a_stark_map_converges_with_j_max():
    table = work_precision(make_scene("stark", molecule="OCS", conditions={"field": [0.0, 100.0]}))
    by_j = list(errors(table, "numerics.jmax").values())
    assert by_j[:4] == sorted(by_j[:4], reverse=True)
    assert by_j[0] > 10.0  # MHz, with the least J max
    assert by_j[-1] < 1e-4 < by_j[-2]  # the tolerance of a scene: the lowest J max that meets it
    for tolerance, error in errors(table, "numerics.tolerance").items():
        assert error <= float(tolerance)


def test_a_partition_function_reaches_each_error():
    table = work_precision(make_scene("thermo", molecule="CO", conditions={"temperature": [20.0, 100.0]}))
    for name in ("Q", "U", "C_v"):
        for goal, error in errors(table, "numerics.relative_error", name).items():
            assert error <= 100 * float(goal)  # percent


@pytest.mark.slow
def test_the_step_of_a_splitting_has_its_order():
    rod = {"moments": [2.0, 2.0, 0.1], "angular_velocity": [0.0, 0.0, 1.0], "attitude": [0.8, 0.6, 0.0, 0.0]}
    weight = {"effect": "gravity about pivot", "mass": 1.0, "centre": [0.0, 0.0, 1.0], "gravity": [0.0, 0.0, -9.8]}
    table = work_precision(
        make_scene("tumble", body=rod, effects=[weight], conditions={"times": [0.0, 1.0, 2.0]}), limit_seconds=20
    )
    for order in (2, 4):
        deviations = errors(table, f"numerics.step, order {order}")
        steps, values = np.array([float(entry) for entry in deviations])[:3], np.array(list(deviations.values()))[:3]
        slope = np.polyfit(np.log(steps), np.log(values), 1)[0]
        assert slope == pytest.approx(order, abs=0.4)  # leading term alone, over a factor of 4 in the step
    steps = errors(table, "numerics.tolerance")
    assert steps["0.001"] > steps["1e-09"]


def test_kinds_without_a_knob_say_so():
    racket = {"moments": [1.0, 2.0, 3.0], "angular_velocity": [0.1, 1.0, 0.1]}
    table = work_precision(make_scene("tumble", body=racket))
    assert len(table) == 0
    assert "exact: nothing cheaper" in table.remarks[0]
    drag = [{"effect": "linear drag", "coefficients": [0.1, 0.1, 0.1]}]
    driven, remarks = sweeps_of(make_scene("tumble", body=racket, effects=drag, conditions={"times": [0.0, 1.0]}))
    assert [knob.name for knob in driven] == ["numerics.tolerance"]
    assert "a splitting holds no torque of the angular velocity" in remarks[0]


@pytest.mark.slow
def test_the_error_of_a_gas_falls_with_the_root_of_its_molecules():
    table = work_precision(make_scene("gas", molecule="water", numerics={"molecules": 3000}))
    deviations = errors(table, "numerics.molecules", "temperature")
    for count, error in deviations.items():
        expected = 300 * math.sqrt(2 / (6 * int(count)))  # of 2E/6k, E a sum of 6 halves of χ²
        assert 0.4 < error / expected < 1.8  # 8 gases: χ of 8 degrees is inside with 99.7 %


@pytest.mark.slow
def test_the_step_of_a_fluid_is_of_second_order():
    box = {"model": "spce", "molecules": 27, "steps": 10}
    table = work_precision(make_scene("fluid", conditions=box, numerics={"cutoff": "4.5 Å", "electrostatics": "ewald"}))
    for of in ("conserved energy per degree", "positions after 48 fs"):
        deviations = errors(table, "numerics.step", of)
        assert deviations["2"] / deviations["1"] == pytest.approx(4.0, rel=0.15)  # leading term alone
    ewald = list(errors(table, "numerics.ewald_tolerance").values())
    assert ewald == sorted(ewald, reverse=True)
    assert ewald[-1] < 1e-3 < 0.01 < ewald[0]  # percent of a force


@pytest.mark.slow
def test_alignment_reaches_each_tolerance():
    pulse = [{"shape": "gaussian", "peak": 1e12, "fwhm": 0.3}]
    table = work_precision(make_scene("align", molecule="OCS", pulses=pulse))
    deviations = errors(table, "numerics.tolerance")
    assert all(error <= float(goal) for goal, error in deviations.items())
    assert deviations["0.01"] > 100 * deviations["1e-06"]


def test_raman_lines():
    deviations = errors(work_precision(make_scene("raman", molecule="N2")), "observables.min_relative")
    assert list(deviations.values()) == sorted(deviations.values(), reverse=True)
    assert deviations["1e-06"] < 1e-3 < deviations["0.1"]  # percent of all cross sections


@pytest.mark.parametrize("kind", sorted(SCENE_VERBS))
def test_the_numerics_of_every_kind_can_be_loaded(kind):
    entry = verb_of(kind).load_numerics()
    assert entry.goals
    assert all(callable(goal.error) for goal in entry.goals.values())
    assert callable(entry.describe or verb_of(kind).answer)


def test_a_fit_and_a_source():
    spectrum = [{"source": "CO", "column": 1e18}, {"source": "CH3CN", "column": 1e14}]
    source = make_scene("emission", molecules=spectrum, conditions={"excitation": "20 K", "range": "110:116GHz"})
    computed = list(errors(work_precision(source), "observables.least_depth").values())
    assert computed == sorted(computed, reverse=True)
    assert computed[-1] < 1e-3 < computed[0]  # K

    lines = PROJECT / "tests" / "oracles" / "fits"
    par = next(iter(sorted(lines.rglob("*.par"))))
    table = work_precision(make_scene("fit", lines={"source": str(par)}))
    by_tolerance = errors(table, "tolerance of the search")
    assert by_tolerance["1e-08"] <= by_tolerance["0.0001"] < 0.1  # standard errors


def slow_knob(seconds: list[float], clock: list[float]) -> Sweep:
    def answer(request: float) -> float:
        clock[0] += request
        return request

    measure = Measure("nothing", "", lambda first, other: abs(first - other))
    settings = tuple(Setting(f"{duration:g}", duration) for duration in seconds)
    return Sweep(Knob(key="time", measures=(measure,)), settings, 1000.0, "a long one", answer)


def test_what_is_beyond_the_limit_is_left_out_and_said(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(time, "process_time", lambda: clock[0])
    rows, against, remarks, spent = sweep(slow_knob([1.0, 2.0, 4.0, 8.0, 16.0], clock), 20.0)
    assert [row.setting for row in rows] == [
        "1",
        "2",
        "4",
    ]  # with 8 s, the reference, they are 15 s; 16 s more are too many
    assert against == "the finest within the time limit, 8"
    assert remarks == ["time: 16 and finer ones are beyond the time limit"]
    assert spent <= 20.0


def test_a_panel_a_knob():
    rows = [Row(f"numerics.step, order {n}", "1", False, "attitude", 1e-3 / n, "rad", 0.1) for n in (2, 4)]
    panels = panels_of(
        WorkPrecision("tumble", tuple(rows), {}, knobs={"numerics.step": Knob(title="length of a step")})
    )
    assert [(panel.title, panel.of, list(panel.curves)) for panel in panels] == [
        ("length of a step", "attitude (rad)", ["order 2", "order 4"])
    ]


def test_settings_of_highest_j_rise_and_hold_that_of_the_scene():
    scene = make_scene("spectrum", molecule="CO", conditions=JET, numerics={"jmax": 56})
    (reach,) = (knob for knob in sweeps_of(scene)[0] if knob.name == "numerics.jmax")
    assert [setting.label for setting in reach.settings] == ["14", "22", "31", "39", "48", "56"]
    assert [setting.request.jmax for setting in reach.settings] == [14, 22, 31, 39, 48, 56]
    assert [setting.in_scene for setting in reach.settings] == [False] * 5 + [True]
    assert (reach.reference.jmax, reach.against, reach.knob.title) == (74, "J max 74", "highest J of the basis")


@dataclass(frozen=True)
class Terms:
    """The sum of so many terms 1/n²."""

    count: int = 30


def answer_terms(request: Terms) -> float:
    return math.fsum(1.0 / n**2 for n in range(1, request.count + 1))


TERMS = Knob(
    (1, 10, 100), 10_000, (Measure("sum", "", lambda answer, reference: abs(answer - reference)),), "{:g} terms",
    key="numerics.terms", attribute="count", tried=(1, 10, 100), coarsest=(1, "loosest"),
    cost=Growth((1_000, 10_000)),
)  # fmt: skip
NUMERICS = Numerics({"": Goal("sum", lambda answer: math.pi**2 / 6 - answer)}, knobs=(TERMS,))


def test_a_toy_knob_is_swept_without_further_code():
    """The error of N terms lies between 1/(N + 1) and 1/N."""
    rows, against, remarks, _ = sweep(TERMS.sweep(Terms(), answer_terms), 10.0)
    assert [(row.knob, row.setting, row.own) for row in rows] == [
        ("numerics.terms", "1", False), ("numerics.terms", "10", False), ("numerics.terms", "30", True),
        ("numerics.terms", "100", False),
    ]  # fmt: skip
    assert (against, remarks) == ("10000 terms", [])
    for row in rows:
        assert 1 / (int(row.setting) + 1) - 1e-4 < row.error < 1 / int(row.setting)


def test_a_toy_knob_is_chosen_without_further_code():
    def chosen(accuracy: float, entries: Entries = Entries()) -> Choice:  # noqa: B008
        return read_accuracy(accuracy, NUMERICS, entries).chosen(Terms(), entries, answer_terms)

    choice = chosen(0.05)
    assert (choice.request, choice.how, choice.answer) == (Terms(100), "terms 100", answer_terms(Terms(100)))
    assert chosen(0.7).how == "terms 1, nothing cheaper: the loosest there is"
    with pytest.raises(
        ValueError, match=r"accuracy: 0.001 cannot be given: the error here is 0.01 \(terms 100\); ask for less"
    ):
        chosen(1e-3)
    with pytest.raises(ValueError, match=r"accuracy and numerics.terms: give one of them"):
        chosen(0.05, Entries({"numerics.terms": 3}))
    unknown = replace(NUMERICS, goals={"": replace(NUMERICS.goals[""], unfit=lambda request: "of another sum")})
    with pytest.raises(ValueError, match=r"accuracy: 0.05: of another sum"):
        read_accuracy(0.05, unknown).chosen(Terms(), Entries(), answer_terms)


def test_a_toy_knob_is_planned_without_further_code(monkeypatch):
    """By a clock on which a sum takes 10 ms and 1 μs a term."""
    calls, clock = [], [0.0]
    monkeypatch.setattr(time, "process_time", lambda: clock[0])

    def counted(request: Terms) -> float:
        calls.append(request.count)
        clock[0] += 0.01 + 1e-6 * request.count
        return answer_terms(request)

    few, many = (NUMERICS.cost(Terms(count), Run(counted, counted)) for count in (2_000_000, 4_000_000))
    assert max(calls) < 2_000_000  # from short sums
    assert (few.seconds, many.seconds) == pytest.approx((2.01, 4.01))
    assert many.amount == 4_000_000


@pytest.mark.parametrize("kind", sorted(SCENE_VERBS))
def test_a_kind_has_knobs_and_no_code_of_its_own_that_chooses_sweeps_or_plans(kind):
    verb = verb_of(kind)
    numerics = verb.load_numerics()
    assert type(numerics) is Numerics
    knobs = [*(field.knob for field in all_fields(verb.request).values() if field.knob is not None), *numerics.knobs]
    for knob in knobs:
        assert type(knob) is Knob
        assert (knob.fixed is None) <= bool(knob.steps and knob.measures)  # swept, or the reason why not
        assert not knob.units or knob.least is not None or knob.tried
        assert knob.cost is None or callable(knob.cost)
    assert {unit for knob in knobs for unit in knob.units} <= {*numerics.goals, "Å"}
    source = inspect.getsource(inspect.getmodule(verb.request)) + inspect.getsource(
        import_module(verb.numerics.partition(":")[0] or "rotor.requests.numerics")
    )
    assert not re.search(r"\b(Choice|Sweep|timed|traced)\(", source)


def test_the_command_accuracy_sweeps_a_scene(call, folder):
    write_scene(make_scene("thermo", molecule="CO", conditions={"temperature": [20.0]}), "s.toml")
    code, out, _ = call("accuracy", "s.toml", "--plot", "a.png", "--csv", "a.csv")
    assert code == 0
    assert "numerics.relative_error: Q" in out
    assert "1e-06  *" in out
    assert (folder / "a.png").stat().st_size > 10_000
    assert (folder / "a.csv").read_text().startswith("knob,setting,own,error_of,error,unit,seconds\n")
    content = json.loads(call("accuracy", "s.toml", "--json", "-")[1])
    assert {row["error_of"] for row in content["settings"]} == {"Q", "U", "C_v"}
    assert content["kind"] == "thermo"


def test_the_command_where_nothing_can_be_swept(call, folder):
    write_scene(make_scene("tumble", body={"moments": [1.0, 2.0, 3.0], "angular_velocity": [0.1, 1.0, 0.1]}), "s.toml")
    assert "exact: nothing cheaper" in call("accuracy", "s.toml")[1]
    code, _, said = call("accuracy", "s.toml", "--plot", "a.png")
    assert code == 2
    assert "there is nothing to draw" in said
    assert not (folder / "a.png").exists()


def test_a_sweep_over_values_is_refused():
    scene = make_scene("thermo", molecule="CO", sweep={"observables.species": ["equilibrium"]})
    with pytest.raises(ValueError, match="the knobs of one point are swept"):
        work_precision(scene)


def test_an_interrupt_prints_what_there_is(call, folder, monkeypatch):
    write_scene(make_scene("spectrum", molecule="HC3N", conditions=JET, numerics={"jmax": 5}), "s.toml")
    true, count = accuracy_sweep.sweep, []

    def second_time(*arguments):
        count.append(1)
        if len(count) == 2:
            raise KeyboardInterrupt
        return true(*arguments)

    monkeypatch.setattr(accuracy_sweep, "sweep", second_time)
    code, out, said = call("accuracy", "s.toml", "--csv", "a.csv")
    assert code == 130
    assert said == "interrupted; the table has the knobs swept so far, no file was written\n"
    assert "observables.min_lgint" in out
    assert not (folder / "a.csv").exists()


def test_compiling_is_no_part_of_a_time():
    """A call far beyond the coarser setting's time is made once more: its first time may hold the compilation of a kernel."""
    clock, calls = [0.5, 1e-3], []

    def call():
        calls.append(len(calls))
        end = time.process_time() + clock[min(len(calls), 2) - 1]
        while time.process_time() < end:
            pass
        return len(calls)

    answer, seconds, both = accuracy_sweep.timed(call, 1e-3)
    assert answer == 2
    assert len(calls) == 2
    assert seconds < 0.25 < 0.5 < both
    calls.clear()
    assert accuracy_sweep.timed(call, 0.4)[1] >= 0.5
    assert len(calls) == 1


def test_times_that_fall_by_less_than_their_scatter_have_one_value():
    """By 0.3 at medians of 2 and 1.7: more than a tenth, less than quartiles that lie 0.8 and 0.7 apart."""
    assert accuracy_sweep.without_scatter([[1.2, 2.0, 2.8], [1.0, 1.7, 2.4]]) == pytest.approx([1.85, 1.85])
    assert accuracy_sweep.without_scatter([[1.9, 2.0, 2.1], [1.6, 1.7, 1.8]]) == pytest.approx([2.0, 1.7])
