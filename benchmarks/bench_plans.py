"""Planned seconds beside those that were taken: processor time, start-up and compilation apart.

    python benchmarks/bench_plans.py

The first three are made longer than their example scenes, so that what is compared is above start-up.
"""

from __future__ import annotations

import time
from pathlib import Path

import msgspec

from rotor.scenes.kind import kind_of
from rotor.scenes.plan import plan_of
from rotor.scenes.scene import Scene
from rotor.scenes.scene_file import read_scene

FOLDER = Path(__file__).resolve().parents[1] / "examples" / "scenes"
CHANGED = {
    "water_gas": {"numerics": {"molecules": 100_000}},
    "rigid_water": {"conditions": {"steps": 1500}},
    "formamide_hyperfine": {"conditions": {"temperature": "300 K", "range": None}, "numerics": {"jmax": None}},
}
NAMES = (*CHANGED, "so2_far_infrared", "ocs_alignment", "driven_chaos")


def scene_of(name: str) -> Scene:
    """An example scene without files, some of its numbers changed."""
    scene = read_scene(FOLDER / f"{name}.toml")
    changes = {
        table: msgspec.structs.replace(getattr(scene, table), **values)
        for table, values in CHANGED.get(name, {}).items()
    }
    return msgspec.structs.replace(scene, outputs=type(scene.outputs)(), **changes)


def main() -> None:
    """Print planned and taken seconds, and their ratio."""
    for name in NAMES:
        scene = scene_of(name)
        planned, kind = plan_of(scene).seconds, kind_of(scene)
        request = kind.request(scene, FOLDER)
        start = time.process_time()
        kind.answer(request, scene, ".", None)
        taken = time.process_time() - start
        print(f"{name:20s} planned {planned:8.3g} s, taken {taken:8.3g} s, ratio {planned / taken:.2f}")


if __name__ == "__main__":
    main()
