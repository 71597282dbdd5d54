"""Effects that stand in one file each and are added to the list: levels, lines, Q, derivatives and sizes see them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from slow_matrix import AXES
from toy_axis_power import AxisPower

from rotor.quantum.effect import QuantumEffect, effect_sizes
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.basis import REPRESENTATIONS
from rotor.spectra.lines import line_list
from rotor.spectra.raman.raman import raman_lines
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

A, B, C = 9000.0, 5000.0, 3500.0
TILTED = tuple((np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])).tolist())
DIPOLE = (1.0, 0.7, 0.4)


def top_in(representation: str = "Ir", **more: object) -> Top:
    return Top(Constants(A=A, B=B, C=C, representation=representation), dipole_abc_debye=DIPOLE, **more)


def body_momenta(j: int) -> dict[str, np.ndarray]:
    """Ja, Jb, Jc with [Ja, Jb] = -i Jc from QuTiP's space-fixed operators: the complex conjugates of jx, jy, jz."""
    import qutip

    if j == 0:
        return dict.fromkeys("abc", np.zeros((1, 1)))
    return {axis: qutip.jmat(j, of).full().conj() for axis, of in zip("abc", "xyz", strict=True)}


def full_matrix(j: int, c: float, axis: tuple[float, float, float]) -> np.ndarray:
    momenta = body_momenta(j)
    along = sum(n * momenta[name] for n, name in zip(axis, "abc", strict=True))
    rigid = sum(x * momenta[name] @ momenta[name] for x, name in zip((A, B, C), "abc", strict=True))
    return rigid + c * np.linalg.matrix_power(along, 4)


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("axis", [TILTED, (0.0, 0.0, 1.0), (math.sqrt(0.5), math.sqrt(0.5), 0.0)])
def test_levels_are_those_of_the_full_matrix(representation, axis):
    levels = solve_levels(top_in(representation), 6, effects=(*SEMI_RIGID, AxisPower(0.8, axis)))
    for j in range(7):
        ours = np.sort(levels.energy_mhz[levels.quanta["j"] == j])
        slow = np.linalg.eigvalsh(full_matrix(j, 0.8, axis))
        assert ours == pytest.approx(slow, abs=1e-13 * np.abs(slow).max() + 1e-9)  # round-off of a 13 x 13 matrix
    assert levels.effects[-1].name == "fourth power along an axis"


def test_every_label_is_given_once_and_leads_back_to_its_row():
    levels = solve_levels(top_in(), 8, effects=(*SEMI_RIGID, AxisPower(2.0, TILTED)))
    plain = solve_levels(top_in(), 8)
    assert sorted(map(tuple, levels.quanta_of(np.arange(len(levels))).tolist())) == sorted(
        map(tuple, plain.quanta_of(np.arange(len(plain))).tolist())
    )
    assert np.array_equal(levels.rows_of(**levels.quanta), np.arange(len(levels)))
    row = levels.find(j=8, ka=3, kc=5)
    assert [int(levels.quanta[name][row]) for name in ("j", "ka", "kc")] == [8, 3, 5]
    with pytest.raises(ValueError, match="no level with j = 9"):
        levels.find(j=9, ka=0, kc=9)
    with pytest.raises(ValueError, match="labelled by j, ka, kc"):
        levels.find(j=8, k=3)


def test_an_effect_of_zero_changes_nothing():
    zero = solve_levels(top_in(), 8, effects=(*SEMI_RIGID, AxisPower(0.0, TILTED)))
    plain = solve_levels(top_in(), 8)
    for name in ("j", "ka", "kc"):
        assert np.array_equal(np.sort(zero.quanta[name]), np.sort(plain.quanta[name]))
    rows = plain.rows_of(**zero.quanta)
    assert zero.energy_mhz == pytest.approx(plain.energy_mhz[rows], rel=1e-13, abs=1e-9)  # another LAPACK routine


