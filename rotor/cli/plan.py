"""`rotor plan`: what a scene will do, at what cost, and what it leaves out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared.inputs import json_option
from rotor.cli.shared.options import argument, grouped
from rotor.cli.shared.output import Files, deliver, json_text, show_facts

if TYPE_CHECKING:
    from rotor.requests.plan import LeftOut, Plan
    from rotor.scenes.scene import Scene

EXAMPLES = """\b
Examples:
  rotor plan s.toml
  rotor plan s.toml --json -"""


@dataclass(frozen=True)
class Options:
    """The scene."""

    scene: str = argument(..., help="A scene file.")
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, options: Options) -> None:
    """Before a scene is run: method, basis, counts, seconds and memory, and the effects left out by size."""
    import rotor
    from rotor.scenes.scene_file import read_scene

    files = Files()
    files.ask_json(options.json)
    scene = read_scene(options.scene)
    plan = scene.plan(folder=Path(options.scene).parent)
    head = {"rotor_version": rotor.__version__, "command": context.obj, "scene": options.scene}
    content = {**head, **plan.facts(), "files": files.names}
    deliver(files, {}, lambda: json_text(content), lambda: _show(scene, plan))


def _show(scene: Scene, plan: Plan) -> None:
    from rotor.requests.plan import larger_ones

    print(scene.title or f"a scene of the kind {scene.kind}")
    facts: list[tuple[str, str]] = [
        ("effects", "; ".join(plan.effects)),
        ("conserved" if plan.kind in ("tumble", "gas", "fluid") else "good numbers", ", ".join(plan.good) or "none"),
        *plan.parts,
        *((name, f"{count:,}") for name, count in plan.counts.items()),
        ("seconds", f"{plan.seconds:.2g} of the processor, without start-up and compilation"),
        ("memory", f"{plan.memory_mb:.2g} MB at the most, in use at one time"),
    ]
    larger, others = larger_ones(plan.left_out, lambda one: one.size, lambda one: one.name)
    texts = [_text(one) for one in larger] + ([others] if others else [])
    show_facts([*facts, *(("left out" if not number else "", text) for number, text in enumerate(texts))])


def _text(one: LeftOut) -> str:
    size: Any = "not estimated" if one.size is None else f"about {one.size:.1g} {one.unit}"
    return f"{one.name}: {size}; {one.basis}"
