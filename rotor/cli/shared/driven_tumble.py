"""`rotor tumble --effect ...`: the stepped motion of a body under torques, drag, drives, rotors inside, gravity, fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.options import option
from rotor.cli.shared.output import Files, Table, answering, deliver, json_with_rows, show_facts, show_table
from rotor.cli.shared.save_scene import save_scene
from rotor.cli.shared.tumble_inputs import Body, Options, read_body, read_vector

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenAnswer, DrivenRequest
    from rotor.classical.tumble import Three

SHOWN = 11  # rows of the motion in the report
NAMES = {"moments": "--moments", "angular_momentum": "--angular-momentum", "angular_velocity": "--omega"}
KNOBS = {"tolerance": "--tolerance", "step": "--step", "order": "--order", "attitude": "--attitude", "times": "--times"}


@dataclass(frozen=True)
class Driven:
    """What acts on a body, and how its motion is stepped."""

    effect: list[str] | None = option(
        None,
        metavar="EFFECT",
        help='What acts on a body: a name and its parameters, such as "linear drag coefficients=0.1,0.1,0.2"; as often as there are.',
    )
    attitude: str | None = option(
        None, metavar="W,X,Y,Z", help="With --effect: unit quaternion, body to space, at the first time."
    )
    tolerance: float | None = option(
        None, metavar="X", help="With --effect: of a step, relative to |L| and one radian (1e-10)."
    )
    step: str | None = option(
        None, metavar="T", help="With --effect: steps of this length of a splitting instead; not for drag."
    )
    order: int | None = option(None, metavar="N", help="Of the splitting: 2, 4, 6 or 8 (4).")


def answer_effects(given: Input, options: Options, driven: Driven, outputs: Any, command: str) -> None:
    """Step the motion, write the files, report."""
    for name in ("plot", "gif"):
        if getattr(outputs, name):
            raise ValueError(f"--{name}: shows a free motion; leave it out with --effect (--csv writes the motion)")
    files = Files.of(outputs)
    body = _body(given, options)
    request = _request(body, options, driven)
    from rotor.classical.driven import answer_driven

    with answering():
        answer = answer_driven(request)
    content = _content(body, answer, driven, command) | {"files": files.names}
    rows = _rows(answer, content)
    writers = {"--csv": rows, "--parquet": rows} | save_scene("tumble", request, outputs)
    text = lambda: json_with_rows(answer.table, "motion", content)  # noqa: E731
    deliver(files, writers, text, lambda: _show(body, answer, content))


def refuse_without_effect(driven: Driven) -> None:
    """Options of a stepped motion that were given to a free one."""
    for name in ("attitude", "tolerance", "step", "order"):
        if getattr(driven, name) is not None:
            raise ValueError(
                f"--{name}: belongs to a motion under effects; give --effect, or leave it out: a free one is exact"
            )


def _body(given: Input, options: Options) -> Body:
    body = read_body(given, options)
    if body is None:
        raise ValueError("--effect: acts on a body; give --moments or --body instead of a molecule")
    if options.times is None:
        raise ValueError("--times: expected with --effect, the start first: such as 0:10:101")
    return body


def _request(body: Body, options: Options, driven: Driven) -> DrivenRequest:
    from rotor.classical.driven import DEFAULT_TOLERANCE, DrivenRequest

    times = inputs.times("--times", options.times, body.units.time)
    step = None if driven.step is None else inputs.positive("--step", driven.step, body.units.time)
    if driven.order is not None and step is None:
        raise ValueError("--order: is that of a splitting; give --step too")
    omega, momentum = _start(body, options)
    with inputs.fields_as_options(**NAMES, **KNOBS):
        request = DrivenRequest(
            body.moments,
            times or (),
            tuple(inputs.parsed("--effect", text, _effect) for text in driven.effect or ()),
            omega,
            momentum,
            tolerance=DEFAULT_TOLERANCE if driven.tolerance is None else driven.tolerance,
            step=step,
            order=4 if driven.order is None else driven.order,
        )
        if driven.attitude is not None:
            request = replace(request, attitude=inputs.parsed("--attitude", driven.attitude, _quaternion))
    return request


def _effect(text: str) -> Any:
    from rotor.scenes.effect_sections import effect_of
    from rotor.scenes.effect_text import effect_section

    return effect_of(effect_section(text))


def _start(body: Body, options: Options) -> tuple[Three | None, Three | None]:
    """ω or L at the first time; a named body turns as it does without effects."""
    if options.omega is not None:
        return inputs.parsed("--omega", options.omega, lambda text: read_vector(text, body.rate_unit)), None
    if options.angular_momentum is not None:
        return None, inputs.parsed("--angular-momentum", options.angular_momentum, lambda text: read_vector(text, ""))
    if body.start is None:
        raise ValueError(
            "--omega: expected with --moments, the angular velocity at the first time; or --angular-momentum"
        )
    return None, body.start[0]


def _quaternion(text: str) -> tuple[float, float, float, float]:
    from rotor.units import parse_grid

    if text.count(",") != 3 or ":" in text:
        raise ValueError(f"{text!r}: expected four numbers, such as 1,0,0,0")
    w, x, y, z = parse_grid(text, "").tolist()
    return w, x, y, z


def _content(body: Body, answer: DrivenAnswer, driven: Driven, command: str) -> dict[str, Any]:
    from rotor.reports.top_facts import begin

    units = body.units
    named = {"time": units.time, "angular_momentum": units.angular_momentum, "energy": units.energy}
    facts = answer.facts() | {"effects": [" ".join(text.split()) for text in driven.effect or ()]}
    return begin(command, body.text) | {"units": named, "axes": list(body.axes)} | facts


def _rows(answer: DrivenAnswer, content: dict[str, Any]) -> Callable[[Path], None]:
    from rotor.cli.shared.output import plain

    keys = ("command", "input", "units", "moments", "effects", "method")

    def write(path: Path) -> None:
        """The file, with what it was made from."""
        import rotor

        rotor.write(answer.table, path, settings={key: plain(content[key]) for key in keys})

    return write


def _show(body: Body, answer: DrivenAnswer, content: dict[str, Any]) -> None:
    units = body.units
    print(f"{body.text}: under {', '.join(_name(text) for text in content['effects'])}")
    energy = f" {units.energy}" if units.energy else ""
    drift = content["energy_drift"]
    last = "not conserved" if drift is None else f"conserved to {drift:.1e} of the largest kinetic one"
    facts = [
        *((f"effect {number}", text) for number, text in enumerate(content["effects"], 1)),
        ("method", f"{content['method']}, {content['steps']} steps"),
        ("energy", f"{content['energy_first']:.10g} to {content['energy_last']:.10g}{energy}: {last}"),
    ]
    show_facts(facts)
    print()
    show_table(_motion_table(body, answer))


def _name(text: str) -> str:
    words = text.split()
    return " ".join(word for word in words[: next((k for k, word in enumerate(words) if "=" in word), len(words))])


def _motion_table(body: Body, answer: DrivenAnswer) -> Table:
    """Some rows of the motion, evenly chosen."""
    columns = answer.table.columns
    count = len(columns["t"])
    rows = sorted({round(i * (count - 1) / (SHOWN - 1)) for i in range(SHOWN)}) if count > SHOWN else range(count)
    names = {"t": _label("t", body.units.time), "energy": _label("energy", body.units.energy)}
    for number, axis in enumerate(body.axes, 1):
        names[f"w{number}"] = _label(f"ω{axis}", body.rate_unit)
    names |= {name: name for name in ("qw", "qx", "qy", "qz")}
    shown = [columns[name] for name in names]
    cells = [[f"{values[i]:.6g}" if k == 0 else f"{values[i]:.6f}" for k, values in enumerate(shown)] for i in rows]
    title = "the motion" if len(cells) == count else f"the motion, {len(cells)} of {count} times"
    return Table(title, list(names.values()), cells)


def _label(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name
