"""`rotor view` without a browser: sessions, undo, resuming, windows of the spectrum, predictions, rows, fits, exports, the widget."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from view_cases import DIPOLE, KELVIN, NAME, NOISE, SERIES, STEP, TRUE, WIDTH, assign_line, true_lines, write_case

from rotor.viewer.actions.actions import ACTIONS
from rotor.viewer.actions.fits import fit_assignments
from rotor.viewer.actions.peak_fit import fit_peak
from rotor.viewer.opening import open_session
from rotor.viewer.pyramid import pyramid
from rotor.viewer.records import Line
from rotor.viewer.session import SUFFIX, read_session


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of a case."""
    folder = tmp_path_factory.mktemp("view")
    write_case(folder)
    return folder


@pytest.fixture
def service(made, tmp_path, monkeypatch):
    """A session on the case with its molecule, in a folder of its own."""
    for name in ("spectrum.csv", NAME):
        (tmp_path / name).write_bytes((made / name).read_bytes())
    monkeypatch.chdir(tmp_path)
    opened = open_session("spectrum.csv", [NAME], temperature_k=KELVIN)
    yield opened
    opened.session.release()


@pytest.fixture(scope="module")
def unchanged(made, tmp_path_factory):
    """A session for messages that leave it as it is."""
    folder = shutil.copytree(made, tmp_path_factory.mktemp("unchanged"), dirs_exist_ok=True)
    opened = open_session(str(folder / "spectrum.csv"), [str(folder / NAME)], temperature_k=KELVIN)
    yield opened
    opened.session.release()


def done(service, name, **message):
    """The content of an answer that is no error."""
    answer = service.answer({"do": name, **message})
    assert "ok" in answer, answer
    return answer["ok"]


# Sessions


def test_every_action_can_be_undone_and_redone_and_is_on_disk(service):
    def tried(name, **message):
        before = service.session.state
        done(service, name, **message)
        after = service.session.state
        assert after != before, name
        done(service, "undo")
        assert service.session.state == before, name
        assert read_session(service.session.path).state == before
        done(service, "redo")
        assert service.session.state == after, name
        assert read_session(service.session.path).state == after
        return name

    seen = {tried("add_species", source="CO", temperature_k=20.0)}
    seen.add(tried("remove_species", species=2))
    f = 16030.188
    target = [{"species": 1, "upper": [3, 0, 3], "lower": [2, 0, 2]}]
    seen.add(tried("assign", frequency_mhz=f, error_mhz=0.002, to=target))
    for upper, lower in SERIES:
        assign_line(service, upper, lower)
    seen.add(tried("edit", lines=[2], error_mhz=0.02, weight=0.5, comment="shoulder"))
    seen.add(tried("reject", lines=[2], rejected=True))
    seen.add(tried("remove", lines=[2]))
    seen.add(tried("free", species=1, free=["A", "B", "C", "DeltaJ", "PhiJ"]))
    seen.add(tried("free", species=1, free=["A", "B", "C"]))
    seen.add(tried("constants", species=1, constants={"A": 9000.01}))
    seen.add(tried("species", species=1, temperature_k=4.0, dipole_abc_debye=[1.0, 1.0, 0.0], scale=2.0, visible=False))
    seen.add(tried("refit", species=1))
    seen.add(tried("series", series={"species": 1, "upper": [3, 0, 3], "lower": [2, 0, 2], "step": [1, 0, 1]}))
    seen.add(tried("assign_series", tolerance_mhz=0.4))
    seen.add(tried("settings", auto_refit=True))
    assert seen == set(ACTIONS)
    labels = len(service.session.done)
    for _ in range(labels):
        done(service, "undo")
    assert service.session.state.records == {}
    for _ in range(labels):
        done(service, "redo")
    assert read_session(service.session.path).state == service.session.state


_KILLED = """
import sys
from pathlib import Path
from rotor.viewer.records import Line, SpectrumFile
from rotor.viewer.session import Session, read_session
path = Path(sys.argv[1])
session = read_session(path) if path.exists() else Session(SpectrumFile("s.csv", "0", 1), path)
session.hold()
print("ready", flush=True)
while True:
    number = session.state.free_number("line")
    session.apply("assign", {f"line/{number}": Line(1, (number, 0, number), (0, 0, 0), 1.0 * number, 0.1, number)})
    print(number, flush=True)
"""


