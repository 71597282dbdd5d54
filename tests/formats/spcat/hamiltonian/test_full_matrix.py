"""The full matrices against the reference program's own files: every level with its label, and line strengths.

So the slow calculation is known to be the program's Hamiltonian before anything else is compared with it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from full_matrix_codes import Case, read_case, unpacked
from full_matrix_levels import CM_MHZ, Block, lgint, solve, strengths

from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.egy import read_egy
from rotor.formats.spcat.text.fields import BLANK

SPINS = ("asym_spinrot", "formamide_quad", "vinylcl35_quad", "ch2cl2_2quad", "ch3cn_quad", "hcn_quad")
STATES = ("two_state_coriolis", "three_states_fermi_coriolis", "tunnelling_doublet_quad")
PLAIN = ("h2co", "h2o_octic", "h2o_quartic_diag3", "so2", "pyridine_oblate_s", "ch3cn", "ocs", "abc_sred", "abc_ared6")
PRINTED_CM = 5.001e-7  # six decimals are printed
PRINTED_LGINT = 1.2e-4  # four decimals, and the program's older constants of nature


def _f2(case: Case, top: int) -> list[int]:
    half = sum(case.states[0].spins2) % 2
    return [2 * f - half for f in range(min(case.intensities.request.fend, top) + 1) if 2 * f >= half]


@cache
def _case(folder: Path) -> Case:
    return read_case(folder)


@cache
def _solved(folder: Path, f2: int) -> Block:
    """A block of the case as it is, which two tests compare."""
    return solve(_case(folder), f2)


def _levels(block: Block) -> dict[tuple[int, ...], list[tuple[float, int]]]:
    groups = defaultdict(list)
    for quanta, energy, weight in zip(block.quanta, block.energy_mhz, block.weight, strict=True):
        if weight > 0:
            groups[quanta].append((energy / CM_MHZ, int(weight) * (block.f2 + 1)))
    return groups


def _printed_levels(folder: Path) -> dict[tuple[int, ...], list[tuple[float, int]]]:
    levels = read_egy(unpacked(next(folder.glob("*.egy.gz"))))
    groups = defaultdict(list)
    for row in range(len(levels)):
        level = levels.level(row)
        groups[level.quanta].append((level.energy_cm, level.degeneracy))
    return groups


def _level_disagreements(folder: Path, blocks: Iterable[Block], top: int = 999) -> tuple[int, list[str]]:
    """How many levels were compared, and those whose label, degeneracy or energy is not the printed one."""
    printed, compared, wrong = _printed_levels(folder), 0, []
    for block in blocks:
        for quanta, ours in _levels(block).items():
            theirs = printed.pop(quanta, [])
            compared += len(ours)
            same = len(ours) == len(theirs) and all(
                abs(a - b) <= PRINTED_CM and g == h for (a, g), (b, h) in zip(sorted(ours), sorted(theirs), strict=True)
            )
            if not same:
                wrong.append(f"{quanta}: {ours}, printed {theirs}")
    if top == 999:
        wrong += [f"{quanta} is printed, not computed" for quanta in printed]
    return compared, wrong


@pytest.mark.oracle
@pytest.mark.parametrize("name", [*SPINS, *STATES, *PLAIN])
def test_every_level_and_label(shared, name):
    folder = shared / "reference" / "spcat" / name
    compared, wrong = _level_disagreements(folder, (_solved(folder, f2) for f2 in _f2(_case(folder), 999)))
    assert compared > 60
    assert wrong == []


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("name", "code", "change"),
    [
        ("formamide_quad", (4, (1, 1)), 1.001),
        ("asym_spinrot", (2, (1,)), 1.05),
        ("three_states_fermi_coriolis", (60, ()), -1.0),  # the sign of G against F
        ("tunnelling_doublet_quad", (21, ()), 1.001),
    ],
)
def test_a_changed_parameter_is_seen(shared, name, code, change):
    """Negative control: a thousandth of χ, a twentieth of C, the sign of a Coriolis term."""
    folder = shared / "reference" / "spcat" / name
    case = _case(folder)
    terms = [replace(t, value=t.value * change) if (t.kind, t.spins) == code else t for t in case.terms]
    assert terms != list(case.terms)
    changed = replace(case, terms=tuple(terms))
    _, wrong = _level_disagreements(folder, (solve(changed, f2) for f2 in _f2(changed, 12)), top=12)
    assert wrong


def _lines(case: Case, blocks: list[Block]) -> dict[tuple, list[tuple[float, float]]]:
    """Frequency and LGINT of all lines by labels."""
    request, groups = case.intensities.request, defaultdict(list)
    for upper in blocks:
        for lower in blocks:
            if abs(upper.f2 - lower.f2) > 2:
                continue
            strength = strengths(case, upper, lower)
            nu = upper.energy_mhz[:, None] - lower.energy_mhz
            allowed = (nu > 5e-5) & (strength > 1e-25) & (upper.weight[:, None] > 0) & (lower.weight > 0)
            for i, j in zip(*np.nonzero(allowed), strict=True):
                size = (strength[i, j], int(upper.weight[i]), lower.energy_mhz[j], request.temperature_k, request.qrot)
                groups[upper.quanta[i], lower.quanta[j]].append((nu[i, j], lgint(nu[i, j], *size)))
    return groups


def _printed_lines(folder: Path) -> dict[tuple, list[tuple[float, float]]]:
    catalogue, groups = read_cat(unpacked(next(folder.glob("*.cat.gz")))), defaultdict(list)
    upper, lower = catalogue.quanta_upper.tolist(), catalogue.quanta_lower.tolist()
    for row in range(len(catalogue)):
        key = tuple(tuple(q for q in state[row] if q != BLANK) for state in (upper, lower))
        groups[key].append((catalogue.frequency_mhz[row], catalogue.lgint[row]))
    return groups


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("name", "top"),
    [("asym_spinrot", 15), ("formamide_quad", 8), ("vinylcl35_quad", 8), ("ch2cl2_2quad", 4), ("ch3cn_quad", 20),
     ("hcn_quad", 20), ("two_state_coriolis", 12), ("three_states_fermi_coriolis", 6), ("tunnelling_doublet_quad", 8),
     ("h2co", 40), ("pyridine_oblate_s", 20)],
)  # fmt: skip
def test_every_printed_line_has_the_strength_of_the_full_matrix(shared, name, top):
    """Every printed line up to an F: its frequency, and LGINT of lines within 1 kHz of each other in sum.

    Such lines mostly end in two levels so close that rounding (1e-15 of the largest element) shares their strength out.
    """
    folder = shared / "reference" / "spcat" / name
    case = _case(folder)
    ours, pairs = _lines(case, [_solved(folder, f2) for f2 in _f2(case, top)]), []
    for (upper, lower), theirs in _printed_lines(folder).items():
        if max(upper[-1], lower[-1]) <= top and (case.states[0].spins2 or max(upper[0], lower[0]) <= top):
            strongest = sorted(ours[upper, lower], key=lambda line: -line[1])[: len(theirs)]
            pairs += [(*a, *b) for a, b in zip(sorted(strongest), sorted(theirs), strict=True)]
    nu, size, printed, lg = np.array(sorted(pairs)).T
    assert len(nu) > 100
    assert np.abs(nu - printed).max() < 5.1e-5  # four decimals are printed
    starts = np.flatnonzero(np.diff(nu, prepend=-1.0) > 1e-3)
    sums = [np.log10(np.add.reduceat(10.0**column, starts)) for column in (size, lg)]
    assert np.abs(sums[0] - sums[1]).max() < PRINTED_LGINT
