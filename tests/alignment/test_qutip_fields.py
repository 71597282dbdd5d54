"""Objects for QuTiP: agreement of both propagators, the step over a pulse that is not seen, collisions; and the classical gas."""

from __future__ import annotations

import math

import numpy as np
import pytest
import qutip

from rotor.alignment.align import align
from rotor.alignment.classical import classical_trace, scaled_moments
from rotor.alignment.pulse import DipolePulse, GaussianPulse, Kick
from rotor.alignment.qutip_objects import block_objects, cosine_chain, linear_objects, solve_windows
from rotor.tops.top import Top

OCS = Top.from_constants("B=6081.492 MHz", dipole_abc_debye=(0.71519, 0, 0)).with_polarizability(
    np.diag([8.04, 4.0, 4.0]), "test"
)
PULSE = GaussianPulse(1e13, 0.05)


# Agreement


def test_both_propagators_agree():
    times = np.linspace(-20, 160, 901)
    objects = block_objects(OCS, [PULSE], jmax=30, cosines=("cos2theta", "cos2theta_2d"))
    theirs = solve_windows(objects, objects.state("0"), times)
    ours = align(OCS, PULSE, times, state={"j": 0}, m=0, tolerance=1e-10, jmax=30, observables=tuple(theirs))
    for name in theirs:
        assert np.abs(theirs[name] - ours.cosines[name]).max() < 1e-8  # their tolerance is 1e-10 a step


def test_both_agree_on_an_asymmetric_top_and_on_crossed_pulses():
    top = Top.from_constants("A=20000 B=9000 C=7000 MHz").with_polarizability(np.diag([6.0, 4.5, 4.0]), "test")
    times = np.linspace(-1, 30, 61)
    for pulses in (
        [GaussianPulse(5e12, 0.1)],
        [GaussianPulse(4e12, 0.1), GaussianPulse(3e12, 0.1, 0.05, axis=(1, 0, 0))],
    ):
        blocks = [block_objects(top, pulses, jmax=8, block=n) for n in range(4)]
        number = next(n for n, block in enumerate(blocks) if "0 0 0" in block.labels)
        objects = block_objects(top, pulses, jmax=24, block=number)
        theirs = solve_windows(objects, objects.state("0 0 0"), times)["cos2theta"]
        ours = align(top, pulses, times, tolerance=1e-8, jmax=24).cosines["cos2theta"]
        assert np.abs(theirs - ours).max() < 2e-8  # both tolerances


def test_the_step_over_a_pulse_is_seen_with_their_defaults_and_not_with_ours():
    """A list of times from -20 ps with 0.1 ps between them: QuTiP alone finds no pulse and says nothing."""
    times = np.linspace(-20, 80, 1001)
    objects = block_objects(OCS, [PULSE], jmax=30)
    ket, cosine = objects.state("0"), objects.cosines["cos2theta"]
    naive = qutip.sesolve(
        objects.hamiltonian(objects.windows[0]), ket, times, e_ops=[cosine], options={"progress_bar": ""}
    )
    assert np.ptp(naive.expect[0]) < 1e-6
    assert solve_windows(objects, ket, times)["cos2theta"].max() > 0.88


def test_kicks_and_fields_on_the_dipole():
    times = np.linspace(-2, 60, 101)
    pulses = [Kick.from_strength(2.0, 4.04), DipolePulse(300.0, 1.0, 0.2, centre_ps=10.0)]
    objects = block_objects(OCS, pulses, jmax=26, cosines=("costheta", "cos2theta"))
    theirs = solve_windows(objects, objects.state("0"), times)
    ours = align(OCS, pulses, times, state={"j": 0}, tolerance=1e-9, jmax=26, observables=("costheta", "cos2theta"))
    for name in theirs:
        assert np.abs(theirs[name] - ours.cosines[name]).max() < 1e-8  # tolerances


# Open systems


def test_operators_of_all_states():
    objects = linear_objects(OCS, 8)
    assert objects.cosine.isherm
    assert np.abs((objects.turns[1] - objects.cosine).full()).max() < 1e-15  # D_00 is cosθ
    total = sum((turn.dag() * turn for turn in objects.turns[1:]), objects.turns[0].dag() * objects.turns[0])
    inside = objects.j < 8
    assert np.abs(np.diag(total.full())[inside] - 1).max() < 1e-14  # Σ_p |D_p0|² = 1 where J + 1 is there
    assert np.trace(objects.thermal(10.0).full()).real == pytest.approx(1.0)
    places = np.array([j * j + j for j in range(7)])
    assert np.abs(cosine_chain(6, 0, 0).full() - objects.cosine.full()[np.ix_(places, places)]).max() < 1e-15


