"""Run a scene: make its request, answer it, and write the files that the scene names."""

from __future__ import annotations

import os
import time
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rotor.formats.atomic_write import resolved
from rotor.scenes.calculation import Calculation
from rotor.scenes.outputs import checked_paths
from rotor.scenes.scene import Scene, SceneResult
from rotor.temporary import locked_file

if TYPE_CHECKING:
    from rotor.scenes.choice import Reached


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
    files = tuple(path for paths in checked_paths(scene, out).values() for path in paths)
    with ExitStack() as stack:
        for path in sorted(set(map(resolved, files))):
            stack.enter_context(locked_file(path))
        calculation = Calculation(scene, folder, out)
        request = calculation.request()
        start, choice = time.perf_counter(), calculation.choice(request)
        request = request if choice is None else choice.request
        answer = calculation.answer(request, executor)
        seconds = time.perf_counter() - start
        outcome = calculation.reached(answer, choice)
        _write(calculation, answer, outcome)
        return SceneResult(scene, request, answer, calculation.verb.table(answer), files, seconds, outcome)


def _write(calculation: Calculation, answer: Any, outcome: Reached | None) -> None:
    """Write all files together, except those written during the calculation; without files, nothing is prepared."""
    pending = {name: paths for name, paths in calculation.files.items() if name not in calculation.growing}
    if not pending:
        return
    from rotor.formats.atomic_write import write_together
    from rotor.scenes.scene_file import scene_text

    provenance: dict[str, Any] = {"scene": scene_text(calculation.scene)}
    if outcome is not None:
        provenance["accuracy"] = asdict(outcome)
    if (budget := getattr(answer, "errors", None)) is not None:
        provenance["errors"] = budget.as_json()
    writers = calculation.writers(answer, provenance)
    write_together({path: writers[name] for name, paths in pending.items() for path in paths})
