"""Short tests of single safeguards that no other test isolates; cases are numbered as in docs/hard_cases.md."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slow_matrix import watson_matrix

from rotor.alignment.align import align
from rotor.alignment.propagation.steps import FIRST_STEPS
from rotor.alignment.pulse import RAD_PER_PS_ANGSTROM3_W_PER_CM2, GaussianPulse
from rotor.classical.lyapunov import body_flow, lyapunov_exponents
from rotor.fluids.motion.thermometers import Kinetic, temperatures
from rotor.molecules.molecule import Molecule
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.fields.map_request import MOST_AT_EDGE
from rotor.quantum.solve import solve_levels
from rotor.statistics.degrees_of_freedom import Degrees
from rotor.structures.family import family
from rotor.structures.least_squares import fit_structure
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

WATER_QUARTIC = {
    "A": 835840.288, "B": 435351.717, "C": 278138.7, "DeltaJ": 37.59422, "DeltaJK": -172.91276, "DeltaK": 973.29052,
    "deltaJ": 15.210402, "deltaK": 41.05025,
}  # fmt: skip


def test_vectors_of_near_degenerate_partners_lie_in_one_block():
    """Case 3: at κ = -0.9, J = 20 the partners of high Ka lie closer than round-off; each vector is in one block as a whole."""
    levels = solve_levels(Top(Constants(A=10000.0, B=6200.0, C=6000.0)), 20, jmin=20)
    for block in levels.blocks:
        overlap = block.vectors.T @ block.vectors
        assert overlap == pytest.approx(np.eye(len(overlap)), abs=1e-12)  # round-off of 11 functions


def test_energies_are_eigenvalues_where_the_diagonal_turns_round():
    """Case 4: quartic water at J = 20, where first-order energies are off by up to 550 cm⁻¹, against the whole matrix."""
    levels = solve_levels(Top(Constants(**WATER_QUARTIC, reduction="A")), 20, jmin=20)
    whole = np.linalg.eigvalsh(watson_matrix(WATER_QUARTIC, "A", "Ir", 20))
    assert np.sort(levels.energy_mhz) == pytest.approx(whole, abs=1e-4)  # MHz; round-off of 1e9 MHz and 41 functions


@pytest.mark.parametrize("part", [1e-6, 1e-7])
def test_the_doublet_of_a_near_symmetric_top_is_there(part):
    """Case 6: K = 1 is split by ½ (B - C) J(J+1), however small that is."""
    top = Top(Constants(A=1000.0, B=500.0 * (1 + part / 2), C=500.0 * (1 - part / 2)))
    levels = solve_levels(top, 20, jmin=20)
    pair = np.sort(levels.energy_mhz[levels.quanta["ka"] == 1])
    assert np.diff(pair) == pytest.approx(0.5 * 500.0 * part * 20 * 21, rel=1e-3)  # second order of 1e-6 and round-off


def test_three_dependent_moments_of_a_planar_molecule_are_named():
    """Case 12: I_c = I_a + I_b, so that a third moment of each species is no third observation."""
    water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]])
    rigid = [Top.from_molecule(molecule).constants for molecule in (water, water.with_isotopes("H=2H"))]
    known = [dict(zip("ABC", rigid_constants.rigid, strict=True)) for rigid_constants in rigid]
    both = family(water, [("H2O", "", known[0], {}), ("D2O", "H=2H", known[1], {})])
    all_three = fit_structure(both, "r0")
    two = fit_structure(both, "r0", leave_out=("c",))
    assert any("they depend on each other" in note for note in all_three.notes)
    assert not any("they depend on each other" in note for note in two.notes)


@pytest.mark.slow
def test_labels_are_ranks_whatever_the_grid():
    """Case 22: 11 and 101 fields through avoided crossings give each label the same energy at the last one."""
    top = Top.from_constants("A=5655.2654 B=1546.875864 C=1214.40399 MHz", dipole_abc_debye=(4.5152, 0.05, 0))
    ends = []
    for count in (11, 101):
        stark = stark_map(top, np.linspace(0, 150, count), j_highest=2, m_values=(1,), tolerance_mhz=1e-3)
        ends.append({str(stark.label[rows.start]): stark.energy_mhz[rows][-1] for rows in stark.curves()})
    assert ends[0].keys() == ends[1].keys()
    assert list(ends[0].values()) == pytest.approx(list(ends[1].values()), abs=2e-3)  # the tolerance, twice


def test_the_factor_of_an_oscillating_field():
    """Case 24: U0/ħ of 1 Å³ and 1e12 W/cm² is 1.98739 rad/ps: Friedrich and Herschbach's formula with ¼ ε² and I = c ε0 ε²/2."""
    assert pytest.approx(1.98739, abs=5e-6) == RAD_PER_PS_ANGSTROM3_W_PER_CM2 * 1e12  # digits of the figure


def test_the_growth_of_a_free_body_is_within_its_error_of_zero():
    """Case 27: distances of a free body grow in proportion to time, ln(t)/t in an exponent, which its error must hold."""
    flow = replace(body_flow([1.0, 1.875, 2.875], [0.5, 0.75, 1.0]), timed=True)  # the route that compiles nothing
    exponents = lyapunov_exponents(flow, time=200.0, segments=4, tolerance=1e-6)
    assert exponents.values[0] > 1e-3  # what is there to be mistaken for chaos
    assert exponents.values[0] < 3 * exponents.errors[0]


def test_rotation_has_a_temperature_of_its_own():
    """Case 29: rotations with 1.5 times the energy a degree of translations are 1.5 times as hot, not the mean of both."""
    hot = temperatures(Kinetic(3.0, 1.5 * 3.0), Degrees(bodies=10, translation=30, rotation=30))
    assert hot.rotation_k / hot.translation_k == pytest.approx(1.5, rel=1e-12)  # round-off


def test_the_steps_of_a_pulse_are_halved_until_they_agree():
    """Case 24: the first number of steps is far from enough for 1e-8, and what is found of the steps is within the tolerance."""
    top = Top.from_constants("B=6081.492 MHz", polarizability_abc_angstrom3=((7.8, 0, 0), (0, 3.7, 0), (0, 0, 3.7)))
    trace = align(top, GaussianPulse(3e12, 0.3), np.linspace(-1, 20, 5), temperature_k=2.0, tolerance=1e-8)
    assert trace.step_error <= 1e-8
    assert max(trace.steps) > FIRST_STEPS


def test_the_edge_of_a_basis_is_empty_whatever_the_tolerance():
    """Case 23: cosines are off by about the population of the two highest J, which a tolerance of the energies says nothing of."""
    top = Top.from_constants("B=1000 MHz", dipole_abc_debye=(3.0, 0.0, 0.0))
    stark = stark_map(top, [0.0, 100.0], j_highest=1, tolerance_mhz=1e7)
    assert stark.edge_population.max() <= MOST_AT_EDGE