def test_a_session_killed_fifty_times_loses_no_assignment(tmp_path):
    path, rng = tmp_path / f"s{SUFFIX}", random.Random(4)
    known = 0
    for _ in range(50):
        process = subprocess.Popen([sys.executable, "-c", _KILLED, str(path)], stdout=subprocess.PIPE, text=True)
        assert process.stdout.readline() == "ready\n"
        time.sleep(rng.uniform(0.0, 0.03))
        process.kill()
        said = [int(word) for word in process.communicate()[0].split("\n")[:-1]]  # what a page was told is finished
        known = max([known, *said])
        if path.exists():
            resumed = read_session(path)
            assert set(range(1, known + 1)) <= set(resumed.state.lines)
            assert [len(step.after) for step in resumed.done] == [1] * len(resumed.done)
    assert known > 50


def test_a_folder_is_no_spectrum():
    with pytest.raises(ValueError, match=r"^\.: is a folder; expected a spectrum"):
        open_session(".")


def test_a_changed_spectrum_is_said_and_a_second_program_is_refused(service, tmp_path):
    assign_line(service, *SERIES[0])
    with pytest.raises(ValueError, match="another run"):
        open_session("spectrum.csv")
    service.session.release()
    again = open_session("spectrum.csv")
    assert again.session.state == service.session.state
    assert again.session.warnings == ()
    again.session.release()
    text = (tmp_path / "spectrum.csv").read_text().split("\n")
    (tmp_path / "spectrum.csv").write_text("\n".join(text[:-100]) + "\n")
    notes = []
    other = open_session("spectrum.view.json", note=notes.append)
    other.session.release()
    assert "spectrum.csv has changed since the session was saved" in notes[0]
    assert other.session.state == service.session.state
    assert other.facts()["warnings"] == notes[:1]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{}", "not a session of rotor view"),
        ('{"kind":"x"}', "not a session of rotor view"),
        ("\x00\x01", "not a session of rotor view"),
    ],
)
def test_what_is_no_session_is_refused_in_one_line(made, tmp_path, content, said):
    path = tmp_path / f"a{SUFFIX}"
    path.write_text(content)
    with pytest.raises(ValueError, match=said):
        open_session(path)
    assert path.read_text() == content


# Windows


def test_a_window_has_the_extremes_of_every_pixel():
    rng = np.random.default_rng(3)
    x = np.sort(rng.uniform(0, 1000, 50_000))
    y = rng.normal(size=len(x))
    made = pyramid(x, y)
    for first, last, pixels in (
        (0, 1000, 100),
        (200, 700.5, 333),
        (0, 1000, 7),
        (500, 501, 40),
        (999.9, 1100, 20),
        (-5, 0.0, 3),
    ):
        px, py = made.window(first, last, pixels)
        inside = (x >= first) & (x <= last)
        if inside.sum() <= 2 * pixels:  # the channels themselves
            assert set(y[inside]) <= set(py)
            continue
        assert len(px) <= 2 * pixels
        edges = np.linspace(first, last, pixels + 1)
        pixel = (last - first) / pixels
        for a, b in pairwise(edges):
            here = (x >= a) & (x < b)
            if here.any():
                near = np.abs(px - (a + b) / 2) < 0.01 * pixel  # the pixel's own two points
                assert py[near].max() >= y[here].max()
                assert py[near].min() <= y[here].min()
        assert py.max() == y[inside].max() or py.max() in y  # nothing is made up


def test_a_single_spike_is_seen_at_every_zoom():
    y = np.zeros(1_000_000)
    y[777_777] = 1.0
    y[-1] = 0.5
    made = pyramid(np.arange(1e6), y)
    for span in (1e6, 3e5, 1e4, 500.0):
        x, seen = made.window(777_777 - span / 2, 777_777 + span / 2, 800)
        assert seen.max() == 1.0
        assert abs(x[seen.argmax()] - 777_777) <= 1.5 * span / 800
    assert made.window(900_000, 1e6, 333)[1].max() == 0.5  # the last channel, in a block that is not full


# Predictions


def test_sticks_are_the_line_list_and_previews_change_nothing(service):
    lines = service.predictions.lines(service.session.state.species[1]).lines
    window = done(service, "window", first_mhz=9000, last_mhz=17000, pixels=500)
    sticks = window["sticks"]["1"]
    inside = (lines.frequency_mhz >= 9000) & (lines.frequency_mhz < 17000)
    assert len(sticks["x"]) == inside.sum()
    assert np.allclose(sticks["x"], lines.frequency_mhz[inside], atol=1e-6)  # rounded for the message
    before = service.session.state
    moved = done(
        service,
        "window",
        first_mhz=9000,
        last_mhz=17000,
        pixels=500,
        preview={"species": 1, "constants": {"B": 3001.0}},
    )
    assert max(moved["sticks"]["1"]["x"]) != max(sticks["x"])
    assert service.session.state == before


