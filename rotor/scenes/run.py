"""Run a scene: make its request, answer it, and write the files that the scene names."""

from __future__ import annotations

from concurrent.futures import Executor
from contextlib import ExitStack

from rotor.formats.atomic_write import resolved
from rotor.requests.fill import Entries, flattened
from rotor.scenes.keys import keyed
from rotor.scenes.outputs import Where, checked_paths, paths_of
from rotor.scenes.scene import Scene, SceneResult
from rotor.scenes.scene_file import scene_text
from rotor.temporary import locked_file
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
    files = tuple(path for paths in checked_paths(scene, out).values() for path in paths)
    with ExitStack() as stack:
        for path in sorted(set(map(resolved, files))):
            stack.enter_context(locked_file(path))
        outcome = scene_calculation(scene, folder, out).run(executor)
        _write(outcome)
    return SceneResult.extending(outcome, scene=scene, files=files)


def scene_calculation(scene: Scene, folder: Where = ".", out: Where = ".") -> Calculation:
    """The calculation of a scene. folder: of the files that it reads. out: of those that it writes."""
    verb = verb_of(scene.kind)  # no other verb is imported
    entries = Entries(flattened(verb.subject.tables(scene.content), keyed(verb)), "key")
    files = paths_of(scene, out)
    provenance = {"scene": scene_text(scene)} if files else {}
    work = Work(shown=verb.read_shown(entries), files=files, provenance=provenance, from_scene=True)
    return Calculation(verb, entries, work, folder, scene.accuracy)


def _write(outcome: Outcome) -> None:
    """Write all files of a scene together, except those written during the calculation; without files, nothing is prepared."""
    files = outcome.calculation.work.files
    growing = {output.name for output in outcome.verb.outputs if output.grows}
    if pending := files.keys() - growing:
        from rotor.formats.atomic_write import write_together

        writers = {"json": lambda path: outcome.write_table(outcome.table, path), **outcome.writers}
        write_together({path: writers[name] for name in files if name in pending for path in files[name]})
