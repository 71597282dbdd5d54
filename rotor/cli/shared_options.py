"""Options that several commands share: those of the picture, a scene file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.plots.view import View
from rotor.requests.field import PICTURE, REQUIRED, declared
from rotor.requests.fill import naming
from rotor.requests.readers import Custom, Field, Range, Reader, Text

if TYPE_CHECKING:
    from rotor.scenes.scene import Scene
    from rotor.verbs.common.verb import Verb

MOST_WORKERS = 256
UNITS = ("MHz", "GHz", "THz", "cm-1")


def picture_fields(unit: str = "") -> dict[str, Field]:
    """The options of a picture by name. unit: of its horizontal axis."""
    formula = Custom(lambda text: text.replace("$", r"\$"))  # matplotlib takes dollar signs for formulas
    log = Custom(lambda text: Text(("linear", "log")).read(text) == "log", metavar="NAME")
    rows: tuple[tuple[str, Reader, str], ...] = (
        ("plot_unit", Text(UNITS, "UNIT"), "Unit of the picture's frequency axis: MHz, GHz, THz or cm-1"),
        ("plot_title", formula, "Title of the picture"),
        ("plot_range", Range(unit), "Range of the horizontal axis, in its unit"),
        ("plot_vertical", Range(""), "Range of the vertical axis, in its unit"),
        ("plot_scale", log, "Vertical axis: linear or log"),
        ("style", Text(metavar="STYLE"), "Style of the picture: a name of matplotlib's, or an .mplstyle file"),
    )
    return {name: Field(reader, help_, name=name, panel=PICTURE) for name, reader, help_ in rows}


PLOT_NAMES = tuple(picture_fields())


def picture_settings(verb: Verb, typed: Mapping[str, Any], drawn: bool) -> Any:
    """The view of a verb's picture from the typed options; for a spectrum, settings by name. drawn: whether there is a picture."""
    across, unit = ("range_mhz", "MHz") if verb.spectral else ("horizontal", verb.drawn or "")
    fields = {name: field for name, field in picture_fields(unit).items() if name in typed}
    if fields and not drawn:
        raise ValueError(f"{next(iter(fields.values())).flag}: expected with --plot, the file of the picture")
    names = ("unit", "title", across, "vertical", "log")
    settings = {
        setting: fields[name].read(typed[name], "option")
        for name, setting in zip(PLOT_NAMES, names, strict=False)
        if name in fields
    }
    return settings if verb.spectral else View(**settings)


@contextmanager
def picture_style(typed: Mapping[str, Any]) -> Iterator[None]:
    """Context in which pictures have the style of --style; ValueError for an unknown one. Without the option, matplotlib is not loaded."""
    with ExitStack() as stack:
        if "style" in typed:
            from rotor.plots.picture import users_style

            with naming(picture_fields().values(), "option"):
                stack.enter_context(users_style(typed["style"]))
        yield


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
