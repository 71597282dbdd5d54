"""Random Hamiltonians of two states, two spins, fields and a methyl group as full matrices of direct products.

|v⟩|N k m⟩|m_I⟩|m_S⟩ with all m of one total M, N ≤ 3, and beside internal rotation the plane waves e^imα of one species. Nothing is
coupled or contracted; products of direction cosines and of N are multiplied out with one N more.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from direct_product import rotor_matrix, space_cosines, states_up_to

from rotor.units import MHZ_PER_DEBYE_KV_PER_CM, NUCLEAR_MAGNETON_MHZ_PER_T

LARGEST, WAVES = 3, 8
NUCLEAR_G = {"N": 0.4, "H": 5.59}


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
    dipole: np.ndarray  # of every state
    between: np.ndarray  # dipole between two states
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
        between=rng.uniform(-0.5, 0.5, 3) * (states == 2),
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


def functions_of_m(case: Case) -> tuple[np.ndarray, ...]:
    """Numbers of the state, of |N k m⟩ and of the functions of both spins, of all products of one total M."""
    sizes = [np.arange(t, -t - 1, -2) for t in ((2, 1) if case.spins else (0, 0))]
    basis = [
        (v, r, a, b)
        for v, (r, (n, _, m)), (a, m_a), (b, m_b) in product(
            range(len(case.abc)), enumerate(states_up_to(LARGEST + 1)), enumerate(sizes[0]), enumerate(sizes[1])
        )
        if n <= LARGEST and 2 * m + m_a + m_b == case.twice_m
    ]  # fmt: skip
    return tuple(np.array(column) for column in zip(*basis, strict=True))


def full_matrix(case: Case) -> np.ndarray:
    """The Hamiltonian of one total M, beside internal rotation with its plane waves."""
    phi, momentum = operators()
    n_states, twice = len(case.abc), (2, 1) if case.spins else (0, 0)
    rotor_states = states_up_to(LARGEST + 1)
    sizes = [np.arange(t, -t - 1, -2) for t in twice]
    v, r, a, b = functions_of_m(case)
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
    between = np.ones((n_states, n_states)) - np.eye(n_states)
    for dipole, states in ((case.dipole, np.eye(n_states)), (case.between, between)):
        along = sum(dipole[i] * phi["z", "abc"[i]] for i in range(3))
        total = total - case.kv_per_cm * MHZ_PER_DEBYE_KV_PER_CM * over(along, states)
    if case.tesla:
        g = sum(case.g[i, k] * _half(phi["z", "abc"[i]], momentum["abc"[k]]) for i in range(3) for k in range(3))
        moment = over(g)
        if case.spins:
            moment = (
                moment + over(whole, first=NUCLEAR_G["N"] * first["z"]) + over(whole, second=NUCLEAR_G["H"] * two["z"])
            )
        total = total - case.tesla * NUCLEAR_MAGNETON_MHZ_PER_T * moment
    if not case.torsion:
        return total
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
    return np.kron(total + dab, eye) + case.torsion["F"] * slip @ slip + np.kron(np.eye(len(total)), potential)


def _half(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x @ y + y @ x) / 2
