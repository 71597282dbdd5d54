"""`rotor tumble --effect` keeps the contract of docs/verbs/tumble.md; its numbers against closed forms."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from places import PROJECT, TESTS

import rotor
from rotor.classical.driven import BODY_EFFECTS, DrivenRequest, answer_driven
from rotor.classical.effects.drag import LinearDrag
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.effects.torques import ConstantTorque
from rotor.classical.motion import SI
from rotor.requests.field import all_fields

CONTRACT = PROJECT / "docs" / "verbs" / "tumble.md"
BODY = ("tumble", "--moments", "1,2,3", "--omega", "0.1,1,0")
LINES = {  # each effect once, as it stands on the command line
    "constant torque": "vector=0.1,0,0 frame=space",
    "linear drag": "coefficients=0.1,0,0;0,0.1,0.02;0,0,0.2",
    "quadratic drag": "coefficients=0.1,0.1,0.2",
    "periodic drive": "amplitude=0.1,0,0 angular_frequency=1.2 phase=0.3",
    "spinning rotor": "momentum=0,0,0.7",
    "gravity about pivot": "mass=2 centre=0,0,-0.5 gravity=0,0,-9.81",
    "permanent dipole": "dipole=1,0,0 field=0,0,2",
    "induced dipole": "polarizability=1,1,3 field=0,0,2",
    "optical centrifuge": "polarizability=3,1,1 field=2 acceleration=0.3 phase=0.1",
    "rolling ellipsoid": "mass=1 semiaxes=0.5,0.6,0.7 gravity=0,0,-1",
    "fluid impulse": "impulse=1,1,0 masses=1,2,2",
    "changing inertia": "times=0,2 moments=1,2,3;1,2,4",
}


def package_effects():
    """The named effects of the package, without those of toy modules that the collection of tests imports."""
    return {name: kind for name, kind in BODY_EFFECTS.load().items() if kind.__module__.startswith("rotor.")}


def test_every_effect_is_read_from_a_line_and_written_down_again():
    assert set(LINES) == set(package_effects())
    for name, parameters in LINES.items():
        (effect,) = BODY_EFFECTS.read(f"{name} {parameters}")
        tables = BODY_EFFECTS.write([effect])
        (again,) = BODY_EFFECTS.read(tables)
        assert type(again) is type(effect)
        assert BODY_EFFECTS.write([again]) == tables
        assert BODY_EFFECTS.read(BODY_EFFECTS.line(effect))[0].__class__ is type(effect)


def test_a_variant_of_an_effect_does_not_take_its_name():
    class Doubled(ConstantTorque):
        """A class of a user that states no name."""

    assert BODY_EFFECTS.load()[Doubled.name] is ConstantTorque


def test_the_contract_names_every_effect_and_parameter():
    text = CONTRACT.read_text(encoding="utf-8")
    rows = {line.split("|")[1].strip(" `"): line.split("|")[2] for line in text.splitlines() if line.startswith("| `")}
    for name, kind in package_effects().items():
        assert all(f"`{field.last}`" in rows[name] for field in all_fields(kind).values()), name


def test_drag_slows_a_sphere_as_the_closed_form_says(call):
    code, out, err = call(
        "tumble", "--moments", "2,2,2 kg m2", "--omega", "0,0,60 rpm", "--effect", "linear drag coefficients=0.5,0.5,0.5",
        "--times", "0:8s:5", "--json", "-",
    )  # fmt: skip
    assert code == 0, err
    rows = json.loads(out)["motion"]
    for row in rows:  # ω = ω0 exp(-c t/I); the tolerance of a step is 1e-10
        assert row["w3_rad_per_s"] == pytest.approx(2 * math.pi * math.exp(-0.25 * row["t_s"]), rel=1e-8)


def test_a_pendulum_swings_with_its_period_and_keeps_its_energy(call):
    """Small swing about axis 1 from rest: θ = θ0 cos(√(mgl/I1) t), with I1 about the pivot."""
    half = 0.5e-3
    code, out, err = call(
        "tumble", "--moments", "2,2,0.5", "--omega", "0,0,0", "--attitude", f"{math.cos(half)!r},{math.sin(half)!r},0,0",
        "--effect", "gravity about pivot mass=1 centre=0,0,-0.5 gravity=0,0,-9.81", "--times", "0:4:9", "--step", "0.01",
        "--json", "-",
    )  # fmt: skip
    assert code == 0, err
    content = json.loads(out)
    rate = math.sqrt(9.81 * 0.5 / 2)
    swing = [2 * math.atan2(row["qx"], row["qw"]) for row in content["motion"]]
    # of 1e-3 rad, the next term is θ0²/16 of the phase
    assert np.allclose(swing, 1e-3 * np.cos(rate * np.linspace(0, 4, 9)), rtol=0, atol=1e-9)
    assert content["energy_first"] == pytest.approx(content["energy_last"], rel=1e-12)
    assert content["method"] == "splitting of order 4, step 0.01"


def test_the_report_and_the_files(call, tmp_path):
    code, out, err = call(*BODY, "--effect", "spinning rotor momentum=0,0,0.7", "--times", "0:3:31", "--csv", "a.csv")
    assert code == 0, err
    assert "moments 1, 2, 3: asymmetric top, under spinning rotor" in out
    assert "conserved to" in out
    assert "the motion, 11 of 31 times" in out
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == "t,m1,m2,m3,qw,qx,qy,qz,energy,w1,w2,w3"
    assert len(lines) == 32


def test_a_named_body_that_is_given_no_motion_turns_once_a_second(call):
    code, out, err = call(
        "tumble", "book", "--effect", "linear drag coefficients=1e-4,1e-4,1e-4", "--times", "0,1", "--json", "-"
    )
    assert code == 0, err
    first = json.loads(out)["motion"][0]
    assert first["w2_rad_per_s"] == pytest.approx(2 * math.pi, rel=1e-4)  # half a degree off the axis: 1 - cos = 4e-5


DRAG = ("--effect", "linear drag coefficients=1,1,1")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((*BODY, "--effect", "drag coefficients=1,1,1", "--times", "0:1:3"), "no effect is named 'drag'; the nearest is 'linear drag'"),
        ((*BODY, "--effect", "linear drag coefs=1,1,1", "--times", "0:1:3"), "linear drag has no 'coefs'; the nearest is 'coefficients'"),
        ((*BODY, "--effect", "linear drag", "--times", "0:1:3"), "coefficients is missing; give coefficients (diagonal (3,)"),
        ((*BODY, "--effect", "linear drag coefficients=1,1", "--times", "0:1:3"), "--effect: linear drag: expected 3 numbers"),
        ((*BODY, "--effect", "linear drag coefficients=1,a", "--times", "0:1:3"), "coefficients=1,a: expected numbers"),
        ((*BODY, "--effect", "linear drag coefficients=1 coefficients=2", "--times", "0:1:3"), "expected each parameter once"),
        ((*BODY, *DRAG), "--times: expected with --effect, the start first: such as 0:10:101"),
        ((*BODY, *DRAG, "--times", "0,2,1"), "--times: expected times that all increase, or all decrease"),
        ((*BODY, *DRAG, "--times", "0:1:3", "--step", "0.1"), "--step: a splitting holds no torque of the angular velocity"),
        ((*BODY, *DRAG, "--times", "0:1:3", "--order", "4"), "--order: belongs to a splitting; give --step too"),
        ((*BODY, *DRAG, "--times", "0:1:3", "--tolerance", "2"), "--tolerance"),
        ((*BODY, *DRAG, "--times", "0:1:3", "--attitude", "1,1,0,0"), "--attitude: (1.0, 1.0, 0.0, 0.0): expected a unit quaternion"),
        ((*BODY, *DRAG, "--times", "0:1:3", "--gif", "a.gif"), "motion (a table shows any); expected without --effect"),
        (("tumble", "water", *DRAG, "--times", "0:1:3"), "--effect: acts on a body; give --moments or --body"),
        (("tumble", "--moments", "1,2,3", *DRAG, "--times", "0:1:3"), "--omega: expected with --moments"),
        ((*BODY, "--step", "0.1"), "--step: belongs to a motion under effects"),
    ],
)  # fmt: skip
def test_errors_are_one_line_and_leave_no_file(call, tmp_path, arguments, said):
    code, out, err = call(*arguments, "--csv", "a.csv")
    assert code == 2
    assert out == ""
    assert said in err
    assert err.startswith("error: ")
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_motion_that_does_not_stay_finite_is_an_answer_that_was_not_reached(call, tmp_path):
    effect = ("--effect", "constant torque vector=1e308,0,0", "--step", "0.1")
    code, _, err = call(*BODY, *effect, "--times", "0:100:3", "--csv", "a.csv")
    assert code == 1
    assert err.startswith("error: ")
    assert list(tmp_path.iterdir()) == []


def test_an_effect_of_one_file_reaches_command_scene_and_schema(folder):
    """Spin-up about axis 3: I ω = rate t²/2."""
    import subprocess
    import sys

    toy = str(TESTS / "helpers" / "toy_body_effect.py")
    words = [
        "tumble",
        "--moments",
        "1,2,4",
        "--omega",
        "0,0,0",
        "--times",
        "0,1,2",
        "--effect",
        "rising torque rate=0.5",
    ]
    ran = subprocess.run(
        [sys.executable, toy, *words, "--json", "a.json", "--save-scene", "s.toml"], capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    assert "under rising torque" in ran.stdout
    spins = [row["w3"] for row in json.loads(Path("a.json").read_text())["motion"]]
    assert spins == pytest.approx([0, 0.5 / 2 / 4, 0.5 * 4 / 2 / 4], abs=1e-9)  # tolerance of a step 1e-10
    assert 'effect = "rising torque"\nrate = 0.5' in Path("s.toml").read_text()
    again = subprocess.run([sys.executable, toy, "run", "s.toml", "--json", "-"], capture_output=True, text=True)
    assert [row["w3"] for row in json.loads(again.stdout)["motion"]] == spins
    wrong = subprocess.run([sys.executable, toy, *words[:-1], "rising torque rat=1"], capture_output=True, text=True)
    assert (wrong.returncode, len(wrong.stderr.splitlines())) == (2, 1)
    assert "the nearest is 'rate'" in wrong.stderr


def test_a_motion_under_effects_has_a_picture(call, tmp_path):
    """ω in the body, L in space and the energy; refused before, so that the slowing of a body could not be seen."""
    code, _, err = call("tumble", "book", *DRAG, "--times", "0:3:31", "--plot", "slowed.png")
    assert code == 0, err
    with Image.open(tmp_path / "slowed.png") as image:
        assert "book" in image.info["Description"]
    request = DrivenRequest(
        (1.0, 2.0, 3.0), (0.0, 1.0, 2.0), (LinearDrag([1, 1, 1]),), angular_velocity=(0.0, 0.0, 1.0), units=SI
    )
    above, middle, below = rotor.plot(answer_driven(request)).axes
    assert [above.get_ylabel(), middle.get_ylabel()] == ["ω in the body\n(rad/s)", "L in space\n(kg m²/s)"]
    assert [below.get_ylabel(), below.get_xlabel()] == ["Energy\n(J)", "Time (s)"]
    pendulum = answer_driven(replace(request, effects=(GravityAboutPivot(1.0, [0, 0, -1.0], [0, 0, -9.81]),)))
    low, high = rotor.plot(pendulum).axes[2].get_ylim()
    assert high - low > 0.1 * abs(high)  # conserved: an axis of round-off would show a change
    assert np.allclose(middle.lines[2].get_ydata(), 3 * np.exp(-np.array([0.0, 1.0, 2.0]) / 3), rtol=1e-8)
