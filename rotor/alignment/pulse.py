"""Pulses that align or orient molecules, and how strongly they act.

A non-resonant pulse of intensity I(t) and unit polarization e acts, averaged over its optical cycle, by

    V(t) = -¼ ε(t)² e*·α·e = -(2π I(t)/c) α'_FG Re(e_F* e_G),     ε² = 2I/(ε0 c),  α' the polarizability volume,

that is U0/ħ = 1.98739 rad/ps for 1 Å³ of anisotropy and 1e12 W/cm² (B. Friedrich and D. Herschbach, Phys. Rev. Lett. 74, 4623
(1995)). The factor ¼ holds one ½ for the induced dipole and one for the mean of cos². A half-cycle or THz pulse acts on the
permanent dipole instead, V(t) = -μ·E(t), with 503.41 MHz for 1 D and 1 kV/cm (`DipolePulse`).

Averaging over the cycle is safe for light far from resonance: with the carrier of 800 nm resolved the cosines of OCS differ by
less than 1e-7.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats
from rotor.checks import Renamed
from rotor.quantum.fields.inputs import INTENSITY
from rotor.requests.choices import Choices
from rotor.requests.field import REQUIRED, all_fields, check_fields, declared
from rotor.requests.fill import within
from rotor.requests.lists import Numbers
from rotor.requests.readers import Custom, Quantity

Axis = tuple[complex, complex, complex]

Z_AXIS: Axis = (0.0, 0.0, 1.0)
HIGHEST_KV_PER_CM = 1e6  # 10 V/Å: molecules are ionised below 1 V/Å; models of kicks may go beyond that
# 2π I/(cħ) in rad/ps for 1 Å³ and 1 W/cm²; Å³ → m³ 1e-30, W/cm² → W/m² 1e4, 1/s → 1/ps 1e-12
RAD_PER_PS_ANGSTROM3_W_PER_CM2 = (
    2 * math.pi * 1e-30 * 1e4 / (units.SPEED_OF_LIGHT_M_PER_S * units.PLANCK_J_S / (2 * math.pi)) * 1e-12
)
RAD_PER_PS_MHZ = 2 * math.pi * 1e-6
DEFAULT_TOLERANCE = 1e-6  # of cosines
GAUSSIAN_REACH = 3.5  # widths on either side of the middle; the intensity there is 2e-15 of the peak
FIELD_REACH = 3.0  # widths of a field envelope: exp(-4 ln2 · 9) = 1.5e-11


_AXES = {"z": (0, 0, 1), "x": (1, 0, 0), "y": (0, 1, 0), "circular": (1, 1j, 0)}


def read_axis(axis_text: Any) -> Axis:
    """The unit polarization vector from a word, or from real and imaginary parts of its components.

    >>> round(float(read_axis("circular")[0].real), 12) == round(2**-0.5, 12)
    True
    """
    if isinstance(axis_text, str):
        word, _, ratio = axis_text.strip().lower().partition(":")
        if word in _AXES and not ratio:
            return polarization(_AXES[word])
        if word == "elliptical":
            try:
                return elliptical(float(ratio))
            except ValueError:
                pass
        raise ValueError(f"{axis_text!r}: expected z, x, y, circular, or elliptical:R with R of 0 or more")
    if len(axis_text) != 3 or any(len(parts) != 2 for parts in axis_text):
        raise ValueError(f"{axis_text}: expected real and imaginary parts of three components")
    x, y, z = (complex(*parts) for parts in axis_text)
    if abs(abs(x) ** 2 + abs(y) ** 2 + abs(z) ** 2 - 1.0) > 1e-12:
        raise ValueError(f"{axis_text}: expected a unit vector")
    return x, y, z


def write_axis(axis: Axis) -> str | list[list[float]]:
    """The inverse of `read_axis`."""
    return "z" if axis == Z_AXIS else [[complex(x).real, complex(x).imag] for x in axis]


def axis_field() -> Any:
    """The field of the polarization of a pulse of light."""
    reader = Custom(read_axis, write_axis, "NAME", str | list[list[float]])
    return declared(Z_AXIS, reader, "z, x, y, circular, elliptical:R, or parts of a unit vector", "axis", typed="z")


class Pulse(ABC):
    """A pulse: its time window, polarization, and the molecular property on which it acts."""

    acts_on: ClassVar[str]  # "polarizability" or "dipole"

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "axis", polarization(self.axis))

    @property
    @abstractmethod
    def window_ps(self) -> tuple[float, float]:
        """Begin and end of the pulse, which is exactly zero outside; equal for a kick."""

    @property
    def breaks_ps(self) -> tuple[float, ...]:
        """Times inside the window at which the pulse is not smooth."""
        return ()

    @property
    @abstractmethod
    def axis(self) -> Axis:
        """Unit polarization vector, complex for elliptical light."""

    @abstractmethod
    def strength(self, times_ps: Floats) -> Floats:
        """Rad/ps for 1 Å³ (`polarizability`) or for 1 D (`dipole`) at times inside the window."""

    @property
    def space_tensor(self) -> Floats:
        """Re(e_F* e_G) (3, 3) for light; the unit vector (3,) for a field that acts on the dipole."""
        axis = np.array(self.axis)
        return axis.real if self.acts_on == "dipole" else np.outer(axis.conj(), axis).real


def polarization(axis: ArrayLike) -> Axis:
    """A unit vector from the components along X, Y, Z: (0, 0, 1) linear, (1, 1j, 0) circular, (1, 0, 1j·√3) elliptical.

    >>> polarization([0, 0, 2])
    (0j, 0j, (1+0j))
    """
    vector = np.asarray(axis, dtype=np.complex128)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not np.abs(vector).max() > 0:
        raise ValueError(f"polarization: expected three finite components along X, Y, Z, not all 0; got {axis!r}")
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return x, y, z


def elliptical(ratio: float) -> Axis:
    """Light with I_X : I_Z = `ratio` : 1 and a phase of 90°; 0 is linear along Z, 1 circular in the XZ plane.

    >>> round(abs(elliptical(1 / 3)[2]) ** 2, 12)  # of the whole intensity
    0.75
    """
    if not (math.isfinite(ratio) and ratio >= 0):
        raise ValueError(f"ratio of intensities {ratio}: a finite number of 0 or more is expected")
    return polarization([1j * math.sqrt(ratio), 0, 1])


@dataclass(frozen=True)
class GaussianPulse(Pulse):
    """I(t) = I0 exp(-4 ln2 (t-t0)²/τ²): `fwhm_ps` is the full width at half maximum of the intensity.

    >>> pulse = GaussianPulse(1e13, 0.05)
    >>> round(float(pulse.strength(np.array([0.0]))[0]) * 4.04, 3)  # rad/ps for OCS
    80.291
    """

    acts_on: ClassVar[str] = "polarizability"

    peak_w_per_cm2: float = declared(REQUIRED, INTENSITY, "Peak intensity (W/cm2)", "peak", example="1e13 W/cm2")
    fwhm_ps: float = declared(
        REQUIRED, Quantity("ps", above=0), "Full width at half maximum of the intensity (ps)", "fwhm", example="1 ps"
    )
    centre_ps: float = declared(0.0, Quantity("ps"), "Time of the peak (ps)", "centre")
    axis: Axis = axis_field()

    @property
    def window_ps(self) -> tuple[float, float]:
        """3.5 widths on either side, where the intensity is 2e-15 of the peak."""
        return self.centre_ps - GAUSSIAN_REACH * self.fwhm_ps, self.centre_ps + GAUSSIAN_REACH * self.fwhm_ps

    def strength(self, times_ps: Floats) -> Floats:
        """Rad/ps for 1 Å³."""
        shape = np.exp(-4 * math.log(2) * ((times_ps - self.centre_ps) / self.fwhm_ps) ** 2)
        return np.asarray(RAD_PER_PS_ANGSTROM3_W_PER_CM2 * self.peak_w_per_cm2 * shape)


@dataclass(frozen=True)
class SwitchedPulse(Pulse):
    """Rises as sin² in `rise_ps`, stays for `plateau_ps`, falls as cos² in `fall_ps`; 0 is a sudden switch.

    `start_ps` is its begin. After a slow rise and a sudden fall, pendular states dephase without field.
    """

    acts_on: ClassVar[str] = "polarizability"

    peak_w_per_cm2: float = declared(REQUIRED, INTENSITY, "Peak intensity (W/cm2)", "peak", example="1e12 W/cm2")
    rise_ps: float = declared(REQUIRED, Quantity("ps", least=0), "Rise (ps)", "rise", example="1 ps")
    plateau_ps: float = declared(REQUIRED, Quantity("ps", least=0), "Plateau (ps)", "plateau", example="10 ps")
    fall_ps: float = declared(REQUIRED, Quantity("ps", least=0), "Fall (ps)", "fall", example="1 ps")
    start_ps: float = declared(0.0, Quantity("ps"), "Where it begins (ps)", "start")
    axis: Axis = axis_field()

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.rise_ps + self.plateau_ps + self.fall_ps > 0:
            raise ValueError("rise_ps, plateau_ps, fall_ps: 0 ps in all: expected a finite time above 0")

    @property
    def breaks_ps(self) -> tuple[float, ...]:
        """The ends of the rise and of the plateau."""
        full = self.start_ps + self.rise_ps
        return full, full + self.plateau_ps

    @property
    def window_ps(self) -> tuple[float, float]:
        """From the start to the end of the fall."""
        return self.start_ps, self.start_ps + self.rise_ps + self.plateau_ps + self.fall_ps

    def strength(self, times_ps: Floats) -> Floats:
        """Rad/ps for 1 Å³."""
        first, last = self.window_ps
        rising = (times_ps - first) / self.rise_ps if self.rise_ps else np.ones_like(times_ps)
        falling = (last - times_ps) / self.fall_ps if self.fall_ps else np.ones_like(times_ps)
        share = np.clip(np.minimum(rising, falling), 0.0, 1.0)
        return np.asarray(RAD_PER_PS_ANGSTROM3_W_PER_CM2 * self.peak_w_per_cm2 * np.sin(0.5 * math.pi * share) ** 2)


@dataclass(frozen=True)
class TabulatedPulse(Pulse):
    """Intensities at given times, joined by a monotone cubic curve (PCHIP), zero outside."""

    acts_on: ClassVar[str] = "polarizability"

    times_ps: ArrayLike = declared(REQUIRED, Numbers("ps"), "Times (ps)", "times", example=[0.0, 1.0])
    intensities_w_per_cm2: ArrayLike = declared(
        REQUIRED, Numbers("W/cm2"), "Intensities (W/cm2)", "intensities", example=[0.0, 1e12]
    )
    axis: Axis = axis_field()

    def __post_init__(self) -> None:
        times, values = (np.array(a, dtype=np.float64) for a in (self.times_ps, self.intensities_w_per_cm2))
        if times.ndim != 1 or times.shape != values.shape or len(times) < 2:
            raise ValueError(
                f"table of a pulse: expected as many intensities as times, 2 or more; got {times.shape}, {values.shape}"
            )
        if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise ValueError("times_ps: expected finite times that rise")
        with within("intensities_w_per_cm2"):
            for value in (values.min(), values.max()):
                INTENSITY.check(float(value))
        object.__setattr__(self, "times_ps", times)
        object.__setattr__(self, "intensities_w_per_cm2", values)
        super().__post_init__()

    @property
    def breaks_ps(self) -> tuple[float, ...]:
        """The times of the table, where the curve's second derivative jumps."""
        return tuple(np.asarray(self.times_ps).tolist()[1:-1])

    @property
    def window_ps(self) -> tuple[float, float]:
        """From the first to the last time."""
        times = np.asarray(self.times_ps)
        return float(times[0]), float(times[-1])

    def strength(self, times_ps: Floats) -> Floats:
        """Rad/ps for 1 Å³."""
        from scipy.interpolate import PchipInterpolator

        curve = PchipInterpolator(np.asarray(self.times_ps), np.asarray(self.intensities_w_per_cm2))
        return np.asarray(RAD_PER_PS_ANGSTROM3_W_PER_CM2 * curve(times_ps))


