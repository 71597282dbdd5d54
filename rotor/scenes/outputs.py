"""The files that a scene names in [outputs]: their paths, and the checks before anything is computed."""

from __future__ import annotations

import os
from pathlib import Path

from rotor.scenes.scene import Scene, within
from rotor.verbs.outputs import Files
from rotor.verbs.verb import verb_of

Where = str | os.PathLike[str]


def suffixes_of(kind: str) -> dict[str, tuple[str, ...]]:
    """Allowed suffixes of the outputs of a kind of scene."""
    outputs = verb_of(kind).outputs
    return {output.name: output.suffixes for output in outputs if output.scene} | {"json": (".json",)}


def names_of(scene: Scene) -> dict[str, list[str]]:
    """The names of files in a scene, by output."""
    outputs = scene.content.get("outputs", {})
    named = {name: outputs[name] for name in suffixes_of(scene.kind) if name in outputs}
    return {name: value if isinstance(value, list) else [value] for name, value in named.items()}


def paths_of(scene: Scene, out: Where) -> dict[str, tuple[Path, ...]]:
    """The files that a scene names, in the folder `out`."""
    return {name: tuple(Path(within(out, text)) for text in texts) for name, texts in names_of(scene).items()}


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

    >>> from rotor.scenes.scene import LevelsScene
    >>> refuse_outside(LevelsScene(molecule="CO", outputs={"csv": "../a.csv"}), "results")
    Traceback (most recent call last):
        ...
    ValueError: outputs.csv: ../a.csv: lies outside the folder results; name a file inside it, or give another folder as --out
    """
    inside = Path(os.path.abspath(out))
    for name, texts in names_of(scene).items():
        for text in texts:
            if not Path(os.path.abspath(within(out, text))).is_relative_to(inside):
                raise ValueError(
                    f"outputs.{name}: {text}: lies outside the folder {os.fspath(out)}; name a file inside it, or give "
                    "another folder as --out"
                )