def test_of_many_lines_the_strongest_of_each_piece_stays(service):
    predicted = service.predictions.lines(service.session.state.species[1])
    few = predicted.between(8000.0, 17000.0, 10)
    assert len(few) <= 10
    assert int(np.argmax(predicted.intensity)) in few.tolist()


def test_a_refit_finds_the_constants_that_made_the_spectrum(service):
    for upper, lower in SERIES:
        assert assign_line(service, upper, lower)["ok"]["label"]
    done(service, "refit", species=1)
    record = service.session.state.species[1]
    for name in "ABC":
        assert abs(record.constants[name] - TRUE[name]) < 5 * record.errors[name]
        assert record.fit.before[name] != record.constants[name] or name == "C"
    rows = service.facts()["lines"]
    assert max(abs(row["difference_mhz"]) for row in rows.values()) < 0.005  # noise over height of the weakest line


def test_automatic_refits_are_one_step_and_say_why_not(service):
    done(service, "settings", auto_refit=True)
    answer = assign_line(service, *SERIES[0])
    assert answer["notes"][0].startswith("not refitted: lines of case: 3 free constants for 1")
    for upper, lower in SERIES[1:4]:
        assign_line(service, upper, lower)
    assert service.session.state.species[1].fit.lines == 4
    steps = len(service.session.done)
    assign_line(service, *SERIES[4])
    assert len(service.session.done) == steps + 1
    assert service.session.state.species[1].fit.lines == 5
    done(service, "undo")
    assert service.session.state.species[1].fit.lines == 4


def test_peak_fit_agrees_with_another_program_and_with_the_closed_form_of_its_error(service):
    from scipy.optimize import curve_fit

    spectrum = service.spectrum
    f = spectrum.frequency_mhz[np.argmax(spectrum.intensity)]
    peak = fit_peak(spectrum, f - 0.5, f + 0.5)
    a, b = np.searchsorted(spectrum.frequency_mhz, (f - 0.5, f + 0.5))
    x, y = spectrum.frequency_mhz[a:b], spectrum.intensity[a:b]

    def gaussian(x, b0, b1, h, centre, width):
        return b0 + b1 * (x - f) + h * np.exp(-4 * np.log(2) * ((x - centre) / width) ** 2)

    best, covariance = curve_fit(
        gaussian,
        x,
        y,
        p0=[0, 0, y.max(), f, 0.1],
        sigma=np.full(len(x), NOISE),
        absolute_sigma=True,
        ftol=1e-14,
        xtol=1e-14,
    )
    assert abs(peak.frequency_mhz - best[3]) < 1e-3 * peak.error_mhz + 1e-9
    assert abs(peak.width_mhz - best[4]) < 1e-3 * peak.width_error_mhz + 1e-8
    noise = float(np.median(spectrum.noise))
    assert abs(peak.error_mhz / (np.sqrt(covariance[3, 3]) * max(1.0, peak.rms) * noise / NOISE) - 1) < 1e-3
    s = WIDTH / np.sqrt(2)
    closed = noise / peak.height * np.sqrt(2 * s * STEP / np.sqrt(np.pi))
    assert (
        abs(peak.error_mhz / closed - 1) < 0.35
    )  # the baseline is fitted too, and the residuals scatter a little more


# Loomis-Wood rows


def test_rows_of_a_series_stand_about_the_predicted_lines(service):
    done(service, "series", series={"species": 1, "upper": [3, 0, 3], "lower": [2, 0, 2], "step": [1, 0, 1]})
    rows = done(service, "loomis_wood", half_width_mhz=2.0, pixels=200)["rows"]
    predicted = service.predictions.lines(service.session.state.species[1]).lines
    levels = predicted.levels
    for row in rows:
        at = [levels.find(j=j, ka=ka, kc=kc) for j, ka, kc in (row["upper"], row["lower"])]
        assert row["centre_mhz"] == pytest.approx(levels.energy_mhz[at[0]] - levels.energy_mhz[at[1]], abs=1e-9)
        assert abs(max(row["x"]) - 2.0) < 0.05
    assert [row["upper"][0] for row in rows] == sorted(row["upper"][0] for row in rows)
    count = done(service, "assign_series", tolerance_mhz=0.4)
    assert str(len(rows)) in count["label"]


