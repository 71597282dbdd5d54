"""`rotor spectrum --exomol`, and the way back through a local catalogue."""

import json

import numpy as np
import pytest


def test_lines_go_out_and_come_back_through_a_catalogue(call, tmp_path):
    """Frequencies within a unit of the last place of the two energies, Einstein coefficients within that of five digits."""
    code, out, err = call("spectrum", "CO", "--exomol", str(tmp_path / "CO.states"), "--jmax", "12", "--json", "-")
    assert (code, err) == (0, "")
    content = json.loads(out)
    assert content["files"] == [str(tmp_path / "CO.states")]
    assert {path.name for path in tmp_path.iterdir()} == {"CO.states", "CO.trans", "CO.pf", "CO.states.provenance.json"}
    catalogue = str(tmp_path / "a.rotorcat")
    assert call("catalogue", "add", str(tmp_path / "CO.states"), "--catalogue", catalogue)[0] == 0
    code, out, _ = call("catalogue", "show", "CO", "--catalogue", catalogue, "--json", "-")
    again = json.loads(out)["lines"]
    assert len(again) == len(content["lines"]) == 12
    for line, written in zip(again, content["lines"], strict=True):
        assert abs(line["frequency_mhz"] - written["frequency_mhz"]) < 1.01e-6 * 29979.2458
        assert line["einstein_a_per_s"] == pytest.approx(written["einstein_a_per_s"], rel=1e-4)
        assert line["g_upper"] == written["g_upper"]
    # four digits of Q and five of A; the local catalogue's intensity at 300 K is that of the line list
    lgint = [line["lgint"] for line in content["lines"]]
    assert np.allclose([line["log_intensity_300k"] for line in again], lgint, atol=1e-3)


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        (("HCN", "--hyperfine", "--jmax", "2", "--exomol", "b.states"), "b.states: lines split by spins"),
        (("CO", "--exomol", "b.trans"), "--exomol b.trans: the name must end in .states"),
    ],
)
def test_what_the_form_cannot_hold_is_one_line_and_no_file(call, tmp_path, monkeypatch, words, rule):
    monkeypatch.chdir(tmp_path)
    code, out, err = call("spectrum", *words)
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert err.startswith(f"error: {rule}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["x.states", "x.trans", "x.trans.bz2"])
@pytest.mark.parametrize("verb", [("spectrum",), ("emission",), ("convert",)])
def test_a_line_list_is_no_molecule(call, tmp_path, verb, name):
    (tmp_path / name).write_text("1 0.0 1 0\n")
    more = {"convert": (str(tmp_path / "a.toml"),), "emission": ("--range", "100:300GHz")}.get(verb[0], ())
    code, out, err = call(*verb, str(tmp_path / name), *more)
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert "rotor catalogue add" in err


def test_a_spectrum_without_numbers_warns_of_nothing(call, tmp_path):
    """An empty file and one with a heading alone."""
    for text in ("", "# frequency_mhz, intensity_k\n"):
        (tmp_path / "s.txt").write_text(text)
        code, _, err = call("emission", "CO", "--over", str(tmp_path / "s.txt"))
        assert (code, len(err.splitlines())) == (2, 1)
        assert "0 lines with numbers" in err
