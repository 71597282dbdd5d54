"""`rotor catalogue`, `rotor identify` and `rotor emission --over/--fit` on synthetic spectra."""

import json
from pathlib import Path

import numpy as np
import pytest

from rotor.formats.catalogue import catdir
from rotor.formats.catalogue.cat_species import read_cat_species
from rotor.formats.catalogue.catdir import read_catdir
from rotor.observed.model.model import Component, model

CATDIR = """ 28503 CO, v=0    2   2.5595  2.2584  2.0369  1.9123  1.7370  1.4386  1.1429  0.8526  0.5733  0.3389  0.1479
 99501 XYZ         8   0.0     0.0     3.0000  2.8126  2.5485  2.0969  1.6454  1.1938  0.7423  0.3000  0.0000
 99502 XYW         8   0.0     0.0     3.0000  2.8126  2.5485  2.0969  1.6454  1.1938  0.7423  0.3000  0.0000
"""
LINE = "{:13.4f}  0.0010{:8.4f} 3{:10.4f} 21 {:6d} 303{:2d} 1{:2d}      {:2d} 1{:2d}      \n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two species of eight lines between 230.2 and 230.8 GHz, and a spectrum of one of them."""
    rng = np.random.default_rng(4)
    (tmp_path / "cats").mkdir()
    (tmp_path / "cats" / "catdir.cat").write_text(CATDIR)
    for tag in (99501, 99502):
        rows = zip(
            np.sort(rng.uniform(230200, 230800, 8)),
            rng.uniform(-4, -3, 8),
            rng.uniform(5, 150, 8),
            range(8),
            strict=True,
        )
        text = "".join(LINE.format(f, i, e, tag, 10 + j, j, 9 + j, j) for f, i, e, j in rows)
        (tmp_path / "cats" / f"c{tag:06d}.cat").write_text("".join(line.rstrip() + "\n" for line in text.splitlines()))
    species = read_cat_species(tmp_path / "cats" / "c099501.cat")
    grid = np.arange(230200, 230800, 0.2)
    seen = model([Component(species, 2e15, 80.0, 3.0, 2.0)], grid).brightness_k + rng.normal(0, 0.05, len(grid))
    np.savetxt(tmp_path / "s.txt", np.stack([grid, seen], axis=1), header="frequency_mhz, intensity_k")
    return tmp_path


def test_catalogue_added_listed_and_shown(call, folder):
    catalogue = str(folder / "a.rotorcat")
    code, out, err = call("catalogue", "add", str(folder / "cats"), "--catalogue", catalogue, "--licence", "free")
    assert (code, err) == (0, "")
    assert "16 lines from 2 sources" in out
    code, out, _ = call("catalogue", "list", "--catalogue", catalogue, "--json", "-")
    species = json.loads(out)["species"]
    assert [
        (component["name"], component["tag"], component["lines"], component["licence"]) for component in species
    ] == [
        ("XYW", 99502, 8, "free"),
        ("XYZ", 99501, 8, "free"),
    ]
    code, out, _ = call(
        "catalogue", "show", "XYZ", "--catalogue", catalogue, "--json", "-", "--csv", str(folder / "l.csv")
    )
    lines = json.loads(out)["lines"]
    assert len(lines) == 8
    assert len((folder / "l.csv").read_text().splitlines()) == 9
    direct = read_cat_species(folder / "cats" / "c099501.cat")
    assert [line["frequency_mhz"] for line in lines] == direct.frequency_mhz.tolist()


def test_faults_of_a_catalogue(call, folder):
    text = (folder / "cats" / "c099501.cat").read_text().replace(" 3 ", " x ", 1)
    (folder / "cats" / "c099503.cat").write_text(text)
    code, out, err = call("catalogue", "add", str(folder / "cats"), "--catalogue", str(folder / "a.rotorcat"))
    assert code == 0
    assert "c099503.cat" in err
    assert "left out   1" in out
    before = (folder / "a.rotorcat").read_bytes()
    code, out, err = call(
        "catalogue", "add", str(folder / "cats" / "c099503.cat"), "--catalogue", str(folder / "a.rotorcat")
    )
    assert (code, out) == (2, "")
    assert "nothing to add" in err
    assert "c099503.cat" in err
    assert (folder / "a.rotorcat").read_bytes() == before
    for words in (("frob",), ("add",), ("show", "--catalogue", str(folder / "none")), ("add", str(folder / "s.txt"))):
        code, _, err = call("catalogue", *words)
        assert code == 2, words
        assert len(err.splitlines()) == 1


