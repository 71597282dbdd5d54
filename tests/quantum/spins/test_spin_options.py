"""Two equivalent spins in a total, sums that are kept, magnetic moments: against the plain coupling and QuTiP's direct product."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to

from rotor.quantum.effect import Moment, QuantumEffect
from rotor.quantum.effects.spin_effect import NuclearQuadrupole, SpinRotation, SpinSpin
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.operators.algebra import half_anticommutator
from rotor.quantum.operators.rotation import direction_cosine, j_squared
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins import Scheme, Spin
from rotor.quantum.spins.coupling import patterns, patterns_of_total, recoupling
from rotor.quantum.spins.scheme import ByElements, CosinesWithN, Scalar
from rotor.spectra.transitions.pairs import all_transitions
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

TOP = Top(Constants(A=9400.0, B=3100.0, C=2500.0), dipole_abc_debye=(1.2, 0.0, 0.0))
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Kept(QuantumEffect):
    """Sums of angular momenta that are taken for good ones."""

    sums: frozenset[str]

    def parameters(self, top):
        return {}

    def size_mhz(self, top, j):
        return 0.0

    def conserved_sums(self, top):
        return self.sums


def _pair(total: str) -> tuple[QuantumEffect, ...]:
    """Two nuclei of spin 1 that a half turn about a exchanges: off-diagonal ab and ac change their sign."""
    both = (Spin("D1", 2, total=total), Spin("D2", 2, total=total))
    chi = {"chi_aa": 0.17, "chi_bb-cc": -0.11}
    odd = {"chi_ab": 0.13, "chi_ac": 0.05}
    values = {f"{k}({s.name})": v for s in both for k, v in chi.items()}
    values |= {f"{k}({s.name})": v * sign for s, sign in zip(both, (1, -1), strict=True) for k, v in odd.items()}
    turning = {f"C_bb({s.name})": 0.02 for s in both} | {"C_ab(D1)": 0.03, "C_ab(D2)": -0.03}
    spin_spin = {"T_aa(D1,D2)": -0.01, "J(D1,D2)": 0.004}
    return NuclearQuadrupole(values, both), SpinRotation(turning, both), SpinSpin(spin_spin, both)


@pytest.mark.parametrize("spins", [(1, 1), (2, 2), (1, 3, 3), (1, 2, 1, 1)])
@pytest.mark.parametrize("f", [0, 1, 4, 7])
def test_recoupling_is_orthogonal(spins, f):
    twice = 2 * f + sum(spins) % 2
    pattern, total = patterns(spins, twice), patterns_of_total(spins, twice)
    assert len(pattern) == len(total)
    turn = recoupling(spins, pattern, total)
    np.testing.assert_allclose(turn @ turn.T, np.eye(len(pattern)), atol=1e-13)  # sums of a few products


def test_a_total_spin_changes_labels_alone():
    plain, total = (solve_levels(TOP, 4, effects=(*SEMI_RIGID, *_pair(name))) for name in ("", "I"))
    assert total.quanta_names == ("n", "ka", "kc", "i_tot", "f")
    for f in range(5):
        ours, theirs = (np.sort(levels.energy_mhz[levels.quanta["f"] == f]) for levels in (total, plain))
        same = min(len(ours), len(theirs))
        np.testing.assert_allclose(ours[:same], theirs[:same], rtol=0, atol=2e-9)  # 1e-14 of the largest
    # of a level with Ka even the spin function is one of I_tot = 0, 2 or 1; no operator connects them
    shares = solve_levels(TOP, 4, effects=(*SEMI_RIGID, *_pair("I"))).mixing
    assert shares is not None
    assert shares.min() > 0.4


def test_exchange_keeps_two_kinds_of_levels_apart():
    """Every block holds Ka + I_tot even or odd alone, and the dipole along a connects none of different kinds."""
    levels = solve_levels(TOP, 4, effects=(*SEMI_RIGID, *_pair("I")))
    kind = (levels.quanta["ka"] + levels.quanta["i_tot"]) % 2
    for block in levels.blocks:
        assert len(set(kind[block.start : block.start + len(block.energies_mhz)].tolist())) == 1
    transitions = all_transitions(levels, TOP.dipole_abc_debye)
    assert len(transitions.upper) > 1000
    assert (kind[transitions.upper] == kind[transitions.lower]).all()


def test_strengths_with_a_total_spin():
    plain, total = (solve_levels(TOP, 3, effects=(*SEMI_RIGID, *_pair(name))) for name in ("", "I"))
    ours, theirs = (all_transitions(levels, TOP.dipole_abc_debye) for levels in (total, plain))
    assert ours.strength_debye2.sum() == pytest.approx(theirs.strength_debye2.sum(), rel=1e-12)  # thousands of terms
    strong = [np.sort(each.strength_debye2[each.strength_debye2 > 0.3]) for each in (ours, theirs)]
    np.testing.assert_allclose(*strong, rtol=1e-6)  # levels 1e-6 MHz apart share strength by rounding


def test_derivatives_with_a_total_spin():
    levels = solve_levels(TOP, 2, effects=(*SEMI_RIGID, *_pair("I")))
    step = 1e-3
    for name in ("chi_ab(D1)", "C_bb(D2)", "T_aa(D1,D2)"):
        moved = []
        for sign in (1, -1):
            changed = [
                replace(e, values={**e.values, name: e.values[name] + sign * step}) if name in e.values else e
                for e in _pair("I")
            ]
            # one of a pair alone breaks the exchange, which a second order of 1e-7 MHz shows
            moved.append(solve_levels(TOP, 2, effects=(*SEMI_RIGID, *changed)))
        slope = (moved[0].energy_mhz.sum() - moved[1].energy_mhz.sum()) / (2 * step)
        derivative = level_derivatives(TOP, levels, [name])[:, 0].sum()
        assert derivative == pytest.approx(slope, abs=1e-4)  # round-off of sums of 1e6 MHz over the step


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Scheme((Spin("D1", 2, total="I"), Spin("N", 2))), "the last ones"),
        (lambda: Scheme((Spin("D1", 2, total="I"), Spin("N", 3, total="I"))), "of one size"),
        (lambda: Scheme((Spin("D1", 2, total="I"),)), "two nuclei"),
    ],
)
def test_impossible_totals_are_refused(make, says):
    with pytest.raises(ValueError, match=says):
        make()


# The direct product of N ≤ 2 with a triplet; elements between different N left out on both sides, so that it is complete

TRIPLET = Spin("S", 2, True)
D, E, GAMMA = 5900.0, 310.0, -250.0
LARGEST = 2


def _triplet() -> tuple[QuantumEffect, ...]:
    spin_spin = SpinSpin({"D_aa(S)": D, "D_bb-cc(S)": E, "D_ab(S)": 120.0}, (TRIPLET,))
    return spin_spin, SpinRotation({"gamma(S)": GAMMA}, (TRIPLET,)), Kept(frozenset({"n"}))


def _direct_triplet() -> tuple[np.ndarray, dict[str, np.ndarray], list[tuple[int, int, int]]]:
    """The Hamiltonian, the operators S_p and N_p of space, and the states |N k m⟩ of one spin function."""
    wide = states_up_to(LARGEST + 1)
    selected = [i for i, state in enumerate(wide) if state[0] <= LARGEST]
    states = [wide[i] for i in selected]
    same_n = np.array([[a[0] == b[0] for b in states] for a in states], dtype=float)
    phi = space_cosines(LARGEST + 1)
    spin = {p: qutip.jmat(1, p).full() for p in "xyz"}
    momentum = {axis: rotor_matrix(axis, LARGEST) for axis in "abc"}
    wide_momentum = {axis: rotor_matrix(axis, LARGEST + 1) for axis in "abc"}
    total = sum(
        x * on_spins(momentum[a] @ momentum[a], (2,), {}) for x, a in zip((9400.0, 3100.0, 2500.0), "abc", strict=True)
    )
    # a traceless tensor: the parameter D_aa stands with -½ along b and c, the difference with ±½
    tensor = D * np.diag([1.0, -0.5, -0.5]) + E * np.diag([0.0, 0.5, -0.5])
    tensor[0, 1] = tensor[1, 0] = 120.0
    space_n = {}
    for p in "xyz":
        product = sum((phi[p, a] @ wide_momentum[a] + wide_momentum[a] @ phi[p, a]) / 2 for a in "abc")
        space_n[p] = product[np.ix_(selected, selected)]
        total = total + GAMMA * on_spins(space_n[p], (2,), {1: spin[p]})
        for q in "xyz":
            cosines = sum(tensor[i, k] * phi[p, "abc"[i]] @ phi[q, "abc"[k]] for i in range(3) for k in range(3))
            total = total + on_spins(cosines[np.ix_(selected, selected)] * same_n, (2,), {1: spin[p] @ spin[q]})
    operators = {"S": [on_spins(np.eye(len(states)), (2,), {1: spin[p]}) for p in "xyz"]}
    operators["N"] = [on_spins(space_n[p], (2,), {}) for p in "xyz"]
    return total, operators, states


def test_sums_that_are_kept():
    slow = np.linalg.eigvalsh(_direct_triplet()[0])
    levels = solve_levels(TOP, LARGEST, effects=(*SEMI_RIGID, *_triplet()))
    ours = np.sort(np.repeat(levels.energy_mhz, levels.multiplicity))
    np.testing.assert_allclose(ours, slow, rtol=0, atol=1e-9)  # 1e-14 of 6e4 MHz, and round-off
    mixed = solve_levels(TOP, LARGEST, effects=(*SEMI_RIGID, *_triplet()[:2]))
    assert np.abs(np.sort(mixed.energy_mhz) - np.sort(levels.energy_mhz)).max() > 100.0


@pytest.mark.parametrize(
    ("moment", "operator"),
    [
        (Moment(1.0, (0, 0), Scalar(), "S", electric=False), "S"),
        (Moment(1.0, (0, 0), CosinesWithN(UNIT), electric=False), "N"),
    ],
)
def test_magnetic_strengths_are_those_of_the_direct_product(moment, operator):
    """Σ |⟨i|V_p|k⟩|² over p and all M of two levels."""
    hamiltonian, operators, _ = _direct_triplet()
    energies, vectors = np.linalg.eigh(hamiltonian)
    squares = sum(np.abs(vectors.conj().T @ operator @ vectors) ** 2 for operator in operators[operator])
    levels = solve_levels(TOP, LARGEST, effects=(*SEMI_RIGID, *_triplet()))
    transitions = all_transitions(levels, {}, moments=[moment])
    for row in np.argsort(-transitions.strength_debye2)[:60]:
        where = [
            np.abs(energies - levels.energy_mhz[state]) < 1e-6
            for state in (transitions.upper[row], transitions.lower[row])
        ]
        expected = squares[np.ix_(*where)].sum()
        assert transitions.strength_debye2[row] == pytest.approx(
            expected, rel=1e-9, abs=1e-12
        )  # sums of some hundred squares
    assert (transitions.strength_debye2 > 1e-3).sum() >= 15


def test_moments_need_levels_with_spins():
    with pytest.raises(ValueError, match="solved with spins"):
        all_transitions(
            solve_levels(TOP, 3), (1.0, 0.0, 0.0), moments=[Moment(1.0, (0, 0), CosinesWithN(UNIT), electric=False)]
        )


def test_powers_of_a_dipole():
    """½{N², φ} is N² of the higher N between N and N - 1, [N², φ]/2 its N: R lines of a linear molecule have μ + N² c."""
    linear = Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0))
    nucleus = NuclearQuadrupole({"chi_aa(N)": 0.0}, (Spin("N", 2),))
    levels = solve_levels(linear, 6, effects=(*SEMI_RIGID, nucleus))
    cosine, n2 = direction_cosine("a", "Ir"), j_squared()
    commutator = 0.5 * (n2 @ cosine - cosine @ n2)
    plain = all_transitions(levels, {(0, 0): (0.11, 0.0, 0.0)})
    for operator, factor in (
        (half_anticommutator(n2, cosine), lambda n: n**2),
        (half_anticommutator(j_squared(2), cosine), lambda n: n**2 * (n**2 + 1)),
        (0.5 * (n2 @ commutator - commutator @ n2), lambda n: n**2),
        (-1.0 * commutator, lambda n: -n),
    ):
        transitions = all_transitions(
            levels, {(0, 0): (0.11, 0.0, 0.0)}, moments=[Moment(1e-4, (0, 0), ByElements(1, 1j * operator))]
        )
        order = [np.lexsort((each.lower, each.upper)) for each in (transitions, plain)]
        n, f = (levels.quanta[name][plain.upper[order[1]]] for name in ("n", "f"))
        rises = f > levels.quanta["f"][plain.lower[order[1]]]
        expected = plain.strength_debye2[order[1]] * (1 + 1e-4 / 0.11 * factor(n)) ** 2
        chosen = rises if factor(1) < 0 else np.ones(len(n), dtype=bool)  # a commutator's sign goes by F
        ours = transitions.strength_debye2[order[0]]
        np.testing.assert_allclose(ours[chosen], expected[chosen], rtol=1e-10)  # products of a few numbers
