"""Levels, strengths and derivatives with spins and several states, against the full matrices of `full_matrix.py`."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from full_matrix_codes import case_of
from full_matrix_levels import solve, strengths

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.spin_effect import NuclearQuadrupole, SpinRotation, SpinSpin, quadrupole_of_tensor
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins import Scheme, Spin
from rotor.spectra.transitions.pairs import all_transitions
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

ASYMMETRIC = Top(Constants(A=9400.0, B=3100.0, C=2500.0, DeltaJK=-2.0, deltaK=0.3), dipole_abc_debye=(1.2, 0.7, 0.4))
LINES = ((10000, 9400.0), (20000, 3100.0), (30000, 2500.0), (1100, 2.0), (41000, -0.3))
N, CL, S, H, T = Spin("N", 2), Spin("Cl", 3), Spin("S", 1, True), Spin("H", 1), Spin("T", 2, True)
CHI = {"chi_aa": -57.0, "chi_bb-cc": -4.2, "chi_ab": 60.3, "chi_ac": -8.2, "chi_bc": 5.5}
CHI_CODES = {
    "chi_aa": (10000, 1.5),
    "chi_bb-cc": (40000, 0.25),
    "chi_ab": (610000, 1.0),
    "chi_ac": (410000, 1.0),
    "chi_bc": (210000, 1.0),
}


def _named(values: dict[str, float], spin: str) -> dict[str, float]:
    return {f"{name}({spin})": value for name, value in values.items()}


def _chi_lines(values: dict[str, float], place: int) -> list[tuple[int, float]]:
    return [(110_000_000 * place + CHI_CODES[name][0], CHI_CODES[name][1] * value) for name, value in values.items()]


CASES = {
    "one nucleus, chi off the diagonal": (
        "a 4", [NuclearQuadrupole(_named(CHI, "Cl"), (CL,))], _chi_lines(CHI, 1)),
    "two nuclei with their spin-spin coupling": (
        "a 34",
        [NuclearQuadrupole(_named(CHI, "Cl") | {"chi_aa(N)": 2.9, "chi_ab(N)": 1.1}, (CL, N)),
         SpinSpin({"J(Cl,N)": 3.0, "T_aa(Cl,N)": -6.0, "T_bb-cc(Cl,N)": 8.0, "T_ab(Cl,N)": 4.0}, (CL, N))],
        [*_chi_lines(CHI, 1), (220010000, 1.5 * 2.9), (220610000, 1.1), (120000000, 3.0), (120010000, -9.0), (120040000, 2.0),
         (120610000, 4.0)]),
    "doublet with a nucleus of spin 1": (
        "a 32",
        [SpinRotation({"eps_aa(S)": 30.0, "eps_bb(S)": -12.0, "eps_cc(S)": 9.0, "eps_ab(S)": 5.0,
                       "eps_aa_J(S)": 0.4, "gamma_K(S)": 0.2}, (S, N)),
         SpinSpin({"b_F(S,N)": 140.0, "T_aa(S,N)": 60.0, "T_bb-cc(S,N)": -17.0, "T_bc(S,N)": 8.0}, (S, N)),
         NuclearQuadrupole({"chi_aa(N)": 5.1}, (S, N))],
        [(10010000, 30.0), (10020000, -12.0), (10030000, 9.0), (10610000, 5.0), (10010100, 0.4), (10001000, 0.2), (120000000, 140.0),
         (120010000, 90.0), (120040000, -4.25), (120210000, 8.0), (220010000, 7.65)]),
    "triplet with a proton": (
        "a 23",
        [SpinSpin({"D_aa(T)": 59000.0, "D_bb-cc(T)": 3600.0, "b_F(T,H)": 90.0}, (T, H)),
         SpinRotation({"gamma(T)": -250.0, "gamma_S(T)": 1.5}, (T, H))],
        [(110010000, 1.5 * 2 * 59000.0), (110040000, 2 * 900.0), (120000000, 90.0), (10000000, -250.0), (11000000, 1.5)]),
    "powers of N², Nz² and N·S together": (
        "a 2", [SpinRotation({"C_aa_K(H)": 0.7, "C_ab_JK(H)": 0.3, "C_bb_JS(H)": 0.11}, (H,))],
        [(10011000, 0.7), (10611100, 0.3), (11020100, 0.11)]),
}  # fmt: skip


def _case(options: str, lines, dipoles: str = " 1 1.2\n 2 0.7\n 3 0.4\n"):
    text = "".join(f"{code} {value!r} 1.0\n" for code, value in lines)
    par = read_par(f"a case\n{len(lines)} 1 1 0 0.0 1e6 1.0 1.0\n{options}\n{text}".encode())
    return case_of(par, read_int(f"a case\n0 999 1000.0 0 9 -30 -30 9999.99 300.0\n{dipoles}".encode()))


def _of_f(levels, twice_f: int) -> dict[tuple[int, ...], float]:
    """Energies of the levels of one F by the quantum numbers that the files print."""
    rows = np.flatnonzero(levels.multiplicity == twice_f + 1)
    names = ["n" if "n" in levels.quanta else "j", "ka", "kc"]
    names += [name for name in levels.quanta if name not in (*names, "v")]
    if "v" in levels.quanta:
        names.insert(3, "v")
    columns = [(levels.quanta[q][rows] + 1) // 2 if q in levels.halves else levels.quanta[q][rows] for q in names]
    return dict(zip(zip(*(c.tolist() for c in columns), strict=True), levels.energy_mhz[rows], strict=True))


@pytest.mark.parametrize("name", CASES)
def test_levels_and_labels(name):
    options, effects, lines = CASES[name]
    case = _case(f"{options} 1 0 30 0 1 1 1 0 1 0", [*LINES, *lines])
    levels = solve_levels(ASYMMETRIC, 6, effects=(*SEMI_RIGID, *effects))
    total = sum(case.states[0].spins2)
    for twice_f in range(total % 2, 2 * 4 + 1, 2):
        slow = solve(case, twice_f)
        expected = {q: e for q, e in zip(slow.quanta, slow.energy_mhz, strict=True) if q[0] <= 6}
        computed = _of_f(levels, twice_f)
        assert set(computed) == set(expected)
        worst = max(abs(computed[q] - expected[q]) for q in expected)
        assert worst < 1e-8  # 1e-14 of the largest element, 1e6 MHz, and its rounding in two orders of summation


@pytest.mark.parametrize("name", CASES)
def test_strengths_between_two_f_add_up(name):
    """Σ of line strengths between all levels of two F with N ≤ 6, level by level."""
    options, effects, lines = CASES[name]
    case = _case(f"{options} 1 0 30 0 1 1 1 0 1 0", [*LINES, *lines])
    levels = solve_levels(ASYMMETRIC, 4, effects=(*SEMI_RIGID, *effects))
    transitions = all_transitions(levels, ASYMMETRIC.dipole_abc_debye)
    total = sum(case.states[0].spins2)
    slow = {f: solve(case, f) for f in range(total % 2, 8, 2)}
    by_energy = {}
    for f, block in slow.items():
        by_energy |= {(f, q): (f, i) for i, q in enumerate(block.quanta)}
    labels = [_label(levels, row) for row in range(len(levels))]
    s = {(f, g): strengths(case, slow[f], slow[g]) for f in slow for g in slow if abs(f - g) <= 2}
    compared = 0
    for strength, up, low in zip(transitions.strength_debye2, transitions.upper, transitions.lower, strict=True):
        a, b = by_energy.get(labels[up]), by_energy.get(labels[low])
        if a and b:
            assert strength == pytest.approx(
                s[a[0], b[0]][a[1], b[1]], abs=1e-6
            )  # some levels are 1e-3 MHz apart, and mix at 1e-9/1e-3
            compared += 1
    assert compared > 200


def _label(levels, row: int) -> tuple[int, tuple[int, ...]]:
    names = ["n", "ka", "kc", *(name for name in levels.quanta if name not in ("n", "ka", "kc", "v"))]
    halves = [
        (int(levels.quanta[q][row]) + 1) // 2 if q in levels.halves else int(levels.quanta[q][row]) for q in names
    ]
    return int(levels.multiplicity[row]) - 1, tuple(halves)


@pytest.mark.parametrize("name", CASES)
def test_derivatives_of_split_levels_are_differences(name):
    """∂E/∂c against central differences, of the rotation's constants and of every spin parameter."""
    _, effects, _ = CASES[name]
    all_effects = (*SEMI_RIGID, *effects)
    top_n = 3 if len(effects) == 1 else 1
    levels = solve_levels(ASYMMETRIC, top_n, effects=all_effects)
    names = [*ASYMMETRIC.constants.values, *(key for effect in effects for key in effect.values)]
    analytic = level_derivatives(ASYMMETRIC, levels, names)
    for column, key in enumerate(names):
        step = 1e-3
        sides = []
        for sign in (1, -1):
            top, changed = ASYMMETRIC, all_effects
            if key in top.constants.values:
                values = {**top.constants.values, key: top.constants[key] + sign * step}
                top = replace(top, constants=Constants(**values))
            else:
                changed = tuple(
                    replace(e, values={**e.values, key: e.values[key] + sign * step})
                    if key in getattr(e, "values", {})
                    else e
                    for e in all_effects
                )
            sides.append(solve_levels(top, top_n, effects=changed).energy_mhz)
        numeric = (sides[0] - sides[1]) / (2 * step)
        size = max(1.0, np.abs(analytic[:, column]).max())
        np.testing.assert_allclose(
            analytic[:, column], numeric, atol=2e-6 * size
        )  # 1e-10 of 1e5 MHz over 2e-3, second order in gaps


