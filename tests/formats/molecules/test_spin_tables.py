"""Constants of spins in molecule files, in isotopologues, and what is said of nuclei that split lines."""

from __future__ import annotations

import gzip
import re

import numpy as np
import pytest

import rotor
from rotor.formats.molecules.molecule_file import parse_molecule_file
from rotor.formats.molecules.molecule_writer import molecule_file_text
from rotor.formats.spcat.text.cat import read_cat
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.splittings import casimir, splitting_nuclei
from rotor.spectra.lines import line_list
from rotor.tops.isotopes.isotopic_spins import named_chi
from rotor.tops.isotopes.isotopologues import isotopologue
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.tensor_elements import chi_tensor

FILE = """
name = "something"
geometry = { atoms = [["N", 0.0, 0.0, 0.0], ["Cl", 0.0, 0.3, 1.7], ["D", 0.9, 0.1, -0.4]] }
constants = { A = 300000.0, B = 14000.0, C = 13000.0 }

[spins]
unit = "kHz"
source = "all of them"

[spins.14N]
chi_aa = { value = -4220.0, uncertainty = 1.5, source = "a paper" }
chi_bb-cc = "0.3 MHz"

[spins.35Cl]
atom = 2
source = "another"
chi_ab = 20e3

[spins.S]
spin = "1/2"
eps_aa = 500.0

[spins."S,14N"]
b_F = 12.5
"""


def test_a_file_has_constants_of_spins_and_is_written_as_it_was_read():
    file = parse_molecule_file(FILE)
    spins = file.spin_constants
    assert spins is not None
    assert dict(spins.values) == {
        "chi_aa(14N)": -4.22, "chi_bb-cc(14N)": 0.3, "chi_ab(35Cl)": 20.0, "eps_aa(S)": 0.5, "b_F(S,14N)": 0.0125,
    }  # fmt: skip
    assert dict(spins.twice) == {"14N": 2, "35Cl": 3, "S": 1}
    assert (dict(spins.atoms), dict(spins.sources)) == ({"14N": 1, "35Cl": 2}, {"35Cl": "another"})
    assert dict(spins.uncertainties) == {"chi_aa(14N)": 0.0015}
    again = parse_molecule_file(molecule_file_text(file)).spin_constants
    assert again is not None
    for field in ("values", "twice", "atoms", "sources", "uncertainties", "source"):
        assert getattr(again, field) == getattr(spins, field), field


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[spins.14N]", "[spins.17Xx]", "17Xx"),
        ("[spins.14N]", "[spins.12C]", "splits nothing"),
        ('spin = "1/2"', 'spin = "0.3"', "expected spins such as"),
        ("atom = 2", "atom = 3", "number of a 35Cl of the geometry, of which there is 2"),
        ("b_F = 12.5", "b_F = [1]", "b_F"),
        ('"S,14N"', '"S,13C"', "13C is not among"),
        ("uncertainty = 1.5", "uncertainty = -1.5", "at least 0"),
        ("value = -4220.0", "vlaue = -4220.0", "unknown key"),
    ],
)
def test_what_cannot_be_is_refused_with_file_and_table(old, new, says):
    assert old in FILE
    with pytest.raises(ValueError, match=re.escape(says)) as caught:
        parse_molecule_file(FILE.replace(old, new))
    assert str(caught.value).startswith("molecule file, [spins]")


def test_a_difference_after_a_number_is_read():
    """`-4.22 chi_bb-cc(...)`: the name that follows a number is not its unit."""
    values = SpinConstants.parse("chi_aa(14N)=-4.22 chi_bb-cc(14N)=1.1 MHz").values
    assert dict(values) == {"chi_aa(14N)": -4.22, "chi_bb-cc(14N)": 1.1}


def test_a_tensor_and_its_names_are_one():
    rng = np.random.default_rng(1)
    tensor = rng.normal(size=(3, 3))
    tensor = tensor + tensor.T - np.eye(3) * 2 * np.trace(tensor) / 3
    assert np.allclose(chi_tensor(named_chi(tensor)), tensor, rtol=0, atol=1e-14)  # round-off