def test_identify_names_the_species_that_is_there(call, folder):
    plot, table = folder / "p.png", folder / "t.csv"
    code, out, err = call(
        "identify",
        str(folder / "s.txt"),
        "--catalogue",
        str(folder / "cats"),
        "--json",
        "-",
        "--plot",
        str(plot),
        "--csv",
        str(table),
    )
    assert (code, err) == (0, "")
    content = json.loads(out)
    assert [component["species"] for component in content["species"]] == ["XYZ"]
    assert content["velocity_km_s"] == pytest.approx(3.0, abs=0.5)
    assert content["unidentified"] == []
    assert plot.stat().st_size > 5000
    assert table.read_text().splitlines()[1].startswith("XYZ,")
    code, out, _ = call(
        "identify", str(folder / "s.txt"), "--catalogue", str(folder / "cats"), "--velocity", "3", "--width", "2"
    )
    assert "species by evidence" in out


def test_species_on_a_single_line_are_marked(call, folder):
    """A line of a species that is no candidate, at the only line of another: named, and marked."""
    grid, seen = np.loadtxt(folder / "s.txt", unpack=True)
    taken = np.sort(
        np.concatenate([read_cat_species(file).frequency_mhz for file in sorted(folder.glob("cats/c099*.cat"))])
    )
    middle = float(taken[(gap := int(np.argmax(np.diff(taken)))) : gap + 2].mean())
    seen += 3.0 * np.exp(-4 * np.log(2) * ((grid - middle * (1 - 3.0 / 299792.458)) / (middle * 2.0 / 299792.458)) ** 2)
    np.savetxt(folder / "s.txt", np.stack([grid, seen], axis=1), header="frequency_mhz, intensity_k")
    (folder / "cats" / "c099503.cat").write_text(LINE.format(middle, -3.5, 50.0, 99503, 10, 0, 9, 0).rstrip() + "\n")
    with (folder / "cats" / "catdir.cat").open("a") as handle:
        handle.write(CATDIR.splitlines()[1].replace("99501 XYZ", "99503 ONE") + "\n")
    command = ("identify", str(folder / "s.txt"), "--catalogue", str(folder / "cats"))
    code, out, err = call(*command, "--json", "-")
    assert (code, err) == (0, "")
    assert {row["species"]: row["single_line"] for row in json.loads(out)["species"]} == {"XYZ": False, "ONE": True}
    code, out, _ = call(*command)
    marked = {line.split()[0]: " * " in line for line in out.splitlines() if line.startswith(("XYZ ", "ONE "))}
    assert marked == {"XYZ": False, "ONE": True}
    assert "* 1 species on a single line" in out
    assert {row["species"]: row["uncertain"] for row in json.loads(call(*command, "--json", "-")[1])["species"]}[
        "XYZ"
    ] is False


def test_species_in_a_narrow_piece_are_uncertain(call, folder):
    """A piece of a few widths about a line: any candidate with a line there would match."""
    grid, seen = np.loadtxt(folder / "s.txt", unpack=True)
    middle = int(np.argmax(seen))
    here = np.abs(grid - grid[middle]) < 3 * grid[middle] * 2.0 / 299792.458
    np.savetxt(folder / "n.txt", np.stack([grid, seen], axis=1)[here], header="frequency_mhz, intensity_k")
    command = (
        "identify",
        str(folder / "n.txt"),
        "--catalogue",
        str(folder / "cats"),
        "--velocity",
        "3",
        "--width",
        "2",
    )
    code, out, err = call(*command, "--noise", "0.02", "--json", "-")
    assert (code, err) == (0, "")
    (row,) = json.loads(out)["species"]
    assert row["uncertain"]
    assert row["chance"] > 0.05
    out = call(*command, "--noise", "0.02")[1]
    assert "? 1 species is uncertain: as many of its lines would lie on signals by chance" in out