def test_sum_over_f_is_the_rotors_strength():
    """Hyperfine structure shares out the strength of a rotational line, times 2I+1."""
    bare = solve_levels(ASYMMETRIC, 3)
    split = solve_levels(ASYMMETRIC, 3, effects=(*SEMI_RIGID, NuclearQuadrupole(_named(CHI, "Cl"), (CL,))))
    single, parts = (all_transitions(levels, (1.2, 0.7, 0.4)) for levels in (bare, split))
    for up, low in (((1, 0, 1), (0, 0, 0)), ((2, 1, 2), (1, 0, 1)), ((3, 0, 3), (2, 1, 2))):
        whole = _between(bare, single, "j", up, low)
        assert _between(split, parts, "n", up, low) == pytest.approx(
            4 * whole, rel=2e-4
        )  # (60 MHz / 5 GHz)² of others' strength


def _between(levels, transitions, name: str, up: tuple[int, int, int], low: tuple[int, int, int]) -> float:
    labels = np.stack([levels.quanta[q] for q in (name, "ka", "kc")], axis=1)
    ends = labels[transitions.upper], labels[transitions.lower]
    computed = (ends[0] == up).all(axis=1) & (ends[1] == low).all(axis=1)
    computed |= (ends[0] == low).all(axis=1) & (ends[1] == up).all(axis=1)
    return float(transitions.strength_debye2[computed].sum())


