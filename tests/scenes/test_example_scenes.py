"""Every scene of examples/scenes runs, and gives the figure that it is about; the slowest of them in the slow proofs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from places import PROJECT
from scipy.integrate import solve_ivp
from scipy.special import ellipk, fresnel

import rotor
from rotor.scenes.run import run_scene
from rotor.scenes.scene import read_scene
from rotor.scenes.sweep import SweepResult, run_sweep
from rotor.verbs.common.calculation import Outcome

FOLDER = PROJECT / "examples" / "scenes"


def column(result: Outcome, name: str) -> np.ndarray:
    return np.asarray(result.table.columns[name])


def spin(result: Outcome) -> np.ndarray:
    return np.stack([column(result, f"w{k}") for k in (1, 2, 3)], axis=-1)


def water_300k(result):
    lines = column(result, "frequency_mhz")
    assert (
        np.min(np.abs(lines - 183310.087)) < 1.0
    )  # 3(1,3)-2(2,0), measured; the constants reproduce such lines to 0.8 MHz
    assert lines.max() <= 3e6


def so2_far_infrared(result):
    lines = column(result, "frequency_mhz")
    assert 30 * 29979.2458 <= lines.min() < lines.max() <= 60 * 29979.2458
    assert len(lines) > 1000
    assert result.reached.error < result.reached.asked == 1e-3  # MHz


def diol_in_a_jet(result):
    lines = column(result, "frequency_mhz")
    assert np.all((lines >= 2000) & (lines <= 18000))
    assert np.min(np.abs(lines - (3640 + 2790))) < 0.1  # 1(0,1)-0(0,0) is B + C less 4 DJ and less


def ammonia(result):
    near = column(result, "frequency_mhz")
    assert (
        np.min(np.abs(near - 572498.0)) < 5.0
    )  # 1(0)-0(0) measured; between inversion states of constants fitted together


def cyanoacetylene(result):
    top = result.request.top
    lines = column(result, "frequency_mhz")
    x = np.arange(len(lines) + 1) * np.arange(1.0, len(lines) + 2)
    closed = np.diff(top.constants["B"] * x - top.constants["D"] * x**2 + top.constants["H"] * x**3)
    assert np.allclose(lines, closed, rtol=1e-12)  # round-off


def formamide_hyperfine(result):
    """1(0,1)-0(0,0) is three lines at Casimir's -χ_aa/2, χ_aa/4, -χ_aa/20 of F = 0, 1, 2 (I = 1, N = 1, along a)."""
    names = result.table.quanta_names
    assert names[-1] == "f"
    lines, strength = column(result, "frequency_mhz"), column(result, "strength_debye2")
    b, c = (result.request.top.constants[name] for name in "BC")
    near = np.abs(lines - (b + c)) < 5.0
    assert np.count_nonzero(near) == 3
    energies = [-0.5 * 1.9598 * y for y in (1.0, -0.5, 0.1)]
    centre = np.average(lines[near], weights=strength[near])
    assert np.allclose(np.sort(lines[near] - centre), np.sort(energies), atol=2e-3)  # second order in χ²/B


def ocs_stark_map(result):
    field, energy = column(result, "field_kv_per_cm"), column(result, "energy_mhz")
    ground = energy[(column(result, "m") == 0) & (column(result, "rank") == 0)][: len(np.unique(field))]
    top = result.request.top
    mu, b = abs(top.dipole_abc_debye[0]), top.constants["B"]
    at = 2  # kV/cm: second order, and fourth order is 1e-3 of it
    expected = -((mu * 503.411665 * at) ** 2) / (6 * b)
    assert np.isclose(ground[np.flatnonzero(np.unique(field) == at)[0]], expected, rtol=2e-3)