def test_strengths_of_all_lines_from_a_level_add_up():
    """Σ_f S = (2J+1) μ²: the tilted axis mixes all species, so that all three dipole components interfere."""
    effects = (*SEMI_RIGID, AxisPower(3.0, TILTED))
    lines = line_list(top_in(), jmax=7, min_lgint=None, effects=effects)
    total = np.zeros(len(lines.levels))
    np.add.at(total, lines.upper, lines.strength_debye2)
    np.add.at(total, lines.lower, lines.strength_debye2)
    j = lines.levels.quanta["j"]
    inside = j < 7
    expected = (2 * j + 1) * sum(mu * mu for mu in DIPOLE)
    assert total[inside] == pytest.approx(expected[inside], rel=1e-12)  # some hundred terms
    assert lines.frequency_mhz.min() > 0


def test_q_and_intensities_see_the_effect():
    effects = (*SEMI_RIGID, AxisPower(5.0, TILTED))
    levels = solve_levels(top_in(), 40, effects=effects)
    kelvin = (levels.energy_mhz - levels.ground_mhz) * 4.799243073e-5
    by_hand = float((levels.degeneracy * np.exp(-kelvin / 20.0)).sum())
    assert partition_function(top_in(), 20.0, effects=effects).q == pytest.approx(by_hand, rel=2e-6)
    assert by_hand < 0.99 * partition_function(top_in(), 20.0).q
    assert line_list(top_in(), temperature_k=20.0, jmax=5, effects=effects).q == pytest.approx(by_hand, rel=2e-6)


def test_derivatives_are_differences_of_energies():
    step = 1e-4
    low, mid, high = (
        solve_levels(top_in(), 7, effects=(*SEMI_RIGID, AxisPower(1.0 + s, TILTED))) for s in (-step, 0.0, step)
    )
    derivative = level_derivatives(top_in(), mid, ["c_axis", "A"])
    slope = (high.energy_mhz - low.energy_mhz) / (2 * step)
    assert derivative[:, 0] == pytest.approx(slope, rel=1e-5, abs=1e-3)  # round-off of 1e-10 MHz over the step
    bigger = solve_levels(
        Top(Constants(A=A + 1e-3, B=B, C=C, representation="Ir")), 7, effects=(*SEMI_RIGID, AxisPower(1.0, TILTED))
    )
    assert derivative[:, 1] == pytest.approx((bigger.energy_mhz - mid.energy_mhz) / 1e-3, abs=2e-3)  # second order


def test_raman_lines_take_effects():
    tensor = ((4.0, 0.2, 0.1), (0.2, 3.0, 0.3), (0.1, 0.3, 2.0))
    top = top_in(polarizability_abc_angstrom3=tensor)
    lines = raman_lines(
        top, jmax=5, temperature_k=20.0, min_relative=None, effects=(*SEMI_RIGID, AxisPower(3.0, TILTED))
    )
    plain = raman_lines(top, jmax=5, temperature_k=20.0, min_relative=None)
    assert len(lines) > len(plain) * 0.9
    assert not np.isclose(lines.shift_mhz.max(), plain.shift_mhz.max(), rtol=1e-6)


def test_sizes_are_listed_largest_first():
    top = Top.from_constants("A=9000 B=5000 C=3500 DJ=0.001 MHz")
    sizes = effect_sizes(top, 10, [*SEMI_RIGID, AxisPower(0.01, TILTED)])
    assert [size.name for size in sizes] == ["rigid rotor", "fourth power along an axis", "centrifugal distortion"]
    effect = AxisPower(0.01, TILTED)
    plain, with_it = (
        np.sort(solve_levels(top_in(), 10, jmin=10, effects=e).energy_mhz) for e in (SEMI_RIGID, (*SEMI_RIGID, effect))
    )
    assert 1 / 3 < np.abs(with_it - plain).max() / effect.size_mhz(top, 10) <= 1.0  # the size is right within 3


# No operator is dropped


@dataclass(frozen=True)
class LadderSquares(QuantumEffect):
    """c (J₊² + J₋²), by its powers."""

    c_mhz: float

    def parameters(self, top):
        return {"c": self.c_mhz}

    def operators(self, top):
        return {"c": {(0, 0, 1): 1.0}}

    def size_mhz(self, top, j):
        return 2 * abs(self.c_mhz) * j * (j + 1)


