"""Compiled kernels on disk follow the sources that are compiled into them."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

from places import PROJECT

FILES = {
    "__init__.py": "",
    "unrelated.py": "OTHER = 1",
    "constants.py": "FACTOR = 2.0",
    "formula.py": "def square(x):\n    return x * x",
    "middle.py": """
from rotor import formula
from rotor.constants import (
    FACTOR,  # of the formula
)
from rotor.kernels import inlined, kernel

square = inlined(formula.square)

@kernel()
def scaled(x):
    return FACTOR * square(x)

@kernel(inline="always")
def shifted(x):
    return x + 10.0
""",
    "caller.py": """
from rotor.kernels import kernel
from rotor.middle import scaled, shifted

@kernel(nogil=True)
def answer(x):
    return scaled(shifted(x))
""",
}
RUN = """
import rotor.unrelated
from rotor.caller import answer
print(answer(-7.0), sum(answer.stats.cache_hits.values()))
"""


def answer(folder: Path) -> list[float]:
    """Result of the caller in a new process, and 1 if its machine code came from disk."""
    environment = os.environ | {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", RUN]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, cwd=folder)
    return [float(word) for word in ran.stdout.split()]


def change(path: Path, before: str, after: str) -> None:
    """Another text of the same length and date, as a checkout may leave it."""
    dates, text = path.stat(), path.read_text()
    assert text.count(before) == 1
    path.write_text(text.replace(before, after))
    os.utime(path, ns=(dates.st_atime_ns, dates.st_mtime_ns))


def test_a_kernel_follows_callees_plain_functions_and_constants_of_other_files(tmp_path: Path):
    package = tmp_path / "rotor"
    package.mkdir()
    shutil.copy(PROJECT / "rotor" / "kernels.py", package)
    for name, text in FILES.items():
        (package / name).write_text(text)
    assert answer(tmp_path) == [18.0, 0]
    change(package / "unrelated.py", "1", "2")
    assert answer(tmp_path) == [18.0, 1]
    change(package / "formula.py", "x * x", "x + x")
    assert answer(tmp_path) == [12.0, 0]
    change(package / "constants.py", "2.0", "5.0")
    assert answer(tmp_path) == [30.0, 0]
    change(package / "middle.py", "10.0", "20.0")
    assert answer(tmp_path) == [130.0, 0]


def test_every_kernel_is_compiled_by_the_module_of_kernels():
    importing = {
        path.relative_to(PROJECT).as_posix()
        for path in (PROJECT / "rotor").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom | ast.Import)
        if any("numba" in name for name in (getattr(node, "module", None) or "", *(each.name for each in node.names)))
    }
    assert importing == {"rotor/kernels.py"}
