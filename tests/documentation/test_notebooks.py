"""The notebooks: cells as in their scripts without the checks, pictures inside, and the checks of every script hold."""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from types import ModuleType

import pytest
from places import PROJECT

SUBJECTS = (
    "molecule_to_spectrum", "isotopologues", "levels", "free_rotation", "equipartition", "classical", "fit", "structure",
    "stark", "alignment", "hard_cases", "accuracy", "rigid_steps", "spins_and_states", "view", "assign",
    "internal_rotation", "locked_rotation", "simulation", "observed", "five_species",
)  # fmt: skip


def _tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_notebooks", PROJECT / "docs" / "make_notebooks.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


MAKE = _tool()
SCRIPTS = MAKE.scripts()
HAVE_EXTRA = all(importlib.util.find_spec(name) for name in ("jupytext", "nbclient", "ipykernel"))
needs_extra = pytest.mark.skipif(
    not HAVE_EXTRA and "CI" not in os.environ, reason='needs the extra docs: python -m pip install ".[docs]"'
)
named = {"ids": lambda path: path.stem}


def test_every_subject_has_its_notebook():
    names = " ".join(script.stem for script in SCRIPTS)
    assert not [subject for subject in SUBJECTS if subject not in names]


def test_notebooks_read_their_own_data():
    assert not [script.name for script in SCRIPTS if re.search(r"tests/|\.\./", script.read_text(encoding="utf-8"))]
    data, originals = PROJECT / "examples" / "data", PROJECT / "tests" / "oracles"
    for path in (path for path in data.rglob("*") if path.is_file() and path.name != "README.md"):
        original = originals / path.relative_to(data)
        if path.parent.name == "levels":
            original = originals / path.stem / ("sample.egy" if path.suffix == ".egy" else path.name)
        elif path.name == "c064502_part.cat":
            original = originals / "spcat" / path.name
        assert path.read_bytes() == original.read_bytes(), path


def test_notebooks_import_two_modules_of_the_package():
    """Everything comes from `rotor` and `rotor.api`, which the documentation describes."""
    pattern = r"^(?:from|import) (rotor[\w.]*)"
    modules = {
        name for script in SCRIPTS for name in re.findall(pattern, script.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert modules == {"rotor", "rotor.api"}


@needs_extra
@pytest.mark.parametrize("script", SCRIPTS, **named)
def test_the_notebook_is_its_script_executed(script):
    import nbformat

    assert MAKE.agrees(script), f"python docs/make_notebooks.py {script.name[:2]}"
    path = script.with_suffix(".ipynb")
    notebook = nbformat.read(path, as_version=4)
    assert MAKE.pictures(notebook)
    assert all(png.startswith(b"\x89PNG") for png in MAKE.pictures(notebook))
    assert not MAKE.on_standard_error(notebook)
    assert all(cell["execution_count"] for cell in notebook.cells if cell["cell_type"] == "code")  # executed
    assert path.stat().st_size < MAKE.MOST_BYTES
    text = path.read_text(encoding="utf-8")
    code = [cell["source"] for cell in notebook.cells if cell["cell_type"] == "code"]
    assert not [
        source for source in code if re.search(r"^\s*assert ", source, re.MULTILINE)
    ]  # checks stay in the script
    assert "assert " in script.read_text(encoding="utf-8") or script.stem == "00_first_lesson"  # test_first_lesson.py
    assert 10 <= len(notebook.cells) <= 20
    assert str(PROJECT) not in text  # no path of a machine
    assert "ipykernel_" not in text


@needs_extra
@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, **named)
def test_the_notebook_runs(script):
    notebook, seconds = MAKE.executed(script)
    if seconds >= 2 * MAKE.seconds_allowed(script):  # the first run of a new environment compiles kernels
        notebook, seconds = MAKE.executed(script)
    assert MAKE.pictures(notebook)
    # twice: processors differ, and the figure that counts is that of docs/make_notebooks.py on a quiet machine
    assert seconds < 2 * MAKE.seconds_allowed(script)


CELLS = {
    "an error": ("# %%\nraise RuntimeError('wrong')\n", "RuntimeError"),
    "no picture": ("# %%\nprint(1)\n", "a notebook has a picture"),
    "a warning": ("# %%\nimport warnings\nwarnings.warn('mind')\n", "standard error"),
}


@needs_extra
@pytest.mark.parametrize("what", CELLS)
def test_a_notebook_with(what, tmp_path):
    script, reason = tmp_path / "01_short.py", CELLS[what][1]
    script.write_text(CELLS[what][0], encoding="utf-8")
    with pytest.raises(Exception, match=reason):
        MAKE.executed(script)


@needs_extra
def test_checks_run_and_do_not_stand_in_the_notebook(tmp_path):
    script = tmp_path / "01_short.py"
    story = "import matplotlib.pyplot as plt\n\nplt.plot([1, 2])\nx = 2\n"
    loop = "for i in (1, 2):\n    print(i)\n    assert i < 3\nfor i in (1, 2):\n    assert i < 3\n"
    script.write_text(f"# %%\n{story}{loop}assert x == 2\n\n# %%\nassert x < 3\n", encoding="utf-8")
    notebook, _ = MAKE.executed(script)
    assert [cell["source"] for cell in notebook.cells] == [f"{story}for i in (1, 2):\n    print(i)"]
    MAKE.write(script, notebook)
    assert MAKE.agrees(script)
    script.write_text(f"# %%\n{story}assert x == 3\n", encoding="utf-8")
    with pytest.raises(Exception, match="AssertionError"):
        MAKE.executed(script)


@needs_extra
def test_a_changed_script_is_noticed_and_long_ones_say_so(tmp_path):
    script = tmp_path / "01_short.py"
    script.write_text(
        "# %% [markdown]\n# # One\n\n# %%\nimport matplotlib.pyplot as plt\n\nplt.plot([1, 2])\n", encoding="utf-8"
    )
    assert not MAKE.agrees(script)  # no notebook yet
    assert MAKE.write(script, MAKE.executed(script)[0]) < MAKE.MOST_BYTES
    assert MAKE.agrees(script)
    script.write_text(script.read_text(encoding="utf-8") + "plt.title('more')\n", encoding="utf-8")
    assert not MAKE.agrees(script)
    assert MAKE.seconds_allowed(script) == MAKE.SECONDS
    script.write_text("# %% [markdown]\n# # One\n\n# long: 90\n", encoding="utf-8")
    assert MAKE.seconds_allowed(script) == 90
