"""Random SPCAT files against full matrices that share no code with the package but the readers of lines.

Up to three states with interactions, two spins and moments of every TYP within and between states; l-doubled pairs of a threefold axis.
Strengths of lines between groups of close levels are compared in sum, since round-off mixes such levels, and both ways, so that no line
is missing. Series, PHASE, IXX and equivalent spins with a total are in `test_random_codes`. Not covered: the names of levels.
"""

from __future__ import annotations

import numpy as np
import pytest
from full_matrix import pieces, term_matrix
from full_matrix_codes import Case
from full_matrix_l_doubled import l_doubled_solution
from full_matrix_moments import Moment, strengths
from lines_of_levels import compare_levels, compare_lines, groups_of_close, summed
from random_spcat import RIGID, RandomFile, file_of_l, file_of_states, with_both_of_pairs

from rotor.formats.spcat.file_model import connected_groups

# states, spins, whether with ranges of K
STATES = [(1, 1, False), (1, 2, False), (2, 0, False), (2, 1, False), (2, 2, False), (3, 0, False), (3, 1, False),
          (1, 2, True), (2, 1, True), (3, 0, True)]  # fmt: skip
PAIRS = [(1, 0), (2, 0), (1, 1), (1, 2), (2, 1)]  # l-doubled pairs, spins


def _solution(case: Case, f2: int):
    """Pieces, eigenvectors over |v, pattern, k⟩ and energies of one F."""
    basis = pieces(case.states, f2)
    hamiltonian = sum(term_matrix(term, basis, case.states, "c" if case.oblate else "a") for term in case.terms)
    energy, vectors = np.linalg.eigh(hamiltonian)
    return basis, vectors, energy


def _compare(file: RandomFile, solution=_solution, count_of_f: int = 3) -> int:
    """How many sums of lines were compared; AssertionError with the file where a level or a line differs."""
    case = file.case
    half = sum(case.states[0].spins2) % 2
    solved = {f2: solution(case, f2) for f2 in range(half, half + 2 * count_of_f, 2)}
    energies = {f2: energy for f2, (_, _, energy) in solved.items()}
    size = max(np.abs(energy).max(initial=0.0) for energy in energies.values())
    close = groups_of_close(energies, size)
    groups = [
        (group, group.levels((min(solved), max(solved)))) for group in connected_groups(file.par, file.intensities)
    ]
    compare_levels(groups, energies, size, file.text)
    expected = {
        (f, g): summed(strengths(case, file.moments, solved[f][:2], solved[g][:2]), close[f], close[g])
        for f in solved
        for g in (f, f - 2)
        if g in solved and len(close[f]) and len(close[g])
    }
    return compare_lines(groups, energies, close, expected, file.text)


@pytest.mark.parametrize(("states", "spins", "limits"), STATES)
def test_levels_and_strengths_are_those_of_full_matrices(states, spins, limits):
    count = 1 if states * spins > 2 else 2 if states > 1 else 4
    assert sum(_compare(file_of_states(seed, states, spins, limits)) for seed in range(count)) > 50


@pytest.mark.parametrize(("pairs", "spins"), PAIRS)
def test_levels_and_strengths_of_l_doubled_states_are_those_of_full_matrices(pairs, spins):
    count = 1 if pairs * spins > 1 else 2
    assert sum(_compare(file_of_l(seed, pairs, spins), l_doubled_solution) for seed in range(count)) > 50


@pytest.mark.parametrize("code", [1000001, 1040001, 10010001, 10000001, 10610010])
def test_spin_terms_between_states_with_other_ranges_of_k(code):
    """The functions of both states have to be distinguished by K, not by their places in a block."""
    parameters = [(typ + v, size) for v in (0, 11) for typ, size in RIGID]
    moments = [Moment((v, v), 0, axis, 1.0) for v, axis in ((0, 1), (1, 3))]
    for ranges in (("0 20", "1 1"), ("1 2", "0 20")):
        options = [f"a 3 2 {ranges[0]} 0 1 1 1 -1 0 0", f"a 3 1 {ranges[1]} 0 1 1 1 0 0 0"]
        assert _compare(RandomFile.of(0, options, [*parameters, (11, 1641.0), (code, 77.5)], moments)) > 20


@pytest.mark.parametrize("nvib", [3, -3])
@pytest.mark.parametrize(
    ("parallel", "beside"), [(10040012, 410021), (1040012, 410021), (1040010, 40012), (110040012, 400001)]
)
def test_spin_terms_that_change_l(parallel, beside, nvib):
    """Δk Δl > 0 is that of operators without spins in either basis, and N·S times N₊² + N₋² has it too; else E levels split."""
    z, sym = (600011, 3) if nvib < 0 else (200011, 1)
    parameters = [(1099, 3000.0), (199, 5000.0), (11, 20000.0), (z, 2000.0), (parallel, 50.0), (beside, 40.0)]
    options = [f"s -3 {v or nvib} 0 40 0 6 2 2 {-1 if v < 2 else 0} {code} 0" for v, code in enumerate((1, 101, 201))]
    moments = [Moment((v, v), 0, sym, 1.0) for v in (0, 1)]
    file = RandomFile.of(0, options, parameters, moments)
    assert _compare(with_both_of_pairs(file), l_doubled_solution) > 20


@pytest.mark.slow(seconds=15)
@pytest.mark.parametrize(("states", "spins", "limits"), STATES)
def test_levels_and_strengths_of_more_files(states, spins, limits):
    assert sum(_compare(file_of_states(seed, states, spins, limits)) for seed in range(1, 51)) > 1000


@pytest.mark.parametrize("nvib", [3, -3])
@pytest.mark.parametrize(("iax", "fold"), [(7, 4), (9, 5), (10, 6)])
def test_l_doubled_states_of_other_folds(iax, fold, nvib):
    """-2Aζ alone joins both components in every block; energies alone, as not all levels of even folds have weights."""
    z = 600011 if nvib < 0 else 200011
    codes = (1, 101, 100 * (fold - 1) + 1)
    options = [f"s -1 {v or nvib} 0 40 0 {iax} 2 2 {-1 if v < 2 else 0} {code} 0" for v, code in enumerate(codes)]
    for doubling in ((), ((40012, 9.0),)):
        parameters = [(1099, 3000.0), (199, 5000.0), (11, 20000.0), (z, 2000.0), *doubling]
        file = RandomFile.of(0, options, parameters, [Moment((0, 0), 0, 1, 1.0)])
        groups = [(group, group.levels((0, 8))) for group in connected_groups(file.par, file.intensities)]
        energies = {f2: l_doubled_solution(file.case, f2)[2] for f2 in range(0, 10, 2)}
        compare_levels(groups, energies, max(energy.max() for energy in energies.values()), file.text)


@pytest.mark.slow
@pytest.mark.parametrize(("pairs", "spins"), PAIRS)
def test_levels_and_strengths_of_more_l_doubled_states(pairs, spins):
    count = sum(
        _compare(file_of_l(seed, pairs, spins), l_doubled_solution, 4 if not spins else 3) for seed in range(5, 45)
    )
    assert count > 1000
