"""Spins in electric and magnetic fields: against QuTiP's direct product of everything, closed forms, magnetisability, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from direct_product import states_up_to
from spin_field_matrices import CHI, DIPOLE, LARGEST, G, every_state, full_matrix

from rotor.quantum.effects.spin_effect import quadrupole_of_tensor
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.effects.zeeman import zeeman_map
from rotor.quantum.fields.blocks import Magnet
from rotor.quantum.fields.solved_space import field_space
from rotor.quantum.spins import Spin
from rotor.tops.top import Top
from rotor.units import NUCLEAR_MAGNETON_MHZ_PER_T

X = np.diag([-3.0, 2.0, -7.0])


def top_of(text: str, dipole) -> Top:
    return Top.from_constants(text, dipole_abc_debye=tuple(dipole))


@pytest.mark.parametrize("twice_i", [2, 3])
def test_a_quadrupole_nucleus_in_an_electric_field(twice_i):
    """Three dipole components, χ with all elements, 1 kV/cm: Stark shifts of the size of the coupling."""
    top = top_of("A=10000 B=6000 C=4000 MHz", DIPOLE)
    effects = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", twice_i), CHI))
    stark = stark_map(top, [0.0, 1.0], j_highest=1, effects=effects, tolerance_mhz=1e-6, jmax=4)
    count = (1 + 9) * (twice_i + 1)
    slow = np.linalg.eigvalsh(full_matrix((10000.0, 6000.0, 4000.0), twice_i, CHI, kv_per_cm=1.0))[:count]
    assert every_state(stark, count) == pytest.approx(slow, abs=2e-5)  # N > 3: (μE/10B)⁴ 2B and χ²/60B
    assert (stark.m == -1).sum() == 0
    assert set((2 * stark.m) % 2) == {float(twice_i % 2)}  # M_F is whole or half


def test_weak_field_keeps_the_hyperfine_labels_and_strong_field_uncouples_the_spin():
    """A linear top, J = 1, I = 1: from E² shifts of F levels to 2I+1 components near each M."""
    top = top_of("B=6000 MHz", (2.0, 0, 0))
    effects = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", 2), np.diag([-4.0, 2.0, 2.0])))
    stark = stark_map(top, [0.0, 0.01, 100.0], j_highest=1, effects=effects, tolerance_mhz=1e-4)
    free = {str(stark.label[r.start]): stark.energy_mhz[r.start] for r in stark.curves()}
    assert free["1 1"] - free["1 2"] == pytest.approx(4.0 * (-1 / 4 - 1 / 20), abs=1e-3)  # Casimir; second order in χ
    assert free["1 0"] - free["1 2"] == pytest.approx(4.0 * (1 / 2 - 1 / 20), abs=1e-3)  # the same
    plain = stark_map(top, [100.0], j_highest=1, tolerance_mhz=1e-4)
    strong = np.sort(np.repeat(stark.energy_mhz[2::3], stark.copies[2::3]))
    centres = np.sort(np.repeat(plain.energy_mhz, 3 * plain.copies))
    assert np.abs(strong - centres).max() < 4.0  # the coupling


def test_a_symmetric_top_with_a_nucleus_in_an_electric_field():
    """K and -K of opposite first-order shifts, χ along the axis."""
    top = top_of("A=20000 B=6000 MHz", (1.5, 0, 0))
    chi = np.diag([-10.0, 5.0, 5.0])
    effects = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", 2), chi))
    stark = stark_map(top, [0.0, 0.05], j_highest=1, effects=effects, tolerance_mhz=1e-6, jmax=4)
    slow = np.linalg.eigvalsh(full_matrix((20000.0, 6000.0, 6000.0), 2, chi, kv_per_cm=0.05, dipole=(1.5, 0, 0)))[:30]
    assert every_state(stark, 30) == pytest.approx(slow, abs=1e-5)  # χ²/60B of N > 3


@pytest.mark.parametrize(("constants", "text"), [((10000.0, 6000.0, 4000.0), "A=10000 B=6000 C=4000 MHz")])
def test_a_nucleus_in_a_magnetic_field(constants, text):
    """g with an off-diagonal element, magnetisability, quadrupole coupling and the moment of the nucleus at 2 T."""
    effects = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", 2), CHI))
    zeeman = zeeman_map(
        top_of(text, DIPOLE),
        [0.0, 2.0],
        G,
        magnetisability=X,
        effects=effects,
        nuclear_g={"N": 0.4038},
        j_highest=1,
        jmax=4,
    )
    slow = np.linalg.eigvalsh(full_matrix(constants, 2, CHI, tesla=2.0, g_i=0.4038, x=X))[:30]
    assert every_state(zeeman, 30) == pytest.approx(slow, abs=1e-5)  # χ²/60B of N > 3
    moments = zeeman.slope.reshape(-1, 2)[:, 1]
    assert np.abs(moments).max() > 0.4  # the nucleus


@pytest.mark.parametrize(("text", "axis"), [("A=20000 B=6000 MHz", 0), ("B=20000 C=6000 MHz", 2)])
def test_a_symmetric_top_with_a_nucleus_in_a_magnetic_field(text, axis):
    """K and -K coincide, M and -M do not: g, χ and magnetisability with the axis of a prolate and of an oblate top, 5 T."""

    def along(parallel: float, across: float) -> np.ndarray:
        return np.diag(np.roll([parallel, across, across], axis))

    g, chi, x = along(0.5, -0.2), along(-10.0, 5.0), along(-3.0, -7.0)
    constants = tuple(np.diag(along(20000.0 if axis == 0 else 6000.0, 6000.0 if axis == 0 else 20000.0)))
    effects = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", 2), chi))
    zeeman = zeeman_map(
        Top.from_constants(text),
        [0.0, 5.0],
        g,
        magnetisability=x,
        effects=effects,
        nuclear_g={"N": 0.4038},
        j_highest=1,
        jmax=4,
    )
    slow = np.linalg.eigvalsh(full_matrix(constants, 2, chi, tesla=5.0, g=g, g_i=0.4038, x=x))[:30]
    assert every_state(zeeman, 30) == pytest.approx(slow, abs=1e-8)  # round-off of 2e4 MHz; found 3e-10
    with pytest.raises(ValueError, match="axial about its axis"):
        field_space(Top.from_constants(text), 3, [Magnet(np.diag([0.5, 0.2, 0.1]))], effects)


@pytest.mark.parametrize(
    ("constants", "text"),
    [((10000.0, 6000.0, 4000.0), "A=10000 B=6000 C=4000 MHz"), ((0.0, 600.0, 600.0), "B=600 MHz")],
)
def test_magnetisability_against_the_full_matrix(constants, text):
    """-½ B² χ_ZZ at 20 T, a half-spin beside it as in the full matrix alone."""
    g, x = (G, X) if constants[0] else (np.diag([0.0, -0.03, -0.03]), np.diag([-3.0, -7.0, -7.0]))
    zeeman = zeeman_map(Top.from_constants(text), [20.0], g, magnetisability=x, j_highest=1, tolerance_mhz=1e-4)
    slow = full_matrix(constants, 1, CHI, tesla=20.0, g=g, x=x)[::2, ::2]
    if not constants[0]:
        states = states_up_to(LARGEST)
        linear = [i for i, (_, k, _) in enumerate(states) if k == 0]
        slow = slow[np.ix_(linear, linear)]
    assert every_state(zeeman, 4) == pytest.approx(np.linalg.eigvalsh(slow)[:4], abs=1e-4)  # N > 3
    if not constants[0]:
        near = [zeeman_map(Top.from_constants(text), [b], g, magnetisability=x, j_highest=1) for b in (19.99, 20.01)]
        slope = (near[1].energy_mhz - near[0].energy_mhz) / 0.02 / NUCLEAR_MAGNETON_MHZ_PER_T
        assert zeeman.slope == pytest.approx(-slope, abs=1e-6)  # round-off of 1200 MHz over 0.02 T


def test_a_spin_alone_precesses_beside_a_linear_top():
    """No coupling: E = E0 - μ_N B (g M_N + g_I M_I) exactly."""
    top = top_of("B=6000 MHz", (1.0, 0, 0))
    effects = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", 3), np.zeros((3, 3))))
    zeeman = zeeman_map(top, [1.5], -0.03, effects=effects, nuclear_g={"N": 0.5}, j_highest=1, jmax=4)
    m, i = np.meshgrid([-1, 0, 1], [-1.5, -0.5, 0.5, 1.5])
    exact = 12000.0 - 1.5 * NUCLEAR_MAGNETON_MHZ_PER_T * (-0.03 * m + 0.5 * i)
    ours = np.sort(zeeman.energy_mhz[[str(label).startswith("1 ") for label in zeeman.label]])
    assert ours == pytest.approx(np.sort(exact.ravel()), abs=1e-9)  # round-off of 12 GHz


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda top, q: stark_map(top, [1.0], effects=q, direction=(1, 0, 1)), "along Z alone"),
        (lambda top, q: stark_map(top, [1.0], effects=q, m_values=(0.5,)), "m_values: "),
        (lambda top, q: zeeman_map(top, [1.0], 0.1, nuclear_g={"N": 0.4}), "give the effects"),
        (lambda top, q: zeeman_map(top, [1.0], 0.1, effects=q, nuclear_g={"H": 5.6}), "g of H"),
        (lambda top, q: zeeman_map(top, [1.0], 0.1, magnetisability=np.nan), "χ tensor"),
    ],
)
def test_wrong_requests_are_refused(call, message):
    effects = (*SEMI_RIGID, quadrupole_of_tensor(Spin("N", 2), CHI))
    with pytest.raises(ValueError, match=message):
        call(top_of("A=10000 B=6000 C=4000 MHz", DIPOLE), effects)
