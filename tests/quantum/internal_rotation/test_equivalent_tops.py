"""Two equivalent tops: signs under their exchange, spin weights by permuting the spins of every nucleus, levels and lines."""

from dataclasses import replace
from itertools import product
from math import pi

import numpy as np
import pytest
from linear_functions import energies_of

import rotor
from rotor import units
from rotor.formats.molecules.molecule_file import read_molecule_file
from rotor.formats.molecules.molecule_writer import write_molecule_file
from rotor.quantum.internal_rotation.exchange import exchanged_functions
from rotor.quantum.internal_rotation.several_tops import several_tops

CM = units.MHZ_PER_CM
ABC = {"A": 9800.0, "B": 4300.0, "C": 3200.0, "DeltaK": 0.01}
ANGLES = {  # delta_2, epsilon_1, epsilon_2 that C2 about an axis makes of delta_1 = 0.56
    "b": (pi - 0.56, 0.0, 0.0),
    "a": (-0.56, 0.0, 0.0),
    "c": (0.56 - pi, 0.0, 0.0),
    "b, out of the plane": (pi - 0.56, 0.3, -0.3),
}


def constants_of(case="b", **others):
    delta, first, second = ANGLES[case]
    tops = {"F0_1": 158e3, "delta_1": 0.56, "epsilon_1": first, "V3_1": 150 * CM}
    tops |= {"F0_2": 158e3, "delta_2": delta, "epsilon_2": second, "V3_2": 150 * CM}
    return tops | {"V12": 5 * CM, "V12s": -3 * CM} | others


# Spin weights by brute force


def permuted(permutation, states):
    """The matrix of a permutation of nuclei over all products of their spin states."""
    functions = list(product(*(range(n) for n in states)))
    place = {function: i for i, function in enumerate(functions)}
    matrix = np.zeros((len(functions),) * 2)
    for i, function in enumerate(functions):
        moved = [0] * len(states)
        for nucleus, value in enumerate(function):
            moved[permutation[nucleus]] = value
        matrix[place[tuple(moved)], i] = 1.0
    return matrix


def characters(sigma, x):
    """Matrices of (123), (456) and of the exchange over the torsion-rotation functions of one level of (σ1, σ2)."""
    w = np.exp(2j * np.pi / 3)
    members = [sigma] if sigma[0] == sigma[1] else [sigma, sigma[::-1]]
    if any(sigma):
        members += [(-a, -b) for a, b in members if (-a, -b) not in members]
    first, second = (np.diag([w ** member[i] for member in members]) for i in (0, 1))
    exchange = np.zeros((len(members),) * 2)
    for i, member in enumerate(members):
        exchange[members.index(member[::-1]), i] = x if sigma[0] == sigma[1] else 1.0
    return first, second, exchange


def allowed_functions(sigma, x, n, pairs=()):
    """Products of level and spin functions that change as the statistics of the nuclei demand, by projection."""
    states = [n] * 6 + [m for m in pairs for _ in (0, 1)]
    swap = [3, 4, 5, 0, 1, 2]
    for i in range(len(pairs)):
        swap += [7 + 2 * i, 6 + 2 * i]
    rest = list(range(6, len(states)))
    spins = [permuted(p, states) for p in ([1, 2, 0, 3, 4, 5, *rest], [0, 1, 2, 4, 5, 3, *rest], swap)]
    statistics = (-1) ** (3 * (n - 1) + sum(m - 1 for m in pairs))
    whole = [np.kron(a, b) for a, b in zip(characters(sigma, x), spins, strict=True)]
    one = np.eye(len(whole[0]))
    projection = one
    for cycle in whole[:2]:
        projection = projection @ (one + cycle + cycle @ cycle) / 3
    return round(np.trace(projection @ (one + statistics * whole[2]) / 2).real)


CASES = [
    ((0, 0), 2, ()),
    ((0, 1), 2, ()),
    ((1, 1), 2, ()),
    ((1, -1), 2, ()),
    ((0, 0), 2, (2,)),
    ((0, 0), 2, (3,)),
    ((1, 1), 2, (2,)),
]


@pytest.mark.parametrize(("sigma", "n", "pairs"), CASES)
@pytest.mark.parametrize("x", [1, -1])
def test_spin_weights_are_those_of_permuted_spins(sigma, x, n, pairs):
    counted = exchanged_functions(n, pairs, sigma)[[1, -1].index(x)]
    assert counted == allowed_functions(sigma, x, n, pairs)


