"""Operators that time reversal turns around within one state, and PHASE of XOPT, against closed forms and complex matrices over signed K.

Lines of the program are in tests/oracles/kinds (odd_and_phase, odd_in_oblate).
"""

from __future__ import annotations

import numpy as np
import pytest
from full_matrix_rotor import momenta, reduced_vector

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.hamiltonian.coded_file import coded_file
from rotor.formats.spcat.names.named_top import named_top
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.int_file import IntensityFile, Request, read_int
from rotor.formats.spcat.text.par import read_par

ABC = ((10099, 9000.123), (20099, 5000.2), (30099, 4300.7))
ROUND_OFF_MHZ = 1e-8  # of 1e6 MHz


def _file(parameters, spin=1, nvib=1, phase=0):
    lines = "".join(f"{code} {value!r} 0\n" for code, value in parameters)
    options = f"a {spin} {nvib} 0 40 0 1 1 1 0 1 0 {phase}\n"
    return read_par(f"a case\n {len(parameters)} 1 1 0 0 1e6 1 1\n{options}{lines}".encode())


def _energies(file, j):
    (group,) = connected_groups(file, IntensityFile("", Request(), ()))
    levels = group.levels((2 * j, 2 * j))
    return np.sort(levels.energy_mhz[levels.rotational == j])


def _rigid(of):
    return sum(value * of[axis] @ of[axis] for axis, (_, value) in zip("abc", ABC, strict=True))


def _both(of, first, other):
    return of[first] @ of[other] + of[other] @ of[first]


@pytest.mark.parametrize(("nvib", "code"), [(1, 200099), (-1, 600099)])
@pytest.mark.parametrize("j", [1, 6])
def test_along_the_axis_of_a_symmetric_top(nvib, code, j):
    """B J(J+1) + (A - B) k² + g k for every signed k: K doublets are split by 2 g K."""
    b, off, g = 5000.0, 1234.5, 77.7
    energies = _energies(_file(((199, b), (1099, off), (code, g)), nvib=nvib), j)
    k = np.arange(-j, j + 1)
    assert energies == pytest.approx(np.sort(b * j * (j + 1) + off * k**2 + g * k), abs=ROUND_OFF_MHZ)


# codes and values beside the rigid rotor, and what they stand for
CASES = {
    "a, with powers": ({200099: 70.0, 200199: 0.2, 201099: 0.1}, lambda of, x: x * (70.0 * of["a"] + 0.2 * _n2(of, "a"))),
    "b and c, even along a": ({400099: 60.0, 600099: -50.0, 210099: 20.0},
                              lambda of, x: x * (60.0 * of["b"] - 50.0 * of["c"]) + 20.0 * _both(of, "b", "c")),
    "c, even along b": ({600099: 45.0, 410099: 12.0}, lambda of, x: x * 45.0 * of["c"] + 12.0 * _both(of, "a", "c")),
}  # fmt: skip


def _n2(of, axis):
    n2 = sum(of[each] @ of[each] for each in "abc")
    return n2 @ of[axis]


@pytest.mark.parametrize("nvib", [1, -1])
@pytest.mark.parametrize("name", CASES)
def test_levels_are_those_of_the_complex_matrix(name, nvib):
    j, z = 5, "a" if nvib > 0 else "c"
    codes, more = CASES[name]
    of = momenta(j, z)
    whole = _rigid(of) + more(of, 1.0)
    if 201099 in codes:
        whole = whole + codes[201099] * (of[z] @ of[z] @ of["a"] + of["a"] @ of[z] @ of[z]) / 2
    energies = _energies(_file((*ABC, *codes.items()), nvib=nvib), j)
    assert energies == pytest.approx(np.linalg.eigvalsh(whole), abs=ROUND_OFF_MHZ)
    assert np.abs(energies - _energies(_file(ABC, nvib=nvib), j)).max() > 5.0  # they act