def formic_acid_zeeman(result):
    """1(0,1) rotates about b and c alike: E = E0 - (g_bb + g_cc)/2 μ_N B M, and -B²/2 of χ_ZZ, the same for M and -M."""
    states = result.table
    up, down = (states.energy_mhz[states.curve("1 0 1", m)] for m in (1, -1))
    moment = (-0.0903 - 0.0270) / 2 * 7.6225932
    assert np.allclose(
        up - down, -2 * moment * states.fields, atol=2e-5
    )  # 1(0,1) takes 1e-5 of J_a² from asymmetry and field
    middle = states.energy_mhz[states.curve("1 0 1", 0)]
    for energies, share in (
        (middle, 3 / 5),
        ((up + down) / 2, 1 / 5),
    ):  # of Φ_Za² in |J = 1, K_a = 0, M⟩; b and c have the rest
        chi = -18.8 * share - (16.8 + 24.2) * (1 - share) / 2
        expected = -0.5 * 0.0250607 * chi * states.fields**2
        assert np.allclose(energies - energies[0], expected, atol=2e-5)  # six digits of the unit, 1.6 MHz


def ocs_alignment(result):
    times, cosine = column(result, "t_ps"), column(result, "cos2theta")
    period = 1e6 / (2 * result.request.top.constants["B"])
    assert np.isclose(cosine[0], 1 / 3, atol=1e-4)  # isotropic before the pulse; tolerance 1e-5
    late, again = (
        np.interp(np.linspace(20, 40, 50), times, cosine),
        np.interp(np.linspace(20, 40, 50) + period, times, cosine),
    )
    assert np.allclose(late, again, atol=2e-3)  # one revival later; distortion and interpolation over 0.2 ps


def tennis_racket(result):
    times, along = column(result, "t"), column(result, "m2")
    before = np.flatnonzero(along[:-1] * along[1:] < 0.0)
    flips = times[before] + 0.01 * along[before] / (along[before] - along[before + 1])
    assert np.allclose(np.diff(flips), 12.3349458093386 / 2, atol=1e-4)  # linear interpolation over 0.01 s


def driven_chaos(result):
    """The published equations, integrated independently: equal until their exponent of 0.14 has made round-off visible."""

    def rate(_, v):
        x, y, z = v
        return [-0.4 * x + y + 10 * y * z, -x - 0.4 * y + 5 * x * z, 0.175 * z - 5 * x * y]

    scale = np.sqrt([1 / 75, 1 / 50, 1 / 150])
    times = column(result, "t")
    plain = solve_ivp(rate, (0, 40), [0.349, 0.0, -0.160], method="DOP853", rtol=1e-12, atol=1e-13, t_eval=times).y.T
    assert np.max(np.abs(spin(result) * scale - plain)) < 1e-6  # 1e-10 of a step, times exp(0.14 · 40)


def rattleback(result):
    times, rate = column(result, "t"), -column(result, "w3")
    k = np.flatnonzero(rate[:-1] * rate[1:] < 0.0)[0]
    stop = times[k] + 0.005 * rate[k] / (rate[k] - rate[k + 1])
    assert abs(stop - 2.390) < 2e-3  # the published figure has three decimals; interpolation over 5 ms
    assert rate[-1] > 0.1  # it has turned back


def water_gas(result):
    assert result.answer.test.accepted
    assert result.answer.facts()["degrees_of_freedom"]["rotation"] == 3


def rigid_water(result):
    facts = result.answer.facts()
    assert facts["degrees"]["total"] == 6 * 64
    assert len(result.table) == 21


def body_in_ideal_fluid(result):
    assert result.answer.facts()["energy_drift"] < 1e-10  # 1e-12 a step, hundreds of steps
    impulse = np.array([40.0, 25.0, 10.0])
    q = np.stack([column(result, name) for name in ("qw", "qx", "qy", "qz")], axis=-1)
    momentum = np.stack([column(result, f"m{k}") for k in (1, 2, 3)], axis=-1)
    from rotor.geometry.rotations import rotate

    assert np.ptp(rotate(q, momentum) @ impulse) < 1e-9 * np.max(np.abs(momentum)) * 50  # M·p is conserved