@pytest.mark.parametrize("n", [2, 3])
def test_weights_sum_to_all_spin_functions(n):
    """Σ over C3 ≀ C2 of (spin functions of a species) times its dimension over its copies is n⁶."""
    counts = {sigma: exchanged_functions(n, (), sigma) for sigma in ((0, 0), (1, 1), (1, -1), (0, 1))}
    total = counts[0, 0].sum() + counts[1, 1].sum() + 2 * counts[1, -1][0] + 2 * counts[0, 1][0]
    assert total == n**6
    assert counts[0, 0].tolist() == ([6, 10] if n == 2 else [66, 55])


# Levels


@pytest.mark.parametrize("case", ANGLES)
@pytest.mark.parametrize("species", [(0, 0), (1, 1)])
def test_functions_with_a_sign_give_the_levels_of_plain_ones(case, species):
    model = several_tops(ABC, constants_of(case))
    assert model.axis == case[0]
    blocks = model.blocks(species, 3, count=9)
    plain = replace(model, axis="").blocks(species, 3, count=len(blocks.functions.torsion.retained))
    linear = blocks.summed(model.coefficients)
    energies = np.sort(energies_of(linear, len(blocks.functions.labels["J"]), [1.0]))
    assert (
        np.abs(energies - np.sort(energies_of(plain.linear, plain.elements.count, model.coefficients))).max() < 1e-6
    )  # MHz, of up to 1e8
    largest, of_plain = (max(block.size for _, block in each) for each in (linear, plain.linear))
    assert largest < 0.75 * of_plain
    every = blocks.functions.elements(list(blocks.terms.values()))
    x = blocks.functions.labels["x"]
    whole = model.coefficients @ every.values
    assert np.abs(whole[x[every.rows] != x[every.columns]]).max(initial=0.0) < 1e-6  # what `of_whole` leaves out


@pytest.mark.parametrize("name", ["AA", "AE", "EE", "EE*"])
@pytest.mark.parametrize("case", ANGLES)
def test_expectation_values_are_those_of_the_elements_between_functions(case, name):
    model = several_tops(ABC, constants_of(case))
    further = list(model.slopes_by_rho(model.species[name]).values())
    levels = model.blocks(model.species[name], 3, jmin=2, count=16).solve_once(model.coefficients, 1)
    slopes = levels.slopes(further=further)
    elements = levels.functions.elements([*levels.source.terms.values(), *further])
    for number, column in enumerate(slopes.T):
        matrix = elements.dense(number)
        expected = np.concatenate(
            [
                (vectors.conj() * (matrix[np.ix_(rows, rows)] @ vectors)).sum(axis=0).real
                for rows, vectors in zip(levels.members, levels.vectors, strict=True)
            ]
        )
        assert np.allclose(column, expected, rtol=1e-10, atol=1e-10 * np.abs(elements.values[number]).max())


@pytest.mark.parametrize("case", ANGLES)
def test_the_sign_of_a_ground_state_is_that_of_a_rigid_top(case):
    """C2 about the axis changes J(Ka, Kc) by (-1)^Ka, (-1)^(Ka + Kc), (-1)^Kc of a, b, c."""
    model = several_tops(ABC, constants_of(case))
    for species in ((0, 0), (1, 1)):
        levels = model.blocks(species, 4, count=9).solve_once(model.coefficients, 0)
        quanta = levels.quanta
        power = {"a": quanta["ka"], "b": quanta["ka"] + quanta["kc"], "c": quanta["kc"]}[case[0]]
        x = levels.functions.labels["x"][levels.names]
        assert (x == np.where(power % 2, -1, 1)).all()
        assert len(set(zip(quanta["j"], quanta["ka"], quanta["kc"], strict=True))) == 25  # each (J, Ka, Kc) once


@pytest.mark.parametrize("change", [{"V3_2": 151 * CM}, {"F0_2": 158.1e3}, {"delta_2": pi - 0.561}])
def test_tops_that_differ_are_not_equivalent(change):
    assert several_tops(ABC, constants_of(**change)).axis == ""


