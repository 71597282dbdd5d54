"""A request for a rotational spectrum, and what answers it: lines, their shape on a grid, the depth of a layer of gas.

The command line and scene files fill a `SpectrumRequest`; `answer_spectrum` is the one function behind all of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.checks import require_one_of, require_positive, require_top, require_whole
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.limits import limit_facts, populated_j
from rotor.quantum.spins.method import hyperfine_facts
from rotor.spectra.intensity import USUAL_CUT, largest
from rotor.spectra.lines import DEFAULT_MIN_LGINT, Lines, line_list
from rotor.table import TextOf
from rotor.thermodynamics import VibrationalStates
from rotor.thermodynamics.partition_table import partition_facts
from rotor.tops.covariance import Covariance
from rotor.tops.facts import top_facts, without_constants

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.spectra.spectrum import Spectrum
    from rotor.tops.top import Top

PROFILES = ("sticks", "gaussian", "lorentzian", "voigt")
NO_DIPOLE = "none: a rigid spherical top has no rotational lines"


@dataclass(frozen=True)
class GasLayer:
    """A layer of gas: partial pressure of the molecules meant in bar, length in cm."""

    pressure_bar: float
    path_cm: float

    def __post_init__(self) -> None:
        require_positive("pressure_bar", self.pressure_bar)
        require_positive("path_cm", self.path_cm)


@dataclass(frozen=True)
class SpectrumRequest:
    """A spectrum to compute; every field is checked when the request is made.

    top: with its dipole; a spherical one needs none. temperature_k: of the intensities. jmax: the highest J; None: what the
    cut needs. min_lgint: log10 of nm² MHz below which lines are left out; None: every allowed line. range_mhz: first and last
    frequency. q: partition function instead of the summed one. vibrational_factor: multiplies Q; vibrations: states whose
    factor does so instead. covariance: of the constants, for the errors of frequencies. profile: sticks, gaussian, lorentzian
    or voigt; None: gaussian where there is a width or a layer, else sticks. fwhm_mhz: full width at half maximum; None:
    Doppler's. layer: of gas, for optical depths. untrusted: as in `line_list`. effects: what the Hamiltonian consists of.
    """

    top: Top
    temperature_k: float = 300.0
    jmax: int | None = None
    min_lgint: float | None = DEFAULT_MIN_LGINT
    range_mhz: tuple[float, float] = (0.0, math.inf)
    q: float | None = None
    vibrational_factor: float = 1.0
    vibrations: VibrationalStates | None = None
    covariance: Covariance | None = None
    profile: str | None = None
    fwhm_mhz: float | None = None
    layer: GasLayer | None = None
    untrusted: bool = False
    effects: tuple[QuantumEffect, ...] = SEMI_RIGID

    def __post_init__(self) -> None:
        require_top(self.top)
        require_positive("temperature_k", self.temperature_k)
        require_whole("jmax", self.jmax, 0)
        require_positive("vibrational_factor", self.vibrational_factor)
        for name in ("q", "fwhm_mhz"):
            if getattr(self, name) is not None:
                require_positive(name, getattr(self, name))
        if self.min_lgint is not None and not math.isfinite(self.min_lgint):
            raise ValueError(f"min_lgint: {self.min_lgint}: expected a finite number, or None for every allowed line")
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
        require_one_of("profile", self.shape, PROFILES)
        if self.shape == "sticks" and self.fwhm_mhz is not None:
            raise ValueError("fwhm_mhz: sticks have no width; leave it out or choose another profile")
        if self.shape == "sticks" and self.layer is not None:
            raise ValueError("profile: an optical depth needs a width, and sticks have none; choose another one")
        if self.shape in ("lorentzian", "voigt") and self.fwhm_mhz is None:
            raise ValueError(f"profile {self.shape}: expected the full width of the Lorentzian, fwhm_mhz")
        doppler = self.shape == "voigt" or (self.shape == "gaussian" and self.fwhm_mhz is None)
        if doppler and self.top.mass_u is None:
            raise ValueError(
                "a Doppler width needs a mass, which constants alone do not have; give fwhm_mhz, and not the profile voigt"
            )

    @property
    def shape(self) -> str:
        """The profile: as given, else gaussian where there is a width or a layer of gas, else sticks."""
        if self.profile is not None:
            return self.profile
        return "sticks" if self.fwhm_mhz is None and self.layer is None else "gaussian"


@dataclass(frozen=True, repr=False)
class SpectrumAnswer(TextOf):
    """The lines that a request asked for, and what follows from them."""

    shown = "lines"

    request: SpectrumRequest
    lines: Lines

    @property
    def column_per_cm2(self) -> float | None:
        """Molecules in the line of sight, 1/cm²; None without a layer."""
        layer = self.request.layer
        if layer is None:
            return None
        from rotor.spectra.opacity import column_density_per_cm2

        return column_density_per_cm2(layer.pressure_bar, layer.path_cm, self.lines.temperature_k)

    @cached_property
    def optical_depth(self) -> Floats | None:
        """Optical depth (lines,) at the centre of every line, as if it were alone; None without a layer."""
        layer = self.request.layer
        if layer is None:
            return None
        from rotor.spectra.opacity import line_optical_depth

        shape: dict[str, Any] = {"profile": self.request.shape, "fwhm_mhz": self.request.fwhm_mhz}
        return line_optical_depth(self.lines, layer.pressure_bar, layer.path_cm, **shape)

    @cached_property
    def spectrum(self) -> Spectrum:
        """The lines with their shape on a grid that resolves each: a cross section, or the optical depth of the layer."""
        if self.request.shape == "sticks":
            raise ValueError("profile: sticks have no profile; choose gaussian, lorentzian or voigt")
        from rotor.spectra.opacity import optical_depth
        from rotor.spectra.spectrum import Spectrum, resolving_grid

        first, last = self.request.range_mhz
        shape: dict[str, Any] = {"profile": self.request.shape, "fwhm_mhz": self.request.fwhm_mhz}
        grid = resolving_grid(self.lines, range_mhz=(first, last) if math.isfinite(last) else None, **shape)
        made = Spectrum.from_lines(self.lines, grid, **shape)
        layer = self.request.layer
        return made if layer is None else optical_depth(made, layer.pressure_bar, layer.path_cm)

    def strongest(self, count: int) -> Ints:
        """Rows of the `count` most intense lines, in order of frequency."""
        return np.sort(largest(self.lines.intensity_nm2_mhz, count)) if count else np.zeros(0, dtype=np.int64)

    @property
    def jmax_source(self) -> str:
        """How the highest J was chosen."""
        if self.request.jmax is not None:
            return "given"
        if self.request.min_lgint is None:
            return f"beyond it no line reaches an lgint of {USUAL_CUT:g}"
        return "beyond it no line reaches the cut"

    @property
    def typical_j(self) -> int:
        """The J at which effects are compared: the most populated one, as far as the list goes."""
        return min(populated_j(self.lines.top, self.lines.temperature_k), max(self.lines.jmax, 1))

    @property
    def why_no_lines(self) -> str:
        """Why the list is empty; nothing where it is not."""
        if len(self.lines):
            return ""
        if self.lines.top.kind == "spherical":
            return "a rigid spherical top has none (the calculation has neither a field nor the dipole that distortion makes)"
        if not any(self.lines.top.dipole_abc_debye or ()):
            return "without a permanent dipole there is no rotational absorption"
        return "none of the allowed ones is inside the range and above the cut; widen the range or lower the cut"

    def facts(self) -> dict[str, Any]:
        """Everything about the answer but its table of lines, by the keys of docs/command_line.md."""
        lines, layer = self.lines, self.request.layer
        found = {
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
            "notes": [*lines.top.notes, *lines.warnings],
            **limit_facts(lines.top, self.typical_j, lines.levels.effects),
        }
        if lines.levels.of_named_constants:
            return found
        return without_constants(found) | {"q": found["q"] | {"classical": None}, "limits": []}


def answer_spectrum(request: SpectrumRequest, executor: Executor | None = None) -> SpectrumAnswer:
    """The lines of a request. executor: J are spread over it.

    Raises ValueError where no answer is reached, such as a partition function that does not converge.

    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0))
    >>> answer = answer_spectrum(SpectrumRequest(top, jmax=2))
    >>> [round(float(f), 3) for f in answer.lines.frequency_mhz], answer.jmax_source
    ([115271.936, 230543.872], 'given')
    """
    top = request.top
    if top.dipole_abc_debye is None:  # a spherical top, see the check of the request
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
    )
    return SpectrumAnswer(request, lines)