def test_axial_top_is_its_wang_blocks():
    """A prolate top solved in |N K⟩, and the same made barely asymmetric: ±K coincide."""
    chi = NuclearQuadrupole({"chi_aa(N)": -4.2}, (N,))
    rotation = SpinRotation({"C_iso(N)": 0.002, "C_aa(N)": -0.001}, (N,))
    axial = solve_levels(Top(Constants(A=158000.0, B=9200.0, DJK=0.18)), 6, effects=(*SEMI_RIGID, chi, rotation))
    other = Top(Constants(A=158000.0, B=9200.0, C=9200.0, kind="asymmetric", reduction="S", DJK=0.18))
    wang = solve_levels(other, 6, effects=(*SEMI_RIGID, chi, rotation))
    assert set(axial.quanta) == {"n", "k", "f"}
    assert axial.states.sum() == wang.states.sum()
    sorted_energies = np.sort(np.repeat(axial.energy_mhz, axial.states))
    np.testing.assert_allclose(sorted_energies, np.sort(np.repeat(wang.energy_mhz, wang.states)), rtol=1e-13, atol=1e-8)
    ours, theirs = (all_transitions(levels, (3.9, 0.0, 0.0)) for levels in (axial, wang))
    moving = theirs.frequency_mhz > 1e-5  # not those from K to -K of one level
    assert ours.strength_debye2.sum() == pytest.approx(theirs.strength_debye2[moving].sum(), rel=1e-9)


def test_across_the_axis():
    """ΔK = ±1 of an axial top: strengths summed over both signs of K are those of the Wang blocks."""
    chi = NuclearQuadrupole({"chi_aa(N)": -4.2}, (N,))
    axial = solve_levels(Top(Constants(A=158000.0, B=9200.0)), 4, effects=(*SEMI_RIGID, chi))
    wang = solve_levels(
        Top(Constants(A=158000.0, B=9200.0, C=9200.0, kind="asymmetric")), 4, effects=(*SEMI_RIGID, chi)
    )
    ours = all_transitions(axial, (0.0, 0.3, 0.4)).strength_debye2.sum()
    assert ours == pytest.approx(all_transitions(wang, (0.0, 0.3, 0.4)).strength_debye2.sum(), rel=1e-9)


