"""Request for a rotational spectrum, and its answer: lines, their shape on a grid, the optical depth of a layer of gas.

The command line and scene files fill a `SpectrumRequest`; `answer_spectrum` computes all of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.checks import require_top
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.estimates.limits import all_limits, limit_facts
from rotor.quantum.hamiltonian_input import effects_field
from rotor.quantum.hyperfine_method import hyperfine_facts
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import check_fields, declared, identical, part
from rotor.requests.knob import Measure
from rotor.requests.readers import INFINITE, Flag, Quantity, Range, Text, Whole
from rotor.spectra.budgets import frequencies_budget
from rotor.spectra.intensity import USUAL_CUT, largest
from rotor.spectra.intensity_accuracy import cut_knob
from rotor.spectra.lines import DEFAULT_MIN_LGINT, Lines, line_list
from rotor.table import TextOf
from rotor.thermodynamics.sums.classical_limit import typical_j
from rotor.thermodynamics.sums.partition_table import partition_facts
from rotor.thermodynamics.vibration import VibrationalStates, missing_fundamentals
from rotor.thermodynamics.vibration_input import vibrations_field
from rotor.tops.constants.covariance import Covariance
from rotor.tops.facts import top_facts, without_constants

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.spectra.spectrum import Spectrum
    from rotor.tops.top import Top

PROFILES = ("sticks", "gaussian", "lorentzian", "voigt")
Q_TOO_SMALL, Q_TOO_LARGE = 0.9, 10.0  # ratio of a given Q to the sum, beyond which there is a note
NOTE_ERROR = 1e-5  # relative error of the sum in such a note, which has four digits; the classical limit often serves
NO_DIPOLE = "none: a rigid spherical top has no rotational lines"


@dataclass(frozen=True)
class GasLayer:
    """A layer of gas: partial pressure of the absorbing molecules in bar, length in cm."""

    pressure_bar: float = declared(
        None, Quantity("bar", above=0, metavar="P"), "Pressure of these molecules (bar), for optical depths; with the path",
        "conditions.pressure", example="1 mbar",
    )  # fmt: skip
    path_cm: float = declared(
        None,
        Quantity("cm", above=0, metavar="L"),
        "Length of the layer of gas (cm); with the pressure",
        "conditions.path",
        example="1 m",
    )

    def __post_init__(self) -> None:
        for name in ("pressure_bar", "path_cm"):
            if getattr(self, name) is None:
                raise ValueError(f"{name}: an optical depth needs it")
        check_fields(self)


COARSER_CUTS = (5.0, 4.0, 3.0, 2.0, 1.0, 0.0)  # settings of a sweep: decades above the cut of the scene
COARSE_CUTS = (-4.0, -6.0, -8.0, -10.0, -12.0)  # settings without a cut in the scene: log10 of the intensity
FINER_CUT = 2.0  # decades between the scene's cut and the reference


def intensity_left_out(answer: Any, reference: Any) -> float:
    """Percentage of the total intensity that a list lacks compared with a reference."""
    part, whole = (float(spectrum.lines.intensity_nm2_mhz.sum()) for spectrum in (answer, reference))
    return 100.0 * max(1.0 - part / whole, 0.0) if whole else 0.0


INTENSITY = Measure("integrated intensity", "%", intensity_left_out)
CUT = cut_knob(
    "min_lgint",
    lambda request: COARSE_CUTS if request.min_lgint is None else tuple(request.min_lgint + decades for decades in COARSER_CUTS),
    lambda request: None if request.min_lgint is None else request.min_lgint - FINER_CUT,
    INTENSITY, lambda cut, decades: cut - decades, "least intensity in the list, log10(nm² MHz)",
)  # fmt: skip


@dataclass(frozen=True)
class SpectrumRequest:
    """A spectrum to compute; fields are checked when the request is made.

    top: with its dipole; a spherical top needs none. temperature_k: for intensities. jmax: highest J; None: as the cut requires.
    min_lgint: log10 of nm² MHz below which lines are left out; None: all lines. range_mhz: first and last frequency.
    q: partition function instead of the summed one. vibrational_factor: multiplies Q; vibrations: states that give this factor instead.
    covariance: of the constants, for errors of frequencies. profile: sticks, gaussian, lorentzian or voigt; None: gaussian with a width
    or a layer, else sticks. fwhm_mhz: full width at half maximum; None: the Doppler width. layer: of gas, for optical depths.
    untrusted: as in `line_list`. effects: the Hamiltonian.
    """

    top: Top
    temperature_k: float = declared(
        300.0, Quantity("K", above=0, metavar="T"), "Temperature (K)", "conditions.temperature", common=True
    )
    jmax: int | None = declared(
        None, Whole(0), "Highest J; by default as the cut requires", "numerics.jmax", common=True, example=40
    )
    min_lgint: float | None = declared(
        DEFAULT_MIN_LGINT, Quantity(least=-300, most=300), "Least log10 of the intensity in nm² MHz; or 'none'",
        "observables.min_lgint", none="none", common=True, knob=CUT,
    )  # fmt: skip
    range_mhz: tuple[float, float] = declared(
        INFINITE,
        Range("MHz"),
        "First and last frequency, such as 0:2000GHz (MHz)",
        "conditions.range",
        common=True,
        example="2:18GHz",
    )
    q: float | None = declared(
        None,
        Quantity(above=0, metavar="Q"),
        "Partition function to use instead of the summed one",
        "observables.q",
        example=1000.0,
    )
    vibrational_factor: float = declared(
        1.0, Quantity(above=0), "Factor of Q for vibrations", "observables.vibrational_factor"
    )
    vibrations: VibrationalStates | None = vibrations_field()
    covariance: Covariance | None = None
    profile: str | None = declared(
        None,
        Text(PROFILES, "NAME"),
        "sticks, gaussian, lorentzian or voigt",
        "observables.profile",
        common=True,
        example="gaussian",
    )
    fwhm_mhz: float | None = declared(
        None, Quantity("MHz", above=0, metavar="W"), "Full width at half maximum (MHz); by default the Doppler width", "observables.fwhm",
        common=True, example="1 MHz",
    )  # fmt: skip
    layer: GasLayer | None = part(GasLayer, identical, identical, whole=True, why="an optical depth needs both")
    untrusted: bool = declared(
        False, Flag(), "Also list lines of levels beyond the reach of the constants", "observables.untrusted"
    )
    effects: tuple[QuantumEffect, ...] = effects_field()

    def __post_init__(self) -> None:
        require_top(self.top)
        check_fields(self)
        missing_fundamentals(self.top, self.vibrations)  # refuses too many
        first, last = self.range_mhz
        if not first < last:
            raise ValueError(f"range_mhz: {first:g} to {last:g} MHz: expected a range that rises")
        if self.vibrations is not None and self.vibrational_factor != 1.0:
            raise ValueError("vibrational_factor and vibrational energies: both multiply Q; give one of them")
        if self.top.dipole_abc_debye is None and self.top.kind != "spherical":
            raise ValueError(
                f"the dipole of {self.top.name or 'this top'} is not known; give one, in principal axes or in the input's frame"
            )
        self._check_shape()

    def _check_shape(self) -> None:
        if self.shape == "sticks" and self.fwhm_mhz is not None:
            raise ValueError("fwhm_mhz: sticks have no width; leave it out or choose another profile")
        if self.shape == "sticks" and self.layer is not None:
            raise ValueError("profile: an optical depth needs a width, and sticks have none; choose another profile")
        if self.shape in ("lorentzian", "voigt") and self.fwhm_mhz is None:
            raise ValueError(f"profile {self.shape}: expected the full width of the Lorentzian, fwhm_mhz")
        doppler = self.shape == "voigt" or (self.shape == "gaussian" and self.fwhm_mhz is None)
        if doppler and self.top.mass_u is None:
            raise ValueError(
                "a Doppler width needs a mass, which constants alone do not have; give fwhm_mhz, with another profile than voigt"
            )

    @property
    def shape(self) -> str:
        """The profile: as given, else gaussian with a width or a layer, else sticks."""
        if self.profile is not None:
            return self.profile
        return "sticks" if self.fwhm_mhz is None and self.layer is None else "gaussian"


@dataclass(frozen=True, repr=False)
class SpectrumAnswer(TextOf):
    """The lines of a request, and quantities derived from them."""

    shown = "lines"

    request: SpectrumRequest
    lines: Lines

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Limits of the lines, vibrations left out of Q, and a given Q that is far from the sum over levels."""
        stated, lines = self.request.q, self.lines
        limits = (*lines.warnings, *missing_fundamentals(self.request.top, self.request.vibrations))
        if stated is None or not lines.levels.has_named_constants:
            return limits
        try:
            expected = _expected_q(lines)
        except ValueError:  # the sum does not converge
            expected = None
        if expected is None:  # nothing to compare with
            return limits
        summed, estimated = expected
        if Q_TOO_SMALL * summed <= stated <= Q_TOO_LARGE * summed:
            return limits
        factor = f"intensities differ by a factor of {summed / stated:.3g}"
        sum_text = f"about {summed:.2g}" if estimated else f"{summed:.4g}"
        text = f"Q = {stated:g} is given where the sum over the levels is {sum_text}: {factor}"
        return (*limits, f"{text}; vibration makes Q larger, other spin weights change it by a whole number")

    @property
    def column_per_cm2(self) -> float | None:
        """Column density in 1/cm²; None without a layer."""
        layer = self.request.layer
        if layer is None:
            return None
        from rotor.spectra.opacity import column_density_per_cm2

        return column_density_per_cm2(layer.pressure_bar, layer.path_cm, self.lines.temperature_k)

    @cached_property
    def optical_depth(self) -> Floats | None:
        """Optical depth (lines,) at the centre of each line alone; None without a layer."""
        layer = self.request.layer
        if layer is None:
            return None
        from rotor.spectra.opacity import line_optical_depth

        shape: dict[str, Any] = {"profile": self.request.shape, "fwhm_mhz": self.request.fwhm_mhz}
        return line_optical_depth(self.lines, layer.pressure_bar, layer.path_cm, **shape)

    @cached_property
    def spectrum(self) -> Spectrum:
        """Cross section, or optical depth of the layer, on a grid that resolves each line."""
        if self.request.shape == "sticks":
            raise ValueError("profile: sticks have no profile; choose gaussian, lorentzian or voigt")
        from rotor.spectra.opacity import optical_depth
        from rotor.spectra.spectrum import Spectrum, resolving_grid

        first, last = self.request.range_mhz
        shape: dict[str, Any] = {"profile": self.request.shape, "fwhm_mhz": self.request.fwhm_mhz}
        lines = self._profile_lines(shape)
        grid = resolving_grid(lines, range_mhz=(first, last) if math.isfinite(last) else None, **shape)
        spectrum = replace(Spectrum.from_lines(lines, grid, **shape), lines=self.lines)
        layer = self.request.layer
        return spectrum if layer is None else optical_depth(spectrum, layer.pressure_bar, layer.path_cm)

    def _profile_lines(self, shape: Mapping[str, Any]) -> Lines:
        """The lines of the list, and lines outside a finite range whose wings reach into it."""
        from rotor.spectra.spectrum import reach_at

        first, last = self.request.range_mhz
        if type(self.request) is not SpectrumRequest or not math.isfinite(last):
            return self.lines
        below, above = reach_at((first, last), self.lines, **shape)
        wider = replace(self.request, range_mhz=(max(first - below, 0.0), last + above))
        return answer_spectrum(wider).lines

    def strongest(self, count: int) -> Ints:
        """Rows of the `count` most intense lines, in order of frequency."""
        return np.sort(largest(self.lines.intensity_nm2_mhz, count)) if count else np.zeros(0, dtype=np.int64)

    @property
    def jmax_source(self) -> str:
        """Reason for the highest J."""
        if self.request.jmax is not None:
            cut_short = self.lines.top.level_table is not None and self.lines.jmax < self.request.jmax
            return "the table of energies has no lines beyond it" if cut_short else "given"
        if self.request.min_lgint is None:
            return f"beyond it no line reaches an lgint of {USUAL_CUT:g}"
        return "beyond it no line reaches the cut"

    @property
    def typical_j(self) -> int:
        """The J at which effects are compared."""
        lines = self.lines
        return typical_j(lines.top, lines.temperature_k, lines.levels.rotational[lines.upper], lines.jmax)

    @property
    def why_no_lines(self) -> str:
        """Reason for an empty list; empty text otherwise."""
        if len(self.lines):
            return ""
        if self.lines.top.kind == "spherical":
            return "a rigid spherical top has none (the calculation has neither a field nor the dipole that distortion makes)"
        if not any(self.lines.top.dipole_abc_debye or ()):
            return "without a permanent dipole there is no rotational absorption"
        return "no allowed line is inside the range and above the cut; widen the range or lower the cut"

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the frequencies."""
        lines = self.lines
        named = lines.levels.has_named_constants
        limits = all_limits(lines.top, self.typical_j, lines.levels.effects, tabulated=lines.tabulated) if named else ()
        return frequencies_budget(lines.levels, limits, lines.intensity_nm2_mhz, lines.error_mhz, lines.errors_from)

    def facts(self) -> dict[str, Any]:
        """All content except the table of lines, by the keys of docs/verbs."""
        lines, layer = self.lines, self.request.layer
        facts = {
            **top_facts(lines.top),
            "constants_reason": None,
            "temperature_k": lines.temperature_k,
            "q": partition_facts(lines.top, lines.partition, lines.levels.effects),
            "jmax": lines.jmax,
            "jmax_source": self.jmax_source,
            "min_lgint": self.request.min_lgint,
            "range_mhz": lines.range_mhz,
            "line_count": len(lines),
            "profile": self.request.shape,
            "fwhm_mhz": self.request.fwhm_mhz,
            "pressure_bar": layer.pressure_bar if layer else None,
            "path_cm": layer.path_cm if layer else None,
            "column_per_cm2": self.column_per_cm2,
            "optical_depth": self.optical_depth,
            "hyperfine": hyperfine_facts(lines.top, lines.levels),
            "notes": [*lines.top.notes, *self.notes],
            **limit_facts(lines.top, self.typical_j, lines.levels.effects),
            "errors": self.errors.as_json(),
        }
        if lines.levels.has_named_constants:
            return facts
        return without_constants(facts) | {"q": facts["q"] | {"classical": None}, "limits": []}


def _expected_q(lines: Lines) -> tuple[float, bool] | None:
    """Q summed over the levels, and whether it is estimated; None with two equivalent nuclei, where both would take long.

    Q = Q_0 n Σ_v e^(-E_v/kT) w_v/w_0 with the levels of state 0 without spins, E_v the energy of a state, w_v its mean spin weight,
    and n the number of spin functions; with three equivalent nuclei a third of n, since one in three exists with a function of the
    rotation. Constants of the other states, couplings and splittings change Q far less than the tenth that gives a note.
    """
    from rotor.thermodynamics.sums.partition import partition_function

    top, effects, kelvin = lines.top, lines.levels.effects, lines.temperature_k
    state_effects = [effect for effect in effects if effect.states(top)]
    others = tuple(effect for effect in effects if effect not in state_effects and not effect.spins(top))
    if len(others) == len(effects):
        return partition_function(top, kelvin, NOTE_ERROR, effects).q, False
    from rotor.quantum.spins.scheme import scheme_of

    scheme = scheme_of(top, effects)
    if scheme.equivalent == 2:  # the weights of the rotation decide which functions exist
        return None
    bare = replace(top, states=None, spin_constants=None, level_table=None, symmetry_checked=False)
    first, sums = partition_function(bare, kelvin, NOTE_ERROR, others).q, 1.0
    for effect in state_effects:
        values = effect.parameters(top)
        for state in effect.states(top):
            energy = state.operators(values).get((0, 0, 0), 0.0)
            weight = 1.0 if state.spin_weights is None else state.spin_weights.mean / top.spin_weights.mean
            sums += weight * math.exp(-energy / (units.MHZ_PER_K * kelvin))
    # equivalent nuclei: the functions of each symmetry are counted by the weights
    functions = math.prod(twice + 1 for twice in scheme.twice) / max(scheme.equivalent, 1)
    return functions * first * sums, True


def answer_spectrum(
    request: SpectrumRequest, executor: Executor | None = None, most_lines: float = math.inf
) -> SpectrumAnswer:
    """The lines of a request. executor: shares the work over J. most_lines: with a cut, TooManyLinesError beyond them.

    Raises ValueError if no answer is reached, as for a partition function that does not converge.

    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0))
    >>> answer = answer_spectrum(SpectrumRequest(top, jmax=2))
    >>> [round(float(f), 3) for f in answer.lines.frequency_mhz], answer.jmax_source
    ([115271.936, 230543.872], 'given')
    """
    top = request.top
    if top.dipole_abc_debye is None:  # a spherical top: the request refuses others without a dipole
        top = top.with_dipole((0.0, 0.0, 0.0), NO_DIPOLE)
    lines = line_list(
        top,
        temperature_k=request.temperature_k,
        jmax=request.jmax,
        min_lgint=request.min_lgint,
        range_mhz=request.range_mhz,
        q=request.q,
        vibrational_factor=request.vibrational_factor,
        vibrations=request.vibrations,
        covariance=request.covariance,
        untrusted=request.untrusted,
        effects=request.effects,
        executor=executor,
        most_lines=most_lines,
    )
    return SpectrumAnswer(request, lines)
