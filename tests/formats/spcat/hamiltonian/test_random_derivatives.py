"""Derivatives of labelled levels in fits of SPFIT's files, of random files, against full matrices: ∂E/∂p = ⟨ψ|∂H/∂p|ψ⟩ and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from full_matrix_l_doubled import l_doubled_solution
from random_spcat import RandomFile, file_of_l, file_of_states, with_value

from rotor.formats.spcat.fits.fit_states import FileLevels
from rotor.formats.spcat.predict import predict

CLOSE = 1e-6  # of the largest energy: of closer levels round-off mixes the functions
FILES = [(1, 1, False), (2, 0, False), (2, 1, False), (3, 0, False), (2, 2, False), (1, 2, True), (2, 1, True)]
PAIRS = [(1, 0), (2, 0), (1, 1), (1, 2)]  # l-doubled pairs, spins


def _slopes(file: RandomFile, f2: int) -> tuple[np.ndarray, np.ndarray]:
    """Energies of one F and their derivatives (levels, parameter lines)."""
    _, vectors, energy = l_doubled_solution(file.case, f2)
    columns = []
    for parameter in file.par.parameters:
        alone = replace(file, par=replace(file.par, parameters=(replace(parameter, value=1.0),)))
        _, functions, values = l_doubled_solution(alone.case, f2)
        columns.append((np.abs(functions.conj().T @ vectors) ** 2 * values[:, None]).sum(axis=0))
    return energy, np.array(columns).T


def _labelled(file: RandomFile, highest_f: int) -> tuple[np.ndarray, np.ndarray]:
    """Labels of the levels up to an F as the files list them, and F doubled."""
    quanta, spins = predict(file.par, file.intensities).levels.quanta.astype(int), file.case.states[0].spins2
    quanta = quanta[:, quanta[0] > -100]
    f = quanta[:, -1 if spins else 0]
    return quanta[f <= highest_f], (2 * f - sum(spins) % 2)[f <= highest_f]


def _compare(file: RandomFile, highest_f: int = 2) -> int:
    """How many derivatives were compared."""
    labels, twice_f = _labelled(file, highest_f)
    model = FileLevels.from_labels(file.par, labels)
    energies, slopes = model.levels(np.array([p.value for p in file.par.parameters]))
    full = {f2: _slopes(file, f2) for f2 in set(twice_f.tolist())}
    size, count = max(np.abs(energy).max() for energy, _ in full.values()), 0
    for f2, ours, of_ours in zip(twice_f.tolist(), energies, slopes, strict=True):
        energy, expected = full[f2]
        at = np.abs(energy - ours).argmin()
        assert abs(energy[at] - ours) < 1e-12 * size, file.text
        gap = np.sort(np.abs(energy - energy[at]))[1] if len(energy) > 1 else size
        if gap > CLOSE * size:
            off = np.abs(of_ours - expected[at]) / (np.abs(expected).max(axis=0) + 1e-9)
            assert off.max() < 1e-9 + 1e-12 * size / gap, (file.text, f2, of_ours, expected[at])
            count += len(off)
    return count


@pytest.mark.parametrize(("states", "spins", "limits"), FILES[:4])
def test_derivatives_of_random_files(states, spins, limits):
    assert _compare(file_of_states(1, states, spins, limits)) > 50


@pytest.mark.parametrize(("pairs", "spins"), PAIRS[:3])
def test_derivatives_of_l_doubled_states(pairs, spins):
    assert _compare(file_of_l(1, pairs, spins)) > 20


@pytest.mark.parametrize("file", [file_of_states(2, 2, 1), file_of_l(2, 1, 0)], ids=["two states", "l-doubled"])
def test_these_derivatives_are_finite_differences(file):
    f2 = 4 - sum(file.case.states[0].spins2) % 2
    energy, slopes = _slopes(file, f2)
    apart = np.minimum(np.diff(energy, prepend=-np.inf), np.diff(energy, append=np.inf)) > CLOSE * np.abs(energy).max()
    for i, parameter in enumerate(file.par.parameters):
        step = 1e-3 / np.abs(slopes[:, i]).max(initial=1.0)
        above, below = (
            l_doubled_solution(with_value(file, i, parameter.value + sign * step).case, f2)[2] for sign in (1, -1)
        )
        difference = (above - below) / (2 * step)
        # of energies of 1e5 MHz, to 1e-10 of them, by steps of 1e-3 MHz
        np.testing.assert_allclose(
            difference[apart], slopes[apart, i], rtol=0, atol=2e-6 * np.abs(slopes[:, i]).max(initial=1.0)
        )


@pytest.mark.slow
@pytest.mark.parametrize(("states", "spins", "limits"), FILES)
def test_derivatives_of_more_files(states, spins, limits):
    assert sum(_compare(file_of_states(seed, states, spins, limits)) for seed in range(12)) > 500


@pytest.mark.slow
@pytest.mark.parametrize(("pairs", "spins"), PAIRS)
def test_derivatives_of_more_l_doubled_states(pairs, spins):
    assert sum(_compare(file_of_l(seed, pairs, spins)) for seed in range(12)) > 500
