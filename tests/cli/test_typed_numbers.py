"""Numbers with units in every verb; errors name the option and quote what was typed."""

import json

import pytest

WINDOW = "--range", "110:120GHz"
BOX = "fluid", "water", "--molecules", "8", "--steps", "0", "--cutoff", "2", "--equilibration", "0"
PULSE = "align", "OCS", "--points", "2", "--until", "9 ps", "--pulse"


FIT_WATER = "fit", "lines.csv", "--start", "water", "--free", "A,B", "--poor-rms", "1e99", "--prior"
LINES = """frequency_mhz,error_mhz,j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower
22235.08,0,6,1,6,5,2,3
183310.09,0,3,1,3,2,2,0
325152.9,0,5,1,5,4,2,2
556935.99,0.05,1,1,0,1,0,1
"""

READ = [  # a command with a unit, the same with the number in the unit of the option, and another that differs
    ((*BOX, "--density"), "0.997 g/cm3", "0.997", "0.5"),
    ((*BOX, "--density"), "997 kg/m3", "0.997", "0.5"),
    ((*BOX, "--step"), "0.002 ps", "2", "3"),
    ((*BOX, "--friction", "1 /ns", "--ensemble", "langevin", "--temperature"), "300 K", "300", "200"),
    (("emission", "CO", *WINDOW, "--velocity"), "8000 m/s", "8", "9"),
    (("emission", "CO", *WINDOW, "--velocity"), "8 km/s", "8", "9"),
    (("emission", "CO", *WINDOW, "--filling"), "50 %", "0.5", "1"),
    (("emission", "CO", *WINDOW, "--column"), "1e18 /m2", "1e14", "1e15"),
    (("emission", "CO", *WINDOW, "--column"), "1e14 /cm2", "1e14", "1e15"),
    (("emission", "CO", "HCN", *WINDOW, "--excitation"), "20 K,50 K", "20,50", "50,20"),
    (("raman", "N2", "--jmax", "2", "--laser"), "0.532 um", "532", "1064"),
    (("spectrum", "CO", "--jmax", "2", "--temperature"), "100000 mK", "100", "200"),
    (("spectrum", "CO", "--jmax", "2", "--pressure", "1 mbar", "--path"), "1 m", "100", "10"),
    (("stark", "OCS", "--m", "0", "--field"), "100000 V/m", "1", "2"),
    (("zeeman", "HC3N", "--g", "-0.01", "--field"), "1000 G", "0.1", "0.2"),
    ((*PULSE,), "10 TW/cm2, 1000 fs", "1e13, 1", "1e12, 1"),
    (("thermo", "CO", "--temperature"), "100000 mK,300K", "100,300", "100,200"),
    (("gas", "N2", "--molecules", "20", "--times"), "0:1000fs:3", "0:1:3", "0:2:3"),
    (("raman", "N2", "--jmax", "3", "--min-relative"), "10 %", "0.1", "0.5"),
    (("isotopologues", "water", "--min-abundance"), "0.1 %", "0.001", "0.1"),
    (("tumble", "water", "--angular-momentum"), "0,1,10 ħ", "0,1,10", "0,2,10"),
    (("tumble", "--body", "book", "--times"), "0:100 ms:3", "0:0.1:3", "0:1:3"),
    (("info", "water", "--temperature"), "100 K,300000 mK", "100,300", "100,200"),
    (("info", "water", "--dipole-abc"), "0,1.8546 debye,0", "0,1.8546,0", "0,2,0"),
    (FIT_WATER, "A=100 kHz", "A=0.1", "A=10"),
    (
        ("fit", "lines.csv", "--start", "water", "--free", "B", "--poor-rms", "1e99", "--default-error"),
        "50 kHz",
        "0.05",
        "1",
    ),
]


@pytest.mark.parametrize(
    ("command", "typed", "plain", "other"), READ, ids=[f"{c[0]} {c[-1]} {t}" for c, t, _, _ in READ]
)
def test_a_number_takes_its_unit(call, folder, command, typed, plain, other):
    (folder / "lines.csv").write_text(LINES)
    answers = []
    for text in (typed, plain, other):
        code, out, err = call(*command, text, "--json", "-")
        assert code == 0, err
        answers.append({key: value for key, value in json.loads(out).items() if key != "command"})
    with_unit, without, different = (json.dumps(_rounded(answer), sort_keys=True) for answer in answers)
    assert with_unit == without
    assert with_unit != different


