"""Spin weights of random SPCAT files: predicted levels and lines against full matrices over functions of one weight.

WTPL and WTMN by the character under the half turn of IAX, equal or exchanged in the states, EWT by K - l modulo three of l-doubled states;
elements between functions of unlike weights are zero. Energies and degeneracies of all levels are compared, and of lines between two F
with one weight the sum of intensities and its first moments in frequency and E″.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from full_matrix import pieces, term_matrix, wang_columns, wang_functions
from full_matrix_codes import Case
from full_matrix_l_doubled import l_doubled_solution, l_values
from full_matrix_moments import strengths
from random_spcat import Draw, RandomFile, file_of_l, file_of_states
from scipy.linalg import block_diag

from rotor.formats.spcat.predict import predict
from rotor.units import MHZ_PER_CM, MHZ_PER_K

INTENSITY, TEMPERATURE_K, QROT = (
    4.16231e-5,
    300.0,
    1000.0,
)  # nm² MHz of a catalogue over D² MHz, TEMP and QROT of the files
UNLIKE = ((1, 3), (3, 1), (1, 0), (0, 1), (2, 2), (5, 3), (6, 10))
FILES = [(1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (1, 2)]  # states, spins


def _by_half_turn(case: Case, f2: int) -> tuple[list, np.ndarray, np.ndarray, np.ndarray]:
    """Pieces, transformation to Wang functions, Hamiltonian over them, and their weights."""
    z = "c" if case.oblate else "a"
    basis = pieces(case.states, f2)
    functions = wang_functions(basis, z)
    columns = block_diag(*(wang_columns(p, [f for f in functions if f.piece == i]) for i, p in enumerate(basis)))
    states = [case.states[basis[f.piece].v] for f in functions]
    weights = [
        s.plus if f.species in ("A", "abc"[s.axis - 1]) else s.minus for s, f in zip(states, functions, strict=True)
    ]
    hamiltonian = sum(term_matrix(term, basis, case.states, z) for term in case.terms)
    return basis, columns, columns.T @ hamiltonian @ columns, np.array(weights)


def _by_three_folds(case: Case, f2: int) -> tuple[list, np.ndarray, np.ndarray, np.ndarray]:
    """The same of l-doubled states with WTPL = WTMN, over |v, pattern, k⟩."""
    basis, vectors, energy = l_doubled_solution(case, f2)
    l_of = l_values(case)
    classes = [(p.v, (k - l_of.get(p.v, 0)) % 3) for p in basis for k in p.ks]
    weights = [case.states[v].e_weight if alike else case.states[v].plus for v, alike in classes]
    return basis, np.eye(len(vectors)), (vectors * energy) @ vectors.conj().T, np.array(weights)


def _solution(case: Case, f2: int) -> tuple[tuple[list, np.ndarray], np.ndarray, np.ndarray]:
    """(Pieces, eigenvectors), energies and weights of the levels that exist."""
    basis, columns, hamiltonian, weights = (_by_three_folds if l_values(case) else _by_half_turn)(case, f2)
    vectors, energies, of_level = [np.zeros((len(weights), 0))], [np.zeros(0)], [np.zeros(0, int)]
    for weight in set(weights.tolist()) - {0}:
        rows = np.flatnonzero(weights == weight)
        energy, states = np.linalg.eigh(hamiltonian[np.ix_(rows, rows)])
        vectors.append(np.eye(len(weights))[:, rows] @ states)
        energies.append(energy)
        of_level.append(np.full(len(rows), weight))
    return (basis, columns @ np.hstack(vectors)), np.concatenate(energies), np.concatenate(of_level)


def _acting(file: RandomFile) -> bool:
    """Whether more moments within states that join levels of equal weight are of odd order than of even order."""
    states = file.case.states
    within = [
        m.typ in (1, 2, 5)
        for m in file.moments
        for s in [states[m.states[0]]]
        if m.sym and m.states[0] == m.states[1] and (s.plus == s.minus or s.axis == m.sym)
    ]
    return within.count(False) > within.count(True)


def _full_lines(file: RandomFile, solved) -> dict[tuple[int, int, int], np.ndarray]:
    """Frequency, E″ and intensity (lines, 3) by 2F′, 2F″ and weight."""
    lines = defaultdict(list)
    kt = TEMPERATURE_K * MHZ_PER_K
    for up, (states, energy, weight) in solved.items():
        for low, (others, energy_low, weight_low) in solved.items():
            if abs(up - low) > 2 or not len(energy) or not len(energy_low):
                continue
            strength = strengths(file.case, list(file.moments), states, others, 1.0 if _acting(file) else 1j)
            nu = energy[:, None] - energy_low
            for i, j in zip(*np.nonzero((nu > 5e-5) & np.equal.outer(weight, weight_low)), strict=True):
                boltzmann = np.exp(-energy_low[j] / kt) - np.exp(-energy[i] / kt)
                size = INTENSITY * nu[i, j] * strength[i, j] * weight[i] * boltzmann / QROT
                lines[up, low, int(weight[i])].append((nu[i, j], energy_low[j], size))
    return {key: np.array(rows) for key, rows in lines.items()}


def _compare(file: RandomFile, count_of_f: int = 3) -> int:
    """How many lines were compared."""
    half = sum(file.case.states[0].spins2) % 2
    solved = {f2: _solution(file.case, f2) for f2 in range(half, half + 2 * count_of_f, 2)}
    prediction = predict(file.par, file.intensities)
    levels, catalogue = prediction.levels, prediction.catalogue

    def twice_f(quanta: np.ndarray) -> np.ndarray:
        width = int((quanta[0] > -100).sum())
        return 2 * quanta[:, width - 1 if file.case.states[0].spins2 else 0].astype(int) - half

    of_f, weights = twice_f(levels.quanta), levels.degeneracy // (twice_f(levels.quanta) + 1)
    for f2, (_, energy, weight) in solved.items():
        for each in set(weights[of_f == f2].tolist()) | set(weight.tolist()):
            ours = np.sort(levels.energy_cm[(of_f == f2) & (weights == each)]) * MHZ_PER_CM
            np.testing.assert_allclose(ours, np.sort(energy[weight == each]), rtol=1e-12, atol=1e-6, err_msg=file.text)
    full = _full_lines(file, solved)
    if not len(catalogue):
        return 0
    up, low = twice_f(catalogue.quanta_upper), twice_f(catalogue.quanta_lower)
    keys = np.column_stack([up, low, catalogue.g_upper // (up + 1)])
    columns = np.column_stack([catalogue.frequency_mhz, catalogue.energy_lower_cm * MHZ_PER_CM, 10.0**catalogue.lgint])
    largest = max((rows[:, 2].max() for rows in full.values()), default=0.0)
    for key, rows in full.items():
        ours = columns[(keys == key).all(axis=1)]
        for factor, factor_of_ours in ((1.0, 1.0), (rows[:, 0], ours[:, 0]), (rows[:, 1], ours[:, 1])):
            expected, size = (factor * rows[:, 2]).sum(), (np.abs(factor) * rows[:, 2]).sum()
            assert abs((factor_of_ours * ours[:, 2]).sum() - expected) <= 3e-7 * size + 1e-9 * largest * (
                np.abs(factor).max() + 1.0
            ), file.text
    return sum(len(rows) for rows in full.values())


def _with_half_turn(file: RandomFile, seed: int) -> RandomFile:
    """The file with weights by one axis in all states, equal or exchanged."""
    r = Draw(seed)
    axis, weights = r.randint(1, 3), r.choice(UNLIKE)
    pairs = [r.choice([weights, weights, weights[::-1]]) for _ in file.case.states]
    first, signs = file.par.options[0], [-1] * (len(pairs) - 1) + [0]
    options = [
        replace(first, nvib=v or first.nvib, iax=axis, wtpl=plus, wtmn=minus, vsym=sign)
        for v, ((plus, minus), sign) in enumerate(zip(pairs, signs, strict=True))
    ]
    return replace(file, par=replace(file.par, options=tuple(options)))


def _with_e(file: RandomFile, seed: int) -> RandomFile:
    """The file of l-doubled states with other weights of A and of E species."""
    r = Draw(seed)
    weight, of_e = r.choice([1, 2, 4]), r.choice([1, 2, 3])
    options = [replace(each, wtpl=weight, wtmn=weight, ewt=each.ewt - 1 + of_e) for each in file.par.options]
    return replace(file, par=replace(file.par, options=tuple(options)))


@pytest.mark.parametrize(("states", "spins"), FILES[:5])
def test_weights_by_a_half_turn(states, spins):
    count = 1 if states * spins > 1 else 3
    assert sum(_compare(_with_half_turn(file_of_states(seed, states, spins), seed)) for seed in range(count)) > 5


@pytest.mark.parametrize(("pairs", "spins"), [(1, 0), (1, 1)])
def test_weights_of_e_species(pairs, spins):
    assert _compare(_with_e(file_of_l(3, pairs, spins), 3)) > 20


@pytest.mark.slow
@pytest.mark.parametrize(("states", "spins"), FILES)
def test_weights_by_a_half_turn_of_more_files(states, spins):
    assert sum(_compare(_with_half_turn(file_of_states(seed, states, spins), seed)) for seed in range(20)) > 50


@pytest.mark.slow
@pytest.mark.parametrize(("pairs", "spins"), [(1, 0), (2, 0), (1, 1), (1, 2)])
def test_weights_of_e_species_of_more_files(pairs, spins):
    assert sum(_compare(_with_e(file_of_l(seed, pairs, spins), seed)) for seed in range(12)) > 500