STATES = InteractingStates(
    {"E[1]": 60000.0, "A[1]": 9480.0, "B[1]": 3091.0, "C[1]": 2497.0, "DeltaJK[1]": -2.0, "G_c[0,1]": 450.0, "F_ab[0,1]": -2.1,
     "G_b_J[0,1]": 0.02, "F_ac_K[0,1]": 0.3, "W[0,1]": 12.0, "W_pm2[0,1]": 0.7},
    moments={(1, 1): (1.0, 0.6, 0.4), (0, 1): (0.1, 0.2, 0.3)},
)  # fmt: skip
STATE_LINES = [
    (10000, 9400.0), (20000, 3100.0), (30000, 2500.0), (1100, 2.0), (41000, -0.3), (11, 60000.0), (10011, 9480.0), (20011, 3091.0),
    (30011, 2497.0), (1111, 2.0), (600001, 450.0), (610001, -2.1), (400101, 0.02), (411001, 0.3), (1, 12.0), (40001, 0.7),
]  # fmt: skip


@pytest.mark.parametrize("spin", [None, N])
def test_two_states_with_everything_between_them(spin):
    effects, lines, options = [STATES], list(STATE_LINES), "a 1"
    if spin:
        effects.append(NuclearQuadrupole(_named(CHI, "N"), (N,)))
        lines += [(code * 100 // 100 + 99, value) for code, value in _chi_lines(CHI, 1)]
        options = "a 3"
    case = _case(
        f"{options} 2 0 30 0 1 1 1 0 1 0",
        lines,
        " 1 1.2\n 2 .7\n 3 .4\n 111 1.0\n 112 .6\n 113 .4\n 11 .1\n 12 .2\n 13 .3\n",
    )
    levels = solve_levels(ASYMMETRIC, 5, effects=(*SEMI_RIGID, *effects))
    for twice_f in range(0, 9, 2):
        slow = solve(case, twice_f)
        expected = {q: e for q, e in zip(slow.quanta, slow.energy_mhz, strict=True) if q[0] <= 5}
        computed = _of_f(levels, twice_f)
        assert set(computed) == set(expected)
        assert max(abs(computed[q] - expected[q]) for q in expected) < 1e-8  # 1e-14 of 1e6 MHz
    ours = all_transitions(levels, {(0, 0): (1.2, 0.7, 0.4), **STATES.moments})
    slow = [solve(case, f) for f in (2, 4)]
    theirs = strengths(case, slow[1], slow[0])
    chosen = (levels.multiplicity[ours.upper] + levels.multiplicity[ours.lower] == 8) & (
        np.maximum(levels.rotational[ours.upper], levels.rotational[ours.lower]) <= 3
    )
    assert np.abs(levels.multiplicity[ours.upper][chosen] - levels.multiplicity[ours.lower][chosen]).max() == 2
    assert ours.strength_debye2[chosen].sum() == pytest.approx(
        theirs.sum(), rel=1e-9
    )  # sums of all lines of two blocks


def test_derivatives_of_states_and_spins():
    effects = (*SEMI_RIGID, STATES, NuclearQuadrupole({"chi_aa(N)": 3.0}, (N,)))
    levels = solve_levels(ASYMMETRIC, 3, effects=effects)
    names = ["A", "E[1]", "DeltaJK[1]", "G_c[0,1]", "F_ac_K[0,1]", "W[0,1]", "chi_aa(N)"]
    analytic = level_derivatives(ASYMMETRIC, levels, names)
    for column, key in enumerate(names[1:6], 1):
        sides = [
            solve_levels(
                ASYMMETRIC,
                3,
                effects=(
                    *SEMI_RIGID,
                    replace(STATES, values={**STATES.values, key: STATES.values[key] + d}),
                    effects[-1],
                ),
            ).energy_mhz
            for d in (1e-3, -1e-3)
        ]
        numeric = (sides[0] - sides[1]) / 2e-3
        np.testing.assert_allclose(
            analytic[:, column], numeric, atol=3e-6 * max(1.0, np.abs(numeric).max())
        )  # 1e-9 over 2e-3
    assert analytic[:, 1].min() >= -1e-9
    assert analytic[:, 1].max() <= 1 + 1e-9  # the share of the upper state


def test_n_range_and_rows():
    """Levels from N = 2 on are those of the whole list; every label finds its row."""
    effects = (*SEMI_RIGID, NuclearQuadrupole(_named(CHI, "Cl"), (CL,)))
    whole = solve_levels(ASYMMETRIC, 4, effects=effects)
    upper = solve_levels(ASYMMETRIC, 4, jmin=2, effects=effects)
    rows = whole.rows_of(**upper.quanta)
    assert (rows >= 0).all()
    np.testing.assert_allclose(whole.energy_mhz[rows], upper.energy_mhz, atol=1e-8)  # rounding of 1e6 MHz
    assert whole.halves == {"f"}
    assert whole.labels(np.array([whole.find(n=1, ka=0, kc=1, f=5)]))[0].split() == ["1", "0", "1", "5/2"]
    assert whole.multiplicity.sum() == 4 * sum((2 * n + 1) ** 2 for n in range(5))


def test_a_scheme_names_its_sums():
    assert Scheme((S, N, CL)).names == ("j", "f1", "f")
    assert Scheme((S,)).names == ("j",)
    assert Scheme((S, N, CL)).half == (True, True, False)
    with pytest.raises(ValueError, match="a name of its own"):
        Scheme((N, N))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: NuclearQuadrupole({"chi_aa(N)": 1.0}, (CL,)), "belongs to 1 of the spins Cl"),
        (lambda: NuclearQuadrupole({"C_aa(N)": 1.0}, (N,)), "nuclear quadrupole knows chi_aa"),
        (lambda: SpinSpin({"D_aa(S)": 1.0}, (S,)), "no coupling with itself"),
        (lambda: quadrupole_of_tensor(N, np.diag([1.0, 1.0, 1.0])), "traceless"),
        (lambda: quadrupole_of_tensor(N, [[1.0, 0.5, 0], [0, -1, 0], [0, 0, 0]]), "symmetric"),
        (lambda: Spin("X", -1), "twice a spin is a whole number, 0 or more"),
        (lambda: InteractingStates({"F_aa[0,1]": 1.0}), "interactions between states are"),
        (lambda: InteractingStates({"G_a[1,1]": 1.0}), "connects two states"),
        (lambda: InteractingStates({"A[0]": 1.0}), "states are numbered from 1"),
    ],
)
def test_impossible_spins_and_states_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_spin_without_quadrupole():
    with pytest.raises(ValueError, match="no quadrupole moment"):
        solve_levels(ASYMMETRIC, 1, effects=(*SEMI_RIGID, NuclearQuadrupole({"chi_aa(H)": 1.0}, (H,))))


