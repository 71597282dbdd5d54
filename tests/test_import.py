"""`import rotor` loads nothing heavy."""

from __future__ import annotations

import subprocess
import sys

HEAVY = (
    "ase",
    "rdkit",
    "qutip",
    "matplotlib",
    "numba",
    "polars",
    "pandas",
    "rich",
    "typer",
    "scipy.special",
    "scipy.stats",
)


def loaded_after(code: str) -> set[str]:
    program = f"import sys\n{code}\nprint(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_import_loads_no_foreign_library():
    assert loaded_after("import rotor").isdisjoint((*HEAVY, "numpy", "scipy"))


def test_the_command_line_starts_without_arrays():
    foreign = {*HEAVY, "numpy", "scipy"} - {"typer", "rich"}
    assert loaded_after("import rotor.cli").isdisjoint(foreign)


def test_constants_to_lines_needs_numpy_and_lapack_only():
    code = (
        "import rotor\n"
        "top = rotor.Top.from_constants('A=9 B=5 C=3 GHz', dipole_abc_debye=(1, 0, 0))\n"
        "rotor.line_list(top, jmax=3)"
    )
    assert loaded_after(code).isdisjoint(HEAVY)


def test_public_names_exist():
    import rotor

    for name in rotor.__all__:
        assert getattr(rotor, name) is not None
    assert "line_list" in dir(rotor)