def test_chi_turns_with_the_axes_and_scales_with_q():
    """In the frame of the atoms χ/Q is the same tensor in every isotopologue."""
    parent = rotor.read("CH2CHCN")
    assert parent.spin_constants is not None
    nitrogen = parent.molecule.symbols.index("N") + 1
    deuterated = isotopologue(parent, {parent.molecule.symbols.index("H") + 1: "D"}).top
    fixed = [
        molecule.frame.axes.T @ chi_tensor(molecule.spin_constants.of("14N")) @ molecule.frame.axes
        for molecule in (parent, deuterated)
    ]
    assert not np.allclose(parent.frame.axes, deuterated.frame.axes, atol=1e-3)
    assert np.allclose(*fixed, rtol=0, atol=1e-5)  # 1e-6 of χ is taken for round-off of the frame
    assert "chi_ab(14N)" in deuterated.spin_constants.values
    assert any("off-diagonal elements of χ are not known" in note for note in deuterated.notes)
    assert isotopologue(parent, {nitrogen: "15N"}).top.spin_constants is None


@pytest.mark.oracle
def test_methyl_chloride_with_the_other_chlorine(shared):
    """Splittings of c052009 (JPL): χ of 37Cl from that of 35Cl by Q'/Q; their ratio is known within 1e-3."""
    top = rotor.read("CH3Cl", isotopes={2: "37Cl"})
    lines = line_list(top, jmax=1, temperature_k=300.0, effects=effects_of(top, True), min_lgint=None)
    path = shared / "reference" / "library_lines" / "c052009.cat.gz"
    theirs = read_cat(gzip.decompress(path.read_bytes())).frequency_mhz[:3]
    ours = np.sort(lines.frequency_mhz[lines.frequency_mhz > 20000])  # not those inside N = 1
    assert ours.shape == (3,)
    assert np.diff(ours) == pytest.approx(np.diff(theirs), rel=1e-3)


def test_spin_rotation_follows_the_moments_of_inertia():
    top = rotor.read("CH3Cl", isotopes={2: "37Cl"})
    ratio = top.spin_constants.values["C_iso(37Cl)"] / rotor.read("CH3Cl").spin_constants.values["C_iso(35Cl)"]
    first, other = (rotor.read("CH3Cl", isotopes=i) for i in ({}, {2: "37Cl"}))
    g = [x.molecule.nuclei[1].g_factor for x in (first, other)]
    assert ratio == pytest.approx(g[1] / g[0] * other.constants["B"] / first.constants["B"], rel=1e-6)  # scaled B


def test_splittings_by_casimirs_function():
    """Y of J = 1 and I = 3/2 as tabulated: 0.05, -0.2, 0.25 (Gordy and Cook, appendix I)."""
    assert [casimir(3, 1, f) for f in (5, 3, 1)] == pytest.approx([0.05, -0.2, 0.25], abs=1e-15)  # round-off
    computed = splitting_nuclei(rotor.read("CH3Cl"))[0]
    assert (computed.nucleus, computed.known) == ("35Cl", True)
    assert computed.splitting_mhz == pytest.approx(26604.3651 - 26570.7288, rel=2e-3)  # c050007; second order


def test_formamide_by_the_command_line(capsys):
    from rotor.cli import run

    assert run(["spectrum", "HCONH2", "--jmax", "2"]) == 0
    plain = " ".join(capsys.readouterr().out.split())  # the report folds its lines
    assert "14N splits J = 1 by 2.89 MHz: rotor spectrum --hyperfine" in plain
    assert run(["spectrum", "formamide", "--jmax", "2", "--hyperfine", "--range", "21206:21209"]) == 0
    out = capsys.readouterr().out
    assert out.count("0  0  0  1") == 3
    assert "rotor spectrum --hyperfine" not in out
    assert run(["info", "formamide"]) == 0
    assert re.search(r"14N +1 +2\.89  chi_aa 1\.9543, chi_bb-cc 5\.7476", capsys.readouterr().out)