def _rounded(value):
    """Numbers to 9 digits: 997 kg/m3 and 0.997 g/cm3 differ by a rounding."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


REFUSED = [
    (("stark", "OCS", "--field", "0:100V"), "--field: '0:100V': unit 'V' is not a known unit"),
    (("zeeman", "HC3N", "--field", "0:1V"), "--field: '0:1V': unit 'V' is not a known unit"),
    (("spectrum", "water", "--range", "0:100V"), "--range: '0:100V': unit 'V' is not a known unit"),
    (("spectrum", "water", "--profile", "gauss"), "--profile: 'gauss': expected one of sticks, gaussian"),
    (("spectrum", "water", "--pressure", "1 V", "--path", "1 m"), "--pressure: '1 V': unit 'V' is not a known unit"),
    (("spectrum", "water", "--min-lgint", "-5 dB"), "--min-lgint: '-5 dB': expected plain numbers here"),
    (("emission", "CO", *WINDOW, "--excitation", "20,50"), "--excitation: 20,50: 2 numbers for 1 molecule;"),
    (("emission", "CO", *WINDOW, "--velocity", "8 MHz"), "--velocity: '8 MHz': unit 'MHz' does not measure"),
    (("emission", "CO", *WINDOW, "--column", "1e18 /m3"), "--column: '1e18 /m3': unit '/m3'"),
    (("emission", "CO", *WINDOW, "--filling", "50 K"), "--filling: '50 K': expected plain numbers here"),
    ((*BOX[:4], "--density", "1 g/cm2"), "--density: '1 g/cm2': unit 'g/cm2'"),
    ((*BOX[:4], "--step", "1 km"), "--step: '1 km': unit 'km' does not measure"),
    ((*PULSE, "1e13 W/cm2, 50 %"), "--pulse: fwhm: '50 %': unit '%' does not measure"),
    ((*PULSE, "1e13 V, 1 ps"), "--pulse: peak: '1e13 V': unit 'V' is not a known unit"),
    ((*PULSE, "1e13 W/cm2, -1 ps"), "--pulse: fwhm: -1 ps: expected a finite number above 0 ps"),
    (("raman", "N2", "--laser", "532 V"), "--laser: '532 V': unit 'V' is not a known unit"),
    (("gas", "water", "--times", "0:5V"), "--times: '0:5V': unit 'V' is not a known unit"),
    (("tumble", "water", "--times", "0:10V"), "--times: '0:10V': unit 'V' is not a known unit"),
    (("thermo", "water", "--temperature", "100:300V"), "--temperature: '100:300V'"),
    (("spectrum", "water", "--min-lgint", "50 %"), "--min-lgint: '50 %': expected plain numbers here, without the unit '%'"),
    (("spectrum", "water", "--q", "50 %"), "--q: '50 %': expected plain numbers here, without the unit '%'"),
    (("emission", "CO", *WINDOW, "--redshift", "50 %"), "--redshift: '50 %': expected plain numbers here"),
    (("zeeman", "HC3N", "--field", "1T", "--g", "50 %"), "--g: '50 %': expected plain numbers here"),
    (("zeeman", "HC3N", "--field", "1T", "--g", "3620"), "g: 3620 is no g of the rotation"),
    (("isotopologues", "water", "--min-abundance", "1 K"), "--min-abundance: '1 K': expected plain numbers here"),
    (("accuracy", "s.toml", "--seconds", "20 V"), "--seconds: '20 V': unit 'V' is not a known unit"),
    (("tumble", "water", "--angular-momentum", "0,1,9 V"), "--angular-momentum: '0,1,9 V': unit 'V' is not a known unit"),
    (("identify", "a.csv", "--catalogue", "a.cat", "--velocity", "8 MHz"), "--velocity: '8 MHz': unit 'MHz' does not"),
    (("identify", "a.csv", "--catalogue", "a.cat", "--rest", "0"), "--rest: 0: expected a finite number above 0 MHz"),
    (("view", "a.csv", "--rest", "-5GHz"), "--rest: -5GHz: expected a finite number above 0 MHz"),
    (("identify", "a.csv", "--catalogue", "a.cat", "--background", "-5"), "--background: -5: expected a finite number of 0 K or more"),
    (("identify", "a.csv", "--catalogue", "a.cat", "--model-error", "8 K"), "--model-error: '8 K': expected plain numbers"),
    (("levels", "water", "--jmax", "2.5e0"), "--jmax: '2.5e0': expected a whole number"),
    (
        ("align", "OCS", "--pulse", "1e13 W/cm2 1 ps"),
        "--pulse: '1e13 W/cm2 1 ps': expected 2 to 3 numbers with commas between: peak (W/cm2), fwhm (ps), centre (ps); found 1",
    ),
    (("levels", "water", "--jmax", "2 K"), "--jmax: '2 K': expected a whole number"),
    (("cat", "a.cat", "--range", "0:100V"), "--range: '0:100V': unit 'V' is not a known unit"),
]  # fmt: skip


@pytest.mark.parametrize(("command", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_an_error_names_the_option_and_quotes_what_was_typed(call, folder, command, said):
    line = "  115271.2018  0.0005 -5.0105 2    0.0000  3  28503 101 1           0"
    (folder / "a.cat").write_text(f"{line:80}\n")
    code, out, err = call(*command)
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert err.startswith(f"error: {said}")


HEAD = 'schema = 1\nkind = "align"\nmolecule = "OCS"\n'
TABLES = [
    ('shape = "gaussian"\npeak = "1e13 V"\nfwhm = 1', "pulses[0].peak: '1e13 V': unit 'V' is not a known unit"),
    ('shape = "gaussian"\npeak = 1e13\nfwhm = "50 %"', "pulses[0].fwhm: '50 %': unit '%' does not measure"),
    ('shape = "gaussian"\npeak = 1e18\nfwhm = 1', "pulses[0].peak: 1e+18: expected a number from 0 to 1e+17 W/cm2"),
    ('shape = "switched"\npeak = 1e12\nrise = -1\nplateau = 1\nfall = 1', "pulses[0].rise: -1: expected a finite"),
    ('shape = "kick"\nfluence = "-1 J/cm2"', "pulses[0].fluence: -1 J/cm2: expected a finite number of 0 J/cm2"),
    ('shape = "gaussian"\npek = 1e13\nfwhm = 1', "pulses[0] has no key 'pek'; the nearest is 'peak'"),
    ('shape = "gausian"', "pulses[0].shape: 'gausian' is none; the nearest is 'gaussian'"),
    ('shape = "gaussian"\npeak = 1e13', "pulses[0]: the key 'fwhm' is missing"),
]


@pytest.mark.parametrize(("table", "said"), TABLES, ids=[said for _, said in TABLES])
def test_an_error_names_the_table_of_a_pulse_and_its_key(call, folder, table, said):
    (folder / "s.toml").write_text(f"{HEAD}[[pulses]]\n{table}\n")
    code, out, err = call("plan", "s.toml")
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert said in err


def test_a_list_without_a_pulse(call, folder):
    (folder / "s.toml").write_text(f"{HEAD}pulses = []\n")
    code, _, err = call("plan", "s.toml")
    assert code == 2
    assert err.startswith("error: pulses: expected one or more, such as")
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("typed", ["20-600GHz", "20 - 600 GHz", "20GHz-600GHz", "20–600 GHz"])
def test_a_range_with_a_hyphen_between_two_numbers(call, folder, typed):
    assert call("spectrum", "water", "--range", typed)[:2] == call("spectrum", "water", "--range", "20:600GHz")[:2]


def test_whole_numbers_may_have_a_power_of_ten():
    from rotor.requests.readers import Whole

    read = Whole().read
    assert [read(text) for text in ("1e5", "2.5E3", " 1e+2 ")] == [100_000, 2500, 100]
    for text in ("1e-1", "2.55e1", "1e", "e5"):
        with pytest.raises(ValueError, match="expected a whole number"):
            read(text)
