"""`rotor convert` of SPFIT's files of every kind: what it writes is read again as the same top, or it refuses with a remedy.

What is lost is noted. The lists of levels of `rotor spectrum --egy` have their errors."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.cli import run
from rotor.formats.spcat.names.named_parameters import named_parameter_file
from rotor.formats.spcat.predict import predict_file
from rotor.formats.spcat.text.egy import format_egy, read_egy
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import format_par, read_par
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import StateConstants
from rotor.verbs.convert import ConvertRequest, lost_options, top_with_errors

KINDS = sorted(path for path in ORACLES.glob("**/*.int") if path.with_suffix(".var").exists())
REMEDY = re.compile(r"predict from the files? (themselves|itself)|(is|are) read but not computed yet")


def copied(kind: str, folder: Path) -> Path:
    """The .int of a kind in a folder where it may be changed, its .var beside it."""
    return copy_of(next(path for path in KINDS if path.parent.name == kind), folder)


def copy_of(source: Path, folder: Path) -> Path:
    for suffix in (".int", ".var"):
        shutil.copy(source.with_suffix(suffix), folder / f"{source.stem}{suffix}")
    return folder / source.name


def values_of(top) -> dict[str, float]:
    further = [top.states.values if top.states else {}, top.spin_constants.values if top.spin_constants else {}]
    return {**top.constants.values, **further[0], **further[1]}


@pytest.mark.parametrize("source", KINDS, ids=lambda path: f"{path.parent.parent.name}-{path.stem}")
def test_what_is_written_is_read_as_the_same_top(source, tmp_path, capsys):
    copy, written = copy_of(source, tmp_path), tmp_path / "x.toml"
    code = run(["convert", str(copy), str(written)])
    if code == 2:
        assert REMEDY.search(capsys.readouterr().err)
        assert not written.exists()
        return
    assert code == 0
    again, top = rotor.read(written), top_with_errors(str(copy))
    assert values_of(again) == pytest.approx(values_of(top), rel=1e-14)  # digits of a double in decimal
    assert again.spin_weights == top.spin_weights
    assert again.dipole_abc_debye == top.dipole_abc_debye
    if top.states:
        assert dict(again.states.weights) == dict(top.states.weights)
        assert dict(again.states.dipoles) == dict(top.states.dipoles)
    back = named_parameter_file(again, 20)
    assert read_par(format_par(back)).options == back.options


def test_a_state_without_weights_beside_one_with_them_comes_back(tmp_path, capsys):
    """WTPL and WTMN beside a total spin are the weights of the other nuclei, also where they are as 1 to 3."""
    copy = copied("weights_of_states_i_tot", tmp_path)
    lines = [line for line in copy.read_text().splitlines(True) if line.split()[:2] != ["1", "1.29"]]
    copy.write_text("".join(lines))
    assert run(["convert", str(copy), str(tmp_path / "x.toml")]) == 2
    assert "mixes levels of nuclear-spin weights 3 and 1" in capsys.readouterr().err
    beside = copy.with_suffix(".var")
    file = read_par(beside)
    beside.write_bytes(format_par(replace(file, parameters=tuple(p for p in file.parameters if p.value != 1e-6))))
    assert run(["convert", str(copy), str(tmp_path / "x.toml")]) == 0
    assert 'weights = "other nuclei"' in (tmp_path / "x.toml").read_text()
    weights = rotor.read(tmp_path / "x.toml").states.weights
    assert weights[1].rule == "none"
    assert weights[0].to_mapping() == {"ee": 1, "eo": 3, "oe": 3, "oo": 1}

    shutil.copy(copy, tmp_path / "y.int")
    assert run(["convert", str(tmp_path / "x.toml"), str(tmp_path / "y.var")]) == 0
    first, again = (predict_file(tmp_path / name, as_spcat=True).catalogue for name in (copy.name, "y.int"))
    assert len(first) == len(again) > 200
    for name in ("frequency_mhz", "lgint", "energy_lower_cm"):
        assert getattr(again, name) == pytest.approx(
            getattr(first, name), abs=1e-6
        )  # 1 Hz: round-off of the constants in print
    assert np.array_equal(again.g_upper, first.g_upper)


def test_weights_of_other_nuclei_are_stated_beside_a_total_spin_alone(tmp_path, capsys):
    (tmp_path / "a.toml").write_text(
        'constants = { A = 9e3, B = 3e3, C = 2.5e3 }\n[spins]\nweights = "other nuclei"\n[spins.14N]\nchi_aa = -4\n'
    )
    assert run(["levels", str(tmp_path / "a.toml")]) == 2
    assert "expected a total spin of nuclei beside them" in capsys.readouterr().err
    (tmp_path / "b.toml").write_text((tmp_path / "a.toml").read_text().replace("other nuclei", "all"))
    assert run(["levels", str(tmp_path / "b.toml")]) == 2
    assert "[spins], weights = 'all': expected one of other nuclei" in capsys.readouterr().err


def test_dipoles_that_the_weights_forbid_are_refused_before_anything_is_written(tmp_path, capsys):
    copy = copied("dipoles_between", tmp_path)
    assert run(["convert", str(copy), str(tmp_path / "x.toml")]) == 2
    said = capsys.readouterr().err
    assert "μa = 1.3 D, μb = 0.7 D" in said
    assert "remove the part named here from the source" in said
    assert not (tmp_path / "x.toml").exists()


def test_axes_in_another_order_are_refused_with_the_state(tmp_path, capsys):
    copy = copied("near_sphere_states", tmp_path)
    assert run(["convert", str(copy), str(tmp_path / "x.toml")]) == 2
    said = capsys.readouterr().err
    assert "state 1: A = 7297.2, B = 7228.2, C = 7270.8 MHz" in said
    assert "predict from the files themselves" in said
    assert "exchange" not in said


def test_what_of_the_option_line_is_lost_is_noted(tmp_path, capsys):
    copy = copied("water_diag1", tmp_path)
    assert run(["convert", str(copy), str(tmp_path / "x.toml")]) == 0
    said = capsys.readouterr().err
    assert "note: DIAG = 1, KNMAX = 20, NLINE = 0 of water_diag1.var have no place in a .toml" in said
    assert "DIAG = 3, KNMAX = 99, NLINE = 1" in said
    file = read_par(copy.with_suffix(".var"))
    same = replace(file, header=replace(file.header, nline=1), options=(replace(file.options[0], diag=3),))
    (tmp_path / "y.var").write_bytes(format_par(same))
    again = ConvertRequest(str(tmp_path / "y.var"), 20)
    many = replace(same, header=replace(file.header, nline=55))
    (tmp_path / "many.var").write_bytes(format_par(many))
    assert lost_options(rotor.read(tmp_path / "x.toml"), ConvertRequest(str(tmp_path / "many.var"), 20), "z.toml") == []
    assert lost_options(rotor.read(tmp_path / "x.toml"), again, "z.toml") == []  # all three come back


SYMMETRIC = "inversion\n2 1 1\ns -1 1 0 20 0 {iax} {plus} {minus} 0 2 0 0\n100 298000.0 1\n1000 -111000.0 1\n"


@pytest.mark.parametrize(("plus", "minus", "named"), [(0, 4, [0, 4, 1, 1]), (4, 4, [2, 1, 1]), (3, 1, [3, 1, 2, 2])])
def test_weights_by_j_at_k_0_have_names_in_one_state_too(plus, minus, named, tmp_path):
    path = tmp_path / "a.par"
    path.write_text(SYMMETRIC.format(iax=6, plus=plus, minus=minus))
    weights = rotor.read(path).spin_weights
    assert list(weights.to_mapping().values()) == named
    assert weights.classes[0] == ("0" if plus == minus else "0even")


def test_weights_of_other_folds_are_refused_with_the_files_as_remedy(tmp_path):
    (tmp_path / "a.par").write_text(SYMMETRIC.format(iax=10, plus=4, minus=0))
    with pytest.raises(ValueError, match=r"IAX = 10: .* predict from the files themselves"):
        rotor.read(tmp_path / "a.par")


# two states, one nucleus with I = 1: SPCAT (C source djean032/pickett, 6374a66; FLAGS = 111) lists these energies, errors (cm-1), quanta
QUADRUPOLE = """maxv
 9 1 1
