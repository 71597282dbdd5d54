"""A scene: a simulation as one object, with the content of a scene file (`rotor.scenes.scene_file`).

No physics is imported here: a scene is data, checked for names and types; requests check the values. What computes a scene is
imported by name when it runs.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from msgspec import Struct, field

from rotor.frozen import dataclass
from rotor.requests.accuracy import Stated
from rotor.verbs.calculation import Outcome
from rotor.verbs.scene_tables import entries_before, tables_of
from rotor.verbs.tables import described
from rotor.verbs.verb import SCENE_VERBS, verb_of

if TYPE_CHECKING:
    from rotor.requests.plan import Plan

SCHEMA = 1


class Scene(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True, tag_field="kind"):
    """Fields of all kinds of scene. schema: version of the format."""

    schema: Annotated[int, described("version of this format")] = SCHEMA
    title: Annotated[str, described("a line for reports", "Water in the microwave region")] = ""
    sweep: Annotated[
        dict[str, list[Any]],
        described(
            "values by dotted name; every combination is run", {"conditions.temperature": ["10 K", "100 K", "300 K"]}
        ),
    ] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """Name of the kind, such as spectrum or stark; `rotor.verbs.names.SCENE_VERBS` lists all."""
        return str(self.__struct_config__.tag)

    @property
    def heading(self) -> str:
        """The title, or the kind in words."""
        return self.title or f"a scene of the kind {self.kind}"

    def run(
        self,
        *,
        folder: str | os.PathLike[str] = ".",
        out: str | os.PathLike[str] = ".",
        executor: Executor | None = None,
    ) -> SceneResult:
        """Run the scene, see `rotor.scenes.run.run_scene`."""
        result: SceneResult = import_module("rotor.scenes.run").run_scene(
            self, folder=folder, out=out, executor=executor
        )
        return result

    def plan(self, *, folder: str | os.PathLike[str] = ".") -> Plan:
        """Plan of the scene with neglected effects, see `rotor.scenes.plan.plan_of`."""
        plan: Plan = import_module("rotor.scenes.plan").plan_of(self, folder)
        return plan


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SceneResult(Outcome):
    """Result of a scene. files: written files."""

    scene: Scene
    files: tuple[Path, ...]

    def _repr_html_(self) -> str:
        """The rows and their errors, for notebooks."""
        from rotor.table import errors_html

        return self.table._repr_html_() + errors_html(self.answer)


@cache
def _scene_class(kind: str) -> Any:
    """The structure of a kind of scene, made from the declaration of its verb."""
    verb = verb_of(kind)
    entries = entries_before(verb)
    if verb.accuracy:
        meta = described(verb.accuracy, verb.accuracy_example)
        entries.append(("accuracy", Annotated[Stated, meta], None))
    entries += [(table, structure, structure()) for table, structure in tables_of(verb).items()]
    scene = msgspec.defstruct(
        f"{kind.capitalize()}Scene", entries, bases=(Scene,), frozen=True, kw_only=True, tag=kind, tag_field="kind",
        forbid_unknown_fields=True, omit_defaults=True, module=__name__,
    )  # fmt: skip
    scene.__doc__ = verb.about
    return scene


class Kinds(Mapping[str, type[Scene]]):
    """The structures of all kinds of scene, each made on first use."""

    def __getitem__(self, kind: str) -> type[Scene]:
        if kind not in SCENE_VERBS:
            raise KeyError(kind)
        structure: type[Scene] = _scene_class(kind)
        return structure

    def __iter__(self) -> Iterator[str]:
        return iter(SCENE_VERBS)

    def __len__(self) -> int:
        return len(SCENE_VERBS)


KINDS = Kinds()


def __getattr__(name: str) -> Any:
    """Structures by name, such as `RamanScene`."""
    kind = name.removesuffix("Scene").lower()
    if name.endswith("Scene") and kind in SCENE_VERBS and name == f"{kind.capitalize()}Scene":
        return KINDS[kind]
    raise AttributeError(f"module 'rotor.scenes.scene' has no attribute {name!r}")


def within(folder: str | os.PathLike[str], name: str) -> str:
    """Path of a file that a scene names, relative to the scene's folder."""
    return str(Path(folder) / name)