@dataclass(frozen=True)
class Kick(Pulse):
    """A pulse so short that the molecule does not rotate during it: exp(i P cos²θ), P = ∫ U0 dt/ħ for 1 Å³ of anisotropy.

    fluence_j_per_cm2 = ∫ I dt. The error for a Gaussian pulse is proportional to its width: for OCS with P = 4.3
    it is 3e-4 in the cosine for 10 fs and 1.5e-3 for 50 fs.

    >>> kick = Kick.from_strength(5.0, anisotropy_angstrom3=4.04)
    >>> round(float(kick.area * 4.04), 12)
    5.0
    """

    acts_on: ClassVar[str] = "polarizability"

    fluence_j_per_cm2: float = declared(
        REQUIRED, Quantity("J/cm2", least=0), "Fluence (J/cm2)", "fluence", example="0.1 J/cm2"
    )
    time_ps: float = declared(0.0, Quantity("ps"), "Time (ps)", "time")
    axis: Axis = axis_field()

    @classmethod
    def from_strength(cls, p: float, anisotropy_angstrom3: float, time_ps: float = 0.0) -> Kick:
        """The kick with P = `p` for a linear molecule with this polarizability anisotropy."""
        return cls(p / (anisotropy_angstrom3 * RAD_PER_PS_ANGSTROM3_W_PER_CM2) * 1e-12, time_ps)

    of_strength = Renamed("from_strength")

    @property
    def area(self) -> float:
        """∫ strength dt, in rad for 1 Å³; 1 J/cm² is 1e12 W/cm² for 1 ps."""
        return RAD_PER_PS_ANGSTROM3_W_PER_CM2 * self.fluence_j_per_cm2 * 1e12

    @property
    def window_ps(self) -> tuple[float, float]:
        """The time of the kick, twice."""
        return self.time_ps, self.time_ps

    def strength(self, times_ps: Floats) -> Floats:
        """A kick has no finite strength: its area counts."""
        raise ValueError("a kick has an area, not a strength at a time")