def centre_of_percussion(result):
    omega = column(result, "m3") / 0.10125
    assert np.allclose(omega * 0.45, 3.0 / 1.5, rtol=1e-12)  # ω l/2 is the speed of the centre: no jar


def chandler_wobble(result):
    angle = np.unwrap(np.arctan2(column(result, "m2"), column(result, "m1")))
    assert abs(2 * np.pi * 1000 / (angle[-1] - angle[0]) - 304.456) < 5e-4  # the published period has three decimals


def dual_spin_satellite(result):
    times, across = column(result, "t"), column(result, "w1")
    rising = np.flatnonzero((across[:-1] < 0.0) & (across[1:] >= 0.0))
    passes = times[rising] - across[rising] * 0.21 / (across[rising + 1] - across[rising])
    assert abs(2 * np.pi / np.mean(np.diff(passes)) - 0.748053028423342) < 1e-4  # straight lines over 0.21 s


def physical_pendulum(result):
    times = column(result, "t")
    angle = 2 * np.arctan2(column(result, "qx"), column(result, "qw"))
    k = np.flatnonzero(angle[:-1] * angle[1:] < 0.0)
    passes = times[k] - angle[k] * (times[k + 1] - times[k]) / (angle[k + 1] - angle[k])
    small = 2 * np.pi * np.sqrt(2 / (3 * 9.80665))
    assert abs(2 * (passes[1] - passes[0]) / small - 2 * ellipk(0.5) / np.pi) < 1e-5  # interpolation over 8 ms
    assert result.answer.facts()["energy_drift"] < 1e-8  # 1e-10 a step


def satellite_body_torque(result):
    times, k, i3, torque = column(result, "t"), 0.8, 180.0, (0.05, 2.0)
    winding = np.sqrt(k * torque[1] / (np.pi * i3))
    sine, cosine = fresnel(winding * times)
    closed = torque[0] / 100.0 * np.exp(0.5j * np.pi * (winding * times) ** 2) * (cosine - 1j * sine) / winding
    assert np.max(np.abs(column(result, "w1") + 1j * column(result, "w2") - closed)) < 1e-8  # 1e-12 a step, 2000 steps


def skater_and_panels(result):
    assert np.isclose(column(result, "w3")[-1], 0.3 * 70 / 130, rtol=1e-13)  # L3 is conserved to round-off
    cone = np.arctan2(np.hypot(column(result, "m1"), column(result, "m2")), column(result, "m3"))
    assert np.ptp(cone) < 1e-12  # likewise


def space_station(result):
    angle = np.unwrap(2 * np.arctan2(column(result, "qz"), column(result, "qw")))
    assert np.allclose(
        angle - angle[0], np.sqrt(9.80665 / 100) * column(result, "t"), atol=1e-12
    )  # steady: 13 rad, round-off


def optical_centrifuge(result):
    """The rod stays behind the field by half of asin(I β/U0), so that L is I β t: 116 ħ at 10 THz."""
    times, inertia, rate = column(result, "t"), result.request.moments[1], 2 * np.pi * 0.1
    depth = 1.1 * 1.98739 * 10
    turned = (column(result, "qw") + 1j * column(result, "qz")) ** 2
    assert np.allclose(
        np.angle(np.exp(0.5j * rate * times**2) / turned), np.arcsin(inertia * rate / depth) / 2, atol=1e-7
    )
    assert np.allclose(column(result, "m3"), inertia * rate * times, atol=1e-3)
    assert abs(column(result, "m3")[-1] - 116.0) < 0.1


def unbalanced_wheel(result):
    from rotor.geometry.rotations import rotate

    q = np.stack([column(result, name) for name in ("qw", "qx", "qy", "qz")], axis=-1)
    axle = np.array([np.sin(np.radians(1)), 0, np.cos(np.radians(1))])
    assert np.max(np.abs(rotate(q, axle) - axle)) < 1e-7  # the axle stays: 1e-10 a step, 100 rad


