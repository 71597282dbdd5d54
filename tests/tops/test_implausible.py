"""Input that hardly any molecule has is taken with a note."""

import sys
import tracemalloc

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.formats.molecules.library import names
from rotor.molecules.molecule import Molecule
from rotor.quantum.effects.of_top import effects_of
from rotor.spectra.request import SpectrumRequest, _expected_q, answer_spectrum
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.plausible import _far_apart, implausible
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top


def test_constants_beyond_a_rigid_body(call):
    """I_c - I_a - I_b = 505379.008 (1/1500 - 1/3000 - 1/9000) = 112.3 u Å², a third of I_c."""
    code, _, err = call("levels", "--constants", "A=9000 B=3000 C=1500 MHz", "--jmax", "1")
    assert code == 0
    assert "I_c - I_a - I_b = 112 u Å², 33 % of I_c" in err
    assert call("levels", "--constants", "A=9000 B=3000 C=2250 MHz", "--jmax", "1")[2] == ""  # flat to round-off


def test_no_molecule_of_the_library_is_implausible():
    assert [name for name in names() if implausible(rotor.read(name))] == []


def test_a_dipole_too_large(call):
    err = call("info", "--constants", "A=9 B=3 C=2.3 GHz", "--dipole-abc", "185,0,0")[2]
    assert "a dipole of 185 D is too large for a molecule" in err
    assert implausible(rotor.Top.from_constants("B=9 GHz", dipole_abc_debye=(19.0, 0, 0))) == ()


@pytest.mark.parametrize("name", ["water", "H2", "HCN", "CCl4", "CH3I"])
def test_coordinates_in_bohr(name):
    """Those of the library are noted when they are divided by the Bohr radius, and not as they are."""
    from ase import Atoms

    molecule = rotor.read(name).molecule
    for scale, notes in ((1.0, 0), (1 / 0.529177, 1)):
        top = rotor.read(Atoms(molecule.symbols, scale * molecule.positions_angstrom))
        said = [text for text in implausible(top) if "multiply them by 0.529177" in text]
        assert len(said) == notes


def test_atoms_that_form_no_molecule_anyway_are_not_taken_for_bohr():
    from ase import Atoms

    for atoms in (Atoms("ArN2", [(0, 0, 0), (3.7, 0.55, 0), (3.7, -0.55, 0)]), Atoms("He2", [(0, 0, 0), (5.0, 0, 0)])):
        (note,) = implausible(rotor.read(atoms))
        assert "single rigid complex" in note


@pytest.mark.parametrize(("q", "noted"), [("5", True), ("178.1", False), ("400", False), ("5000", True)])
def test_a_partition_function_far_from_the_sum(call, q, noted):
    code, _, err = call("spectrum", "water", "--q", q, "--jmax", "2")
    assert code == 0
    assert ("is given where the sum over the levels is 178" in err) == noted


def test_the_sum_beside_a_given_q_is_made_once(call, folder, monkeypatch):
    """The note needs it; the report, the JSON and the files need nothing more of it."""
    sums, summed = [], partition_function

    def counting(*arguments, **options):
        sums.append(arguments)
        return summed(*arguments, **options)

    monkeypatch.setattr("rotor.thermodynamics.sums.partition.partition_function", counting)
    monkeypatch.setattr("rotor.spectra.lines.partition_function", counting)
    code, _, err = call(
        "spectrum", "water", "--q", "5", "--jmax", "2", "--json", "a.json", "--csv", "a.csv", "--cat", "a.cat"
    )
    assert code == 0
    assert "the sum over the levels is 178" in err
    assert len(sums) == 1


@pytest.mark.parametrize(("name", "kelvin"), [("NH3", 300.0), ("NH3", 50.0)])
def test_the_note_on_q_estimates_further_states(name, kelvin):
    """A sum over the coupled states of a file took 18 s for the sake of this note; a tenth is enough."""
    answer = answer_spectrum(SpectrumRequest(rotor.read(name), temperature_k=kelvin, jmax=3, q=1.0))
    expected, state_sums = _expected_q(answer.lines)
    summed = partition_function(answer.lines.top, kelvin, effects=answer.lines.levels.effects).q
    assert state_sums
    assert expected == pytest.approx(summed, rel=0.05)  # half of what the note is about
    assert "about" in answer.notes[-1]


