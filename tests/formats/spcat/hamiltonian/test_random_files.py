"""Random SPCAT files with spins and several moments against full matrices that share no code with the package but the readers of lines.

Amplitudes of all moments of a line add, so that a moment with a wrong sign in one order of N shows only beside another one, and with spins.

Files of one state have one or two spins, those of two states none or one. Not covered: three states and more, two spins with two states,
l-doubled states, series, weights, moments between states, and the names of levels.
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
DISTORTION = (200, 1100, 2000, 40100, 41000, 300, 50000)
# W, F and G of Fermi and Coriolis interactions with powers of N² and Nz², and with a spin
COUPLINGS = (0, 40000, 200000, 400000, 600000, 210000, 410000, 610000)
HIGHER_COUPLINGS = (100, 1000, 41000, 200100, 401000, 610100)
SPIN_COUPLINGS = (10000000, 10010000, 10040000, 10610000, 10210000, 10200000, 10400000, 10600000, 1000000)


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
    values = "".join(f"{code} {_value(r, 5.0, 300.0)!r} 1\n" for code in chosen)
    option = f"a {spind} {-1 if oblate else 1} 0 20 0 1 1 1 0 0 0"
    return f"random {seed}\n{3 + len(chosen)} 1 1 0 0 1e6 1 1\n{option}\n{RIGID}{values}", *_moments(r, (0,))


def _file_of_two_states(seed: int):
    """The same for two states with constants of their own, of all states or of one, and interactions between them."""
    r = random.Random(seed)
    oblate, spind = r.random() < 0.4, r.choice(("1", "2", "3", "4"))
    lines = [(11, r.uniform(-3e4, 3e4))]
    for state in (0, 11):
        lines += [
            (code + state, size * r.uniform(0.97, 1.03))
            for code, size in ((10000, 9400.0), (20000, 3100.0), (30000, 2500.0))
        ]
        lines += [(code + state, r.uniform(-0.05, 0.05)) for code in r.sample(DISTORTION, r.randint(0, 3))]
    between = (1, 10)  # the states in either order
    lines += [(code + r.choice(between), _value(r, 1.0, 500.0)) for code in r.sample(COUPLINGS, r.randint(1, 3))]
    lines += [(code + r.choice(between), _value(r, 0.1, 5.0)) for code in r.sample(HIGHER_COUPLINGS, r.randint(0, 2))]
    if spind != "1":
        lines += [
            (code + r.choice((0, 11, 99)), _value(r, 5.0, 100.0)) for code in r.sample(ANY_SPIN[:8], r.randint(1, 3))
        ]
        lines += [
            (code + r.choice(between), _value(r, 5.0, 100.0)) for code in r.sample(SPIN_COUPLINGS, r.randint(0, 2))
        ]
    if spind not in ("1", "2"):
        lines += [
            (code + r.choice((0, 11, 99, 1)), _value(r, 5.0, 100.0)) for code in r.sample(QUADRUPOLE, r.randint(1, 2))
        ]
    option = f"a {spind} {-2 if oblate else 2} 0 20 0 1 1 1 0 0 0"
    values = "".join(f"{code} {value!r} 1\n" for code, value in lines)
    return f"random {seed}\n{len(lines)} 1 1 0 0 1e6 1 1\n{option}\n{values}", *_moments(r, (0, 110))


def _value(r: random.Random, least: float, most: float) -> float:
    """A value of either sign."""
    return r.choice([-1, 1]) * round(r.uniform(least, most), 1)


def _moments(r: random.Random, states):
    """The request of the .int file, and dipole lines, the same in each state, as text and as (TYP, axis, value)."""
    moments = [(0, r.randint(1, 3), 1.0)]
    moments += [(r.choice(MOMENTS), r.randint(1, 3), round(r.uniform(-0.3, 0.3), 3)) for _ in range(r.randint(1, 3))]
    codes = [(100_000 * (t // 10) + 10_000 * (t % 10) + axis, value) for t, axis, value in moments]
    lines = "".join(f"{code + state} {value}\n" for state in states for code, value in codes)
    return "random\n0 41 1000 0 4 -30 -30 9999 300\n", lines, moments


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
        if bra.v != ket.v:
            return np.zeros((1, 1))
        ks, others = np.array(bra.ks), np.array(ket.ks)
        return sum(
            value * vector_elements(case, bra, ket, np.eye(3)[axis - 1]) * _powers(typ, bra.n, ket.n, ks, others)
            for typ, axis, value in moments
        )

    return amplitudes(case, upper, lower, elements)


def _compare(file) -> int:
    """How many lines of a file were compared; AssertionError where a level or a line differs."""
    par_text, request, dipole_lines, moments = file
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
        np.testing.assert_allclose(levels.energy_mhz[ours], block.energy_mhz[full], rtol=0, atol=1e-13 * size)
        energy = block.energy_mhz[full]
        # round-off of 1e-15 of the largest energy mixes closer levels by more than 1e-9
        apart = np.minimum(np.diff(energy, prepend=-np.inf), np.diff(energy, append=np.inf)) > 1e-6 * size
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
        assert off <= 1e-9 * largest + 1e-9 * strength, (par_text, f, g, strength, ways)
        count += 1
    return count


@pytest.mark.parametrize("first", range(0, 40, 10))
def test_levels_and_strengths_are_those_of_full_matrices(first):
    assert sum(_compare(_random_file(seed)) for seed in range(first, first + 10)) > 1000


@pytest.mark.parametrize("first", range(0, 30, 10))
def test_levels_and_strengths_of_two_coupled_states_are_those_of_full_matrices(first):
    assert sum(_compare(_file_of_two_states(seed)) for seed in range(first, first + 10)) > 1000


@pytest.mark.slow
@pytest.mark.parametrize("first", range(40, 440, 40))
@pytest.mark.parametrize("file", [_random_file, _file_of_two_states])
def test_levels_and_strengths_of_more_files(file, first):
    assert sum(_compare(file(seed)) for seed in range(first, first + 40)) > 4000
