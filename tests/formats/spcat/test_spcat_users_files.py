"""What files of users have that made ones have not: the other sign of SPIND, constants out of order, spins that are not named, spellings.

The lines and levels are those of the reference program (tests/oracles/kinds/README.md), compiled from its public source.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from places import ORACLES

from rotor.formats.spcat.block_numbers import numbered_blocks
from rotor.formats.spcat.file_lines import as_level_list
from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.file_quanta import quanta_format
from rotor.formats.spcat.predict import Prediction, predict
from rotor.formats.spcat.solved_groups import SolvedGroup
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.egy import format_egy, format_level, read_egy
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import format_par, read_par

KINDS = ORACLES / "kinds"
REQUEST = b"a top\n1 76004 1000.0 0 3 -9.0 -9.0 60.0 300.0\n1 1.2\n3 0.4\n"
TOP = b"a top\n 4 1 1 0 0.0 1.0e6 1.0 1.0\na -1 -1 0 60 0 1 1 1 0 1 0\n10000 8572.06 0\n20000 3640.11 0\n30000 2790.97 0\n200 -7.13e-4 0\n"
WITH_K = b"""\
     493.4227  0.0000 -8.2777 3    2.0018  7  76004 202 3-1         3 2         
     849.1400  0.0000 -7.9850 3    0.3790  3  76004 202 1 0         1 1         
    2547.4200  0.0000 -7.2869 3    0.7797  5  76004 202 2 1         2-2         
    3243.0430  0.0000 -7.3371 3    1.2706  7  76004 202 3 3         3-3         
   48761.5825  0.0000 -7.9703 3    1.2706  7  76004 202 3 1         3-3         
"""  # noqa: W291  # of 41 lines
SYMMETRIC = b"a top\n 3 1 1 0 0.0 1.0e6 1.0 1.0\ns 1 1 0 50 0 6 2 2 0 1 0\n1000 20000.0 0\n100 5000.0 0\n1100 -0.05 0\n"
WITH_KA_KC = b"""\
   10000.0000  0.0000 -4.6938 3    0.0000  6  41505 303 1 0 1       0 0 0       
   19999.8000  0.0000 -4.2191 3    1.0007  5  41505 303 2 1 1       1 1 0       
   19999.8000  0.0000 -4.2191 3    1.0007  5  41505 303 2 1 1       1 1 0       
   20000.0000  0.0000 -3.7918 3    0.3336 10  41505 303 2 0 2       1 0 1       
   29998.8000  0.0000 -3.8271 3    3.6692  7  41505 303 3 2 1       2 2 0       
