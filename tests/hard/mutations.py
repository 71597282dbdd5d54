"""Safeguards taken away one by one, in a copy of the package, each with the tests that must go red.

python tests/hard/mutations.py          # all of them; exit code 1 if one stays green
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Mutation:
    """A safeguard of a case: the text of a file that is replaced, and the test that must then fail."""

    case: int
    file: str
    old: str
    new: str
    test: str


MUTATIONS = (
    Mutation(
        2,
        "rotor/quantum/convergence.py",
        "    found = disordered_blocks(top, levels)\n    if not found:",
        "    found = disordered_blocks(top, levels)\n    if True:",
        "tests/test_reliability.py::test_quartic_water_is_told_of",
    ),
    Mutation(
        8,
        "rotor/geometry/inertia.py",
        "    moments = np.where(moments < 1e-12 * moments[2], 0.0, moments)\n",
        "",
        "tests/test_top.py::test_linear_in_any_orientation",
    ),
    Mutation(
        20, "rotor/quantum/levels.py", "self.energy_mhz[self.weight > 0].min()", "self.energy_mhz.min()",
        "tests/test_requests.py::test_levels_count_from_the_lowest_that_exists",
    ),
    Mutation(
        24, "rotor/alignment/pulse.py", "    2 * math.pi * 1e-30 * 1e4", "    4 * math.pi * 1e-30 * 1e4",
        "tests/hard/test_safeguards.py::test_the_factor_of_an_oscillating_field",
    ),
    Mutation(
        26, "rotor/geometry/rotations.py", "    angle = np.asarray(2.0 * np.arctan2(sine, q[..., 0]))",
        "    angle = np.asarray(2.0 * np.arccos(np.clip(q[..., 0], -1.0, 1.0)))",
        "tests/test_rotations.py::test_log_gives_back_the_smallest_rotation_vectors_in_any_direction",
    ),
    Mutation(
        28,
        "rotor/statistics/degrees_of_freedom.py",
        "    turns = rotating_axes(array, linear_below).sum(axis=-1)",
        "    turns = 3 * rotating_axes(array, linear_below).any(axis=-1)",
        "tests/test_degrees.py::test_a_linear_triatomic_has_five_degrees_not_six",
    ),
)  # fmt: skip


def copy_of_package(folder: Path) -> None:
    """The package, its data and its tests, as they are now."""
    for name in ("rotor", "data", "tests"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc"))
    shutil.copy(ROOT / "pyproject.toml", folder)


def goes_red(mutation: Mutation, folder: Path) -> bool:
    """Whether the test passes in the copy and fails without the safeguard; the copy is as before afterwards."""
    path = folder / mutation.file
    whole = path.read_text(encoding="utf-8")
    assert whole.count(mutation.old) == 1, f"case {mutation.case}: {mutation.file} has changed; write the mutation anew"
    assert passes(mutation.test, folder), f"case {mutation.case}: {mutation.test} fails already"
    path.write_text(whole.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        return not passes(mutation.test, folder)
    finally:
        path.write_text(whole, encoding="utf-8")


def passes(test: str, folder: Path) -> bool:
    """Whether a test passes in the copy."""
    command = [sys.executable, "-B", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", test]
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert ran.returncode in (0, 1), ran.stdout + ran.stderr  # 1: tests failed; anything else is no verdict
    return ran.returncode == 0


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as temporary:
        copy_of_package(Path(temporary))
        green = [one for one in MUTATIONS if not goes_red(one, Path(temporary))]
    for one in green:
        print(f"case {one.case}: {one.test} stays green without its safeguard")
    sys.exit(bool(green))
