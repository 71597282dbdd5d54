"""What a run refuses, its plan refuses, in the same words; what a run does, its plan does not refuse."""

import re

import pytest

HEAD = 'schema = 1\nkind = "{}"\n'
SEPARATRIX = "[body]\nmoments = [1.0, 2.0, 3.0]\nangular_momentum = [1.0, 0.3, 1.7320508075690504]\n"
DRIVEN = (
    "[body]\nmoments = [1.0, 2.0, 2.5]\nangular_velocity = [1.0, 2.0, 3.0]\n[[effects]]\n"
    'effect = "linear drag"\ncoefficients = [0.1, 0.1, 0.1]\n[conditions]\ntimes = "0:5:6"\n'
)
CO, OCS = 'molecule = "CO"\n', 'molecule = "OCS"\n'
LIGHT = '[[pulses]]\nshape = "gaussian"\npeak = "1e11 W/cm2"\nfwhm = 0.3\n[conditions]\ntemperature = 0\npoints = 11\n'
REFUSED = {
    "levels rounding": ("levels", 'accuracy = "1e-12 MHz"\n' + CO),
    "levels total": ("levels", 'accuracy = { total = "1 Hz" }\n' + OCS),
    "spectrum total": ("spectrum", 'accuracy = { total = "1 kHz" }\nmolecule = "SMILES:C=O"\n'),
    "raman total": ("raman", 'accuracy = { total = "1 Hz" }\nmolecule = "N2"\n'),
    "stark total": ("stark", 'accuracy = { total = "1 Hz" }\n' + OCS + '[conditions]\nfield = "0:10:3"\n'),
    "stark without dipole": ("stark", 'molecule = "N2"\n'),
    "zeeman total": (
        "zeeman",
        'accuracy = { total = "1 Hz" }\n' + OCS + "[magnetic]\ng = [-0.02]\n[conditions]\nfield = [0.0, 1.0]\n",
    ),
    "thermo total": ("thermo", 'accuracy = { total = "0.1 %" }\n' + CO),
    "thermo too hot": ("thermo", 'molecule = "water"\n[conditions]\ntemperature = "1e5 K"\n'),
    "align total": ("align", "accuracy = { total = 1e-3 }\n" + OCS + LIGHT),
    "driven total": ("tumble", 'accuracy = { total = "1e-6 rad" }\n' + DRIVEN),
    "free total": ("tumble", 'accuracy = { total = "1e-6 rad" }\n' + SEPARATRIX),
    "growth rate of a driven body": ("tumble", 'accuracy = "0.1 %"\n' + DRIVEN),
    "gas total": ("gas", 'accuracy = { total = "5 K" }\n' + OCS),
    "folder of a file": ("levels", CO + '[outputs]\ncsv = "nowhere/l.csv"\n'),
    "suffix of a file": ("levels", CO + '[outputs]\ncsv = "l.txt"\n'),
}
ALLOWED = {
    "separatrix": ("tumble", 'accuracy = "1e-6 rad"\n' + SEPARATRIX + "[conditions]\ntimes = [0.0, 1e13]\n"),
    "growth rate": ("tumble", 'accuracy = "1e-9 %"\n' + SEPARATRIX),
    "levels": ("levels", 'accuracy = "1 Hz"\n' + CO),
    "stark": ("stark", 'accuracy = "1 kHz"\n' + OCS + '[conditions]\nfield = "0:10:3"\n'),
    "thermo": ("thermo", 'accuracy = "0.1 %"\n' + CO),
    "driven": ("tumble", 'accuracy = "1e-6 rad"\n' + DRIVEN),
}


def outcomes(call, folder, scene) -> list[tuple[int, str]]:
    kind, body = scene
    (folder / "s.toml").write_text(HEAD.format(kind) + body)
    computed = [call(verb, "s.toml") for verb in ("plan", "run")]
    return [(code, " ".join(err.split())) for code, _, err in computed]


@pytest.mark.parametrize("case", REFUSED)
def test_a_plan_refuses_in_the_words_of_the_run(call, folder, case):
    plan, run = outcomes(call, folder, REFUSED[case])
    assert run[0] == 2
    assert plan == run


@pytest.mark.parametrize("case", ALLOWED)
def test_a_plan_refuses_nothing_that_runs(call, folder, case):
    assert [code for code, _ in outcomes(call, folder, ALLOWED[case])] == [0, 0]


def test_a_plan_says_that_a_fit_reaches_no_result(call, folder):
    """Lines of CO with B of another molecule: the plan is made, with a warning."""
    (folder / "l.csv").write_text(
        "frequency_mhz,error_mhz,j_upper,j_lower\n115271.2018,0.0005,1,0\n230538.0,0.0005,2,1\n345795.9899,0.0005,3,2\n"
    )
    (folder / "s.toml").write_text(
        HEAD.format("fit")
        + '[molecule]\nconstants = "B=57600 MHz"\n[lines]\nsource = "l.csv"\n[parameters]\nfree = ["B"]\n'
    )
    code, out, err = call("plan", "s.toml")
    assert code == 0, err
    assert "no result: not converged" in " ".join(out.split())
    assert call("run", "s.toml")[0] == 1


def test_a_plan_of_a_sweep_is_of_its_longest_point(call, folder):
    """Swept values and lists of molecules; each point is planned, so that there may not be many."""
    scene = HEAD.format("levels") + 'molecule = "{}"\n'
    (folder / "s.toml").write_text(scene.format("water") + '[sweep]\n"observables.jmax" = [2, 60]\n')
    code, out, err = call("plan", "s.toml")
    assert code == 0, err
    out = " ".join(out.split())
    assert re.search(r"points 2, \S+ s of processor time together; this is the longest: observables.jmax = 60", out)
    (folder / "list.csv").write_text("name\nCO\nHCl\n")
    (folder / "s.toml").write_text(scene.format("list.csv"))
    assert "points 2, " in " ".join(call("plan", "s.toml")[1].split())
    (folder / "list.csv").write_text("name\n" + "CO\n" * 21)
    code, _, err = call("plan", "s.toml")
    assert (code, err) == (
        2, "error: sweep: 21 points, of which 20 at most are planned: give fewer values or molecules for the plan\n",
    )  # fmt: skip
