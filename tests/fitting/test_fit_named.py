"""Fits of several states and of spins in named constants: from TOML and .csv, the same numbers as SPFIT's files give.

The frequencies are the package's own, with normal errors of 5 kHz. With the program SPFIT itself (compiled from its public source) the
constants of fits like these agreed to 5e-7 standard errors, errors to 3e-8, of two states with 14N, 35Cl with 14N, a doublet radical with
a proton, a linear molecule with 14N; to 1.2e-3 in two states of an oblate basis, where SPFIT ends its search before.
"""

from __future__ import annotations

import csv
import tomllib

import numpy as np
import pytest

import rotor
from rotor.fitting.assignment import Assignments
from rotor.fitting.choice.orders import j_order
from rotor.fitting.fit import fit_lines
from rotor.fitting.levels.top_levels import top_levels
from rotor.fitting.parameters import parameters, with_names
from rotor.fitting.search.first_values import beside_zero
from rotor.fitting.top_constants import TopConstants
from rotor.formats.fits.fit_request import answer_fit, lines_request
from rotor.formats.lines.assigned_lines import read_assigned_lines, write_assigned_lines
from rotor.formats.spcat.fits.fit_input import spfit_input
from rotor.formats.spcat.fits.fit_states import groups_for_fit, levels_in_blocks
from rotor.formats.spcat.fits.named_fit import named_file
from rotor.formats.spcat.names.named_parameters import named_parameters
from rotor.formats.spcat.text.lin import read_lin
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

TWO_STATES = """name = "two states"
constants = { A = 9000.0, B = 3000.0, C = 2500.0, DeltaJ = 0.001 }
dipole = { a = 1.0, b = 0.7 }
[states]
"E[1]" = 120.0
"A[1]" = 8990.0
"B[1]" = 3003.0
"C[1]" = 2501.0
"DeltaJ[1]" = 0.0011
"G_c[0,1]" = 20.0
dipoles = { "0,1" = [0, 0, 0.5] }
[spins.14N]
chi_aa = -4.0
chi_bb-cc = 1.2
"""
FREE = "A,B,C,DeltaJ,E[1],A[1],B[1],C[1],DeltaJ[1],G_c[0,1],chi_aa(14N),chi_bb-cc(14N)"
COMMAND = ("fit", "lines.csv", "--start", "start.toml", "--free", FREE, "--out", "fitted", "--table", "t.md")
ERROR_MHZ = 0.005
STATES = StateConstants.parse(
    "E[1]=100 A[1]=9000 B[1]=3001 C[1]=2501 DeltaJ[1]=0.001 G_c[0,1]=20 G_a[0,1]=7 F_ab[0,1]=0.4 W[0,1]=3 W_pm2_J[0,1]=0.01 "
    "F_bc_K[0,1]=0.02 G_b_J[0,1]=0.03 MHz"
)
SPINS = SpinConstants.parse(
    "chi_aa(14N)=-4 chi_bb-cc(14N)=1 chi_ab(14N)=2 chi_aa(14N)[1]=-0.1 C_aa(14N)=0.01 C_iso(H1)=0.02 C_bb-cc(H1)=0.01 "
    "C_ab(H1)=0.003 J(14N,H1)=0.05 T_aa(14N,H1)=0.2 T_bb-cc(14N,H1)=0.1 T_ac(14N,H1)=0.07 chi_bb-cc_J(14N)=0.001 MHz",
    "H1=1/2 14N=1",
)
TRIPLET = SpinConstants.parse(
    "eps_aa(S)=-40 eps_bb(S)=30 eps_cc(S)=2 D_aa(S)=100 D_bb-cc(S)=20 b_F(S,H1)=50 T_aa(S,H1)=5 T_bb-cc(S,H1)=2 eps_aa_S(S)=0.01 "
    "lambda(S)=9 MHz",
    "S=1 H1=1/2",
)
PROLATE = Constants(A=9000.0, B=3000.0, C=2500.0, DeltaJ=0.001)
OBLATE = Constants(A=9000.0, B=8000.0, C=4000.0, representation="IIIl")
TOPS = {
    "states": Top(PROLATE, states=STATES),
    "states and spins": Top(PROLATE, states=STATES, spin_constants=SPINS),
    "triplet, oblate": Top(OBLATE, spin_constants=TRIPLET),
    "states, oblate": Top(
        OBLATE,
        states=StateConstants.parse(
            "E[1]=100 A[1]=9001 B[1]=8001 C[1]=4001 G_c[0,1]=20 G_a[0,1]=8 F_bc[0,1]=0.7 F_ab[0,1]=0.4 MHz"
        ),
    ),
    "symmetric": Top.from_constants(
        "A=9 B=3 GHz", spin_constants=SpinConstants.parse("chi_aa(35Cl)=-40 C_iso(35Cl)=0.01")
    ),
    "linear": Top.from_constants("B=3000 D=1e-3", spin_constants=SpinConstants.parse("chi_aa(14N)=-4 C_iso(14N)=0.01")),
}


