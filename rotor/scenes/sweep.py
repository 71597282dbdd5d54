"""A scene run for several molecules or values: every combination is a scene of its own.

Each point that is done is written down at once; a sweep that was stopped goes on with the points that are missing.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor, as_completed
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rotor.scenes.kind import kind_of
from rotor.scenes.molecule import named
from rotor.scenes.run import SUFFIXES, output_paths, run_scene
from rotor.scenes.scene import Scene
from rotor.scenes.scene_file import parse_scene, scene_of, scene_text
from rotor.table import Table
from rotor.version import version

_NOT_IN_NAMES = re.compile(r"[^\w.+-]+")


@dataclass(frozen=True)
class Point:
    """One point of a sweep: the values by dotted name, and the scene with them."""

    values: Mapping[str, Any]
    scene: Scene

    @property
    def key(self) -> str:
        """What the result depends on: the scene and the version of the package."""
        return hashlib.sha256(f"{version()}\n{scene_text(self.scene)}".encode()).hexdigest()


@dataclass(frozen=True, repr=False)
class SweepResult(Table):
    """A sweep that was run: a row for each point, with its values, rows, seconds, and the numbers that its answer states."""

    records: tuple[Mapping[str, Any], ...]
    computed: int

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The swept values, rows and seconds, and every number that all points state."""
        first = self.records[0] if self.records else {"values": {}, "facts": {}}
        values = {name: [record["values"][name] for record in self.records] for name in first["values"]}
        facts = [name for name in first["facts"] if all(name in record["facts"] for record in self.records)]
        out = {name: np.array([_cell(value) for value in column]) for name, column in values.items()}
        out |= {name: np.array([record[name] for record in self.records]) for name in ("rows", "seconds")}
        return out | {name: np.array([record["facts"][name] for record in self.records]) for name in facts}

    @property
    def files(self) -> tuple[str, ...]:
        """All files of all points."""
        return tuple(file for record in self.records for file in record["files"])


def _cell(value: Any) -> Any:
    return value if isinstance(value, int | float | str) else json.dumps(value, ensure_ascii=False)


def points(scene: Scene) -> list[Point]:
    """Every combination of the values of a sweep, the last name running fastest.

    Raises ValueError for a name that the scene has not, and where two points would write one file.

    >>> from rotor.scenes.scene import LevelsScene
    >>> [p.scene.molecule for p in points(LevelsScene(molecule="CO", sweep={"molecule": ["CO", "HCl"]}))]
    ['CO', 'HCl']
    """
    content: dict[str, Any] = msgspec.to_builtins(scene)
    content |= {"schema": scene.schema}
    content.pop("sweep", None)
    for name, values in scene.sweep.items():
        if not values:
            raise ValueError(f"sweep.{name}: expected at least one value")
    out = []
    for combination in itertools.product(*scene.sweep.values()):
        chosen = dict(zip(scene.sweep, combination, strict=True))
        inner = deepcopy(content)
        for name, value in chosen.items():
            _put(inner, name, value)
        _name_files(inner.get("outputs", {}), chosen)
        out.append(Point(chosen, scene_of(inner, f"sweep {_text(chosen)}")))
    _refuse_one_file_twice(out)
    return out


def _put(content: dict[str, Any], name: str, value: Any) -> None:
    """Put a value at a dotted name; the molecule's word becomes a table where one of its keys is meant."""
    *path, last = name.split(".")
    table = content
    for part in path:
        inner = table.get(part, {})
        table[part] = inner = {"source": inner} if isinstance(inner, str) else inner
        if not isinstance(inner, dict):
            raise ValueError(f"sweep.{name}: {part} is no table of the scene")
        table = inner
    table[last] = value


