"""One Euler core: each shared piece is broken in a copy of the package, and exactly the motions that use it change.

The table of docs/validation/classical_core.md is the claim. The copies run with numba switched off, so that the plain
source is what runs; that the compiled form gives the same numbers, and breaks with the same source, is tested beside it.
"""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest
from places import PROJECT

PAGE = PROJECT / "docs" / "validation" / "classical_core.md"

# (file, what stands there, what is put in its place): each text stands there once
BREAKS = {
    "right-hand side": [
        ("classical/euler.py", "return vector_product(momentum, omega)", "return vector_product(1.001 * momentum, omega)"),
    ],
    "free flow": [
        ("classical/free/_kernels.py", "half_turn = 2.0 * math.pi * turn", "half_turn = 2.002 * math.pi * turn"),
        ("classical/free/theta.py", "speed = (d1 * j32 /", "speed = (d1 * 1.001 * j32 /"),
    ],
    "splitting step": [
        ("classical/integrators/strang.py", "turns(state, before, 0.5 * (", "turns(state, before, 0.5005 * ("),
    ],
    "quaternion algebra": [
        ("geometry/quaternions.py", "        p[0] * q[0] - p[1]", "        1.001 * p[0] * q[0] - p[1]"),
        ("geometry/quaternions.py", "return v[0] + q[0] * u[0]", "return v[0] + 1.001 * q[0] * u[0]"),
    ],
    "kinetic energy": [
        ("geometry/inertia.py", "return 0.5 * momentum * omega", "return 0.5005 * momentum * omega"),
    ],
}  # fmt: skip


def table():
    """{piece: motions that use it} and all motions, from the page."""
    text = PAGE.read_text(encoding="utf-8").split("## Which motion uses what")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (.+) \|$", text, re.MULTILINE)
    head, *body = ([cell.strip() for cell in row.split("|")] for row in rows)
    used = {piece: {row[0] for row in body if row[column]} for column, piece in enumerate(head) if column}
    return used, {row[0] for row in body}


def copied(folder, edits=()):
    """A copy of the package without caches, changed; the folder to import it from."""
    shutil.copytree(PROJECT / "rotor", folder / "rotor", ignore=shutil.ignore_patterns("__pycache__"))
    for name, before, after in edits:
        path = folder / "rotor" / name
        text = path.read_text(encoding="utf-8")
        assert text.count(before) == 1, f"{name}: expected {before!r} once; change BREAKS with the source"
        path.write_text(text.replace(before, after), encoding="utf-8")
    if (PROJECT / "data").is_dir():
        shutil.copytree(PROJECT / "data", folder / "data", ignore=shutil.ignore_patterns("*.parquet"))
    return folder


def answers(folder, compiled=False):
    """What every motion gives, by a package imported from `folder`."""
    program = [
        sys.executable,
        str(PROJECT / "tests" / "helpers" / "core_probes.py"),
        str(PROJECT / "examples" / "scenes"),
    ]
    environment = os.environ | {"PYTHONPATH": str(folder), "NUMBA_DISABLE_JIT": "0" if compiled else "1"}
    run = subprocess.run(program, env=environment, cwd=folder, capture_output=True, text=True, check=False, timeout=600)
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout)


def differs(first, other, tolerance):
    if isinstance(first, str) or isinstance(other, str) or len(first) != len(other):
        return first != other
    return any(abs(a - b) > tolerance * (1.0 + abs(a)) for a, b in zip(first, other, strict=True))


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return answers(copied(tmp_path_factory.mktemp("whole")))


def test_the_table_names_every_scene_and_piece():
    used, motions = table()
    assert set(used) == set(BREAKS)
    scenes = {f"scene {path.stem}" for path in (PROJECT / "examples" / "scenes").glob("*.py")}
    assert {name for name in motions if name.startswith("scene ")} == scenes


@pytest.mark.slow(seconds=15)
def test_nothing_fails_in_the_whole_package(plain):
    _, motions = table()
    assert set(plain) == motions
    assert not {name: answer for name, answer in plain.items() if isinstance(answer, str) or len(answer) < 3}


@pytest.mark.slow(seconds=15)
@pytest.mark.parametrize("piece", BREAKS)
def test_breaking_a_piece_changes_exactly_its_users(piece, plain, tmp_path):
    broken = answers(copied(tmp_path, BREAKS[piece]))
    used, _ = table()
    # breaks are of 1e-3; rounding repeats itself exactly
    assert {name for name in plain if differs(plain[name], broken[name], 1e-12)} == used[piece]


GROWING = "scene rattleback"  # its reversals make 1e-9 of round-off between the compiled and the plain rolling


@pytest.mark.slow(seconds=60)
def test_compiled_and_plain_forms_give_the_same_numbers(plain, tmp_path):
    compiled = answers(copied(tmp_path), compiled=True)
    # fused multiply-adds of blocks, 1e-16 each; and thousands of adaptive steps whose sums are in another order
    assert not {name for name in plain if differs(plain[name], compiled[name], 1e-7 if name == GROWING else 1e-11)}


@pytest.mark.slow(seconds=60)
def test_compiled_kernels_follow_the_plain_source(plain, tmp_path):
    broken = answers(copied(tmp_path, BREAKS["splitting step"]), compiled=True)
    used, _ = table()
    limits = {name: 1e-7 if name == GROWING else 1e-9 for name in plain}
    assert {name for name in plain if differs(plain[name], broken[name], limits[name])} == used["splitting step"]
