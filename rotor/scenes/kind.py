"""The interface between scenes and the library: what each file of `rotor.scenes.kinds` gives, and what they share."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.plots.view import WHOLE
from rotor.requests.fill import renaming
from rotor.scenes.molecule import named
from rotor.scenes.scene import Scene
from rotor.scenes.sections import Grid, MoleculeSection
from rotor.verbs.verb import Place, Report, Verb, Work, files_of, verb_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rotor.table import Table

Writer = Callable[[Path], None]
Where = str | os.PathLike[str]


class NoResultError(RuntimeError):
    """A scene that could be run and has no result, such as a fit that does not converge; nothing is written."""


def _no_writers(answer: Any, scene: Any, provenance: Mapping[str, Any]) -> Mapping[str, Writer]:
    return {}


@dataclass(frozen=True)
class Kind:
    """How one kind of scene is computed.

    request: of a scene in a folder; checks everything that can be checked beforehand. answer: of a request, for a scene with
    files that grow in a folder. table: of an answer. writers: by the name of an output, what writes it, besides csv, parquet
    and json, which the table itself becomes. grows: outputs that the answer itself writes. saved: the scene that a request is
    the answer to, its molecule given. names: keys of the scene by the fields of the request, for errors.
    """

    request: Callable[[Any, Where], Any]
    answer: Callable[[Any, Any, Where, Executor | None], Any]
    table: Callable[[Any], Table]
    saved: Callable[[Any, MoleculeSection | None], Scene]
    writers: Callable[..., Mapping[str, Writer]] = _no_writers
    grows: frozenset[str] = frozenset()
    names: Mapping[str, str] = field(default_factory=dict)


def kind_of(scene: Scene) -> Kind:
    """What computes a scene; only the module of its kind is imported."""
    return _kind(scene.kind)


@cache
def _kind(name: str) -> Kind:
    from importlib.util import find_spec

    if find_spec(f"rotor.scenes.kinds.{name}") is not None:
        written: Kind = import_module(f"rotor.scenes.kinds.{name}").KIND
        old = written.writers
        return written if old is _no_writers else replace(written, writers=lambda answer, scene, _: old(answer, scene))
    return kind_of_verb(verb_of(name))


def kind_of_verb(verb: Verb) -> Kind:
    """How a kind of scene is computed whose verb declares it."""
    from rotor.scenes.structures import given_of

    def request(scene: Any, folder: Where) -> Any:
        asked = verb.read(given_of(scene, verb), Place(folder))[0]
        return asked if verb.adapt is None else verb.adapt(asked, outputs_of(scene, verb), given_of(scene, verb))

    def answer(asked: Any, scene: Any, out: Where, executor: Executor | None) -> Any:
        from rotor.scenes.scene_file import scene_text

        shown, record = verb.read_shown(given_of(scene, verb)), {"scene": scene_text(scene)}
        work = Work(executor, shown, outputs_of(scene, verb, out), provenance=record)
        with renaming({one.name: one.key for one in verb.fields.values() if one.key}):
            return verb.answer(asked, work)

    def saved(asked: Any, molecule: Any) -> Scene:
        raise NotImplementedError

    def writers(found: Any, scene: Any, provenance: Mapping[str, Any]) -> Mapping[str, Writer]:
        given = given_of(scene, verb)
        shown = verb.read_shown(given)
        content = {**found.facts(), **verb.content(found, shown)}
        report = Report(content, shown, given, provenance, {} if verb.spectral else WHOLE)
        return files_of(verb, found, report)

    names = {one.name: one.key for one in verb.fields.values() if one.key}
    grows = frozenset(one.name for one in verb.outputs if one.grows)
    return Kind(request, answer, verb.table, saved, writers, grows, names)


def outputs_of(scene: Any, verb: Verb, out: Where = ".") -> dict[str, tuple[Path, ...]]:
    """The files that a scene names, counted from a folder."""
    names = [*(one.name for one in verb.outputs if one.scene), "json"]
    named = {name: getattr(scene.outputs, name, None) for name in names}
    return {
        name: tuple(Path(out) / one for one in (value if isinstance(value, list) else [value]))
        for name, value in named.items()
        if value
    }


def quantity(name: str, value: float | str, unit: str) -> float:
    """A number in `unit`; a ValueError names the field."""
    from rotor.units import MOST_KELVIN, parse_quantity

    found = named(name, lambda: parse_quantity(value, unit))
    if unit == "K" and found > MOST_KELVIN:
        raise ValueError(f"{name}: {value!r}: expected a temperature up to {MOST_KELVIN:g} K; no molecule lasts beyond")
    return found


def grid(name: str, value: Grid | None, unit: str) -> tuple[float, ...] | None:
    """Numbers in `unit` of a list or of a text such as 0:10:101; None for none."""
    from rotor.units import parse_grid

    if value is None:
        return None
    if isinstance(value, str):
        return named(name, lambda: tuple(parse_grid(value, unit).tolist()))
    if not all(map(math.isfinite, value)):
        raise ValueError(f"{name}: expected finite numbers")
    return tuple(value)


@contextmanager
def fields(**names: str) -> Iterator[None]:
    """Inside, a ValueError that begins with a field of a request names the key of the scene instead."""
    try:
        yield
    except ValueError as error:
        text = str(error)
        found = re.match(r"\w+", text)
        word = found[0] if found else ""
        raise ValueError(names.get(word, word) + text[len(word) :]) from None
