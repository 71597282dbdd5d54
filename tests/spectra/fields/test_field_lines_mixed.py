"""Lines in a field of states with spins and of states of mixed M: full matrices, catalogues, sum rules, bad input."""

from __future__ import annotations

import functools
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from direct_product import on_spins
from field_matrices import contracted_vectors, rigid, rotation_function, states
from spin_field_matrices import CHI, DIPOLE, LARGEST, full_matrix, space_cosines, states_up_to

from rotor.quantum.effects.spin_effect import quadrupole_of_tensor
from rotor.quantum.effects.stark import MHZ_ANGSTROM3_W_PER_CM2
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.spins import Spin
from rotor.spectra.fields.light import light_components
from rotor.spectra.fields.lines import field_lines
from rotor.spectra.lines import line_list
from rotor.thermodynamics.gas.field_mixture import field_mixture
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM

SKEW = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=tuple(DIPOLE)).with_polarizability(
    np.diag([5.0, 3.5, 2.0]), ""
)
ROD = Top.from_constants("B=6000 MHz", dipole_abc_debye=(2.0, 0, 0))
PROLATE = Top.from_constants("A=20000 B=6000 MHz", dipole_abc_debye=(1.5, 0, 0))
LIGHTS = {"parallel": "z", "perpendicular": "x"}


