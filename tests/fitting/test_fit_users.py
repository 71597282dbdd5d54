"""What users of `rotor fit` need at the terminal: interrupts, ties in SPFIT's files, held parameters in a .var, names of the start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from file_covariance import constants_covariance

import rotor
from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.choice.choose import choose_constants
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.parameters import parameters
from rotor.fitting.reports.report import dfbetas, influential
from rotor.fitting.resampling import bootstrap
from rotor.fitting.result import Fit
from rotor.formats.fits import fit_further
from rotor.formats.fits.fit_request import answer_fit, lines_request
from rotor.formats.spcat.fits.fit_input import fitted_file, spfit_input
from rotor.formats.spcat.fits.named_fit import named_file
from rotor.formats.spcat.text.par import read_par
from rotor.spectra.lines import line_list
from rotor.statistics.least_squares import INTERRUPTED, Iteration
from rotor.tops.constants.constants import Constants

TRUE = Constants(A=5213.4471, B=1897.2265, C=1401.8812, DeltaJ=2.12e-4, DeltaJK=-1.11e-3, deltaJ=5.1e-5, deltaK=9.3e-4)
HEAD = "j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower,frequency_mhz,error_mhz\n"


def lines_of(constants: Constants, error: float = 0.003, shift: float = 0.0) -> Assignments:
    """Lines to J = 6 with normal noise."""
    lines = line_list(rotor.Top.from_constants(constants, dipole_abc_debye=(1, 1, 0)), jmax=6, min_lgint=None, q=1.0)
    labels = np.stack([lines.levels.quanta[name] for name in ("j", "ka", "kc")], axis=1)
    noise = error * np.random.default_rng(7).normal(size=len(lines)) + shift
    return assignments(("j", "ka", "kc"), labels[lines.upper], labels[lines.lower], lines.frequency_mhz + noise, error)


@pytest.fixture(scope="module")
def seen() -> Assignments:
    return lines_of(TRUE)


def interrupting(last: int, steps: list[Iteration]):
    """A progress that notes the steps and interrupts once, at the last one."""

    def progress(step: Iteration) -> None:
        steps.append(step)
        if len(steps) == last:
            raise KeyboardInterrupt

    return progress


def test_an_interrupt_ends_every_way_of_the_search(seen):
    """Lines that nothing describes: the direct search, that by rising J and those with other signs. Each step may be interrupted."""
    wrong = replace(seen, frequency_mhz=np.roll(seen.frequency_mhz, 7))
    free = parameters(TRUE, ["A", "B", "C"])
    seen_steps = list[Iteration]()
    fit_lines(wrong, TRUE, free, progress=seen_steps.append)
    assert len({step.rms_before for step in seen_steps}) > 15  # more than one way
    for step in range(1, len(seen_steps)):
        after = list[Iteration]()
        fit = fit_lines(wrong, TRUE, free, progress=interrupting(step, after))
        assert fit.minimum.status == INTERRUPTED
        assert not fit.converged
        assert "interrupted after" in fit.reason
        assert len(after) == step  # nothing went on behind it


def test_an_interrupt_of_many_fits_leaves_what_is_done(seen, monkeypatch):
    import rotor.fitting.choice.choose as choose
    import rotor.fitting.resampling as resampling

    fit = fit_lines(seen, TRUE, parameters(TRUE, ["A", "B", "C", "DeltaJ"]))

    def interrupted_at(last: int):
        count = [0]

        def fitted(*arguments, **more) -> Fit:
            count[0] += 1
            if count[0] == last:
                raise KeyboardInterrupt
            return fit_lines(*arguments, **more)

        return fitted

    monkeypatch.setattr(resampling, "fit_lines", interrupted_at(6))
    values, spread = bootstrap(fit, 50, np.random.default_rng(1))
    assert values.shape == (5, 4)
    assert np.allclose(spread, values.std(axis=0, ddof=1))
    monkeypatch.setattr(choose, "fit_lines", interrupted_at(9))
    start = Constants(A=5213.0, B=1897.0, C=1402.0)
    computed, steps = choose_constants(seen, start, ["A", "B", "C"], ["DeltaJ", "DeltaJK", "deltaJ", "deltaK"])
    assert not computed.converged
    assert computed.minimum.status == INTERRUPTED
    assert computed.reason == f"interrupted after {len(steps)} steps of the choice"


def test_a_search_passes_an_interrupt_on_where_it_is_one_of_many(seen):
    free = parameters(TRUE, ["A", "B"])
    with pytest.raises(KeyboardInterrupt):
        fit_lines(seen, TRUE, free, FitOptions(pass_interrupt=True), progress=interrupting(1, []))


def test_choosing_may_begin_with_a_b_c_alone(seen):
    """The reduction comes with the first constant that has one."""
    start = Constants(A=5213.0, B=1897.0, C=1402.0)
    fit, steps = choose_constants(seen, start, ["A", "B", "C"], ["DeltaJ", "DeltaJK", "deltaJ", "deltaK"])
    assert fit.converged
    assert {step.name for step in steps} >= {"DeltaJ", "DeltaJK"}
    assert fit.weighted_rms < 1.2  # normal errors of the lines


def tied(seen: Assignments) -> Fit:
    """C = B - 495.3453 MHz and deltaK in a ratio to deltaJ; DeltaJ with an a-priori error."""
    ties = ["C = B - 495.3453 MHz", f"deltaK = {9.3 / 0.51}*deltaJ"]
    free = parameters(TRUE, ["A", "B", "DeltaJ", "DeltaJK", "deltaJ"], ties=ties, priors_mhz={"DeltaJ": 1e-3})
    return fit_lines(seen, TRUE, free)


def test_ties_and_a_priori_errors_go_into_spfits_files_and_come_back(seen):
    fit = tied(seen)
    file = named_file(fit, "tied", variances=False)
    rows = {(p.code, p.constrained): p for p in file.parameters}
    assert rows[30000, True].value == fit.constants["B"]
    assert rows[30000, False].value == pytest.approx(-495.3453, abs=1e-9)  # round-off of 1900
    assert rows[30000, False].error == 1e-37
    assert rows[200, False].error == 1e-3
    assert rows[41000, True].value / rows[40100, False].value == pytest.approx(9.3 / 0.51, rel=1e-12)  # round-off
    text = "".join(
        f"{''.join(f'{n:3d}' for n in (*u, *low)):36s} {f:15.6f} 0.003\n"
        for u, low, f in zip(seen.upper, seen.lower, seen.frequency_mhz, strict=True)
    )
    from rotor.formats.spcat.text.lin import read_lin

    fit_input = spfit_input(file, read_lin(text.encode(), 3))
    again = fit_lines(fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options)
    for name in ("A", "B", "C", "DeltaK", "deltaK"):
        if name in fit.constants:
            assert abs(again.constants[name] - fit.constants[name]) < 1e-3 * fit.constants.uncertainties[name]


def test_a_var_file_has_the_correlations_of_held_parameters_too(seen):
    """SPCAT counts every parameter without a minus sign: with those of the free ones alone its errors were up to 3 times too large."""
    fit = tied(seen)
    file = named_file(fit, "tied", variances=True)
    leaders = [p for p in file.parameters if not p.constrained]
    count = len([line[i : i + 10] for line in file.rest.splitlines() for i in range(0, len(line), 10)])
    assert len(leaders) == len(fit.parameters.names) + 1  # the difference is held
    assert count == len(leaders) * (len(leaders) + 1) // 2
    covariance = constants_covariance(file)
    assert covariance is not None
    for name in fit.parameters.names:
        row = [covariance.names.index(n) for n in ("B", name)]
        columns = [fit.covariance.names.index(n) for n in ("B", name)]
        theirs, ours = covariance.matrix_mhz2[np.ix_(row, row)], fit.covariance.matrix_mhz2[np.ix_(columns, columns)]
        assert np.allclose(theirs, ours, rtol=1e-5, atol=1e-6 * abs(ours[0, 1]))  # seven digits in the file


def test_a_held_parameter_of_a_par_file_stays_in_the_var(tmp_path):
    (tmp_path / "co.par").write_text(
        "CO\n   3  20   20    0    0.0E+000    1.0E+006    1.0E+000 1.0\n"
        "l   -1    1    0    0    0    1    1    1         0   -1    0\n"
        "   100  5.7E+004 1.0E+035 /B\n   200 -1.835E-001 1.0E-037 /-D\n   300  1.7E-007 1.0E+035 /H\n"
    )
    top = rotor.Top.from_constants("B=57635.96804 D=0.1835053 H=1.7e-7 MHz", dipole_abc_debye=(0.1, 0, 0))
    lines = line_list(top, jmax=20, min_lgint=None, q=1.0)
    j = lines.levels.quanta["j"]
    rows = zip(j[lines.upper].tolist(), j[lines.lower].tolist(), lines.frequency_mhz.tolist(), strict=True)
    (tmp_path / "co.lin").write_text("".join(f"{u:3d}{low:3d}{'':30s} {f:15.4f} 0.003\n" for u, low, f in rows))
    from rotor.formats.spcat.fits.fit_input import read_fit

    fit_input = read_fit(tmp_path / "co.par")
    fit = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, replace(fit_input.options, poor_rms=1e9)
    )
    rest = fitted_file(fit_input, fit, variances=True).rest
    numbers = [rest[i : i + 10] for i in range(0, len(rest.strip()), 10)]
    assert len(numbers) == 6  # B, -D, H
    assert [float(x) for x in numbers[1:3]] == [0.0, 1.0]  # -D with B, and with itself
    assert float(numbers[3]) == pytest.approx(fit.statistics.correlations[0, 1], abs=1e-7)  # as printed


def test_a_tied_constant_need_not_be_in_the_start(call, folder, seen):
    write_csv(folder / "x.csv", seen)
    start = "A=5213 B=1897 C=1402 DeltaJ=2e-4 deltaJ=5e-5 DeltaJK=-1e-3 MHz"
    common = ("fit", "x.csv", "--constants", start, "--free", "A,B,C,DeltaJ,DeltaJK,deltaJ", "--out", "t")
    code, _, err = call(*common, "--tie", f"deltaK={9.3 / 0.51}*deltaJ")
    assert code == 0, err
    assert {path.name for path in folder.iterdir()} == {"x.csv", "t.fit", "t.toml", "t.par", "t.var"}
    file = read_par(folder / "t.par")
    assert [p.constrained for p in file.parameters if p.code == 41000] == [True]
    assert file.options[0].knmax == 99  # more than was measured: SPCAT leaves higher K out of what it predicts
    code, _, err = call(*common, "--tie", "DeltaQ=2*deltaJ")
    assert code == 2
    assert "--tie 'DeltaQ=2*deltaJ': 'DeltaQ' is not a rotational constant known here" in err


def test_the_report_has_what_each_line_moves(call, folder, seen):
    """DFBETAS by leaving the line out and fitting again; linear, so that a tenth is a wide bound."""
    import json

    few = seen.take(np.arange(0, len(seen), 9))
    write_csv(folder / "x.csv", few)
    start = "A=5213.4471 B=1897.2265 C=1401.8812 DeltaJ=2e-4 DeltaJK=-1.11e-3 deltaJ=5.1e-5 deltaK=9.3e-4 MHz"
    common = ("fit", "x.csv", "--constants", start, "--free", "A,B,C,DeltaJ")
    code, out, err = call(*common, "--out", "t", "--json", "t.json")
    assert code == 0, err
    content = json.loads((folder / "t.json").read_text(encoding="utf-8"))
    moved = np.array([line["dfbetas"] for line in content["lines"]])
    worst = int(np.abs(moved).max(axis=1).argmax())
    text = (folder / "t.fit").read_text(encoding="utf-8")
    assert "asymmetric top, A-reduction, Ir" in text
    assert text.split("INFLUENCE")[1].splitlines()[1].startswith(f"line {worst + 1}, ")
    write_csv(folder / "less.csv", few.take(np.arange(len(few)) != worst))
    call("fit", "less.csv", *common[2:], "--json", "less.json")
    less = json.loads((folder / "less.json").read_text(encoding="utf-8"))
    for k, (whole, rest) in enumerate(zip(content["parameters"], less["parameters"], strict=True)):
        change = (whole["value"] - rest["value"]) / (whole["error"] * less["reduced_chi"])
        assert moved[worst, k] == pytest.approx(change, abs=0.02)  # of a standard error: what is not linear
    assert ("influential, line" in out) == (np.abs(moved).max() > 1)


TWO_STATES = """two states
   8   30   20    0    0.0E+000    1.0E+006    1.0E+000 1.0
