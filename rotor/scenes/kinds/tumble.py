"""Scenes of the rotation of one body."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.classical.euler import checked_moments
from rotor.classical.tumble import COHERENT, SI, Three, TumbleAnswer, TumbleRequest, answer_tumble
from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import named, top_of
from rotor.scenes.scene import TumbleScene, molecule_of
from rotor.scenes.sections import BodySection, MoleculeSection, TumbleConditions, TumbleNumerics

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenAnswer, DrivenRequest
    from rotor.table import Table

UNITS = {"": COHERENT, "SI": SI}


def request(scene: TumbleScene, folder: Where = ".") -> TumbleRequest | DrivenRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    if (molecule is None) == (scene.body is None):
        raise ValueError("molecule, body: give one of them")
    if molecule is None:
        assert scene.body is not None
        return _driven(scene, scene.body) if scene.effects else _of_body(scene.body, scene.conditions)
    if scene.effects:
        raise ValueError("effects: act on a body; give its moments in [body] instead of a molecule")
    from rotor.thermodynamics.thermal_tumble import thermal_tumble

    start = scene.conditions
    with kind.fields(angular_momentum="conditions.angular_momentum", temperature_k="conditions.temperature"):
        return thermal_tumble(
            top_of(molecule, folder),
            temperature_k=kind.quantity("conditions.temperature", start.temperature, "K"),
            angular_momentum_hbar=None if start.angular_momentum is None else three(start.angular_momentum),
            times_ps=kind.grid("conditions.times", start.times, "ps"),
        )


def _driven(scene: TumbleScene, body: BodySection) -> DrivenRequest:
    from rotor.classical.driven import DrivenRequest
    from rotor.scenes.effect_sections import effect_of

    times = kind.grid("conditions.times", scene.conditions.times, "")
    if times is None:
        raise ValueError("conditions.times: expected with effects, the start first: such as 0:10:101")
    effects = tuple(named(f"effects[{number}]", partial(effect_of, one)) for number, one in enumerate(scene.effects))
    names = {name: f"body.{name}" for name in ("moments", "angular_velocity", "angular_momentum", "attitude")}
    with kind.fields(**names, tolerance="numerics.tolerance", step="numerics.step", times="conditions.times"):
        w, x, y, z = body.attitude or (1.0, 0.0, 0.0, 0.0)
        return DrivenRequest(
            _moments(body),
            times,
            effects,
            None if body.angular_velocity is None else three(body.angular_velocity),
            None if body.angular_momentum is None else three(body.angular_momentum),
            (w, x, y, z),
            scene.numerics.tolerance,
            scene.numerics.step,
            scene.numerics.order,
        )


def three(numbers: list[float]) -> Three:
    """Three components, refused with a ValueError unless they are three."""
    if len(numbers) != 3:
        raise ValueError(f"{numbers}: expected three numbers")
    x, y, z = numbers
    return x, y, z


def _moments(body: BodySection) -> Three:
    def checked() -> Three:
        checked_moments(three(body.moments))
        return three(body.moments)

    return named("body.moments", checked)


def _of_body(body: BodySection, start: TumbleConditions) -> TumbleRequest:
    if (body.angular_momentum is None) == (body.angular_velocity is None):
        raise ValueError("body: give either angular_momentum or angular_velocity")
    if body.attitude is not None:
        raise ValueError("body.attitude: the table of a free motion begins at 1, 0, 0, 0; leave it out")
    if start.angular_momentum is not None:
        raise ValueError("conditions.angular_momentum: is that of a molecule; of a body it stands in [body]")
    if body.units not in UNITS:
        raise ValueError(f'body.units: {body.units!r}: expected "SI", or "" for any coherent set')
    times, units = kind.grid("conditions.times", start.times, ""), UNITS[body.units]
    with kind.fields(moments="body.moments", angular_momentum="body.angular_momentum", times="conditions.times"):
        moments = _moments(body)
        if body.angular_velocity is not None:
            return TumbleRequest.of_angular_velocity(moments, three(body.angular_velocity), times=times, units=units)
        assert body.angular_momentum is not None
        return TumbleRequest(moments, three(body.angular_momentum), times, units)


def answer(
    asked: TumbleRequest | DrivenRequest, scene: TumbleScene, out: Where, executor: Executor | None
) -> TumbleAnswer | DrivenAnswer:
    """The motion: exact where it is free, else stepped.

    Parameters
    ----------
    asked : TumbleRequest or DrivenRequest
        The scene as the library takes it, checked.
    scene : TumbleScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Not used.

    Returns
    -------
    TumbleAnswer or DrivenAnswer
        Momentum and attitude over time.
    """
    if isinstance(asked, TumbleRequest):
        return answer_tumble(asked)
    from rotor.classical.driven import answer_driven

    return answer_driven(asked)


def table(found: TumbleAnswer | DrivenAnswer) -> Table:
    """The motion at the times asked for."""
    return found.table


def writers(found: TumbleAnswer | DrivenAnswer, scene: TumbleScene) -> Mapping[str, Writer]:
    """The picture of the polhodes, of a free motion."""

    def plot(path: Path) -> None:
        from rotor.plots.show import plot as draw

        if not isinstance(found, TumbleAnswer):
            raise ValueError("outputs.plot: there is a picture of a free motion alone; leave it out")
        draw(found, path)

    return {"plot": plot}


def saved(asked: TumbleRequest | DrivenRequest, molecule: MoleculeSection | None) -> TumbleScene:
    """The scene of a request."""
    if not isinstance(asked, TumbleRequest):
        return _saved_driven(asked)
    times = None if asked.times is None else list(asked.times)
    if molecule is None:
        units = next(name for name, one in UNITS.items() if one == asked.units)
        momentum = list(asked.angular_momentum)
        body = BodySection(moments=list(asked.moments), angular_momentum=momentum, units=units)
        return TumbleScene(body=body, conditions=TumbleConditions(times=times))
    conditions = TumbleConditions(angular_momentum=list(asked.angular_momentum), times=times)
    return TumbleScene(molecule=molecule, conditions=conditions)


def _saved_driven(asked: DrivenRequest) -> TumbleScene:
    from rotor.scenes.effect_sections import section_of

    spin = asked.angular_velocity
    body = BodySection(
        moments=list(asked.moments),
        angular_velocity=None if spin is None else list(spin),
        angular_momentum=None if asked.angular_momentum is None else list(asked.angular_momentum),
        attitude=list(asked.attitude),
    )
    numerics = TumbleNumerics(tolerance=asked.tolerance, step=asked.step, order=asked.order)
    effects = [section_of(effect) for effect in asked.effects]
    conditions = TumbleConditions(times=list(asked.times))
    return TumbleScene(body=body, effects=effects, conditions=conditions, numerics=numerics)


KIND = Kind(request, answer, table, saved, writers)
