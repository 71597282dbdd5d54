"""Accuracy as an input: what was asked for is reached, measured against a calculation a hundred times finer; else it is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

import rotor
from rotor.geometry.rotations import distance
from rotor.scenes.accuracy import asked_of
from rotor.scenes.effect_sections import DriveSection, LinearDragSection
from rotor.scenes.run import run_scene
from rotor.scenes.scene import AlignScene, LevelsScene, SpectrumScene, StarkScene, ThermoScene, TumbleScene
from rotor.scenes.scene_file import parse_scene, write_scene
from rotor.scenes.sections import (
    AlignConditions,
    AlignNumerics,
    BasisNumerics,
    BodySection,
    GaussianSection,
    MoleculeSection,
    SpectrumConditions,
    StarkConditions,
    StarkNumerics,
    ThermoConditions,
    ThermoNumerics,
    TumbleConditions,
    TumbleNumerics,
)


@pytest.mark.parametrize("asked", ["1 MHz", "1 kHz"])
def test_a_stark_map(asked):
    field = StarkConditions(field=[0.0, 100.0])
    result = run_scene(StarkScene(molecule="OCS", conditions=field, accuracy=asked))
    fine = run_scene(
        StarkScene(molecule="OCS", conditions=field, numerics=StarkNumerics(tolerance=result.reached.asked / 100))
    )
    error = np.abs(result.table.columns["energy_mhz"] - fine.table.columns["energy_mhz"]).max()
    assert result.reached.error <= result.reached.asked
    assert error <= result.reached.asked


def test_cosines_of_a_pulse():
    pulse, when = [GaussianSection(peak=1e12, fwhm=0.3)], AlignConditions(temperature=0, points=51)
    result = run_scene(AlignScene(molecule="OCS", pulses=pulse, conditions=when, accuracy=1e-4))
    fine = run_scene(AlignScene(molecule="OCS", pulses=pulse, conditions=when, numerics=AlignNumerics(tolerance=1e-6)))
    error = np.abs(result.table.columns["cos2theta"] - fine.table.columns["cos2theta"]).max()
    assert max(error, result.reached.error) <= 1e-4 == result.reached.asked


def test_a_partition_function():
    when = ThermoConditions(temperature=[20.0, 100.0])
    result = run_scene(ThermoScene(molecule="CO", conditions=when, accuracy="0.1 %"))
    fine = run_scene(ThermoScene(molecule="CO", conditions=when, numerics=ThermoNumerics(relative_error=1e-10)))
    error = np.abs(result.table.columns["q_rot"] / fine.table.columns["q_rot"] - 1).max()
    assert max(error, result.reached.error) <= 1e-3 == result.reached.asked


BODY = BodySection(moments=[1.0, 2.0, 3.0], angular_velocity=[0.2, 1.0, 0.1])
DRIVEN = [
    DriveSection(amplitude=[0.1, 0.0, 0.2], angular_frequency=1.3),
    LinearDragSection(coefficients=[0.1, 0.1, 0.1]),
]
TIMES = TumbleConditions(times=[0.0, 5.0, 10.0])


@pytest.mark.parametrize("asked", [1e-3, 1e-8])
def test_a_driven_motion(asked):
    result = run_scene(TumbleScene(body=BODY, effects=DRIVEN, conditions=TIMES, accuracy=f"{asked} rad"))
    fine = run_scene(TumbleScene(body=BODY, effects=DRIVEN, conditions=TIMES, numerics=TumbleNumerics(tolerance=1e-13)))
    error = distance(result.answer.motion.attitude, fine.answer.motion.attitude).max()
    assert max(error, result.reached.error) <= asked
    assert result.answer.motion.steps < fine.answer.motion.steps  # cheaper than the finest


def test_a_free_motion_is_exact():
    result = run_scene(TumbleScene(body=BODY, conditions=TIMES, accuracy="1e-9 rad"))
    assert result.reached.how == "exact: nothing cheaper"
    assert result.reached.error < 1e-13
    assert float(result.answer.drift.momentum) < 1e-13  # round-off


JET = SpectrumConditions(temperature="2 K", range="0:100GHz")
NITROGEN = MoleculeSection(constants="A=9.2 B=3 C=2.5 GHz", dipole_abc=[1, 0, 0], spin_constants="chi_aa(14N)=-4.2 MHz")


def test_spins_are_taken_where_they_are_larger_than_what_is_asked_for():
    few = BasisNumerics(jmax=2)
    known = run_scene(SpectrumScene(molecule=NITROGEN, conditions=JET, numerics=few, accuracy="1 kHz"))
    assert "f" in known.table.quanta_names
    assert "with spins" in known.reached.how
    plain = MoleculeSection(constants=NITROGEN.constants, dipole_abc=[1, 0, 0])
    exact = run_scene(SpectrumScene(molecule=plain, conditions=JET, numerics=few, accuracy="1 kHz"))
    assert exact.reached.how == "exact: nothing cheaper"
    assert exact.reached.error < 1e-9


def test_the_rounding_that_is_stated_bounds_the_true_one():
    """Levels of a heavy top at J = 150 beside the same in extended precision, for a linear molecule in closed form."""
    scene = SpectrumScene(molecule="HC3N", conditions=SpectrumConditions(temperature="300 K"), accuracy="1 Hz")
    result = run_scene(scene)
    levels, top = result.table.levels, result.request.top
    j = levels.quanta["j"].astype(np.longdouble)
    x = j * (j + 1)
    exact = sum(np.longdouble(top.constants[n]) * s * x**p for n, s, p in (("B", 1, 1), ("D", -1, 2), ("H", 1, 3)))
    assert float(np.abs(exact - levels.energy_mhz).max()) <= result.reached.error


REFUSED = [
    (StarkScene(molecule="OCS", accuracy="1e-12 MHz"), "accuracy: 1e-12: the finest that is possible here is 1e-09"),
    (StarkScene(molecule="OCS", accuracy="1 D"), "accuracy: '1 D': unit 'D' does not measure the same thing"),
    (StarkScene(molecule="OCS", accuracy="1 %"), "expected MHz, not a percentage"),
    (StarkScene(molecule="OCS", accuracy="-1 kHz"), "expected more than 0"),
    (
        StarkScene(molecule="OCS", accuracy="1 kHz", numerics=StarkNumerics(tolerance="1 MHz")),
        "accuracy and numerics.tolerance: give one of them",
    ),
    (SpectrumScene(molecule="SO2", accuracy="1e-15 MHz", numerics=BasisNumerics(jmax=20)), "cannot be given: the error here is"),
    (TumbleScene(body=BODY, effects=DRIVEN, conditions=TIMES, accuracy="1e-17 rad"), "cannot be given"),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_cannot_be_given_is_refused(folder, scene, said):
    with pytest.raises(ValueError, match=r".") as caught:
        run_scene(scene)
    assert said in str(caught.value)


def test_kinds_without_a_knob_have_no_accuracy():
    with pytest.raises(ValueError, match="has no key 'accuracy'"):
        parse_scene('schema = 1\nkind = "levels"\nmolecule = "CO"\naccuracy = "1 kHz"')
    assert asked_of(LevelsScene(molecule="CO")) is None


def test_the_command_states_the_error(call):
    write_scene(StarkScene(molecule="OCS", conditions=StarkConditions(field=[0, 10]), accuracy="1 kHz"), "s.toml")
    assert "reached, 0.001 MHz asked for: tolerance 0.001" in call("run", "s.toml")[1]
    content = json.loads(call("run", "s.toml", "--json", "-")[1])
    assert 0 <= content["accuracy"]["error"] <= content["accuracy"]["asked"] == 1e-3
    assert rotor.__version__ == content["rotor_version"]
