"""How far one typed value travels: functions, files and returns between the command line and the kernel.

    python benchmarks/walks.py [CHECKOUT ...]

A command runs in a process of its own under a profiler. A function counts where one of its arguments holds the value: as the text that
was typed, as the number, or one or two levels deep in a list, tuple, table or short array. Numbers inside objects are not counted. A
return is a step, in the order of first calls, into a file that was left before. docs/validation/walks.md has the figures.
"""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

CONSTANTS = "A=50000 B=12000 C=9000 MHz"
SCENE = 'schema = 1\nkind = "stark"\naccuracy = "1.375 kHz"\nmolecule = "OCS"\n[conditions]\nfield = "0:10kV/cm:3"\n'
WALKS: dict[str, tuple[str, tuple[float, ...], list[str]]] = {
    "temperature": ("123.25", (123.25,), ["spectrum", "water", "--temperature", "123.25", "--jmax", "5"]),
    "chi_aa": ("-1.4375", (-1.4375,), ["levels", "--constants", CONSTANTS, "--jmax", "2", "--spin-constants",
                                       "chi_aa(14N)=-1.4375 chi_bb(14N)=0.5 MHz"]),
    "electric field": ("17.25", (17.25,), ["stark", "OCS", "--field", "17.25kV/cm"]),
    "accuracy": ("1.375", (1.375, 1.375e-3), ["run", "s.toml"]),
}  # fmt: skip
DEEP, SMALL = 2, 60  # levels of containers that are looked into, and their size


def holds(value: Any, text: str, numbers: tuple[float, ...], deep: int = DEEP) -> bool:
    """Whether a value is the text or one of the numbers, or a container of it."""
    if isinstance(value, str):
        return text in value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return any(abs(value - number) <= 1e-9 * abs(number) for number in numbers)
    if isinstance(value, np.ndarray) and value.dtype.kind == "f" and value.size <= 4:
        return any(holds(float(number), text, numbers, 0) for number in value.ravel())
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return deep > 0 and len(items) <= SMALL and any(holds(item, text, numbers, deep - 1) for item in items)


def walk(root: Path, text: str, numbers: tuple[float, ...], arguments: list[str]) -> tuple[int, int, int]:
    """Functions, files and returns of one command of the checkout in `root`, which must be the first on the path."""
    seen: dict[tuple[str, str], None] = {}
    package = f"{root}/rotor/"

    def look(frame: Any, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(package) or code.co_name.startswith("<"):
            return
        count = code.co_argcount + code.co_kwonlyargcount + bool(code.co_flags & 4) + bool(code.co_flags & 8)
        if any(holds(frame.f_locals.get(name), text, numbers) for name in code.co_varnames[:count]):
            seen[code.co_filename, code.co_qualname] = None

    from rotor.cli import run

    with contextlib.redirect_stdout(io.StringIO()):
        sys.setprofile(look)
        code = run(arguments)
        sys.setprofile(None)
    assert code == 0, arguments
    files = [file for file, _ in seen]
    trip = [file for place, file in enumerate(files) if not place or files[place - 1] != file]
    return len(seen), len(set(files)), len(trip) - len(set(trip))


def main() -> None:
    """Print a table of all walks in one checkout or several."""
    roots = [Path(argument).resolve() for argument in sys.argv[1:]] or [Path(__file__).resolve().parents[1]]
    for name in WALKS:
        for root in roots:
            with tempfile.TemporaryDirectory() as folder:
                (Path(folder) / "s.toml").write_text(SCENE, encoding="utf-8")
                call = [sys.executable, __file__, "--one", str(root), name]
                process = subprocess.run(
                    call, cwd=folder, env={"PYTHONPATH": str(root)}, capture_output=True, check=True
                )
            print(
                name,
                root.name,
                "functions {}, files {}, returns {}".format(*json.loads(process.stdout.splitlines()[-1])),
            )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(walk(Path(sys.argv[2]), *WALKS[sys.argv[3]])))
    else:
        main()