def test_collisions_destroy_alignment():
    """mesolve with √γ D^1_p0 after a kick: what is left of the permanent alignment falls, and the trace stays 1."""
    objects = linear_objects(OCS, 6)
    aligned = (1j * 1.0 * objects.cosine_squared).expm() * objects.thermal(0.5) * (-1j * objects.cosine_squared).expm()
    options = {"progress_bar": "", "matrix_form": True}
    ends = []
    for rate in (0.0, 0.05):
        solved = qutip.mesolve(
            objects.free,
            aligned,
            np.linspace(0, 40, 81),
            objects.collisions(rate),
            e_ops=[objects.cosine_squared],
            options=options,
        )
        ends.append(np.real(solved.expect[0]))
    assert np.ptp(ends[0][-40:]) > 5 * np.ptp(ends[1][-40:])
    assert ends[1][-1] == pytest.approx(1 / 3, abs=0.02)


def test_wrong_requests_are_refused():
    with pytest.raises(ValueError, match="there are 2"):
        block_objects(OCS, [PULSE], jmax=10, block=5)
    with pytest.raises(ValueError, match="the block has"):
        block_objects(OCS, [PULSE], jmax=10).state("1")
    with pytest.raises(ValueError, match="not linear"):
        linear_objects(Top.from_constants("A=10 B=6 C=4 MHz"), 3)
    for rate in (-1.0, float("inf"), float("nan")):
        with pytest.raises(ValueError, match="rate"):
            linear_objects(OCS, 2).collisions(rate)


# The classical gas


def test_units_of_the_classical_gas():
    """I = 1/(2B): the rate of rotation of L = 1 (ħ) is 2B."""
    assert 1 / scaled_moments(OCS)[1] == pytest.approx(2 * 2 * math.pi * 6081.492e-6)
    assert scaled_moments(OCS)[0] == 0.0


@pytest.mark.slow
def test_classical_and_quantum_gas_agree_while_both_dephase():
    """At 50 K, up to 15 ps: far from any revival. 20,000 bodies scatter by 0.3/√20000 = 2e-3."""
    times = np.linspace(-0.2, 15, 60)
    names = ("cos2theta", "cos2theta_2d")
    quantum = align(OCS, PULSE, times, temperature_k=50.0, observables=names, tolerance=1e-5)
    classical = classical_trace(
        OCS, [PULSE], times, temperature_k=50.0, molecules=20_000, observables=names, rng=np.random.default_rng(3)
    )
    for name in names:
        assert np.abs(classical[name] - quantum.cosines[name])[times < 5].max() < 1e-2  # four standard errors
    assert np.abs(classical["cos2theta"]).max() > 0.37


def test_a_classical_kick_turns_by_its_torque():
    """At 0 K a kick gives θ' = -(P/I) sin2θ ħ: ⟨cos²θ⟩ follows from one dimension."""
    kick, times = Kick.from_strength(1.0, 4.04), np.linspace(1e-6, 3.0, 30)
    computed = classical_trace(OCS, [kick], times, temperature_k=0.0, molecules=20_000, rng=np.random.default_rng(1))[
        "cos2theta"
    ]
    cosine = np.linspace(-1, 1, 20001)
    theta = np.arccos(cosine)
    rate = -np.sin(2 * theta) * 2 * (2 * math.pi * 6081.492e-6)
    exact = [np.mean(np.cos(theta + rate * t) ** 2) for t in times]
    assert np.abs(computed - exact).max() < 1e-2  # four standard errors of 20,000 bodies


@pytest.mark.slow
def test_an_asymmetric_gas_moves_with_the_same_core():
    top = Top.from_constants("A=5669.126 B=750.414293 C=662.636162 MHz").with_polarizability(
        np.diag([21.5, 15.3, 10.2]), "test"
    )
    pulse, times = GaussianPulse(1e12, 0.3), np.linspace(-1.2, 10, 20)
    quantum = align(top, pulse, times, temperature_k=1.0, tolerance=1e-3).cosines["cos2theta"]
    classical = classical_trace(top, [pulse], times, temperature_k=1.0, molecules=2000, rng=np.random.default_rng(2))[
        "cos2theta"
    ]
    assert np.abs(classical - quantum).max() < 0.035  # 0.3/√2000 four times, and 1 K is 30 B
    assert quantum.max() > 0.5
