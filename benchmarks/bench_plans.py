"""Planned seconds and memory beside those of the run: processor time without start-up and compilation, and peak of what is allocated.

    python benchmarks/bench_plans.py

Scenes that are longer than the examples, so that both stand above what is always there. Plans hold within a factor of 3 above a second,
and above a megabyte. A run that is traced for its memory takes several times as long; its seconds are those of another.
"""

from __future__ import annotations

import time
from pathlib import Path

import msgspec

from rotor.scenes.plan import plan_of
from rotor.scenes.plan_parts import peak_mb
from rotor.scenes.scene import LevelsScene, Scene, SpectrumScene, StarkScene
from rotor.scenes.scene_file import read_scene
from rotor.scenes.sections import LevelsObservables, SpectrumConditions, SpectrumObservables, StarkConditions

FOLDER = Path(__file__).resolve().parents[1] / "examples" / "scenes"
CHANGED = {
    "water_gas": {"numerics": {"molecules": 100_000}},
    "rigid_water": {"conditions": {"steps": 1500, "molecules": 216}},
    "formamide_hyperfine": {"conditions": {"temperature": "300 K", "range": None}, "numerics": {"jmax": None}},
    "tennis_racket": {"conditions": {"times": "0:500:50001"}},
    "driven_chaos": {"conditions": {"times": "0:30:20001"}},
    "so2_far_infrared": {},
    "ocs_alignment": {"conditions": {"temperature": "10 K"}},
    "ocs_stark_map": {"conditions": {"field": "0:200kV/cm:2001"}},
}
OTHERS: dict[str, Scene] = {
    "SO2, every line": SpectrumScene(
        molecule="SO2",
        conditions=SpectrumConditions(temperature="300 K"),
        observables=SpectrumObservables(min_lgint="none"),
    ),
    "SO2, levels to 150": LevelsScene(molecule="SO2", observables=LevelsObservables(jmax=150)),
    "OCS, levels to 3000": LevelsScene(molecule="OCS", observables=LevelsObservables(jmax=3000)),
    "formaldehyde, Stark map": StarkScene(molecule="H2CO", conditions=StarkConditions(field="0:100kV/cm:301")),
}
WITHOUT_ACCURACY = {"water_gas", "driven_chaos"}  # their numbers are given here


def scenes() -> dict[str, Scene]:
    """Example scenes without files, some of their numbers changed, and others."""
    found: dict[str, Scene] = {}
    for name, tables in CHANGED.items():
        scene = read_scene(FOLDER / f"{name}.toml")
        changes = {table: msgspec.structs.replace(getattr(scene, table), **new) for table, new in tables.items()}
        if name in WITHOUT_ACCURACY:
            changes["accuracy"] = None
        found[name] = msgspec.structs.replace(scene, outputs=type(scene.outputs)(), **changes)
    return found | OTHERS


def main() -> None:
    """Print planned and taken seconds and megabytes, and their ratios."""
    for name, scene in scenes().items():
        plan = plan_of(scene, FOLDER)

        def run(scene: Scene = scene) -> None:
            scene.run(folder=FOLDER)

        start = time.process_time()
        run()
        taken = time.process_time() - start
        most = peak_mb(run)
        print(
            f"{name:24s} seconds: planned {plan.seconds:8.3g}, taken {taken:8.3g}, ratio {plan.seconds / taken:5.2f}    "
            f"MB: planned {plan.memory_mb:8.3g}, taken {most:8.3g}, ratio {plan.memory_mb / most:5.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
