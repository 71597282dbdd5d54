"""Scenes are run: the same numbers as the verbs, saved scenes give the same bytes, sweeps go on where they stopped."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.quantum.effects.watson import Rigid
from rotor.scenes.run import run_scene
from rotor.scenes.scene import make_scene, parse_scene, read_scene, write_scene
from rotor.scenes.sweep import points, run_sweep
from rotor.verbs.common.verb import verb_of

WATER_XYZ = "3\nwater\nO 0 0 0.1173\nH 0 0.7572 -0.4692\nH 0 -0.7572 -0.4692\n"

ROD = "--constants|A=9.2 B=3 C=2.5 GHz|--dipole-abc 1,0,2"
SAVED = [  # a verb with its options; --csv a.csv goes with each
    ("spectrum", "water --temperature 123.4 --range 10:900.1GHz --jmax 8 --vibration 1595,3657,3756 --cat a.cat --tag 18003"),
    ("spectrum", "water.xyz --dipole 0,0,1.85 --isotope 2=2H --jmax 5"),
    ("spectrum", "SMILES:C=O --jmax 4 --min-lgint none"),
    ("spectrum", "OCS --jmax 9 --pressure 2mbar --path 1m --fwhm 3MHz --profile-csv p.csv"),
    ("spectrum", "ROD --spin-constants|chi_aa(14N)=-4.2 chi_bb-cc(14N)=1.1 MHz|--jmax 3"),
    ("spectrum", "--constants|A=9.2 B=3 C=2.5 GHz|--dipole-abc 0,2,0 --spin-weights ee=1,eo=3,oe=3,oo=1 --q 99 --jmax 3"),
    ("spectrum", "HCONH2 --hyperfine --hyperfine-method auto --hyperfine-tolerance 1kHz --jmax 4"),
    ("spectrum", "NH3 --jmax 3"),
    ("levels", "NH3 --jmax 3"),
    ("levels", "CH3CN --k 0:3 --jmax 6 --max-energy 30cm-1 --egy a.egy"),
    ("raman", "CO2 --laser 488 --temperature 77.7 --min-relative 1e-3"),
    ("raman", "--constants|B=1.98958 cm-1|--polarizability 2.22,1.53 --spin-weights even=2,odd=1"),
    ("thermo", "water --species ortho --temperature 100:300K:5 --gas --pressure 1atm --vibration-states|1594.7x1,3151.6|"),
    ("tumble", "water --temperature 100 --times 0:2ps:21"),
    ("tumble", "OCS --angular-momentum 0,10.1,0.3"),
    ("tumble", "--moments 0.6,0.8,1.0 --angular-momentum 1.8,0.4,-0.9 --times 0,1,2.7"),
    ("tumble", "book --times 0:2:21"),
    ("tumble", "--moments|1,2,3 kg m2|--omega 0.1,5,0 --times 0:2:21"),
    ("tumble", "book --times 0:2:21 --effect|linear drag coefficients=1e-4,1e-4,2e-4|--effect|constant torque vector=0,1e-4,0|"),
    ("tumble", "--moments 1,2,3 --omega 0.1,1,0 --times 0,1,2.7 --step 0.1 --order 2 --attitude 0.6,0,0.8,0"
     " --effect|periodic drive amplitude=0.1,0,0 angular_frequency=1.2 frame=space|"),
    ("stark", "OCS --field 10,20 --states J<=1 --intensity|1e9 W/cm2|--tilt 45"),
    ("gas", "OCS --molecules 500 --temperature 200 --seed 5"),
    ("stark", "OCS --field 0:77.7kV/cm:5 --states J<=1 --intensity|1e10 W/cm2|--diabatic-gap 5"),
    ("stark", "HC3N --field 0,0.3 --states J<=1 --m 1 --spin-constants|chi_aa(14N)=-4.3 MHz|"),
    ("zeeman", "OCS --g -0.02 --magnetisability 1.5,-2.5 --field 0:2T:3 --states J<=1"),
    ("zeeman", "--constants|A=10 B=6 C=4 GHz|--g 0.6,-0.2,0.3,0.05,0,0 --field 0,33.3 --states J<=1 --tolerance 1e-5"),
    ("zeeman", "HC3N --g -0.01 --field 0:200G:3 --states J<=1 --spin-constants|chi_aa(14N)=-4.3 MHz|--nuclear-g 14N=0.4"),
    ("align", "OCS --pulse|1e12 W/cm2, 0.3 ps|--kick|1e-2 J/cm2, 5 ps|--polarization elliptical:0.3 --temperature 0 --points 51"),
    ("align", "--constants|B=6081.492 MHz|--anisotropy 4.04 --switched|1e11 W/cm2, 1, 2, 0.5|--temperature 0 --until 20ps --points 31"),
    ("align", "OCS --thz|100 kV/cm, 1 ps, 0.3 THz|--observable costheta --observable cos2theta --state j=1 --m 0 --until 20 --points 31"),
    ("fluid", "water --molecules 27 --density 0.5 --ensemble langevin --steps 20 --cutoff 5 --seed 3 --temperature 320"),
]  # fmt: skip


def words_of(text: str) -> list[str]:
    """Words between blanks; a text between bars may have blanks."""
    return [word for k, part in enumerate(text.split("|")) for word in ([part] if k % 2 else part.split())]


@pytest.mark.parametrize(("verb", "options"), SAVED, ids=[f"{verb} {options[:30]}" for verb, options in SAVED])
def test_a_saved_scene_gives_the_same_bytes(call, folder, verb, options):
    """No tolerance: the same request is answered by the same code."""
    options = options.replace("ROD", ROD).replace("--vibration-states", "--vibrational-states") + " --csv a.csv"
    (folder / "water.xyz").write_text(WATER_XYZ)
    code, _, err = call(verb, *words_of(options), "--save-scene", "s.toml")
    assert code == 0, err
    tables = {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".csv", ".cat", ".egy")}
    assert tables
    (folder / "again").mkdir()
    code, _, err = call("run", "s.toml", "--out", "again")
    assert code == 0, err
    assert {name: (folder / "again" / name).read_bytes() for name in tables} == tables
    again = read_scene("s.toml")
    write_scene(again, "t.toml")
    assert read_scene("t.toml") == again


def test_a_scene_that_is_saved_elsewhere_finds_its_files(call, folder):
    (folder / "water.xyz").write_text(WATER_XYZ)
    (folder / "scenes").mkdir()
    code, _, err = call("levels", "water.xyz", "--jmax", "2", "--csv", "a.csv", "--save-scene", "scenes/s.toml")
    assert code == 0, err
    before = Path("a.csv").read_bytes()
    assert call("run", "scenes/s.toml")[0] == 0
    assert Path("a.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("levels", "CO", "--save-scene", "s.json"), "--save-scene s.json: the name must end in .toml"),
        (("levels", "-", "--save-scene", "s.toml"), "standard input"),
    ],
)
def test_a_scene_that_cannot_be_saved(call, folder, monkeypatch, arguments, said):
    import io

    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"constants = { B = 57635.968 }\n")))
    code, _, err = call(*arguments)
    assert code == 2
    assert said in err
    assert not list(folder.iterdir())


def test_what_a_scene_asks_for_is_what_the_library_answers():
    scene = make_scene(
        "spectrum",
        molecule="OCS",
        conditions={"temperature": "150 K", "range": "10:400GHz"},
        observables={"min_lgint": -6.5},
        vibration={"fundamentals": "859,520x2,2062"},
    )
    lines = run_scene(scene).table
    direct = rotor.api.line_list(
        rotor.read("OCS"), temperature_k=150.0, range_mhz=(10e3, 400e3), min_lgint=-6.5,
        vibrations=rotor.api.VibrationalStates.parse("859,520x2,2062", harmonic=True),
    )  # fmt: skip
    for name, column in direct.columns.items():
        assert np.array_equal(lines.columns[name], column), name


def test_effects_are_those_named():
    observables = {"jmax": 4}
    rigid = run_scene(make_scene("levels", molecule="CO", effects={"distortion": False}, observables=observables))
    assert [type(effect) for effect in rigid.request.effects] == [Rigid]
    b = rotor.read("CO").constants["B"]
    j = np.arange(5)
    assert np.allclose(rigid.table.energy_mhz, b * j * (j + 1), rtol=1e-15)  # one product
    whole = run_scene(make_scene("levels", molecule="CO", observables=observables))
    assert np.all(whole.table.energy_mhz[1:] < rigid.table.energy_mhz[1:])  # distortion lowers


SHORT = {
    "spectrum": make_scene("spectrum", molecule="CO", observables={"min_lgint": -6}),
    "levels": make_scene("levels", molecule="CO"),
    "tumble": make_scene("tumble", molecule="water", conditions={"times": "0:1:5"}),
    "gas": make_scene("gas", molecule="CO", observables={"times": [0.0, 1.0]}),
    "stark": make_scene("stark", molecule="OCS", conditions={"field": [0, 10]}, observables={"jmax": 1}),
    "zeeman": make_scene(
        "zeeman",
        molecule="OCS",
        magnetic={"g": [-0.03]},
        conditions={"field": [0, 1]},
        observables={"jmax": 1},
    ),
    "align": make_scene(
        "align",
        molecule="OCS",
        pulses=[{"shape": "gaussian", "peak": 1e12, "fwhm": 0.2}],
        conditions={"temperature": 0, "points": 11},
    ),
    "fluid": make_scene(
        "fluid",
        conditions={"model": "argon", "molecules": 8, "density": 0.01, "steps": 2, "every": 1, "equilibration": 0},
    ),
}


@pytest.mark.parametrize("kind", SHORT)
def test_the_command_reports_a_scene(call, folder, kind):
    write_scene(SHORT[kind], "s.toml")
    code, out, err = call("run", "s.toml", "--json", "s.json")
    assert code == 0, err
    assert "seconds" in out
    content = json.loads((folder / "s.json").read_text(encoding="utf-8"))
    rows = content["rows"] if find_spec(f"rotor.verbs.{kind}") is None else content[verb_of(kind).rows]
    assert len(rows) == len(run_scene(SHORT[kind]).table)
    assert content["kind_of_scene"] == kind


@pytest.mark.parametrize(("kind", "by"), [("levels", "levels"), ("thermo", "thermo"), ("info", "spectrum")])
def test_spins_that_are_left_out_are_added_by_the_command_of_the_scene(call, folder, kind, by):
    (folder / "s.toml").write_text(f'schema = 1\nkind = "{kind}"\nmolecule = "HCN"\n', encoding="utf-8")
    _, ran, _ = call("run", "s.toml")
    _, shown, _ = call(kind, "HCN")
    assert f"rotor {by} --hyperfine" in " ".join(ran.split())  # the report folds its lines
    assert f"rotor {by} --hyperfine" in " ".join(shown.split())


def test_a_body_by_its_angular_velocity():
    scene = make_scene("tumble", body={"moments": [0.3, 0.35, 0.4], "angular_velocity": [0.1, 15.0, 0.1]})
    assert run_scene(scene).answer.facts()["period"] == pytest.approx(
        12.3349458093386, abs=1e-9
    )  # its closed form, 12 digits


BAD = [
    (make_scene("spectrum", molecule={}), "molecule: give either source or constants"),
    (make_scene("spectrum", molecule="CO", conditions={"temperature": "300 GHz"}), "conditions.temperature: '300 GHz'"),
    (make_scene("spectrum", molecule="CO", conditions={"temperature": -1}), "conditions.temperature: -1"),
    (make_scene("spectrum", molecule="CO", conditions={"pressure": 1}), "an optical depth needs both"),
    (make_scene("spectrum", molecule="CO", observables={"min_lgint": "all"}), "observables.min_lgint: 'all'"),
    (make_scene("spectrum", molecule="CO", outputs={"csv": "a.txt"}), "outputs.csv: a.txt: the name must end in .csv"),
    (make_scene("spectrum", molecule="CO", outputs={"csv": "x/a.csv"}), "there is no folder"),
    (make_scene("spectrum", molecule="CO", outputs={"csv": "a.csv", "profile_csv": "a.csv"}), "another output writes the same file"),
    (make_scene("levels", molecule="water", observables={"jmax": -1}), "observables.jmax: -1"),
    (make_scene("levels", molecule="nonesuch"), "molecule.source: 'nonesuch' is no file here"),
    (make_scene("tumble"), "molecule, body: give one of them"),
    (make_scene("tumble", body={"moments": [1, 2], "angular_velocity": [1, 2, 3]}), "expected three finite numbers"),
    (make_scene("fluid", conditions={}), "conditions: give either molecules"),
    (make_scene("align", molecule="OCS", pulses=[{"shape": "gaussian", "peak": "1 T", "fwhm": 1}]), "pulses[0].peak: '1 T'"),
    (make_scene("align", molecule="OCS", pulses=[{"shape": "gaussian", "peak": 1e10, "fwhm": 1, "axis": "up"}]), "pulses[0].axis: 'up'"),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "said"), BAD, ids=[said for _, said in BAD])
def test_what_cannot_be_is_refused_with_its_key(folder, scene, said):
    with pytest.raises(ValueError, match=r".") as caught:
        run_scene(scene)
    assert said in str(caught.value)
    assert not list(folder.iterdir())


SWEEP = make_scene(
    "levels",
    molecule="CO",
    sweep={"molecule": ["CO", "HCl", "OCS"], "observables.jmax": [2, 5]},
    outputs={"csv": "{molecule}_{jmax}.csv"},
)


def test_a_sweep_is_every_combination():
    expanded = list(points(SWEEP))
    assert [(p.scene.content["molecule"], p.scene.content["observables"]["jmax"]) for p in expanded] == [
        (m, j) for m in ("CO", "HCl", "OCS") for j in (2, 5)
    ]
    assert expanded[1].scene.content["outputs"]["csv"] == "CO_5.csv"
    result = run_sweep(make_scene("levels", molecule="CO", sweep={"observables.jmax": [2, 5]}))
    assert result.columns["rows"].tolist() == [3, 6]
    assert result.columns["observables.jmax"].tolist() == [2, 5]


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (make_scene("levels", molecule="CO", sweep={"observables.j": [1]}), "[observables] has no key 'j'"),
        (make_scene("levels", molecule="CO", sweep={"observables.jmax": []}), "expected at least one value"),
        (
            make_scene("levels", molecule="CO", sweep={"observables.jmax": [1, 2]}, outputs={"egy": "a.egy"}),
            "put {jmax} into its name",
        ),
        (
            make_scene("levels", molecule="CO", sweep={"observables.jmax": [1]}, outputs={"csv": "{j}.csv"}),
            "there are {jmax}",
        ),
        (
            make_scene("levels", molecule="CO", sweep={"observables.jmax": [1]}, outputs={"csv": "o_{jmax.real}.csv"}),
            "{jmax.real} is no swept name",
        ),
        (
            make_scene("levels", molecule="CO", sweep={"observables.jmax": [1]}, outputs={"csv": "{jmax:>9}.csv"}),
            "{jmax:>9} is no swept name",
        ),
        (
            make_scene("levels", molecule="CO", sweep={"observables.jmax": [1]}, outputs={"csv": "{jmax}}.csv"}),
            "a brace without its partner",
        ),
        (make_scene("levels", molecule="CO", sweep={"observables.jmax": [1, 1]}), "1 stands there twice"),
    ],
)
def test_a_sweep_that_cannot_be(scene, said):
    with pytest.raises(ValueError, match=r".") as caught:
        run_sweep(scene)
    assert said in str(caught.value)


def test_a_stopped_sweep_goes_on_where_it_stopped(folder):
    (folder / "whole").mkdir()
    (folder / "cut").mkdir()
    run_sweep(SWEEP, out="whole")

    count = 0

    def stop_after_two(_):
        nonlocal count
        count += 1
        if count == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(SWEEP, out="cut", record="r.jsonl", on_point=stop_after_two)
    with open("r.jsonl", "a") as handle:
        handle.write('{"key": "cut off in the mid')
    (folder / "r.jsonl").write_text((folder / "r.jsonl").read_text() + "\n")
    result = run_sweep(SWEEP, out="cut", record="r.jsonl")
    assert result.computed == 4
    names = sorted(path.name for path in (folder / "whole").glob("*.csv"))
    assert len(names) == 6
    for name in names:
        assert (folder / "whole" / name).read_bytes() == (folder / "cut" / name).read_bytes()
    (folder / "cut" / "OCS_2.csv").unlink()  # a file that is lost is made again
    assert run_sweep(SWEEP, out="cut", record="r.jsonl").computed == 1
    assert run_sweep(SWEEP, out="cut", record="r.jsonl").computed == 0


def test_points_may_be_spread_over_processes(folder):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        spread = run_sweep(SWEEP, out=folder, executor=pool)
    (folder / "one").mkdir()
    single = run_sweep(SWEEP, out="one")
    assert spread.columns["rows"].tolist() == single.columns["rows"].tolist()
    for path in folder.glob("*.csv"):
        assert path.read_bytes() == (folder / "one" / path.name).read_bytes()


def test_the_command_runs_a_sweep(call, folder):
    write_scene(SWEEP, "s.toml")
    code, out, err = call("run", "s.toml")
    assert code == 0
    assert out.count("\n") == 8  # a heading, the columns and six points
    assert "CO" in out
    assert err.startswith("6 points: 6 computed now in ")
    assert err.count("\n") == 1
    assert call("run", "s.toml")[2].endswith("6 done before (s.sweep.jsonl)\n")
    assert (folder / "s.sweep.jsonl").is_file()


@pytest.mark.slow
def test_a_killed_sweep_goes_on(folder):
    """The same with a process that is really killed."""
    scene = parse_scene(
        'schema = 1\nkind = "levels"\nmolecule = "water"\n[outputs]\ncsv = "{jmax}.csv"\n[sweep]\n'
        f'"observables.jmax" = [{", ".join(str(j) for j in range(20, 60))}]\n'
    )
    write_scene(scene, "s.toml")
    process = subprocess.Popen(
        [sys.executable, "-m", "rotor", "run", "s.toml"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    record = folder / "s.sweep.jsonl"
    while not (record.is_file() and record.read_text().count("\n") >= 5):
        time.sleep(0.01)
        assert process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.wait()
    result = run_sweep(scene, record=record)
    assert 0 < result.computed < 40
    assert result.columns["rows"].tolist() == [(j + 1) ** 2 for j in range(20, 60)]


def test_a_scene_writes_every_file_of_its_verb(folder):
    """The thermodynamic functions of a torsion were passed over without a word."""
    (folder / "s.toml").write_text(
        'schema = 1\nkind = "torsion"\nmolecule = "C2H6"\n[observables]\nbond = "1-2"\npotential = "V3=1013 cm-1"\n'
        '[outputs]\nthermo_csv = "heat.csv"\n'
    )
    run_scene(read_scene("s.toml"))
    assert len((folder / "heat.csv").read_text().splitlines()) > 2


@pytest.mark.parametrize(
    "words",
    [
        ("isotopologues", "OCS"),
        ("emission", "SMILES:CCO", "--band", "ALMA3"),
        ("spectrum", "SMILES:CCO", "--jmax", "2"),
    ],
)
def test_a_saved_scene_has_the_remarks_of_its_command(call, words):
    code, _, said = call(*words, "--save-scene", "s.toml")
    assert (code, "note: " in said) == (0, True)
    assert call("run", "s.toml")[2] == said