def test_fit_of_a_source(call, folder):
    files = [str(folder / name) for name in ("f.csv", "f_profile.csv", "f.pdf")]
    code, out, err = call(
        "emission", "XYZ", "XYW", "--fit", str(folder / "s.txt"), "--catalogue", observed_file(call, folder), "--shared", "velocity,width",
        "--json", "-", "--csv", files[0], "--profile-csv", files[1], "--plot", files[2],
    )  # fmt: skip
    assert (code, err) == (0, "")
    content = json.loads(out)
    rows = {parameter["name"]: parameter for parameter in content["parameters"]}
    for name, exact in (
        ("XYZ column_per_cm2", 2e15),
        ("XYZ excitation_k", 80.0),
        ("all velocity_km_s", 3.0),
        ("all fwhm_km_s", 2.0),
    ):
        assert abs(rows[name]["value"] - exact) < 4 * rows[name]["error"], name
    first, second = content["contributions"]
    assert (first["needed"], second["needed"]) == (True, False)
    assert second["limit_per_cm2"] < 2e15
    assert first["limit_excitation_k"] is None
    assert second["limit_excitation_k"] == 10.0  # of the start, which has no lines of this species to go by
    assert any("K estimated from line-free channels" in note for note in content["spectrum"]["notes"])
    assert content["reduced_chi_squared"] == pytest.approx(1.0, abs=0.1)
    assert all(Path(file).stat().st_size > 100 for file in files)
    assert (
        (folder / "f_profile.csv")
        .read_text()
        .startswith("frequency_mhz,observed_k,noise_k,model_k,residual_k,optical_depth\n")
    )


def observed_file(call, folder: Path) -> str:
    path = str(folder / "a.rotorcat")
    call("catalogue", "add", str(folder / "cats"), "--catalogue", path)
    return path


def test_model_over_a_spectrum(call, folder):
    code, out, err = call(
        "emission", str(folder / "cats" / "c099501.cat"), "--over", str(folder / "s.txt"), "--column", "2e15", "--excitation", "80",
        "--velocity", "3", "--width", "2", "--json", "-",
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert json.loads(out)["rms_k"] == pytest.approx(0.05, rel=0.05)


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (("--over", "s.txt", "--fit", "s.txt"), "both name a spectrum"),
        (("--free", "column"), "belongs to a fit"),
        (("--fit", "none.txt"), "none.txt"),
        (("--fit", "s.txt", "--free", "colour"), "expected each of column"),
        (("--fit", "s.txt", "--size", "1"), "without a beam"),
        (("--fit", "s.txt", "--column", "1,2,3"), "3 numbers for 1 species"),
        (("--fit", "s.txt", "--unit", "mag"), "intensity in 'mag'"),
        (("--fit", "s.txt", "--save-scene", "a.toml"), "have no place in a scene"),
    ],
)
def test_mistakes_are_one_line(call, folder, options, rule):
    named = [str(folder / word) if word.endswith((".txt", ".toml")) else word for word in options]
    code, _, err = call("emission", str(folder / "cats" / "c099501.cat"), *named)
    assert code == 2
    assert rule in err
    assert len(err.splitlines()) == 1


def test_a_table_of_species_is_read_once_for_all_catalogues_beside_it(call, folder, monkeypatch):
    """It was read three times for each catalogue: two thirds of the time for a folder of 105."""
    catdir._read_once.cache_clear()
    read = []
    monkeypatch.setattr(catdir, "read_catdir", lambda file: read.append(file) or read_catdir(file))
    assert call("catalogue", "add", str(folder / "cats"), "--catalogue", str(folder / "once.rotorcat"))[0] == 0
    assert len(read) == 1
    (folder / "cats" / "catdir.cat").write_text(CATDIR.replace("XYZ", "XYV"))
    assert catdir.catdir_beside(folder / "cats" / "c099501.cat")[99501].name == "XYV"


@pytest.mark.parametrize(
    ("column", "said"),
    [
        (
            lambda f: (f - 230500) / 230500 * -3e5,
            "the first column, read as frequencies in MHz, contains -",
        ),
        (
            lambda f: f * 1e6,
            "no species has a line from 2.302e+11 to 2.307998e+11 MHz; for a file in Hz give --axis-unit Hz",
        ),
    ],
)
def test_axes_in_another_unit_are_named(call, folder, column, said):
    grid, seen = np.loadtxt(folder / "s.txt", unpack=True)
    np.savetxt(folder / "other.txt", np.stack([column(grid), seen], axis=1))
    code, _, error = call("identify", str(folder / "other.txt"), "--catalogue", str(folder / "cats"))
    assert code == 2
    assert said in error


def test_a_fit_that_does_not_describe_the_spectrum_says_so(call, folder):
    """The other species is fitted: its lines lie elsewhere."""
    said = "the model does not describe the spectrum"
    for tag, poor in (("99501", False), ("99502", True)):
        code, shown, _ = call("emission", str(folder / "cats" / f"c0{tag}.cat"), "--fit", str(folder / "s.txt"))
        assert (code, said in " ".join(shown.split())) == (0, poor)