def test_strengths_are_those_of_the_complex_matrix():
    """Components of the dipole that are real and imaginary in these functions: their squares are added, not their sum squared."""
    mu = (1.0, 0.7, 0.4)
    diagonal = {200099: 90.0, 610099: 15.0}
    request = read_int(b"a case\n0 41 1 0 4 -90 -90 99999 300\n 1 1.0\n 2 0.7\n 3 0.4\n")
    lines = predict(_file((*ABC, *diagonal.items())), request).lines
    states = {}
    for j in range(5):
        of = momenta(j, "a")
        states[j] = np.linalg.eigh(_rigid(of) + 90.0 * of["a"] + 15.0 * _both(of, "a", "b"))
    results = {}
    for j in range(5):
        for up in range(j, min(j + 2, 5)):
            amplitude = states[up][1].conj().T @ reduced_vector(up, j, np.array(mu), "a") @ states[j][1]
            for i, k in zip(*np.nonzero(np.abs(amplitude) > 1e-6), strict=True):
                if up > j or i > k:
                    key = round(abs(states[up][0][i] - states[j][0][k]), 3)
                    results[key] = abs(amplitude[i, k]) ** 2
    strong = lines.strength_debye2 > 1e-5
    assert strong.sum() > 150
    for frequency, strength in zip(lines.frequency_mhz[strong], lines.strength_debye2[strong], strict=True):
        near = min(results, key=lambda frequency_: abs(frequency_ - frequency))
        assert abs(near - frequency) < 2e-3  # the rounding of the keys
        assert results[near] == pytest.approx(strength, rel=1e-7, abs=1e-12)  # round-off of levels that nearly coincide


@pytest.mark.parametrize("phase", [0, 3, 5, 6])
@pytest.mark.parametrize("nvib", [2, -2])
def test_two_states_with_each_phase(phase, nvib):
    """⟨0|H|1⟩ = Σ g N + Σ f {N, N}, times i where g is not along an odd axis, and where f is along one."""
    j, z = 4, "a" if nvib > 0 else "c"
    of, size = momenta(j, z), 2 * j + 1
    axes = "cba" if nvib > 0 else "abc"
    odd = [axis for bit, axis in enumerate(axes) if phase >> bit & 1]
    sign = 1.0 if nvib > 0 else -1.0  # with which the program takes odd operators in an oblate basis
    g, f = {"a": 30.0, "b": 25.0, "c": -20.0}, {"a": 8.0, "b": -7.0, "c": 5.0}
    within = {"a": 60.0, "b": -50.0, "c": 40.0}
    codes = {"a": 200001, "b": 400001, "c": 600001}
    pairs = {"a": "bc", "b": "ac", "c": "ab"}
    parameters = [*ABC, (11, 700.0)]
    between = np.zeros((size, size), dtype=complex)
    coupling = np.zeros((size, size), dtype=complex)
    for axis in "abc":
        parameters += [(codes[axis], g[axis]), (codes[axis] + 10000, f[axis])]
        between += (1 if axis in odd else 1j) * sign * g[axis] * of[axis]
        between += (1j if axis in odd else 1) * f[axis] * _both(of, *pairs[axis])
        if axis in odd:
            parameters.append((codes[axis] + 10, within[axis]))
            coupling += sign * within[axis] * of[axis]
    whole = np.block([[_rigid(of), between], [between.conj().T, _rigid(of) + coupling + 700.0 * np.eye(size)]])
    energies = _energies(_file(parameters, nvib=nvib, phase=phase), j)
    assert energies == pytest.approx(np.linalg.eigvalsh(whole), abs=ROUND_OFF_MHZ)


def test_a_spin_along_the_axis():
    """c φ_a·S of S = 1/2: its square is c²/4, so that N = J ± 1/2 with one k give a matrix with the elements ±d and √(c²/4 - d²)."""
    b, off, c, j = 5000.0, 1234.5, 88.8, 3.5
    file = _file(((199, b), (1099, off), (10200000, c)), spin=2)
    (group,) = connected_groups(file, IntensityFile("", Request(), ()))
    levels = group.levels((7, 7))
    expected = []
    for k in range(-4, 5):
        n = np.array([j - 0.5, j + 0.5])
        d = c * k * (j * (j + 1) - n * (n + 1) - 0.75) / (2 * n * (n + 1))
        energy = b * n * (n + 1) + off * k**2
        if abs(k) == 4:  # N = 4 alone
            expected.append(energy[1] + d[1])
        else:
            across = np.sqrt(c**2 / 4 - d[0] ** 2)
            expected += list(np.linalg.eigvalsh([[energy[0] + d[0], across], [across, energy[1] + d[1]]]))
    assert np.sort(levels.energy_mhz) == pytest.approx(np.sort(expected), abs=ROUND_OFF_MHZ)


