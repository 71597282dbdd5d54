"""What can be done with a scene: functions that the package `rotor.scenes` registers, above all of its modules.

A scene is data and imports neither `rotor.scenes.run` nor `rotor.scenes.plan`; `scene.run()` and `scene.plan()` call what stands here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

VERBS: dict[str, Callable[..., Any]] = {}
