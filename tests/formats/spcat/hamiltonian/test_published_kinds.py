"""Inputs of the kinds that published fits have, each made with constants of that size and checked by the full matrix.

Each kind is the text of a .var file; the levels that the package makes of it are compared, F by F, with those of one full matrix
for each F (`full_matrix.py`), which reads the codes by itself. l-doubled states of symmetric tops have a test in
`test_l_doubled.py`, lines of the reference program one in `test_spcat_kinds.py`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from full_matrix_codes import case_of
from full_matrix_levels import solve
from places import ORACLES

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.text.int_file import IntensityFile, read_int
from rotor.formats.spcat.text.par import ParameterFile, read_par

KINDS = ORACLES / "kinds"


def _eighteen_states() -> str:
    """18 states in near pairs; couplings of the codes that published fits of nitriles have, and a chain that ties the pairs."""
    lines = ["a 1 18 0 20 0 1 1 1 0 1 0"]
    lines += ["109999 22670.0", "19999 4830.0", "4009999 14.5", "29999 -1.5e-3", "119999 0.085", "209999 -1.2"]
    for v in range(18):
        lines.append(f"{101 * v} {260.0e3 * (v // 2) + 8000.0 * (v % 2)!r}")
        lines.append(f"{100000 + 101 * v} {-35.0 + 9.0 * v!r}")
        lines.append(f"-{10000 + 101 * v} {1.5 - 0.4 * v!r}")  # tied, as most lines are
    lines += [
        "40000405 612.0",
        "40010405 -3.1e-3",
        "41010405 2.0e-6",
        "60000001 -1480.0",
        "61000001 11.2",
        "20001617 5.0e3",
    ]
    lines += ["1213 9.1e3", "11213 0.2", "4001213 -0.02", "21000607 7.7", "20000809 2.1e4"]
    lines += [f"{100 * (v + 2) + v} {250.0 + 7 * v!r}" for v in range(0, 16, 2)]
    return "\n".join(lines)


WIDE = "10099 {a!r}\n20099 {b!r}\n30099 {c!r}\n"

TEXTS = {
    "18 states, two digits for each": (_eighteen_states(), (0, 2, 8)),
    # letter and blanks left to their defaults, two option lines, oblate basis by NVIB < 0 in both
    "option fields by commas, an option line for each state, NVIB negative": (
        "a 1,-2,,12,,1,3,3,-1\na 1,-1,,,,1,3,3\n"
        "10099 8545.8\n20099 8545.1\n30099 4272.9\n20011 -12.0\n11 5400.0\n60001 820.0\n610001 -3.4\n40099 0.04\n",
        (2, 8, 12),
    ),
    "two states of two chlorine nuclei, SPIND 44": (
        "a 44 2 0 20 0 1 1 1 0 1 0\n" + WIDE.format(a=32002.3, b=3320.0, c=3065.2)
        + "11 9100.0\n10011 -88.0\n20011 -4.0\n60001 310.0\n610001 -1.9\n"
        + "".join(f"{s}{s}0010099 -62.7\n{s}{s}0040099 -9.2\n" for s in (1, 2))
        + "110610099 48.0\n220610099 -48.0\n10010099 0.004\n20010099 0.004\n",
        (0, 2, 8),
    ),
    "symmetric-top radical with fluorine, SPIND -22": (
        "s -22 1 0 36 0 1 1 1 0 1 0\n1000 252.4\n1000 -5.5\n100 5195.5\n1100 1.3e-3\n200 -3.8e-3\n10000000 -14.6\n10010000 -3.1\n"
        "120000000 -9.1\n120010000 21.3\n20000000 0.011\n20010000 -0.004\n",
        (2, 6, 12),
    ),
    "a triplet sigma state beside a singlet delta state, SPIND -3": (
        "l -3 2 0 0 0 1 1 1 -1 1 0\nl -1 1 2 2 0 1 1 1 0 1 0\n"
        "100 43100.44\n200 -0.1451\n110010000 59501.3\n110010100 0.0584\n10000000 -252.6\n10000100 -7.4e-4\n"
        "11 236512000.0\n111 42504.5\n211 -0.153\n",
        (4, 6, 14),
    ),
    "a linear molecule with l-type doubling and nitrogen, SPIND -4": (
        "l -3 1 1 1 0 1 1 1 0 1 0\n100 44422.4\n200 -0.0891\n40000 112.2\n40100 -1.35e-3\n110010000 -7.05\n110040000 -0.0985\n"
        "10000000 0.0105\n10010000 0.003\n",
        (2, 6, 12),
    ),
    "CsF: spin-rotation, tensor and scalar spin-spin of 7/2 and 1/2, SPIND -28": (
        "l -28 1 0 0 0 1 1 1 0 1 0\n100 5490.0\n110010000 1.855608779941512\n10000000 6.880531625605832e-4\n"
        "20000000 1.504430640628889e-2\n120010000 -2.943237328539779e-3\n120000000 6.184912813981738e-4\n",
        (0, 4, 10),
    ),
}  # fmt: skip


H2S = """10000 310583.57\n20000 270367.676\n30000 141820.035\n200 -20.861\n1100 76.2298\n2000 -117.7225\n40100 -8.86591
50000 0.641778\n300 1.0209e-2\n1200 -9.0192e-2\n2100 0.155613\n3000 -3.38e-2\n40200 2.8796e-3\n50100 -9.5638e-4\n60000 1.24892e-3
400 -5.418e-6\n1300 6.93075e-5\n2200 -2.15084e-4\n3100 2.67556e-4\n4000 -1.58098e-4\n40300 -1.02846e-6\n50200 -3.56e-7
60100 -1.76868e-6\n70000 4.138e-7\n40400 4.1e-10\n50300 6.0e-10\n60200 -3.0e-10\n70100 -2.2e-10\n80000 1.9e-10\n40500 -2.0e-13
50400 3.0e-13\n60300 1.1e-13\n70200 -2.0e-13\n80100 1.5e-13\n90000 -4.0e-14\n42000 1.0e-6\n41100 -2.0e-6\n51000 3.0e-7\n61000 1.0e-9
"""  # the last, with powers of Nz² too, are not of the S-reduction, but of files that go on where it ends
TEXTS["higher terms off the diagonal of hydrogen sulphide"] = ("s 1 1 0 20 0 1 1 1 0 1 0\n" + H2S, (0, 16, 24))

FILES = {"h2coh": (2, 4), "oc33s": (3, 5), "o2": (2, 6)}  # doubled F


def _parameters(text: str) -> ParameterFile:
    options = [line for line in text.splitlines() if line[0].isalpha()]
    values = [line for line in text.splitlines() if not line[0].isalpha()]
    body = "".join(f"{line} 0\n" for line in values)
    return read_par(f"a kind\n {len(values)} 1 1 0 0 1e6 1 1\n{chr(10).join(options)}\n{body}".encode())


@cache
def _wanted() -> IntensityFile:
    return read_int(b"a kind\n0 1 1000.0 0 9 -30 -30 99999 300\n")


def _energies(par: ParameterFile, twice: int) -> np.ndarray:
    """Energies of one F from the package, over all groups of states and with K up to KNMAX, rising."""
    errors = []
    for group in connected_groups(par, _wanted(), as_spcat=True):
        if (sum(group.spins) - twice) % 2 == 0:
            levels = group.levels((twice, twice))
            here = levels.multiplicity == twice + 1
            errors.append(np.repeat(levels.energy_mhz[here], levels.components[here]))
    return np.sort(np.concatenate(errors))


def _compared(par: ParameterFile, twice: int) -> tuple[np.ndarray, np.ndarray]:
    """The same, and energies of the full matrix, rising."""
    return _energies(par, twice), np.sort(solve(case_of(par, _wanted()), twice).energy_mhz)


def _assert_equal(par: ParameterFile, twice: int) -> None:
    computed, expected = _compared(par, twice)
    assert len(computed) == len(expected) > 0
    assert (
        np.abs(computed - expected).max() < 1e-14 * np.abs(expected).max() + 2e-8
    )  # 1e-14 of the largest energy, and its sums


@pytest.mark.parametrize("kind", TEXTS)
def test_levels_are_those_of_the_full_matrix(kind):
    text, fs = TEXTS[kind]
    for twice in fs:
        _assert_equal(_parameters(text), twice)


@pytest.mark.parametrize("name", FILES)
def test_published_files_are_the_full_matrix(name):
    """The whole parameter lists of fits that stand in the folder of kinds; of levels without weight the package has none."""
    par = read_par(KINDS / name / f"{name}.var")
    for twice in FILES[name]:
        computed, expected = _compared(par, twice)
        assert len(expected) >= len(computed) > 0
        nearest = np.abs(computed[:, None] - expected).min(axis=1)
        assert nearest.max() < 1e-14 * np.abs(expected).max() + 2e-8  # 1e-14 of the largest energy, and its sums
        if name == "h2coh":  # two protons, of which each state has one total spin
            assert 2 * len(computed) == len(expected)


@pytest.mark.parametrize("kind", TEXTS)
def test_every_parameter_counts(kind):
    """Each parameter, left out of one side, is seen by the comparison, but those of value 0."""
    text, (_, twice, _) = TEXTS[kind]
    par = _parameters(text)
    whole = _compared(par, twice)[1]
    step = max(len(par.parameters) // 12, 1)  # a dozen of long lists
    for place in range(0, len(par.parameters), step):
        if par.parameters[place].value:
            rest = replace(par, parameters=par.parameters[:place] + par.parameters[place + 1 :])
            without = _energies(rest, twice)
            assert np.abs(without - whole).max() > 2e-7, par.parameters[place]


def test_option_fields_by_commas_are_those_in_full():
    comma = _parameters(TEXTS["option fields by commas, an option line for each state, NVIB negative"][0])
    first, second = comma.options
    assert (first.spind, first.nvib, first.knmin, first.knmax, first.wtpl, first.wtmn, first.vsym) == (
        1,
        -2,
        0,
        12,
        3,
        3,
        -1,
    )
    assert (second.nvib, second.knmin, second.knmax, second.iax, second.wtpl, second.wtmn) == (
        -1,
        0,
        12,
        1,
        3,
        3,
    )  # blanks: as the line before
    (group,) = connected_groups(comma, _wanted())
    levels = group.levels((4, 4))
    assert group.oblate
    assert set(levels.weight[levels.quanta["v"] == 1].tolist()) == {3}


def test_codes_of_eighteen_states_name_two_of_them():
    from rotor.formats.spcat.hamiltonian.code_table import split_code

    code = split_code(40010405, 18)
    assert sorted((code.v1, code.v2)) == [4, 5]
    groups = [
        [state.number for state in group.states]
        for group in connected_groups(_parameters(_eighteen_states()), _wanted())
    ]
    assert sorted(v for group in groups for v in group) == list(range(18))
    assert {0, 1, 4, 5, 16, 17} < set(groups[0])
    assert [3] in groups
