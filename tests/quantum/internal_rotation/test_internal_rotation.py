"""Internal rotation of one top: levels of BELGI, full matrices written out here, limits, lines."""

import math
from importlib import import_module

import numpy as np
import pytest
from linear_functions import energies_of
from places import ORACLES

import rotor
from rotor.formats.internal_rotation.belgi import read_belgi_levels
from rotor.quantum.internal_rotation.labels import counted_ka_kc
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.torsion import torsional_states
from rotor.tops.internal_rotation import InternalRotationConstants, is_torsional

CM = rotor.units.MHZ_PER_CM
BELGI = {
    "A": 0.100069228559446,
    "B": 5.003461427972281e-2,
    "C": 3.335640951981520e-2,
    "F": 5.1,
}  # cm-1, of the listing's head
ACETALDEHYDE = {
    "A": 1.8848813,
    "B": 0.3487065,
    "C": 0.303184,
    "Dab": 0.122669,
    "F": 7.567082,
    "V3": 407.59768,
}  # A&A 579, A46
EPS = np.finfo(float).eps


def model(constants_cm, **others):
    values = {name: value * CM for name, value in constants_cm.items()}
    return RamModel(values | others)


def solved(ram, sigma, jmax, vt_max=3, **settings):
    return ram.blocks(sigma, jmax, **settings).solve(ram.coefficients, vt_max)


# BELGI


def compare_with_belgi(barrier, reference):
    """Levels (σ, J, v_t, K, cm-1): energies one to one under BELGI's rule for K."""
    ram = model(BELGI | {"V3": barrier}, rho=0.05)
    for sigma in (0, 1):
        ours = solved(ram, sigma, 6)
        quanta = ours.quanta
        k = counted_ka_kc(quanta["j"], quanta["vt"], ours.energies)[0] if sigma == 0 else quanta["k"]
        names = list(zip(quanta["j"].tolist(), quanta["vt"].tolist(), k.tolist(), strict=True))
        for j, vt, number in {row[1:4] for row in reference if row[0] == sigma}:
            expected = np.sort([row[4] for row in reference if row[:4] == (sigma, j, vt, number)]) * CM
            found = np.sort([e for name, e in zip(names, ours.energies, strict=True) if name == (j, vt, number)])
            assert len(found) == len(expected)  # pairs ±K of A, one level of E
            assert np.abs(found - expected).max() < 1e-5  # 0.01 kHz; BELGI prints 1e-10 cm-1 = 0.003 kHz


def test_levels_of_belgi_with_their_names():
    rows = (ORACLES / "belgi_v200.txt").read_text().splitlines()[1:]
    reference = [(*map(int, row.split()[:4]), float(row.split()[4])) for row in rows]
    assert len(reference) == 128
    compare_with_belgi(200.0, reference)


@pytest.mark.oracle
@pytest.mark.parametrize("barrier", [20, 200])
def test_every_level_of_belgi(shared, barrier):
    listed = read_belgi_levels(shared / "reference" / "internal_rotation" / "belgi" / f"v{barrier}.txt")
    reference = list(
        zip(*(listed.columns[name].tolist() for name in ("species", "j", "vt", "k", "energy_cm")), strict=True)
    )
    assert len(reference) == 392
    compare_with_belgi(float(barrier), reference)


# Full matrices of |K⟩|m⟩, written without the package


def direct_matrix(constants, j, sigma, waves=10):
    """H over |J K⟩|m⟩ of one J, with every kind of term, MHz."""
    c = dict.fromkeys(("Dab", "Dbc", "Dac", "V3", "V6", "FJ", "rhoK", "V3K", "D3ac", "DeltaK"), 0.0) | constants
    k = np.arange(-j, j + 1.0)
    raising = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1)), -1)
    pa, pb, pc = np.diag(k), (raising + raising.T) / 2, 0.5j * (raising - raising.T)
    m = 3.0 * np.arange(-waves, waves + 1) + sigma
    size = len(m)
    p, one, unit = np.diag(m), np.eye(size), np.eye(2 * j + 1)
    cos3 = (np.eye(size, k=1) + np.eye(size, k=-1)) / 2
    cos6 = (np.eye(size, k=2) + np.eye(size, k=-2)) / 2
    sin3 = (np.eye(size, k=-1) - np.eye(size, k=1)) / 2j  # exp(3iα) raises m, to the row below

    def both(u, v):
        return u @ v + v @ u

    slip = np.kron(unit, p) - c["rho"] * np.kron(pa, one)
    rotation = c["A"] * pa @ pa + c["B"] * pb @ pb + c["C"] * pc @ pc - c["DeltaK"] * pa @ pa @ pa @ pa
    rotation = rotation + c["Dab"] * both(pa, pb) + c["Dbc"] * both(pb, pc) + c["Dac"] * both(pa, pc)
    total = np.kron(rotation, one) + c["F"] * slip @ slip
    total = total + np.kron(unit, c["V3"] / 2 * (one - cos3) + c["V6"] / 2 * (one - cos6))
    total = total + c["FJ"] * j * (j + 1) * np.kron(unit, p @ p) + c["rhoK"] * np.kron(pa @ pa @ pa, p)
    return total + c["V3K"] * np.kron(pa @ pa, one - cos3) + c["D3ac"] * np.kron(both(pa, pc) / 2, sin3)


