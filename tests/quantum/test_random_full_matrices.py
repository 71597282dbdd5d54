"""Random Hamiltonians of two states, two spins, fields and a methyl group against full matrices of direct products.

The matrices are written here: |v⟩|N k m⟩|m_I⟩|m_S⟩ with all m of one total M, N ≤ 3, and beside internal rotation the plane waves
e^imα of one species. Nothing is coupled or contracted; products of direction cosines and of N are multiplied out with one N more.
Levels of N ≤ 1 of all states are compared: what is left out above N = 3 moves them by less than 1e-7 MHz.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, product
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from direct_product import rotor_matrix, space_cosines, states_up_to

import rotor
from rotor.quantum.effects.hyperfine import quadrupole_of_tensor
from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.spin_rotation import SpinRotation
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.effects.zeeman import zeeman_map
from rotor.quantum.fields.operators import Contraction
from rotor.quantum.fields.solved_space import solved_levels, solved_space
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins import Spin
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM, NUCLEAR_MAGNETON_MHZ_PER_T

PARTS = ("states", "spins", "electric", "magnetic", "torsion")
LARGEST, WAVES = 3, 8
BELOW_MHZ = 18_000.0  # all N ≤ 1 of both states, and no N = 2
WITHIN_MHZ = 1e-6
NUCLEAR_G = {"N": 0.4, "H": 5.59}
COMPUTED = [
    (), ("states",), ("spins",), ("states", "spins"), ("electric",), ("magnetic",), ("spins", "electric"),
    ("spins", "magnetic"), ("states", "electric"), ("states", "magnetic"), ("states", "spins", "electric"),
    ("states", "spins", "magnetic"), ("torsion",), ("spins", "torsion"), ("electric", "torsion"),
]  # fmt: skip
ELSEWHERE = {("spins", "electric", "torsion")}  # torsional states are not taken together there: test_fields_combined.py
OTHERS = [
    parts for count in range(6) for parts in combinations(PARTS, count)
    if parts not in COMPUTED and parts not in ELSEWHERE and not {"electric", "magnetic"} <= set(parts)
]  # fmt: skip
COUNT = {("spins", "torsion"): 4}  # of 200 in all: 3 s of processor time each


@dataclass(frozen=True)
class Case:
    """Constants of one Hamiltonian, MHz but for dipole (D), fields (kV/cm, T), g; of what does not take part 0 or one state."""

    abc: np.ndarray  # (states, 3)
    origin: float
    fermi: float
    coriolis: float
    f_ab: float
    chi: np.ndarray
    c: np.ndarray
    dipole: np.ndarray
    kv_per_cm: float
    tesla: float
    g: np.ndarray
    torsion: dict[str, float]
    spins: bool
    twice_m: int
    sigma: int


def random_case(parts: tuple[str, ...], rng: np.random.Generator) -> Case:
    states, spins = 1 + ("states" in parts), "spins" in parts
    abc = np.array([6000.0, 5000.0, 4200.0]) + rng.uniform(-150, 150, (states, 3))
    chi = rng.uniform(-4, 4, (3, 3))
    chi = (chi + chi.T) / 2
    c = rng.uniform(-0.3, 0.3, (3, 3))
    if "torsion" in parts:  # a mirror plane ab, which the package needs
        chi[2, :2] = chi[:2, 2] = c[2, :2] = c[:2, 2] = 0.0
    torsion = {
        "F": 160e3,
        "rho": rng.uniform(0, 0.1),
        "V3": rng.uniform(2e6, 9e6),
        "Dab": rng.uniform(-300, 300),
    }
    kv_per_cm = rng.uniform(0.05, 0.1 if "torsion" in parts else 0.3)
    tesla = rng.uniform(0.1, 2.0)
    return Case(
        abc=abc,
        origin=rng.uniform(500, 3000),
        fermi=rng.uniform(-200, 200),
        coriolis=rng.uniform(-200, 200),
        f_ab=rng.uniform(-20, 20),
        chi=chi - np.eye(3) * np.trace(chi) / 3,
        c=(c + c.T) / 2,
        dipole=rng.uniform(0.2, 1.0, 3) * (1, 1, "torsion" not in parts),
        kv_per_cm=kv_per_cm if "electric" in parts else 0.0,
        tesla=tesla if "magnetic" in parts else 0.0,
        g=rng.uniform(-0.5, 0.5, (3, 3)),
        torsion=torsion if "torsion" in parts else {},
        spins=spins,
        twice_m=2 * int(rng.integers(0, 1 if "torsion" in parts else 2)) + spins * int(rng.choice([-1, 1])),
        sigma=int(rng.integers(0, 2)),
    )


# The full matrix


@cache
def operators() -> tuple[dict[tuple[str, str], np.ndarray], dict[str, np.ndarray]]:
    """Direction cosines φ_pi and momenta N_i over |N k m⟩ with one N more than is held."""
    return space_cosines(LARGEST + 1), {axis: rotor_matrix(axis, LARGEST + 1) for axis in "abc"}


def spin_matrices(twice: int) -> dict[str, np.ndarray]:
    """S_x, S_y, S_z over m = S, ..., -S."""
    s = twice / 2
    m = np.arange(s, -s - 1, -1)
    plus = np.diag(np.sqrt(s * (s + 1) - m[1:] * (m[1:] + 1)), 1)
    return {"x": (plus + plus.T) / 2, "y": (plus - plus.T) / 2j, "z": np.diag(m)}


def full_levels(case: Case) -> np.ndarray:
    """The energies of one total M."""
    phi, momentum = operators()
    n_states, twice = len(case.abc), (2, 1) if case.spins else (0, 0)
    rotor_states = states_up_to(LARGEST + 1)
    sizes = [np.arange(t, -t - 1, -2) for t in twice]
    basis = [
        (v, r, a, b)
        for v, (r, (n, _, m)), (a, m_a), (b, m_b) in product(
            range(n_states), enumerate(rotor_states), enumerate(sizes[0]), enumerate(sizes[1])
        )
        if n <= LARGEST and 2 * m + m_a + m_b == case.twice_m
    ]  # fmt: skip
    v, r, a, b = (np.array(column) for column in zip(*basis, strict=True))
    first, two = (spin_matrices(t) for t in twice)
    unit = {0: np.eye(n_states), 1: np.eye(len(sizes[0])), 2: np.eye(len(sizes[1]))}

    def over(rotation: np.ndarray, state=unit[0], first=unit[1], second=unit[2]) -> np.ndarray:
        """The direct product over the functions of this M."""
        return rotation[np.ix_(r, r)] * state[np.ix_(v, v)] * first[np.ix_(a, a)] * second[np.ix_(b, b)]

    squares = {axis: momentum[axis] @ momentum[axis] for axis in "abc"}
    whole = np.eye(len(rotor_states))
    total = sum(
        over(
            sum(x * squares[axis] for x, axis in zip(case.abc[s], "abc", strict=True)),
            np.diag(np.eye(n_states)[s]),
        )
        for s in range(n_states)
    )
    if n_states == 2:
        real, imaginary = np.array([[0, 1], [1, 0]]), np.array([[0, 1j], [-1j, 0]])
        total = total + over(case.origin * whole, np.diag([0, 1.0])) + over(case.fermi * whole, real)
        total = total + over(case.coriolis * momentum["c"], imaginary)
        total = total + over(
            case.f_ab * (momentum["a"] @ momentum["b"] + momentum["b"] @ momentum["a"]),
            real,
        )
    if case.spins:
        for p, q in product("xyz", "xyz"):  # I = 1: I·χ·I/(2I(2I-1))
            field = sum(case.chi[i, k] * phi[p, "abc"[i]] @ phi[q, "abc"[k]] for i in range(3) for k in range(3))
            total = total + over(field, first=(first[p] @ first[q] + first[q] @ first[p]) / 4)
        for p in "xyz":
            mixed = sum(case.c[i, k] * _half(phi[p, "abc"[i]], momentum["abc"[k]]) for i in range(3) for k in range(3))
            total = total + over(mixed, second=two[p])
    total = total - case.kv_per_cm * MHZ_PER_DEBYE_KV_PER_CM * over(
        sum(case.dipole[i] * phi["z", "abc"[i]] for i in range(3))
    )
    if case.tesla:
        g = sum(case.g[i, k] * _half(phi["z", "abc"[i]], momentum["abc"[k]]) for i in range(3) for k in range(3))
        moment = over(g)
        if case.spins:
            moment = (
                moment + over(whole, first=NUCLEAR_G["N"] * first["z"]) + over(whole, second=NUCLEAR_G["H"] * two["z"])
            )
        total = total - case.tesla * NUCLEAR_MAGNETON_MHZ_PER_T * moment
    if not case.torsion:
        return np.linalg.eigvalsh(total)
    along, dab = (
        over(momentum["a"]),
        over(_half(momentum["a"], momentum["b"]) * 2 * case.torsion["Dab"]),
    )
    p = np.diag(3.0 * np.arange(-WAVES, WAVES + 1) + case.sigma)
    eye, potential = (
        np.eye(len(p)),
        case.torsion["V3"] / 2 * (np.eye(len(p)) - (np.eye(len(p), k=1) + np.eye(len(p), k=-1)) / 2),
    )
    slip = np.kron(np.eye(len(total)), p) - case.torsion["rho"] * np.kron(along, eye)
    turning = np.kron(total + dab, eye) + case.torsion["F"] * slip @ slip + np.kron(np.eye(len(total)), potential)
    return scipy.linalg.eigh(turning, eigvals_only=True, subset_by_index=[0, min(59, len(turning) - 1)])


def _half(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x @ y + y @ x) / 2


# The package


def top_and_effects(case: Case) -> tuple[Top, tuple[Any, ...]]:
    constants = rotor.Constants(**dict(zip("ABC", case.abc[0], strict=True)), reduction="A", representation="Ir")
    together = bool(case.kv_per_cm) and not case.spins
    settings = {"vt_max": 12, "functions": 14} if together else {"vt_max": 4}
    turning = InternalRotationConstants(case.torsion, "RAM", **settings) if case.torsion else None
    quadrupole = quadrupole_of_tensor(Spin("N", 2), case.chi)
    names = {f"C_{x}{y}(H)": case.c["abc".index(x), "abc".index(y)] for x, y in ("aa", "bb", "cc", "ab", "ac", "bc")}
    top = Top.from_constants(constants, dipole_abc_debye=tuple(case.dipole), internal_rotation=turning)
    effects: tuple[Any, ...] = effects_of(top, False) if turning else SEMI_RIGID
    if case.spins:
        effects = (*effects, quadrupole, SpinRotation(names, (Spin("H", 1),)))
    if len(case.abc) == 2:
        values = {
            "E[1]": case.origin,
            "W[0,1]": case.fermi,
            "G_c[0,1]": case.coriolis,
            "F_ab[0,1]": case.f_ab,
        }
        values |= dict(zip(("A[1]", "B[1]", "C[1]"), case.abc[1], strict=True))
        effects = (*effects, InteractingStates(values, {}, {(1, 1): tuple(case.dipole)}))
    return top, effects


def package_levels(case: Case) -> np.ndarray:
    """The energies of one total M, of one species beside internal rotation."""
    top, effects = top_and_effects(case)
    if case.torsion and case.kv_per_cm and not case.spins and len(case.abc) == 1:
        return _turning_in_field(case, top)
    if case.kv_per_cm or case.tesla:
        common = {"j_highest": 1, "jmax": LARGEST + 2, "tolerance_mhz": 1e-6}
        with_effects = {"effects": effects} if case.spins or len(case.abc) == 2 or case.torsion else {}
        if case.tesla:
            nuclear = {"nuclear_g": NUCLEAR_G} if case.spins else {}
            zeeman = zeeman_map(top, [0.0, case.tesla], case.g, **with_effects, **nuclear, **common)
        else:
            zeeman = stark_map(top, [0.0, case.kv_per_cm], m_values=[abs(case.twice_m) / 2], **with_effects, **common)
        m = case.twice_m / 2 if case.tesla else abs(case.twice_m) / 2
        chosen = (zeeman.field == zeeman.field.max()) & (zeeman.m == m)
        return np.sort(zeeman.energy_mhz[chosen])
    levels = solve_levels(top, LARGEST, effects=effects)
    chosen = levels.multiplicity > abs(case.twice_m)
    if case.torsion:
        chosen &= levels.quanta["species"] == "AE"[case.sigma]
    return np.sort(levels.energy_mhz[chosen])


def _turning_in_field(case: Case, top: Top) -> np.ndarray:
    """All torsional states of one species together in an electric field."""
    along = Contraction(tuple(case.dipole), (0.0, 0.0, 1.0))
    levels = solved_levels(top, LARGEST, ())
    without_vt = {name: column for name, column in levels.quanta.items() if name != "vt"}
    space = solved_space(top, replace(levels, quanta=without_vt), LARGEST, [along])
    species = space.levels.quanta["species"]
    blocks = [block for block in space.blocks(abs(case.twice_m) // 2) if species[block.rows[0]] == "AE"[case.sigma]]
    strength = case.kv_per_cm * MHZ_PER_DEBYE_KV_PER_CM
    matrices = [np.diag(block.energies_mhz) - strength * block.matrix(along) for block in blocks]
    return np.sort(np.concatenate([np.linalg.eigvalsh(matrix) for matrix in matrices]))


def differences(case: Case) -> np.ndarray:
    """Of the levels that neither side leaves out."""
    everything = not (case.spins or case.kv_per_cm or case.tesla or case.torsion)
    slow, ours = full_levels(case), package_levels(case)
    if not everything:
        lowest = slow[0] if case.torsion else 0.0
        slow, ours = (energies[energies < lowest + BELOW_MHZ] for energies in (slow, ours))
    assert len(ours) == len(slow) >= 3
    return np.abs(ours - slow)


@pytest.mark.parametrize("parts", [parts for parts in COMPUTED if parts not in COUNT], ids="+".join)
def test_one_of_each_combination(parts):
    assert differences(random_case(parts, np.random.default_rng(7))).max() < WITHIN_MHZ


@pytest.mark.slow
@pytest.mark.parametrize("parts", COMPUTED, ids="+".join)
def test_two_hundred_hamiltonians(parts):
    rng = np.random.default_rng(COMPUTED.index(parts))
    for _ in range(COUNT.get(parts, 14)):
        assert differences(random_case(parts, rng)).max() < WITHIN_MHZ


@pytest.mark.parametrize("parts", OTHERS, ids="+".join)
def test_other_combinations_are_refused_with_a_reason_or_right(parts):
    """No request takes an electric and a magnetic field at once; of the others each that computes is compared."""
    case = random_case(parts, np.random.default_rng(7))
    try:
        package_levels(case)
    except ValueError as error:
        refusal = str(error)
    else:
        refusal = ""
        assert differences(case).max() < WITHIN_MHZ
    assert not refusal or re.search(
        r"states|spins|internal rotation", refusal
    )  # which part it is that does not go with others


@pytest.mark.parametrize("name", ["chi", "c", "f_ab", "coriolis"])
def test_a_changed_constant_is_seen(name):
    """The comparison fails where the full matrix has another value: a negative control."""
    case = random_case(("states", "spins"), np.random.default_rng(7))
    value = getattr(case, name)
    wrong = replace(case, **{name: 1.05 * value})
    energies, slow = package_levels(case), full_levels(wrong)
    count = int((slow < BELOW_MHZ).sum())
    assert np.abs(energies[:count] - slow[:count]).max() > 5 * WITHIN_MHZ
