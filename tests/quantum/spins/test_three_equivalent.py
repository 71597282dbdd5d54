"""Three equivalent nuclei on a threefold axis: against every spin function written out, projected on A1, A2 and E, and against the
plain coupling of three nuclei with tensors turned by 120°."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to
from scipy.linalg import expm

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.spin_effect import NuclearQuadrupole, SpinRotation, SpinSpin
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.fields.blocks import Magnet
from rotor.quantum.fields.reduced_elements import ReducedElements
from rotor.quantum.hyperfine_method import HyperfineMethod
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins import Scheme, Spin
from rotor.quantum.spins.coupling import patterns, patterns_of_three, recoupling_of_three, symmetric_functions
from rotor.quantum.spins.levels import unmixed_levels
from rotor.spectra.transitions.pairs import all_transitions
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

PROLATE = Top(Constants(A=9400.0, B=3100.0), dipole_abc_debye=(1.2, 0.0, 0.0))
OBLATE = Top(Constants(B=9400.0, C=3100.0), dipole_abc_debye=(0.0, 0.0, 1.2))

# of the first nucleus, that half a turn about b leaves alone: the axis is a, the molecule's other elements are along b, c and ac
CHI = np.array([[-60.0, 0.0, 33.0], [0.0, 45.0, 0.0], [33.0, 0.0, 15.0]])
TURNING = np.array([[0.6, 0.0, 0.11], [0.0, 0.3, 0.0], [0.11, 0.0, 0.2]])
FURTHER = np.array(
    [[0.0, 7.0, 0.0], [7.0, 0.0, -11.0], [0.0, -11.0, 0.0]]
)  # which half a turn about b does not leave alone
PAIR = np.array([[3.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -2.0]])  # of the two nuclei across from it
SCALAR = 0.4
ACROSS = {0: (1, 2), 1: (2, 0), 2: (0, 1)}


@dataclass(frozen=True)
class SameN(QuantumEffect):
    """N taken for a good quantum number."""

    def parameters(self, top):
        return {}

    def size_mhz(self, top, j):
        return 0.0

    def conserved_sums(self, top):
        return frozenset({"n"})


def _turned(tensor: np.ndarray, times: int, axis: int = 0) -> np.ndarray:
    angle, (x, y) = 2 * np.pi / 3 * times, [i for i in range(3) if i != axis]
    turn = np.eye(3)
    turn[x, x] = turn[y, y] = np.cos(angle)
    turn[x, y], turn[y, x] = -np.sin(angle), np.sin(angle)
    return turn @ tensor @ turn.T


def _traceless(symbol: str, spins: str, t: np.ndarray) -> dict[str, float]:
    parts = {"aa": t[0, 0], "bb-cc": t[1, 1] - t[2, 2], "ab": t[0, 1], "ac": t[0, 2], "bc": t[1, 2]}
    return {f"{symbol}_{letters}({spins})": float(value) for letters, value in parts.items() if abs(value) > 1e-12}


def _symmetric(spins: str, c: np.ndarray) -> dict[str, float]:
    return {f"C_{'abc'[i]}{'abc'[k]}({spins})": float(c[i, k]) for i in range(3) for k in range(i, 3) if c[i, k]}


def _effects(twice: int, total: str = "I", axis: int = 0, chi: np.ndarray = CHI) -> tuple[QuantumEffect, ...]:
    """All three nuclei one by one, or with a total spin the first and the pair across from it alone."""
    order = [0, 1, 2] if axis == 0 else [1, 2, 0] if axis == 1 else [2, 1, 0]
    place = np.ix_(np.argsort(order), np.argsort(order))
    spins = tuple(Spin(f"X{k + 1}", twice, total=total) for k in range(3))
    values: tuple[dict[str, float], ...] = ({}, {}, {})
    for k in range(1 if total else 3):
        pair = "X1,X2" if total else ",".join(f"X{i + 1}" for i in sorted(ACROSS[k]))
        values[0].update(_traceless("chi", f"X{k + 1}", _turned(chi[place], k, axis)) if twice > 1 else {})
        values[1].update(_symmetric(f"X{k + 1}", _turned(TURNING[place], k, axis)))
        values[2].update(_traceless("T", pair, _turned(PAIR[place], k, axis)) | {f"J({pair})": SCALAR})
    kinds = (NuclearQuadrupole, SpinRotation, SpinSpin)
    return tuple(kind(value, spins) for kind, value in zip(kinds, values, strict=True) if value)


# every function |N k m⟩ |m1 m2 m3⟩, N ≤ a limit, elements between different N left out


class Direct:
    """The Hamiltonian and the operations of D3 over all products."""

    def __init__(self, twice: int, top_n: int) -> None:
        wide = states_up_to(top_n + 1)
        selected = [i for i, state in enumerate(wide) if state[0] <= top_n]
        self.states = [wide[i] for i in selected]
        n = np.array([state[0] for state in self.states])
        self.spins, self.same_n = (twice,) * 3, n[:, None] == n[None, :]
        phi = {key: each[np.ix_(selected, selected)] for key, each in space_cosines(top_n + 1).items()}
        full, momenta = space_cosines(top_n + 1), {a: rotor_matrix(a, top_n + 1) for a in "abc"}
        spin = {p: qutip.jmat(twice / 2, p).full() for p in "xyz"}
        here = {a: rotor_matrix(a, top_n) for a in "abc"}
        rotation = (9400.0 - 3100.0) * here["a"] @ here["a"] + 3100.0 * sum(each @ each for each in here.values())
        total = on_spins(rotation, self.spins, {})
        for k in range(3):
            chi, c, pair = (_turned(tensor, k) for tensor in (CHI, TURNING, PAIR))
            first, other = ACROSS[k]
            for p in "xyz":
                turning = sum(
                    c[i, j] * (full[p, "abc"[i]] @ momenta["abc"[j]] + momenta["abc"[j]] @ full[p, "abc"[i]]) / 2
                    for i in range(3) for j in range(3) if c[i, j]
                )  # fmt: skip
                total = total + self._on(turning[np.ix_(selected, selected)], {k: spin[p]})
                total = total + SCALAR * self._on(np.eye(len(selected)), {first: spin[p], other: spin[p]})
                for q in "xyz":
                    both = {(i, j): full[p, "abc"[i]] @ full[q, "abc"[j]] for i in range(3) for j in range(3)}
                    pair_matrix, spin_matrix = (
                        sum(t[key] * each for key, each in both.items())[np.ix_(selected, selected)]
                        for t in (pair, chi)
                    )
                    total = total + self._on(pair_matrix, {first: spin[p], other: spin[q]})
                    if twice > 1:  # over 2I(2I - 1)
                        total = total + self._on(spin_matrix / (twice * (twice - 1)), {k: spin[p] @ spin[q]})
        self.hamiltonian = total
        self.phi, self.here = phi, here

    def _on(self, rotor: np.ndarray, acting: dict[int, np.ndarray]) -> np.ndarray:
        return on_spins(rotor * self.same_n, self.spins, {k + 1: each for k, each in acting.items()})

    def exchange(self, order: tuple[int, int, int]) -> np.ndarray:
        """|m1 m2 m3⟩ with the spins in another order."""
        size = self.spins[0] + 1
        index = np.arange(size**3).reshape(size, size, size).transpose(order).ravel()
        return np.eye(size**3)[index]

    def operation(self, angle: float, axis: str, order: tuple[int, int, int]) -> np.ndarray:
        """A turn of the molecule about one of its axes, with an exchange of spins."""
        return np.kron(expm(1j * angle * self.here[axis]), self.exchange(order))

    def projectors(self) -> dict[str, np.ndarray]:
        """On A1, A2 and E, the operations being those that leave the Hamiltonian alone."""
        for order in ((1, 2, 0), (2, 0, 1)):  # which of them the turn goes with is a matter of its sense
            cyclic = self.operation(2 * np.pi / 3, "a", order)
            if np.abs(cyclic @ self.hamiltonian - self.hamiltonian @ cyclic).max() < 1e-8:  # round-off of 1e5 MHz
                break
        half = self.operation(np.pi, "b", (0, 2, 1))
        assert np.abs(half @ self.hamiltonian - self.hamiltonian @ half).max() < 1e-8
        identity = np.eye(len(cyclic))
        allowed = (identity + cyclic + cyclic @ cyclic) / 3
        return {"A1": allowed @ (identity + half) / 2, "A2": allowed @ (identity - half) / 2, "E": identity - allowed}

    def energies(self, projector: np.ndarray) -> np.ndarray:
        """Of the functions that a projector leaves."""
        values, vectors = np.linalg.eigh((projector + projector.conj().T) / 2)
        inside = vectors[:, values > 0.5]
        return np.linalg.eigvalsh(inside.conj().T @ self.hamiltonian @ inside)


# (2I, highest N)
CASES = [(1, 1), pytest.param(1, 3, marks=pytest.mark.slow), pytest.param(2, 2, marks=pytest.mark.slow),
         pytest.param(3, 1, marks=pytest.mark.slow)]  # fmt: skip


@pytest.mark.parametrize(("twice", "top_n"), CASES)
def test_levels_are_those_of_all_products_of_the_allowed_species(twice, top_n):
    """NH3, ND3 and CHCl3: energies and degeneracies of A1 and A2 by the labels, and of E the rest."""
    direct = Direct(twice, top_n)
    levels = solve_levels(PROLATE, top_n, effects=(*SEMI_RIGID, *_effects(twice), SameN()))
    quanta = levels.quanta
    odd = (
        quanta["ka"] + quanta["kc"] + (quanta["i_sym"] % 6 == 1)
    ) % 2 == 1  # under half a turn about b, with the exchange
    results = {}
    for name, projector in direct.projectors().items():
        results[name] = direct.energies(projector)
        if name != "E":
            chosen = odd == (name == "A2")
            ours = np.sort(np.repeat(levels.energy_mhz[chosen], levels.multiplicity[chosen]))
            assert len(ours) == len(results[name])
            np.testing.assert_allclose(ours, results[name], rtol=0, atol=2e-9)  # 1e-14 of the largest + 1e-9
    assert sum(map(len, results.values())) == len(direct.states) * (twice + 1) ** 3
    assert len(results["E"]) > 0


@pytest.mark.parametrize(("twice", "count"), [(1, (4, 0, 4)), (2, (10, 1, 16)), (3, (20, 4, 40)), (5, (56, 20, 140))])
def test_numbers_of_spin_functions(twice, count):
    """(2I+1)(2I+2)(2I+3)/6 of A1, (2I+1)(2I)(2I-1)/6 of A2, the rest of E, M written out."""
    kinds = {0: 0, 2: 0, 4: 0, 8: 0}
    for total in range(3 * twice % 2, 3 * twice + 1, 2):
        for name in symmetric_functions(twice, total).symmetry.tolist():
            kinds[name % 12] += total + 1
    assert (kinds[0], kinds[2], kinds[4] + kinds[8]) == count
    assert kinds[4] == kinds[8]


@pytest.mark.parametrize("spins", [(1, 1, 1), (3, 3, 3), (1, 2, 2, 2)])
@pytest.mark.parametrize("f", [0, 2])
def test_recoupling_of_three_is_orthogonal(spins, f):
    twice = 2 * f + sum(spins) % 2
    pattern, total = patterns(spins, twice), patterns_of_three(spins, twice)
    turn = recoupling_of_three(spins, pattern, total)
    np.testing.assert_allclose(turn @ turn.T, np.eye(len(pattern)), atol=1e-13)  # sums of a few products


@pytest.mark.parametrize(
    ("top", "axis", "twice", "chi", "top_n"),
    [
        (PROLATE, 0, 1, CHI, 3),
        (OBLATE, 2, 1, CHI, 3),
        pytest.param(PROLATE, 0, 2, CHI, 5, marks=pytest.mark.slow),
        pytest.param(OBLATE, 2, 2, CHI + FURTHER, 5, marks=pytest.mark.slow),
        pytest.param(PROLATE, 0, 3, CHI, 6, marks=pytest.mark.slow),
    ],
)
def test_the_plain_coupling_has_these_levels_and_pairs_of_e(top, axis, twice, chi, top_n):
    """Every level, with all N, is one of three nuclei with turned tensors; the others coincide in pairs. The fourth has the axis alone."""
    total, plain = (
        solve_levels(top, top_n, effects=(*SEMI_RIGID, *_effects(twice, name, axis, chi))) for name in ("I", "")
    )
    compared = 0
    for f in sorted(set(total.quanta["f"].tolist())):
        if (f / 2 if "f" in total.halves else f) > top_n - 1.5 * twice:  # of others some N are beyond the limit
            continue
        ours, rest = (levels.energy_mhz[levels.quanta["f"] == f] for levels in (total, plain))
        for energy in ours:
            nearest = int(np.abs(rest - energy).argmin())
            assert abs(rest[nearest] - energy) < 2e-9  # 1e-14 of the largest + 1e-9
            rest = np.delete(rest, nearest)
        rest = np.sort(rest)
        assert len(rest) % 2 == 0
        np.testing.assert_allclose(rest[::2], rest[1::2], rtol=0, atol=2e-9)
        compared += len(ours)
    assert compared >= 10


def test_names_and_lines():
    levels = solve_levels(PROLATE, 3, effects=(*SEMI_RIGID, *_effects(1)))
    assert levels.quanta_names == ("n", "ka", "kc", "i_sym", "i_tot", "f")
    assert levels.halves == {"i_tot", "f"}
    quanta = levels.quanta
    k = quanta["ka"] % 3
    assert (quanta["i_sym"] == np.select([k == 0, k == 2], [0, 2], 4)).all()  # spin 1/2: A1 of 3/2, E of 1/2
    assert (quanta["i_tot"] == np.where(k == 0, 3, 1)).all()
    transitions = all_transitions(levels, PROLATE.dipole_abc_debye)
    odd = (quanta["ka"] + quanta["kc"]) % 2
    strong = transitions.strength_debye2 > 1e-20  # round-off is below
    assert (odd[transitions.upper] != odd[transitions.lower])[strong].all()  # along the axis: A1 with A2
    assert strong.sum() > 100
    plain = solve_levels(PROLATE, 3, effects=SEMI_RIGID)
    rigid = all_transitions(plain, PROLATE.dipole_abc_debye)
    # each N, K of a top without spins has 8 times its strength, of which half belongs to A1 and A2, for K ≠ 0 of both signs
    for n in (1, 2):
        for k in range(n):
            ours = transitions.strength_debye2[
                (quanta["n"][transitions.upper] == n)
                & (quanta["n"][transitions.lower] == n - 1)
                & (quanta["ka"][transitions.upper] == k)
            ].sum()
            row = (plain.quanta["k"][rigid.upper] == k) & (plain.quanta["j"][rigid.upper] == n)
            weight = 4 if k % 3 == 0 else 2  # spin functions of A1, and of one function of E
            assert ours == pytest.approx(weight * rigid.strength_debye2[row].sum(), rel=1e-5)  # mixing of N, K


def test_partition_function():
    """Of the functions of spins 1/2 four belong to A1, two to each function of E: the weights 4, 2, 2 of K modulo 3."""
    effects, weights = (*SEMI_RIGID, _effects(1)[0]), SpinWeights.from_mapping({"0": 4, "1": 2, "2": 2})
    with_spins = partition_function(PROLATE, 1.0, effects=effects)
    without = partition_function(replace(PROLATE, spin_weights=weights, symmetry_checked=False), 1.0)
    # weights are reduced by their common divisor 2; shifts of 3 MHz with a mean of 0, kT = 20.8 GHz
    assert with_spins.q == pytest.approx(2 * without.q, rel=1e-6)


def test_derivatives_with_three_equivalent_spins_are_differences():
    effects, step = _effects(2)[:2], 1e-3
    levels = solve_levels(PROLATE, 1, effects=(*SEMI_RIGID, *effects))
    for name in ("chi_ac(X1)", "C_bb(X1)"):
        moved = []
        for sign in (1, -1):
            changed = [
                replace(e, values={**e.values, name: e.values[name] + sign * step}) if name in e.values else e
                for e in effects
            ]
            moved.append(solve_levels(PROLATE, 1, effects=(*SEMI_RIGID, *changed)).energy_mhz)
        slope = (moved[0] - moved[1]) / (2 * step)
        derivative = level_derivatives(PROLATE, levels, [name])[:, 0]
        np.testing.assert_allclose(np.sort(derivative), np.sort(slope), atol=1e-5)  # round-off of 1e5 MHz over the step
        assert np.abs(derivative).max() > 1e-3


def test_what_is_refused():
    three = [Spin(f"X{k}", 2, total="I") for k in (1, 2, 3)]
    with pytest.raises(ValueError, match="the last ones"):
        Scheme((three[0], three[1], three[2], Spin("N", 2)))
    with pytest.raises(ValueError, match="of one size"):
        Scheme((three[0], three[1], Spin("X3", 3, total="I")))
    with pytest.raises(ValueError, match="name the first of them"):
        solve_levels(PROLATE, 1, effects=(*SEMI_RIGID, NuclearQuadrupole({"chi_aa(X2)": 1.0}, tuple(three))))
    with pytest.raises(ValueError, match="the constants have none"):
        solve_levels(Top(Constants(A=9.0, B=3.0, C=2.0)), 2, effects=(*SEMI_RIGID, *_effects(1)))
    with pytest.raises(ValueError, match="only the exact method"):
        solve_levels(PROLATE, 1, effects=(*SEMI_RIGID, *_effects(2), HyperfineMethod("first-order", 1.0, tuple(three))))
    with pytest.raises(ValueError, match="not products"):
        unmixed_levels(PROLATE, (*SEMI_RIGID, *_effects(1)), [1])


def test_tensors_that_are_axial_alone():
    """χ along the axis of a prolate top, for which K is good: F = 0 has the energies of the limit of small elements off the axis."""
    spins = tuple(Spin(f"2H_{i}", 2, total="I") for i in (1, 2, 3))
    axial = {"chi_aa(2H_1)": 0.2}
    computed = [
        np.sort(solve_levels(PROLATE, 2, effects=(*SEMI_RIGID, NuclearQuadrupole(axial | further, spins))).energy_mhz)
        for further in ({}, {"chi_bb-cc(2H_1)": 1e-9})
    ]
    assert computed[0] == pytest.approx(computed[1], abs=1e-7)  # the small elements, and round-off
    assert np.unique(computed[0].round(4)).size > 9  # levels of N and K are split


def test_the_magnetic_moment_of_three_nuclei_is_that_of_their_total():
    """N = 0 has F = I_tot and the reduced element g √(F(F+1)(2F+1)) of the total spin, but for admixtures of 1e-8 of N = 2."""
    levels = solve_levels(PROLATE, 2, effects=(*SEMI_RIGID, *_effects(1)))
    elements = ReducedElements(levels)
    magnet = Magnet(np.zeros((3, 3)), {f"X{k}": 5.58 for k in (1, 2, 3)})
    place = int(np.flatnonzero(levels.rotational == 0)[0])
    number = next(i for i, b in enumerate(elements.blocks) if b.start <= place < b.start + len(b.energies_mhz))
    twice_f = int(levels.quanta["f"][place])
    assert twice_f == 3
    state = place - elements.blocks[number].start
    f = twice_f / 2
    expected = 5.58 * np.sqrt(f * (f + 1) * (2 * f + 1))
    assert elements.between(magnet, number, number)[state, state] == pytest.approx(expected, rel=1e-6)