CASES = {
    "a plane of symmetry": {},
    "higher terms": {"V6": -11.6, "FJ": -3e-3, "rhoK": 2e-3, "V3K": 0.02, "D3ac": 0.014, "DeltaK": 1e-3},
    "no plane of symmetry": {"Dbc": 0.03, "Dac": -0.05},
}


@pytest.mark.parametrize("sigma", [0, 1])
@pytest.mark.parametrize("case", CASES)
def test_all_torsional_functions_give_the_levels_of_the_direct_product(case, sigma):
    constants = {name: value * CM for name, value in (ACETALDEHYDE | CASES[case]).items()} | {"rho": 0.3286}
    ram = RamModel(constants)
    blocks = ram.blocks(sigma, 4, count=21)
    energies = energies_of(blocks.linear, blocks.elements.count, ram.coefficients)
    for j in range(5):
        expected = np.linalg.eigvalsh(direct_matrix(constants, j, sigma))
        found = np.sort(energies[blocks.functions.labels["J"] == j])
        assert (
            np.abs(found - expected).max() < 64 * EPS * expected.max()
        )  # rounding of two matrices with elements up to 2e8 MHz


def test_contraction_to_nine_functions_is_one_hertz_at_j_25():
    ram = model(ACETALDEHYDE, rho=0.3286)
    for sigma in (0, 1):
        nine = solved(ram, sigma, 25, 0, jmin=25)
        whole = np.linalg.eigvalsh(direct_matrix(dict(ram.values), 25, sigma))
        assert len(nine.energies) == 51
        nearest = np.abs(nine.energies[:, None] - whole).min(axis=1)  # v_t = 0 at K = 25 lies among v_t = 2
        assert nearest.max() < 1e-6 + 64 * EPS * 2e8


# Limits


@pytest.mark.parametrize("sigma", [0, 1])
def test_without_a_barrier_the_top_turns_freely(sigma):
    ram = RamModel({"A": 9000.0, "B": 4000.0, "C": 4000.0 - 1e-9, "F": 160e3, "rho": 0.1, "V3": 0.0})
    levels = solved(ram, sigma, 3, 1)
    k = np.arange(-3, 4)
    free = np.sort(
        (5000.0 * k**2 + 4000.0 * 12)[:, None] + 160e3 * (3 * np.arange(-3, 4) + sigma - 0.1 * k[:, None]) ** 2, None
    )
    found = np.sort(levels.energies[levels.quanta["j"] == 3])
    assert np.abs(found - free[: len(found)]).max() < 1e-6  # C - B apart, rounding of 1e7 MHz


def test_behind_a_high_barrier_a_symmetric_top_is_rigid():
    rigid = rotor.api.solve_levels(rotor.Top.from_constants("A=9000 B=4000 MHz"), 4)
    ram = RamModel({"A": 9000.0, "B": 4000.0, "C": 4000.0, "F": 160e3, "rho": 0.1, "V3": 160e3 * 600})
    for sigma in (0, 1):
        levels = solved(ram, sigma, 4, 0, count=7, waves=18)
        origin = levels.energies[levels.quanta["j"] == 0][0]
        for j in range(1, 5):
            found = np.sort(levels.energies[levels.quanta["j"] == j]) - origin
            expected = np.sort(
                np.repeat(rigid.energy_mhz, rigid.components)[np.repeat(rigid.quanta["j"] == j, rigid.components)]
            )
            assert np.abs(found - expected).max() < 1e-5


