"""Moments of .int files of every TYP against a direct product in which they are written out as the documentation of SPCAT has them.

|v⟩ x |N k m⟩ x |m_S⟩ with every m; cosines and N as full matrices over N one higher than what is compared, so that products are exact.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.hamiltonian.dipole_codes import line_moment, split_dipole
from rotor.formats.spcat.text.int_file import Dipole, read_int
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins.many_f_lines import moments_of
from rotor.spectra.transitions.pairs import all_transitions
from rotor.tops.top import Top

TOP = 2  # highest N that is compared
CONSTANTS = ({"a": 9400.0, "b": 3100.0, "c": 2500.0}, {"a": 9340.0, "b": 3120.0, "c": 2500.0})
APART, GAMMA, MAGNETON = 150000.0, 31.0, 0.009274
DIPOLE = 0.4  # along SYM between the states, so that signs count


def _files(spind: str, oblate: bool, dipoles: str):
    rigid = "10099 9400.0 1\n20099 3100.0 1\n30099 2500.0 1\n10011 -60.0 1\n20011 20.0 1\n11 150000.0 1\n"
    spin = f"10000099 {GAMMA} 1\n" if spind == "2" else ""
    option = f"a {spind} {'-' if oblate else ''}2 0 9 0 1 1 1 0 1 0"
    par = read_par(f"two states\n9 1 1 0 0.0 1e6 1.0 1.0\n{option}\n{rigid}{spin}".encode())
    return par, read_int(f"two states\n0 999 1000.0 0 3 -30 -30 9999.99 300.0\n{dipoles}".encode())


def _ours(spind: str, oblate: bool, dipoles: str):
    (group,) = connected_groups(*_files(spind, oblate, dipoles))
    levels = group.levels((0, 2 * TOP) if spind == "1" else (1, 2 * TOP + 1))
    return levels, all_transitions(levels, dict(group.effect.moments), moments=group.effect.others)


@cache
def _factors():
    """φ (by axis in space and in the molecule) and N over N up to TOP + 1, and which functions are compared."""
    momentum = {axis: rotor_matrix(axis, TOP + 1) for axis in "abc"}
    keep = [i for i, s in enumerate(states_up_to(TOP + 1)) if s[0] <= TOP]
    return space_cosines(TOP + 1), momentum, keep


def _anti(first, two):
    return first @ two + two @ first


def _documented(typ: int, sym: int, oblate: bool, space: str) -> np.ndarray:
    """The operator of the table of dipole types without a spin, one component in space, SYM 0 in magnetons."""
    cosines, n, _ = _factors()
    x, y, z = "bac" if oblate else "bca"
    i = -1j if oblate else 1j
    phi = {axis: cosines[space, axis] for axis in "abc"}
    squared = sum(component @ component for component in n.values())
    along_n = sum(phi[axis] @ n[axis] for axis in "abc")
    base = phi["abc"[sym - 1]] if sym else along_n
    first, two = (axis for axis in "abc" if axis != "abc"[sym - 1])
    if sym:
        second = i * (_anti(phi[first], n[two]) + _anti(phi[two], n[first])) / 2
    elif typ == 1:
        second = (2 * phi[z] @ n[z] - phi[x] @ n[x] - phi[y] @ n[y]) / 2
        second = (second + second.conj().T) / 2
    else:
        second = phi[y] @ n[y] - phi[x] @ n[x]
        second = (second + second.conj().T) / 2
    across = n[y] @ n[y] - n[x] @ n[x]
    if typ in (1, 2):
        return second
    if typ in (3, 9):
        return _anti(np.linalg.matrix_power(squared, {3: 1, 9: 2}[typ]), base) / 2
    if typ == 4:
        return _anti(n[z] @ n[z], base) / 2
    if typ == 5:
        return (squared @ base - base @ squared) / 2
    if typ == 10:
        inner = squared @ base - base @ squared
        return (squared @ inner - inner @ squared) / 4
    if typ == 11:
        return (squared @ second - second @ squared) / 2
    if typ == 12:
        return -i * _anti(n[z], second) / 2  # the sign of the program
    if not sym:
        return along_n @ across
    if sym == "abc".index(z) + 1:
        crossed = _anti(phi[y], _anti(n[y], n[z])) - _anti(phi[x], _anti(n[x], n[z]))
        return (_anti(phi[z], across) + crossed) / np.sqrt(6)
    axis_, other, sign = (x, y, 1) if sym == "abc".index(x) + 1 else (y, x, -1)
    return (_anti(phi[axis_], across) + sign * _anti(phi[other], _anti(n[x], n[y]))) / 2


def _direct(spins2: tuple[int, ...], space_operator) -> tuple[np.ndarray, np.ndarray]:
    """Energies and Σ |⟨f|M_p|i⟩|² over p of M = |0⟩m⟨1| + its conjugate, m = `of_space`(p) over the rotor and the spin."""
    cosines, n, keep = _factors()
    inner = np.ix_(keep, keep)
    blocks = []
    for v, constants in enumerate(CONSTANTS):
        rigid = sum(value * n[axis] @ n[axis] for axis, value in constants.items()) + APART * v * np.eye(len(n["a"]))
        rotation = on_spins(rigid[inner], spins2, {})
        if spins2:
            for p in "xyz":
                space_n = sum(cosines[p, axis] @ n[axis] for axis in "abc")
                rotation = rotation + GAMMA * on_spins(space_n[inner], spins2, {1: qutip.jmat(0.5, p).full()})
        blocks.append(rotation)
    size = len(blocks[0])
    energies, vectors = np.linalg.eigh(
        np.block([[blocks[0], np.zeros((size, size))], [np.zeros((size, size)), blocks[1]]])
    )
    total = 0.0
    for p in "xyz":
        moment = np.zeros((2 * size, 2 * size), complex)
        moment[:size, size:] = space_operator(p)
        moment += moment.conj().T
        total = total + np.abs(vectors.conj().T @ moment @ vectors) ** 2
    return energies, total


def _compare(spind: str, oblate: bool, dipoles: str, space_operator) -> None:
    levels, computed = _ours(spind, oblate, dipoles)
    energies, squares = _direct((1,) if spind == "2" else (), space_operator)
    low = [row for row in range(len(computed.upper)) if max(_n(levels, computed, row)) <= TOP]
    assert len(low) >= 10
    for row in low:
        where = [
            np.abs(energies - levels.energy_mhz[state]) < 1e-6 for state in (computed.upper[row], computed.lower[row])
        ]
        expected = squares[np.ix_(*where)].sum()
        # sums of some hundred squares of numbers of about 10
        assert computed.strength_debye2[row] == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert computed.strength_debye2[low].sum() == pytest.approx(squares.sum() / 2, rel=1e-9)  # none is missing


def _n(levels, computed, row):
    return [int(levels.rotational[state]) for state in (computed.upper[row], computed.lower[row])]


KINDS = [
    (typ, sym) for typ in (1, 2, 3, 4, 5, 6, 9, 10, 11, 12) for sym in range(4) if (typ, sym) not in ((5, 0), (10, 0))
]


@pytest.mark.parametrize("oblate", [False, True])
@pytest.mark.parametrize(("typ", "sym"), KINDS)
def test_moments_between_two_states(typ, sym, oblate):
    code = 100_000 * (typ // 10) + 10_000 * (typ % 10) + 10 + sym
    keep = _factors()[2]
    inner = np.ix_(keep, keep)

    def space_operator(p):
        plain = _documented(3, sym, oblate, p) if not sym else sum(_factors()[0][p, axis] for axis in "abc")
        whole = DIPOLE * plain + 0.15 * _documented(typ, sym, oblate, p)
        return (whole if sym else MAGNETON * whole)[inner]

    first = "\n".join(f"{each} {DIPOLE}" for each in ((11, 12, 13) if sym else (30010,)))
    _compare("1", oblate, f"{first}\n{code} 0.15\n", space_operator)


@pytest.mark.parametrize("oblate", [False, True])
@pytest.mark.parametrize(("typ", "sym"), [(1, 0), (2, 0), (1, 1), (1, 2), (2, 3), (0, 0), (4, 0), (6, 0)])
def test_moments_of_a_spin_between_two_states(typ, sym, oblate):
    cosines, n, keep = _factors()
    x, y, z = "bac" if oblate else "bca"
    inner, spin = np.ix_(keep, keep), {p: qutip.jmat(0.5, p).full() for p in "xyz"}
    c = np.zeros((3, 3), complex)
    first, two = (axis for axis in range(3) if axis != sym - 1) if sym else (0, 0)
    if sym:
        c[first, two] = c[two, first] = -1j if oblate else 1j
    else:
        for axis, value in zip((x, y, z), (-0.5, -0.5, 1.0) if typ == 1 else (-1.0, 1.0, 0.0), strict=True):
            c["abc".index(axis), "abc".index(axis)] = value

    def space_operator(p):
        if typ in (1, 2):
            total = 0.0
            for q in "xyz":
                both = sum(c[i, k] * cosines[p, "abc"[i]] @ cosines[q, "abc"[k]] for i in range(3) for k in range(3))
                total = total + on_spins(both[inner], (1,), {1: spin[q]})
        else:
            across = n[y] @ n[y] - n[x] @ n[x]
            rotor = {0: np.eye(len(across)), 4: n[z] @ n[z], 6: across}[typ]
            total = on_spins(rotor[inner], (1,), {1: spin[p]})
        plain = on_spins(cosines[p, "abc"[sym - 1]][inner], (1,), {}) if sym else 0.0
        return 0.15 * total + DIPOLE * plain if sym else MAGNETON * 0.15 * total

    plain = f"{10 + sym} {DIPOLE}\n" if sym else ""
    _compare("2", oblate, f"{plain}{10_000 * typ + 1010 + sym} 0.15\n", space_operator)


@pytest.mark.parametrize("oblate", [False, True])
def test_a_spin_with_a_moment_and_n(oblate):
    """TYP 0 with SYM along z and a spin: 3/2 Σ_q of the traceless symmetric part of ½{φ_p, N_q} with S_q."""
    cosines, n, keep = _factors()
    sym = 3 if oblate else 1
    inner, axis = np.ix_(keep, keep), "abc"[sym - 1]
    space_n = {p: sum(cosines[p, axis] @ n[axis] for axis in "abc") for p in "xyz"}
    both = {(p, q): _anti(cosines[p, axis], space_n[q]) / 2 for p in "xyz" for q in "xyz"}
    trace = sum(both[p, p] for p in "xyz") / 3

    def space_operator(p):
        parts = {q: (both[p, q] + both[q, p]) / 2 - (trace if p == q else 0.0) for q in "xyz"}
        spins = sum(on_spins(parts[q][inner], (1,), {1: qutip.jmat(0.5, q).full()}) for q in "xyz")
        return 1.5 * 0.15 * spins + DIPOLE * on_spins(cosines[p, axis][inner], (1,), {})

    _compare("2", oblate, f"{10 + sym} {DIPOLE}\n{1010 + sym} 0.15\n", space_operator)


@pytest.mark.parametrize("code", [10001, 20002, 81001, 110002, 110000])
def test_a_moment_that_time_reversal_turns_is_none_of_one_state(code):
    with pytest.raises(ValueError, match="time reversal would change the sign"):
        line_moment(Dipole(code, 1.0), split_dipole(code, 1), (0, 0), 1)


@pytest.mark.parametrize("as_spcat", [False, True])
@pytest.mark.parametrize("beside", ["", "1 0.001\n"])
def test_a_cosine_without_an_angle_is_the_plain_dipole(beside, as_spcat):
    """TYP 7 with n = 0 is TYP 0, between states that a coupling mixes too, alone and beside a dipole of a state."""
    results = []
    for code in (103, 70103):
        par, request = _files("1", False, f"{code} 1.0\n{beside}")
        coupling = replace(par.parameters[-1], code=20010, value=100.0)
        (group,) = connected_groups(replace(par, parameters=(*par.parameters, coupling)), request, as_spcat=as_spcat)
        levels = group.levels((0, 8))
        lines = all_transitions(levels, dict(group.effect.moments), moments=group.effect.others)
        results.append(dict(zip(zip(lines.upper, lines.lower, strict=True), lines.strength_debye2, strict=True)))
    plain, cosine = ({lines: value for lines, value in entry.items() if value > 1e-12} for entry in results)  # of 1 D²
    assert len(plain) > 100
    assert cosine == pytest.approx(plain, rel=1e-6)  # 1e-12 of 1 D² where amplitudes cancel


def test_moments_beside_plain_dipoles_need_levels_with_spins():
    levels = solve_levels(Top.from_constants("A=9 B=6 C=5 GHz"), 2)
    for plain in (levels, replace(levels, blocks=())):
        with pytest.raises(ValueError, match="need levels that were solved with spins"):
            moments_of(plain, {(0, 0): (1.0, 0.0, 0.0)}, [])