def test_a_file_of_many_states_is_not_summed_for_a_note(monkeypatch):
    """The sum is of the levels of one state."""
    from rotor.thermodynamics.sums import partition

    counted, solve = [], partition.level_sums

    def counting(top, *arguments, **options):
        counted.append(top.states)
        return solve(top, *arguments, **options)

    monkeypatch.setattr(partition, "level_sums", counting)
    top = rotor.read(ORACLES / "kinds" / "eighteen_states" / "eighteen_states.int")
    answer = answer_spectrum(SpectrumRequest(top, jmax=2, q=1000.0, min_lgint=None))
    assert answer.notes[-1].startswith("Q = 1000 is given where the sum over the levels is about 1.6e+06")
    assert counted == [None]


KINDS = ORACLES / "kinds"


@pytest.mark.parametrize("name", ["methyl_i_tot", "forbidden_three_i_tot", "three_protons_i_tot"])
def test_the_note_on_q_estimates_three_equivalent_nuclei(name):
    """n/3 functions of the spins; the sum over levels at 30 K, where it takes little. Six minutes and 5 GB for three deuterons before."""
    top = rotor.read(KINDS / name / f"{name}.int")
    answer = answer_spectrum(SpectrumRequest(top, temperature_k=30.0, jmax=1, q=1.0, effects=effects_of(top, True)))
    expected = _expected_q(answer.lines)
    summed = partition_function(top, 30.0, relative_error=1e-3, effects=answer.lines.levels.effects).q
    assert expected == (pytest.approx(summed, rel=0.02), True)  # K and -K of few levels; a note is about a tenth


def test_the_note_on_q_estimates_spins():
    """Two nuclei: functions of both."""
    top = rotor.Top.from_constants(
        "A=30 B=9 C=7 GHz",
        dipole_abc_debye=(1.0, 0.0, 0.0),
        spin_constants=SpinConstants.parse("C_aa(1H)=0.01 chi_aa(14N)=-4 MHz"),
    )
    answer = answer_spectrum(
        SpectrumRequest(top, temperature_k=5.0, jmax=1, q=1.0, effects=effects_of(top, True), min_lgint=None)
    )
    summed = partition_function(top, 5.0, effects=answer.lines.levels.effects).q
    assert _expected_q(answer.lines) == (pytest.approx(summed, rel=1e-3), True)


def test_no_note_where_the_sum_takes_minutes(monkeypatch):
    """Two equivalent nuclei of I = 3/2 in two states: 0.8 GB and half a minute before it was ended."""
    monkeypatch.setattr("rotor.thermodynamics.sums.partition.partition_function", None)
    top = rotor.read(KINDS / "two_quadrupoles_i_tot" / "two_quadrupoles_i_tot.int")
    answer = answer_spectrum(SpectrumRequest(top, jmax=1, q=1.0, effects=effects_of(top, True), min_lgint=None))
    assert _expected_q(answer.lines) is None
    assert not [note for note in answer.notes if "Q = 1" in note]


def test_the_note_on_q_takes_the_classical_limit_where_it_is_exact_enough(monkeypatch):
    """Four digits: no levels beyond the ground state are solved, where a sum to six took 50 of 350 ms of a whole command."""
    answer = answer_spectrum(SpectrumRequest(rotor.read("SO2"), jmax=2, q=1.0))
    summed = partition_function(answer.lines.top, 300.0).q
    monkeypatch.setattr(sys.modules["rotor.thermodynamics.sums.level_sums"], "_summed", None)
    assert _expected_q(answer.lines) == (pytest.approx(summed, rel=1e-5), False)


def test_atoms_that_no_bond_joins_are_named_by_their_parts():
    water = np.array([[0, 0, 0.117], [0, 0.757, -0.47], [0, -0.757, -0.47]])
    pair = Molecule(("O", "H", "H") * 2, np.concatenate([water, water + np.array([5, 0, 0])]))
    assert implausible(Top.from_molecule(pair)) == (
        "2 parts (3 + 3 atoms) without a bond between them: they are taken as a single rigid complex",
    )
    hydrogen = implausible(Top.from_molecule(Molecule(("H", "H"), [[0, 0, 0], [0, 0, 740]])))
    assert hydrogen[0].startswith("2 parts (1 + 1 atoms)")
    caesium = Molecule(("Cs", "I"), [[0, 0, 0], [0, 0, 3.315]])  # the longest of ordinary bonds
    assert implausible(Top.from_molecule(caesium)) == ()


def test_thousands_of_atoms_need_no_matrix_of_distances():
    grid = 1.5 * np.stack(np.meshgrid(*[np.arange(17.0)] * 3), axis=-1).reshape(-1, 3)
    molecule = Molecule(("C",) * len(grid), grid)
    tracemalloc.start()
    assert _far_apart(molecule) == []
    assert tracemalloc.get_traced_memory()[1] < 50e6  # bytes; the matrix has 8 * 4913² = 193e6
    tracemalloc.stop()