def named(kind: str) -> TopConstants:
    top = TOPS[kind]
    return TopConstants(top, top.spin_constants is not None)


def write_lines(path, constants: TopConstants, count: int, seed: int = 3) -> None:
    """A .csv of some lines up to N = 3, by the names of the levels, with normal errors."""
    lines = line_list(constants.top, jmax=3, min_lgint=-9, q=1e5, range_mhz=(2e3, 1e5), effects=constants.effects)
    rng = np.random.default_rng(seed)
    chosen, quanta = np.sort(rng.choice(len(lines), min(count, len(lines)), replace=False)), lines.levels.quanta
    heads = [f"{name}_{side}" for side in ("upper", "lower") for name in constants.quanta]
    with open(path, "w", newline="") as handle:
        writer = csv.writer(handle)
        writer.writerow([*heads, "frequency_mhz", "error_mhz"])
        for i in chosen.tolist():
            labels = [quanta[name][rows[i]] for rows in (lines.upper, lines.lower) for name in constants.quanta]
            writer.writerow([*map(int, labels), round(lines.frequency_mhz[i] + ERROR_MHZ * rng.normal(), 4), ERROR_MHZ])


@pytest.fixture
def case(folder):
    """lines.csv of two states with 14N, true.toml, and start.toml, which is off by hundreds of errors."""
    (folder / "true.toml").write_text(TWO_STATES)
    start = (
        TWO_STATES.replace("9000.0", "9000.4")
        .replace("3003.0", "3003.1")
        .replace("= 20.0", "= 19.0")
        .replace("-4.0", "-3.9")
    )
    (folder / "start.toml").write_text(start)
    write_lines(folder / "lines.csv", TopConstants(rotor.read("true.toml"), True), 100)
    return folder


def names(text: str) -> list[str]:
    """Of a list with commas in brackets too."""
    return text.replace("[0,1]", "[0;1]").replace(",", " ").replace(";", ",").split()


@pytest.mark.parametrize("kind", TOPS)
def test_levels_and_derivatives_are_those_of_a_prediction(kind):
    constants = named(kind)
    levels = solve_levels(constants.top, 1, effects=constants.effects)
    labels = np.stack([levels.quanta[name] for name in constants.quanta], axis=1)
    energies, slopes = top_levels(constants, labels).levels(np.array(list(constants.values.values())))
    assert energies == pytest.approx(levels.energy_mhz, abs=1e-8)  # round-off of energies of 1e5 MHz
    expected = level_derivatives(constants.top, levels, tuple(constants.values))
    assert slopes == pytest.approx(expected, abs=1e-8)  # round-off; two levels 1e-3 MHz apart mix by it


