"""Which lines exist, how strong they are: sum rules, closed forms, cuts, columns."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.quantum.blocks.reduced import connected_wang_blocks, wang_amplitudes
from rotor.quantum.operators.tensors import body_tensor
from rotor.quantum.solve import solve_levels
from rotor.spectra.intensity import EINSTEIN_PER_MHZ3, INTENSITY_NM2_MHZ
from rotor.spectra.lines import line_list
from rotor.spectra.transitions import pairs as transitions
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.operators import REPRESENTATIONS
from rotor.tops.top import Top

ABC = "A=8572 B=3640 C=2790 MHz"


def sum_over_final_states(top: Top, j: int) -> dict[str, np.ndarray]:
    """Σ S_g over all final states with J-1, J, J+1, for every level of J and each component g, unit dipoles."""
    levels = solve_levels(top, j + 1, jmin=j - 1)
    sums = {axis: np.zeros(len(levels)) for axis in "abc"}
    for axis, direction in zip("abc", np.eye(3), strict=True):
        dipole = body_tensor(direction, 1, str(levels.representation))
        for up, low in connected_wang_blocks(levels.blocks, dipole):
            strength = wang_amplitudes(up, low, dipole) ** 2
            sums[axis][up.start : up.start + up.basis.size] += strength.sum(axis=1)
            sums[axis][low.start : low.start + low.basis.size] += strength.sum(axis=0)
    return {axis: total[levels.quanta["j"] == j] for axis, total in sums.items()}


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("j", [1, 2, 17])
def test_strengths_from_one_level_add_up(j, representation):
    """Σ S_g = 2J+1 for each component, whatever the top (J. K. G. Watson's sum rule; Φ_Fg² summed over F is 1)."""
    top = Top(Constants(A=8572.0, B=3640.0, C=2790.0, representation=representation))
    for total in sum_over_final_states(top, j).values():
        assert np.allclose(total, 2 * j + 1, rtol=1e-13)  # round-off of 2J+1 terms


def test_strengths_add_up_at_300():
    for total in sum_over_final_states(Top.from_constants(ABC), 300).values():
        assert np.allclose(total, 601, rtol=1e-12)  # round-off of 600 terms


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_every_representation_gives_the_same_lines(representation):
    """Also with a c-type dipole; only phases of vectors may differ."""
    make = lambda r: line_list(  # noqa: E731
        Top(Constants(A=8572.0, B=3640.0, C=2790.0, representation=r), (1.2, 1.9, 0.4)), jmax=12, min_lgint=None
    )
    ours, theirs = make(representation), make("Ir")
    key = lambda lines: np.lexsort((*lines.quanta(lines.upper).T, *lines.quanta(lines.lower).T))  # noqa: E731
    i, k = key(ours), key(theirs)
    assert np.allclose(ours.frequency_mhz[i], theirs.frequency_mhz[k], atol=1e-8)  # round-off of 1e6 MHz
    assert np.allclose(ours.strength_debye2[i], theirs.strength_debye2[k], atol=1e-11)


def test_how_many_lines_are_allowed():
    """Three components, J' = J and J ± 1: n_up n_low for every pair of blocks, 12.1 million to J = 200 (peers.md)."""
    lines = line_list(Top.from_constants(ABC, dipole_abc_debye=(1, 1, 1)), jmax=60, min_lgint=None, sort=False)
    n = lambda j, s: sum(b.basis.size for b in lines.levels.blocks if b.basis.j == j and b.basis.species == s)  # noqa: E731
    species = ("ee", "eo", "oe", "oo")
    q = sum(n(j, p) * n(j, s) for j in range(61) for i, p in enumerate(species) for s in species[i + 1 :])
    r = sum(n(j, p) * n(j + 1, s) for j in range(60) for p in species for s in species if p != s)
    assert len(lines) == q + r


def test_selection_rules():
    water = line_list(Top.from_constants(ABC, dipole_abc_debye=(0, 1.8, 0)), jmax=8, min_lgint=None)
    up, low = water.quanta(water.upper), water.quanta(water.lower)
    assert ((up - low)[:, 1] % 2 == 1).all()
    assert ((up - low)[:, 2] % 2 == 1).all()


def test_missing_levels_make_no_lines():
    """SO2: only (Ka + Kc) even exist."""
    top = Top.from_constants(ABC, dipole_abc_debye=(0, 1.6, 0), spin_weights={"ee": 1, "eo": 0, "oe": 0, "oo": 1})
    lines = line_list(top, jmax=10, min_lgint=None)
    quanta = np.concatenate([lines.quanta(lines.upper), lines.quanta(lines.lower)])
    assert len(lines) > 0
    assert ((quanta[:, 1] + quanta[:, 2]) % 2 == 0).all()


def test_linear_molecule():
    """ν = 2B(J+1), S = J+1, A(1-0) of CO from its formula."""
    lines = line_list(Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11011, 0, 0)), jmax=3, min_lgint=None)
    assert np.allclose(lines.frequency_mhz, 2 * 57635.968 * np.arange(1, 4))
    assert np.allclose(lines.strength_debye2, 0.11011**2 * np.arange(1, 4))
    assert lines.einstein_a_per_s[0] == pytest.approx(7.2e-8, rel=0.01)  # CO 1-0, as published


