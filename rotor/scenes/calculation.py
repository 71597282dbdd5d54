"""How a scene is computed: its entries, request, answer and files, by the verb that declares its kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from rotor.checks import NoAnswerError
from rotor.plots.view import WHOLE
from rotor.requests.fill import Entries, flattened
from rotor.scenes.outputs import Where, paths_of
from rotor.scenes.scene import Scene
from rotor.verbs.scene_tables import keyed
from rotor.verbs.verb import Place, Report, Verb, Work, files_of, report_of, verb_of

if TYPE_CHECKING:
    from rotor.requests.knob import Choice
    from rotor.scenes.choice import Reached

Writer = Callable[[Path], None]


class NoResultError(NoAnswerError):
    """A valid scene without a result, such as a fit that does not converge; no file is written."""


@dataclass(frozen=True)
class Calculation:
    """A scene in a folder. out: folder of the files that it writes."""

    scene: Scene
    folder: Where = "."
    out: Where = "."

    @cached_property
    def verb(self) -> Verb:
        """The verb of the scene's kind; no other verb is imported."""
        return verb_of(self.scene.kind)

    @cached_property
    def entries(self) -> Entries:
        """Values of the scene by key, without defaults."""
        tables = self.verb.subject.tables(msgspec.to_builtins(self.scene))
        return Entries(flattened(tables, [*keyed(self.verb), *self.verb.subject.tables_read]), "key")

    @cached_property
    def files(self) -> dict[str, tuple[Path, ...]]:
        """The files that the scene names, by output."""
        return paths_of(self.scene, self.out)

    @cached_property
    def growing(self) -> frozenset[str]:
        """Outputs that are written while the answer is computed."""
        return frozenset(output.name for output in self.verb.outputs if output.grows)

    def request(self) -> Any:
        """The request, checked as far as possible before the calculation."""
        request = self.verb.read(self.entries, Place(self.folder))[0]
        adapt = self.verb.adapt
        return request if adapt is None else adapt(request, self.files, self.entries)

    def choice(self, request: Any) -> Choice | None:
        """Settings for the accuracy of the scene; None if it requests none."""
        if getattr(self.scene, "accuracy", None) is None:
            return None
        from rotor.scenes.accuracy import chosen

        with self.verb.naming("key"):
            return chosen(self.scene, request)

    def answer(self, request: Any, executor: Executor | None = None) -> Any:
        """The answer to a request.

        Raises NoResultError if it is not a result.
        """
        from rotor.scenes.scene_file import scene_text

        with self.verb.naming("key"):
            # files that grow during the calculation hold the scene from the start
            provenance = {"scene": scene_text(self.scene)} if self.growing & self.files.keys() else {}
            work = Work(
                executor, self.verb.read_shown(self.entries), self.files, provenance=provenance, from_scene=True
            )
            answer = self.verb.answer(request, work)
        if reason := self.verb.failure(answer):
            raise NoResultError(f"{reason}; 'rotor {self.verb.name}' shows it nevertheless")
        for name, reason in self.verb.withheld(answer, list(self.files)).items():
            raise ValueError(f"outputs.{name}: {reason}")
        return answer

    def reached(self, answer: Any, choice: Choice | None) -> Reached | None:
        """The error of an answer whose settings were chosen for the accuracy of the scene; ValueError if it is larger."""
        if choice is None:
            return None
        from rotor.scenes.accuracy import reached

        return reached(self.scene, answer, choice)

    def report(self, answer: Any, head: Mapping[str, Any]) -> Report:
        """Data of the report and of the files. head: their provenance."""
        return report_of(self.verb, answer, head, self.entries, {} if self.verb.spectral else WHOLE)

    def writers(self, answer: Any, provenance: Mapping[str, Any]) -> Mapping[str, Writer]:
        """Functions that write the outputs, by name."""

        def rows(path: Path) -> None:
            from rotor.formats import write

            write(self.verb.table(answer), path, settings=dict(provenance))

        return {"json": rows, **files_of(self.verb, answer, self.report(answer, provenance))}