@dataclass(frozen=True)
class DipolePulse(Pulse):
    """A field that acts on the permanent dipole: E(t) = E0 exp(-4 ln2 (t-t0)²/τ²) cos(2πν(t-t0) + φ).

    `fwhm_ps` is the full width of the field's envelope; ν = 0 is a half-cycle pulse. `shape`, a function of times in ps that
    returns kV/cm, replaces the formula; the window is then that of the formula.
    """

    acts_on: ClassVar[str] = "dipole"

    peak_kv_per_cm: float = declared(
        REQUIRED,
        Quantity("kV/cm", least=-HIGHEST_KV_PER_CM, most=HIGHEST_KV_PER_CM),
        "Peak field (kV/cm)",
        "peak",
        example="100 kV/cm",
    )
    fwhm_ps: float = declared(
        REQUIRED, Quantity("ps", above=0), "Full width of the envelope (ps)", "fwhm", example="1 ps"
    )
    frequency_thz: float = declared(0.0, Quantity("THz", least=0), "Frequency (THz)", "frequency")
    phase_rad: float = declared(0.0, Quantity(), "Phase (rad)", "phase")
    centre_ps: float = declared(0.0, Quantity("ps"), "Middle of the envelope (ps)", "centre")
    axis: Axis = Z_AXIS
    shape: Callable[[Floats], Floats] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.array(self.axis).imag.any():
            raise ValueError(f"a field that acts on the dipole has a real direction; got {self.axis}")

    @property
    def window_ps(self) -> tuple[float, float]:
        """Three widths on either side, where the envelope is 1.5e-11 of the peak."""
        return self.centre_ps - FIELD_REACH * self.fwhm_ps, self.centre_ps + FIELD_REACH * self.fwhm_ps

    def strength(self, times_ps: Floats) -> Floats:
        """Rad/ps for 1 D."""
        if self.shape is not None:
            return np.asarray(RAD_PER_PS_MHZ * units.MHZ_PER_DEBYE_KV_PER_CM * np.asarray(self.shape(times_ps)))
        late = times_ps - self.centre_ps
        envelope = np.exp(-4 * math.log(2) * (late / self.fwhm_ps) ** 2)
        field = self.peak_kv_per_cm * envelope * np.cos(2 * math.pi * self.frequency_thz * late + self.phase_rad)
        return np.asarray(RAD_PER_PS_MHZ * units.MHZ_PER_DEBYE_KV_PER_CM * field)