def test_those_of_the_rarer_kind_are_left_out_with_a_note():
    """One odd and one even operator along a: the program takes the even one; PHASE 4 the other."""
    both = (*ABC, (200099, 70.0), (210099, 20.0))
    assert [note[:16] for note in coded_file(_file(both)).left_out] == ["parameter 200099"]
    assert [note[:16] for note in coded_file(_file(both, phase=4)).left_out] == ["parameter 210099"]
    assert coded_file(_file(both, phase=8)).left_out == coded_file(_file(both)).left_out
    common_parameters = (*both[:3], (11, 9.0), (200099, 70.0), (210000, 20.0))  # the odd one counts twice
    assert [note[:16] for note in coded_file(_file(common_parameters, nvib=2)).left_out] == ["parameter 210000"]
    assert _energies(_file(both), 3) == pytest.approx(_energies(_file((*ABC, both[-1])), 3), abs=ROUND_OFF_MHZ)


@pytest.mark.parametrize(
    ("parameters", "says"),
    [
        (((200099, 70.0), (410099, 20.0), (610099, 20.0)), "a odd, b even, c even"),
        (((200099, 70.0), (400099, 20.0), (600099, 20.0)), "a odd, b odd, c odd"),
        (((11_000_210_099, 5.0), (910099, 0.4)), "under no half turn"),
        (((120099, 5.0),), "under no half turn"),
    ],
)
def test_what_is_complex_in_all_phases_is_refused(parameters, says):
    with pytest.raises(ValueError, match=says):
        _energies(_file((*ABC, *parameters)), 2)


@pytest.mark.parametrize("dipole", ["81010 1.0", "120100 1.0"])
def test_magnetic_moments_that_a_half_turn_changes_are_refused(dipole):
    request = read_int(f"a case\n0 41 1 0 4 -90 -90 99999 300\n 1 1.0\n {dipole}\n".encode())
    file = _file((*ABC, (11, 700.0), (200099, 90.0), (910099, 0.4)), nvib=2)
    with pytest.raises(ValueError, match="SYM 0 with TYP 8 or 12"):
        connected_groups(file, request)


def test_they_have_no_names():
    with pytest.raises(ValueError, match="odd under time reversal"):
        named_top(_file((*ABC, (200099, 70.0))))


def test_sines_of_internal_rotation():
    """c sin(2π ρ K/3), an odd function of K along the axis."""
    j, rho, c = 4, 0.37, 55.5
    of, k = momenta(j, "a"), np.arange(-j, j + 1)
    whole = _rigid(of) + np.diag(c * np.sin(2 * np.pi / 3 * rho * k))
    energies = _energies(_file((*ABC, (910099, rho), (11_000_000_099, c))), j)
    assert energies == pytest.approx(np.linalg.eigvalsh(whole), abs=ROUND_OFF_MHZ)


def test_weights_forbid_elements():
    """Two states of weights 5, 3 and 3, 3 by the parity of Ka: i g Nb joins levels of weight 3 alone, of the first state Ka odd."""
    j, g, energy = 5, 90.0, 300.0
    lines = "".join(f"{code} {value!r} 0\n" for code, value in (*ABC, (11, energy), (400001, g)))
    options = "a 1 2 0 40 0 1 5 3 -1 1 0\na 1 1 0 40 0 1 3 3 0 1 0\n"
    file = read_par(f"a case\n 5 1 1 0 0 1e6 1 1\n{options}{lines}".encode())
    of, size = momenta(j, "a"), 2 * j + 1
    odd = np.diag((np.arange(-j, j + 1) % 2).astype(float))
    between = 1j * g * odd @ of["b"]
    whole = np.block([[_rigid(of), between], [between.conj().T, _rigid(of) + energy * np.eye(size)]])
    assert _energies(file, j) == pytest.approx(np.linalg.eigvalsh(whole), abs=ROUND_OFF_MHZ)


@pytest.mark.parametrize(("weights", "acts"), [("1 1", True), ("5 3", False)])
def test_imaginary_l_doubling(weights, acts):
    """{Nb, Nc} with Δk = Δl = 2 is l-doubling with another phase of l: by itself it acts as N₊² + N₋² of half its size, where levels A1
    and A2 may mix, and with unlike weights of these not at all."""
    constants = ((1099, 148900.0), (199, 9198.9), (200000, -277854.0))

    def energies(*more):
        lines = "".join(f"{code} {value!r} 0\n" for code, value in (*constants, *more))
        options = f"s -1 2 0 30 0 6 {weights} -1 101 0\ns -1 1 0 30 0 6 {weights} 0 201 0\n"
        return _energies(read_par(f"a case\n {3 + len(more)} 1 1 0 0 1e6 1 1\n{options}{lines}".encode()), 5)

    energies_, none, real = energies((210001, 40.0)), energies(), energies((40001, 20.0))
    assert np.abs(real - none).max() > 1.0
    assert energies_ == pytest.approx(real if acts else none, abs=ROUND_OFF_MHZ)