def test_constants_of_intensity_are_codata():
    """8π³/3hc and 64π⁴/3hc³ from the SI; the catalogues' 4.16231e-5 is 1.7e-5 below CODATA 2022."""
    common = np.pi**2 * units.DEBYE_C_M**2 / (3 * units.VACUUM_PERMITTIVITY_F_PER_M * units.PLANCK_J_S) * 1e18
    assert common * 2 / units.SPEED_OF_LIGHT_M_PER_S == pytest.approx(INTENSITY_NM2_MHZ, rel=1e-8)
    assert common * 16 * np.pi / units.SPEED_OF_LIGHT_M_PER_S**3 == pytest.approx(EINSTEIN_PER_MHZ3, rel=1e-8)


def test_symmetric_top_joins_the_asymmetric_one():
    """Hard case 6: CH3CN-like lines in closed form and from Wang blocks with B = C (1 + 1e-13), both dipoles."""
    symmetric = line_list(Top.from_constants("A=150 B=9 GHz", dipole_abc_debye=(3.9, 0.5, 0)), jmax=9, min_lgint=None)
    near = Constants(A=150000.0, B=9000.0 * (1 + 1e-13), C=9000.0, kind="asymmetric")
    asymmetric = line_list(Top(near, (3.9, 0.5, 0.0)), jmax=9, min_lgint=None)
    # K doublets of one J, and changes of K by more than 1, are lines of an asymmetric top only
    real = asymmetric.where((asymmetric.frequency_mhz > 1.0) & (asymmetric.strength_debye2 > 1e-15))

    def totals(lines):
        rounded = np.round(lines.frequency_mhz, 3)
        return {f: lines.strength_debye2[rounded == f].sum() for f in np.unique(rounded)}

    ours, theirs = totals(symmetric), totals(real)
    assert ours.keys() == theirs.keys()
    assert all(ours[f] == pytest.approx(theirs[f], rel=1e-9) for f in ours)


def test_cut_and_range_only_leave_out():
    top = Top.from_constants(ABC, dipole_abc_debye=(1.2, 1.9, 0.4))
    everything = line_list(top, jmax=20, min_lgint=None)
    cut = line_list(top, jmax=20, min_lgint=-8.0, range_mhz=(1e4, 2e5))
    expected = (everything.lgint >= -8.0) & (everything.frequency_mhz >= 1e4) & (everything.frequency_mhz <= 2e5)
    assert len(cut) == expected.sum()
    assert np.allclose(cut.frequency_mhz, everything.frequency_mhz[expected], rtol=0)
    assert (np.diff(cut.frequency_mhz) >= 0).all()


def test_default_jmax_reaches_every_line_above_the_cut():
    top = Top.from_constants(ABC, dipole_abc_debye=(1.2, 1.9, 0.4))
    lines = line_list(top, temperature_k=5.0)
    further = line_list(top, temperature_k=5.0, jmax=lines.jmax + 15)
    assert len(further) == len(lines)


def test_compiled_and_plain_loops_give_the_same_bits(monkeypatch):
    top = Top.from_constants(ABC, dipole_abc_debye=(1.2, 1.9, 0.4))
    plain = line_list(top, jmax=15, min_lgint=None, sort=False)
    monkeypatch.setattr(transitions, "LONG_LIST", 0)
    compiled = line_list(top, jmax=15, min_lgint=None, sort=False)
    for name in ("frequency_mhz", "strength_debye2", "upper", "lower"):
        assert np.array_equal(getattr(plain, name), getattr(compiled, name))