def test_two_lines_are_extrapolated_linearly_and_three_by_a_parabola(service):
    done(service, "series", series={"frequencies_mhz": [9000.0, 10000.0]})
    rows = done(service, "loomis_wood", half_width_mhz=1.0, pixels=50)["rows"]
    assert [round(row["centre_mhz"]) for row in rows] == [9000, 10000, 11000, 12000, 13000, 14000, 15000, 16000]
    done(service, "series", series={"frequencies_mhz": [9000.0, 10000.0, 11100.0]})
    rows = done(service, "loomis_wood", half_width_mhz=1.0, pixels=50)["rows"]
    assert [round(row["centre_mhz"], 6) for row in rows] == [8100, 9000, 10000, 11100, 12300, 13600, 15000, 16500]


# Files


def test_lines_written_and_read_again_are_the_same(service, tmp_path):
    for upper, lower in SERIES:
        assign_line(service, upper, lower)
    blend = [
        {"species": 1, "upper": [3, 2, 2], "lower": [2, 2, 1], "weight": 0.25},
        {"species": 1, "upper": [3, 2, 1], "lower": [2, 2, 0], "weight": 0.75},
    ]
    done(service, "assign", frequency_mhz=16200.5, error_mhz=0.0312, to=blend)
    done(service, "edit", lines=[2], error_mhz=0.0077)
    before = {
        (line.upper, line.lower): (line.frequency_mhz, line.error_mhz, line.weight, line.rejected)
        for line in service.session.state.lines.values()
    }
    for suffix in ("lin", "csv"):
        made = done(service, "export", what=suffix, species=1)
        (tmp_path / made["name"]).write_text(made["text"])
        other = open_session("spectrum.csv", [NAME], lines=made["name"], session=f"{suffix}{SUFFIX}")
        other.session.release()
        lines = other.session.state.lines.values()
        after = {
            (line.upper, line.lower): (line.frequency_mhz, line.error_mhz, line.weight, line.rejected) for line in lines
        }
        assert after == before
        numbers = [line.blend for line in lines if line.frequency_mhz == 16200.5]
        assert len(numbers) == 2
        assert len(set(numbers)) == 1
        assert len({line.blend for line in lines}) == len(before) - 1
        notes = []
        again = open_session("spectrum.csv", [NAME], lines=made["name"], session=f"{suffix}{SUFFIX}", note=notes.append)
        again.session.release()
        assert again.session.state == other.session.state  # the file named again adds nothing
        assert f"{len(before)} lines are in the session already" in notes[-1]


def test_rejected_lines_stay_rejected_in_files(service, tmp_path):
    for upper, lower in SERIES:
        assign_line(service, upper, lower)
    done(service, "reject", lines=[2], rejected=True)
    for suffix in ("lin", "csv"):
        made = done(service, "export", what=suffix, species=1)
        (tmp_path / made["name"]).write_text(made["text"])
        other = open_session("spectrum.csv", [NAME], lines=made["name"], session=f"{suffix}{SUFFIX}")
        other.session.release()
        assert sum(line.rejected for line in other.session.state.lines.values()) == 1


def test_exports_are_read_by_the_other_verbs(service, call, tmp_path):
    for upper, lower in SERIES:
        assign_line(service, upper, lower)
    done(service, "refit", species=1)
    for what in ("lin", "csv", "par", "var", "toml", "scene", "fit", "md", "tex"):
        made = done(service, "export", what=what, species=1)
        (tmp_path / made["name"]).write_text(made["text"])
    assert call("fit", "case.par", "--lin", "case.lin", "--json", "p.json")[0] == 0
    assert call("fit", "case.csv", "--start", "case.toml", "--free", "A,B,C", "--json", "c.json")[0] == 0
    assert call("run", "case.scene.toml")[0] == 0
    record = service.session.state.species[1]
    fitted = {one["name"]: one for one in json.loads((tmp_path / "c.json").read_text())["parameters"]}
    for name in "ABC":
        assert fitted[name]["value"] == pytest.approx(record.constants[name], abs=1e-6)
    assert call("spectrum", "case.toml", "--range", "8000:9000", "--top", "1")[0] == 0


def test_an_exported_page_has_everything_inside(service, tmp_path):
    from rotor.viewer.export_page import export_page, read_page

    assign_line(service, *SERIES[0])
    text = export_page(service)
    data = read_page(text)
    assert data["hello"]["session"]["records"]["line/1"]["upper"] == [2, 0, 2]
    assert data["x"]["steps"] == len(service.spectrum)
    assert "src=" not in text.split('id="rotor-data"')[0]
    assert '<link rel="stylesheet"' not in text


