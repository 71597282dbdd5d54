"""The notebooks of examples/: each is its percent script, executed, with its pictures inside.

    python docs/make_notebooks.py                  # all of them
    python docs/make_notebooks.py 04 12            # those whose names begin so
    python docs/make_notebooks.py --check          # compare and execute, write nothing

The script is the source: a story with its checks. The checks are assert statements: they run with the cells and do not stand in
the notebook. `agrees` says whether a notebook has the cells of its script, `executed` runs one and fails on an error, a failed
check, a warning and a notebook without a picture. A script with `# long: SECONDS` in its first lines may take so long;
all others have 20 s of processor time. Needs the extra `docs` (jupytext, nbclient, ipykernel).
"""

from __future__ import annotations

import argparse
import ast
import base64
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
PYTHON3 = {"name": "python3", "display_name": "Python 3", "language": "python"}
SECONDS = 20.0  # of one notebook, where its script names no other limit
MOST_BYTES = 400_000
# threads of BLAS wait for each other where another process has a core: a notebook of 15 s took 166
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
DRAWN = "--InlineBackend.print_figure_kwargs={'dpi': 90, 'bbox_inches': 'tight'}"  # small files, all pictures alike


def scripts() -> list[Path]:
    """The percent scripts, in the order of their numbers."""
    return sorted(EXAMPLES.glob("[0-9][0-9]_*.py"))


def seconds_allowed(script: Path) -> float:
    """What the line `# long: SECONDS` of a script says, else 20 s."""
    head = "".join(script.read_text(encoding="utf-8").splitlines(keepends=True)[:5])
    marked = re.search(r"^# long: (\d+)$", head, re.MULTILINE)
    return float(marked.group(1)) if marked else SECONDS


def notebook_of(script: Path) -> Any:
    """The cells of a percent script as a notebook without outputs; ids and metadata do not change between runs."""
    import jupytext

    notebook = jupytext.read(script, fmt="py:percent")
    notebook.metadata = {"kernelspec": PYTHON3, "language_info": {"name": "python"}}
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"
        cell["metadata"] = {}
    return notebook


def without_checks(notebook: Any) -> Any:
    """The notebook without its assert statements, and without cells that served them alone."""
    later_names: set[str] = set()
    kept = []
    for cell in reversed(notebook.cells):
        if cell["cell_type"] == "code":
            story = _story(cell["source"])
            prepares = story != cell["source"] and _is_preparation(story, later_names)
            if prepares or not re.sub(r"^# long: \d+$", "", story).strip():
                continue
            cell["source"] = story
            later_names |= _names(story)
        kept.append(cell)
    notebook.cells = kept[::-1]
    code = [cell for cell in notebook.cells if cell["cell_type"] == "code"]
    for cell in code:
        cell["outputs"] = [output for output in cell.get("outputs", []) if not _is_bare_object(output)]
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"
    for count, cell in enumerate(code, 1):
        if cell["execution_count"] is not None:
            cell["execution_count"] = count
            for output in cell["outputs"]:
                if "execution_count" in output:
                    output["execution_count"] = count
    return notebook


def _is_bare_object(output: Any) -> bool:
    """Whether an output is an object without content: what matplotlib returns beside a picture, or the page of `rotor view`."""
    text = output.get("data", {}).get("text/plain", "")
    return (
        len(output.get("data", {})) == 1
        and re.match(r"\[?(<matplotlib\.|<rotor\.viewer\.|Text\()|\[\(.*\bText\(", text, re.DOTALL) is not None
    )


def _story(source: str) -> str:
    """The source of a cell without asserts, and without loops and branches that consist of asserts."""
    dropped = {line for node in ast.parse(_without_magics(source)).body for line in _lines_of_checks(node)}
    left = [line for number, line in enumerate(source.splitlines(), 1) if number not in dropped]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(left)).strip("\n")


def _is_preparation(story: str, later_names: set[str]) -> bool:
    """Whether a cell without its checks only sets variables that no later cell reads."""
    nodes = ast.parse(_without_magics(story)).body
    return not later_names & _bound(nodes) and all(_sets_variables(node) for node in nodes)


def _sets_variables(node: ast.stmt) -> bool:
    return isinstance(node, ast.Assign) or (isinstance(node, ast.For) and all(map(_sets_variables, node.body)))


def _bound(nodes: list[ast.stmt]) -> set[str]:
    inner = [node for statement in nodes for node in ast.walk(statement)]
    return {node.id for node in inner if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}


def _names(source: str) -> set[str]:
    return {node.id for node in ast.walk(ast.parse(_without_magics(source))) if isinstance(node, ast.Name)}


def _without_magics(source: str) -> str:
    """The source as Python: magics become comments of the same length."""
    return re.sub(r"^[%!]", "#", source, flags=re.MULTILINE)


def _lines_of_checks(node: ast.stmt) -> set[int]:
    """Numbers of the lines of a statement that hold checks alone, with the else of nothing but checks."""
    last = node.end_lineno or node.lineno
    if isinstance(node, ast.Assert):
        return set(range(node.lineno, last + 1))
    if isinstance(node, ast.FunctionDef):
        return {line for inner in node.body for line in _lines_of_checks(inner)}
    if not isinstance(node, ast.For | ast.If | ast.With):
        return set()
    otherwise = getattr(node, "orelse", [])
    if _are_checks(node.body) and (not otherwise or _are_checks(otherwise)):
        return set(range(node.lineno, last + 1))
    dropped = {line for inner in (*node.body, *otherwise) for line in _lines_of_checks(inner)}
    if otherwise and _are_checks(otherwise):
        dropped |= set(range((node.body[-1].end_lineno or 0) + 1, last + 1))
    return dropped


