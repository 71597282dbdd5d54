"""Random SPCAT files with spins and several moments against full matrices that share no code with the package but the readers of lines.

Amplitudes of all moments of a line add, so that a moment with a wrong sign in one order of N shows only beside another one, and with spins.
"""

from __future__ import annotations

import random

import numpy as np
import pytest
from full_matrix_codes import case_of
from full_matrix_levels import Block, amplitudes, solve, vector_elements

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par
from rotor.spectra.transitions import all_transitions

COUNT_OF_F = 3  # the lowest F, whole or half
SPINS = ("2", "3", "4", "32", "22", "33")  # SPIND
RIGID = "10000 9400.0 1\n20000 3100.0 1\n30000 2500.0 1\n"
ANY_SPIN = (10010000, 10020000, 10030000, 10610000, 10000000, 10000100, 10001000, 1100, 41000, 2000)
QUADRUPOLE = (110010000, 110040000, 110610000)
TWO_SPINS = (120000000, 120010000, 120040000, 120610000)
MOMENTS = (0, 3, 4, 5, 9, 10)  # TYP of vectors with powers of N² and Nz²


def _random_file(seed: int):
    """Parameters, dipole lines as (TYP, axis, value), and both texts."""
    r = random.Random(seed)
    oblate, spind = r.random() < 0.4, r.choice(SPINS)
    codes = list(ANY_SPIN)
    if spind[-1] != "2":
        codes += QUADRUPOLE
    if len(spind) > 1:
        codes += TWO_SPINS
    chosen = r.sample(codes, r.randint(2, 5))
    moments = [(0, r.randint(1, 3), 1.0)]
    moments += [(r.choice(MOMENTS), r.randint(1, 3), round(r.uniform(-0.3, 0.3), 3)) for _ in range(r.randint(1, 3))]
    values = "".join(f"{code} {r.choice([-1, 1]) * (round(r.uniform(5.0, 300.0), 1))!r} 1\n" for code in chosen)
    option = f"a {spind} {-1 if oblate else 1} 0 20 0 1 1 1 0 0 0"
    par = f"random {seed}\n{3 + len(chosen)} 1 1 0 0 1e6 1 1\n{option}\n{RIGID}{values}"
    lines = "".join(f"{100_000 * (t // 10) + 10_000 * (t % 10) + axis} {value}\n" for t, axis, value in moments)
    request = "random\n0 41 1000 0 4 -30 -30 9999 300\n"
    return par, request, lines, moments


def _powers(typ: int, bra: int, ket: int, k_bra: np.ndarray, k_ket: np.ndarray) -> np.ndarray:
    """Elements of a TYP over those of the cosine: ½{N², }, ½{Nz², }, ½[N², ], ½{N⁴, }, ¼[N², [N², ]]."""
    up, low = bra * (bra + 1.0), ket * (ket + 1.0)
    unit = np.ones((len(k_bra), len(k_ket)))
    if typ == 4:
        return (k_bra[:, None] ** 2.0 + k_ket**2.0) / 2
    return unit * {0: 1.0, 3: (up + low) / 2, 5: (up - low) / 2, 9: (up**2 + low**2) / 2, 10: (up - low) ** 2 / 4}[typ]


def _amplitudes(case, moments, upper: Block, lower: Block) -> np.ndarray:
    """⟨F'||M||F⟩ between all levels of two F."""

    def elements(bra, ket):
        ks, others = np.array(bra.ks), np.array(ket.ks)
        return sum(
            value * vector_elements(case, bra, ket, np.eye(3)[axis - 1]) * _powers(typ, bra.n, ket.n, ks, others)
            for typ, axis, value in moments
        )

    return amplitudes(case, upper, lower, elements)


def _compare(seed: int) -> int:
    """How many lines of a file were compared; AssertionError where one differs."""
    par_text, request, dipole_lines, moments = _random_file(seed)
    par, intensities = read_par(par_text.encode()), read_int((request + dipole_lines).encode())
    case = case_of(par, read_int((request + "1 1.0\n").encode()))
    (group,) = connected_groups(par, intensities)
    half = sum(case.states[0].spins2) % 2
    all_f2 = range(half, half + 2 * COUNT_OF_F, 2)
    levels = group.levels((all_f2[0], all_f2[-1]))
    blocks = {f2: solve(case, f2) for f2 in all_f2}
    where: dict[int, tuple[int, int]] = {}
    for f2, block in blocks.items():
        ours = np.flatnonzero(levels.multiplicity == f2 + 1)
        ours, full = ours[np.argsort(levels.energy_mhz[ours])], np.argsort(block.energy_mhz)
        size = np.abs(block.energy_mhz).max()
        np.testing.assert_allclose(levels.energy_mhz[ours], block.energy_mhz[full], rtol=0, atol=1e-13 * size + 1e-9)
        energy = block.energy_mhz[full]
        apart = np.minimum(np.diff(energy, prepend=-np.inf), np.diff(energy, append=np.inf)) > 1e-2
        where |= {int(a): (f2, int(b)) for a, b, alone in zip(ours, full, apart, strict=True) if alone}
    lines = all_transitions(levels, dict(group.effect.moments), moments=group.effect.others)
    between = {
        (f, g): _amplitudes(case, moments, blocks[f], blocks[g]) for f in all_f2 for g in all_f2 if abs(f - g) <= 2
    }
    largest, count = max(float(np.abs(a).max()) for a in between.values()) ** 2, 0
    for up, low, strength in zip(lines.upper.tolist(), lines.lower.tolist(), lines.strength_debye2, strict=True):
        if up not in where or low not in where:
            continue
        (f, i), (g, j) = where[up], where[low]
        # from the higher F to the lower; with one F either order, as [N², φ] is not Hermitian
        ways = [abs(between[g, f][j, i]) ** 2] if f > g else [abs(between[f, g][i, j]) ** 2]
        ways += [abs(between[g, f][j, i]) ** 2] if f == g else []
        off = min(abs(strength - expected) for expected in ways)
        assert off <= 1e-9 * largest + 1e-9 * strength, (seed, f, g, strength, ways)
        count += 1
    return count


@pytest.mark.parametrize("first", range(0, 40, 10))
def test_levels_and_strengths_are_those_of_full_matrices(first):
    assert sum(_compare(seed) for seed in range(first, first + 10)) > 1000


@pytest.mark.slow
@pytest.mark.parametrize("first", range(40, 440, 40))
def test_levels_and_strengths_of_more_files(first):
    assert sum(_compare(seed) for seed in range(first, first + 40)) > 4000