# Messages


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (7, "expected a message"),
        ({"do": "nonsense"}, "known are hello, window"),
        ({"do": "window", "first_mhz": "a"}, "first_mhz: 'a': expected a finite number"),
        ({"do": "window", "first_mhz": 2, "last_mhz": 1, "pixels": 9}, "expected a range that rises"),
        ({"do": "assign", "frequency_mhz": -1}, "expected a number above 0"),
        ({"do": "assign", "frequency_mhz": 9e3, "to": [{"species": 9}]}, "species: 9: expected one of 1"),
        ({"do": "assign", "frequency_mhz": 9e3, "to": [{"species": 1, "upper": [1], "lower": [0]}]}, "3 quantum numbers; expected"),
        ({"do": "assign", "frequency_mhz": 9e3, "to": [{"species": 1, "upper": [1, 1, 1], "lower": [1, 1, 1]}]}, "are the same"),
        ({"do": "assign", "frequency_mhz": 9e3, "to": [{"species": 1, "upper": [1, 5, 1], "lower": [1, 1, 1]}]}, "there is no such level"),
        ({"do": "remove", "lines": [99]}, "there is no line 99"),
        ({"do": "reject", "lines": [], "rejected": True}, "expected a list"),
        ({"do": "constants", "species": 1, "constants": {"A": float("nan")}}, "expected a finite number"),
        ({"do": "constants", "species": 1, "constants": {"Q": 1.0}}, "Q"),
        ({"do": "free", "species": 1, "free": ["nonsense"]}, "nonsense"),
        ({"do": "species", "species": 1, "temperature_k": 0}, "expected a number above 0"),
        ({"do": "add_species", "source": "no such thing"}, "no such thing"),
        ({"do": "refit", "species": 1}, "no line is assigned"),
        ({"do": "series", "series": {"species": 1, "upper": [1], "lower": [1], "step": [0]}}, "3 quantum numbers each"),
        ({"do": "series", "series": {"what": 1}}, "series"),
        ({"do": "assign_series", "tolerance_mhz": 1}, "choose a series"),
        ({"do": "export", "what": "exe", "species": 1}, "expected one of lin, csv"),
        ({"do": "export", "what": "lin", "species": 1}, "no line is assigned"),
        ({"do": "pick", "species": 1, "level": [50, 60, 1]}, "there is no such level"),
    ],
)  # fmt: skip
def test_a_message_that_cannot_be_is_answered_with_one_line(unchanged, message, said):
    state = unchanged.session.state
    answer = unchanged.answer(message)
    assert said in answer["error"]
    assert "\n" not in answer["error"]
    assert unchanged.session.state == state


def test_a_session_without_an_undo_has_nothing_to_redo(service):
    state = service.session.state
    assert service.answer({"do": "redo"})["error"].endswith("no action was taken back")
    assert service.session.state == state
    assert "ok" in service.answer({"do": "undo", "x": 1})


def test_species_of_many_kinds_are_predicted_and_labelled(service):
    for source, names in (("CO", ["j"]), ("NH3", ["j", "k"])):
        done(service, "add_species", source=source)
        facts = service.facts()
        number = str(max(service.session.state.species))
        assert facts["quanta"][number]["names"][: len(names)] == names
        window = done(service, "window", first_mhz=8000, last_mhz=17000, pixels=100)
        assert number in window["sticks"]


def test_lines_split_by_spins_have_their_quantum_numbers(service, tmp_path):
    text = 'name = "spin"\n[constants]\nB = 6e3\n[dipole]\na = 1.0\n[spins.14N]\nchi_aa = -4.2\n'
    (tmp_path / "spin.toml").write_text(text)
    done(service, "add_species", source="spin.toml", temperature_k=3.0)
    assert service.facts()["quanta"]["2"]["names"] == ["j"]
    target = {"species": 2, "upper": [1], "lower": [0]}
    done(service, "assign", frequency_mhz=12000.0, error_mhz=0.01, to=[target])
    answer = service.answer({"do": "species", "species": 2, "hyperfine": True})
    assert "1 line is assigned by j, not by n, f; remove such lines first" in answer["error"]
    assert service.facts()["lines"]["1"]["calculated_mhz"] == pytest.approx(12000.0)
    done(service, "undo")
    done(service, "species", species=2, hyperfine=True)
    assert service.facts()["quanta"]["2"]["names"] == ["n", "f"]
    window = done(service, "window", first_mhz=11990, last_mhz=12010, pixels=100)["sticks"]["2"]
    assert sorted(upper[1] for upper in window["upper"]) == [0, 1, 2]  # J = 1 of a spin 1
    target = {"species": 2, "upper": window["upper"][0], "lower": window["lower"][0]}
    done(service, "assign", frequency_mhz=window["x"][0], error_mhz=0.01, to=[target])
    done(service, "undo")
    done(service, "species", species=2, hyperfine=False)
    assert service.facts()["quanta"]["2"]["names"] == ["j"]
    assert "no constants of spins" in service.answer({"do": "species", "species": 1, "hyperfine": True})["error"]


