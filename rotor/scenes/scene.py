"""A scene: a simulation as data, and scene files in TOML.

No physics is imported here: names and types of a scene are checked by the declaration of its verb, values by the request. What
computes a scene is imported by name when it runs.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from concurrent.futures import Executor
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.formats.toml import toml_key, toml_value
from rotor.frozen import dataclass
from rotor.requests.accuracy import Stated
from rotor.requests.choices import nearest
from rotor.scenes.keys import UnknownKeyError, checked_table, declared_keys, inner_tables, tables_of
from rotor.verbs.calculation import Outcome
from rotor.verbs.verb import SCENE_VERBS, Verb, verb_of

if TYPE_CHECKING:
    from rotor.requests.plan import Plan

SCHEMA = 1


@dataclass(frozen=True)
class Scene:
    """A scene, made by `scene_of`. kind: name of the verb. content: keys and tables as in the file, without schema, kind and defaults."""

    kind: str
    content: Mapping[str, Any]

    @property
    def title(self) -> str:
        """The line for reports."""
        return str(self.content.get("title", ""))

    @property
    def sweep(self) -> Mapping[str, list[Any]]:
        """Swept values by dotted name."""
        swept: Mapping[str, list[Any]] = self.content.get("sweep", {})
        return swept

    @property
    def accuracy(self) -> Stated:
        """The requested accuracy; None without one."""
        stated: Stated = self.content.get("accuracy")
        return stated

    @property
    def heading(self) -> str:
        """The title, or the kind in words."""
        return self.title or f"a scene of the kind {self.kind}"

    def replaced(self, **content: Any) -> Scene:
        """The scene with other keys or whole tables."""
        return scene_of({"schema": SCHEMA, "kind": self.kind, **self.content, **content})

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


def make_scene(kind: str, **content: Any) -> Scene:
    """A scene from its keys and tables.

    Parameters
    ----------
    kind : str
        Name of a verb with scenes: "spectrum", "levels", ...
    **content
        Keys of the scene, and its tables as mappings, as in a scene file.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        For an unknown kind or key, and for a value of a wrong type.

    Examples
    --------
    >>> make_scene("levels", molecule="CO", observables={"jmax": 3}).run().table.energy_cm.round(3).tolist()
    [0.0, 3.845, 11.535, 23.069]
    """
    return scene_of({"schema": SCHEMA, "kind": kind, **content})


def scene_of(content: Mapping[str, Any], where: str = "scene") -> Scene:
    """The scene of nested tables, as parsed from TOML.

    Raises ValueError for an unknown version or kind, unknown keys and wrong types.
    """
    verb = _kind_verb(content.get("schema"), content.get("kind"), where)
    tables = tables_of(verb)
    values = {key: value for key, value in content.items() if key not in ("schema", "kind")}
    try:
        for key, value in values.items():
            if key not in tables and key not in tables[""]:
                raise UnknownKeyError(key, value, "", [*tables[""], *tables])
        inner = {name: checked_table(keys, values.get(name) or {}, name) for name, keys in tables.items() if name}
        head = checked_table(tables[""], {key: value for key, value in values.items() if key not in inner}, "")
    except UnknownKeyError as error:
        raise ValueError(f"{where}: {error.text(_other_place(error.key, verb))}") from None
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    return Scene(verb.name, head | {name: table for name, table in inner.items() if table})


def _kind_verb(schema: Any, kind: Any, where: str) -> Verb:
    if schema != SCHEMA:
        problem = "it has none" if schema is None else f"this one has {schema!r}"
        raise ValueError(f"{where}: expected schema = {SCHEMA}, the version of the format, and {problem}")
    if not isinstance(kind, str) or kind not in SCENE_VERBS:
        problem = "it has none" if kind is None else f"{kind!r} is none; {nearest(str(kind), SCENE_VERBS)}"
        raise ValueError(f"{where}: expected kind, one of {', '.join(SCENE_VERBS)}; {problem}")
    return verb_of(kind)


def _other_place(key: str, verb: Verb) -> str:
    """Where a scene has a key of this name, outside lists of tables; empty if nowhere."""
    tables = dict(tables_of(verb))
    first = tables.pop("")
    if key in first or key in tables:
        return "; it stands before the first table"
    tables |= {name: declared_keys(part) for name, field in first.items() for part in inner_tables(field).values()}
    places = [name for name, keys in tables.items() if key in keys]
    return f"; it is a key of {' and '.join(f'[{name}]' for name in places)}" if places else ""


def read_scene(path: str | os.PathLike[str]) -> Scene:
    """The scene of a file.

    Raises ValueError, with file and key, for invalid TOML, unknown keys and wrong types.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: a scene file is UTF-8 text: {error}") from None
    return parse_scene(text, str(path))


def parse_scene(text: str, where: str = "scene") -> Scene:
    """The scene of a TOML text; `where` names the text in errors.

    >>> parse_scene('schema = 1\\nkind = "levels"\\nmolecule = "CO"').content
    {'molecule': 'CO'}
    >>> parse_scene('schema = 1\\nkind = "levels"\\nmolecule = "CO"\\n[observables]\\nj_max = 3')
    Traceback (most recent call last):
        ...
    ValueError: scene: [observables] has no key 'j_max'; the nearest is 'jmax'
    """
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where}: not a TOML file: {error}") from None
    return scene_of(content, where)


def scene_text(scene: Scene) -> str:
    """The scene as TOML. Defaults are left out; numbers read back as the same doubles.

    >>> from rotor.scenes.scene import LevelsScene
    >>> print(scene_text(LevelsScene(molecule="CO")), end="")
    schema = 1
    kind = "levels"
    molecule = "CO"
    """
    return "".join(_lines_of({"schema": SCHEMA, "kind": scene.kind, **scene.content}, ()))


def _lines_of(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """Lines of a table: values first, then inner tables."""
    plain = {key: value for key, value in table.items() if not _is_table(value)}
    lines = [f"{toml_key(key)} = {toml_value(value)}\n" for key, value in plain.items() if value is not None]
    for key, value in table.items():
        inner = (*path, key)
        name = ".".join(toml_key(part) for part in inner)
        if isinstance(value, Mapping) and _is_table(value):
            lines += [f"\n[{name}]\n", *_lines_of(value, inner)]
        elif _is_table(value):
            for item in value:
                lines += [f"\n[[{name}]]\n", *_lines_of(item, inner)]
    return lines


def _is_table(value: Any) -> bool:
    if isinstance(value, Mapping):
        return True
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def write_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene as TOML, completely or not at all."""
    from rotor.formats.atomic_write import open_atomic

    with open_atomic(path, "w", encoding="utf-8", newline="\n") as handle:
        handle.write(scene_text(scene))


def __getattr__(name: str) -> Any:
    """Functions that make a scene of a kind from its keys and tables, such as `RamanScene(molecule="N2")`."""
    kind = name.removesuffix("Scene").lower()
    if kind not in SCENE_VERBS or name != f"{kind.capitalize()}Scene":
        raise AttributeError(f"module 'rotor.scenes.scene' has no attribute {name!r}")

    return partial(make_scene, kind)


def within(folder: str | os.PathLike[str], name: str) -> str:
    """Path of a file that a scene names, relative to the scene's folder."""
    return str(Path(folder) / name)
