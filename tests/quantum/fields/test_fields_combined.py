"""Any Hamiltonian in an electric field: two states, spins beside them, an operator of one file, internal rotation with spins and lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spin_field_matrices import CHI, DIPOLE, every_state, full_matrix
from torsion_top import turning
from toy_axis_power import AxisPower

import rotor
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.spin_effect import quadrupole_of_tensor
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.spins import Spin
from rotor.spectra.fields.lines import field_lines
from rotor.spectra.lines import line_list
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

CONSTANTS = ((10000.0, 6000.0, 4000.0), (9900.0, 5950.0, 4010.0))
BETWEEN, OTHER = (0.3, 0.2, 0.5), (0.8, -0.2, 0.1)
STATES = StateConstants(
    {"E[1]": 3000.0, "A[1]": 9900.0, "B[1]": 5950.0, "C[1]": 4010.0, "W[0,1]": 150.0},
    dipoles={(0, 1): BETWEEN, (1, 1): OTHER},
)
TWO = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=tuple(DIPOLE), states=STATES)


def two_states(twice_i: int, chi, kv_per_cm: float) -> np.ndarray:
    """|v⟩ times everything of `test_spin_fields`: each state with its constants and dipole, W and the dipole between them."""
    lower, upper = (
        full_matrix(abc, twice_i, chi, kv_per_cm=kv_per_cm, dipole=np.array(dipole))
        for abc, dipole in zip(CONSTANTS, (DIPOLE, OTHER), strict=True)
    )
    between = full_matrix((0.0, 0.0, 0.0), twice_i, 0 * CHI, kv_per_cm=kv_per_cm, dipole=np.array(BETWEEN))
    unit = np.eye(len(lower))
    return np.block([[lower, between + 150.0 * unit], [between + 150.0 * unit, upper + 3000.0 * unit]])


def test_two_states_in_an_electric_field():
    """Dipoles of both states and between them, three components each, a Fermi coupling: the direct product."""
    states = stark_map(TWO, [0.0, 2.0], j_highest=1, jmax=3, tolerance_mhz=1e3, most_at_edge=1.0)
    slow = np.linalg.eigvalsh(two_states(1, 0 * CHI, 2.0))[::2]  # the spin beside it does nothing
    assert every_state(states, 8) == pytest.approx(slow[:8], abs=1e-6)
    assert {str(label)[0] for label in states.label} == {"0", "1"}
    alone = stark_map(replace(TWO, states=None), [0.0, 2.0], j_highest=1, jmax=3, tolerance_mhz=1e3, most_at_edge=1.0)
    assert np.abs(every_state(alone, 1) - slow[:1]) > 1.0  # the other state matters


@pytest.mark.parametrize("twice_i", [2, 3])
def test_a_quadrupole_nucleus_with_two_states_in_an_electric_field(twice_i):
    effects = (*effects_of(TWO, False), quadrupole_of_tensor(Spin("N", twice_i), CHI))
    states = stark_map(TWO, [0.0, 0.3], j_highest=1, effects=effects, jmax=4, tolerance_mhz=1e3, most_at_edge=1.0)
    count = 6 * (twice_i + 1)
    slow = np.linalg.eigvalsh(two_states(twice_i, CHI, 0.3))
    assert every_state(states, count) == pytest.approx(slow[:count], abs=2e-5)  # N > 3: (μE/10B)⁶, χ²/60B


def test_lines_of_two_states_without_field_are_the_catalogue():
    fields = {"j_highest": 1, "light": "isotropic", "temperature_k": 20.0}
    lines = field_lines(TWO, [0.0], **fields, jmax=3, tolerance_mhz=1e9)
    free = line_list(TWO, jmax=1, temperature_k=20.0, min_lgint=-np.inf)
    assert lines.strength_debye2.sum() == pytest.approx(
        free.strength_debye2.sum(), rel=1e-9
    )  # lines below 1e-10 are cut


def test_an_operator_of_one_file_reaches_stark_maps():
    """c (J·n)⁴ along an axis: the full matrix over |J k M⟩ with J ≤ 3."""
    from direct_product import on_spins, rotor_matrix, states_up_to

    axis = np.array([0.6, 0.48, 0.64])
    effects = (*SEMI_RIGID, AxisPower(c_mhz=20.0, axis_abc=tuple(axis.tolist())))
    top = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=tuple(DIPOLE))
    states = stark_map(top, [0.0, 2.0], j_highest=1, effects=effects, jmax=3, tolerance_mhz=1e4, most_at_edge=1.0)
    along = sum(n * rotor_matrix(letter, 3) for n, letter in zip(axis, "abc", strict=True))
    assert len(along) == len(states_up_to(3))
    toy = on_spins(np.linalg.matrix_power(along, 4), (1,), {})
    slow = np.linalg.eigvalsh(full_matrix(CONSTANTS[0], 1, CHI, kv_per_cm=2.0) + 20.0 * toy)[::2]
    assert every_state(states, 9) == pytest.approx(slow[:9], abs=1e-6)
    assert np.abs(np.linalg.eigvalsh(full_matrix(CONSTANTS[0], 1, CHI, kv_per_cm=2.0))[:18:2] - slow[:9]).max() > 10


def with_nitrogen(top: Top) -> Top:
    return replace(top, spin_constants=SpinConstants.parse("chi_aa(14N)=-4 chi_bb(14N)=1.5 chi_ab(14N)=1 MHz"))


def test_internal_rotation_with_a_nucleus_in_a_field_is_the_rigid_top_where_nothing_couples():
    top = with_nitrogen(turning(rho=0.0, dab=0.0, v3=400.0, vt_max=0))
    rigid = replace(top, internal_rotation=None)
    expected, states = (
        stark_map(
            item, [0.0, 2.0], j_highest=1, effects=effects_of(item, True), jmax=4, tolerance_mhz=1e3, most_at_edge=1.0
        )
        for item in (rigid, top)
    )
    for species, copies in (("A", 1), ("E", 2)):
        named = np.char.startswith(states.label, species)
        at = named & (states.field == 2.0)
        energies = np.sort(np.repeat(states.energy_mhz[at], states.copies[at]))
        known = np.repeat(every_state(expected, 30), copies)
        assert np.abs((energies - energies[0]) - (known - known[0])).max() < 1e-5  # rounding of 1e7 MHz


@pytest.mark.parametrize("frame", ["RAM", "PAM"])
def test_lines_of_internal_rotation_without_field_are_the_catalogue(frame):
    top = turning(v3=400.0, vt_max=0, frame=frame)
    lines = field_lines(top, [0.0], j_highest=2, light="isotropic", temperature_k=20.0, jmax=4, tolerance_mhz=1e9)
    lines = lines.where(lines.frequency_mhz > 1e-4)  # MHz: M and M + 1 of one level are connected too
    free = line_list(top, jmax=2, temperature_k=20.0, min_lgint=-np.inf)
    assert lines.strength_debye2.sum() == pytest.approx(
        free.strength_debye2.sum(), rel=1e-9
    )  # lines below 1e-10 are cut
    assert lines.intensity_nm2_mhz.sum() == pytest.approx(free.intensity_nm2_mhz.sum(), rel=1e-6)  # Q to 1e-6


@pytest.mark.parametrize("frame", ["RAM", "PAM"])
def test_a_nucleus_beside_internal_rotation_leaves_the_sum_of_strengths(frame):
    """3 times that without the nucleus in any frame: the dipole turns with the axes of ρ."""
    top = with_nitrogen(turning(v3=400.0, vt_max=0, frame=frame))
    plain = line_list(top, jmax=2, temperature_k=20.0, min_lgint=-np.inf)
    hyperfine = line_list(top, jmax=2, temperature_k=20.0, min_lgint=-np.inf, effects=effects_of(top, True))
    far = hyperfine.where(hyperfine.frequency_mhz > 10.0)  # MHz: not those within one level
    assert far.strength_debye2.sum() == pytest.approx(3 * plain.strength_debye2.sum(), rel=1e-6)  # mixing of levels


def test_what_is_not_computed_in_a_magnetic_field_says_so():
    with pytest.raises(ValueError, match="internal rotation in a magnetic field"):
        rotor.api.zeeman_map(turning(), [1.0], 0.1, j_highest=1)


def test_a_tensor_of_one_file_on_a_spin_reaches_stark_maps():
    """The toy tensor with the numbers of a quadrupole coupling has its map."""
    from toy_spin_tensor import SpinTensor

    top = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=tuple(DIPOLE))
    toy = SpinTensor(g_mhz=1.0, t_abc=tuple(map(tuple, CHI.tolist())), twice_s=2)
    known = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", 2), CHI))
    settings = {"j_highest": 1, "jmax": 4, "tolerance_mhz": 1.0, "most_at_edge": 1.0}
    ours, expected, none = (
        stark_map(top, [0.0, 1.0], effects=effects, **settings)
        for effects in ((*SEMI_RIGID, toy), known, (*SEMI_RIGID, replace(toy, g_mhz=0.0)))
    )
    assert ours.energy_mhz == pytest.approx(expected.energy_mhz, abs=1e-8)  # rounding of 3e4 MHz
    assert np.abs(ours.energy_mhz - none.energy_mhz).max() > 0.1


def test_an_operator_of_one_file_is_fitted():
    """c of c (J·n)⁴ with A, B, C from lines that it made."""
    from rotor.fitting.assignment import assignments
    from rotor.fitting.fit import fit_lines
    from rotor.fitting.parameters import Parameters
    from rotor.quantum.labels.tracking import labelled_states

    top = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=tuple(DIPOLE))
    effects = (*SEMI_RIGID, AxisPower(c_mhz=2.0, axis_abc=(0.6, 0.48, 0.64)))
    lines = line_list(top, jmax=4, min_lgint=-np.inf, effects=effects)
    strong = lines.where(lines.frequency_mhz > 1000.0)
    names = ("A", "B", "C", "c_axis")
    labels = [strong.levels.quanta_of(rows) for rows in (strong.upper, strong.lower)]
    measured = assignments(("j", "ka", "kc"), *labels, strong.frequency_mhz, 0.001)

    def model(wanted):
        j, ka, kc = wanted.T
        start = np.array([10001.0, 6000.5, 3999.5, 1.5])
        return labelled_states(top, effects, names, np.column_stack([j, 0 * j, ka, kc]), start)

    start = np.array([10001.0, 6000.5, 3999.5, 1.5])
    free = Parameters(names, start, np.full(4, np.inf), names, np.zeros(4), np.eye(4))
    fit = fit_lines(measured, None, free, model=model)
    assert fit.converged
    assert fit.values == pytest.approx([10000.0, 6000.0, 4000.0, 2.0], abs=1e-5)  # lines without noise


def test_intensities_of_two_states_without_field_are_the_catalogue():
    lines = field_lines(TWO, [0.0], j_highest=1, light="isotropic", temperature_k=20.0, jmax=3, tolerance_mhz=1.0)
    free = line_list(TWO, jmax=1, temperature_k=20.0, min_lgint=-np.inf)
    far = lines.where(lines.frequency_mhz > 1e-4)  # MHz: not M and M + 1 of one level
    assert far.intensity_nm2_mhz.sum() == pytest.approx(free.intensity_nm2_mhz.sum(), rel=1e-6)  # Q to 1e-6
