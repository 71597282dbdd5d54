"""`rotor plan`: method, cost and neglected effects of a scene, before it is run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.reports.screen import Part
from rotor.reports.top_facts import left_out_facts
from rotor.requests.field import REQUIRED, declared
from rotor.requests.readers import Text
from rotor.verbs.tool import Tool
from rotor.verbs.verb import Work, verb_of

if TYPE_CHECKING:
    from rotor.requests.plan import LeftOut, Plan
    from rotor.scenes.scene import Scene

EXAMPLES = """\b
Examples:
  rotor plan s.toml
  rotor plan s.toml --json -"""


@dataclass(frozen=True)
class PlanRequest:
    """The scene."""

    scene: str = declared(REQUIRED, Text(), "A scene file", option="SCENE")


@dataclass(frozen=True)
class PlanAnswer:
    """A scene and its plan."""

    path: str
    scene: Scene
    plan: Plan

    def facts(self) -> dict[str, Any]:
        """The plan, by the keys of docs/verbs."""
        return {"scene": self.path, **self.plan.facts()}


def answer(request: PlanRequest, work: Work) -> PlanAnswer:
    """The plan of the scene."""
    from rotor.scenes.scene import read_scene

    scene = read_scene(request.scene)
    return PlanAnswer(request.scene, scene, scene.plan(folder=Path(request.scene).parent))


def show(answer: PlanAnswer, _: Any) -> Iterable[Part | None]:
    """The plan."""
    from rotor.requests.plan import larger_items

    plan = answer.plan
    yield answer.scene.heading
    facts: list[tuple[str, str]] = [
        ("effects", "; ".join(plan.effects)),
        (verb_of(plan.kind).invariants, ", ".join(plan.good) or "none"),
        *plan.parts,
        *((name, f"{count:,}") for name, count in plan.counts.items()),
        ("seconds", f"{plan.seconds:.2g} processor time, without start-up and compilation"),
        ("memory", f"{plan.memory_mb:.2g} MB peak"),
    ]
    larger, others = larger_items(plan.left_out, lambda part: part.size, lambda part: part.name)
    texts = [_text(part) for part in larger] + ([others] if others else [])
    yield [*facts, *left_out_facts(texts)]


def _text(part: LeftOut) -> str:
    size: Any = "not estimated" if part.size is None else f"about {part.size:.1g} {part.unit}"
    return f"{part.name}: {size}; {part.basis}"


VERB = Tool(
    name="plan",
    about="Plan of a scene: method, basis, counts, seconds, memory, and neglected effects by size.",
    examples=EXAMPLES,
    request=PlanRequest,
    of="scene",
    answer=answer,
    show=show,
)
