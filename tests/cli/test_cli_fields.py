"""`rotor stark` and `rotor align`: what they print and write, the same request from Python, wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.alignment.pulse import GaussianPulse, Kick
from rotor.alignment.request import AlignRequest, answer_align
from rotor.cli.workers import Counted, working
from rotor.formats import read
from rotor.quantum.effects.stark import StarkRequest, answer_stark
from rotor.quantum.effects.zeeman import ZeemanRequest, answer_zeeman
from rotor.reports.screen import plain
from rotor.spectra.fields.lines import field_lines
from rotor.units import NUCLEAR_MAGNETON_MHZ_PER_T

BARE = ("--constants", "B=6081.492 MHz", "--anisotropy", "4.04")
SHORT = ("--pulse", "1e13 W/cm2, 50 fs", "--points", "51", "--temperature", "0", "--tolerance", "1e-4")
COMMAND_KEYS = {"rotor_version", "command", "input", "files"}


def rows(path: str) -> list[list[str]]:
    return [line.split(",") for line in Path(path).read_text().splitlines()]


def test_stark_writes_what_the_library_computes(call):
    code, out, err = call(
        "stark",
        "OCS",
        "--field",
        "0:200kV/cm:5",
        "--states",
        "J<=1",
        "--csv",
        "a.csv",
        "--plot",
        "a.png",
        "--json",
        "a.json",
    )
    assert (code, err) == (0, "")
    assert "μ_eff" in out
    table = rows("a.csv")
    assert table[0][:6] == ["field_kv_per_cm", "m", "rank", "energy_mhz", "label", "mu_eff_debye"]
    assert len(table) == 1 + 5 * 3
    content = json.loads(Path("a.json").read_text())
    answer = answer_stark(
        StarkRequest(read("OCS"), tuple(np.linspace(0, 200, 5).tolist()), j_highest=1, tolerance_mhz=1e-4)
    )
    assert set(content) - COMMAND_KEYS == {*answer.facts(), "states"}
    for key, value in plain(answer.facts()).items():
        assert content[key] == value, key
    assert [row["energy_mhz"] for row in content["states"]] == answer.states.energy_mhz.tolist()
    assert Path("a.png").stat().st_size > 10_000
    assert json.loads(Path("a.csv.provenance.json").read_text())["jmax"] == answer.states.jmax


def test_stark_with_light_labels_and_chosen_m(call):
    code, out, _ = call(
        "stark", "OCS", "--field", "0,50", "--states", "1", "--m", "0", "--intensity", "1e11 W/cm2", "--diabatic-gap", "1 MHz",
        "--json", "-",
    )  # fmt: skip
    content = json.loads(out)
    assert code == 0
    assert {row["m"] for row in content["states"]} == {0}
    assert {row["diabatic_label"] for row in content["states"]} == {"0", "1"}


def test_stark_coefficients_stand_on_the_screen_too(call):
    """OCS: c2 = -μ²/6(B - 2D) for J = 0 (docs/stark.md), and the rows of the file in their order."""
    code, out, _ = call("stark", "OCS", "--field", "0:10kV/cm:3", "--states", "J<=1", "--coefficients", "c.csv")
    printed = [line.split() for line in out.split("Stark coefficients\n")[1].splitlines()[1:4]]
    written = rows("c.csv")[1:]
    assert code == 0
    assert printed[0][:4] == ["0", "0", "0", "-3.55285"]
    for cells, row in zip(printed, written, strict=True):
        assert cells[:2] == row[:2]
        assert np.allclose([float(x) for x in cells[2:6]], [float(x) for x in row[2:6]], rtol=1e-5)  # six digits


def test_stark_writes_lines_spectra_mixtures_and_tables(call):
    """Every further file; lines as the library has them, and two processes as one."""
    code, _, err = call(
        "stark", "OCS", "--field", "0:5kV/cm:6", "--states", "J<=1", "--light", "perpendicular", "--temperature", "2K",
        "--line", "1 - 0", "--spread", "0.01", "--linewidth", "0.1MHz", "--range", "12:12.3GHz", "--lines", "l.csv",
        "--lobes", "l.png", "--spectrum", "s.csv", "--coefficients", "c.csv", "--mixture", "m.csv", "--deflection", "d.csv",
    )  # fmt: skip
    assert (code, err) == (0, "")
    computed = field_lines(
        read("OCS"), np.linspace(0, 5, 6), j_highest=1, light="perpendicular", temperature_k=2.0
    ).lobes("1", "0")
    table = rows("l.csv")
    assert table[0] == list(computed.columns)
    assert [float(line[1]) for line in table[1:]] == computed.frequency_mhz.tolist()
    assert rows("c.csv")[0][:5] == ["upper", "upper_m", "lower", "lower_m", "c1_mhz_per_kv_per_cm"]
    assert rows("d.csv")[0] == ["field_kv_per_cm", "mu_eff_debye 0 M0", "mu_eff_debye 1 M0", "mu_eff_debye 1 M1"]
    assert rows("m.csv")[0][:3] == ["field_kv_per_cm", "energy_mhz", "mu_eff_debye"]
    spectrum = np.array(rows("s.csv")[1:], dtype=float)
    strongest = spectrum[np.argmax(spectrum[:, 1]), 0]
    assert strongest == pytest.approx(
        computed.frequency_mhz[-1], abs=2.5
    )  # the spread: 2 % of a shift of 62 MHz, twice
    assert Path("l.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("option", "value", "file"),
    [("--line", "1 - 0", "--coefficients c.csv"), ("--light", "perpendicular", "--lines c.csv"), ("--spread", "0.01", "--spectrum c.csv"),
     ("--temperature", "2K", "--mixture c.csv"), ("--linewidth", "2MHz", "--spectrum c.csv"),
     ("--populations", "adiabatic", "--lines c.csv")],
)  # fmt: skip
def test_stark_refuses_what_changes_no_file_that_is_written(call, folder, option, value, file):
    words = ("stark", "OCS", "--field", "0,1", "--states", "1", option, value)
    code, out, err = call(*words)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {option}: does not change the map itself; expected with ")
    assert file.split()[0] in err
    assert list(folder.iterdir()) == []
    assert call(*words, *file.split())[0] == 0


def test_stark_with_the_spin_of_a_nucleus(call):
    """A linear top in a weak field: three levels of J = 1 (F = 0, 1, 2) with their M_F, the picture too."""
    arguments = ("--constants", "B=4549 MHz", "--dipole-abc", "3.73,0,0", "--spin-constants", "chi_aa(14N)=-4.3 MHz")
    code, out, err = call("stark", *arguments, "--field", "0,0.1", "--states", "1", "--json", "-", "--plot", "a.png")
    assert (code, err) == (0, "")
    content = json.loads(out)
    assert content["hyperfine"] is True
    levels = {(row["label"], row["m"]) for row in content["states"]}
    assert levels == {("0 1", 0), ("0 1", 1), ("1 0", 0), ("1 1", 0), ("1 1", 1), ("1 2", 0), ("1 2", 1), ("1 2", 2)}
    assert Path("a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "arguments",
    [("H2O", "--states", "J<=1", "--tilt", "30", "--intensity", "1e8 W/cm2"), ("formamide", "--hyperfine", "--states", "J<=0")],
    ids=["one state", "spins"],
)  # fmt: skip
def test_workers_change_no_number(call, arguments):
    """Blocks of states go to other processes with what computes their elements."""
    results = []
    for workers in ("1", "2"):
        code, out, err = call("stark", *arguments, "--field", "0,1", "--workers", workers, "--json", "-")
        assert (code, err) == (0, "")
        results.append(json.loads(out)["states"])
    assert results[0] == results[1]


def test_align_writes_what_the_library_computes(call):
    code, _, err = call(
        "align", "OCS", *SHORT, "--observable", "cos2theta", "--observable", "cos2theta_2d", "--classical", "200",
        "--csv", "a.csv", "--plot", "a.png", "--json", "a.json",
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert rows("a.csv")[0] == ["t_ps", "cos2theta", "cos2theta_2d", "cos2theta_classical", "cos2theta_2d_classical"]
    content = json.loads(Path("a.json").read_text())
    request = AlignRequest(
        read("OCS"), (GaussianPulse(1e13, 0.05),), temperature_k=0.0, points=51, tolerance=1e-4,
        observables=("cos2theta", "cos2theta_2d"), classical_molecules=200,
    )  # fmt: skip
    answer = answer_align(request)
    assert set(content) - COMMAND_KEYS == {*answer.facts(), "trace"}
    for key, value in plain(answer.facts()).items():
        assert content[key] == value, key
    assert [row["cos2theta"] for row in content["trace"]] == answer.table.columns["cos2theta"].tolist()
    assert Path("a.png").stat().st_size > 10_000


def test_align_of_bare_constants(call):
    """Figures of fields.md for OCS at 1e13 W/cm² and 50 fs: 0.887 at 38.7 ps."""
    code, out, _ = call("align", *BARE, *SHORT[:2], "--temperature", "0", "--until", "82 ps", "--json", "-")
    content = json.loads(out)
    assert code == 0
    assert content["extremes"][0]["max"] == pytest.approx(0.887, abs=1e-3)  # grid of 41 fs
    assert content["permanent"]["cos2theta"] == pytest.approx(0.48630, abs=2e-3)  # digits; their mean is over the grid


@pytest.mark.parametrize(
    "options",
    [
        ("--switched", "1e11 W/cm2, 10, 0, 5"),
        ("--kick", "0.1 J/cm2"),
        ("--pulse", "5e12 W/cm2, 50 fs", "--polarization", "circular"),
        ("--pulse", "5e12 W/cm2, 50 fs", "--polarization", "elliptical:0.3"),
        ("--pulse", "5e12 W/cm2, 50 fs", "--pulse", "5e12 W/cm2, 50 fs, 1 ps"),
        ("--pulse-table", "pulse.csv"),
        ("--thz", "500 kV/cm, 1 ps, 0.3 THz", "--dipole-abc", "0.7,0,0"),
    ],
)
def test_every_kind_of_pulse(call, options):
    Path("pulse.csv").write_text("# measured\nt_ps,intensity_w_per_cm2\n0,0\n0.1,5e12\n0.3,0\n")
    code, out, err = call("align", *BARE, *options, "--temperature", "0", "--points", "11", "--tolerance", "1e-3")
    assert (code, err) == (0, "")
    assert "cos2theta" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("align", "OCS"), "no pulse"),
        (
            ("align", "OCS", *SHORT[:2], "--state", "j=1,m=0"),
            "--state: a level has all M, and one |M| of it is given by --m",
        ),
        (("align", "OCS", "--pulse", "1e13 W/cm2"), "--pulse: '1e13 W/cm2': expected 2 to 3 numbers"),
        (("align", "OCS", "--pulse", "1e13 MHz, 1 ps"), "--pulse: peak: '1e13 MHz'"),
        (("align", "OCS", "--pulse", "1e13 W/cm2, 1 MHz"), "--pulse: fwhm: '1 MHz'"),
        (("align", "OCS", "--pulse", "-1e13 W/cm2, 1 ps"), "--pulse: peak: -1e13 W/cm2"),
        (
            ("align", "OCS", "--pulse", "1e13 W/cm2, 10 ps", "--until", "5"),
            "--until: 5 ps is before the pulses have ended",
        ),
        (("align", "OCS", "--pulse", "1e13 W/cm2, 1 ps", "--jmax", "20"), "J max 20 is too small"),
        (("align", "OCS", "--pulse", "1e13 W/cm2, 1 ps", "--tolerance", "2"), "--tolerance: 2"),
        (("align", "OCS", "--pulse", "1e13 W/cm2, 1 ps", "--temperature", "-1"), "--temperature: -1"),
        (("align", "OCS", "--pulse", "1e13 W/cm2, 1 ps", "--polarization", "up"), "--polarization: 'up'"),
        (("align", "OCS", "--pulse", "1e13 W/cm2, 1 ps", "--state", "1"), "--state: '1'"),
        (
            ("align", "OCS", "--pulse", "1e13 W/cm2, 1 ps", "--state", "j=0,m=0", "--temperature", "10"),
            "--temperature and --state: give one of them",
        ),
        (("align", "OCS", "--pulse", "1e13 W/cm2, 1 ps", "--observable", "cosine"), "observable 'cosine'"),
        (("align", "CCl4", "--pulse", "1e13 W/cm2, 1 ps"), "spherical top"),
        (
            ("align", "H2O", "--anisotropy", "3", "--pulse", "1e13 W/cm2, 1 ps"),
            "--anisotropy: a top of the kind asymmetric",
        ),
        (("align", "OCS", "--pulse-table", "missing.csv"), "missing.csv"),
        (("stark", "OCS", "--field", "1e12V/m"), "no molecule holds together"),
        (("stark", "OCS", "--field", "0:5:1T"), "--field"),
        (("stark", "OCS", "--field", "0:100", "--states", "all"), "--states: 'all'"),
        (("stark", "OCS", "--m", "7"), "--m: "),
        (("stark", "OCS", "--field", "500", "--jmax", "5"), "J max 5 is too small"),
        (("stark", "OCS", "--field", "5", "--plot", "a.png"), "--plot: a picture of a map needs two fields"),
        (("stark", "OCS", "--intensity", "-1"), "--intensity: -1"),
        (("stark", "N2"), "no dipole"),
        (("stark", "OCS", "--light", "up"), "--light: 'up'"),
        (("stark", "OCS", "--hyperfine"), "no constants of spins"),
        (("stark", "OCS", "--m", "0.5"), "--m: "),
        (("stark", "OCS", "--m", "x"), "--m: 'x'"),
        (("stark", "OCS", "--line", "1"), "--line: '1'"),
        (("stark", "OCS", "--line", "9 - 8", "--lines", "a.csv"), "no line 9 - 8"),
        (("stark", "OCS", "--spread", "2"), "--spread: 2"),
        (("stark", "OCS", "--tilt", "up"), "--tilt: 'up'"),
        (("stark", "OCS", "--tilt", "20", "--m", "0"), "mixes M"),
        (("stark", "OCS", "--light", "1,2", "--lines", "a.csv"), "a direction such as 1,0,1"),
        (("stark", "OCS", "--workers", "0"), "--workers: 0"),
        (("stark", "OCS", "--field", "0,1,5", "--deflection", "a.csv"), "evenly"),
        (("stark", "OCS", "--temperature", "0"), "--temperature"),
        (("stark", "CCl4"), "spherical top"),
    ],
)
def test_wrong_input_is_one_line_and_code_2(call, arguments, message):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert not [path for path in Path().iterdir() if path.suffix in (".png", ".csv", ".json")]


def test_a_temperature_beside_a_level_is_that_of_the_classical_gas(call):
    """A level has no temperature; the classical gas beside it has one, and a note says which is which."""
    given = (
        "align",
        "OCS",
        "--pulse",
        "1e12 W/cm2, 1 ps",
        "--state",
        "j=0",
        "--temperature",
        "10",
        "--until",
        "8 ps",
    )
    code, _, err = call(*given, "--points", "3", "--classical", "200")
    assert (code, err) == (
        0,
        "note: the classical gas is at the temperature of --temperature, not in the level of --state\n",
    )


def test_pieces_are_counted_in_order():
    """On a terminal a bar says after each piece how many are done; results come in order, errors where they are asked for."""
    seen: list[tuple[int, int]] = []
    counted = Counted(None, lambda done, total: seen.append((done, total)))
    assert list(counted.map(lambda x: x * x, [3, 1, 2])) == [9, 1, 4]
    assert seen == [(1, 3), (2, 3), (3, 3)]
    with pytest.raises(ValueError, match="invalid literal"):
        list(counted.map(int, ["x"]))
    with working(1, "blocks") as executor:
        assert executor is None  # standard error is no terminal here


# rotor zeeman

NITRILE = """
name = "nitrile"
[constants]
B = 4549.06
[magnetic]
source = "invented"
g = -0.01
magnetisability_parallel = -40.0
magnetisability_perpendicular = -30.0
[spins.14N]
chi_aa = -4.3
"""


def test_the_element_of_g_along_a_linear_axis_is_said_to_do_nothing(call):
    code, _, err = call("zeeman", "CO", "--g", "1,-0.27", "--field", "1T")
    assert code == 0
    assert "note: --g: the element along the axis of a linear molecule, 1, has no effect\n" in err
    code, _, err = call("zeeman", "CO", "--g", "0,-0.27", "--field", "1T")
    assert (code, "no effect" in err) == (0, False)


def test_a_scene_of_zeeman_keeps_the_tensors_as_entered(call, folder):
    inputs = ("--constants", "B=6081.5 MHz", "--g", "-0.03", "--field", "0,1T", "--states", "J<=1")
    code, _, err = call("zeeman", *inputs, "--save-scene", "s.toml")
    assert code == 0, err
    scene = (folder / "s.toml").read_text()
    assert "[magnetic]\ng = [-0.03]\n" in scene
    (folder / "s.toml").write_text(scene + '\n[outputs]\ncsv = "scene.csv"\n')
    assert call("zeeman", *inputs, "--csv", "verb.csv")[0] == call("run", "s.toml")[0] == 0
    assert (folder / "scene.csv").read_text() == (folder / "verb.csv").read_text()


def test_a_tensor_in_two_forms_is_refused(call):
    Path("m.toml").write_text(NITRILE.replace("g = -0.01", "g = -0.01\ng_perpendicular = -0.01"))
    code, _, err = call("zeeman", "m.toml", "--field", "1 T", "--states", "J<=1")
    assert code == 2
    assert "g_perpendicular beside g: give the tensor in a single form" in err


def test_zeeman_writes_what_the_library_computes(call):
    """Tensors of the file, g of 14N of the table of isotopes, a field in gauss; the same request from Python."""
    Path("m.toml").write_text(NITRILE)
    arguments = ("--field", "0:200G:3", "--states", "J<=1", "--hyperfine", "--csv", "a.csv", "--plot", "a.png")
    code, out, err = call("zeeman", "m.toml", *arguments, "--json", "a.json")
    assert (code, err) == (0, "")
    assert "μ_N" in out
    content = json.loads(Path("a.json").read_text())
    answer = answer_zeeman(ZeemanRequest(read("m.toml"), (0.0, 0.01, 0.02), j_highest=1, hyperfine=True))
    assert set(content) - COMMAND_KEYS == {*answer.facts(), "states"}
    for key, value in plain(answer.facts()).items():
        assert content[key] == value, key
    assert content["nuclear_g"]["14N"] == pytest.approx(0.4037, abs=1e-3)  # μ/(μ_N I), shielding aside
    assert content["magnetisability_abc"][0][0] == -40.0
    assert [row["energy_mhz"] for row in content["states"]] == answer.states.energy_mhz.tolist()
    assert rows("a.csv")[0][:6] == ["field_tesla", "m", "rank", "energy_mhz", "label", "moment_nuclear_magnetons"]
    assert sum(row["copies"] for row in content["states"]) == 3 * 12  # (2I+1) (1 + 3) states at 3 fields
    assert Path("a.png").stat().st_size > 10_000


def test_zeeman_of_bare_constants(call):
    """A linear top is E0 - g μ_N B M, whichever way g is given."""
    for text in ("-0.03", "0,-0.03", "5,-0.03,-0.03"):
        code, out, _ = call(
            "zeeman", "--constants", "B=6000 MHz", "--g", text, "--field", "2T", "--states", "1", "--json", "-"
        )
        assert code == 0
        shifts = sorted(row["energy_mhz"] for row in json.loads(out)["states"])
        step = 0.06 * NUCLEAR_MAGNETON_MHZ_PER_T
        assert shifts == pytest.approx([0.0, 12000 - step, 12000.0, 12000 + step], abs=1e-9)  # round-off of 12000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("OCS",), "the rotational g tensor is not known: give --g"),
        (("OCS", "--g", "1,2,3,4"), "--g: 4 numbers for a top of the kind linear"),
        (("OCS", "--g", "x"), "'x' is not a number"),
        (("OCS", "--g", "-.03", "--field", "0:1kV/cm"), "--field: '0:1kV/cm': unit 'kV/cm'"),
        (("OCS", "--g", "-.03", "--field", "2000T"), "2000 T is beyond 1000 T"),
        (("OCS", "--g", "-.03", "--field", "1T", "--plot", "a.png"), "--plot: a picture of a map needs two fields"),
        (("OCS", "--g", "-.03", "--nuclear-g", "14N=2"), "--nuclear-g: belongs to spins"),
        (("CH4", "--g", "0.3"), "a spherical top has an isotropic g"),
        (("CH3CN", "--g", "1,2,3"), "symmetric about a"),
        (
            ("CH3CN", "--g", "1,2", "--hyperfine", "--nuclear-g", "15N=1"),
            "--nuclear-g: 15N: the spins of this top are 14N",
        ),
    ],
)
def test_wrong_input_of_zeeman(call, arguments, message):
    code, out, err = call("zeeman", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert message in err
    assert err.count("\n") == 1
    assert not list(Path().glob("*.png"))


def test_m_and_its_negative_are_one_row_with_three_dipole_components(call):
    """M and -M coincide by time reversal; "mixed" is for fields at an angle alone."""
    options = (
        "stark",
        "--constants",
        "A=10 B=6 C=4 GHz",
        "--dipole-abc",
        "1,0.7,-0.4",
        "--field",
        "0,5",
        "--states",
        "J<=1",
    )
    code, out, err = call(*options)
    assert code == 0, err
    assert "mixed" not in out
    assert not any(line.split()[3:4] == ["-1"] for line in out.splitlines())
    assert "mixed" in call(*options, "--tilt", "30")[1]


def test_the_report_of_align_has_the_numbers_of_each_pulse(call):
    pulses = ("--pulse", "1e12 W/cm2, 1 ps", "--kick", "0.1 J/cm2, 30", "--thz", "200 kV/cm, 1 ps, 0.3 THz, 20")
    code, out, _ = call("align", "OCS", *pulses, "--points", "11", "--tolerance", "1e-3")
    text = " ".join(out.split())
    assert code == 0
    assert "GaussianPulse on the polarizability, -3.5 to 3.5 ps (peak 1e+12 W/cm2, fwhm 1 ps, centre 0 ps)" in text
    assert "Kick on the polarizability, 30 to 30 ps (fluence 0.1 J/cm2, time 30 ps)" in text
    assert "(peak 200 kV/cm, fwhm 1 ps, frequency 0.3 THz, phase 0, centre 20 ps)" in text


def test_cosines_of_named_axes_are_formulas_below_the_picture():
    answer = rotor.align("OCS", pulses=[Kick(0.1)], observables=["cos2_aX", "cos_bZ"], points=11, tolerance=1e-3)
    figure = answer.plot()
    figure.canvas.draw()
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["⟨cos²θ$_{aX}$⟩", "⟨cosθ$_{bZ}$⟩"]
    assert legend.get_window_extent().y1 < figure.axes[1].bbox.y0
