"""Accuracy goals, sweeps and plans for line lists and Raman lines; neglected line widths."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.quantum.estimates.accuracy import (
    SHORT_J,
    by_blocks,
    distortion,
    hyperfine,
    largest,
    levels_error,
    rounding_of,
)
from rotor.quantum.estimates.plans import effect_texts, level_parts, neglected_in_levels, plan_fields
from rotor.quantum.levels import energies_like
from rotor.requests.budget import ErrorTerm
from rotor.requests.knob import Knob, Measure
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut, largest_first
from rotor.spectra.intensity_accuracy import intensity_error
from rotor.spectra.raman.request import SECTION, answer_raman
from rotor.spectra.request import INTENSITY, answer_spectrum
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


def highest_j(measure: Measure, cost: Growth | None = None) -> Knob:
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
        cost=cost,
    )


def _line_numerics(
    names: tuple[str, str, str],
    answer: Callable[[Any], Any],
    reach: Knob,
    error: Callable[[Any, Any], float],
    describe: Callable[[Any, Any], Mapping[str, Any]],
    rounding: Callable[[Any], ErrorTerm],
) -> Numerics:
    """Numerics of a list of lines. names: of the error of a line, of frequencies and of intensities. error: of frequencies in a list."""
    of, frequencies, intensities = names
    frequency = Measure(of, "MHz", lambda answer, reference: error(answer.lines, reference.lines))
    return Numerics(
        {"MHz": Goal(frequencies, list_error), "%": Goal(intensities, intensity_error)},
        knobs=(reach, distortion(frequency), hyperfine(frequency)),
        prepare=lambda request: replace(request, jmax=answer(request).lines.jmax),
        describe=describe,
        rounding=rounding,
    )


def _spectrum_jmax(request: Any) -> tuple[int, str]:
    """J max of a line list, and the reason."""
    from rotor.spectra import intensity
    from rotor.spectra.lines import line_partition
    from rotor.thermodynamics.sums.partition import partition_function

    if request.jmax is not None:
        return request.jmax, "given"
    top, kelvin = request.top, request.temperature_k
    cut = -math.inf if request.min_lgint is None else request.min_lgint
    partition = line_partition(top, kelvin, request.q, request.vibrational_factor, None)
    dipole = top.dipole_abc_debye or (0.0, 0.0, 0.0)
    return intensity.highest_j(top, dipole, partition or partition_function(top, kelvin), cut), "as the cut requires"


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


LENGTH = Growth(
    lambda request: (max(SHORT_J[0], request.jmax // 3), max(SHORT_J[1], request.jmax // 2)),
    prepare=lambda request: replace(request, jmax=_spectrum_jmax(request)[0]),
    work=lambda request, j: by_blocks(request.top, j),
    memory=lambda request, j: (j + 1.0) ** (1 if request.top.kind == "linear" else 2),
    table=False,  # long lists are written in parts
)


def describe_spectrum(request: Any, _: Cost) -> dict[str, Any]:
    """What a line list does."""
    from rotor.thermodynamics.sums.classical_limit import populated_j

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


def describe_raman(request: Any, cost: Cost) -> dict[str, Any]:
    """What Raman lines are, with J max of the answer."""
    top, answer, jmax = request.top, cost.answer, cost.answer.lines.jmax
    parts = (("J max", f"{jmax}: {answer.jmax_source}"), *level_parts(top, jmax, request.effects))
    described = plan_fields(top, answer.typical_j, request.effects)
    return {**described, "parts": parts, "counts": {"lines": len(answer.lines)}}


def _raman_rounding(request: Any) -> ErrorTerm:
    return rounding_of(request.top, int(answer_raman(request).lines.jmax))


SPECTRUM = _line_numerics(
    ("frequency of a line", "frequencies", "intensities"),
    answer_spectrum,
    highest_j(INTENSITY, LENGTH),
    line_error,
    describe_spectrum,
    lambda request: rounding_of(request.top, _spectrum_jmax(request)[0]),
)
RAMAN = _line_numerics(
    ("shift of a line", "shifts", "cross sections"),
    answer_raman,
    highest_j(SECTION),
    shift_error,
    describe_raman,
    _raman_rounding,
)


def describe_emission(request: Any, cost: Cost) -> dict[str, Any]:
    """What a source does."""
    from rotor.tops.top import Top

    answer, effects = cost.answer, list[str]()
    neglected = [LeftOut("departures from one excitation temperature", None, "", "collisions and radiation")]
    for name, top, lines in zip(request.names, request.molecules, answer.emitted, strict=True):
        if not isinstance(top, Top):
            continue
        j, hamiltonian = lines.typical_j, lines.effects
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