@pytest.mark.parametrize(("kind", "constants"), [("prolate", "A=9000 B=4000"), ("oblate", "B=9000 C=5000")])
def test_a_symmetric_top_has_operators_off_the_diagonal(kind, constants):
    """100 MHz (J₊² + J₋²) moves the levels of a symmetric top as the full matrix says; the closed form is left."""
    top = Top.from_constants(f"{constants} MHz")
    assert top.kind == kind
    momenta = body_momenta(4)
    x, y, z = (momenta[axis] for axis in AXES["Ir" if kind == "prolate" else "IIIr"])
    equal, axial = (4000.0, 9000.0) if kind == "prolate" else (9000.0, 5000.0)
    slow = equal * (x @ x + y @ y) + axial * z @ z + 200.0 * (x @ x - y @ y)
    levels = solve_levels(top, 4, jmin=4, effects=(*SEMI_RIGID, LadderSquares(100.0)))
    assert np.sort(levels.energy_mhz) == pytest.approx(np.linalg.eigvalsh(slow), rel=1e-12)  # round-off
    assert levels.quanta_names == ("j", "ka", "kc")
    assert solve_levels(top, 4, effects=SEMI_RIGID).quanta_names == ("j", "k")
    derivative = level_derivatives(top, levels, ["c", "B"])
    assert derivative[:, 0] @ np.ones(9) == pytest.approx(0.0, abs=1e-9)  # the operator has no trace


def test_a_linear_top_refuses_what_it_has_no_room_for():
    top = Top.from_constants("B=5000 MHz", dipole_abc_debye=(1, 0, 0))
    with pytest.raises(ValueError, match="linear top in a Σ state has K = 0"):
        solve_levels(top, 3, effects=(*SEMI_RIGID, AxisPower(1.0, TILTED)))


def test_weights_that_an_effect_would_mix_are_refused():
    weights = SpinWeights.from_mapping({"ee": 1, "eo": 3, "oe": 3, "oo": 1})
    top = Top(Constants(A=A, B=B, C=C, representation="Ir"), spin_weights=weights)
    with pytest.raises(ValueError, match="mixes levels of nuclear-spin weights"):
        solve_levels(top, 3, effects=(*SEMI_RIGID, AxisPower(1.0, TILTED)))
    along_a = solve_levels(top, 3, effects=(*SEMI_RIGID, AxisPower(1.0, (1.0, 0.0, 0.0))))
    assert set(along_a.weight.tolist()) == {1, 3}


def test_an_odd_power_of_j_is_refused_within_a_state():
    class Odd(AxisPower):
        name = ""

        def j_operator(self, top, name, representation):
            from rotor.quantum.operators.rotation import components

            return components(representation)["a"]

    with pytest.raises(ValueError, match="not invariant under time reversal"):
        solve_levels(top_in(), 3, effects=(*SEMI_RIGID, Odd(1.0, TILTED)))


def test_an_operator_that_changes_j_is_refused():
    class Cosine(AxisPower):
        name = ""

        def j_operator(self, top, name, representation):
            from rotor.quantum.operators.rotation import body_tensor

            return body_tensor([0.0, 1.0, 0.0])

    with pytest.raises(ValueError, match="c_axis: the operator changes J"):
        solve_levels(top_in(), 3, effects=(*SEMI_RIGID, Cosine(1.0, TILTED)))


def test_a_field_is_refused_where_levels_have_no_m():
    class Field(AxisPower):
        conserved = frozenset({"m"})
        resolves_m = True

    with pytest.raises(ValueError, match="labelled by M"):
        solve_levels(top_in(), 3, effects=(*SEMI_RIGID, Field(0.01, TILTED)))


def test_a_linear_top_refuses_operators_off_the_diagonal():
    with pytest.raises(ValueError, match="a linear top in a Σ state has K = 0 and operators of J² alone"):
        solve_levels(Top.from_constants("B=6000 MHz"), 2, effects=(*SEMI_RIGID, LadderSquares(100.0)))
