"""The scene file of a command, and what a command found out about its scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.requests.field import REQUIRED, declared
from rotor.requests.readers import Text

if TYPE_CHECKING:
    from rotor.scenes.scene import Scene


@dataclass(frozen=True)
class SceneFile:
    """A scene file."""

    scene: str = declared(REQUIRED, Text(), "A scene file", option="SCENE")

    @property
    def folder(self) -> Path:
        """The folder of the files that the scene reads."""
        return Path(self.scene).parent

    def read(self) -> Scene:
        """The scene."""
        from rotor.scenes.scene import read_scene

        return read_scene(self.scene)


@dataclass(frozen=True)
class SceneAnswer:
    """A scene and a result with `facts`: its plan, or its errors and times."""

    file: SceneFile
    scene: Scene
    result: Any

    def facts(self) -> dict[str, Any]:
        """The facts of the result, by the keys of docs/verbs."""
        return {"scene": self.file.scene, **self.result.facts()}
