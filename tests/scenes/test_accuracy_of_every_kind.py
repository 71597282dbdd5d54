"""Every kind of scene takes an accuracy; its answer is within it, and the next coarser setting is not, or the plan says why not."""

import json

import pytest

from rotor.scenes.run import scene_calculation
from rotor.scenes.scene import parse_scene

LINES_OF_CO = (
    "frequency_mhz,error_mhz,j_upper,j_lower\n115271.2018,0.0005,1,0\n230538.0,0.0005,2,1\n345795.9899,0.0005,3,2\n"
    "461040.768,0.0005,4,3\n"
)
HEAD = 'schema = 1\nkind = "{}"\naccuracy = "{}"\n'
FIT = '[molecule]\nconstants = "B=57000 D=0.1 MHz"\n[lines]\nsource = "l.csv"\n[parameters]\nfree = ["B", "D"]\n'
EMISSION = '[[molecules]]\nsource = "HCONH2"\ncolumn = 1e15\n[conditions]\nrange = "100:120GHz"\nexcitation = "50 K"\nwidth = "3 km/s"\n'
FAMILY = 'name = "OCS"\n[geometry]\natoms = [["O", 0, 0, 1.16], ["C", 0, 0, 0], ["S", 0, 0, -1.56]]\n' + "".join(
    f'[[isotopologue]]\n{isotopes}constants = "B={b} MHz"\n'
    for isotopes, b in (("", 6081.492114), ('isotopes = "C=13C"\n', 6061.923848), ('isotopes = "S=34S"\n', 5932.833732))
)
STRUCTURE = '[family]\nfile = "f.toml"\n[observables]\nmethod = ["r0"]\n'
TORSION = 'molecule = "C2H6"\n[observables]\nbond = "1-2"\npotential = "V3=1013 cm-1"\n'


def ran(call, folder, kind, accuracy, body) -> tuple[int, str, str]:
    (folder / "l.csv").write_text(LINES_OF_CO)
    (folder / "f.toml").write_text(FAMILY)
    (folder / "s.toml").write_text(HEAD.format(kind, accuracy) + body)
    return call("run", "s.toml", "--json", "-")


@pytest.mark.parametrize(
    ("kind", "accuracy", "body", "unit"),
    [
        ("fit", "1 kHz", FIT, "MHz"),
        ("fit", "1 %", FIT, "%"),
        ("emission", "1 mK", EMISSION, "K"),
        ("emission", "0.05 mK", EMISSION, "K"),
        ("torsion", "1 kHz", TORSION, "MHz"),
        ("spectrum", "0.1 %", 'molecule = "OCS"\n', "%"),
        ("raman", "1 kHz", 'molecule = "N2"\n', "MHz"),
        ("info", "1 kHz", 'molecule = "OCS"\n', "MHz"),
        ("isotopologues", "1 kHz", 'molecule = "OCS"\n', "MHz"),
        ("structure", "1e-6 Å", STRUCTURE, "Å"),
    ],
)
def test_an_accuracy_is_reached_and_named_with_its_unit(call, folder, kind, accuracy, body, unit):
    code, out, err = ran(call, folder, kind, accuracy, body)
    assert code == 0, err
    record = json.loads(out)["accuracy"]
    assert record["unit"] == unit
    assert record["error"] <= record["asked"]
    assert call("plan", "s.toml")[0] == 0


