"""`rotor accuracy`: every numerical knob of a scene swept, error against a finer reference, and what each setting costs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import json_option
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import Files, Table, deliver, json_text, note, show_facts, show_table

if TYPE_CHECKING:
    from rotor.scenes.accuracy_sweep import Row, WorkPrecision
    from rotor.scenes.scene import Scene

EXAMPLES = """\b
Examples:
  rotor accuracy s.toml
  rotor accuracy s.toml --plot cost.png --csv cost.csv
  rotor accuracy s.toml --seconds 20 --json -"""


@dataclass(frozen=True)
class Options:
    """The scene, and what is written."""

    scene: str = argument(..., help="A scene file.")
    seconds: str = option(
        "120", metavar="S", help="Of the processor, for all sweeps together; what is beyond is left out."
    )
    csv: str | None = file_option(".csv", help="All settings with error and time.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Error against time, one panel a knob.")
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, options: Options) -> None:
    """What accuracy costs in a scene: each numerical knob swept, error against a finer reference, processor time."""
    from rotor.scenes.scene_file import read_scene

    seconds = inputs.positive("--seconds", options.seconds, "s")
    files = Files.of(options)
    scene = read_scene(options.scene)
    found = _swept(scene, options, seconds)
    if "--plot" in files.paths and not found.rows:
        raise ValueError(f"--plot: there is nothing to draw: {'; '.join(found.remarks)}")
    content = _content(found, options, files, context.obj)
    deliver(files, _writers(found, scene, content), lambda: json_text(content), lambda: _show(scene, found))


def _swept(scene: Scene, options: Options, seconds: float) -> WorkPrecision:
    """The whole table; what there is of it is printed before an interrupt ends the command."""
    from rotor.scenes.accuracy_sweep import work_precision

    so_far: list[WorkPrecision] = []
    try:
        with _progress() as show:
            return work_precision(
                scene,
                folder=Path(options.scene).parent,
                limit_seconds=seconds,
                progress=show,
                on_knob=so_far.append,
            )
    except KeyboardInterrupt:
        note("interrupted: the knobs swept so far follow, no file is written")
        if so_far:
            _show(scene, so_far[-1])
        raise


@contextmanager
def _progress() -> Iterator[Callable[[str, str], object]]:
    """A line on a terminal, rewritten before each calculation; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda knob, setting: None
        return
    from rich.console import Console

    with Console(stderr=True).status("") as status:
        yield lambda knob, setting: status.update(f"{knob}: {setting}")


def _content(found: WorkPrecision, options: Options, files: Files, command: str) -> dict[str, Any]:
    import rotor

    head = {"rotor_version": rotor.__version__, "command": command, "scene": options.scene}
    return {**head, **found.provenance, "settings": [asdict(row) for row in found.rows], "files": files.names}


def _writers(found: WorkPrecision, scene: Scene, content: dict[str, Any]) -> dict[str, Callable[[Path], None]]:
    def rows(path: Path) -> None:
        """The table as a file."""
        from rotor.formats import write

        write(found, path)

    def plot(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.work_precision import plot_work_precision
        from rotor.scenes.accuracy_panels import panels_of

        facts = {name: content[name] for name in ("command", "scene", "references")}
        plot_work_precision(
            panels_of(found), path, title=scene.title or f"a scene of the kind {scene.kind}", facts=facts
        )

    return {"--csv": rows, "--plot": plot}


def _show(scene: Scene, found: WorkPrecision) -> None:
    print(scene.title or f"a scene of the kind {scene.kind}")
    for (knob, error_of, unit), rows in found.curves().items():
        print()
        heading = f"error ({unit})" if unit else "error"
        show_table(Table(f"{knob}: {error_of}", ["setting", "", heading, "seconds"], [_cells(row) for row in rows]))
    if found.rows:
        print("\n* what the scene has; seconds of the processor, without start-up and compilation")
    facts = [("against", f"{name}: {text}") for name, text in found.references.items()]
    facts += [("remark", text) for text in found.remarks]
    show_facts([(name if not n or facts[n - 1][0] != name else "", text) for n, (name, text) in enumerate(facts)])


def _cells(row: Row) -> list[str]:
    return [row.setting, "*" if row.own else "", f"{row.error:.2g}", f"{row.seconds:.2g}"]
