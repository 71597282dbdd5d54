"""Raman lines with spins: strengths against a direct product, sums over F, what belongs to Rayleigh's line, refusals."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to

from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.spectra.raman.raman import RamanLines, raman_lines
from rotor.spectra.raman.request import RamanRequest, answer_raman
from rotor.spectra.raman.strengths import raman_transitions
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

ROD = ((2.2, 0, 0), (0, 1.5, 0), (0, 0, 1.5))
DISC = ((2.0, 0, 0), (0, 2.0, 0), (0, 0, 1.4))
SKEW = ((2.1, 0.3, -0.2), (0.3, 1.4, 0.5), (-0.2, 0.5, 1.0))
ABC = (9400.0, 3100.0, 2500.0)
CHI = np.array([[-1930.0, 1100.0, -400.0], [1100.0, 860.0, 700.0], [-400.0, 700.0, 1070.0]])  # as large as of iodine


def with_spins(top: Top, constants: str, spins: str | None = None) -> Top:
    return replace(top, spin_constants=SpinConstants.parse(constants, spins))


def both(top: Top, constants: str, spins: str | None = None, jmax: int = 4) -> tuple[RamanLines, RamanLines]:
    """The lines without and with spins at 5 K, where Q is a short sum."""
    split = with_spins(top, constants, spins)
    each = {"temperature_k": 5.0, "jmax": jmax, "min_relative": None}
    return raman_lines(top, **each), raman_lines(split, **each, effects=effects_of(split, True))


def by_rotation(lines: RamanLines) -> dict[tuple[int, ...], tuple[float, float]]:
    """Strength and cross section between two rotational levels."""
    numbers = [
        "n" if "n" in lines.levels.quanta else "j",
        *(name for name in ("k", "ka", "kc") if name in lines.levels.quanta),
    ]
    rows = np.column_stack([lines.levels.quanta[n][rows] for rows in (lines.initial, lines.final) for n in numbers])
    results: dict[tuple[int, ...], tuple[float, float]] = {}
    for key, *values in zip(
        map(tuple, rows.tolist()), lines.strength_angstrom6, lines.cross_section_cm2_per_sr, strict=True
    ):
        before = results.get(key, (0.0, 0.0))
        results[key] = (before[0] + values[0], before[1] + values[1])
    return results


def test_strengths_of_a_direct_product():
    """S = (3/2) Σ_FG |⟨f|α_FG - δ_FG tr α/3|i⟩|² over every m. States of N ≤ 3 with a spin of 1 are complete for F ≤ 2."""
    states = states_up_to(4)
    keep = np.array([i for i, state in enumerate(states) if state[0] <= 3])
    phi, n = space_cosines(4), {axis: rotor_matrix(axis, 4) for axis in "abc"}
    spin = {p: qutip.jmat(1, p).full() for p in "xyz"}

    def in_space(tensor: np.ndarray, p: str, q: str) -> np.ndarray:
        whole = sum(tensor[i, k] * phi[p, "abc"[i]] @ phi[q, "abc"[k]] for i in range(3) for k in range(3))
        return whole[np.ix_(keep, keep)]

    rigid = sum(x * n[axis] @ n[axis] for x, axis in zip(ABC, "abc", strict=True))[np.ix_(keep, keep)]
    total = on_spins(rigid, (2,), {})
    for p, q in product("xyz", repeat=2):
        squares = (spin[p] @ spin[q] + spin[q] @ spin[p]) / 4  # (IpIq + IqIp)/2 over 2I(2I - 1) = 2
        total = total + on_spins(in_space(CHI, p, q), (2,), {1: squares})
    energies, vectors = np.linalg.eigh(total)
    spread = np.array(SKEW) - np.eye(3) * np.trace(SKEW) / 3
    moved = [
        vectors.conj().T @ on_spins(in_space(spread, p, q), (2,), {}) @ vectors for p, q in product("xyz", repeat=2)
    ]

    constants = {f"chi_{'abc'[i]}{'abc'[k]}(14N)": CHI[i, k] for i in range(3) for k in range(i, 3)}
    top = Top.from_constants(dict(zip("ABC", ABC, strict=True)), spin_constants=SpinConstants(constants, {"14N": 2}))
    levels = solve_levels(top, 3, effects=effects_of(top, True))
    complete = levels.quanta["f"] <= 2
    members = (
        np.abs(energies[:, None] - levels.energy_mhz) < 1e-6
    ) & complete  # MHz; other levels are 1 MHz off and more
    assert (members.sum(axis=0)[complete] == levels.multiplicity[complete]).all()
    slow = 1.5 * members.T @ sum(np.abs(operator) ** 2 for operator in moved) @ members
    transitions = raman_transitions(levels, SKEW)
    known = complete[transitions.upper] & complete[transitions.lower]
    assert known.sum() > 200
    upper, lower = transitions.upper[known], transitions.lower[known]
    assert transitions.strength_angstrom6[known] == pytest.approx(
        slow[upper, lower], abs=1e-9
    )  # round-off of strengths up to 3
    left = np.tril(slow, -1)
    left[np.maximum(upper, lower), np.minimum(upper, lower)] = 0.0
    labels = np.column_stack([levels.quanta[name] for name in ("n", "ka", "kc")])
    elastic = np.argwhere(left > 1e-9)
    assert len(elastic)
    assert (labels[elastic[:, 0]] == labels[elastic[:, 1]]).all()  # nothing but Rayleigh's line is left out


@pytest.mark.parametrize(
    ("text", "tensor", "constants", "jmax"),
    [
        ("B=60 GHz", ROD, "chi_aa(14N)=-4.7 kHz", 5),
        ("A=9 B=3 C=2.5 GHz", SKEW, "chi_aa(14N)=-4.7 chi_bb-cc(14N)=1 kHz", 4),
        ("A=9 B=3 GHz", ROD, "chi_aa(35Cl)=-40 chi_aa(14N)=1.2 kHz", 3),
        ("B=9 C=3 GHz", DISC, "chi_cc(35Cl)=-40 kHz", 5),
    ],
)
def test_components_add_up_to_the_line_without_spins(text, tensor, constants, jmax):
    """Σ (2F'+1)(2F+1) {N' F' I; F N 2}² = 2I+1 for every spin, and Q has the same factor."""
    top = Top.from_constants(text).with_polarizability(tensor, "made up")
    plain, split = both(top, constants, jmax=jmax)
    functions = np.prod([twice + 1 for twice in SpinConstants.parse(constants).twice.values()])
    single, many = by_rotation(plain), by_rotation(split)
    largest = max(strength for strength, _ in single.values())
    assert all(key in single or strength < 1e-9 * largest for key, (strength, _) in many.items())
    for key, (strength, section) in single.items():
        assert many[key][0] == pytest.approx(
            functions * strength, abs=1e-9 * largest
        )  # couplings of 1e-6 of A mix states
        assert many[key][1] == pytest.approx(section, rel=1e-6, abs=1e-9 * plain.cross_section_cm2_per_sr.max())


def test_components_of_one_level_are_rayleigh_scattering_but_not_those_of_an_electron():
    """O2 has lines at 2 cm⁻¹ between J of one N; HCN has none at the 1e-4 cm⁻¹ of its quadrupole splitting."""
    rod = Top.from_constants("B=43.1 GHz").with_polarizability(ROD, "made up")
    _, nuclear = both(rod, "chi_aa(14N)=-4.7 MHz")
    assert np.abs(nuclear.shift_cm).min() > 8.0
    _, electron = both(rod, "lambda(S)=59.5 gamma(S)=-0.25 GHz", "S=1")
    fine = electron.where(np.abs(electron.shift_cm) < 4.0)
    n, j = electron.levels.quanta["n"], electron.levels.quanta["j"]
    assert len(fine)
    assert (n[fine.initial] == n[fine.final]).all()
    assert (j[fine.initial] != j[fine.final]).all()


def test_levels_without_weight_in_a_block_do_not_hide_the_others():
    """Two nuclei of one total spin: blocks hold levels of both weights; ortho and para add up to 16 times the line."""
    top = Top.from_constants("A=30 B=20 C=15 GHz", spin_weights={"ee": 1, "eo": 0, "oe": 0, "oo": 1})
    top = top.with_polarizability(ROD, "made up")
    _, split = both(top, "chi_aa(35Cl_1)=-40 chi_aa(35Cl_2)=-40 Hz", "35Cl_1+35Cl_2", jmax=2)
    bare, _ = both(
        Top.from_constants("A=30 B=20 C=15 GHz").with_polarizability(ROD, "made up"), "chi_aa(14N)=1 Hz", jmax=2
    )
    single, many = by_rotation(bare), by_rotation(split)
    assert all(key in single or strength < 1e-9 for key, (strength, _) in many.items())
    even = (10, 6)  # functions of even I (0 and 2: 1 + 5) and of odd I (1 and 3: 3 + 7) of two spins 3/2
    for key, (strength, _) in single.items():
        assert min(abs(many[key][0] / strength - count) for count in even) < 1e-6  # couplings of 1e-9 of A


def test_a_tensor_without_the_axis_is_refused_with_spins():
    top = with_spins(Top.from_constants("A=9 B=3 GHz").with_polarizability(SKEW, "made up"), "chi_aa(14N)=-4.7 MHz")
    with pytest.raises(
        ValueError, match="prolate top with spins: expected a polarizability with the axis of the top, a"
    ):
        raman_lines(top, jmax=2, effects=effects_of(top, True))


def test_the_answer_says_which_method_was_used():
    top = with_spins(Top.from_constants("B=44 GHz").with_polarizability(ROD, "made up"), "chi_aa(14N)=-4.7 MHz")
    exact = answer_raman(RamanRequest(top, temperature_k=5.0, effects=effects_of(top, True)))
    auto = answer_raman(RamanRequest(top, temperature_k=5.0, effects=effects_of(top, True, "auto", 1.0)))
    assert exact.facts()["hyperfine"]["method"] == "exact"
    used = auto.facts()["hyperfine"]
    assert used["method"] == "first-order"
    assert np.abs(auto.lines.shift_mhz - exact.lines.shift_mhz).max() < used["estimate_mhz"] < 1.0
    assert exact.facts()["q"]["classical"] == pytest.approx(
        3 * answer_raman(RamanRequest(top, 5.0)).facts()["q"]["classical"]
    )
