"""`rotor accuracy`: every numerical knob of a scene swept, error against a finer reference, and what each setting costs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.reports.screen import Table, show_facts, show_table
from rotor.requests.field import REQUIRED, check_fields, declared
from rotor.requests.readers import Quantity, Text
from rotor.verbs.tool import Tool
from rotor.verbs.verb import PICTURES, Output, Report, Work

if TYPE_CHECKING:
    from rotor.scenes.accuracy_sweep import Row, WorkPrecision
    from rotor.scenes.scene import Scene

EXAMPLES = """\b
Examples:
  rotor accuracy s.toml
  rotor accuracy s.toml --plot cost.png --csv cost.csv
  rotor accuracy s.toml --seconds 20 --json -"""


@dataclass(frozen=True)
class AccuracyRequest:
    """The scene, and how long its sweeps may take."""

    scene: str = declared(REQUIRED, Text(), "A scene file", option="SCENE")
    seconds: float = declared(
        120.0,
        Quantity("s", above=0, metavar="S"),
        "Of the processor, for all sweeps together; what is beyond is left out",
    )

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Swept:
    """A scene, and errors and times of its knobs."""

    path: str
    scene: Scene
    found: WorkPrecision

    def facts(self) -> dict[str, Any]:
        """Every setting, by the keys of docs/verbs."""
        return {"scene": self.path, **self.found.provenance, "settings": [asdict(row) for row in self.found.rows]}


def answer(request: AccuracyRequest, work: Work) -> Swept:
    """The whole table; what there is of it is printed before an interrupt ends the command."""
    from rotor.scenes.accuracy_sweep import work_precision
    from rotor.scenes.scene_file import read_scene

    scene, folder = read_scene(request.scene), Path(request.scene).parent
    so_far: list[WorkPrecision] = []
    try:
        with _progress() as shown:
            table = work_precision(
                scene, folder=folder, limit_seconds=request.seconds, progress=shown, on_knob=so_far.append
            )
    except KeyboardInterrupt:
        work.note("interrupted: the knobs swept so far follow, no file is written")
        if so_far:
            show(Swept(request.scene, scene, so_far[-1]), None)
        raise
    if "plot" in work.files and not table.rows:
        raise ValueError(f"--plot: there is nothing to draw: {'; '.join(table.remarks)}")
    return Swept(request.scene, scene, table)


@contextmanager
def _progress() -> Iterator[Callable[[str, str], object]]:
    """A line on a terminal, rewritten before each calculation; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda knob, setting: None
        return
    from rich.console import Console

    with Console(stderr=True).status("") as status:
        yield lambda knob, setting: status.update(f"{knob}: {setting}")


def draw(answer: Swept, path: Path, report: Report) -> None:
    """Error against time, one panel a knob."""
    from rotor.plots.work_precision import plot_work_precision
    from rotor.scenes.accuracy_panels import panels_of

    facts = {name: report.content[name] for name in ("command", "scene", "references")}
    plot_work_precision(panels_of(answer.found), path, title=_title(answer.scene), facts=facts)


def write_rows(answer: Swept, path: Path, report: Report) -> None:
    """The table as a file."""
    from rotor.formats import write

    write(answer.found, path)


def _title(scene: Scene) -> str:
    return scene.title or f"a scene of the kind {scene.kind}"


def show(answer: Swept, _: Any) -> None:
    """Print a table for each knob, and what they are held against."""
    table = answer.found
    print(_title(answer.scene))
    for (knob, error_of, unit), rows in table.curves().items():
        print()
        heading = f"error ({unit})" if unit else "error"
        show_table(Table(f"{knob}: {error_of}", ["setting", "", heading, "seconds"], [_cells(row) for row in rows]))
    if table.rows:
        print("\n* what the scene has; seconds of the processor, without start-up and compilation")
    facts = [("against", f"{name}: {text}") for name, text in table.references.items()]
    facts += [("remark", text) for text in table.remarks]
    show_facts([(name if not n or facts[n - 1][0] != name else "", text) for n, (name, text) in enumerate(facts)])


def _cells(row: Row) -> list[str]:
    return [row.setting, "*" if row.own else "", f"{row.error:.2g}", f"{row.seconds:.2g}"]


VERB = Tool(
    name="accuracy",
    about="What accuracy costs in a scene: each numerical knob swept, error against a finer reference, processor time.",
    examples=EXAMPLES,
    request=AccuracyRequest,
    of="scene",
    answer=answer,
    show=show,
    outputs=(
        Output("csv", (".csv",), "All settings with error and time", write_rows),
        Output("plot", PICTURES, "Error against time, one panel a knob", draw),
    ),
    stepwise=True,
)