a 3 3 0 18 0 1 1 1 0 1 0
 10099 30000.0 1e-2 /A
 20099 9000.0 1e-3 /B
 30099 8000.0 1e-3 /C
 11 60000. 1
 22 120000. 1
 600001 50. 1
 110010099 -3. 0.1
 110040099 0.4 0.1
 200012 30. 1
"""
LISTED = {
    (1, 0, 1, 0, 0): (0.567091, 0.000001), (1, 1, 0, 0, 0): (1.300897, 0.000003), (1, 1, 1, 0, 0): (1.267511, 0.000003),
    (1, 0, 1, 1, 0): (2.568479, 0.000033), (1, 1, 0, 1, 0): (3.302281, 0.000034),
}  # fmt: skip


def test_levels_of_an_int_file_have_the_errors_of_spcat(tmp_path):
    (tmp_path / "a.var").write_text(QUADRUPOLE)
    (tmp_path / "a.int").write_text("maxv\n11 99001 1000.0 0 2 -9 -9 9999. 300. 1\n 1 1.0\n 111 1.0\n")
    assert run(["spectrum", str(tmp_path / "a.int"), "--egy", str(tmp_path / "a.egy")]) == 0
    levels = read_egy(tmp_path / "a.egy")
    computed = {tuple(quanta): i for i, quanta in enumerate(levels.quanta.tolist())}
    for quanta, (energy, error) in LISTED.items():
        row = computed[quanta]
        assert levels.energy_cm[row] == pytest.approx(energy, abs=1.1e-6)  # the last printed digit
        assert levels.error_cm[row] == pytest.approx(error, abs=1.1e-6)  # the last printed digit
    assert (np.asarray(levels.error_cm) > 0).sum() > 10


def test_levels_of_one_state_have_errors_too(tmp_path):
    """J = 1 of CO: E = 2B - 4D, so that its error is twice that of B."""
    (tmp_path / "a.var").write_text("CO\n1 1 1\nl -1 1 0 0\n100 57635.968 0.5\n")
    (tmp_path / "a.int").write_text("CO\n0 1 1000.0 0 1 -9 -9 9999. 300.\n 1 0.1\n")
    assert run(["spectrum", str(tmp_path / "a.int"), "--egy", str(tmp_path / "a.egy")]) == 0
    levels = read_egy(tmp_path / "a.egy")
    assert levels.error_cm.tolist() == pytest.approx([0, 1.0 / 29979.2458], abs=6e-7)  # MHz in cm⁻¹, digits of print


def test_round_off_below_zero_prints_as_zero():
    levels = read_egy(b"     1    1         -0.000001          0.000000   1.000000    1:  0  0  0\n")
    object.__setattr__(levels, "energy_cm", np.array([-3e-13]))
    assert b"-0.000000" not in format_egy(levels)


def test_nothing_is_written_where_levels_are_not_reached(tmp_path, monkeypatch):
    from rotor.formats.spcat import predict

    def failing(*args, **options):
        raise ValueError("no levels")

    monkeypatch.setattr(predict, "as_level_list", failing)
    copy = copied("ocs", tmp_path)
    before = sorted(tmp_path.iterdir())
    assert run(["spectrum", str(copy), "--egy", str(tmp_path / "a.egy"), "--cat", str(tmp_path / "a.cat")]) == 2
    assert sorted(tmp_path.iterdir()) == before


def test_an_int_file_of_a_molecule_cuts_off_weak_lines_alone(tmp_path):
    """STR0 and STR1 are 12 decades below 1 nm² MHz: of CO at 300 K every line to J = 20 stays."""
    assert run(["convert", "CO", str(tmp_path / "co.int")]) == 0
    assert run(["convert", "CO", str(tmp_path / "co.var")]) == 0
    request = read_int(tmp_path / "co.int").request
    assert (request.str0, request.str1, request.maxv) == (-12.0, -12.0, 0)
    frequency = predict_file(tmp_path / "co.int").catalogue.frequency_mhz
    assert len(frequency) >= 20
    assert frequency[:2] == pytest.approx([115271.2, 230538.0], abs=1.0)


def test_the_file_of_a_kind_is_read(tmp_path):
    """The kinds of this page are many, so that no pattern above passes on an empty list."""
    assert len(KINDS) > 50
    assert read_par(copied("co", tmp_path).with_suffix(".var")).parameters
    assert read_int(tmp_path / "co.int").dipoles


def test_three_states_with_weights_of_their_own_go_to_a_file_and_come_back():
    """Every line of options but the last says that another follows: VSYM below 0."""
    weights = {
        v: SpinWeights.from_mapping({"ee": even, "eo": even, "oe": odd, "oo": odd})
        for v, even, odd in ((0, 1, 3), (1, 3, 1), (2, 5, 7))
    }
    states = StateConstants(
        {
            f"{name}[{v}]": value * v
            for v in (1, 2)
            for name, value in (("E", 100.0), ("A", 9e3), ("B", 3e3), ("C", 2.5e3))
        },
        weights=weights,
    )
    top = replace(
        rotor.Top.from_constants("A=9000 B=3000 C=2500 MHz"),
        states=states,
        spin_weights=weights[0],
    )
    options = read_par(format_par(named_parameter_file(top, 20))).options
    assert len({(line.wtpl, line.wtmn) for line in options}) == len(options) == 3
    assert [line.vsym < 0 for line in options] == [True, True, False]