@pytest.mark.parametrize("kind", TOPS)
def test_the_codes_of_names_make_the_same_levels(kind):
    constants = named(kind)
    file, matrix = named_parameters(constants, "", 99)
    assert matrix @ np.array(list(constants.values.values())) == pytest.approx(
        [p.value for p in file.parameters], rel=1e-14
    )
    levels = solve_levels(constants.top, 1 if kind == "states and spins" else 3, effects=constants.effects)
    total = sorted(set((levels.multiplicity - 1).tolist()))
    computed = [levels_in_blocks(group, total) for group in groups_for_fit(file)]
    inside = levels.rotational <= 1  # of higher N the two lists do not have the same F
    ours = sorted(zip((levels.multiplicity - 1)[inside], levels.energy_mhz[inside], strict=True))
    theirs = sorted(
        pair
        for entry in computed
        for pair in zip(
            (entry.multiplicity - 1)[entry.rotational <= 1], entry.energy_mhz[entry.rotational <= 1], strict=True
        )
    )
    if kind == "symmetric":  # both signs of K are one row here and one row there
        assert len(ours) == len(theirs)
    assert np.array(ours) == pytest.approx(np.array(theirs), abs=1e-8)  # round-off of energies of 1e5 MHz


def test_the_same_fit_as_from_spfits_files(case):
    answer = answer_fit(lines_request("lines.csv", rotor.read("start.toml"), names(FREE)))
    fit = answer.fit
    assert fit.converged
    assert 0.7 < fit.weighted_rms < 1.3  # of 88 degrees of freedom: three standard deviations are 0.23
    write_assigned_lines(fit.lines, "case.lin")
    file = named_file(fit, "case", variances=False)
    start, matrix = named_parameters(TopConstants(rotor.read("start.toml"), True), "", 9)
    begin = tuple(p.__class__(p.code, s.value, 1e36) for p, s in zip(file.parameters, start.parameters, strict=True))
    fit_input = spfit_input(file.__class__("", file.header, file.options, begin), read_lin("case.lin", 5))
    other = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )
    values = matrix @ np.array(list(fit.named.values.values()))
    assert np.abs((values - other.values) / other.errors).max() < 1e-6  # where either search ends
    covariance = matrix @ fit.covariance.matrix_mhz2 @ matrix.T
    assert np.sqrt(np.diag(covariance)) == pytest.approx(other.errors, rel=1e-7)  # likewise
    true = np.array(list(TopConstants(rotor.read("true.toml"), True).values.values()))
    assert np.abs((fit.values - true) / fit.errors).max() < 4  # of 12 normal numbers


def test_the_file_of_a_fit_gives_its_lines_their_errors(case):
    answer = answer_fit(lines_request("lines.csv", rotor.read("start.toml"), names(FREE), start="start.toml"))
    rotor.formats.fits.fit_request.write_fitted_toml(answer, "fitted.toml")
    content = tomllib.loads((case / "fitted.toml").read_text())
    assert content["covariance"]["names"] == names(FREE)
    assert set(content["states"]["G_c[0,1]"]) == set(content["spins"]["14N"]["chi_aa"]) == {"value", "uncertainty"}
    top, fit = rotor.read("fitted.toml"), answer.fit
    constants = TopConstants(top, True)
    assert dict(constants.values) == pytest.approx(dict(fit.named.values), rel=1e-15)
    assert dict(constants.uncertainties) == pytest.approx(dict(fit.named.uncertainties), rel=1e-15)
    lines = line_list(top, jmax=3, min_lgint=None, q=1e5, effects=constants.effects)
    pairs = zip(fit.lines.upper.tolist(), fit.lines.lower.tolist(), strict=True)
    known = {(*u, *low): e for (u, low), e in zip(pairs, fit.calculated_errors_mhz, strict=True)}
    labels = np.stack([lines.levels.quanta[name] for name in constants.quanta], axis=1)
    both = np.concatenate([labels[lines.upper], labels[lines.lower]], axis=1).tolist()
    errors = [(known[tuple(row)], e) for row, e in zip(both, lines.error_mhz, strict=True) if tuple(row) in known]
    assert len(errors) == len(fit.lines)
    ours, predicted = np.array(errors).T
    assert predicted == pytest.approx(ours, rel=1e-6)  # the covariance is stored as correlations
    plain = line_list(top, jmax=3, min_lgint=None, q=1e5, effects=rotor.quantum.effects.of_top.effects_of(top, False))
    assert plain.error_mhz is not None  # constants of spins have no part in lines without them
    assert "chi_aa" not in plain.errors_from


