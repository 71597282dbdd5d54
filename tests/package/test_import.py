"""`import rotor` loads nothing heavy."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from places import PROJECT

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
    environment = os.environ | {"PYTHONPATH": str(PROJECT), "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment)
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
        "rotor.api.line_list(top, jmax=3)"
    )
    assert loaded_after(code).isdisjoint(HEAVY)


def test_public_names_exist():
    import rotor

    for name in rotor.__all__:
        assert getattr(rotor, name) is not None
    assert "spectrum" in dir(rotor)


NOT_FOR_SHORT_COMMANDS = (
    "scipy.linalg", "scipy.stats", "scipy.special", "numba", "polars", "pandas", "duckdb", "pydantic", "rdkit", "ase", "matplotlib",
    "qutip", "concurrent.futures",
)  # fmt: skip
LIST_TO_J60 = [
    "spectrum",
    "--constants",
    "A=8572 B=3640 C=2790 MHz",
    "--dipole-abc",
    "1.201,1.916,0.365",
    "--jmax",
    "60",
]


@pytest.mark.parametrize(
    "words",
    [
        ["info", "water"],
        ["spectrum", "water"],
        ["levels", "water"],
        ["info", "--constants", "B=10 C=5 GHz"],
        [*LIST_TO_J60, "--min-lgint", "-12", "--q", "93882.35", "--cat", "out.cat"],
        ["spectrum", "water", "--csv", "out.csv"],
    ],
    ids=lambda words: " ".join(words[:2] + words[-2:]),
)
def test_a_short_command_loads_nothing_heavy(folder, words):
    """Lists of modules, not seconds: scipy.linalg costs 0.2 s, numba 0.26, polars 0.17 where water costs 0.05."""
    loaded = loaded_after(f"from rotor.cli import run\nassert run({words!r}) == 0")
    assert sorted(loaded & set(NOT_FOR_SHORT_COMMANDS)) == []


NOT_FOR_HELP = (
    "rotor.spectra.lines", "rotor.fitting.fit", "rotor.fitting.reports.publication", "rotor.formats.fits.fit_request",
    "rotor.assignment.answer",
    "rotor.assignment.search.rigid_table", "rotor.formats.catalogue.cat_species", "rotor.alignment.acting", "rotor.alignment.align",
    "rotor.classical.euler", "rotor.classical.free.free_motion", "rotor.classical.integrators.method", "rotor.quantum.levels",
    "rotor.formats.fits.family_file", "rotor.structures.least_squares",
)  # fmt: skip


@pytest.mark.parametrize("verb", ["emission", "identify", "fit", "assign", "structure", "align", "tumble"])
def test_help_loads_no_calculation(verb):
    """Help needs the declarations alone; these modules, loaded for a constant or a type, cost 10 to 70 ms."""
    loaded = loaded_after(f"from rotor.cli import run\nassert run([{verb!r}, '--help']) == 0")
    assert sorted(loaded & set(NOT_FOR_HELP)) == []


def test_a_short_motion_compiles_nothing(folder):
    """Kernels as plain Python give the same report; compiling them takes seconds the first time."""
    environment = os.environ | {"PYTHONPATH": str(PROJECT), "NUMBA_CACHE_DIR": str(folder / "cache")}
    words = [sys.executable, "-m", "rotor", "tumble", "water", "--times", "0:1:11", "--json", "-"]
    first = subprocess.run(words, capture_output=True, text=True, check=True, env=environment)
    assert not (folder / "cache").exists() or not list((folder / "cache").rglob("*.nbi"))
    assert '"motion"' in first.stdout


def test_no_module_is_in_a_circle_of_imports():
    """Deferred imports and those for types counted too; the order is one from the command line down to the units."""
    from graphlib import TopologicalSorter

    grimp = pytest.importorskip("grimp", reason="it comes with import-linter, in the extra dev")

    graph = grimp.build_graph("rotor", cache_dir=None)
    below = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    order = list(TopologicalSorter(below).static_order())  # raises CycleError, which names the circle
    assert order.index("rotor.scenes.scene") < order.index("rotor.scenes.run")