@pytest.mark.parametrize(
    ("kind", "body", "accuracy"),
    [
        ("spectrum", 'molecule = "SO2"\n[conditions]\nrange = "80:120GHz"\n[observables]\nmin_lgint = -5\n', "10 %"),
        ("spectrum", 'molecule = "CO"\n', "0.001 %"),
        ("raman", 'molecule = "O2"\n[observables]\nmin_relative = 1e-3\n', "1 %"),
    ],
)
def test_the_intensity_of_all_lines_is_within_what_is_stated(kind, body, accuracy):
    """Against lists without a cut."""
    from dataclasses import replace

    from rotor.scenes.run import run_scene
    from rotor.verbs.common.verb import Work, verb_of

    result = run_scene(parse_scene(HEAD.format(kind, accuracy) + body))
    name, column = {
        "spectrum": ("min_lgint", "intensity_nm2_mhz"),
        "raman": ("min_relative", "cross_section_cm2_per_sr"),
    }[kind]
    whole = verb_of(kind).answer(replace(result.request, **{name: None, "jmax": 150}), Work())
    part, true = (getattr(each_answer.lines, column).sum() for each_answer in (result.answer, whole))
    assert 0 <= 100 * (1 - part / true) <= result.reached.error <= result.reached.asked


def test_a_cut_is_lowered_where_it_leaves_out_too_much():
    """The accuracy of one that is given by hand is refused instead."""

    enough, more = (
        scene_calculation(parse_scene(HEAD.format("raman", text) + 'molecule = "N2"\n'))
        for text in ("1e-3 %", "8e-5 %")
    )
    assert enough.choice.request.min_relative == enough.request.min_relative
    assert more.choice.request.min_relative < more.request.min_relative
    assert more.choice.error <= 8e-5


@pytest.mark.parametrize(("accuracy", "value"), [("1 mK", 1e-3), ("2 K", 2.0)])
def test_brightness_is_asked_for_in_kelvin(accuracy, value):
    assert scene_calculation(parse_scene(HEAD.format("emission", accuracy) + EMISSION)).accuracy.value == pytest.approx(
        value
    )


def test_a_decade_coarser_misses(folder):
    """Of brightness by its least depth, and of a fit by its tolerance: the stated error of the next setting is above the accuracy."""
    from dataclasses import replace

    from rotor.formats.fits.fit_request import answer_fit
    from rotor.spectra.emission.request import answer_emission

    def taken(kind, accuracy, body):
        scene = parse_scene(HEAD.format(kind, accuracy) + body)
        calculation = scene_calculation(scene)
        return calculation.choice.request

    (folder / "l.csv").write_text(LINES_OF_CO)
    for accuracy, kelvin in (("100 mK", 0.1), ("1 mK", 1e-3), ("0.05 mK", 5e-5)):
        request = taken("emission", accuracy, EMISSION)
        assert answer_emission(request).errors.numerical <= kelvin
        assert answer_emission(replace(request, least_depth=10 * request.least_depth)).errors.numerical > kelvin
    for accuracy, percent in (("0.1 %", 0.1), ("0.01 %", 0.01)):
        request = taken("fit", accuracy, FIT)
        coarser = replace(request, options=replace(request.options, tolerance=10 * request.options.tolerance))
        errors = [100 * answer_fit(fit_request).constants_errors.numerical for fit_request in (request, coarser)]
        assert errors[0] <= percent
        assert errors[1] > percent or request.options.tolerance == 1.0


def test_what_cannot_be_had_is_refused(call, folder):
    assert "cannot be given: the error here is" in ran(call, folder, "emission", "1e-9 K", EMISSION)[2]
    assert "cannot be given: the error here is" in ran(call, folder, "fit", "1e-9 kHz", FIT)[2]
    assert "does not measure the same thing" in ran(call, folder, "structure", "1 kHz", STRUCTURE)[2]
    substitution = STRUCTURE.replace('"r0"', '"rs"')
    said = ran(call, folder, "structure", "1e-6 Å", substitution)[2]
    assert (
        "accuracy: the numerical error of bond lengths (rs) is not estimated: Kraitchman's equations lose digits"
        in said
    )
    assert "does not measure the same thing" in ran(call, folder, "emission", "1 MHz", EMISSION)[2]
    (folder / "s.toml").write_text(HEAD.format("emission", "1 mK") + EMISSION + "[observables]\nleast_depth = 1e-3\n")
    assert "accuracy and observables.least_depth: give one of them" in call("run", "s.toml")[2]
