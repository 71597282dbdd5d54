"""Scenes of fits and of emission: the same bytes as the verbs, plans, and what cannot be."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

from rotor.scenes.accuracy_sweep import work_precision
from rotor.scenes.plan import plan_of
from rotor.scenes.run import run_scene
from rotor.scenes.scene import make_scene, parse_scene, read_scene, write_scene
from rotor.verbs.common.calculation import NoResultError

DATA = ORACLES / "fits"
OCS = ("--constants", "B=6081 D=0.001 H=0 MHz")


@pytest.fixture
def lines(folder):
    for name in ("ocs.csv", "co.par", "co.lin"):
        shutil.copy(DATA / name, folder)
    return folder


@pytest.mark.parametrize(
    "options",
    [
        ("ocs.csv", *OCS, "--free", "B,D,H", "--reject", "9", "--loss", "huber", "--poor-rms", "5"),
        ("ocs.csv", *OCS, "--free", "B,D", "--tie", "H=-6.883e-8*D", "--prior", "D=3kHz", "--default-error", "10kHz", "--iterations", "30"),
        ("co.par",),
        ("co.par", "--lin", "co.lin"),
    ],
)  # fmt: skip
def test_a_saved_fit_gives_the_same_bytes(call, lines, options):
    """No tolerance: the same request is answered by the same code."""
    files = ["t.md", "l.csv"]
    if "--tie" not in options:  # tied constants have no .par
        options, files = (*options, "--out", "out"), [*files, "out.fit", "out.toml", "out.par", "out.var"]
    code, _, err = call("fit", *options, "--table", "t.md", "--save-lines", "l.csv", "--save-scene", "s.toml")
    assert code == 0, err
    before = {name: (lines / name).read_bytes() for name in files}
    (lines / "again").mkdir()
    code, _, err = call("run", "s.toml", "--out", "again")
    assert code == 0, err
    assert {name: (lines / "again" / name).read_bytes() for name in files} == before
    again = read_scene("s.toml")
    write_scene(again, "t.toml")
    assert read_scene("t.toml") == again


def test_a_scene_of_a_fit_saved_elsewhere_finds_its_files(call, lines):
    (lines / "scenes").mkdir()
    assert call("fit", "ocs.csv", *OCS, "--free", "B,D,H", "--save-scene", "scenes/s.toml")[0] == 0
    assert read_scene("scenes/s.toml").content["lines"]["source"] == "../ocs.csv"
    assert len(run_scene(read_scene("scenes/s.toml"), folder="scenes").table) == 3


def test_a_choice_of_constants_is_no_scene(call, lines):
    code, _, err = call("fit", "ocs.csv", *OCS, "--free", "B", "--choose", "D", "--save-scene", "s.toml")
    assert code == 2
    assert "--choose: a scene holds no choice of constants" in err
    assert not Path("s.toml").exists()


START = {"constants": "B=6081 D=0.001 H=0 MHz"}
BAD = [
    (make_scene("fit", lines={"source": "none.csv"}, molecule=START), "lines.source: none.csv: no such file"),
    (make_scene("fit", lines={"source": "ocs.csv"}), "molecule: expected the starting constants"),
    (make_scene("fit", lines={"source": "ocs.csv"}, molecule=START), "parameters.free: name the constants to fit"),
    (make_scene("fit", lines={"source": "ocs.csv", "lin": "co.lin"}, molecule=START), "lines.lin: expected with a .par file"),
    (make_scene("fit", lines={"source": "co.par"}, molecule=START), "a .par file states the free"),
    (
        make_scene("fit", lines={"source": "ocs.csv"}, molecule=START, parameters={"free": ["B"], "priors": {"B": "1 bar"}}),
        "parameters.priors.B: '1 bar'",
    ),
    (
        make_scene("fit", lines={"source": "ocs.csv"}, molecule=START, parameters={"free": ["B"]}, numerics={"loss": "l1"}),
        "numerics.loss 'l1'",
    ),
    (make_scene("emission", molecules=[]), "molecules: expected one molecule or more"),
    (make_scene("emission", molecules=[{"source": "nonesuch"}]), "molecules[0]: molecule.source: 'nonesuch'"),
    (make_scene("emission", molecules=[{"source": "CO"}]), "conditions.range: expected a range or a band"),
    (
        make_scene("emission", molecules=[{"source": "CO"}], conditions={"band": "ALMA3", "filling": 2.0}),
        "conditions.filling: 2: expected a number above 0 and up to 1",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "said"), BAD, ids=[said for _, said in BAD])
def test_what_cannot_be_is_refused_with_its_key(lines, scene, said):
    with pytest.raises(ValueError, match=r".") as caught:
        run_scene(scene)
    assert said in str(caught.value)


def test_an_unknown_key_of_a_list_of_tables_is_named():
    text = 'schema = 1\nkind = "emission"\n[[molecules]]\nsource = "CO"\ncolunm = 1.0\n'
    with pytest.raises(ValueError, match=r"molecules\[0\] has no key 'colunm'; the nearest is 'column'"):
        parse_scene(text)


def test_a_fit_that_is_no_result_writes_nothing(call, lines):
    scene = make_scene(
        "fit",
        lines={"source": "ocs.csv"},
        molecule=START,
        parameters={"free": ["B"]},
        outputs={"csv": "a.csv", "toml": "a.toml"},
    )
    with pytest.raises(NoResultError, match="not converged"):
        run_scene(scene)
    write_scene(scene, "s.toml")
    code, out, err = call("run", "s.toml")
    assert (code, out) == (1, "")
    assert err.startswith("error: not converged: ")
    assert not list(lines.glob("a.*"))


def test_plans_of_fits_say_what_is_free_and_count():
    scene = make_scene("fit", lines={"source": "ocs.csv"}, molecule=START, parameters={"free": ["B", "D"]})
    plan = plan_of(scene, DATA)
    assert plan.counts == {"lines": 61, "blended": 0, "parameters": 2}
    assert dict(plan.parts)["free"] == "B, D"
    assert plan.left_out[0].name == "centrifugal distortion of order J^6"
    free = plan_of(
        make_scene("fit", lines=scene.content["lines"], molecule=START, parameters={"free": ["B", "D", "H"]}), DATA
    )
    assert not any(
        neglected.name.startswith("centrifugal distortion") for neglected in free.left_out
    )  # H is no longer left out
    spfit = plan_of(make_scene("fit", lines={"source": "co.par"}), DATA)
    assert spfit.counts["parameters"] == 4


def test_a_saved_scene_of_several_molecules_gives_the_same_bytes(call, folder):
    options = (
        "CO",
        "HC3N",
        "--band",
        "ALMA3",
        "--column",
        "1e16,3e13",
        "--excitation",
        "17.3",
        "--velocity=-3.3",
        "--filling",
        "0.7",
    )
    code, _, err = call("emission", *options, "--csv", "a.csv", "--profile-csv", "p.csv", "--save-scene", "s.toml")
    assert code == 0, err
    (folder / "again").mkdir()
    code, _, err = call("run", "s.toml", "--out", "again")
    assert code == 0, err
    for name in ("a.csv", "p.csv"):
        assert (folder / name).read_bytes() == (folder / "again" / name).read_bytes()


def test_a_plan_of_a_source_counts_lines_and_points():
    scene = make_scene(
        "emission",
        molecules=[{"source": "CO"}, {"source": "HC3N", "isotopes": ["N=15N"]}],
        conditions={"range": "110:116GHz", "width": 5.0},
    )
    plan, result = plan_of(scene), run_scene(scene)
    assert plan.counts["lines"] == len(result.table)
    assert plan.counts["points"] == len(result.answer.spectrum)
    sizes = [neglected.size for neglected in plan.left_out if neglected.size is not None]
    assert sizes == sorted(sizes, reverse=True)
    assert np.isfinite(plan.seconds)


def test_the_knobs_of_a_fit_and_of_a_source():
    """Lines of a linear top are linear in its constants, so that one iteration is enough; a deep cut leaves a line out."""
    table = work_precision(
        make_scene("fit", lines={"source": "ocs.csv"}, molecule=START, parameters={"free": ["B", "D", "H"]}),
        folder=DATA,
    )
    assert {row.knob for row in table.rows} == {"numerics.iterations", "tolerance of the search"}
    assert max(row.error for row in table.rows) < 1e-6  # standard errors: round-off of sums over the lines
    core = make_scene(
        "emission",
        molecules=[{"source": "CO", "column": 1e14}],
        conditions={"excitation": "10 K", "range": "115.2:115.4GHz"},
    )
    errors = {row.setting: row.error for row in work_precision(core).rows}
    assert errors["0.1"] == pytest.approx(
        float(run_scene(core).answer.spectrum.brightness_k.max()), rel=1e-9
    )  # no line is left
    assert errors["1e-06"] == 0.0
