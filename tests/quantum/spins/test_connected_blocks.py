"""Pairs of blocks with spins that a dipole connects, and the elements between them, against sums over parts of all pairs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from places import ORACLES
from spin_elements import elements_of_parts

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.blocks.reduced import connections
from rotor.quantum.operators.tensors import body_tensor
from rotor.quantum.spins import Spin, many_f_lines
from rotor.quantum.spins.coupling import ChainOperator
from rotor.quantum.spins.pattern_tables import column_tensors, pattern_table
from rotor.quantum.spins.scheme import Scheme

KINDS = ORACLES / "kinds"


def _group(name: str, span: int):
    folder = KINDS / name if (KINDS / name).is_dir() else KINDS.parent / name
    par, request = read_par(folder / f"{name}.var"), read_int(folder / f"{name}.int")
    return connected_groups(par, replace(request, request=replace(request.request, fend=span)))[0]


@pytest.mark.parametrize(
    "name", ["ch3cn_quad", "h2coh", "patterns_of_i_tot", "vinylcl35_quad", "methyl_i_tot", "l_doubled_quad"]
)
def test_pairs_are_those_of_all_blocks(name: str):
    group = _group(name, 4)
    blocks = (levels := group.levels((sum(group.spins) % 2, 6))).blocks
    tensors = {(0, 0): body_tensor((1.0, 0.7, 0.4), 1, str(levels.representation))}
    pairs, amplitudes = connections(blocks, tensors)
    expected = {
        (up.start, low.start): elements
        for low in blocks
        for up in blocks
        if (up.twice_total, up.start) >= (low.twice_total, low.start)
        and (elements := elements_of_parts(up, low, tensors)).any()
    }
    assert [(up.start, low.start) for up, low in pairs] == sorted(expected, key=lambda pair: pair[::-1])
    for up, low in pairs:
        assert np.abs(np.abs(amplitudes(up, low)) - np.abs(expected[up.start, low.start])).max() < 1e-12


@pytest.mark.parametrize("name", ["ch3cn_quad", "vinylcl35_quad"])
def test_coefficients_of_pairs_of_groups_are_those_of_all_patterns(name: str, monkeypatch):
    group = _group(name, 4)
    blocks = (levels := group.levels((sum(group.spins) % 2, 6))).blocks
    tensors = {(0, 0): body_tensor((1.0, 0.7, 0.4), 1, str(levels.representation))}
    pairs, amplitudes = connections(blocks, tensors)
    monkeypatch.setattr(many_f_lines, "_IN_MEMORY", 0)
    monkeypatch.delattr(many_f_lines, "tensors_by_f")
    again, others = connections(blocks, tensors)
    assert [(up.start, low.start) for up, low in again] == [(up.start, low.start) for up, low in pairs]
    for up, low in pairs:
        np.testing.assert_array_equal(others(up, low), amplitudes(up, low))


def test_many_patterns_are_not_compared_all_with_all():
    """Spins of 7/2, 4, 1/2 and 4 without couplings: 1,296 patterns of each F, of which the dipole connects 3 %."""
    scheme = Scheme(tuple(Spin(name, twice) for name, twice in (("a", 7), ("b", 8), ("c", 1), ("d", 8))))
    table = pattern_table(scheme, 80, 82)
    numbers = slice(0, 40), slice(100, 140)
    vector = ChainOperator((), 1, scalar=False)
    part = column_tensors(scheme, vector, 2, 80, 82, np.array([80]), *numbers)[0]
    up, low = (table.distances[at, :-1] + f for at, f in zip(numbers, (82, 80), strict=True))
    assert part.any()
    np.testing.assert_array_equal(part, vector.coefficients(scheme.twice, up[:, None], low))
    assert not column_tensors(scheme, vector, 2, 80, 82, np.array([82]), *numbers).any()  # there is no F = 42
