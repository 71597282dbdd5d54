"""Functions on scenes, registered by the package `rotor.scenes`, which imports all of its modules.

A scene is data and imports neither `rotor.scenes.run` nor `rotor.scenes.plan`; `scene.run()` and `scene.plan()` call these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

VERBS: dict[str, Callable[..., Any]] = {}
