"""Scenes of molecules aligned or oriented by pulses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotor.alignment.pulse import (
    Axis,
    DipolePulse,
    GaussianPulse,
    Kick,
    Pulse,
    SwitchedPulse,
    TabulatedPulse,
    elliptical,
    polarization,
)
from rotor.alignment.request import AlignAnswer, AlignmentTable, AlignRequest, answer_align
from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import named, top_of, with_dipole
from rotor.scenes.scene import AlignScene, molecule_of
from rotor.scenes.sections import (
    AlignConditions,
    AlignNumerics,
    AlignObservables,
    FieldPulseSection,
    GaussianSection,
    KickSection,
    MoleculeSection,
    PulseSection,
    SwitchedSection,
    TableSection,
)

if TYPE_CHECKING:
    from rotor.tops.top import Top

_NAMES = {
    "temperature_k": "conditions.temperature", "from_ps": "conditions.first_time", "until_ps": "conditions.last_time",
    "points": "conditions.points", "tolerance": "numerics.tolerance", "jmax": "numerics.jmax", "seed": "numerics.seed",
    "classical_molecules": "observables.classical_molecules", "state": "conditions.state", "m": "conditions.m",
}  # fmt: skip
_AXES = {"z": (0, 0, 1), "x": (1, 0, 0), "y": (0, 1, 0), "circular": (1, 1j, 0)}


def request(scene: AlignScene, folder: Where = ".") -> AlignRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top, when, how = top_of(molecule, folder), scene.conditions, scene.numerics
    pulses = tuple(pulse_of(pulse, f"pulses[{number}]") for number, pulse in enumerate(scene.pulses))
    first, last = (
        None if time is None else kind.quantity(f"conditions.{name}", time, "ps")
        for name, time in (("first_time", when.first_time), ("last_time", when.last_time))
    )
    with kind.fields(**_NAMES):
        return AlignRequest(
            _acted_on(top, pulses),
            pulses,
            temperature_k=kind.quantity("conditions.temperature", when.temperature, "K"),
            state=when.state,
            m=when.m,
            from_ps=first,
            until_ps=last,
            points=when.points,
            observables=tuple(scene.observables.cosines),
            tolerance=how.tolerance,
            jmax=how.jmax,
            classical_molecules=scene.observables.classical_molecules,
            seed=how.seed,
        )


def _acted_on(top: Top, pulses: tuple[Pulse, ...]) -> Top:
    acts_on = {pulse.acts_on for pulse in pulses}
    if "polarizability" in acts_on and top.polarizability_abc_angstrom3 is None and top.kind != "spherical":
        raise ValueError("molecule.polarizability: it is not known; give it in principal axes (Å³)")
    return with_dipole(top) if "dipole" in acts_on else top


def pulse_of(given: PulseSection, name: str) -> Pulse:
    """The pulse that a table describes; `name` is that of the table in errors."""

    def number(key: str, unit: str) -> float:
        return kind.quantity(f"{name}.{key}", getattr(given, key), unit)

    if isinstance(given, FieldPulseSection):
        peak, fwhm, centre = number("peak", "kV/cm"), number("fwhm", "ps"), number("centre", "ps")
        frequency = number("frequency", "THz")
        return named(name, lambda: DipolePulse(peak, fwhm, frequency, given.phase, centre))
    axis = named(f"{name}.axis", lambda: axis_of(given.axis))
    if isinstance(given, TableSection):
        return named(name, lambda: TabulatedPulse(np.array(given.times), np.array(given.intensities), axis))
    units = _UNITS[type(given)]
    numbers = [number(key, unit) for key, unit in units.items()]
    return named(name, lambda: _MAKERS[type(given)](*numbers, axis))


_UNITS: dict[type, dict[str, str]] = {
    GaussianSection: {"peak": "W/cm2", "fwhm": "ps", "centre": "ps"},
    SwitchedSection: {"peak": "W/cm2", "rise": "ps", "plateau": "ps", "fall": "ps", "start": "ps"},
    KickSection: {"fluence": "J/cm2", "time": "ps"},
}
_MAKERS: dict[type, Callable[..., Pulse]] = {
    GaussianSection: GaussianPulse, SwitchedSection: SwitchedPulse, KickSection: Kick,
}  # fmt: skip


def axis_of(given: str | list[list[float]]) -> Axis:
    """The unit vector of polarization that a word, or real and imaginary parts of its components, mean."""
    if isinstance(given, str):
        word, _, ratio = given.strip().lower().partition(":")
        if word in _AXES and not ratio:
            return polarization(_AXES[word])
        if word == "elliptical":
            return elliptical(float(ratio))
        raise ValueError(f"{given!r}: expected z, x, y, circular, or elliptical:R")
    if len(given) != 3 or any(len(parts) != 2 for parts in given):
        raise ValueError(f"{given}: expected real and imaginary parts of three components")
    x, y, z = (complex(*parts) for parts in given)
    if abs(abs(x) ** 2 + abs(y) ** 2 + abs(z) ** 2 - 1.0) > 1e-12:
        raise ValueError(f"{given}: expected a unit vector")
    return x, y, z


def answer(asked: AlignRequest, scene: AlignScene, out: Where, executor: Executor | None) -> AlignAnswer:
    """The cosines.

    Parameters
    ----------
    asked : AlignRequest
        The scene as the library takes it, checked.
    scene : AlignScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Its workers share the work.

    Returns
    -------
    AlignAnswer
        Cosines over time.
    """
    with kind.fields(**_NAMES):
        return answer_align(asked, executor)


def table(found: AlignAnswer) -> AlignmentTable:
    """All cosines against time."""
    return found.table


def writers(found: AlignAnswer, scene: AlignScene) -> Mapping[str, Writer]:
    """The picture of the cosines."""

    def plot(path: Path) -> None:
        from rotor.plots.alignment import plot_alignment

        title = found.trace.top.name
        plot_alignment(found.trace, path, classical=found.classical, title=title, provenance={})

    return {"plot": plot}


def saved(asked: AlignRequest, molecule: MoleculeSection | None) -> AlignScene:
    """The scene of a request."""
    assert molecule is not None
    first, last = (None if time is None else f"{time!r} ps" for time in (asked.from_ps, asked.until_ps))
    return AlignScene(
        molecule=molecule,
        pulses=[saved_pulse(pulse) for pulse in asked.pulses],
        conditions=AlignConditions(
            temperature=f"{asked.temperature_k!r} K",
            state=None if asked.state is None else dict(asked.state),
            m=asked.m,
            first_time=first,
            last_time=last,
            points=asked.points,
        ),
        observables=AlignObservables(cosines=list(asked.observables), classical_molecules=asked.classical_molecules),
        numerics=AlignNumerics(tolerance=asked.tolerance, jmax=asked.jmax, seed=asked.seed),
    )


def saved_pulse(pulse: Pulse) -> PulseSection:
    """The table of a pulse.

    Raises ValueError for a pulse whose shape is a function, which no file holds.
    """
    parts = [[complex(x).real, complex(x).imag] for x in pulse.axis]
    axis: str | list[list[float]] = "z" if pulse.axis == (0, 0, 1) else parts
    if isinstance(pulse, GaussianPulse):
        return GaussianSection(peak=pulse.peak_w_per_cm2, fwhm=pulse.fwhm_ps, centre=pulse.centre_ps, axis=axis)
    if isinstance(pulse, SwitchedPulse):
        numbers = {"peak": pulse.peak_w_per_cm2, "rise": pulse.rise_ps, "plateau": pulse.plateau_ps}
        return SwitchedSection(**numbers, fall=pulse.fall_ps, start=pulse.start_ps, axis=axis)
    if isinstance(pulse, Kick):
        return KickSection(fluence=pulse.fluence_j_per_cm2, time=pulse.time_ps, axis=axis)
    if isinstance(pulse, TabulatedPulse):
        times, values = (np.asarray(x).tolist() for x in (pulse.times_ps, pulse.intensities_w_per_cm2))
        return TableSection(times=times, intensities=values, axis=axis)
    if isinstance(pulse, DipolePulse) and pulse.shape is None and axis == "z":
        numbers = {"peak": pulse.peak_kv_per_cm, "fwhm": pulse.fwhm_ps, "frequency": pulse.frequency_thz}
        return FieldPulseSection(**numbers, phase=pulse.phase_rad, centre=pulse.centre_ps)
    raise ValueError(f"a scene holds no {type(pulse).__name__} of this form")


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