def test_a_session_whose_molecule_is_gone_is_refused_and_stays(service, tmp_path):
    before = (tmp_path / "spectrum.view.json").read_bytes()
    service.session.release()
    (tmp_path / NAME).rename(tmp_path / "elsewhere.toml")
    with pytest.raises(ValueError, match=NAME):
        open_session("spectrum.csv")
    assert (tmp_path / "spectrum.view.json").read_bytes() == before


def test_what_is_remembered_of_a_species_follows_its_record(service):
    for upper, lower in SERIES:
        assign_line(service, upper, lower)
    done(service, "free", species=1, free=["A"])
    done(service, "refit", species=1)
    record = service.session.state.species[1]
    assert [*record.errors] == ["A"]
    assert record.constants["B"] == pytest.approx(TRUE["B"] - 0.01, abs=1e-9)  # stays as the file has it
    message = {"first_mhz": 9000, "last_mhz": 17000, "pixels": 100}
    once = done(service, "window", **message)["sticks"]["1"]["height"]
    done(service, "species", species=1, scale=2.0)
    assert done(service, "window", **message)["sticks"]["1"]["height"] == pytest.approx(
        [2 * one for one in once], abs=1e-4
    )
    moved = done(service, "window", **message, preview={"species": 1, "scale": 4.0})["sticks"]["1"]["height"]
    assert moved == pytest.approx([4 * one for one in once], abs=1e-4)


def test_constants_as_text_are_a_species(service):
    answer = service.answer({"do": "add_species", "source": "A=2458.69 B=490.43 C=408.87 MHz", "temperature_k": 3.0})
    assert "dipole not known, 1 D along each axis assumed" in answer["notes"][0]
    assert service.session.state.species[2].constants == {"A": 2458.69, "B": 490.43, "C": 408.87}
    assert done(service, "window", first_mhz=8000, last_mhz=9000, pixels=100)["sticks"]["2"]["x"]


def test_isotopologues_are_species_by_the_isotopes_behind_a_comma(service, tmp_path):
    from rotor.formats import read

    done(service, "add_species", source="OCS, S=34S", temperature_k=20.0)
    done(service, "add_species", source="OCS,O=18O , S=34S")
    species = service.session.state.species
    assert [species[n].source for n in (2, 3)] == ["OCS, S=34S", "OCS, O=18O , S=34S"]
    assert species[2].constants == dict(read("OCS", isotopes="S=34S").constants.values)
    assert species[2].constants["B"] > species[3].constants["B"] > 0.9 * species[2].constants["B"]
    shutil.copy(tmp_path / NAME, tmp_path / "a, S=34S.toml")  # the name of a file is not taken apart
    done(service, "add_species", source="a, S=34S.toml")
    assert "isotope 99S is not in" in service.answer({"do": "add_species", "source": "OCS, S=99S"})["error"]
    done(service, "assign", frequency_mhz=11865.55, error_mhz=0.01, to=[{"species": 2, "upper": [1], "lower": [0]}])
    for what in ("csv", "toml", "par"):
        done(service, "export", what=what, species=2)
    service.session.release()
    again = open_session("spectrum.csv", ["OCS, S=34S"])  # is there already
    assert again.session.state == service.session.state
    again.session.release()


def test_a_wrong_assignment_in_a_refit_is_named(service):
    for upper, lower in SERIES:
        assign_line(service, upper, lower)
    done(service, "refit", species=1)
    good = service.session.state.species[1].fit
    assert (good.suspect, good.rms_without) == ((), None)
    wrong = [{"species": 1, "upper": [5, 1, 4], "lower": [5, 1, 5]}]  # the peak is 5 2 3 - 5 1 4
    done(service, "assign", frequency_mhz=16022.8108, error_mhz=0.001, to=wrong)
    done(service, "refit", species=1)
    poor = service.session.state.species[1].fit
    number = max(service.session.state.lines)
    assert poor.suspect == (number,)
    assert poor.weighted_rms > 1000
    assert poor.rms_without == pytest.approx(good.weighted_rms, rel=1e-3)  # the same lines as before
    done(service, "reject", lines=[number], rejected=True)
    done(service, "refit", species=1)
    assert service.session.state.species[1].fit.suspect == ()


