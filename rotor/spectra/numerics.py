"""Accuracy goals, sweeps and plans for line lists and Raman lines; neglected line widths."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.quantum.estimates.accuracy import (
    distortion,
    energies_like,
    hyperfine,
    largest,
    levels_error,
    reason_of_no_distortion_sweep,
    rounding_of,
)
from rotor.quantum.estimates.left_out import neglected_in_levels
from rotor.quantum.estimates.plans import SHORT_J, effect_texts, level_parts, plan_fields
from rotor.requests.knob import Knob, Measure
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut, largest_first
from rotor.spectra.intensity_accuracy import Cut, intensity_error
from rotor.spectra.raman_request import RELATIVE_CUT, SECTION, answer_raman, section_left_out
from rotor.spectra.request import CUT, INTENSITY, answer_spectrum, intensity_left_out
from rotor.spectra.widths import doppler, pressure_width

if TYPE_CHECKING:
    from rotor.tops.top import Top

SHARES_OF_J = (0.25, 0.4, 0.55, 0.7, 0.85, 1.0)  # settings of a sweep, as shares of the scene's J max
BEYOND = 1.3  # J max of the reference, relative to that of the scene


def line_error(answer: Any, reference: Any) -> float:
    """Largest difference in MHz of the frequencies of the reference's lines, computed from the levels of an answer."""
    energies = energies_like(reference.levels, answer.levels)
    return largest(energies[reference.upper] - energies[reference.lower] - reference.frequency_mhz)


def shift_error(answer: Any, reference: Any) -> float:
    """Largest difference in MHz of the Raman shifts of the reference's lines, computed from the levels of an answer."""
    energies = energies_like(reference.levels, answer.levels)
    return largest(energies[reference.final] - energies[reference.initial] - reference.shift_mhz)


def list_error(answer: Any) -> float:
    """Error of line frequencies in MHz."""
    return levels_error(answer, answer.lines.top, answer.lines.levels)


def highest_j(measure: Measure) -> Knob:
    """The highest J of the levels that lines connect."""
    return Knob(
        lambda request: [max(1, round(share * request.jmax)) for share in SHARES_OF_J],
        lambda request: math.ceil(BEYOND * request.jmax) + 1,
        (measure,),
        "J max {}",
        key="numerics.jmax",
        title="highest J of the basis",
        attribute="jmax",
        label=str,
    )


def _knobs(of: str, lost: Measure, error: Callable[[Any, Any], float]) -> tuple[Knob, ...]:
    """Highest J (by the intensity lost), order of distortion and treatment of spins (by the error of frequencies)."""
    frequency = Measure(of, "MHz", lambda answer, reference: error(answer.lines, reference.lines))
    return highest_j(lost), distortion(frequency), hyperfine(frequency)


def _line_numerics(
    names: tuple[str, str],
    cut: Cut,
    weakest: Knob,
    knobs: tuple[Knob, ...],
    describe: Callable[[Any, Any], Mapping[str, Any]],
    cost: Callable[[Any], Cost] | None,
    rounding: Callable[[Any], float],
) -> Numerics:
    """Numerics of a list of lines. names: of frequencies and intensities. weakest: knob of the cut. knobs: the last is that of spins."""
    frequencies, intensities = names
    return Numerics(
        {
            "MHz": Goal(frequencies, list_error, knobs[-1:]),
            "%": Goal(intensities, intensity_error, (replace(weakest, search=cut.choices),)),
        },
        knobs=knobs,
        prepare=lambda request: replace(request, jmax=cut.answer(request).lines.jmax),
        remarks=lambda request: reason_of_no_distortion_sweep(request.top),
        describe=describe,
        cost=cost,
        rounding=rounding,
    )


def _spectrum_jmax(request: Any) -> tuple[int, str]:
    """J max of a line list, and the reason."""
    from rotor.spectra.intensity import jmax_for_cut
    from rotor.thermodynamics import partition_function

    if request.jmax is not None:
        return request.jmax, "given"
    top, kelvin = request.top, request.temperature_k
    cut = -math.inf if request.min_lgint is None else request.min_lgint
    q = request.q or partition_function(top, kelvin).q
    dipole = top.dipole_abc_debye or (0.0, 0.0, 0.0)
    return jmax_for_cut(top, dipole, kelvin, q * request.vibrational_factor, cut), "as the cut requires"


def allowed_lines(top: Top, jmax: int) -> int:
    """Number of dipole lines of a semi-rigid top up to J max that the selection rules allow.

    μ_a preserves the parity of Ka, μ_c that of Kc, μ_b changes both; linear and symmetric tops have ΔJ = 1 and ΔK = 0. Levels of spin
    weight 0 do not count.

    >>> from rotor.tops.top import Top
    >>> allowed_lines(Top.from_constants("A=10 B=6 C=4 GHz", dipole_abc_debye=(1, 0, 0)), 1)  # 1(0,1)-0(0,0), 1(1,0)-1(1,1)
    2
    """
    from rotor.quantum.solve import solve_levels
    from rotor.quantum.wang.basis import wang_blocks
    from rotor.quantum.wang.rotation import representation_of

    dipole = top.dipole_abc_debye or (0.0, 0.0, 0.0)
    if not any(dipole):
        return 0
    if top.kind != "asymmetric":
        levels = solve_levels(top, jmax, vectors=False)
        return int(((levels.weight > 0) & (levels.rotational < jmax)).sum())
    weights = top.spin_weights.to_mapping()
    blocks = [
        {b.species: b.size for b in wang_blocks(j, representation_of(top)) if weights.get(b.species, 1)}
        for j in range(jmax + 1)
    ]
    flips = [flip for mu, flip in zip(dipole, ((False, True), (True, True), (True, False)), strict=True) if mu]
    total = 0
    for j, level in enumerate(blocks):
        for up in (level, blocks[j + 1]) if j < jmax else (level,):
            pairs = sum(size * up.get(_flipped(species, flip), 0) for species, size in level.items() for flip in flips)
            total += pairs // 2 if up is level else pairs  # within a J each pair would count twice
    return total


