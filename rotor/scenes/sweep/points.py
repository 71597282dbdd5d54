"""The points of a sweep: all combinations of the swept values, each with its scene.

Scenes are made when they are needed: a sweep over ten thousand molecules holds only their names.
"""

from __future__ import annotations

import itertools
import json
import math
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from functools import cached_property
from pathlib import Path
from typing import Any

from rotor.frozen import dataclass
from rotor.scenes.run import file_names, files_of
from rotor.scenes.scene import SCHEMA, Scene, scene_of
from rotor.scenes.sweep.molecule_list import Entry, is_list, list_entries

_NOT_IN_NAMES = re.compile(r"[^\w.+-]+")
_PLACE = re.compile(r"\{([^{}]*)\}")
JOINED = ("parquet", "csv")  # outputs that hold the rows of all points if their names have no swept key
_MOLECULE = ("molecule", "molecule.source")  # swept names whose values may be lists of molecules


@dataclass(frozen=True)
class Axis:
    """The values of a swept name. shown: values in tables."""

    name: str
    values: tuple[Any, ...]
    shown: tuple[Any, ...]

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Distinct texts of the values in file names."""
        return tuple(numbered(_NOT_IN_NAMES.sub("_", str(cell(value))) for value in self.shown))

    @property
    def key(self) -> str:
        """The last part of the name, which file names have in braces."""
        return self.name.rpartition(".")[2]


@dataclass(frozen=True)
class Point:
    """A point of a sweep: its values by dotted name, and the tables of its scene."""

    values: Mapping[str, Any]
    content: Mapping[str, Any]

    @property
    def scene(self) -> Scene:
        """The scene of this point; ValueError for invalid values."""
        return scene_of(self.content, f"sweep {text_of(self.values)}")


@dataclass(frozen=True)
class Points:
    """All points of a sweep in order. combined: files for the rows of all points, by output."""

    axes: tuple[Axis, ...]
    base: Mapping[str, Any]
    combined: Mapping[str, str]

    def __len__(self) -> int:
        return math.prod(len(axis.values) for axis in self.axes)

    def __iter__(self) -> Iterator[Point]:
        for indices in self._indices():
            content = deepcopy(dict(self.base))
            for axis, i in zip(self.axes, indices, strict=True):
                put(content, axis.name, axis.values[i])
            outputs = content.get("outputs", {})
            words = self._words(indices)
            for name, texts in file_names(outputs, content["kind"]).items():
                filled = [named(text, words) for text in texts]
                outputs[name] = filled if isinstance(outputs[name], list) else filled[0]
            shown = {axis.name: axis.shown[i] for axis, i in zip(self.axes, indices, strict=True)}
            yield Point(shown, content)

    def _indices(self) -> Iterator[tuple[int, ...]]:
        return itertools.product(*(range(len(axis.values)) for axis in self.axes))

    def _words(self, indices: tuple[int, ...]) -> dict[str, str]:
        """Texts for the keys in braces of file names; a key of two swept names is left out."""
        keys = [axis.key for axis in self.axes]
        pairs = zip(self.axes, indices, strict=True)
        return {axis.key: axis.words[i] for axis, i in pairs if keys.count(axis.key) == 1}

    def refuse_equal_names(self) -> None:
        """Raise ValueError if two points would write the same file."""
        seen: set[str] = set()
        patterns = [
            text for texts in file_names(self.base.get("outputs", {}), self.base["kind"]).values() for text in texts
        ]
        for indices in self._indices():
            words = self._words(indices)
            names = {os.path.normpath(named(pattern, words)) for pattern in patterns}
            if twice := names & seen:
                keys = " and ".join(f"{{{axis.key}}}" for axis in self.axes)
                raise ValueError(
                    f"outputs: {twice.pop()}: several points write this file; put {keys} into its name (the rows of all "
                    "points go into one file that is named as parquet or csv)"
                )
            seen |= names


def is_sweep(scene: Scene, folder: str | os.PathLike[str] = ".") -> bool:
    """Whether a scene has several points: swept values, or a list of molecules as its molecule."""
    return bool(scene.sweep) or _listed(scene, folder) is not None


def _listed(scene: Scene, folder: str | os.PathLike[str]) -> str | None:
    """The list of molecules that a scene names as its molecule; None for a single molecule."""
    molecule = scene.content.get("molecule", {})
    source = molecule if isinstance(molecule, str) else molecule.get("source")
    return source if source is not None and is_list(source, folder) else None


def points(scene: Scene, folder: str | os.PathLike[str] = ".") -> Points:
    """All combinations of the values of a sweep; the last name varies fastest.

    scene: with a sweep, or with a list of molecules (an SDF file of several, a CSV file) as its molecule. folder: folder of the files
    that the scene reads.
    Returns: an iterable with a length.
    Raises ValueError for a name without values, for braces in a file name without a swept name, and for two points that would write the
    same file.

    >>> from rotor.scenes.scene import make_scene
    >>> [p.scene.content["molecule"] for p in points(make_scene("levels", molecule="CO", sweep={"molecule": ["CO", "HCl"]}))]
    ['CO', 'HCl']
    """
    content: dict[str, Any] = {"schema": SCHEMA, "kind": scene.kind, **deepcopy(dict(scene.content))}
    content.pop("sweep", None)
    swept = dict(scene.sweep)
    whole = _listed(scene, folder)
    if whole is not None and not any(name in swept for name in _MOLECULE):
        swept = {"molecule.source" if isinstance(content["molecule"], dict) else "molecule": [whole]} | swept
    axes = tuple(_axis(name, values, folder) for name, values in swept.items())
    combined = _combined(content.get("outputs", {}), axes)
    sweep = Points(axes, content, combined)
    sweep.refuse_equal_names()
    return sweep


def _axis(name: str, values: list[Any], folder: str | os.PathLike[str]) -> Axis:
    if not values:
        raise ValueError(f"sweep.{name}: expected at least one value")
    if name not in _MOLECULE:
        counts = Counter(json.dumps(value, default=str) for value in values)
        if twice := next((text for text, count in counts.items() if count > 1), None):
            raise ValueError(f"sweep.{name}: {twice} stands there twice; each point is one combination of values")
        return Axis(name, tuple(values), tuple(values))
    entries: list[Entry] = []
    for value in values:
        listed = isinstance(value, str) and is_list(value, folder)
        entries += list_entries(value, folder) if listed else [Entry(value, value)]
    shown = [entry.name for entry in entries]
    texts = all(isinstance(value, str) for value in shown)
    return Axis(name, tuple(entry.source for entry in entries), tuple(numbered(shown) if texts else shown))


def _combined(outputs: dict[str, Any], axes: tuple[Axis, ...]) -> dict[str, str]:
    """Remove the files for the rows of all points from the outputs, and return their names by output."""
    if math.prod(len(axis.values) for axis in axes) == 1:
        return {}
    names = [name for name in JOINED if isinstance(outputs.get(name), str) and not _PLACE.search(outputs[name])]
    return {name: outputs.pop(name) for name in names}


def numbered(texts: Iterable[str]) -> Iterator[str]:
    """The texts, with a number added to repeated ones.

    >>> list(numbered(["a", "b", "a", "a_2"]))
    ['a', 'b', 'a_2', 'a_2_2']
    """
    seen: dict[str, int] = {}
    for text in texts:
        unique = text
        while unique in seen:
            seen[text] += 1
            unique = f"{text}_{seen[text]}"
        seen[unique] = 1
        yield unique


def named(text: str, words: Mapping[str, str]) -> str:
    """A file name with its keys in braces filled, such as {temperature} for conditions.temperature.

    >>> named("{molecule}_{jmax}.csv", {"molecule": "CO", "jmax": "3"})
    'CO_3.csv'
    >>> named("{jmax.real}.csv", {"jmax": "3"})
    Traceback (most recent call last):
        ...
    ValueError: outputs: '{jmax.real}.csv': {jmax.real} is no swept name; of the sweep there are {jmax}
    """
    for key in _PLACE.findall(text):
        if key not in words:
            known = ", ".join(f"{{{word}}}" for word in words)
            raise ValueError(f"outputs: {text!r}: {{{key}}} is no swept name; of the sweep there are {known}")
    if any(brace in _PLACE.sub("", text) for brace in "{}"):
        raise ValueError(f"outputs: {text!r}: a brace without its partner; a swept name stands as {{key}}")
    return _PLACE.sub(lambda match: words[match[1]], text)


def put(content: dict[str, Any], name: str, value: Any) -> None:
    """Set the value of a dotted name; for a key of the molecule, its name becomes a table. Tables of a list count from 1.

    >>> scene = {"pulses": [{"peak": 1.0}, {"peak": 2.0}]}
    >>> put(scene, "pulses.2.peak", 3.0)
    >>> scene
    {'pulses': [{'peak': 1.0}, {'peak': 3.0}]}
    """
    *path, last = name.split(".")
    table: Any = content
    for part in path:
        if isinstance(table, list):
            if not (part.isdecimal() and 1 <= int(part) <= len(table)):
                raise ValueError(f"sweep.{name}: {part} is no table of this list; expected 1 to {len(table)}")
            place: Any = int(part) - 1
            inner = table[place]
        else:
            place, inner = part, table.get(part, {})
        inner = {"source": inner} if isinstance(inner, str) else inner
        if not isinstance(inner, dict | list):
            raise ValueError(f"sweep.{name}: {part} is no table of the scene")
        table[place] = inner
        table = inner
    if isinstance(table, list):
        raise ValueError(f"sweep.{name}: expected the number of a table and its key, such as {'.'.join(path)}.1.KEY")
    table[last] = value


def check_first(points: Points, out: str | os.PathLike[str]) -> None:
    """Check what all points have in common: swept names, and folders and suffixes of the outputs."""
    first = next(iter(points))
    files = files_of(first.scene, out)
    for name, text in points.combined.items():
        files.add(name, f"outputs.{name}:", Path(out) / text, (f".{name}",))


def cell(value: Any) -> Any:
    """A swept value as a cell of a table: lists and tables as JSON text."""
    return value if isinstance(value, int | float | str) else json.dumps(value, ensure_ascii=False, default=str)


def text_of(values: Mapping[str, Any]) -> str:
    """The values of a point in a sentence.

    >>> text_of({"molecule": "CO", "observables.jmax": 3})
    'molecule = CO, observables.jmax = 3'
    """
    return ", ".join(f"{name} = {value}" for name, value in values.items())
