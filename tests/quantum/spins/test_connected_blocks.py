"""Pairs of blocks with spins between which a dipole acts: found by their rotational blocks, the same as of all pairs."""

from __future__ import annotations

from dataclasses import replace

import pytest
from places import ORACLES

from rotor.formats.spcat.file_model import groups_of
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.reduced import connected_pairs, pairs_where
from rotor.quantum.spins import lines
from rotor.quantum.tensors import body_tensor, rank_of

KINDS = ORACLES / "kinds"


def _group(name: str, span: int):
    folder = KINDS / name if (KINDS / name).is_dir() else KINDS.parent / name
    par, request = read_par(folder / f"{name}.var"), read_int(folder / f"{name}.int")
    return groups_of(par, replace(request, request=replace(request.request, fend=span)))[0]


@pytest.mark.parametrize(
    "name", ["ch3cn_quad", "h2coh", "patterns_of_i_tot", "vinylcl35_quad", "methyl_i_tot", "l_doubled_quad"]
)
def test_pairs_are_those_of_all_blocks(name: str):
    group = _group(name, 5)
    levels = group.levels((sum(group.spins) % 2, 10))
    tensors = {(0, 0): body_tensor((1.0, 0.7, 0.4), 1, str(levels.representation))}
    rank = rank_of(tensors)
    expected = list(pairs_where(levels.blocks, rank, lambda up, low: bool(lines._acting(up, low, tensors, rank))))
    assert expected
    computed = list(connected_pairs(levels.blocks, tensors))
    assert [(up.start, low.start) for up, low in computed] == [(up.start, low.start) for up, low in expected]


def test_few_pairs_are_tested_beside_those_that_are_connected(monkeypatch):
    """Every pair of blocks of neighbouring F was tested: two spins to F = 50 took more than 20 s (fuzzed input 538100)."""
    group = _group("ch3cn_quad", 12)
    levels = group.levels((0, 24))
    tensors = {(0, 0): body_tensor((1.0, 0.0, 0.0), 1, str(levels.representation))}
    tests, original = [], lines._acting
    monkeypatch.setattr(lines, "_acting", lambda *arguments: tests.append(1) or original(*arguments))
    pairs = list(connected_pairs(levels.blocks, tensors))
    assert len(tests) < 1.5 * len(pairs)
