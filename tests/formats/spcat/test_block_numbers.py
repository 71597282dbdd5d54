"""Block and place of levels in .egy files against those of the reference program, and their rule by hand."""

from __future__ import annotations

import numpy as np
import pytest
from oracle_cases import SAMPLES

from rotor.formats.spcat.block_numbers import _reach
from rotor.formats.spcat.hamiltonian.code_table import Digits
from rotor.formats.spcat.predict import predict, predict_file
from rotor.formats.spcat.text.egy import read_egy
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par

LONG = (
    "hard_nearsym_j150",
    "three_states_fermi_coriolis",
    "abc_ared6",
    "abc_sred",
    "pyridine_oblate_s",
    "two_state_coriolis",
)
OPTION_CARDS = [
    pytest.param(path.parent.name, marks=[pytest.mark.slow] if path.parent.name in LONG else [])
    for path in sorted(SAMPLES.glob("*/sample.egy"))
]


def numbers(levels) -> list[tuple[int, ...]]:
    """Block, place, degeneracy and quantum numbers of every level."""
    computed = [levels.level(row) for row in range(len(levels))]
    return [(level.block, level.rank, level.degeneracy, *level.quanta) for level in computed]


@pytest.mark.parametrize("case", OPTION_CARDS)
def test_samples_of_every_reference_case(case):
    ours = predict_file(SAMPLES / case / f"{case}.int", as_spcat=True).levels
    reference = numbers(read_egy(SAMPLES / case / "sample.egy"))
    assert set(reference) <= set(numbers(ours))
    assert len(set(zip(ours.block.tolist(), ours.rank.tolist(), strict=True))) == len(ours)
    assert len({block for block, *_ in reference}) > 5


def levels_of(options: str, parameters: str, fend: int = 2):
    """Levels of a file of A, B, C and more, J from 0 on."""
    file = read_par(f"a file\n9 1 1 0\n{options}\n10099 9000 0\n20099 3000 0\n30099 2500 0\n{parameters}".encode())
    light = read_int(f"a file\n1 91 1000 0 {fend} -20 -20 9999 300\n1 1.0\n".encode())
    return predict(file, light, as_spcat=True).levels


def test_states_that_are_connected_share_blocks_and_others_do_not():
    """Two states have 8 blocks of each J, a coupling by Na 4; by Nb and Na together 2."""
    options = "a 1 2 0 20 0 1 1 1 0 1 0"
    assert numbers(levels_of(options, "11 1000 0\n", 0)) == [(1, 1, 1, 0, 0, 0, 0), (5, 1, 1, 0, 0, 0, 1)]
    by_na = numbers(levels_of(options, "11 1000 0\n200001 5 0\n", 1))
    assert (7, 1, 3, 1, 1, 1, 0) in by_na  # with 1 1 0 of the other state in one block, the later species first
    assert {block for block, *_ in by_na} == {1, 4, 5, 6, 7, 8}
    by_both = numbers(levels_of("a 1 2 0 20 0 1 1 1 0 1 0", "11 1000 0\n200001 5 0\n400001 5 0\n", 1))
    assert max(block for block, *_ in by_both) == 4


def test_patterns_of_spins_stand_in_order_of_n():
    """I = 1: of F = 1 and species A the levels of N = 0 and 2, the places of Ka = 2 after those of Ka = 0."""
    computed = numbers(levels_of("a 3 1 0 20 0 1 1 1 0 1 0", "110010099 2 0\n", 1))
    in_state = [row for row in computed if row[0] == 5]
    assert [(row[1], *row[3:]) for row in in_state] == [(1, 0, 0, 0, 1), (2, 2, 0, 2, 1), (3, 2, 2, 0, 1)]


@pytest.mark.parametrize(
    ("ff", "typ", "species"), [(0, 0, 0), (0, 60, 1), (3, 60, 1), (12, 0, 3), (12, 60, 2), (21, 60, 1), (31, 60, 2)]
)
def test_a_sine_has_the_other_species(ff, typ, species):
    """cos(2πFF ρK/3) is even in K, a sine (FF 11 to 20, 31 to 40) odd: times Bz of N."""
    assert _reach(Digits(0, ff, 0, 0, 0, typ, 0, 0, 1, 0, 2), False).species == species


def test_a_file_of_transition_dipoles_is_refused_by_name():
    """FLAGS = 11 asks for .str and .egy, 1 for .egy alone."""
    file = read_par(b"a file\n3 1 1 0\na 1 1 0 20\n10000 9000 0\n20000 3000 0\n30000 2500 0\n")
    notes = [
        predict(file, read_int(f"a\n{flags} 91 1000 0 2 -20 -20 9999 300\n1 1.0\n".encode())).notes for flags in (11, 1)
    ]
    assert ["a .str file" in " ".join(note) for note in notes] == [True, False]


def test_l_doubled_states_count_by_energy():
    """Their blocks are not known here: block 1."""
    folder = SAMPLES / "kinds" / "l_doubled_weights"
    levels = predict_file(next(folder.glob("*.int")), as_spcat=True).levels
    assert set(levels.block.tolist()) == {1}
    assert np.array_equal(levels.rank, np.arange(1, len(levels) + 1))