def test_an_asymmetric_top_becomes_rigid_as_the_root_of_the_barrier():
    """⟨K±2|K⟩ overlaps of the torsion differ from 1 by terms of order ρ² √(F/V3): the slope is -1/2."""
    constants = {"A": 9000.0, "B": 5000.0, "C": 3000.0}
    rigid = rotor.api.solve_levels(rotor.Top.from_constants(constants), 3)
    barriers, errors = [1e3, 4e3, 16e3], []
    for ratio in barriers:
        levels = solved(RamModel(constants | {"F": 160e3, "rho": 0.1, "V3": 160e3 * ratio}), 0, 3, 0, count=7, waves=24)
        found = np.sort(levels.energies[levels.quanta["j"] == 3]) - levels.energies[levels.quanta["j"] == 0][0]
        errors.append(np.abs(found - np.sort(rigid.energy_mhz[rigid.quanta["j"] == 3])).max())
    slopes = np.diff(np.log(errors)) / np.diff(np.log(barriers))
    assert slopes == pytest.approx(-0.5, abs=0.03)  # the next order falls as 1/V3


def test_one_angle_against_a_grid():
    energies, vectors = (
        result[1, ..., :4] for result in torsional_states(7.0, {3: 3.0, 6: 5.0}, np.array([0.0, 0.3]), 1, 20)
    )
    angle = np.linspace(0, 2 * np.pi, 512, endpoint=False)
    waves = np.exp(1j * np.outer(angle, 3 * np.arange(-20, 21) + 1)) / np.sqrt(2 * np.pi) @ vectors
    step = 2 * np.pi / 512
    numbers = np.fft.fftfreq(512, 1 / 512)
    kinetic = np.fft.ifft(7.0 * (numbers[:, None] - 0.3) ** 2 * np.fft.fft(waves, axis=0), axis=0)
    applied = kinetic + (4.0 - 1.5 * np.cos(3 * angle) - 2.5 * np.cos(6 * angle))[:, None] * waves
    assert np.allclose(
        waves.conj().T @ waves * step, np.eye(4), atol=1e-12
    )  # a trapezoidal sum of periodic functions is exact
    assert np.allclose(waves.conj().T @ applied * step, np.diag(energies), atol=1e-10)


# Levels and lines of a top


def acetaldehyde(**settings):
    values = {name: f"{ACETALDEHYDE[name]} cm-1" for name in ("F", "V3", "Dab")} | {"rho": 0.328632673}
    constants = rotor.Constants(**{name: ACETALDEHYDE[name] * CM for name in "ABC"}, reduction="A", representation="Ir")
    internal = InternalRotationConstants(values, "RAM", **settings)
    return rotor.Top.from_constants(constants, dipole_abc_debye=(2.55, 0.87, 0.0), internal_rotation=internal)


def test_levels_of_a_top_have_species_and_torsional_states():
    levels = rotor.api.solve_levels(acetaldehyde(), 4)
    assert levels.quanta_names == ("species", "vt", "j", "ka", "kc")
    assert len(levels) == 2 * 2 * 25  # every (J, Ka, Kc) once in A and E, v_t = 0 and 1
    assert len({tuple(row) for row in zip(*levels.quanta.values(), strict=True)}) == len(levels)
    row = levels.find(species="E", vt=0, j=1, ka=0, kc=1)
    assert levels.degeneracy[row] == 3
    assert levels.components[row] == 2


def test_strengths_obey_the_sum_rule_over_all_torsional_states():
    """Σ S over the lines of a level is (2J + 1) μ² times its components, with all torsional functions kept."""
    top = acetaldehyde(vt_max=18, functions=20)
    levels = rotor.api.solve_levels(top, 3)
    lines = rotor.api.line_list(top, jmax=3, min_lgint=None, q=1.0)
    total = np.zeros(len(levels))
    np.add.at(total, lines.upper, lines.strength_debye2)
    np.add.at(total, lines.lower, lines.strength_debye2)
    within = levels.quanta["j"] < 3
    low = within & (levels.quanta["vt"] < 6)
    same_level = levels.states * 0.0  # ⟨μ⟩² of a level with itself makes no line
    for block in levels.blocks:
        from rotor.quantum.operators.tensors import body_tensor

        tensors = {(0, 0): body_tensor((2.55, 0.87, 0.0), 1, "Ir")}
        if block.moments.connect(block, block, tensors):
            squares = block.components * np.abs(np.diag(block.moments.reduced(block, block, tensors))) ** 2
            same_level[block.start : block.start + len(block.energies_mhz)] = squares
    expected = levels.states * (2.55**2 + 0.87**2)
    assert np.allclose(
        (total + same_level)[low], expected[low], rtol=1e-6
    )  # the 21st function, and states beyond v_t = 18


