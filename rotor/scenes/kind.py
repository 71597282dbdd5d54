"""How a scene is computed: the link between scenes and the verbs that declare their kinds."""

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
    """A valid scene without a result, such as a fit that does not converge; no file is written."""


@dataclass(frozen=True)
class Kind:
    """A kind of scene, by its verb."""

    verb: Verb

    @cached_property
    def names(self) -> dict[str, str]:
        """Keys of the scene by the names of the request's fields, for errors."""
        return {field.name: field.key for field in self.verb.fields.values() if field.key}

    @property
    def grows(self) -> frozenset[str]:
        """Outputs that are written while the answer is computed."""
        return frozenset(output.name for output in self.verb.outputs if output.grows)

    def request(self, scene: Scene, folder: Where = ".") -> Any:
        """The request of a scene in a folder, checked as far as possible before the calculation."""
        from rotor.scenes.structures import entries_of

        entries = entries_of(scene, self.verb)
        request = self.verb.read(entries, Place(folder))[0]
        return request if self.verb.adapt is None else self.verb.adapt(request, outputs_of(scene, self.verb), entries)

    def answer(self, request: Any, scene: Scene, out: Where, executor: Executor | None) -> Any:
        """The answer to the request of a scene, whose files are written in the folder `out`.

        Raises NoResultError if it is not a result.
        """
        from rotor.scenes.scene_file import scene_text
        from rotor.scenes.structures import entries_of

        outputs = outputs_of(scene, self.verb, out)
        shown = self.verb.read_shown(entries_of(scene, self.verb))
        with self.naming():
            # files that grow during the calculation hold the scene from the start
            provenance = {"scene": scene_text(scene)} if self.grows & outputs.keys() else {}
            answer = self.verb.answer(request, Work(executor, shown, outputs, provenance=provenance, from_scene=True))
        if reason := self.verb.failure(answer):
            raise NoResultError(f"{reason}; 'rotor {self.verb.name}' shows it nevertheless")
        for name, reason in self.verb.withheld(answer, list(outputs)).items():
            raise ValueError(f"outputs.{name}: {reason}")
        return answer

    def writers(self, answer: Any, scene: Scene, provenance: Mapping[str, Any]) -> Mapping[str, Writer]:
        """Functions that write the outputs, by name."""
        from rotor.scenes.structures import entries_of

        entries = entries_of(scene, self.verb)
        shown = self.verb.read_shown(entries)
        content = {**answer.facts(), **self.verb.content(answer, shown)}
        view: Any = {} if self.verb.spectral else WHOLE
        head = {**provenance, **self.verb.stated_in(content)}
        return files_of(self.verb, answer, Report(content, shown, entries, head, view))

    @contextmanager
    def naming(self) -> Iterator[None]:
        """Context in which a ValueError names keys of the scene instead of fields of the request."""
        with renaming(self.names):
            yield


def kind_of(scene: Scene) -> Kind:
    """The kind of a scene; only the module of its verb is imported."""
    return Kind(verb_of(scene.kind))


def outputs_of(scene: Any, verb: Verb, out: Where = ".") -> dict[str, tuple[Path, ...]]:
    """The files that a scene names, relative to the folder `out`."""
    names = [*(output.name for output in verb.outputs if output.scene), "json"]
    named = {name: getattr(scene.outputs, name, None) for name in names}
    return {
        name: tuple(Path(out) / file_name for file_name in (value if isinstance(value, list) else [value]))
        for name, value in named.items()
        if value
    }