def test_a_list_of_peaks_is_drawn_as_sticks_and_a_drag_takes_its_peak(service, tmp_path):
    lines = true_lines((8000.0, 17000.0)).strongest(60).sorted()
    off = 0.004 * np.random.default_rng(9).normal(size=len(lines))
    rows = zip(lines.frequency_mhz + off, lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max(), strict=True)
    text = "\n".join(f"{f:.5f},{h:.6g},0.004" for f, h in rows)
    (tmp_path / "peaks.csv").write_text(f"frequency_mhz,intensity,uncertainty_mhz\n{text}\n")
    listed = open_session("peaks.csv", [NAME], temperature_k=KELVIN)
    listed.session.release()
    window = done(listed, "window", first_mhz=8000, last_mhz=17000, pixels=500)
    assert window["y"].count(0.0) >= 2 * window["y"].count(1.0) > 0
    assert window["x"][0] == window["x"][1] == window["x"][2]
    strongest = float(lines.frequency_mhz[np.argmax(lines.intensity_nm2_mhz)])
    peak = done(listed, "peak", first_mhz=strongest - 0.3, last_mhz=strongest + 0.3)["peak"]
    assert (peak["error_mhz"], peak["width_mhz"], round(peak["height"], 5)) == (0.004, None, 1.0)
    edge = float(listed.peaks.frequency_mhz[0])
    for first, last in ((edge, edge + 1e-4), (edge - 1e-4, edge)):  # both ends of a range belong to it
        assert done(listed, "peak", first_mhz=first, last_mhz=last)["peak"]["frequency_mhz"] == edge
    assert "the list has no peak there" in done(listed, "peak", first_mhz=8000.001, last_mhz=8000.002)["why"]
    for upper, lower in SERIES:
        assert assign_line(listed, upper, lower)["ok"]["label"]
    done(listed, "refit", species=1)
    record = listed.session.state.species[1]
    for name in "ABC":
        assert abs(record.constants[name] - TRUE[name]) < 5 * record.errors[name]
    assert service.peaks is None  # of the spectrum


def test_the_search_of_unknown_molecules_is_one_step(tmp_path, monkeypatch):
    from rotor.spectra.lines import line_list
    from rotor.tops.top import Top

    truth = Top.from_constants("A=5210.331 B=2012.874 C=1533.209 MHz", dipole_abc_debye=(1.6, 0.9, 0.0))
    lines = line_list(truth, temperature_k=2.0, range_mhz=(6000, 18000)).strongest(80).sorted()
    rows = zip(lines.frequency_mhz, lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max(), strict=True)
    (tmp_path / "peaks.csv").write_text("\n".join(f"{f:.5f},{h:.6g},0.005" for f, h in rows))
    monkeypatch.chdir(tmp_path)
    service = open_session("peaks.csv")
    service.session.release()
    answer = service.answer({"do": "search", "seconds": 60})
    assert "certain" in answer["notes"][0]
    record = service.session.state.species[1]
    for name, true in (("A", 5210.331), ("B", 2012.874), ("C", 1533.209)):
        assert abs(record.constants[name] - true) < 0.02
    assert len(service.session.state.lines) > 20
    done(service, "refit", species=1)
    done(service, "undo")
    done(service, "undo")
    assert service.session.state.records == {}


def test_combination_differences_close(service):
    for upper, lower in (*SERIES, ([3, 0, 3], [2, 1, 2]), ([5, 1, 4], [5, 0, 5])):
        assign_line(service, upper, lower)
    found = done(service, "levels", species=1)
    assert len(found["levels"]) >= 10
    energies = {one["label"]: one["energy_mhz"] for one in found["levels"]}
    assert found["differences"]
    for one in found["differences"]:
        a, b = (energies[label] for label in one["levels"])
        assert one["observed_mhz"] - (a - b) == pytest.approx(one["difference_mhz"], abs=1e-6)
        assert abs(one["difference_mhz"]) < 0.5  # the constants are off by 30 kHz