def test_effects_survive_a_copy():
    """They go to other processes with their levels."""
    effect = pickle.loads(pickle.dumps(NuclearQuadrupole(_named(CHI, "Cl"), (CL,))))
    assert effect.values == NuclearQuadrupole(_named(CHI, "Cl"), (CL,)).values
    assert pickle.loads(pickle.dumps(STATES)).moments == STATES.moments


@pytest.mark.parametrize("value", [-40.0, 700.0])
def test_the_scalar_between_two_states_mixes_them(value):
    """value N·I of states D apart: B N(N + 1) + (A - B) K² + D/2 ± √(D²/4 + c²), c = value ½[F(F + 1) - N(N + 1) - I(I + 1)]."""
    par = read_par(
        f"two\n4 1 1 0 0 1e6 1 1\na 3 2 0 9 0 1 1 1 0 1 0\n199 3000 1\n1099 500 1\n11 1500 1\n10000010 {value} 1\n".encode()
    )
    request = read_int(b"two\n0 999 1000.0 0 6 -30 -30 9999.99 300.0\n1 1.0\n12 1.0\n")
    (group,) = connected_groups(par, request)
    levels = group.levels((0, 10))
    for f in range(6):
        f_energies = levels.energy_mhz[levels.multiplicity == 2 * f + 1]
        every_n = {n for n in range(max(abs(f - 1), 0), f + 2) if abs(n - 1) <= f <= n + 1}
        c = {n: value * (f * (f + 1) - n * (n + 1) - 2) / 2 for n in every_n}
        apart = {n: np.hypot(750.0, c[n]) for n in every_n}
        expected = [
            3000.0 * n * (n + 1) + 500.0 * k**2 + 750 + sign * apart[n]
            for n in every_n
            for k in range(-n, n + 1)
            for sign in (-1, 1)
        ]
        assert np.sort(f_energies) == pytest.approx(np.sort(expected), abs=1e-8)  # of 1e5 MHz, round-off
