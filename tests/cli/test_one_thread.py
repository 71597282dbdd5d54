"""One thread of BLAS for small blocks: in a process of the command alone, to J = 200, where the user has not chosen."""

from __future__ import annotations

import os
import sys

import pytest

from rotor.cli import VERBS, declaration, process
from rotor.verbs import has_small_blocks


@pytest.mark.parametrize(
    ("threads", "loaded", "jmax", "before", "after"),
    [
        (True, False, None, None, "1"),
        (True, False, 200, None, "1"),
        (True, False, 201, None, None),
        (True, False, 10, "4", "4"),
        (True, True, 10, None, None),
        (False, False, 10, None, None),
    ],
)
def test_one_thread_is_set_before_numpy_is_loaded(monkeypatch, threads, loaded, jmax, before, after):
    monkeypatch.setattr(process, "_OWN", threads)
    monkeypatch.setattr(sys, "modules", {"numpy": os} if loaded else {})
    monkeypatch.setattr(os, "environ", {"OPENBLAS_NUM_THREADS": before} if before else {})
    process.one_thread_of_blas(jmax)
    assert os.environ.get("OPENBLAS_NUM_THREADS") == after


def test_small_blocks_are_read_from_the_text_as_declared():
    declared = {name for name in VERBS if declaration(name).small_blocks}
    assert declared == {name for name in VERBS if has_small_blocks(name)}
    assert {"spectrum", "levels", "fit", "identify", "stark", "zeeman"} <= declared
    assert not {"fluid", "view"} & declared
