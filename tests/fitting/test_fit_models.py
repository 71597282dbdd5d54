"""Choosing and trying constants beside ties and a-priori errors, and what is said of errors that the lines do not state."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.choice.choose import choose_constants, promised, try_constants
from rotor.fitting.choice.criteria import chi_squared, f_test
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.parameters import parameters, with_names
from rotor.fitting.reports.report import report_text
from rotor.fitting.resampling import bootstrap
from rotor.fitting.result import Fit
from rotor.fitting.top_constants import TopConstants
from rotor.formats.lines.assigned_lin import as_lin, lin_notes
from rotor.formats.lines.assigned_lines import read_assigned_lines, write_assigned_lines
from rotor.plots.spectra.fit import fit_figure
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top
from rotor.verbs.fit import EXAMPLES

ASYMMETRIC = ("j", "ka", "kc")
TRUE = Constants(
    A=8572.06, B=3640.11, C=2790.97, DeltaJ=7.13e-4, DeltaJK=-3.22e-4, DeltaK=4.62e-3, deltaJ=1.42e-4, deltaK=1.37e-3
)
HALF = TRUE.replace(deltaK=0.5 * TRUE["deltaJ"])
TIES = ["deltaK = 9.0*deltaJ", "C = 0.7667*B"]  # both a little off, so that they are seen
QUARTIC = ["A", "B", "DeltaJ", "DeltaJK", "DeltaK", "deltaJ"]


def lines_of(top: Top, names: tuple[str, ...], count: int, jmax: int = 8, error: float = 0.01, **more) -> Assignments:
    """Lines with normal noise, drawn from all of them."""
    rng = np.random.default_rng(2)
    transitions = line_list(top, jmax=jmax, min_lgint=None, q=1.0, **more)
    chosen = rng.choice(len(transitions), size=min(count, len(transitions)), replace=False)
    labels = np.stack([transitions.levels.quanta[name] for name in names], axis=1)
    seen = transitions.frequency_mhz[chosen] + error * rng.normal(size=len(chosen))
    return assignments(names, labels[transitions.upper[chosen]], labels[transitions.lower[chosen]], seen, error)


@pytest.fixture(scope="module")
def lines():
    return lines_of(Top.from_constants(TRUE, dipole_abc_debye=(1, 1, 0)), ASYMMETRIC, 70)


@pytest.fixture(scope="module")
def tied(lines):
    return fit_lines(lines, TRUE, parameters(TRUE, QUARTIC, ties=TIES), FitOptions(poor_rms=1e9))


def test_a_constant_is_tried_beside_the_ties(lines, tied):
    added, left_out = try_constants(tied, ["PhiK", "DeltaK"])
    more = with_names(TRUE, ["PhiK"])
    larger = fit_lines(lines, more, parameters(more, [*QUARTIC, "PhiK"], ties=TIES), FitOptions(poor_rms=1e9))
    assert (added.f_ratio, added.chance) == pytest.approx(f_test(tied, larger), rel=1e-4)  # the searches end at 1e-6
    assert added.fit.constants["deltaK"] == pytest.approx(9.0 * added.fit.constants["deltaJ"], rel=1e-12)  # round-off
    less = TRUE.replace(DeltaK=0.0)
    free = parameters(less, [name for name in QUARTIC if name != "DeltaK"], ties=TIES)
    smaller = fit_lines(lines, less, free, FitOptions(poor_rms=1e9))
    assert left_out.f_ratio == pytest.approx(f_test(smaller, tied)[0], rel=1e-4)  # as above
    assert left_out.fit.constants["DeltaK"] == 0.0


def test_what_is_tied_to_a_constant_that_is_left_out_follows_it(tied):
    [trial] = try_constants(tied, ["deltaJ"])
    assert trial.fit.constants["deltaK"] == 0.0
    assert trial.fit.parameters.names == ("A", "B", "DeltaJ", "DeltaJK", "DeltaK")
    with pytest.raises(ValueError, match="deltaK is free or tied already"):
        try_constants(tied, ["deltaK"])


def test_the_promise_is_that_of_the_linear_model_beside_ties(lines, tied):
    alone, _ = promised(tied, ["PhiK"])
    computed = next(trial for trial in try_constants(tied, ["PhiK"]))
    assert alone[0] == pytest.approx(chi_squared(tied) - chi_squared(computed.fit), rel=0.02)  # nearly linear


def test_a_model_is_built_up_beside_ties_and_a_priori_errors(lines):
    start = TRUE.replace(DeltaJ=None, DeltaJK=None, DeltaK=None, deltaJ=1.0e-4)
    priors = {"deltaJ": 1e-6}
    base = parameters(start, ["A", "B", "C", "deltaJ"], ties=TIES[:1], priors_mhz=priors)
    fit, steps = choose_constants(lines, start, base, ["DeltaJ", "DeltaJK", "DeltaK"])
    assert {step.name for step in steps} == {"DeltaJ", "DeltaJK", "DeltaK"}
    whole = with_names(start, ["DeltaJ", "DeltaJK", "DeltaK"])
    free = parameters(whole, list(fit.parameters.names), ties=TIES[:1], priors_mhz=priors)
    direct = fit_lines(lines, whole, free, FitOptions(poor_rms=1e9))
    assert (fit.values - direct.values) / direct.errors == pytest.approx(0.0, abs=1e-3)  # where searches end
    assert fit.constants["deltaK"] == pytest.approx(9.0 * fit.constants["deltaJ"], rel=1e-12)  # round-off
    assert fit.errors[fit.parameters.names.index("deltaJ")] < 1e-6  # that of the a-priori value
    with pytest.raises(ValueError, match="deltaK is free or tied already"):
        choose_constants(lines, start, base, ["deltaK"])


def test_choose_of_the_command_line_regards_ties_and_a_priori_errors(call, folder):
    co = Top.from_constants("B=57635.96804 D=0.1835053 H=1.723e-7 MHz", dipole_abc_debye=(0.11, 0, 0))
    write_assigned_lines(lines_of(co, ("j",), 25, jmax=25, error=0.003), "co.csv")
    common = ("fit", "co.csv", "--constants", "B=57635 D=0.18 MHz", "--free", "B,D", "--tie", "H=8e-7*D")
    code, _, err = call(*common, "--prior", "D=1e-9", "--choose", "L", "--poor-rms", "1e12", "--json", "c.json")
    assert code == 0, err
    content = json.loads((folder / "c.json").read_text())
    constants = content["constants_mhz"]
    assert constants["H"] == pytest.approx(8e-7 * constants["D"], rel=1e-12)  # round-off
    assert constants["D"] == pytest.approx(0.18, abs=1e-5)  # drawn to its start, 0.0035 from where the lines have it
    code, _, err = call(*common, "--choose", "H")
    assert (code, err) == (2, "error: --choose: H is free or tied already; leave it out, or take the tie away\n")


@pytest.fixture
def half(lines):
    """Every other line without an error."""
    return replace(lines, error_mhz=np.where(np.arange(len(lines)) % 2, 0.0, lines.error_mhz))


def test_a_default_error_is_the_error_of_a_line_in_every_report(half):
    free = parameters(TRUE, ["A", "B", "C"])
    fit = fit_lines(half, TRUE, free, FitOptions(default_error_mhz=0.02))
    assert fit.line_errors_mhz[:4].tolist() == [0.01, 0.02, 0.01, 0.02]
    shown = next(row for row in report_text(fit).splitlines() if row.startswith("    2:"))
    assert "0.02000" in shown
    assert f"{fit.difference_mhz[1] / 0.02:8.2f}" in shown
    assert len(fit_figure(fit).axes[0].lines[1].get_ydata()) == len(half)
    assert np.isfinite(fit_figure(fit).axes[0].lines[1].get_ydata()).all()
    without = fit_lines(half, TRUE, free)
    assert without.line_errors_mhz[:2].tolist() == [0.01, 0.0]
    assert next(row for row in report_text(without).splitlines() if row.startswith("    2:")).split()[-8] == "-"


def test_suggested_lines_have_the_error_that_the_fit_used(call, folder, lines):
    write_assigned_lines(lines, "stated.csv")
    write_assigned_lines(replace(lines, error_mhz=np.where(np.arange(len(lines)) < 60, 0.0, 0.01)), "none.csv")
    results = []
    for name in ("stated", "none"):
        code, _, err = call(
            "fit", f"{name}.csv", "--constants", "A=8572.06 B=3640.11 C=2790.97 MHz", "--free", "A,B,C", "--default-error",
            "0.01", "--poor-rms", "1e9", "--suggest", "A", "--json", f"{name}.json",
        )  # fmt: skip
        assert code == 0, err
        content = json.loads((folder / f"{name}.json").read_text())
        results.append(content["suggestions"])
        assert {line["error_mhz"] for line in content["lines"]} == {0.01}
    assert results[0] == results[1]


def test_the_bootstrap_has_no_error_for_what_is_not_determined():
    measurements = assignments(("j",), [[1]] * 4, [[0]] * 4, [115271.2, 115271.3, 115271.1, 115271.25], 0.1)
    start = Constants(B=57635.6, D=0.0)
    fit = fit_lines(measurements, start, parameters(start, ["B", "D"]))
    assert not np.isfinite(fit.errors).all()
    _, spread = bootstrap(fit, 5, np.random.default_rng(0))
    assert np.isfinite(spread).tolist() == np.isfinite(fit.errors).tolist()


def test_samples_that_do_not_converge_are_drawn_again(lines, monkeypatch):
    import rotor.fitting.resampling as resampling

    start = TRUE
    fit = fit_lines(lines, start, parameters(start, ["A", "B", "C"]))
    real, fits = resampling.fit_lines, list[Fit]()

    def every_other(*arguments, **more):
        fits.append(replace(real(*arguments, **more), converged=len(fits) % 2 == 0))
        return fits[-1]

    monkeypatch.setattr(resampling, "fit_lines", every_other)
    values, _ = bootstrap(fit, 4, np.random.default_rng(0))
    assert len(fits) == 7
    assert values.tolist() == [fit.values.tolist() for fit in fits[::2]]
    monkeypatch.setattr(resampling, "fit_lines", lambda *arguments, **more: replace(fits[0], converged=False))
    with pytest.raises(ValueError, match=r"only 0 of 20 samples .*0 determine fewer, 20 do not"):
        bootstrap(fit, 2, np.random.default_rng(0))


# Lines of one frequency in a .lin


def test_lines_of_one_frequency_that_are_no_blend_are_none_in_a_lin(tmp_path):
    frequency = [5500.0, 9000.0, 16500.0, 16500.0, 16500.0, 10500.0, 10500.0, 10500.0]
    upper = [[i + 1, 0, i + 1] for i in range(8)]
    lower = [[i, 0, i] for i in range(8)]
    seen = assignments(ASYMMETRIC, upper, lower, frequency, [0.01] * 7 + [0.1], blend=[0, 1, 2, 3, 4, 5, 5, 6])
    write_assigned_lines(seen, tmp_path / "x.lin")
    back, _ = read_assigned_lines(tmp_path / "x.lin", ASYMMETRIC)
    groups = [
        {tuple(back.upper[i].tolist()) for i in np.flatnonzero(back.blend == b)} for b in np.unique(back.blend).tolist()
    ]
    assert sorted(map(len, groups)) == [1, 1, 1, 1, 1, 1, 2]
    assert {(6, 0, 6), (7, 0, 7)} in groups
    assert not lin_notes(seen)


def test_lines_that_nothing_parts_are_named():
    seen = assignments(("j",), [[1], [2], [3]], [[0], [1], [2]], [100.0, 100.0, 300.0], 0.1)
    assert not lin_notes(seen)
    last = assignments(("j",), [[1], [2], [3], [4]], [[0], [1], [2], [3]], [200.0, 300.0, 100.0, 100.0], 0.1)
    assert not lin_notes(last)  # nothing stands behind them that parts them, but before
    assert as_lin(last).frequency.tolist() == [100.0, 200.0, 300.0, 100.0]
    assert lin_notes(seen.take(np.array([0, 1])))[0].startswith("1 line of the same frequency as the line before")


def test_the_command_line_says_so(call, folder):
    (folder / "x.csv").write_text("j_upper,j_lower,frequency_mhz,error_mhz,blend\n1,0,100,0.1,\n1,0,100,0.1,\n")
    code, _, err = call("fit", "x.csv", "--constants", "B=50 MHz", "--free", "B", "--save-lines", "x.lin")
    assert code == 0, err
    assert "1 line of the same frequency as the line before it is a blend with it in a .lin file" in err


# The examples of --help


def _files_of_the_examples(folder):
    (folder / "case.par").write_text(
        "CO\n   2  31   20    0    0.0000E+000    1.0000E+006    1.0000E+000 1.0000000000\n"
        "l   -1    1    0    0    0    1    1    1         0   -1    0\n"
        "             100  5.763500000000000E+004 1.00000000E+035 /B\n"
        "             200 -1.830000000000000E-001 1.00000000E+035 /-D\n"
    )
    co = Top.from_constants("B=57635.96804 D=0.1835053 MHz", dipole_abc_debye=(0.11, 0, 0))
    write_assigned_lines(lines_of(co, ("j",), 20, jmax=20), "case.lin")
    water = rotor.read("water")
    write_assigned_lines(lines_of(replace(water, level_table=None), ASYMMETRIC, 25, jmax=4), "lines.lin")
    (folder / "constants.toml").write_text(
        '[constants]\nreduction = "A"\nrepresentation = "Ir"\n'
        + "".join(f"{name} = {value!r}\n" for name, value in HALF.values.items())
    )
    (folder / "states.toml").write_text(
        "dipole = { a = 1.0, b = 0.7 }\n[constants]\nA = 9000.0\nB = 3000.0\nC = 2500.0\n"
        '[states]\n"E[1]" = 30000.0\n"A[1]" = 9010.0\n"B[1]" = 2990.0\n"C[1]" = 2495.0\n"G_c[0,1]" = 150.0\n'
        "[spins.14N]\nchi_aa = -4.0\n"
    )


@pytest.mark.parametrize("example", [row.strip() for row in EXAMPLES.splitlines() if "rotor fit" in row])
def test_the_examples_of_help_run(call, folder, example):
    _files_of_the_examples(folder)
    words = shlex.split(example)[1:]
    if "c060503.cat.gz" in words:  # a catalogue that is not here: its names are those that a linear top has
        assert with_names(Constants(B=6081.0), words[words.index("--free") + 1].split(",")).values.keys() == {
            "B",
            "D",
            "H",
        }
        return
    if "states.toml" in words:
        constants = TopConstants(rotor.read("states.toml"), hyperfine=True)
        seen = lines_of(constants.top, constants.quanta, 60, jmax=2, effects=constants.effects)
        write_assigned_lines(replace(seen, halves=constants.halves), "lines.csv")
    else:
        write_assigned_lines(
            lines_of(Top.from_constants(HALF, dipole_abc_debye=(1, 1, 0)), ASYMMETRIC, 60), "lines.csv"
        )
    code, _, err = call(*words)
    assert code == 0, err


def test_a_name_of_states_or_spins_that_there_is_not_says_how_they_are_written(call, folder):
    _files_of_the_examples(folder)
    (folder / "lines.csv").write_text(
        "j_upper,ka_upper,kc_upper,v_upper,j_lower,ka_lower,kc_lower,v_lower,frequency_mhz,error_mhz\n"
        "1,0,1,0,0,0,0,0,5500,0.1\n"
    )
    code, _, err = call("fit", "lines.csv", "--start", "states.toml", "--free", "A,Foo")
    assert code == 2
    assert "'Foo' is not a rotational constant" in err
    assert "E[1] and A[1] of further states, G_c[0,1] of pairs of states, chi_aa(14N) of spins" in err
