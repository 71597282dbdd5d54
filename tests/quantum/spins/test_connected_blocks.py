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
from rotor.quantum.reduced import connections
from rotor.quantum.tensors import body_tensor

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
        if (up.twice_f, up.start) >= (low.twice_f, low.start)
        and (elements := elements_of_parts(up, low, tensors)).any()
    }
    assert [(up.start, low.start) for up, low in pairs] == sorted(expected, key=lambda pair: pair[::-1])
    for up, low in pairs:
        assert np.abs(np.abs(amplitudes(up, low)) - np.abs(expected[up.start, low.start])).max() < 1e-12
