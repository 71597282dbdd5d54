"""Run a scene: make its request, answer it, and write the files that it names in [outputs]; and back, the scene of an answer."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rotor.scenes.scene import SCHEMA, Scene, checked_scene, keyed, scene_of, scene_text
from rotor.verbs.common.calculation import Calculation, Outcome
from rotor.verbs.common.outputs import Files
from rotor.verbs.common.verb import Note, Work, silent, verb_of

Where = str | os.PathLike[str]


def run_scene(
    scene: Scene, *, folder: Where = ".", out: Where = ".", executor: Executor | None = None, note: Note = silent
) -> Outcome:
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
    note : callable, optional
        Takes remarks on the inputs.

    Returns
    -------
    Outcome
        With `files`, those that were written.

    Raises
    ------
    ValueError
        If the scene cannot be computed (with the key), or another run writes one of its files. No file is written then.

    Examples
    --------
    >>> from rotor.scenes.scene import make_scene
    >>> len(run_scene(make_scene("levels", molecule="CO")).table)
    11
    """
    checked_scene(scene)
    if scene.sweep:
        raise ValueError("sweep: this scene has several points; run_sweep runs them")
    files = files_of(scene, out)
    with ExitStack() as stack:
        files.lock(stack)
        outcome = scene_calculation(scene, folder, out, note).run(executor)
        files.write({"json": lambda path: outcome.write_table(outcome.table, path), **outcome.writers})
    return outcome


def scene_calculation(scene: Scene, folder: Where = ".", out: Where = ".", note: Note = silent) -> Calculation:
    """The calculation of a scene. folder: of the files that it reads. out: of those that it writes. note: takes remarks."""
    verb, entries, files = verb_of(scene.kind), scene.entries, paths_of(scene, out)  # no other verb is imported
    provenance = {"scene": scene_text(scene)} if files else {}
    work = Work(None, verb.read_shown(entries), files, note, provenance=provenance, from_scene=True)
    return Calculation(verb, entries, work, folder, scene.accuracy)


def saved_scene(outcome: Outcome, folder: Path, outputs: Mapping[str, Any]) -> Scene:
    """The scene of an answered request, in a folder. outputs: files by name; their settings are among the inputs."""
    verb, entries = outcome.verb, outcome.calculation.entries
    flat = {
        **verb.saved(outcome.request, outcome.subject, folder),
        **{f"outputs.{name}": value for name, value in outputs.items()},
    }
    for key, field in keyed(verb).items():
        if field.table == "outputs" and entries.has(field):
            flat[key] = field.write(field.read(entries.of(field), entries.style))
    return scene_of({"schema": SCHEMA, "kind": verb.name, **nested(flat)})


def nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables from values by dotted key.

    >>> nested({"a.b": 1, "c": 2, "a.d": 3})
    {'a': {'b': 1, 'd': 3}, 'c': 2}
    """
    tables: dict[str, Any] = {}
    for key, value in flat.items():
        *path, last = key.split(".")
        inner = tables
        for name in path:
            inner = inner.setdefault(name, {})
        inner[last] = value
    return tables


def suffixes_of(kind: str) -> dict[str, tuple[str, ...]]:
    """Allowed suffixes of the outputs of a kind of scene."""
    outputs = verb_of(kind).outputs
    return {output.name: output.suffixes for output in outputs if output.scene} | {"json": (".json",)}


def file_names(outputs: Mapping[str, Any], kind: str) -> dict[str, list[str]]:
    """The names of files in the table [outputs] of a scene, by output."""
    named = {name: outputs[name] for name in suffixes_of(kind) if name in outputs}
    return {name: value if isinstance(value, list) else [value] for name, value in named.items()}


def paths_of(scene: Scene, out: Where) -> dict[str, tuple[Path, ...]]:
    """The files that a scene names, in the folder `out`."""
    return {
        name: tuple(Path(out, text) for text in texts) for name, texts in file_names(scene.outputs, scene.kind).items()
    }


def files_of(scene: Scene, out: Where) -> Files:
    """The files that a scene writes; ValueError for a wrong suffix, a missing folder, and one file for two outputs."""
    files = Files(growing={output.name for output in verb_of(scene.kind).outputs if output.grows})
    suffixes = suffixes_of(scene.kind)
    for name, paths in paths_of(scene, out).items():
        for path in paths:
            files.add(name, f"outputs.{name}:", path, suffixes[name])
    return files


def refuse_outside(scene: Scene, out: Where) -> None:
    """Refuse outputs outside the folder `out`, so that a scene from elsewhere cannot replace other files.

    >>> from rotor.scenes.scene import make_scene
    >>> refuse_outside(make_scene("levels", molecule="CO", outputs={"csv": "../a.csv"}), "results")
    Traceback (most recent call last):
        ...
    ValueError: outputs.csv: ../a.csv: lies outside the folder results; name a file inside it, or give another folder as --out
    """
    inside = Path(os.path.abspath(out))
    for name, texts in file_names(scene.outputs, scene.kind).items():
        for text in texts:
            if not Path(os.path.abspath(Path(out, text))).is_relative_to(inside):
                raise ValueError(
                    f"outputs.{name}: {text}: lies outside the folder {os.fspath(out)}; name a file inside it, or give "
                    "another folder as --out"
                )