def _name_files(outputs: dict[str, Any], values: Mapping[str, Any]) -> None:
    """Put the values into the names of the files: {temperature} is the value of conditions.temperature."""
    words = {name.rpartition(".")[2]: _NOT_IN_NAMES.sub("_", str(_cell(value))) for name, value in values.items()}

    def named(text: str) -> str:
        try:
            return text.format_map(words)
        except (KeyError, IndexError, ValueError):
            raise ValueError(
                f"outputs: {text!r}: of the sweep there are {', '.join(f'{{{w}}}' for w in words)}"
            ) from None

    for name in SUFFIXES.keys() & outputs.keys():
        given = outputs[name]
        outputs[name] = [named(one) for one in given] if isinstance(given, list) else named(given)


def _refuse_one_file_twice(found: Iterable[Point]) -> None:
    seen: set[Path] = set()
    for point in found:
        files = {path.resolve() for paths in output_paths(point.scene, ".").values() for path in paths}
        if twice := files & seen:
            words = " and ".join(f"{{{name.rpartition('.')[2]}}}" for name in point.values)
            raise ValueError(f"outputs: {twice.pop().name}: several points write this file; put {words} into its name")
        seen |= files


def _text(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def run_sweep(
    scene: Scene,
    *,
    folder: str | os.PathLike[str] = ".",
    out: str | os.PathLike[str] = ".",
    record: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    on_point: Callable[[Mapping[str, Any]], None] = lambda _: None,
) -> SweepResult:
    """Run every point of a sweep that the record has not yet.

    Parameters
    ----------
    scene : Scene
        With a sweep.
    folder, out : path
        From which the files that are read, and those that are written, are counted.
    record : path, optional
        A file with one line for each point that is done; points that it has, and whose files are there, are not run again.
    executor : Executor, optional
        Points are spread over it: a process pool, or any other.
    on_point : callable
        Called with the record of each point when it is done.

    Returns
    -------
    SweepResult
        In the order of the points.

    Raises
    ------
    ValueError
        A point that cannot be, before any is run.
    """
    every = points(scene)
    done = _read_record(record)
    missing = [point for point in every if not _is_done(done.get(point.key))]
    for point in missing:
        named(f"sweep {_text(point.values)}", partial(kind_of(point.scene).request, point.scene, folder))
    arguments = [(scene_text(point.scene), dict(point.values), os.fspath(folder), os.fspath(out)) for point in missing]
    for made in _computed(arguments, executor):
        done[made["key"]] = made
        if record is not None:
            with open(record, "a", encoding="utf-8") as handle:
                handle.write(json.dumps(made, ensure_ascii=False) + "\n")
        on_point(made)
    return SweepResult(tuple(done[point.key] for point in every), len(missing))


def _computed(arguments: list[tuple[Any, ...]], executor: Executor | None) -> Iterable[dict[str, Any]]:
    if executor is None:
        yield from (_run_point(*one) for one in arguments)
        return
    for future in as_completed([executor.submit(_run_point, *one) for one in arguments]):
        yield future.result()


def _run_point(text: str, values: dict[str, Any], folder: str, out: str) -> dict[str, Any]:
    """Run one point from the text of its scene; what the record holds of it."""
    point = Point(values, parse_scene(text))
    result = run_scene(point.scene, folder=folder, out=out)
    facts: Mapping[str, Any] = result.answer.facts()
    numbers = {name: value for name, value in facts.items() if isinstance(value, int | float) and np.isfinite(value)}
    return {
        "key": point.key,
        "values": values,
        "rows": len(result.table),
        "seconds": result.seconds,
        "files": [str(path.resolve()) for path in result.files],
        "facts": {name: value for name, value in numbers.items() if not isinstance(value, bool)},
    }


def _read_record(path: str | os.PathLike[str] | None) -> dict[str, dict[str, Any]]:
    """What is done, by key; a last line that a stop cut off is left out."""
    if path is None or not Path(path).is_file():
        return {}
    found = {}
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        try:
            made = json.loads(line)
        except json.JSONDecodeError:
            continue
        found[made["key"]] = made
    return found


def _is_done(made: Mapping[str, Any] | None) -> bool:
    return made is not None and all(Path(file).is_file() for file in made["files"])