def _flipped(species: str, flip: tuple[bool, bool]) -> str:
    return "".join(
        {"e": "o", "o": "e"}[letter] if change else letter for letter, change in zip(species, flip, strict=True)
    )


def spectrum_cost(request: Any) -> Cost:
    """The cost of a line list, from lists to lower J."""
    jmax, power = _spectrum_jmax(request)[0], 3 if request.top.kind == "asymmetric" else 1
    return Growth(
        lambda j: answer_spectrum(replace(request, jmax=j)),
        jmax,
        (max(SHORT_J[0], jmax // 3), max(SHORT_J[1], jmax // 2)),
        lambda j: (j + 1.0) ** power,
        lambda j: (j + 1.0) ** (1 if request.top.kind == "linear" else 2),
    ).cost


def describe_spectrum(request: Any, _: Any) -> dict[str, Any]:
    """What a line list does."""
    from rotor.quantum.estimates.limits import populated_j

    top, kelvin = request.top, request.temperature_k
    jmax, why = _spectrum_jmax(request)
    j = min(populated_j(top, kelvin), max(jmax, 1))
    _, b, c = top.rotational_constants_mhz
    pressure = request.layer.pressure_bar if request.layer else None
    lowest, highest = request.range_mhz or (0.0, math.inf)
    frequency = min(max((b + c) * (j + 1), lowest), highest)  # of the most populated lines, inside the range
    widths = [
        doppler(top, frequency, kelvin) if request.shape == "sticks" else None,
        pressure_width(top, kelvin, pressure) if request.shape in ("sticks", "gaussian") else None,
    ]
    described = plan_fields(top, j, request.effects)
    neglected = largest_first([*described.pop("left_out"), *(part for part in widths if part is not None)])
    lines = allowed_lines(top, jmax)
    return {
        **described,
        "parts": (("J max", f"{jmax}: {why}"), *level_parts(top, jmax, request.effects)),
        "counts": {"allowed lines of one state, without spins, before range and cut": lines},
        "left_out": neglected,
    }


def describe_raman(request: Any, answer: Any) -> dict[str, Any]:
    """What Raman lines are, with J max of the answer."""
    from rotor.quantum.estimates.limits import populated_j

    top, jmax = request.top, answer.lines.jmax
    parts = (("J max", f"{jmax}: {answer.jmax_source}"), *level_parts(top, jmax, request.effects))
    described = plan_fields(top, populated_j(top, request.temperature_k), request.effects)
    return {**described, "parts": parts, "counts": {"lines": len(answer.lines)}}


def _raman_rounding(request: Any) -> float:
    return rounding_of(request.top, int(answer_raman(request).lines.jmax))


def _lower_decades(cut: float, decades: int) -> float:
    return cut - decades


def _lower_factor(cut: float, decades: int) -> float:
    return float(cut * 10.0**-decades)


SPECTRUM = _line_numerics(
    ("frequencies", "intensities"),
    Cut("min_lgint", _lower_decades, intensity_left_out, answer_spectrum),
    CUT,
    _knobs("frequency of a line", INTENSITY, line_error),
    describe_spectrum,
    spectrum_cost,
    lambda request: rounding_of(request.top, _spectrum_jmax(request)[0]),
)
RAMAN = _line_numerics(
    ("shifts", "cross sections"),
    Cut("min_relative", _lower_factor, section_left_out, answer_raman),
    RELATIVE_CUT,
    _knobs("shift of a line", SECTION, shift_error),
    describe_raman,
    None,
    _raman_rounding,
)


def describe_emission(request: Any, answer: Any) -> dict[str, Any]:
    """What a source does."""
    from rotor.quantum.estimates.limits import populated_j
    from rotor.tops.top import Top

    effects: list[str] = []
    neglected = [LeftOut("departures from one excitation temperature", None, "", "collisions and radiation")]
    for name, top, source, lines in zip(request.names, request.molecules, request.sources, answer.emitted, strict=True):
        if not isinstance(top, Top):
            continue
        j, hamiltonian = populated_j(top, source.excitation_k), lines.effects
        effects += [f"{name}: {text}" for text in effect_texts(top, j, hamiltonian)]
        largest_effect = [part for part in neglected_in_levels(top, j, hamiltonian) if part.size is not None][:1]
        neglected += [replace(part, name=f"{name}: {part.name}") for part in largest_effect]
    return {
        "effects": tuple(effects),
        "parts": (
            (
                "method",
                "sum of optical depths of all lines, one excitation temperature for each molecule, one background",
            ),
            ("grid", "eight points to the width of a line"),
        ),
        "counts": {"molecules": len(request.molecules), "lines": len(answer.lines), "points": len(answer.spectrum)},
        "left_out": largest_first(neglected),
    }


EMISSION = Numerics({"K": Goal("brightness")}, describe=describe_emission)