def test_emission_is_the_model_of_the_library(service):
    from rotor.observed.model.model import Component, Sight, model

    done(service, "settings", emission=True)
    done(service, "species", species=1, column_per_cm2=1e13, temperature_k=5.0, fwhm_km_s=2.0, velocity_km_s=1.0)
    window = done(service, "window", first_mhz=16000, last_mhz=16060, pixels=400)
    record = service.session.state.species[1]
    component = Component(service.predictions.emitter(record), 1e13, 5.0, 1.0, 2.0)
    expected = model([component], np.array(window["model"]["x"]), Sight(2.725)).brightness_k
    assert np.allclose(
        window["model"]["y"], expected, atol=1e-3 * expected.max()
    )  # frequencies are rounded for the message
    assert expected.max() > 0


def test_the_dipole_of_a_molecule_without_one_is_said(service):
    (Path.cwd() / "bare.toml").write_text('name = "bare"\n[constants]\nA = 9e3\nB = 3e3\nC = 2.4e3\n')
    answer = service.answer({"do": "add_species", "source": "bare.toml"})
    assert "dipole not known, 1 D along each axis assumed" in answer["notes"][0]


# The command and the function


def test_the_command_exports_a_page_and_refuses_what_it_must(service, call, tmp_path):
    service.session.release()
    code, out, err = call("view", "spectrum.view.json", "--export", "page.html")
    assert code == 0
    assert all(text.startswith("note: ") for text in err.splitlines())
    assert out.startswith("page.html: 300000 points, 0 assigned lines")
    for words, said in (
        (("nothing.csv",), "nothing.csv: no such file"),
        (("nothing.view.json",), "no such session"),
        (("spectrum.csv", "--export", "page.png"), "must end in .html"),
        (("spectrum.csv", "--port", "70000"), "--port: 70000"),
        (("spectrum.csv", "--session", "a.json"), "ends in .view.json"),
        (("spectrum.csv", "no such thing", "--export", "p.html"), "no such thing"),
        (("spectrum.csv", "--lines", "x.lin", "--session", f"n{SUFFIX}"), "lines need a molecule"),
    ):
        code, out, err = call("view", *words)
        assert (code, out) == (2, ""), words
        assert said in err
        assert err.count("\n") == 1
    assert not (tmp_path / f"n{SUFFIX}").exists()


def test_what_was_left_out_or_assumed_of_a_spectrum_is_said(call, tmp_path):
    """Channels without a number, missing units; a velocity axis needs its rest frequency, which the command takes."""
    velocity, rest = np.linspace(-50.0, 50.0, 200), 230538.0
    intensity = np.random.default_rng(1).normal(size=200)
    intensity[10:15] = np.nan
    np.savetxt("v.txt", np.column_stack([velocity, intensity]))
    code, _, err = call("view", "v.txt", "--axis-unit", "km/s", "--export", "p.html")
    assert (code, "state it, such as --rest 230.538GHz" in err) == (2, True)
    code, out, err = call("view", "v.txt", "--axis-unit", "km/s", "--rest", f"{rest} MHz", "--export", "p.html")
    assert (code, out.startswith("p.html: 195 points")) == (0, True)
    assert "note: 5 channels without a finite number left out" in err
    assert "note: no units in the file: intensities in K assumed" in err


def test_the_widget_answers_messages_and_announces_changes(service):
    service.session.release()
    import rotor

    widget = rotor.view("spectrum.csv", NAME, temperature_k=f"{1e3 * KELVIN} mK")
    sent = []
    widget.send = sent.append
    widget._received(widget, {"do": "hello", "id": 3}, None)
    assert sent[0]["re"] == 3
    assert sent[0]["ok"]["session"]["records"]["species/1"]["name"] == "case"
    assert sent[0]["ok"]["session"]["records"]["species/1"]["temperature_k"] == pytest.approx(KELVIN)
    widget._received(widget, {"do": "species", "species": 1, "scale": 2.0, "id": 4}, None)
    assert [*sent[1]] == ["session"]
    assert sent[2]["re"] == 4
    assert widget.do("undo")["label"] == "change scale of case"
    with pytest.raises(ValueError, match="no line is assigned"):
        widget.do("refit", species=1)
    widget.close()


def test_dipole_of_the_case_is_that_of_its_file(service):
    assert service.session.state.species[1].dipole_abc_debye == DIPOLE


def test_the_comment_of_one_line_of_several_is_kept():
    model = SimpleNamespace(quanta=("j",), record=SimpleNamespace(name="OCS"), halves=frozenset())
    lines = {n: Line(1, (n,), (n - 1,), 12163.0 * n, 0.01, n, comment="weak" if n == 2 else "") for n in (1, 2, 3)}
    assert list(fit_assignments(model, lines).comments) == ["", "weak", ""]
    assert not any(fit_assignments(model, {1: lines[1], 3: lines[3]}).comments)