def nitrogen_raman(result):
    shift, cross = column(result, "shift_cm"), column(result, "cross_section_cm2_per_sr")
    b = result.request.top.constants["B"] / 29979.2458
    strongest = shift[np.argmax(cross)]
    assert abs(strongest - 6 * b - 4 * b * round((strongest / b - 6) / 4)) < 0.02  # (4J + 6)B less distortion


def hydrogen_heat_capacity(result):
    assert isinstance(result, SweepResult)
    assert result.columns["observables.species"].tolist() == ["ortho", "para", "equilibrium"]
    assert len(result.files) == 3
    assert all(Path(file).stat().st_size > 500 for file in result.files)


def ocs_levels(result):
    top, j = result.request.top, np.arange(21)
    x = j * (j + 1.0)
    closed = top.constants["B"] * x - top.constants["D"] * x**2
    assert np.allclose(column(result, "energy_mhz"), closed, rtol=1e-8)  # sextic constants


def ocs_fit(result):
    """B and D of OCS are those of the library, which come from another fit of such lines."""
    assert result.answer.fit.converged
    fitted = dict(zip(column(result, "parameter"), column(result, "value_mhz"), strict=True))
    known = rotor.read("OCS").constants
    assert abs(fitted["B"] - known["B"]) < 1e-4  # MHz; both are good to 1e-5, with other sextic constants
    assert abs(fitted["D"] - known["D"]) < 1e-7
    assert result.answer.fit.weighted_rms < 1.0


def cold_core(result):
    """The optical depth of CO 1-0 from its Einstein coefficient: τ0 = c³ A g' N/8πν³Q · e^-E'/kT (e^hν/kT - 1)/(Δv √(π/4 ln 2))."""
    from scipy.constants import Boltzmann, Planck, c

    row = np.flatnonzero(column(result, "molecule") == "carbon monoxide")[0]
    frequency, a, upper = (
        column(result, name)[row] for name in ("frequency_mhz", "einstein_a_per_s", "energy_upper_k")
    )
    j, x = np.arange(40), Planck * frequency * 1e6 / (Boltzmann * 10.0)
    q = np.sum((2 * j + 1) * np.exp(-j * (j + 1) * x / 2))
    width = 500.0 * np.sqrt(np.pi / (4 * np.log(2)))
    area = c**3 * a * 3 * 1e18 / (8 * np.pi * (frequency * 1e6) ** 3 * q)
    depth = area * np.exp(-upper / 10.0) * np.expm1(x) / width
    assert np.isclose(column(result, "optical_depth")[row], depth, rtol=1e-4)  # distortion in Q, 3e-6 of ν
    assert np.isclose(column(result, "observed_mhz")[row], frequency * (1 - 5600.0 / c), rtol=1e-12)  # radio convention


SLOW = {"rattleback", "body_in_ideal_fluid", "physical_pendulum"}
NAMES = sorted(path.stem for path in FOLDER.glob("*.toml"))


def test_every_scene_has_its_figure():
    assert len(NAMES) >= 20
    assert all(name in globals() for name in NAMES)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in NAMES]
)
def test_scene(folder, name):
    scene = read_scene(FOLDER / f"{name}.toml")
    result = run_sweep(scene, folder=FOLDER) if scene.sweep else run_scene(scene, folder=FOLDER)
    globals()[name](result)
    assert result.files
    assert all(Path(file).is_file() for file in result.files)


def test_the_same_numbers_without_a_scene(folder):
    lines = run_scene(read_scene(FOLDER / "cyanoacetylene.toml"), folder=FOLDER).table
    direct = rotor.api.line_list(rotor.read("HC3N"), temperature_k=30.0, range_mhz=(0.0, 300e3))
    assert np.array_equal(lines.frequency_mhz, direct.frequency_mhz)