SHAPES: dict[str, type[Pulse]] = {
    "gaussian": GaussianPulse,
    "switched": SwitchedPulse,
    "kick": Kick,
    "table": TabulatedPulse,
    "thz": DipolePulse,
}  # by their names in scenes

IN_ORDER = {
    "gaussian": ("peak", "fwhm", "centre"),
    "switched": ("peak", "rise", "plateau", "fall", "start"),
    "kick": ("fluence", "time"),
    "thz": ("peak", "fwhm", "frequency", "centre"),
}  # the order of the numbers of a shape in a text


def pulse_of_numbers(shape: str, text: str, **others: Any) -> Pulse:
    """A pulse of a shape from numbers separated by commas; others: further fields.

    >>> pulse_of_numbers("kick", "0.5 J/cm2, 2").fluence_j_per_cm2
    0.5
    """
    fields: dict[str, Any] = {field.key: field for field in all_fields(SHAPES[shape]).values()}
    keys, parts = IN_ORDER[shape], [part.strip() for part in text.split(",")]
    least, units = sum(fields[key].default is REQUIRED for key in keys), [fields[key].reader.unit for key in keys]
    if not least <= len(parts) <= len(keys):
        count = f"{least}" if least == len(keys) else f"{least} to {len(keys)}"
        named = ", ".join(f"{key} ({unit})" for key, unit in zip(keys, units, strict=True))
        raise ValueError(f"{text!r}: expected {count} numbers with commas between: {named}; found {len(parts)}")
    values = {fields[key].name: fields[key].read(part, "key") for key, part in zip(keys, parts, strict=False)}
    return SHAPES[shape](**values, **others)


class PulseReader(Choices):
    """Reader of pulses: also texts of numbers, `1e13 W/cm2, 1 ps` of a Gaussian pulse or `kick 0.5 J/cm2` of a named shape."""

    def _read_line(self, line: str) -> Any:
        word, _, numbers = line.strip().partition(" ")
        if "=" in line:
            return super()._read_line(line)
        if word in IN_ORDER and numbers:
            return pulse_of_numbers(word, numbers)
        return pulse_of_numbers("gaussian", line) if word[:1] in "0123456789.+-" else super()._read_line(line)


PULSES = PulseReader("shape", lambda: SHAPES)
