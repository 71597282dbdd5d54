"""`tumble`: rotation of a molecule or a rigid body, free or under torques, drag, drives and fields."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.reports import top_facts
from rotor.reports.screen import Part, Table, record_table, sampled
from rotor.requests.fill import NamedError, within
from rotor.requests.readers import Rule
from rotor.verbs.common.molecule import DIPOLE, NUCLEI, POLARIZABILITY, REFINEMENT, STATES
from rotor.verbs.common.outputs import Output, Report, drawing, picture, tables
from rotor.verbs.common.turning_body import MotionInput, TurningBody, build
from rotor.verbs.common.verb import Verb, Work, facts_named

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.classical.driven import DrivenAnswer, DrivenRequest
    from rotor.classical.tumble import TumbleAnswer, TumbleRequest

SHOWN = 11  # rows of the motion in the report
SMALL = 1e-4  # largest component of a column below which numbers are printed with digits instead of decimals
FEW_TIMES = 10_000  # plain Python takes half a second for them, as long as loading the compiler
FREE = Rule(excludes=("effects",), why="needs a free motion (a table shows any)")  # of films
EXAMPLES = """\
  rotor tumble water --plot water.png --gif water.gif
  rotor tumble water --times 0:20ps:401 --csv water.csv
  rotor tumble book --plot book.png
  rotor tumble --body wing-nut --omega "0.01,0,20 rad/s" --gif nut.gif
  rotor tumble --moments "0.6,0.8,1.0 kg m2" --omega "0.1,60,0 rpm"
  rotor tumble --moments 0.6,0.8,1.0 --angular-momentum 1.8,0.4,-0.9 --times 0:10:101 --csv out.csv
  rotor tumble book --effect "linear drag coefficients=1e-4,1e-4,1e-4" --times 0:30:301 --csv slowed.csv"""


def is_short(request: TumbleRequest | DrivenRequest) -> bool:
    """Whether plain Python computes the motion faster than the compiler for the kernels can be loaded."""
    from rotor.classical.tumble import TumbleRequest

    return isinstance(request, TumbleRequest) and (request.times is None or len(request.times) <= FEW_TIMES)


def answer(request: TumbleRequest | DrivenRequest, _: Work) -> TumbleAnswer | DrivenAnswer:
    """Compute the exact free motion, or that under effects by steps."""
    from rotor.classical.driven import answer_driven
    from rotor.classical.tumble import TumbleRequest, answer_tumble

    return answer_tumble(request) if isinstance(request, TumbleRequest) else answer_driven(request)


def check(request: TumbleRequest | DrivenRequest, outputs: Mapping[str, tuple[Path, ...]], shown: Any) -> None:
    """Refuse a film without two times or without its program."""
    if "gif" not in outputs:
        return
    from rotor.plots.motion.animation import check_film

    path, times = str(outputs["gif"][0]), request.times
    with within("{outputs.gif}"):
        check_film(path)
    if times is not None and min(times) == max(times):
        raise NamedError(
            f"{{outputs.gif}} {path}: a film needs at least two different times; give more {{conditions.times}}"
        )


def film(answer: TumbleAnswer | DrivenAnswer, path: Path, report: Report) -> None:
    """Write the animation."""
    from rotor.classical.tumble import TumbleAnswer
    from rotor.plots.motion.animation import animate

    assert isinstance(answer, TumbleAnswer)
    request, units = answer.request, answer.request.units
    animate(
        answer.motion, answer.table.times / units.time_factor, path, atoms=_atoms(request), axis_names=request.axes,
        time_unit=units.time, time_factor=units.time_factor, provenance=dict(report.provenance),
    )  # fmt: skip


def _atoms(request: TumbleRequest) -> Any:
    """The atoms in the principal frame (Å); None without a geometry."""
    top = getattr(request, "top", None)
    if top is None or top.molecule is None or top.frame is None:
        return None
    from rotor.plots.motion.animation import Atoms

    return Atoms((top.molecule.positions_angstrom - top.frame.centre) @ top.frame.axes.T, top.molecule.symbols)


def _heading(request: TumbleRequest | DrivenRequest) -> str:
    top = getattr(request, "top", None)
    if top is not None:
        return top_facts.heading(top)
    from rotor.classical.tumble import TumbleRequest

    still = TumbleRequest(request.moments, request.moments)
    name = top_facts.KINDS[still.kind].replace("linear molecule", "linear body")
    return f"{request.named.name if request.named else 'moments ' + _numbers(request.moments)}: {name}"


def _picture_title(request: TumbleRequest | DrivenRequest) -> str:
    from rotor.plots.picture import top_title

    top = getattr(request, "top", None)
    return _heading(request) if top is None else f"{top_title(top)}: {top_facts.KINDS[top.kind]}"


def show(answer: TumbleAnswer | DrivenAnswer, report: Report) -> Iterable[Part | None]:
    """How the body rotates, and rows of the motion."""
    from rotor.classical.driven import DrivenAnswer

    content = report.content
    if isinstance(answer, DrivenAnswer):
        return _driven_parts(answer, content)
    if getattr(answer.request, "top", None) is not None:
        return _show_top(answer, report)
    tables = _axes_table(answer, report), _motion_table(answer, report)
    return [_title(answer), _facts(answer, content), *tables, top_facts.error_facts(content.get("errors"))]


def _title(answer: TumbleAnswer) -> str:
    return f"{_heading(answer.request)}, turning freely"


def _driven_parts(answer: DrivenAnswer, content: Mapping[str, Any]) -> list[Part | None]:
    units = answer.request.units
    names = [type(effect).name or type(effect).__name__ for effect in answer.request.effects]
    energy = f" {units.energy}" if units.energy else ""
    drift = content["energy_drift"]
    last = "the effects change it" if drift is None else f"conserved to {drift:.1e} of the largest kinetic one"
    facts = [
        *((f"effect {number}", text) for number, text in enumerate(content["effects"], 1)),
        ("method", f"{content['method']}, {content['steps']} steps"),
        ("energy", f"{content['energy_first']:.10g} to {content['energy_last']:.10g}{energy}: {last}"),
        *top_facts.error_facts(content.get("errors")),
    ]
    return [f"{_heading(answer.request)}, under {', '.join(names)}", facts, _driven_table(answer)]


def _facts(answer: TumbleAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    request, units = answer.request, answer.request.units
    top, ratio = getattr(request, "top", None), content["separatrix_ratio"]
    size = f"{content['angular_momentum_size']:.8g}{_unit(units.angular_momentum)}"
    vector = f"({_numbers(content['angular_momentum'])})"
    drifts = {"energy": "energy", "|L|": "momentum", "L in space": "space_momentum"}
    conserved = ", ".join(f"{name} to {content['invariant_drift'][key]:.1e}" for name, key in drifts.items())
    separatrix = growth = ""
    if ratio is not None:
        low, _, high = sorted(zip(request.moments, request.axes, strict=True))
        separatrix = f"|ω{high[1]}/ω{low[1]}| = {ratio:.8g} where L crosses the plane of these two axes"
        growth = f"{content['growth_rate']:.8g}{_per(units.time)} off the intermediate axis, exact"
    return [
        *([] if top is None else [top_facts.rigid_fact(top)]),
        ("body", "" if request.named is None else f"{request.named.text}; assumed sizes"),
        ("|L|", f"{size}, {vector} in the body: {request.source}"),
        ("energy", f"{content['energy']:.10g}{_unit(units.energy)}"),
        ("motion", _motion_text(request, content)),
        ("about L", f"turns by {content['turning_rate']:.8g} rad{_per(units.time)} on average, in the space frame"),
        ("separatrix", separatrix),
        ("growth rate", growth),
        ("chaos", content["chaos"]),
        ("times", content["times_source"]),
        ("conserved", f"{conserved} relative: round-off, at all times of the request"),
    ]


def _motion_text(request: TumbleRequest, content: Mapping[str, Any]) -> str:
    kind, unit = content["motion_kind"], _unit(request.units.time)
    if kind == "steady":
        return "steady: L stands still in the body"
    if kind == "separatrix":
        return "on the separatrix: L runs into the intermediate axis and does not come back"
    period = f"L goes round {kind.removeprefix('about ')} of the body in a period of {content['period']:.10g}{unit}"
    if len(set(request.moments)) < 3:
        return period
    middle = sorted(zip(request.moments, request.axes, strict=True))[1][1]
    return f"{period}; its component along axis {middle} changes sign every half of it"


def _axes_table(answer: TumbleAnswer, report: Report) -> Table:
    """Stability of a rotation about each axis."""
    fates = {
        "stable": "a push oscillates",
        "unstable": "a push grows",
        "neutral": "a push stays" if answer.request.kind in ("linear", "spherical") else "a push drifts",
        "none": "no rotation about it",
    }
    units = answer.request.units
    columns = {
        "axis": "{axis}",
        "moment" + _bracket(units.moment): "{moment:.8g}",
        "kind": "{kind}",
        f"rate (rad{_per(units.time)})": "{rate:.8g}",
        "": lambda row: fates[row["kind"]],
    }
    return record_table(
        "spin about each axis, at this |L|", columns, report.content["fixed_axes"], {"axis", "kind", ""}
    )


def _motion_table(answer: TumbleAnswer, _: Report) -> Table:
    columns, unit = answer.table.columns, _bracket(answer.request.units.angular_momentum)
    momentum, attitude = [*columns][1:4], [*columns][4:8]
    texts = [*(f"L{axis}{unit}" for axis in answer.request.axes), *attitude]
    forms = [f"{{{name}:{_form(columns[name])}}}" for name in (*momentum, *attitude)]
    return _rows(answer, dict(zip(texts, forms, strict=True)))


_show_top = top_facts.report_on_top(_facts, _axes_table, _motion_table, title=_title)


def _driven_table(answer: DrivenAnswer) -> Table:
    units = answer.request.units
    names = [*answer.table.columns]
    attitude, energy_and_rates = names[4:8], names[8:]
    rates = (f"ω{axis}{_bracket(units.rate)}" for axis in answer.request.axes)
    texts = [f"energy{_bracket(units.energy)}", *rates, *attitude]
    return _rows(answer, {text: f"{{{n}:.6f}}" for text, n in zip(texts, (*energy_and_rates, *attitude), strict=True)})


def _rows(answer: TumbleAnswer | DrivenAnswer, columns: Mapping[str, str]) -> Table:
    """Evenly spaced rows of a motion."""
    records, few = sampled(answer.table, SHOWN, "times")
    time = {f"t{_bracket(answer.request.units.time)}": f"{{{next(iter(answer.table.columns))}:.6g}}"}
    return record_table(f"the motion{few}", time | dict(columns), records)


def _numbers(values: Any) -> str:
    return ", ".join(f"{x:.8g}" for x in values)


def _unit(name: str) -> str:
    return f" {name}" if name else ""


def _per(name: str) -> str:
    return f"/{name}" if name else " per time"


def _bracket(name: str) -> str:
    return f" ({name})" if name else ""


def _form(column: Floats) -> str:
    """Six decimals, or six digits if decimals would show nothing (SI units of molecules)."""
    return ".6g" if 0 < float(max(abs(column.min()), abs(column.max()))) < SMALL else "z.6f"


VERB = Verb(
    name="tumble",
    about="Rotation of a molecule or a rigid body: exact free motion, conserved quantities, stable axes; motion under effects.",
    examples=EXAMPLES,
    request=MotionInput,
    answer=answer,
    results=lambda answer: facts_named(
        answer.facts(), "energy", "period", "turning_rate", "energy_first", "energy_last", "energy_drift"
    ),
    rows="motion",
    show=show,
    outputs=(
        *tables("the motion", "tumble"),
        picture(
            "Draw the polhodes; with effects ω, L and energy", "tumble.png", drawing(title=lambda answer, _: _picture_title(answer.request))
        ),
        Output("gif", (".gif", ".mp4"), "Animate the motion (.gif; .mp4 with ffmpeg)", film, "tumble.gif", rule=FREE),
    ),
    subject=TurningBody(
        (*DIPOLE, *POLARIZABILITY, "spin_weights", *NUCLEI, *STATES, "internal_rotation", *REFINEMENT, "symmetry_tolerance"),
    ),
    drawn=None,
    stated=("source", "units", "moments", "angular_momentum", "angular_momentum_source", "effects", "method"),
    build=build,
    check=check,
    short=is_short,
    invariants="conserved",
    numerics="rotor.classical.numerics:TUMBLE",
    accuracy="of the attitude",
    accuracy_example="1e-6 rad",
    start={"molecule": "water", "conditions.temperature": "300 K", "outputs.csv": "tumble.csv"},
)  # fmt: skip
