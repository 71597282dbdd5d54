"""One thread of BLAS for small blocks: in a process of the command alone, to J = 200, where the user has not chosen."""

from __future__ import annotations

import os
import sys

import pytest

from rotor import cli
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


SCENE = 'schema = 1\nkind = "{}"\n[molecule]\nsource = "CO"\n{}'


@pytest.mark.parametrize("verb", ["run", "plan", "accuracy"])
@pytest.mark.parametrize(
    ("kind", "more", "limited"),
    [
        ("spectrum", "", [None]),
        ("thermo", "", [None]),
        ("levels", "[observables]\njmax = 7\n", [7]),
        ("levels", "[sweep]\n'observables.jmax' = [7, 300]\n", [300]),
        ("fluid", "", []),
        ("nothing", "", []),
    ],
)
def test_a_scene_of_small_blocks_has_one_thread(verb, kind, more, limited, folder, monkeypatch):
    """The kind of a scene is read from its text: Q of acetaldehyde took six times the processor time with threads of OpenBLAS."""
    (folder / "s.toml").write_text(SCENE.format(kind, more), encoding="utf-8")
    seen = []
    monkeypatch.setattr(process, "one_thread_of_blas", seen.append)
    monkeypatch.setattr(cli.typer.main, "get_command", lambda _: pytest.fail("stopped before the command"))
    with pytest.raises(pytest.fail.Exception):
        cli.run([verb, "s.toml"])
    assert seen == limited
    with pytest.raises(pytest.fail.Exception):
        cli.run([verb, "missing.toml"])
    assert seen == limited
