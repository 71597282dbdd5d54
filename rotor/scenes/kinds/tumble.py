"""Scenes of the rotation of one body."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path

from rotor.classical.motion import MotionTable
from rotor.classical.tumble import Three, TumbleAnswer, TumbleRequest, answer_tumble
from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import top_of
from rotor.scenes.scene import TumbleScene, molecule_of
from rotor.scenes.sections import BodySection, MoleculeSection, TumbleConditions


def request(scene: TumbleScene, folder: Where = ".") -> TumbleRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    if (molecule is None) == (scene.body is None):
        raise ValueError("molecule, body: give one of them")
    if molecule is None:
        assert scene.body is not None
        return _of_body(scene.body, scene.conditions)
    from rotor.thermo.thermal_tumble import thermal_tumble

    start = scene.conditions
    with kind.fields(angular_momentum="conditions.angular_momentum", temperature_k="conditions.temperature"):
        return thermal_tumble(
            top_of(molecule, folder),
            temperature_k=kind.quantity("conditions.temperature", start.temperature, "K"),
            angular_momentum_hbar=None if start.angular_momentum is None else three(start.angular_momentum),
            times_ps=kind.grid("conditions.times", start.times, "ps"),
        )


def three(numbers: list[float]) -> Three:
    """Three components, refused with a ValueError unless they are three."""
    if len(numbers) != 3:
        raise ValueError(f"{numbers}: expected three numbers")
    x, y, z = numbers
    return x, y, z


def _of_body(body: BodySection, start: TumbleConditions) -> TumbleRequest:
    if (body.angular_momentum is None) == (body.angular_velocity is None):
        raise ValueError("body: give either angular_momentum or angular_velocity")
    if start.angular_momentum is not None:
        raise ValueError("conditions.angular_momentum: is that of a molecule; of a body it stands in [body]")
    times = kind.grid("conditions.times", start.times, "")
    with kind.fields(moments="body.moments", angular_momentum="body.angular_momentum", times="conditions.times"):
        moments = three(body.moments)
        if body.angular_velocity is not None:
            return TumbleRequest.of_angular_velocity(moments, three(body.angular_velocity), times=times)
        assert body.angular_momentum is not None
        return TumbleRequest(moments, three(body.angular_momentum), times)


def answer(asked: TumbleRequest, scene: TumbleScene, out: Where, executor: Executor | None) -> TumbleAnswer:
    """The exact motion."""
    return answer_tumble(asked)


def table(found: TumbleAnswer) -> MotionTable:
    """The motion at the times asked for."""
    return found.table


def writers(found: TumbleAnswer, scene: TumbleScene) -> Mapping[str, Writer]:
    """The picture of the polhodes."""

    def plot(path: Path) -> None:
        from rotor.plots.show import plot as draw

        draw(found, path)

    return {"plot": plot}


def saved(asked: TumbleRequest, molecule: MoleculeSection | None) -> TumbleScene:
    """The scene of a request."""
    times = None if asked.times is None else list(asked.times)
    if molecule is None:
        body = BodySection(moments=list(asked.moments), angular_momentum=list(asked.angular_momentum))
        return TumbleScene(body=body, conditions=TumbleConditions(times=times))
    conditions = TumbleConditions(angular_momentum=list(asked.angular_momentum), times=times)
    return TumbleScene(molecule=molecule, conditions=conditions)


KIND = Kind(request, answer, table, saved, writers)