@pytest.mark.parametrize(
    ("constants", "weights", "settings"),
    [
        (ABC, None, {"min_lgint": -7.0, "jmax": 40}),
        (ABC, None, {"min_lgint": -5.5, "jmax": 60, "temperature_k": 20.0}),  # most states of high J reach no line
        # the lower state at the higher J, its partner above the states that may be lower ones
        ("A=90 B=5 C=4.8 GHz", None, {"min_lgint": -6.0, "jmax": 8, "temperature_k": 1.0}),
        (
            "A=90 B=5 C=4.8 GHz",
            {"ee": 1, "eo": 3, "oe": 3, "oo": 1},
            {"min_lgint": -9.0, "jmax": 35, "temperature_k": 30.0},
        ),
        (ABC, None, {"min_lgint": -7.0, "jmax": 40, "range_mhz": (1e4, 2e5)}),
        (ABC, None, {"min_lgint": None, "jmax": 20, "range_mhz": (1e3, 9e4)}),
        (
            "A=9 B=5 C=3 DeltaJ=1e-6 DeltaK=2e-6 GHz",
            {"ee": 0, "eo": 1, "oe": 1, "oo": 0},
            {"min_lgint": -6.0, "jmax": 40},
        ),
    ],
)
def test_a_cut_list_is_the_whole_list_cut(constants, weights, settings):
    """States that cannot reach the cut are left out before their lines are made: no line may be lost so."""
    dipole = (0, 1.9, 0) if weights else (1.2, 1.9, 0.4)
    top = Top.from_constants(constants, dipole_abc_debye=dipole, spin_weights=weights)
    least, (first, last) = settings.get("min_lgint") or -math.inf, settings.get("range_mhz", (0.0, math.inf))
    rest = {name: settings[name] for name in ("jmax", "temperature_k") if name in settings}
    cut = line_list(top, q=1e4, untrusted=True, **settings)
    whole = line_list(top, q=1e4, min_lgint=None, untrusted=True, **rest)
    whole = whole[(whole.lgint >= least) & (whole.frequency_mhz >= first) & (whole.frequency_mhz <= last)]
    assert 0.001 < len(cut) / max(len(line_list(top, q=1e4, min_lgint=None, untrusted=True, **rest)), 1) < 0.99
    labels = [np.lexsort((lines.lower, lines.upper)) for lines in (cut, whole)]
    assert np.array_equal(cut.upper[labels[0]], whole.upper[labels[1]])
    assert np.array_equal(cut.lower[labels[0]], whole.lower[labels[1]])
    assert np.array_equal(cut.frequency_mhz[labels[0]], whole.frequency_mhz[labels[1]])
    assert np.allclose(
        cut.strength_debye2[labels[0]], whole.strength_debye2[labels[1]], rtol=1e-6
    )  # weak ones by cancellation


def test_given_q_and_vibrational_factor():
    top = Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0))
    plain, doubled = line_list(top, jmax=3, q=100.0), line_list(top, jmax=3, q=100.0, vibrational_factor=2.0)
    assert np.allclose(plain.lgint - doubled.lgint, math.log10(2))
    assert doubled.q == 200.0


@pytest.mark.parametrize("temperature", [0.0, -3.0, math.nan, math.inf])
def test_impossible_temperature(temperature):
    with pytest.raises(ValueError, match="above 0 K"):
        line_list(Top.from_constants("B=1 GHz", dipole_abc_debye=(1, 0, 0)), temperature_k=temperature, jmax=1)


def test_unknown_dipole_is_an_error():
    with pytest.raises(ValueError, match="dipole of this top is not known"):
        line_list(Top.from_constants("B=1 GHz"), jmax=1)


def test_tables_have_every_column():
    lines = line_list(Top.from_constants(ABC, dipole_abc_debye=(1.2, 0, 0)), jmax=3)
    frame = lines.to_pandas()
    assert list(frame.columns) == [
        "frequency_mhz", "lgint", "energy_lower_cm", "g_upper", "einstein_a_per_s", "strength_debye2", "intensity_cm_per_molecule",
        "j_upper", "ka_upper", "kc_upper", "j_lower", "ka_lower", "kc_lower",
    ]  # fmt: skip
    assert lines.to_polars().shape == frame.shape


def test_levels_beyond_a_table_of_energies_and_the_cut_are_not_solved():
    """All lines join levels of the table; J up to 1000 took 100 s for the same list."""
    top = rotor.read("water")
    whole, beyond = line_list(top), line_list(top, jmax=1000)
    assert beyond.jmax == whole.jmax
    assert np.array_equal(beyond.frequency_mhz, whole.frequency_mhz)
    assert beyond.untrusted == whole.untrusted
    hot = line_list(top, temperature_k=1e5, jmax=25, q=1e6)  # the cut is beyond J = 600
    assert hot.jmax == 25
