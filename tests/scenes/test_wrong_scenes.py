"""Scene files with a mistake each: one line that names the key, exit code 2, and nothing written, by `rotor plan` and `rotor run` alike."""

from __future__ import annotations

import pytest

SPECTRUM = 'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n'
BODY = 'schema = 1\nkind = "tumble"\n[body]\nmoments = [1.0, 2.0, 3.0]\nangular_velocity = [0.1, 1.0, 0.1]\n'
DRAG = '[[effects]]\neffect = "linear drag"\ncoefficients = [0.1, 0.1, 0.1]\n'
TIMES = '[conditions]\ntimes = "0:10:11"\n'
OCS = 'schema = 1\nkind = "align"\nmolecule = "OCS"\n'
STARK = OCS.replace("align", "stark")
PULSE = '[[pulses]]\nshape = "gaussian"\npeak = "1e12 W/cm2"\nfwhm = "1 ps"\n'
FIELD = '[[pulses]]\nshape = "thz"\npeak = "10 kV/cm"\nfwhm = "1 ps"\nfrequency = "-0.3 THz"\n'
FLUID = 'schema = 1\nkind = "fluid"\n[conditions]\nmolecules = 27\n'
WRONG = {
    "nothing in it": ("", "s.toml: expected schema = 1, the version of the format, and it has none"),
    "a text as schema": (SPECTRUM.replace("1", '"1"'), "this one has '1'"),
    "no molecule": ('schema = 1\nkind = "spectrum"\n', "the key 'molecule' is missing"),
    "two molecules in a list": (SPECTRUM.replace('"CO"', '["CO", "HCl"]'), "molecule: expected a text or a table, found a list"),
    "a frequency as temperature": (SPECTRUM + '[conditions]\ntemperature = "3 GHz"', "conditions.temperature: '3 GHz': unit"),
    "a temperature below 0": (SPECTRUM + '[conditions]\ntemperature = "-3 K"', "conditions.temperature: -3"),
    "a temperature that is no number": (SPECTRUM + "[conditions]\ntemperature = nan", "conditions.temperature: nan"),
    "a range that falls": (SPECTRUM + '[conditions]\nrange = "3:1GHz"', "conditions.range: '3:1GHz'"),
    "an accuracy of no size": (SPECTRUM + "accuracy = 0", "accuracy: 0.0: expected more than 0"),
    "an accuracy in words": (SPECTRUM + 'accuracy = "high"', "accuracy: 'high' is not a number"),
    "an accuracy below rounding": (SPECTRUM + 'accuracy = "1e-9 Hz"', "accuracy: 1e-15 MHz cannot be given"),
    "an accuracy after a table": (SPECTRUM + '[numerics]\naccuracy = "1 kHz"', "it stands before the first table"),
    "a J below 0": (SPECTRUM + "[numerics]\njmax = -1", "numerics.jmax: -1"),
    "a J beyond all lists": (SPECTRUM.replace("CO", "SO2") + "[numerics]\njmax = 100000", "ask for fewer, in ranges of J"),
    "a mixed list": (STARK + '[conditions]\nfield = [0, "1 kV/cm", true]', "conditions.field[1]: expected a number, found a text"),
    "a field of no molecule": (STARK + '[conditions]\nfield = "0:1e12kV/cm:3"', "conditions.field: a field of 1e+12 kV/cm"),
    "an M above J": (STARK + "[observables]\nm = [7]\n[conditions]\nfield = [1.0]", "observables.m: [7.0]: expected numbers from 0"),
    "an effect that is none": (BODY + DRAG.replace("drag", "drg"), "effects[0].effect: 'linear drg' is none; the nearest is"),
    "two coefficients of three": (BODY + DRAG.replace("0.1, 0.1,", "0.1,") + TIMES, "effects[0]: linear drag: expected 3 numbers"),
    "effects without times": (BODY + DRAG, "conditions.times: expected with effects"),
    "a film of a driven body": (BODY + DRAG + TIMES + '[outputs]\ngif = "a.gif"', "outputs.gif: needs a free motion (a table shows any); "
        "expected without effects"),
    "a classical gas without a temperature": ('schema = 1\nkind = "torsion"\nmolecule = "C2H6"\n[observables]\nbond = "1-2"\n[outputs]\n'
        'classical_csv = "a.csv"', "outputs.classical_csv: a classical gas has a temperature, such as 300K; expected with observables.cl"),
    "a picture of one field": (STARK + '[conditions]\nfield = "5 kV/cm"\n[outputs]\nplot = "a.png"', "outputs.plot: a picture of a map "
        "needs two fields or more; give conditions.field a range"),
    "a film of one time": (OCS.replace("align", "tumble") + '[conditions]\ntimes = [1.0]\n[outputs]\ngif = "a.gif"',
        "outputs.gif a.gif: a film needs at least two different times; give more conditions.times"),
    "a profile of sticks": (SPECTRUM + '[outputs]\nprofile_csv = "a.csv"', "outputs.profile_csv: sticks have no profile; give "
        "observables.fwhm or observables.profile"),
    "times to and fro": (BODY + DRAG + "[conditions]\ntimes = [0.0, -2.0, 5.0]", "conditions.times: expected times that all"),
    "moments below 0": (BODY.replace("[1.0,", "[-1.0,"), "body.moments: principal moments must be finite"),
    "no pulse": (OCS, "the key 'pulses' is missing"),
    "a pulse of negative width": (OCS + PULSE.replace("1 ps", "-1 ps"), "pulses[0].fwhm: -1 ps: expected a finite number above 0 ps"),
    "a negative frequency": (OCS + FIELD, "pulses[0].frequency: -0.3 THz: expected a finite number of 0 THz"),
    "a last time before the first": (OCS + PULSE + '[conditions]\nlast_time = "-9 ps"', "conditions.last_time: -9 ps is not"),
    "a last time beyond all digits": (OCS + PULSE + "[conditions]\nlast_time = 1e300", "conditions.last_time: 1e+300 ps"),
    "more times than fit": (OCS + PULSE + "[conditions]\npoints = 1000000000", "conditions.points: 1000000000"),
    "a state without its J": (OCS + PULSE + "[conditions]\nstate = {k = 1}", "conditions.state: {'k': 1}"),
    "one level and a temperature": (OCS + PULSE + "[conditions]\ntemperature = 9\nstate = {j = 1}",
        "conditions.temperature and conditions.state: give one"),
    "friction without Langevin": (FLUID + "friction = 2", "conditions.friction: expected with conditions.ensemble langevin"),
    "steps below 0": (FLUID + "steps = -5", "conditions.steps: -5: expected a whole number of 0 or more"),
}  # fmt: skip