def test_lines_of_both_species_come_close_behind_a_high_barrier():
    lines = rotor.api.line_list(acetaldehyde(), jmax=2, q=1.0, min_lgint=None)
    upper, lower = (lines.levels.quanta_columns(rows, "") for rows in (lines.upper, lines.lower))
    same = (upper["vt_"] == 0) & (lower["vt_"] == 0) & (upper["j_"] == 1) & (lower["j_"] == 0) & (upper["ka_"] == 0)
    frequencies = dict(zip(upper["species_"][same].tolist(), lines.frequency_mhz[same].tolist(), strict=True))
    assert set(frequencies) == {"A", "E"}
    assert 1.0 < abs(frequencies["A"] - frequencies["E"]) < 50.0  # 1(0,1) - 0(0,0), measured 19265.1 and 19262.1 MHz


def test_partition_function_counts_torsional_states():
    cold = rotor.api.partition_function(acetaldehyde(), 5.0)
    rigid = rotor.api.partition_function(rotor.Top.from_constants("A=56.5 B=10.46 C=9.1 GHz"), 5.0)
    assert cold.q == pytest.approx(
        2 * rigid.q, rel=0.06
    )  # A and E weigh alike, E lies 2 GHz above A, the axes are others


@pytest.mark.parametrize("temperature_k", [9.375, pytest.param(100.0, marks=pytest.mark.slow)])
def test_functions_far_above_kt_do_not_count_for_the_partition_function(temperature_k, monkeypatch):
    top = acetaldehyde()
    quick = rotor.api.partition_function(top, temperature_k).q
    monkeypatch.setattr(import_module("rotor.thermodynamics.sums.level_sums"), "HIGHEST_KT_OF_TORSION", math.inf)
    assert quick == pytest.approx(rotor.api.partition_function(top, temperature_k).q, rel=1e-8)  # asked for is 1e-6


@pytest.mark.parametrize("sigma", [0, 1])
def test_terms_that_are_summed_first_give_the_same_levels_and_slopes(sigma):
    ram = model({name: ACETALDEHYDE[name] for name in ACETALDEHYDE}, rho=0.328632673, V3J=17.0, FK=-29.0)
    blocks = ram.blocks(sigma, 6)
    apart, once = blocks.solve(ram.coefficients, 1), blocks.solve_once(ram.coefficients, 1)
    order = [np.lexsort([found.quanta[name] for name in ("kc", "ka", "vt", "j")]) for found in (apart, once)]
    assert np.abs(apart.energies[order[0]] - once.energies[order[1]]).max() < 1e-6  # MHz; rounding of 4e7
    slopes = apart.slopes()[order[0]], once.slopes()[order[1]]
    assert np.allclose(*slopes, rtol=1e-9, atol=1e-9 * np.abs(slopes[0]).max())


def test_wrong_constants_are_refused():
    with pytest.raises(ValueError, match="not stated"):
        InternalRotationConstants({"F": 1.0, "rho": 0.1, "V3": 1.0}, "")
    with pytest.raises(ValueError, match="no constant of an internal rotor"):
        InternalRotationConstants({"F": 1.0, "rho": 0.1, "V3": 1.0, "DeltaJ": 1.0}, "RAM")
    with pytest.raises(ValueError, match="rho missing"):
        InternalRotationConstants({"F": 1.0, "V3": 1.0}, "RAM")
    with pytest.raises(ValueError, match="at least v_t"):
        InternalRotationConstants({"F": 1.0, "rho": 0.1, "V3": 1.0}, "RAM", vt_max=9)
    assert not is_torsional("J4Jz2Jpm6")
    top = acetaldehyde()
    text = "E[1]=9 A[1]=9 B[1]=4 C[1]=3 GHz"
    states = rotor.Top.from_constants("A=9 B=4 C=3 GHz", states=text)
    both = (*rotor.api.effects_of(top, False), *rotor.api.effects_of(states, False)[2:])
    with pytest.raises(ValueError, match="not computed together"):
        rotor.api.solve_levels(top, 2, effects=both)
