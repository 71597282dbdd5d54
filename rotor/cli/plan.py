"""`rotor plan`: method, cost and neglected effects of a scene, before it is run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from rotor.cli.shared_options import SceneAnswer, SceneFile
from rotor.reports.screen import Part, listed
from rotor.verbs.common.verb import Tool, verb_of

if TYPE_CHECKING:
    from rotor.requests.plan import Plan

EXAMPLES = """\
  rotor plan s.toml
  rotor plan s.toml --json -"""


def answer(request: SceneFile, _: Any) -> SceneAnswer:
    """The plan of the scene."""
    scene = request.read()
    return SceneAnswer(request, scene, scene.plan(folder=request.folder))


def show(answer: SceneAnswer, _: Any) -> Iterable[Part | None]:
    """The plan."""
    from rotor.requests.plan import left_out_texts

    plan: Plan = answer.result
    yield answer.scene.heading
    yield [*plan.rows(verb_of(plan.kind).invariants), *listed("left out", left_out_texts(plan.left_out))]


VERB = Tool(
    name="plan",
    about="Plan of a scene: method, basis, counts, seconds, memory, and neglected effects by size.",
    examples=EXAMPLES,
    request=SceneFile,
    of="scene",
    answer=answer,
    show=show,
)
