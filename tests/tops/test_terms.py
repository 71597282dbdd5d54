"""Names of terms, and terms beyond the published names: matrices, text and files, refusals."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slow_matrix import term_matrix, watson_matrix

from rotor.formats.molecules.molecule_file import MoleculeFile, parse_molecule_file
from rotor.formats.molecules.molecule_writer import molecule_file_text
from rotor.quantum.effects.watson import centrifugal_operators, operators_by_name, rigid_operators
from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.operators import published_name, spelled_powers, spelled_term
from rotor.tops.top import Top

RIGID = {"A": 9000.0, "B": 5000.0, "C": 3000.0}
BEYOND = {(1, 0, 4): 3e-7, (0, 2, 2): -2e-4, (6, 0, 0): 1e-9, (0, 6, 0): -4e-9, (2, 1, 3): 5e-8, (0, 0, 5): 2e-8}

powers = st.tuples(*[st.integers(0, 60)] * 3).filter(any)


@given(powers)
def test_every_term_has_a_name_that_reads_back(term):
    assert spelled_powers(spelled_term(*term)) == term


@pytest.mark.parametrize("name", ["J", "Jz", "J3", "J4Jz1", "Jpm3", "JzJ2", "Jz2J4", "J04", "", "DJ", "J2x", "J0"])
def test_what_is_no_spelled_term(name):
    assert spelled_powers(name) is None


@pytest.mark.parametrize("representation", ["Ir", "IIIl", "IIr"])
def test_levels_with_terms_beyond_the_names(representation):
    """The Hamiltonian with terms up to the twelfth power against products of QuTiP's operators."""
    values = RIGID | {"DJ": 0.1, "DK": 2.0, "d2": -0.013}
    constants = Constants(reduction="S", representation=representation, terms=BEYOND, **values)
    levels = solve_levels(Top(constants), 9)
    for j in range(10):
        slow = watson_matrix(values, "S", representation, j)
        slow = slow + sum(value * term_matrix(*term, j) for term, value in BEYOND.items())
        ours = np.sort(levels.energy_mhz[levels.quanta["j"] == j])
        assert np.allclose(ours, np.linalg.eigvalsh(slow), rtol=0, atol=1e-8)  # round-off of a dense solver at 1e6 MHz


@pytest.mark.parametrize(("kind", "text", "name"), [("linear", "B=6000", "J10"), ("prolate", "A=9000 B=5000", "Jz12")])
def test_terms_of_closed_forms(kind, text, name):
    top = Top.from_constants(f"{text} {name}=1e-6 MHz")
    without = solve_levels(Top.from_constants(f"{text} MHz"), 6)
    levels = solve_levels(top, 6)
    expected = 42.0**5 if kind == "linear" else 6.0**12
    assert (levels.energy_mhz - without.energy_mhz)[-1] == pytest.approx(1e-6 * expected, rel=1e-9)  # a difference


def test_named_operators_add_up_to_the_hamiltonian():
    constants = Constants(reduction="A", DeltaJ=0.1, deltaK=0.5, phiK=1e-4, terms=BEYOND, **RIGID)
    total: dict = {}
    for name, operator in operators_by_name(constants).items():
        for term, factor in operator.items():
            total[term] = total.get(term, 0.0) + factor * constants[name]
    assert total == pytest.approx(centrifugal_operators(constants) | rigid_operators(constants))
    assert total[1, 0, 0] == 4000.0  # (B + C)/2
    assert total[0, 1, 0] == 5000.0  # A - (B + C)/2
    assert total[0, 0, 1] == 500.0  # (B - C)/4


def test_terms_survive_text_files_and_pickle():
    constants = Constants(
        reduction="A", DeltaJ=0.1, terms=BEYOND, uncertainties={"J2Jpm8": 1e-9}, sources={"J2Jpm8": "a paper"}, **RIGID
    )
    assert constants["J2_Jpm8"] == 3e-7
    assert constants.terms == BEYOND
    assert Constants.parse(constants.text(), reduction="A").values == constants.values
    assert pickle.loads(pickle.dumps(constants)) == constants
    file = parse_molecule_file(molecule_file_text(MoleculeFile("x", constants=constants)))
    assert file.constants == constants


def test_replace_takes_terms():
    changed = Constants(terms=BEYOND, **RIGID).replace(terms={(1, 0, 4): 1.0}, J12=None)
    assert changed.terms == {**{k: v for k, v in BEYOND.items() if k != (6, 0, 0)}, (1, 0, 4): 1.0}


@pytest.mark.parametrize(
    ("values", "says"),
    [
        (RIGID | {"J4": 1.0}, "DeltaJ or DJ"),
        (RIGID | {"Jz2Jpm2": 1.0, "reduction": "A"}, "deltaK"),
        (RIGID | {"J2": 1.0}, "A, B, C"),
        ({"B": 5.0, "Jz4": 1.0}, "powers of J only"),
        ({"B": 5.0, "A": 9.0, "Jpm8": 1.0}, "J and Jz"),
        (RIGID | {"J4": 1.0, "J_4": 1.0}, "given twice"),
        (RIGID | {"J5": 1.0}, "not a rotational constant"),
    ],
)
def test_terms_without_a_meaning_are_refused(values, says):
    with pytest.raises(ValueError, match=says):
        Constants(**values)


def test_impossible_powers_are_refused():
    with pytest.raises(ValueError, match="whole numbers"):
        Constants(terms={(-1, 0, 3): 1.0}, **RIGID)
    with pytest.raises(ValueError, match="not a rotational term"):
        Constants(terms={(0, 0, 0): 1.0}, **RIGID)


def test_an_operator_outside_a_reduction_is_welcome():
    """δK's operator has a name in A only; an unreduced Hamiltonian with d2 may carry it."""
    assert published_name((0, 1, 1), "asymmetric", "S") == ""
    assert Constants(d2=0.1, Jz2Jpm2=0.2, **RIGID).terms == {(0, 1, 1): 0.2}
