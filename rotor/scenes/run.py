"""Run a scene: make its request, answer it, and write the files that the scene names."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from rotor.formats.atomic_write import resolved
from rotor.scenes.kind import Kind, Where, Writer, kind_of
from rotor.scenes.scene import Scene, SceneResult, within
from rotor.temporary import locked_file
from rotor.verbs.verb import verb_of

if TYPE_CHECKING:
    from rotor.requests.knob import Choice
    from rotor.scenes.choice import Reached
    from rotor.table import Table


def run_scene(
    scene: Scene,
    *,
    folder: str | os.PathLike[str] = ".",
    out: str | os.PathLike[str] = ".",
    executor: Executor | None = None,
) -> SceneResult:
    """Run one scene.

    Parameters
    ----------
    scene : Scene
        Without a sweep; `rotor.scenes.sweep.run_sweep` runs one.
    folder : path
        Folder of the files that the scene reads.
    out : path
        Folder of the files that the scene writes.
    executor : Executor, optional
        Shares the work: J, blocks or states.

    Returns
    -------
    SceneResult

    Raises
    ------
    ValueError
        If the scene cannot be computed (with the key), or another run writes one of its files. No file is written then.

    Examples
    --------
    >>> from rotor.scenes.scene import LevelsScene
    >>> len(run_scene(LevelsScene(molecule="CO")).table)
    11
    """
    if scene.sweep:
        raise ValueError("sweep: this scene has several points; run_sweep runs them")
    targets = output_paths(scene, out)
    with ExitStack() as stack:
        for path in sorted({resolved(path) for paths in targets.values() for path in paths}):
            stack.enter_context(locked_file(path))
        return _run(scene, targets, folder, out, executor)


def _run(
    scene: Scene, targets: Mapping[str, list[Path]], folder: Where, out: Where, executor: Executor | None
) -> SceneResult:
    kind = kind_of(scene)
    request = kind.request(scene, folder)
    start, choice = time.perf_counter(), choice_of(scene, request)
    request = request if choice is None else choice.request
    answer = kind.answer(request, scene, out, executor)
    seconds = time.perf_counter() - start
    outcome = None if choice is None else _reached(scene, answer, choice)
    table = kind.verb.table(answer)
    _write(scene, kind, answer, table, targets, outcome)
    files = tuple(path for paths in targets.values() for path in paths)
    return SceneResult(scene, request, answer, table, files, seconds, outcome)


def choice_of(scene: Scene, request: Any) -> Choice | None:
    """Settings for the accuracy of a scene; None if it requests none."""
    if getattr(scene, "accuracy", None) is None:
        return None
    from rotor.scenes.accuracy import chosen

    with kind_of(scene).naming():
        return chosen(scene, request)


def answer_as_run(scene: Scene, request: Any, choice: Choice | None) -> Any:
    """The answer of a run without its files, with the run's errors. choice: the settings for its accuracy."""
    kind = kind_of(scene)
    bare = msgspec.structs.replace(scene, outputs=type(scene.outputs)())  # type: ignore[attr-defined]
    answer = kind.answer(request if choice is None else choice.request, bare, ".", None)
    if choice is not None:
        _reached(scene, answer, choice)
    return answer


def refuse_outside(scene: Scene, out: str | os.PathLike[str]) -> None:
    """Refuse outputs outside the folder `out`, so that a scene from elsewhere cannot replace other files.

    >>> from rotor.scenes.scene import LevelsScene
    >>> from rotor.scenes.sections import LevelsOutputs
    >>> refuse_outside(LevelsScene(molecule="CO", outputs=LevelsOutputs(csv="../a.csv")), "results")
    Traceback (most recent call last):
        ...
    ValueError: outputs.csv: ../a.csv: lies outside the folder results; name a file inside it, or give another folder as --out
    """
    inside = Path(os.path.abspath(out))
    for name, text in output_names(scene):
        if not Path(os.path.abspath(within(out, text))).is_relative_to(inside):
            raise ValueError(
                f"outputs.{name}: {text}: lies outside the folder {os.fspath(out)}; name a file inside it, or give another "
                "folder as --out"
            )


def output_names(scene: Scene) -> Iterator[tuple[str, str]]:
    """Pairs of output and file name, for all files that the scene names."""
    for name in suffixes_of(scene.kind):
        value = getattr(scene.outputs, name, None)  # type: ignore[attr-defined]
        names: list[str] = value if isinstance(value, list) else [] if value is None else [value]
        yield from ((name, file_name) for file_name in names)


def suffixes_of(kind: str) -> dict[str, tuple[str, ...]]:
    """Allowed suffixes of the outputs of a kind of scene."""
    outputs = verb_of(kind).outputs
    return {output.name: output.suffixes for output in outputs if output.scene} | {"json": (".json",)}


def _reached(scene: Scene, answer: Any, choice: Choice) -> Reached:
    from rotor.scenes.accuracy import reached

    return reached(scene, answer, choice)


def output_paths(scene: Scene, out: str | os.PathLike[str]) -> dict[str, list[Path]]:
    """The files that a scene writes, by the name of the output.

    Raises ValueError for a wrong suffix, a missing folder, and one file for two outputs.
    """
    targets: dict[str, list[Path]] = {}
    suffixes = suffixes_of(scene.kind)
    for name, text in output_names(scene):
        targets.setdefault(name, []).append(_checked_path(f"outputs.{name}", within(out, text), suffixes[name]))
    paths = [path.resolve() for named in targets.values() for path in named]
    for path in paths:
        if paths.count(path) > 1:
            raise ValueError(f"outputs: {path.name}: two outputs write this file; give another name")
    return targets


def _checked_path(name: str, text: str, suffixes: tuple[str, ...]) -> Path:
    path = Path(text)
    if not path.name.lower().endswith(suffixes):
        raise ValueError(f"{name}: {text}: the name must end in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise ValueError(f"{name}: {text}: there is no folder {path.parent}; make it first")
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        raise ValueError(f"{name}: {text}: cannot be written; give another name")
    return path


def _write(
    scene: Scene, kind: Kind, answer: Any, table: Table, targets: Mapping[str, list[Path]], outcome: Reached | None
) -> None:
    """Write all files together, except those written during the calculation; without files, nothing is prepared."""
    if not targets.keys() - kind.grows:
        return
    from rotor.formats.atomic_write import write_together
    from rotor.scenes.scene_file import scene_text

    provenance: dict[str, Any] = {"scene": scene_text(scene)}
    if outcome is not None:
        provenance["accuracy"] = asdict(outcome)
    if (budget := getattr(answer, "errors", None)) is not None:
        provenance["errors"] = budget.as_json()

    def rows(path: Path) -> None:
        from rotor.formats import write

        write(table, path, settings=provenance)

    writers: dict[str, Writer] = {"csv": rows, "parquet": rows, "json": rows, **kind.writers(answer, scene, provenance)}
    pending = {path: writers[name] for name, paths in targets.items() if name not in kind.grows for path in paths}
    write_together(pending)
