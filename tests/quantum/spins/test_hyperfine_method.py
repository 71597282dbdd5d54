"""Exact, with N as a good quantum number, and first order: what is used, what that neglects, and that the estimate holds."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.splittings import casimir
from rotor.quantum.hyperfine_method import used_method
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

CHLORIDE = Top.from_constants(
    "A=9000 B=3000 C=2300 MHz", dipole_abc_debye=(1.0, 0.5, 0.0),
    spin_constants=SpinConstants.parse("chi_aa(35Cl)=-57 chi_bb-cc(35Cl)=-4 chi_ab(35Cl)=30 C_aa(35Cl)=0.01 MHz"),
)  # fmt: skip
TWO = Top.from_constants(
    "A=40000 B=5000 C=4500 MHz", dipole_abc_debye=(1.0, 0.0, 0.0),
    spin_constants=SpinConstants.parse("chi_aa(14N)=-4.2 chi_bb-cc(14N)=1.1 chi_aa(D)=0.2 C_iso(D)=0.002 MHz"),
)  # fmt: skip


def energies(top: Top, method: str, jmax: int = 6, tolerance_mhz: float = 1e-4) -> np.ndarray:
    """Energies by labels, so that methods can be compared."""
    levels = solve_levels(top, jmax, effects=effects_of(top, True, method, tolerance_mhz))
    order = np.lexsort([levels.quanta[name] for name in levels.quanta])
    return np.asarray(levels.energy_mhz[order])


def test_first_order_is_casimirs_formula():
    """One nucleus on a linear molecule: -χ Y(F), without anything of second order."""
    top = Top.from_constants("B=12000 MHz", spin_constants=SpinConstants.parse("chi_aa(35Cl)=-70 MHz"))
    levels = solve_levels(top, 4, effects=effects_of(top, True, "first-order"))
    n, f = levels.quanta["n"], levels.quanta["f"]
    shifts = levels.energy_mhz - 12000.0 * n * (n + 1)
    expected = [70 * casimir(3, j, twice) if j else 0.0 for j, twice in zip(n.tolist(), f.tolist(), strict=True)]
    assert shifts == pytest.approx(expected, abs=1e-9)  # round-off of 240 GHz


@pytest.mark.parametrize("top", [CHLORIDE, TWO], ids=["one nucleus", "two nuclei"])
def test_the_estimate_bounds_the_difference(top):
    exact, first = energies(top, "exact"), energies(top, "first-order")
    used = used_method(solve_levels(top, 6, effects=effects_of(top, True, "first-order")))
    assert used is not None
    difference = 2 * np.abs(exact - first).max()
    assert (
        0.02 * used.estimate_mhz < difference < used.estimate_mhz
    )  # a bound of second order over all elements of a state


def test_auto_takes_the_cheapest_within_the_tolerance():
    methods = {}
    for tolerance in (1e-9, 1e-3, 1.0, 100.0):
        levels = solve_levels(CHLORIDE, 5, effects=effects_of(CHLORIDE, True, "auto", tolerance))
        used = used_method(levels)
        assert used is not None
        assert used.estimate_mhz <= tolerance
        assert np.abs(energies(CHLORIDE, "auto", 5, tolerance) - energies(CHLORIDE, "exact", 5)).max() <= tolerance
        methods[tolerance] = used.method
    assert methods[1e-9] == "exact"
    assert methods[100.0] == "first-order"
    assert used_method(solve_levels(CHLORIDE, 2, effects=effects_of(CHLORIDE, True))) is None


def test_n_is_good_between_first_order_and_exact():
    """Close doublets of Ka = 1 that χ_bc joins are far from first order, and N is good all the same."""
    top = Top.from_constants(
        "A=90000 B=3000.2 C=2999.8 MHz",
        spin_constants=SpinConstants.parse("chi_bb-cc(14N)=2 chi_aa(14N)=-4 chi_bc(14N)=2 MHz"),
    )
    levels = solve_levels(top, 4, effects=effects_of(top, True, "auto", 0.05))
    used = used_method(levels)
    assert used is not None
    assert used.method == "N-diagonal"
    assert np.abs(energies(top, "auto", 4, 0.05) - energies(top, "exact", 4)).max() <= 0.05


def test_strengths_of_first_order_add_up_to_the_line_without_spins():
    lines = line_list(TWO, jmax=2, temperature_k=20.0, effects=effects_of(TWO, True, "first-order"), min_lgint=None)
    plain = line_list(TWO, jmax=2, temperature_k=20.0, min_lgint=None)
    assert lines.q == pytest.approx(9 * plain.q, rel=1e-12)
    for row in range(len(plain)):
        near = np.abs(lines.frequency_mhz - plain.frequency_mhz[row]) < 20
        assert lines.strength_debye2[near].sum() == pytest.approx(9 * plain.strength_debye2[row], rel=1e-12)


def test_a_method_goes_to_other_processes():
    effects = effects_of(TWO, True, "auto", 1e-3)
    again = pickle.loads(pickle.dumps(effects))  # what an executor does
    assert (again[-1].method, again[-1].tolerance_mhz) == ("auto", 1e-3)


@pytest.mark.parametrize(
    ("method", "tolerance", "says"), [("exactly", 1.0, "exactly"), ("auto", -1.0, "tolerance_mhz"), ("auto", 0.0, "tolerance_mhz")]
)  # fmt: skip
def test_other_methods_are_refused(method, tolerance, says):
    with pytest.raises(ValueError, match=says):
        effects_of(TWO, True, method, tolerance)


def test_diagonal_elements_are_taken_together():
    """Two or three elements are the tensor itself, not sums of axial ones; a trace is refused."""
    pair = SpinConstants.parse("chi_aa(14N)=1.9543 chi_bb(14N)=1.89665 MHz")
    assert dict(pair.values) == pytest.approx({"chi_aa(14N)": 1.9543, "chi_bb-cc(14N)": 5.7476}, abs=1e-12)
    three = SpinConstants.parse("chi_aa(14N)=1.9543 chi_bb(14N)=1.89665 chi_cc(14N)=-3.85095 MHz")
    assert dict(three.values) == pytest.approx(dict(pair.values), abs=1e-12)
    with pytest.raises(ValueError, match=r"chi\(14N\): aa \+ bb \+ cc = 1 MHz; the tensor is traceless"):
        SpinConstants.parse("chi_aa(14N)=2 chi_bb(14N)=2 chi_cc(14N)=-3 MHz")
    with pytest.raises(ValueError, match="beside aa, bb"):
        SpinConstants.parse("chi_aa(14N)=2 chi_bb(14N)=2 chi_bb-cc(14N)=-3 MHz")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("chi_aa(14N)=2 chi_bb(14N)=2 chi_cc(14N)=-3 MHz", "traceless"),
        ("chi_aa(99N)=2 MHz", "99N"),
        ("chi_aa(13C)=2 MHz", "a spin of 1 or more"),
    ],
)
def test_the_command_line_refuses_in_one_line(text, says, capsys):
    from rotor.cli import run

    assert run(["spectrum", "HCN", "--spin-constants", text]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def test_the_command_line_says_which_method_was_used(capsys):
    from rotor.cli import run

    command = ["spectrum", "HCONH2", "--hyperfine", "--jmax", "3"]
    assert run([*command, "--hyperfine-method", "auto", "--hyperfine-tolerance", "1kHz"]) == 0
    out = capsys.readouterr().out
    assert "hyperfine     first-order: differs from exact by less than" in out
    assert run(command) == 0
    assert "hyperfine     exact" in capsys.readouterr().out
    assert run([*command, "--hyperfine-method", "best"]) == 2
    assert "auto, exact, N-diagonal, first-order" in capsys.readouterr().err
    assert run(["spectrum", "HCONH2", "--hyperfine-method", "auto"]) == 2
    assert "--hyperfine" in capsys.readouterr().err
    assert rotor.read("HCONH2").spin_constants is not None


def test_a_picture_names_the_components_inside_its_axes():
    from rotor.plots.spectra.spectrum import spectrum_figure

    top = rotor.read("HCONH2")
    lines = line_list(top, jmax=2, temperature_k=300.0, effects=effects_of(top, True))
    figure = spectrum_figure(lines, range_mhz=(21206.0, 21209.0))
    axes = figure.axes[0]
    figure.canvas.draw()
    names = {text.get_text(): text.get_window_extent() for text in axes.texts}
    assert len(names) == 3
    assert any("$F = 2 – 1$" in name for name in names)
    assert all(box.y1 <= axes.bbox.y1 for box in names.values())
    assert axes.get_xlabel() == "Frequency (MHz)"


def test_unresolved_components_are_one_line(capsys):
    """Sums of intensity stay, the mean is that of the line without spins, and nothing of another line comes in."""
    from rotor.cli import run
    from rotor.spectra.patterns import patterns

    top = rotor.read("HCONH2")
    lines = line_list(top, jmax=4, temperature_k=300.0, effects=effects_of(top, True))
    for resolution in (1e-6, 0.5, 50.0):
        pattern = patterns(lines, resolution)
        assert pattern.components.sum() == len(lines)
        assert pattern.intensity_nm2_mhz.sum() == pytest.approx(lines.intensity_nm2_mhz.sum(), rel=1e-12)
    plain = line_list(top, jmax=4, temperature_k=300.0)
    strong = pattern.intensity_nm2_mhz > 1e-7
    assert strong.sum() > 30
    for frequency in pattern.frequency_mhz[strong]:
        assert np.abs(plain.frequency_mhz - frequency).min() < 0.02  # second order, χ²/(B + C) is 1 kHz; and the cut
    command = ["spectrum", "HCONH2", "--hyperfine", "--jmax", "2", "--range", "21206:21209"]
    assert run([*command, "--resolution", "0.7"]) == 0
    out = capsys.readouterr().out
    assert "components" in out
    assert "21206.4546" in out
    assert "21207.3340" not in out


def test_levels_beyond_the_reach_of_the_constants_make_no_lines_with_spins_either():
    """A series that turns down near J = 25: its levels far below 0 would take the whole population."""
    plain = Top.from_constants("A=72000 B=11400 C=9800 DJ=0.5 DJK=-1 HJ=-0.01 MHz", dipole_abc_debye=(3.6, 0, 0))
    top = replace(plain, spin_constants=SpinConstants.parse("chi_aa(14N)=2 chi_bb-cc(14N)=5.7 MHz"))
    bare = line_list(plain, jmax=40, min_lgint=None, q=1.0)
    split = line_list(top, jmax=40, min_lgint=None, q=1.0, effects=effects_of(top, True))
    assert solve_levels(plain, 40).energy_mhz.min() < -1e6
    assert split.untrusted > bare.untrusted > 0
    rows = [np.flatnonzero(lines.levels.weight > 0) for lines in (bare, split)]
    bare_kept, split_kept = (
        {tuple(q[:3]) for q in lines.levels.quanta_of(r).tolist()} for lines, r in zip((bare, split), rows, strict=True)
    )
    assert bare_kept == split_kept
    low = line_list(top, jmax=2, min_lgint=None, q=1.0, effects=effects_of(top, True))
    ends = [np.hstack([item.quanta(item.upper), item.quanta(item.lower)]).tolist() for item in (low, split)]
    split_rows = [ends[1].index(quanta) for quanta in ends[0]]
    assert split.lgint[split_rows] == pytest.approx(low.lgint, abs=1e-12)  # the same arithmetic


def random_tops(seed: int, count: int):
    """Tops with one to three nuclei whose K doublets or other levels nearly coincide, and the highest N worth comparing."""
    draw = np.random.default_rng(seed)
    for _ in range(count):
        low = 10 ** draw.uniform(3, 4.5)
        near = low * (1 + 10 ** draw.uniform(-6, -2))
        abc = ((low * draw.uniform(2, 10), near, low), (2 * near, 2 * low, 1.01 * low))[draw.integers(2)]
        names = draw.choice(["35Cl", "14N", "D"], draw.integers(1, 4), replace=False)
        size = 10 ** draw.uniform(-1, 2)
        parts = [(name, part) for name in names for part in ("aa", "bb-cc", "ab", "bc")]
        text = " ".join(f"chi_{part}({name})={size * draw.normal():.9g}" for name, part in parts)
        top = Top.from_constants(dict(zip("ABC", abc, strict=True)), spin_constants=SpinConstants.parse(text + " MHz"))
        yield top, (6, 3, 1)[len(names) - 1]


def test_the_estimate_holds_where_levels_nearly_coincide():
    """What levels of one F, in order of energy, do at least differ by; lines may differ by twice as much."""
    for top, nmax in random_tops(13, 6):
        exact = solve_levels(top, nmax, effects=effects_of(top, True))
        for method in ("N-diagonal", "first-order"):
            simple = solve_levels(top, nmax, effects=effects_of(top, True, method))
            used = used_method(simple)
            assert used is not None
            order = [np.lexsort((levels.energy_mhz, levels.multiplicity)) for levels in (exact, simple)]
            shift = simple.energy_mhz[order[1]] - exact.energy_mhz[order[0]]
            assert shift.max() - shift.min() <= used.estimate_mhz


@pytest.mark.parametrize("spins", [None, SpinConstants.parse("chi_aa(14N)=2 chi_bb-cc(14N)=5.7 MHz")])
def test_states_whose_levels_fall_below_the_ground_keep_their_lines_of_low_j(spins):
    """The same series in two states: J with a level below 0 are left out, and the lines of low J have their population."""
    states = StateConstants(
        {"E[1]": 1e5, "A[1]": 71900.0, "B[1]": 11390.0, "C[1]": 9790.0, "DJ[1]": 0.5, "DJK[1]": -1.0, "HJ[1]": -0.01}
    )
    plain = "A=72000 B=11400 C=9800 DJ=0.5 DJK=-1 HJ=-0.01 MHz"
    top = Top.from_constants(plain, dipole_abc_debye=(3.6, 0, 0), states=states, spin_constants=spins)
    effects = effects_of(top, spins is not None)
    high, low = (line_list(top, jmax=j, min_lgint=None, q=1.0, effects=effects) for j in (36, 3))
    assert high.untrusted > 0 == low.untrusted
    selected = high.levels.rotational[high.levels.weight > 0]
    assert 20 < selected.max() < 36
    ends = [np.hstack([item.quanta(item.upper), item.quanta(item.lower)]).tolist() for item in (low, high)]
    rows = [ends[1].index(quanta) for quanta in ends[0]]
    assert high.lgint[rows] == pytest.approx(
        low.lgint, abs=1e-9
    )  # blocks of other sizes: round-off of energies over kT