FILE = """
name = "acetone-like"
[constants]
A = 9800
B = 4300
C = 3200
reduction = "A"
representation = "Ir"
[dipole]
b = 2.9
[internal_rotation]
frame = "PAM"
F0_1 = 158000
delta_1 = 0.56
V3_1 = "250 cm-1"
F0_2 = 158000
delta_2 = 2.58159265
V3_2 = "250 cm-1"
vt_max = 0
"""


def read(tmp_path, text=FILE):
    path = tmp_path / "two.toml"
    path.write_text(text)
    return rotor.read(path)


def test_weights_of_levels_of_equivalent_tops(tmp_path):
    levels = rotor.api.solve_levels(read(tmp_path), 2)
    found = {
        (species, ka, kc): int(levels.weight[levels.find(species=species, vt=0, j=1, ka=ka, kc=kc)])
        for species in ("AA", "EE", "EE*", "AE")
        for ka, kc in ((0, 1), (1, 1), (1, 0))
    }
    # half of 6 and 10, 2 and 6, 4, 16: even Ka + Kc goes with the rarer spin functions of A
    assert [found["AA", *k] for k in ((0, 1), (1, 1), (1, 0))] == [5, 3, 5]
    assert [found["EE", *k] for k in ((0, 1), (1, 1), (1, 0))] == [3, 1, 3]
    assert {found[name, 0, 1] for name in ("EE*",)} == {2}
    assert {found[name, 0, 1] for name in ("AE",)} == {8}
    assert "EA" not in levels.quanta["species"]
    assert set(levels.components[levels.quanta["species"] == "AE"].tolist()) == {4}


def test_strengths_are_those_of_inequivalent_tops_together(tmp_path, monkeypatch):
    top = read(tmp_path)
    lines = rotor.api.line_list(top, jmax=2, q=1.0, min_lgint=None)
    from rotor.quantum.internal_rotation import several_tops as module

    monkeypatch.setattr(module, "_exchanging", lambda first, second: "")
    apart = rotor.api.line_list(top, jmax=2, q=1.0, min_lgint=None)
    for name, others in {"AA": ("AA",), "EE": ("EE",), "EE*": ("EE*",), "AE": ("AE", "EA")}.items():
        ours = lines.levels.quanta["species"][lines.lower] == name
        theirs = np.isin(apart.levels.quanta["species"][apart.lower], others)
        a, b = lines.strength_debye2[ours].sum(), apart.strength_debye2[theirs].sum()
        assert a == pytest.approx(b, rel=1e-7)  # the last product has its partner here
    assert np.abs(np.unique(lines.frequency_mhz.round(4))[:, None] - apart.frequency_mhz).min(axis=1).max() < 1e-3


def test_the_partition_function_counts_the_exchange(tmp_path):
    """Half of that of tops that are not exchanged: of their weights each level of AA has 6 or 10 of 16 instead of 16."""
    top, other = read(tmp_path), read(tmp_path, FILE.replace("F0_2 = 158000", "F0_2 = 158050"))
    equal, apart = (rotor.api.partition_function(one, 3.0).q for one in (top, other))
    assert 2 * equal / (8 * apart) == pytest.approx(0.5, rel=1e-3)  # 16 : 8 is 2 : 1 of inequivalent tops


@pytest.mark.parametrize(
    ("change", "text"),
    [(("b = 2.9", "a = 0.4\nb = 2.9"), "dipole"), (("vt_max", 'exchanged = "H2"\nvt_max'), "list of whole numbers"),
     (("F0_2 = 158000", "F0_2 = 159000\nexchanged = [2]"), "no twofold axis")],
)  # fmt: skip
def test_what_the_exchange_excludes_is_refused(tmp_path, change, text):
    with pytest.raises(ValueError, match=text):
        rotor.api.line_list(read(tmp_path, FILE.replace(*change)), jmax=1, q=1.0)


def test_exchanged_nuclei_are_kept_by_a_file(tmp_path):
    text = FILE.replace("vt_max", "exchanged = [2]\nvt_max")
    path = tmp_path / "again.toml"
    (tmp_path / "two.toml").write_text(text)
    write_molecule_file(read_molecule_file(tmp_path / "two.toml"), path)
    top = rotor.read(path)
    assert top.internal_rotation.exchanged == (2,)
    levels = rotor.api.solve_levels(top, 1)
    assert int(levels.weight[levels.find(species="AA", vt=0, j=0, ka=0, kc=0)]) == 9  # 36 : 28 over 4