@pytest.mark.parametrize("verb", ["plan", "run"])
@pytest.mark.parametrize("mistake", WRONG)
def test_a_mistake_is_one_line_with_its_key(call, folder, verb, mistake):
    text, said = WRONG[mistake]
    (folder / "s.toml").write_text(text, encoding="utf-8")
    before = sorted(folder.iterdir())
    code, out, err = call(verb, "s.toml")
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert said in err
    assert sorted(folder.iterdir()) == before


def test_a_point_of_a_sweep_that_cannot_be_costs_itself(call, folder):
    text = SPECTRUM + '[outputs]\ncsv = "{temperature}.csv"\n[sweep]\n"conditions.temperature" = ["10 K", "20 MHz"]'
    (folder / "s.toml").write_text(text, encoding="utf-8")
    code, _, err = call("run", "s.toml")
    assert (code, len(err.splitlines())) == (1, 2)
    assert "conditions.temperature = 20 MHz: conditions.temperature: '20 MHz'" in err
    assert [path.name for path in folder.glob("*.csv")] == ["10_K.csv"]


OPTIONS = [
    (["stark", "OCS", "--field", "1kV/cm", "--m", "7"], "--m: [7]"),
    (["stark", "OCS", "--field", "1kV/cm", "--states", "101"], "--states: 101: expected a whole number from 0 to 100"),
    (
        ["stark", "OCS", "--field", "1kV/cm", "--intensity", "-1 W/cm2"],
        "--intensity: -1 W/cm2: expected a number from 0",
    ),
    (["stark", "OCS", "--field", "1e9kV/cm"], "--field: a field of 1e+09 kV/cm"),
    (["zeeman", "HC3N", "--field", "1T", "--g", "nan"], "--g: 'nan' is not a number"),
    (["align", "OCS", "--pulse", "1e12 W/cm2, 1 ps", "--m", "3"], "--m: 3 belongs to one state"),
    (["align", "OCS", "--pulse", "1e12 W/cm2, 1 ps", "--state", "k=1"], "--state: {'k': 1}"),
    (
        ["align", "OCS", "--pulse", "1e12 W/cm2, 1 ps", "--state", "j=1", "--temperature", "5"],
        "--temperature and --state: give one",
    ),
    (["align", "OCS", "--pulse", "1e12 W/cm2, 1 ps", "--until", "1e300"], "--until: 1e+300 ps"),
    (["align", "OCS", "--pulse", "1e12 W/cm2, 1 ps", "--points", "1000000000"], "--points: 1000000000"),
    (["align", "OCS", "--thz", "100 kV/cm, 1 ps, -0.3 THz"], "--thz: frequency: -0.3 THz: expected"),
]


@pytest.mark.parametrize(("arguments", "said"), OPTIONS, ids=[said for _, said in OPTIONS])
def test_a_mistake_names_its_option(call, arguments, said):
    code, _, err = call(*arguments)
    assert (code, len(err.splitlines())) == (2, 1)
    assert err.startswith(f"error: {said}")
