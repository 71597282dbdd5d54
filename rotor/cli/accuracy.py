"""`rotor accuracy`: error and time of each value of every numerical knob of a scene, against a finer reference."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.cli.shared_options import SceneAnswer, SceneFile
from rotor.frozen import dataclass
from rotor.reports.progress import rewritten_line
from rotor.reports.screen import Part, listed, record_table, show_parts
from rotor.requests.field import declared
from rotor.requests.readers import Quantity
from rotor.verbs.common.outputs import PICTURES, Output, Report
from rotor.verbs.common.verb import Tool, Work

if TYPE_CHECKING:
    from rotor.scenes.accuracy_sweep import WorkPrecision

WIDTH = 70  # of the line that shows the setting
EXAMPLES = """\
  rotor accuracy s.toml
  rotor accuracy s.toml --plot cost.png --csv cost.csv
  rotor accuracy s.toml --seconds 20 --json -"""


@dataclass(frozen=True)
class AccuracyRequest(SceneFile):
    """A scene, and the processor time that its sweeps may take."""

    seconds: float = declared(
        120.0,
        Quantity("s", above=0, metavar="S"),
        "Processor time for all sweeps together; settings beyond it are left out",
    )


def answer(request: AccuracyRequest, work: Work) -> SceneAnswer:
    """The complete table; an interrupt prints the knobs swept so far before it ends the command."""
    from rotor.scenes.accuracy_sweep import work_precision

    scene = request.read()
    so_far: list[WorkPrecision] = []
    try:
        with rewritten_line(WIDTH) as write:
            table = work_precision(
                scene, folder=request.folder, limit_seconds=request.seconds, on_knob=so_far.append,
                progress=lambda knob, setting: write(f"{knob}: {setting}"),
            )  # fmt: skip
    except KeyboardInterrupt:
        if not so_far:
            raise
        show_parts(show(SceneAnswer(request, scene, so_far[-1]), None))
        raise KeyboardInterrupt("interrupted; the table has the knobs swept so far, no file was written") from None
    if "plot" in work.files and not table.rows:
        raise ValueError(f"--plot: there is nothing to draw: {'; '.join(table.remarks)}")
    return SceneAnswer(request, scene, table)


def draw(answer: SceneAnswer, path: Path, report: Report) -> None:
    """Error against time, one panel for each knob."""
    from rotor.plots.work_precision import plot_work_precision
    from rotor.scenes.accuracy_sweep import panels_of

    facts = {name: report.content[name] for name in ("command", "scene", "references")}
    title = answer.scene.title or f"Accuracy and time: {answer.scene.kind}"
    plot_work_precision(panels_of(answer.result), path, title=title, facts=facts)


def show(answer: SceneAnswer, _: Any) -> Iterable[Part | None]:
    """A table for each knob, then the references and remarks."""
    table: WorkPrecision = answer.result
    yield answer.scene.heading
    for (knob, error_of, unit), rows in table.curves().items():
        columns = {
            "setting": "{0.setting}",
            "": lambda row: "*" if row.own else "",
            f"error ({unit})" if unit else "error": "{0.error:.2g}",
            "seconds": "{0.seconds:.2g}",
        }
        yield record_table(f"{knob}: {error_of}", columns, rows)
    if table.rows:
        yield "* value in the scene; processor seconds, without start-up and compilation"
    against = (f"{name}: {text}" for name, text in table.references.items())
    yield [*listed("against", against), *listed("remark", table.remarks)]


VERB = Tool(
    name="accuracy",
    about="What accuracy costs in a scene: error and processor time of each value of its numerical knobs.",
    examples=EXAMPLES,
    request=AccuracyRequest,
    of="scene",
    answer=answer,
    table=lambda answer: answer.result,
    show=show,
    outputs=(
        Output("csv", (".csv",), "All settings with error and time"),
        Output("plot", PICTURES, "Error against time, one panel for each knob", draw),
    ),
    stepwise=True,
)