def _are_checks(nodes: list[ast.stmt]) -> bool:
    return all(node.lineno in _lines_of_checks(node) for node in nodes)


def cells(notebook: Any) -> list[tuple[str, str]]:
    """What has to agree between a script and its notebook."""
    return [(cell["cell_type"], cell["source"].rstrip()) for cell in notebook.cells]


def agrees(script: Path) -> bool:
    """Whether the notebook beside a script has the same cells."""
    import nbformat

    written = script.with_suffix(".ipynb")
    return written.exists() and cells(nbformat.read(written, as_version=4)) == cells(
        without_checks(notebook_of(script))
    )


def executed(script: Path, patience: float = 10.0) -> tuple[Any, float]:
    """The notebook of a script after a run with its checks in examples/, and the processor seconds, start of the kernel included.

    patience: factor on the seconds allowed to a cell, for a busy machine. Raises nbclient's CellExecutionError for an error
    in a cell, ValueError for a warning on standard error and for a notebook without a picture.
    """
    from nbclient import NotebookClient
    from traitlets.config import Config

    os.environ.setdefault("PYDEVD_DISABLE_FILE_VALIDATION", "1")
    notebook, start = notebook_of(script), _spent_by_children()
    limit = int(patience * max(seconds_allowed(script), SECONDS))
    place = {"metadata": {"path": str(EXAMPLES)}}
    with tempfile.TemporaryDirectory() as sockets:
        # files instead of open ports, where there are such
        ipc = {"transport": "ipc", "ip": f"{sockets}/kernel"} if os.name == "posix" else {}
        config = Config({"KernelManager": ipc})
        client = NotebookClient(
            notebook,
            timeout=limit,
            kernel_name="python3",
            resources=place,
            config=config,
            extra_arguments=[DRAWN],
            store_widget_state=False,  # a widget's state holds its whole page
        )
        client.execute(env=ONE_THREAD | os.environ | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"})
    for cell in notebook.cells:
        cell["metadata"] = {}  # times of execution
    if spoken := on_standard_error(notebook):
        raise ValueError(f"{script.name}: a notebook writes nothing to standard error; this one: {spoken[:300]}")
    if not pictures(notebook):
        raise ValueError(f"{script.name}: a notebook has a picture; end a cell with the figure, or draw it with pyplot")
    return without_checks(notebook), _spent_by_children() - start


def _spent_by_children() -> float:
    spent = os.times()  # on Windows 0
    return spent.children_user + spent.children_system


def _outputs(notebook: Any) -> list[Any]:
    return [output for cell in notebook.cells if cell["cell_type"] == "code" for output in cell["outputs"]]


def on_standard_error(notebook: Any) -> str:
    """Everything that the cells wrote there."""
    return "".join(one["text"] for one in _outputs(notebook) if one.get("name") == "stderr")


def pictures(notebook: Any) -> list[bytes]:
    """The PNG files in the outputs of a notebook, in order."""
    shown = [output.get("data", {}).get("image/png") for output in _outputs(notebook)]
    return [base64.b64decode(png) for png in shown if png]


def write(script: Path, notebook: Any) -> int:
    """Write a notebook beside its script; its size in bytes. ValueError where it is larger than a repository should hold."""
    import nbformat

    text = nbformat.writes(notebook)
    if len(text.encode()) > MOST_BYTES:
        raise ValueError(f"{script.name}: {len(text)} bytes; at most {MOST_BYTES}: draw fewer or smaller pictures")
    script.with_suffix(".ipynb").write_text(text + "\n", encoding="utf-8")
    return len(text)


def main() -> int:
    """Make or check the notebooks; 1 where one is wrong or late."""
    parser = argparse.ArgumentParser(description="notebooks from the percent scripts of examples/")
    parser.add_argument("names", nargs="*", help="beginnings of names; all scripts where none is given")
    parser.add_argument("--check", action="store_true", help="compare and execute, write nothing")
    parser.add_argument("--pictures", type=Path, help="write the pictures into this folder too, to look at them")
    arguments = parser.parse_args()
    wrong = 0
    for script in scripts():
        if arguments.names and not script.name.startswith(tuple(arguments.names)):
            continue
        notebook, seconds = executed(script)
        late = seconds > seconds_allowed(script)
        differs = arguments.check and not agrees(script)
        size = 0 if arguments.check else write(script, notebook)
        verdict = ", too long" * late + ", differs from its notebook: run docs/make_notebooks.py" * differs
        print(
            f"{script.stem}: {seconds:.1f} s, {len(pictures(notebook))} pictures, {size // 1000} kB{verdict}",
            flush=True,
        )
        wrong |= late or differs
        if arguments.pictures:
            arguments.pictures.mkdir(parents=True, exist_ok=True)
            for number, png in enumerate(pictures(notebook), start=1):
                (arguments.pictures / f"{script.stem}_{number}.png").write_bytes(png)
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