def test_a_coupling_that_starts_at_zero_is_found(case):
    start = TWO_STATES.replace('"G_c[0,1]" = 20.0\n', "")
    (case / "zero.toml").write_text(start)
    request = lines_request("lines.csv", rotor.read("zero.toml"), names(FREE))
    assert "only the square of these" in request.notes[-1]
    fit = answer_fit(request).fit
    assert abs(abs(fit.named["G_c[0,1]"]) - 20.0) < 4 * fit.named.uncertainties["G_c[0,1]"]
    same, moved = beside_zero(with_names(fit.named, ["C_aa(14N)"]), ["C_aa(14N)"], fit.lines)
    assert not moved  # lines know its sign
    assert same["C_aa(14N)"] == 0.0


def test_half_integers_are_read_in_three_ways(folder):
    head = "n_upper,f_upper,n_lower,f_lower,frequency_mhz,error_mhz\n"
    (folder / "l.csv").write_text(head + "1,5/2,0,3/2,10,1\n1,2.5,0,1.5,11,1\n1,5,0,3,12,1\n")
    lines, _ = read_assigned_lines("l.csv", ("n", "f"), {"f"})
    assert lines.upper.tolist() == [[1, 5]] * 3
    assert lines.lower.tolist() == [[0, 3]] * 3
    assert lines.text(0) == "1 5/2 - 0 3/2"
    for suffix in ("csv", "lin"):
        write_assigned_lines(lines, f"m.{suffix}")
        again, _ = read_assigned_lines(f"m.{suffix}", ("n", "f"), {"f"})
        assert again.upper.tolist() == lines.upper.tolist()
        assert again.lower.tolist() == lines.lower.tolist()
    (folder / "l.csv").write_text(head + "1,2,0,3/2,10,1\n")
    with pytest.raises(ValueError, match=r"f_upper reads '2'; expected a half-integer: 5/2, 2\.5"):
        read_assigned_lines("l.csv", ("n", "f"), {"f"})
    with pytest.raises(ValueError, match="f_lower reads '3/2'; expected a whole number"):
        read_assigned_lines("l.csv", ("n", "f"))


def test_orders_of_constants():
    constants = named("states and spins")
    orders = {
        "E[1]": 0,
        "A[1]": 2,
        "DeltaJ[1]": 4,
        "G_c[0,1]": 1,
        "G_b_J[0,1]": 3,
        "F_ab[0,1]": 2,
        "W[0,1]": 0,
        "W_pm2_J[0,1]": 4,
    }
    orders |= {"chi_aa(14N)": 0, "chi_bb-cc_J(14N)": 2, "C_aa(14N)": 1, "B": 2}
    assert {name: j_order(name, constants) for name in orders} == orders


def test_ties_of_names_with_brackets():
    constants = named("states and spins")
    ties = ["A[1] = A - 10", "chi_bb-cc(14N)=-0.25*chi_aa(14N)", "G_a[0,1] = 2*G_c[1,0]"]
    tied_parameters = parameters(constants, ["A", "chi_aa(14N)", "G_c[0,1]"], ties=ties)
    by_name = dict(
        zip(tied_parameters.constant_names, tied_parameters.to_constants(np.array([9.0, 4.0, 3.0])), strict=True)
    )
    assert (by_name["A[1]"], by_name["chi_bb-cc(14N)"], by_name["G_a[0,1]"]) == (-1.0, -1.0, 6.0)


def test_the_command_fit_names_constants_of_states_and_spins(case, call):
    code, _, err = call(*COMMAND)
    assert code == 0, err
    table = (case / "t.md").read_text()
    assert "| ΔJ[1] | kHz |" in table
    assert "| χ_aa(14N) | MHz |" in table
    assert "1.5*chi_aa(14N)" in (case / "fitted.par").read_text()
    code, _, err = call("spectrum", "fitted.toml", "--hyperfine", "--jmax", "2", "--q", "1e4", "--csv", "p.csv")
    assert code == 0, err
    assert "error_mhz" in (case / "p.csv").read_text().partition("\n")[0]