a    1    2    0   20    0    1    1    1   -1    -1   1
a    1    1    0   20    0    1    1    1    0    -1   1
        10099  5.2134471E+03 1.0E+36 /A
        20000  1.8972265E+03 1.0E+36 /B
        20011  1.8900000E+03 1.0E+36 /B
        30099  1.4018812E+03 1.0E+36 /C
          299 -2.1200000E-04 1.0E+36 /-DJ
        41099 -9.3000000E-04 1.0E-37 /-dK
        40199 -5.1000000E-05 1.0E+36 /-dJ
       -40111  1.0200000E-05 1.0E+36 /-dJ
"""


def test_the_table_of_several_states_has_every_parameter_with_its_state(seen, tmp_path):
    from rotor.formats.fits.fit_request import answer_fit, fit_report, fit_table, spfit_request

    (tmp_path / "two.par").write_text(TWO_STATES)
    rows = []
    for v, b in ((0, 1897.2265), (1, 1890.0)):
        deltas = TRUE["deltaJ"] * (0.8 if v else 1.0)
        for lines in lines_with_v(lines_of(TRUE.replace(B=b, DeltaJK=0.0, deltaJ=deltas)), v):
            rows.append(lines)
    (tmp_path / "two.lin").write_text("".join(rows))
    header = TWO_STATES.replace("   8   30", f"   8 {len(rows):4d}")
    (tmp_path / "two.par").write_text(header)
    answer = answer_fit(spfit_request(str(tmp_path / "two.par")))
    assert answer.fit.converged
    assert answer.fit.parameters.names == ("A", "B (20000)", "B (20011)", "C", "-DJ", "-dJ")
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in fit_table(answer, "markdown").splitlines()]
    by_name = {(row[0], row[1]): row[3] for row in cells if len(row) == 4}
    assert by_name["δK", "all"] == "0.93 (held)"  # kHz, with the sign of the publication
    assert by_name["δJ", "1"].startswith("-1")
    assert by_name["δJ", "1"].endswith("(follows -dJ)")
    assert float(by_name["B", "1"].partition("(")[0]) == pytest.approx(1890.0, abs=3e-4)  # four standard errors
    assert by_name["B", "0"].startswith("1897.22")
    section = fit_report(answer).split("PARAMETERS OF THE FILE")[1].splitlines()
    assert len(section[1 : section.index("")]) == 8
    assert section[8].split()[1:3] == ["-40111", "-dJ"]


def lines_with_v(lines: Assignments, v: int) -> list[str]:
    """Lines of a .lin file with the state v behind the quantum numbers."""
    rows = zip(lines.upper.tolist(), lines.lower.tolist(), lines.frequency_mhz.tolist(), strict=True)
    return [f"{''.join(f'{n:3d}' for n in (*u, v, *low, v)):36s} {f:15.6f} 0.003\n" for u, low, f in rows]


def test_the_errors_of_the_table_may_be_those_of_the_scatter(call, folder, seen):
    write_csv(folder / "x.csv", seen)
    start = "A=5213 B=1897 C=1402 DeltaJ=2e-4 DeltaJK=-1.11e-3 deltaJ=5.1e-5 deltaK=9.3e-4 MHz"
    common = (
        "fit",
        "x.csv",
        "--constants",
        start,
        "--free",
        "A,B,C",
        "--tie",
        "DeltaJ=1e-7*B",
        "--default-error",
        "0.01",
    )
    for name in ("stated", "scatter"):
        assert call(*common, "--poor-rms", "1e9", "--table", f"{name}.tex", "--table-errors", name)[0] == 0
    stated, scatter = ((folder / f"{name}.tex").read_text(encoding="utf-8") for name in ("stated", "scatter"))
    assert "scaled by the scatter" in scatter
    assert "scaled" not in stated
    assert stated.splitlines()[4] != scatter.splitlines()[4]
    assert "(follows $B$)" in stated
    assert "$-1.11$ (held)" in stated  # kHz
    code, _, err = call(*common, "--table", "x.tex", "--table-errors", "both")
    assert code == 2
    assert "--table-errors: 'both': expected one of stated, scatter" in err


def test_what_is_not_written_is_said(call, folder, seen):
    write_csv(folder / "x.csv", lines_of(TRUE, shift=0.0))
    code, _, err = call(
        "fit", "x.csv", "--constants", "A=5213 B=1897 C=1402 MHz", "--free", "A,B,C", "--poor-rms", "1", "--out", "t"
    )
    assert code == 1
    assert "t.toml, t.par, t.var are not written: not converged" in err
    assert [path.name for path in sorted(folder.glob("t.*"))] == ["t.fit"]


def test_levels_that_have_become_another_state_are_named(seen):
    """D_K of the start takes K = 4 below K = 2 of one block: labels stay with block and rank, and the flip is said."""
    true = Constants(A=10e3, B=3001.0, C=2999.0, DJ=1e-3, DK=0.1, reduction="S")
    lines = lines_of(true)
    start = true.replace(DK=900.0)
    fit = fit_lines(lines, start, parameters(start, ["A", "B", "C", "DK"]))
    assert fit.converged
    assert abs(fit.constants["DK"] - 0.1) < 5 * fit.constants.uncertainties["DK"]
    assert "4 2 3" in fit.changed_states
    assert "4 4 1" in fit.changed_states
    assert any("levels are mostly another state than at the start (by overlap)" in text for text in fit.notes)


def test_lengths_beside_bonds_do_not_lie_on_atoms():
    from rotor.molecules.molecule import Molecule
    from rotor.plots.structure import structure_figure
    from rotor.structures.substitution import Value

    z = (-2.96, -1.9, -0.69, 0.69, 1.84)
    chain = Molecule(("H", "C", "C", "C", "N"), [[x, 0, 0] for x in z])
    values = [Value(f"r{i}", (i, i + 1), z[i] - z[i - 1], 1e-4, "Å") for i in range(1, 5)]
    figure = structure_figure(chain, values=values)
    axes = figure.axes[0]
    figure.canvas.draw()
    texts = [text for text in axes.texts if "(" in text.get_text()]
    assert len(texts) == 4
    circles = [patch.get_window_extent() for patch in axes.patches]
    assert not any(text.get_window_extent().overlaps(circle) for text in texts for circle in circles)


def test_lengths_of_two_bonds_of_one_atom_do_not_overlap():
    from rotor.molecules.molecule import Molecule
    from rotor.plots.structure import structure_figure
    from rotor.structures.substitution import Value

    places = [[0, 0, 0.602], [0, 0, -0.605], [0.943, 0, 1.181], [-0.943, 0, 1.181]]  # formaldehyde
    values = [Value("CO", (1, 2), 1.2069, 4e-4, "Å"), Value("CH", (1, 3), 1.1057, 8e-4, "Å")]
    figure = structure_figure(Molecule(("C", "O", "H", "H"), places), values=values)
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts if "(" in text.get_text()]
    assert len(boxes) == 3
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_a_line_with_exchanged_levels_is_named_though_it_spoils_the_constants(seen):
    upper, lower = seen.upper.copy(), seen.lower.copy()
    upper[84], lower[84] = seen.lower[84], seen.upper[84]
    fit = fit_lines(replace(seen, upper=upper, lower=lower), TRUE, parameters(TRUE, ["A", "B", "C", "DeltaJ"]))
    assert not fit.converged
    named = [text for text in fit.notes if "are upper and lower exchanged?" in text]
    assert len(named) == 1
    assert named[0].startswith("line 85, ")


@pytest.mark.parametrize(
    ("sign", "words"), [(";", "its columns are separated by ';'; expected commas"), ("\t", "separated by '\\\\t'")]
)
def test_a_table_with_other_signs_between_its_columns_is_named(call, folder, seen, sign, words):
    write_csv(folder / "x.csv", seen)
    (folder / "y.csv").write_text((folder / "x.csv").read_text().replace(",", sign))
    code, _, err = call("fit", "y.csv", "--constants", "A=5213 B=1897 C=1402 MHz", "--free", "A,B,C")
    assert code == 2
    assert words.replace("\\\\", "\\") in err


TURNING = """constants = { A = 9200.0, B = 3000.0, C = 2310.0 }
dipole = { a = 1.5, b = 1.0 }
[spins.14N]
chi_aa = 1.9
[internal_rotation]
frame = "PAM"
F0 = 160000.0
delta = 0.6
V3 = 9e6
"""


def test_a_fit_of_a_methyl_group_names_what_was_meant_and_what_is_not_written(call, folder):
    """Names typed nearly right, a table separated by semicolons, and the files of SPFIT, which has no internal rotation."""
    (folder / "top.toml").write_text(TURNING)
    assert (
        call("spectrum", "top.toml", "--jmax", "3", "--temperature", "2", "--hyperfine", "--csv", "lines.csv")[0] == 0
    )
    names = (folder / "lines.csv").read_text().splitlines()[0].split(",")
    kept = [i for i, name in enumerate(names) if (name.endswith(("_upper", "_lower")) and name != "g_upper") or i == 0]
    rows = [line.split(",") for line in (folder / "lines.csv").read_text().splitlines()]
    table = [",".join([*(row[i] for i in kept), "error_mhz" if n == 0 else "0.001"]) for n, row in enumerate(rows)]
    (folder / "seen.csv").write_text("\n".join(table) + "\n")
    (folder / "semicolons.csv").write_text("\n".join(table).replace(",", ";") + "\n")
    for free, meant in (("A,V_3", "V3"), ("A,chi_aa", "chi_aa(14N)"), ("A,DJ,v3", "V3")):
        code, _, err = call("fit", "seen.csv", "--start", "top.toml", "--free", free)
        assert (code, f"did you mean {meant}?" in err) == (2, True), err
    code, _, err = call("fit", "semicolons.csv", "--start", "top.toml", "--free", "A")
    assert (code, "its columns are separated by ';'; expected commas" in err) == (2, True), err
    code, shown, _ = call("fit", "seen.csv", "--start", "top.toml", "--free", "A,delta", "--table", "fit.tex")
    assert (code, "value (MHz; delta in rad)" in shown) == (0, True), shown
    assert "$\\delta$ & rad &" in (folder / "fit.tex").read_text()
    code, _, err = call("fit", "seen.csv", "--start", "top.toml", "--free", "A,B,C", "--out", "fitted")
    assert (code, "fitted.par, fitted.var are not written: internal rotation: SPFIT's" in err) == (0, True), err


def test_constants_of_spins_and_states_among_those_of_the_rotation_name_their_option(call):
    for name, option in (
        ("chi_aa(14N)", "--spin-constants"),
        ("E[1]", "--state-constants"),
        ("chi_aa", "--spin-constants"),
    ):
        code, _, err = call("spectrum", "--constants", f"A=9 B=4 C=3 GHz {name}=2 MHz", "--dipole-abc", "1,0,0")
        assert (code, option in err) == (2, True), err


def write_csv(path, lines: Assignments) -> None:
    rows = zip(lines.upper.tolist(), lines.lower.tolist(), lines.frequency_mhz.tolist(), strict=True)
    path.write_text(HEAD + "".join(f"{','.join(map(str, [*u, *low]))},{f:.5f},0.003\n" for u, low, f in rows))


@pytest.mark.parametrize(
    ("step", "name"),
    [("try_constants", "try_constants"), ("suggest_lines", "suggest"), ("_bootstrap", "bootstrap")],
)
def test_an_interrupt_beside_a_fit_leaves_what_is_done(step, name, monkeypatch):
    def interrupted(*_args, **_options):
        raise KeyboardInterrupt

    rows = [[j + 1, j, 2 * 6000.0 * (j + 1) + 0.01 * (-1) ** j, 0.01] for j in range(6)]
    answer = answer_fit(lines_request(rows, rotor.Top.from_constants("B=6000 MHz"), ["B"]))
    monkeypatch.setattr(fit_further, step, interrupted)
    further = fit_further.with_further(answer, ["D"], "B", 10, 0)
    assert further.interrupted == f"{name} is not complete"
    assert further.fit is answer.fit
    assert len(further.trials) == (name != "try_constants")


def test_influential_lines_are_named_the_worst_first():
    rows = [
        [j + 1, j, 2 * 6000.0 * (j + 1) + 0.01 * error, 0.01]
        for j, error in enumerate((1, -1, 2, 0, -3, 1, 0, 2, -1, 4))
    ]
    fit = answer_fit(lines_request(rows, rotor.Top.from_constants("B=6000 MHz"), ["B"])).fit
    moved = np.abs(dfbetas(fit)).max(axis=1)
    named = [int(text.split(",")[0].removeprefix("line ")) - 1 for text in influential(fit, 0.0)]
    assert named == np.argsort(-moved, kind="stable")[:5].tolist()


def test_frequencies_and_errors_in_another_unit_are_said(seen):
    fit = fit_lines(replace(seen, frequency_mhz=seen.frequency_mhz * 1e3), TRUE, parameters(TRUE, ["A", "B", "C"]))
    assert (
        "the lines have 1e+03 times the frequencies of the start; are both in the units that they state?" in fit.notes
    )
    error = seen.error_mhz.copy()
    error[4] = 61700.0  # of 149662,61700 in a .lin, read as a frequency and its error
    notes = fit_lines(replace(seen, error_mhz=error), TRUE, parameters(TRUE, ["A", "B", "C"])).notes
    said = [text for text in notes if "is there a comma in a decimal number?" in text]
    assert len(said) == 1
    assert said[0].startswith("line 5, ")
    assert not fit_lines(seen, TRUE, parameters(TRUE, ["A", "B", "C"])).notes