"""  # noqa: W291


def _same_lines(computed: Prediction, reference: bytes) -> None:
    """Every line of the reference by its label, with frequency, E″, intensity and degeneracy."""
    ours, theirs = computed.catalogue, read_cat(reference)
    assert set(ours.qnfmt.tolist()) == set(theirs.qnfmt.tolist())
    for row in range(len(theirs)):
        same = (ours.quanta_upper == theirs.quanta_upper[row]).all(axis=1) & (
            ours.quanta_lower == theirs.quanta_lower[row]
        ).all(axis=1)
        at = int(np.flatnonzero(same)[0])
        assert ours.frequency_mhz[at] == pytest.approx(theirs.frequency_mhz[row], abs=1e-4)  # the digits printed
        assert ours.energy_lower_cm[at] == pytest.approx(theirs.energy_lower_cm[row], abs=1e-4)  # the digits printed
        assert ours.lgint[at] == pytest.approx(theirs.lgint[row], abs=2e-4)  # two units of the last digit
        assert ours.g_upper[at] == theirs.g_upper[row]


@pytest.mark.parametrize("as_spcat", [False, True])
def test_an_asymmetric_top_by_n_and_k(as_spcat):
    """SPIND = -1: K is that of the basis, here Kc, and its sign the species."""
    prediction = predict(read_par(TOP), read_int(REQUEST), as_spcat=as_spcat)
    assert len(prediction.catalogue) == 41
    _same_lines(prediction, WITH_K)


def test_a_symmetric_top_by_ka_and_kc():
    prediction = predict(read_par(SYMMETRIC), read_int(REQUEST.replace(b"3 0.4\n", b"").replace(b"1 1.2", b"1 3.9")))
    assert len(prediction.catalogue) == 9
    _same_lines(prediction, WITH_KA_KC.replace(b"41505", b"76004"))


def test_constants_in_another_order_than_their_names():
    """B < C with a and c exchanged in the dipole is the same top seen from other axes: the same lines."""
    first, other = TOP.replace(b"a -1 -1", b"a 1 1"), TOP.replace(b"a -1 -1", b"a 1 1")
    other = other.replace(b"20000 3640.11", b"20000 2790.97").replace(b"30000 2790.97", b"30000 3640.11")
    request, turned = read_int(REQUEST), read_int(REQUEST.replace(b"3 0.4", b"2 0.4"))
    mine, theirs = (predict(read_par(p), i).catalogue for p, i in ((first, request), (other, turned)))
    assert np.sort(mine.frequency_mhz) == pytest.approx(np.sort(theirs.frequency_mhz), abs=1e-6)  # round-off
    assert np.sort(mine.lgint) == pytest.approx(np.sort(theirs.lgint), abs=1e-6)  # round-off


def test_numbers_that_abut_and_a_letter_in_apostrophes():
    head = TOP.replace(b" 4 1 1 0 0.0 1.0e6 1.0 1.0", b" 4 0 10 0 0.010000000000000.0-1.0 1.0")
    read = read_par(head.replace(b"a -1", b" 's' -1"))
    assert (read.header.thresh, read.header.errtst, read.header.frac) == (0.01, 0.0, -1.0)
    assert (read.options[0].chr, read.options[0].spind) == ("s", -1)
    assert format_par(read) == head.replace(b"a -1", b" 's' -1")
    with pytest.raises(ValueError, match=r"'0\.01\.0' is no number"):  # elsewhere such a number is a mistake
        read_par(TOP.replace(b"-7.13e-4", b"0.01.0"))


def test_spins_that_spind_does_not_name():
    """As SPCAT does a term of theirs is left out, with a note."""
    chi = TOP.replace(b" 4 1 1", b" 5 1 1") + b"110010000 2.5 0\n"
    for file, says in ((chi, "spin 1 is not among the 0"), (chi.replace(b"a -1", b"a -2"), "no quadrupole moment")):
        prediction = predict(read_par(file), read_int(REQUEST))
        assert any("left out, as SPCAT does" in note and says in note for note in prediction.notes)
        alone = predict(read_par(file.replace(b"110010000 2.5", b"110010000 0.0")), read_int(REQUEST))
        assert prediction.catalogue.frequency_mhz == pytest.approx(
            alone.catalogue.frequency_mhz, abs=1e-9
        )  # the same numbers


def test_levels_with_more_than_six_quanta_have_all_of_them():
    """As the program writes them: the number of the pattern in brackets, then N, Ka, Kc, v, F1, ... F."""
    file = read_par((KINDS / "patterns_of_i_tot" / "patterns_of_i_tot.var").read_bytes())
    request = read_int((KINDS / "patterns_of_i_tot" / "patterns_of_i_tot.int").read_bytes())
    group = connected_groups(file, replace(request, request=replace(request.request, fend=0)), as_spcat=True)[0]
    levels = as_level_list([SolvedGroup(group, group.levels((0, 0)), None)], quanta_format(file, [group]))
    written = format_level(levels.level(0))
    assert written[63:].startswith(":(")
    assert len(written[63:].rstrip()) == 1 + 5 + 3 * 8
    again = read_egy(format_egy(levels))
    assert again.pattern is not None
    assert levels.pattern is not None
    assert (again.pattern == levels.pattern).all()
    assert (again.quanta == levels.quanta).all()


def test_a_list_of_many_levels_fits_its_columns():
    """The program's list of this file has four blocks for every N; where its numbers are not known here, ranks go to 9999."""
    file = read_par(SYMMETRIC.replace(b"s 1 1 0 50", b"s 1 1 0 200"))
    request = read_int(b"a top\n1 1 1000.0 0 104 -9 -9 60.0 300.0\n1 1.2\n")
    group = connected_groups(file, request)[0]
    solved, form = [SolvedGroup(group, group.levels((0, 208)), None)], quanta_format(file, [group])
    levels = as_level_list(solved, form, blocks=numbered_blocks(file, [group]))
    assert (len(levels), levels.block.max(), levels.rank.max()) == (105**2, 4 * 105, 53)
    others = as_level_list(solved, form)
    assert (len(others), others.block.max(), others.rank.max()) == (105**2, 2, 9999)
    last = format_level(others.level(int(others.rank.argmax())))
    assert len(last) == len(format_level(others.level(0)))
    again = read_egy((last + "\n").encode())
    assert (again.block[0], again.rank[0]) == (1, 9999)


@pytest.mark.parametrize("option", ["s 1 1", "s -1 1"])
def test_a_spherical_top_with_a_dipole(option):
    """Symmetry allows it none; the program makes the lines of a file that has one, by N, Ka, Kc or by N, K."""
    file = read_par(
        f"a top\n 2 1 1 0 0.0 1.0e6 1.0 1.0\n{option} 0 50 0 1 1 1 0 1 0\n100 5000.0 0\n200 -0.01 0\n".encode()
    )
    prediction = predict(file, read_int(REQUEST.replace(b"3 0.4\n", b"").replace(b"1 1.2", b"1 3.9"))).catalogue
    assert len(prediction) == 9
    assert set(prediction.frequency_mhz.round(4).tolist()) == {
        9999.96,
        19999.68,
        29998.92,
    }  # 2 B (N + 1) - 4 D (N + 1)³


def test_a_linear_molecule_in_the_oblate_basis():
    """Its axis is c there: a dipole along a makes no line, one along c makes all."""
    file = read_par(b"a rod\n 1 1 1 0 0.0 1.0e6 1.0 1.0\nl -1 -1 0 0 0 1 1 1 0 1 0\n100 5000.0 0\n")
    request = REQUEST.replace(b"3 0.4\n", b"")
    assert len(predict(file, read_int(request)).catalogue) == 0
    assert len(predict(file, read_int(request.replace(b"1 1.2", b"3 1.2"))).catalogue) == 3
