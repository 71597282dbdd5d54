"""How a scene is computed: the interface between scenes and the verbs that declare their kinds."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rotor.checks import NoAnswerError
from rotor.plots.view import WHOLE
from rotor.requests.fill import renaming
from rotor.scenes.scene import Scene
from rotor.verbs.verb import Place, Report, Verb, Work, files_of, verb_of

Writer = Callable[[Path], None]
Where = str | os.PathLike[str]


class NoResultError(NoAnswerError):
    """A scene that could be run and has no result, such as a fit that does not converge; nothing is written."""


@dataclass(frozen=True)
class Kind:
    """A kind of scene, by its verb."""

    verb: Verb

    @cached_property
    def names(self) -> dict[str, str]:
        """Keys of the scene by the fields of the request, for errors."""
        return {one.name: one.key for one in self.verb.fields.values() if one.key}

    @property
    def grows(self) -> frozenset[str]:
        """Outputs that the answer itself writes."""
        return frozenset(one.name for one in self.verb.outputs if one.grows)

    def request(self, scene: Scene, folder: Where = ".") -> Any:
        """The request of a scene in a folder; everything is checked that can be checked beforehand."""
        from rotor.scenes.structures import given_of

        given = given_of(scene, self.verb)
        request = self.verb.read(given, Place(folder))[0]
        return request if self.verb.adapt is None else self.verb.adapt(request, outputs_of(scene, self.verb), given)

    def answer(self, request: Any, scene: Scene, out: Where, executor: Executor | None) -> Any:
        """The answer to a request, for a scene with files in a folder.

        Raises NoResultError where it is no result.
        """
        from rotor.scenes.scene_file import scene_text
        from rotor.scenes.structures import given_of

        outputs = outputs_of(scene, self.verb, out)
        shown = self.verb.read_shown(given_of(scene, self.verb))
        with self.naming():
            provenance = {"scene": scene_text(scene)} if self.grows & outputs.keys() else {}  # of files that grow
            answer = self.verb.answer(request, Work(executor, shown, outputs, provenance=provenance, from_scene=True))
        if reason := self.verb.failure(answer):
            raise NoResultError(f"{reason}; 'rotor {self.verb.name}' shows it nevertheless")
        for name, reason in self.verb.withheld(answer, list(outputs)).items():
            raise ValueError(f"outputs.{name}: {reason}")
        return answer

    def writers(self, answer: Any, scene: Scene, provenance: Mapping[str, Any]) -> Mapping[str, Writer]:
        """By the name of an output, what writes it."""
        from rotor.scenes.structures import given_of

        given = given_of(scene, self.verb)
        shown = self.verb.read_shown(given)
        content = {**answer.facts(), **self.verb.content(answer, shown)}
        view: Any = {} if self.verb.spectral else WHOLE
        head = {**provenance, **self.verb.stated_in(content)}
        return files_of(self.verb, answer, Report(content, shown, given, head, view))

    @contextmanager
    def naming(self) -> Iterator[None]:
        """Inside, a ValueError that names fields of the request names the keys of the scene."""
        with renaming(self.names):
            yield


def kind_of(scene: Scene) -> Kind:
    """What computes a scene; only the module of its verb is imported."""
    return Kind(verb_of(scene.kind))


def outputs_of(scene: Any, verb: Verb, out: Where = ".") -> dict[str, tuple[Path, ...]]:
    """The files that a scene names, counted from a folder."""
    names = [*(one.name for one in verb.outputs if one.scene), "json"]
    named = {name: getattr(scene.outputs, name, None) for name in names}
    return {
        name: tuple(Path(out) / one for one in (value if isinstance(value, list) else [value]))
        for name, value in named.items()
        if value
    }