def with_nucleus(twice_i: int, chi) -> tuple:
    return (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", twice_i), chi))


@functools.cache
def dipole_with_spin(twice_i: int, axis: str, dipole: tuple[float, ...]) -> np.ndarray:
    """μ along a space axis over all |N k m⟩|m_I⟩, N ≤ 3."""
    wide, phi = states_up_to(LARGEST + 1), space_cosines(LARGEST + 1)
    held = np.ix_(*[[i for i, state in enumerate(wide) if state[0] <= LARGEST]] * 2)
    return on_spins(sum(dipole[k] * phi[axis, "abc"[k]] for k in range(3))[held], (twice_i,), {})


def assert_strengths(computed, energies, squares, close_mhz: float, mixed_debye2: float = 0.0) -> None:
    """Every line has the squares of all pairs of states of the full matrix at its two energies, to 1e-9 of the strongest.

    mixed_debye2: what round-off may do besides to states of different M that nearly coincide in the full matrix.
    """
    assert len(computed) > 10
    worst = 0.0
    for line in range(len(computed)):
        high = np.abs(energies - computed.lower_mhz[line] - computed.frequency_mhz[line]) < close_mhz
        low = np.abs(energies - computed.lower_mhz[line]) < close_mhz
        assert high.any()
        assert low.any()
        expected = squares[np.ix_(high, low)].sum()
        worst = max(worst, abs(computed.strength_debye2[line] - expected))
    assert worst < 1e-9 * squares.max() + mixed_debye2


@pytest.mark.slow
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize(
    ("constants", "dipole", "chi", "twice_i"),
    [
        ((10000.0, 6000.0, 4000.0), tuple(DIPOLE), CHI, 2),
        ((10000.0, 6000.0, 4000.0), tuple(DIPOLE), CHI, 3),
        ((20000.0, 6000.0, 6000.0), (1.5, 0.0, 0.0), np.diag([-10.0, 5.0, 5.0]), 2),
    ],
)
def test_strengths_with_a_quadrupole_nucleus_are_those_of_the_full_matrix(constants, dipole, chi, twice_i, light):
    """Whole and half M_F (of which -½ and ½ are connected), K and -K, three dipole components; 1 kV/cm."""
    text = (
        "A={} B={} C={} MHz".format(*constants) if constants[1] != constants[2] else "A={} B={} MHz".format(*constants)
    )
    top = Top.from_constants(text, dipole_abc_debye=dipole)
    lines = field_lines(
        top, [1.0], j_highest=1, light=light, effects=with_nucleus(twice_i, chi), jmax=3, tolerance_mhz=1e9
    )
    energies, vectors = np.linalg.eigh(full_matrix(constants, twice_i, chi, kv_per_cm=1.0, dipole=np.array(dipole)))
    operator = dipole_with_spin(twice_i, LIGHTS[light], dipole)
    squares = 3 * np.abs(vectors.conj().T @ operator @ vectors) ** 2
    assert_strengths(lines, energies, squares, 1e-5, 1e-8)  # D²: 1e-11 MHz of round-off over gaps of 1e-3 MHz


def full_tilted(basis, field: float, direction, intensity: float) -> np.ndarray:
    """Rigid rotor, dipole in the field, and -(2πI/c) α_ZZ = ᾱ + √(2/3) Σ D²_0q α²_q (Iʳ: x, y, z = b, c, a)."""
    alpha = np.diag(np.array(SKEW.polarizability_abc_angstrom3))[[1, 2, 0]]
    parts = {0: (2 * alpha[2] - alpha[0] - alpha[1]) / np.sqrt(6), 2: (alpha[0] - alpha[1]) / 2}
    light = alpha.mean() * np.eye(len(basis)) + np.sqrt(2 / 3) * sum(
        parts[abs(q)] * rotation_function(basis, 2, 0, q) for q in (-2, 0, 2)
    )
    stark = contracted_vectors(basis, DIPOLE[[1, 2, 0]], direction)
    h0 = rigid(basis, 6000.0, 4000.0, 10000.0)
    return h0 - MHZ_PER_DEBYE_KV_PER_CM * field * stark - MHZ_ANGSTROM3_W_PER_CM2 * intensity * light


@pytest.mark.slow
@pytest.mark.parametrize("light", [(0, 0, 1), (1, 0, 0), (0, 1, 0), (1, -2, 0.5)])
def test_strengths_of_mixed_m_are_those_of_the_full_matrix(light):
    """Three dipole components in a field along (1, 2, 2) beside a laser along Z; light of any direction."""
    basis, direction, field, intensity = states(3), np.array([1.0, 2.0, 2.0]) / 3, 8.0, 1e9
    energies, vectors = np.linalg.eigh(full_tilted(basis, field, direction, intensity))
    axis = np.array(light) / np.linalg.norm(light)
    operator = contracted_vectors(basis, DIPOLE[[1, 2, 0]], axis)
    settings = {"intensity_w_per_cm2": intensity, "direction": direction, "jmax": 3, "tolerance_mhz": 1e9}
    lines = field_lines(SKEW, [field], j_highest=1, light=light, **settings)
    assert_strengths(lines, energies, 3 * np.abs(vectors.conj().T @ operator @ vectors) ** 2, 1e-5)


def test_a_tilted_field_has_the_lines_of_the_straight_one():
    """The same molecule turned: frequencies, strengths and intensities, whatever the light, which is counted from the field."""
    for light in ("parallel", "perpendicular", 35.0, "isotropic"):
        straight = field_lines(ROD, [0.0, 20.0], j_highest=1, light=light, temperature_k=5.0)
        tilted = field_lines(ROD, [0.0, 20.0], j_highest=1, light=light, temperature_k=5.0, direction=(1, 0, 1))
        for column in ("strength_debye2", "intensity_nm2_mhz"):
            ours, theirs = (sums(lines, column) for lines in (tilted, straight))
            assert ours.keys() == theirs.keys()
            assert list(ours.values()) == pytest.approx(list(theirs.values()), rel=1e-9)  # round-off


def sums(lines, column: str) -> dict[float, float]:
    """At the last field, by frequency to 1e-4 MHz."""
    out: dict[float, float] = {}
    last = lines.field_kv_per_cm == lines.fields[-1]
    strong = last & (lines.strength_debye2 > 1e-6)
    for frequency, value in zip(lines.frequency_mhz[strong].round(4), getattr(lines, column)[strong], strict=True):
        out[frequency] = out.get(frequency, 0.0) + value
    return dict(sorted(out.items()))


@pytest.mark.parametrize("light", ["parallel", "isotropic", (1, 2, 0.5)])
@pytest.mark.parametrize("top", [ROD, PROLATE])
def test_without_field_lines_with_spins_are_the_catalogue(top, light):
    """S μ² and intensities of the hyperfine lines, all M_F of them; every polarization is the same without a field."""
    effects = with_nucleus(2, np.diag([-4.0, 2.0, 2.0]))
    lines = field_lines(
        top, [0.0], j_highest=1, light=light, temperature_k=20.0, effects=effects, jmax=3, tolerance_mhz=1e9
    )
    lines = lines.where(lines.frequency_mhz > 1e-4)  # MHz: M and M + 1 of one level of K = 1 are connected too
    free = line_list(top, jmax=1, temperature_k=20.0, min_lgint=-np.inf, effects=effects)
    assert lines.strength_debye2.sum() == pytest.approx(
        free.strength_debye2.sum(), rel=1e-9
    )  # lines below 1e-10 are cut
    assert lines.intensity_nm2_mhz.sum() == pytest.approx(free.intensity_nm2_mhz.sum(), rel=1e-6)  # Q to 1e-6
    near = np.isclose(lines.frequency_mhz, free.frequency_mhz[0], atol=1e-5)  # MHz: round-off of 1e4 MHz
    same = np.isclose(free.frequency_mhz, free.frequency_mhz[0], atol=1e-5)
    assert lines.strength_debye2[near].sum() == pytest.approx(free.strength_debye2[same].sum(), rel=1e-9)


def test_sum_rule_of_isotropic_light():
    """Σ over all states of the squares of X, Y and Z is that of μ·μ with all of J ≤ 1 and their J ± 1: a field does not change it."""
    effects = with_nucleus(2, np.diag([-4.0, 2.0, 2.0]))
    totals = []
    for field in (0.0, 0.5):
        lines = field_lines(ROD, [field], j_highest=2, light="isotropic", effects=effects, jmax=4, tolerance_mhz=1e9)
        totals.append(lines.strength_debye2.sum())
    assert totals[1] == pytest.approx(totals[0], rel=1e-3)  # what mixes with J = 3: (μE/6B)²


def test_executors_change_nothing():
    effects = with_nucleus(2, np.diag([-4.0, 2.0, 2.0]))
    with ThreadPoolExecutor(2) as pool:
        ours, spread = (
            field_lines(ROD, [0.1], j_highest=1, effects=effects, jmax=3, tolerance_mhz=1e9, executor=executor)
            for executor in (None, pool)
        )
        plain, mixed = (field_mixture(ROD, [1.0], 1.0, executor=executor) for executor in (None, pool))
    assert (ours.strength_debye2 == spread.strength_debye2).all()
    assert (plain.mu_eff_debye == mixed.mu_eff_debye).all()


def test_light_is_an_angle_or_three_components():
    assert light_components((0, 0, 2)).about((1.0, 0.0, 1.0)).angle_degrees == pytest.approx(45.0)  # round-off
    for wrong in ((0, 0, 0), (1, 2), "up", float("nan")):
        with pytest.raises(ValueError, match="three components"):
            light_components(wrong)
