"""Run a scene: make its request, answer it, and write the files that the scene names; and back, the scene of an answer."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rotor.requests.fill import Entries, flattened, nested
from rotor.scenes.keys import keyed
from rotor.scenes.outputs import Where, files_of, paths_of
from rotor.scenes.scene import SCHEMA, Scene, SceneResult, scene_of, scene_text
from rotor.verbs.calculation import Calculation, Outcome
from rotor.verbs.verb import Work, verb_of


def run_scene(
    scene: Scene,
    *,
    folder: Where = ".",
    out: Where = ".",
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
    files = files_of(scene, out)
    with ExitStack() as stack:
        files.lock(stack)
        outcome = scene_calculation(scene, folder, out).run(executor)
        files.write({"json": lambda path: outcome.write_table(outcome.table, path), **outcome.writers})
    paths = tuple(path for paths in files.paths.values() for path in paths)
    return SceneResult.extending(outcome, scene=scene, files=paths)


def scene_calculation(scene: Scene, folder: Where = ".", out: Where = ".") -> Calculation:
    """The calculation of a scene. folder: of the files that it reads. out: of those that it writes."""
    verb = verb_of(scene.kind)  # no other verb is imported
    molecule = scene.content.get("molecule")
    named = {"molecule": {"source": molecule}} if isinstance(molecule, str) else {}
    entries = Entries(flattened({**scene.content, **named}, keyed(verb)), "key")
    files = paths_of(scene, out)
    provenance = {"scene": scene_text(scene)} if files else {}
    work = Work(shown=verb.read_shown(entries), files=files, provenance=provenance, from_scene=True)
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