@pytest.mark.slow
def test_the_command_with_advice(case, call):
    advice = ("--plot", "r.png", "--suggest", "G_c[0,1]", "--try", "chi_ab(14N),DeltaJ[1]", "--bootstrap", "5")
    code, out, err = call(*COMMAND, *advice, "--save-lines", "l.lin", "--json", "f.json", "--save-scene", "s.toml")
    assert code == 0, err
    assert "chi_ab(14N)" in out.partition("tried")[2]
    assert "lines that would help most" in out
    before = (case / "fitted.toml").read_bytes()
    (case / "again").mkdir()
    code, _, err = call("run", "s.toml", "--out", "again")
    assert code == 0, err
    assert (case / "again" / "fitted.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("free", "said"),
    [
        ("A,B[2]", "--free: B[2]: there is no state 2; the constants to start from have 2, counted from 0"),
        ("A,G_c[0,2]", "--free: G_c[0,2]: there is no state 2"),
        ("G_c[0,1],G_c[1,0]", "--free: G_c[0,1] and G_c[1,0] are one constant"),
        ("A,chi_aa(15N)", "--free: chi_aa(15N): there is no spin 15N; the constants to start from have 14N"),
        ("A,Q[1]", "--free: Q[1]: a state of this asymmetric top has E, A, B, C,"),
        ("A,A[0]", "--free: A[0]: state 0 is the top's own, whose constants have no brackets"),
        ("A,foo(14N)", "--free: foo(14N): known constants of spins are chi_aa,"),
        ("A,chis_aa(14N)", "and 46 more; did you mean chi_aa"),
        ("A,mu_q", "--free: 'mu_q' is not a rotational constant"),
        ("A,d_q[1]", "--free: d_q[1]: a state of this asymmetric top has E,"),
        ("A,Z_c[0,1]", "--free: Z_c[0,1]: couplings of two states are G_a,"),
    ],
)
def test_wrong_names_are_one_line(case, call, free, said):
    code, _, err = call("fit", "lines.csv", "--start", "start.toml", "--free", free, "--out", "fitted")
    assert (code, err.count("\n")) == (2, 1)
    assert said in err
    assert not (case / "fitted.toml").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("v_upper", "v_over"),
            "no column v_upper; columns are n_upper, ka_upper, kc_upper, v_upper, f_upper, n_lower",
        ),
        (("f_upper", "f_over"), "no column f_upper; columns are n_upper"),
    ],
)
def test_wrong_columns_are_one_line(case, call, change, said):
    text = (case / "lines.csv").read_text()
    (case / "lines.csv").write_text(text.replace(*change))
    code, _, err = call("fit", "lines.csv", "--start", "start.toml", "--free", "A")
    assert (code, err.count("\n")) == (2, 1)
    assert said in err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"G_c[0,1]" = 20.0', '"G_c[0,1]" = 20.0\n"G_c[1,0]" = 1.0', "[states]: G_c[0,1] and G_c[1,0] are one coupling; give it once"),
        ("chi_aa = -4.0", '"chi_aa[4]" = 1.0\nchi_aa = -4.0', "chi_aa(14N)[4]: there is no state 4"),
        ("[spins.14N]\nchi_aa = -4.0\nchi_bb-cc = 1.2\n", "", "the constants to start from have none; give them there"),
        ('DeltaJ = 0.001 }', "}", 'DeltaJ[1]: the constants of the first state are rigid and have no reduction'),
    ],
)  # fmt: skip
def test_wrong_files_are_one_line(case, call, old, new, said):
    assert old in TWO_STATES
    (case / "start.toml").write_text(TWO_STATES.replace(old, new).replace(", }", " }"))
    code, _, err = call("fit", "lines.csv", "--start", "start.toml", "--free", "A")
    assert (code, err.count("\n")) == (2, 1), err
    assert said in err


def test_lines_by_other_labels_than_those_of_the_start_are_refused():
    lines = Assignments.from_rows(("j",), [[1, 0, 12000.0, 0.01], [2, 1, 24000.0, 0.01]])
    with pytest.raises(ValueError, match="labels j: expected j, ka, kc, those of the start"):
        lines_request(lines, Top.from_constants("A=9 B=6 C=5 GHz"), ["B"])
