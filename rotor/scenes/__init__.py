"""Scenes: simulations described in one file; read, planned and run."""

from __future__ import annotations

from typing import Any

from rotor.scenes.verbs import VERBS


def _run(*arguments: Any, **named: Any) -> Any:
    """Call `rotor.scenes.run.run_scene`, imported on first use."""
    from rotor.scenes.run import run_scene

    return run_scene(*arguments, **named)


def _plan(*arguments: Any) -> Any:
    """Call `rotor.scenes.plan.plan_of`, imported on first use."""
    from rotor.scenes.plan import plan_of

    return plan_of(*arguments)


VERBS.update(run=_run, plan=_plan)
