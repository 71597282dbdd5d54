"""The spectrum of a top in a static electric field: lines resolved in M, for light of a given polarization.

Every pair of states that the dipole connects is a line, ΔM = 0 for the part of the light that is polarized along the field, ΔM = ±1
for the part across it. The strength is scaled so that its mean over all directions of polarization is the S μ² of a catalogue:

    S(β) = 3 Σ [cos²β |⟨μ_Z⟩|² + ½ sin²β |⟨μ_±1⟩|²],      isotropic light: Σ [|⟨μ_Z⟩|² + |⟨μ_±1⟩|²]

(β between polarization and field; the sum is over the pairs that coincide, M with -M). Circular light along the field is like light
across it.
Intensities are those of `intensity`: 8π³/3hc ν S (p″ - p′), with p the population of one state.
"""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.checks import require_one_of, require_positive
from rotor.quantum.effects.stark import map_request
from rotor.quantum.fields.block_states import BlockStates, block_states
from rotor.quantum.fields.field_map import converged_jmax, each_block
from rotor.quantum.fields.transitions import BlockPair, dipole_elements, pairs_of_blocks
from rotor.spectra.intensity import INTENSITY_NM2_MHZ
from rotor.table import Table
from rotor.thermo.field_mixture import POPULATIONS, Populations, populations_in_field

if TYPE_CHECKING:
    from rotor.tops.top import Top

LIGHT = {"parallel": 0.0, "perpendicular": 90.0, "isotropic": None}
DEFAULT_TOLERANCE_MHZ = 1e-4
LEAST_STRENGTH = 1e-10  # of the strongest line: what round-off leaves of forbidden ones is below


@dataclass(frozen=True, eq=False, repr=False)
class FieldLines(Table):
    """Lines in a field as columns of equal length: all fields of one pair of states after each other.

    frequency_mhz: E′ - E″, the upper state being the higher one at the last field: below 0 where they have crossed. shift_mhz: from the
    line of the free top. strength_debye2, intensity_nm2_mhz: for the light given, all coinciding pairs together. upper, lower: labels of
    the free levels; upper_m, lower_m: |M|. lower_mhz: E″.
    """

    top: Top
    light: str
    temperature_k: float
    populations: str
    field_kv_per_cm: Floats
    frequency_mhz: Floats
    shift_mhz: Floats
    strength_debye2: Floats
    intensity_nm2_mhz: Floats
    upper: NDArray[np.str_]
    upper_m: Ints
    lower: NDArray[np.str_]
    lower_m: Ints
    lower_mhz: Floats
    jmax: int
    accuracy_mhz: float
    q: Floats = field(repr=False)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Every column by its name with unit."""
        names = (
            "field_kv_per_cm", "frequency_mhz", "shift_mhz", "strength_debye2", "intensity_nm2_mhz", "upper", "upper_m", "lower",
            "lower_m", "lower_mhz",
        )  # fmt: skip
        return {name: getattr(self, name) for name in names}

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @property
    def provenance(self) -> dict[str, Any]:
        """Light, temperature, populations, Q at every field, and what was found about accuracy."""
        return {
            "dipole_abc_debye": self.top.dipole_abc_debye,
            "light": self.light,
            "temperature_k": self.temperature_k,
            "populations": self.populations,
            "q": self.q.tolist(),
            "jmax": self.jmax,
            "accuracy_mhz": self.accuracy_mhz,
        }

    @property
    def fields(self) -> Floats:
        """The fields, each once."""
        return np.unique(self.field_kv_per_cm)

    def pairs(self) -> list[slice]:
        """Rows of each pair of states, all fields in order."""
        count = len(self.fields)
        return [slice(first, first + count) for first in range(0, len(self), count)]

    def lobes(self, upper: str, lower: str) -> FieldLines:
        """The lines of one free line alone: its M components, called lobes where a field is switched on and off.

        Raises ValueError where there are none.
        """
        chosen = ((self.upper == upper) & (self.lower == lower)) | ((self.upper == lower) & (self.lower == upper))
        if not chosen.any():
            known = sorted({f"{a} - {b}" for a, b in zip(self.upper, self.lower, strict=True)})
            raise ValueError(f"no line {upper} - {lower} in these fields; there are {', '.join(known)}")
        return self.where(chosen)

    def where(self, chosen: NDArray[np.bool_]) -> FieldLines:
        """Some of the rows; whole pairs of states where `pairs` is to be used."""
        from dataclasses import replace

        cut: dict[str, Any] = {name: column[chosen] for name, column in self.columns.items()}
        return replace(self, **cut)


def field_lines(
    top: Top,
    fields_kv_per_cm: ArrayLike,
    *,
    j_highest: int = 2,
    light: str | float = "parallel",
    temperature_k: float = 300.0,
    populations: str = "equilibrium",
    intensity_w_per_cm2: float = 0.0,
    jmax: int | None = None,
    tolerance_mhz: float = DEFAULT_TOLERANCE_MHZ,
    executor: Executor | None = None,
) -> FieldLines:
    """The lines between the states of a top in a static field along Z.

    Parameters
    ----------
    top : Top
        With `dipole_abc_debye`.
    fields_kv_per_cm : (n,)
        Each once, in rising order.
    j_highest : int
        Both states belong to free levels up to this J.
    light : str or float
        Polarization: "parallel" or "perpendicular" to the field, "isotropic", or the angle with the field in degrees.
    temperature_k : float
        Of the populations.
    populations : str
        "equilibrium" in the field, or "adiabatic": those of the free top, each state followed into the field, as in a beam.
    intensity_w_per_cm2 : float
        Of a laser along the field, far from resonance.
    jmax : int, optional
        Of the basis; by default chosen.
    tolerance_mhz : float
        Of energies.
    executor : Executor, optional
        Blocks are spread over it.

    Returns
    -------
    FieldLines

    Raises
    ------
    ValueError
        As `stark_map`, and for a polarization or populations that are not known.

    Notes
    -----
    Q is that of the free top, corrected in equilibrium by the states that are followed; hyperfine structure is neglected.

    >>> from rotor.tops.top import Top
    >>> found = field_lines(Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0)), [0.0, 1.0], j_highest=1)
    >>> found.frequency_mhz.round(2).tolist(), round(float(found.strength_debye2[0]), 4)  # S μ² = 0.49 D²
    ([12000.0, 12005.52], 0.49)
    """
    angle = checked_light(light)
    require_positive("temperature_k", temperature_k, "K")
    require_one_of("populations", populations, POPULATIONS)
    request = map_request(top, fields_kv_per_cm, j_highest, None, intensity_w_per_cm2, tolerance_mhz=tolerance_mhz)
    jmax, moved = converged_jmax(request, jmax, executor)
    solved = each_block(request, jmax, partial(block_states, request, fields=request.fields), executor)
    found = populations_in_field(top, solved, temperature_k, populations)
    parts = []
    for pair in pairs_of_blocks([one.block for one in solved]):
        factor = polarization_factors(angle)[pair.q] * pair.copies
        if factor > 1e-30:  # the cosine of 90 degrees is not quite 0
            parts.append(_lines_of(top, solved, pair, factor, found, j_highest))
    columns = _strong(_joined(parts), len(request.fields))
    text = light if isinstance(light, str) else f"{light:g}° to the field"
    return FieldLines(
        top=top,
        light=text,
        temperature_k=temperature_k,
        populations=populations,
        field_kv_per_cm=np.tile(request.fields, len(columns["upper"]) // len(request.fields)),
        jmax=jmax,
        accuracy_mhz=2 * float(moved.max(initial=0.0)),
        q=found.q,
        **columns,
    )


def checked_light(light: str | float) -> float | None:
    """The angle of a polarization with the field in degrees, None for isotropic light; ValueError for others."""
    if isinstance(light, str) and light in LIGHT:
        return LIGHT[light]
    try:
        angle = float(light)
    except ValueError:
        angle = math.nan
    if not math.isfinite(angle):
        raise ValueError(f"light {light!r}: expected one of {', '.join(LIGHT)}, or an angle with the field in degrees")
    return angle


def polarization_factors(angle_degrees: float | None) -> tuple[float, float]:
    """What |⟨μ_Z⟩|² and |⟨μ_1⟩|² are multiplied by: (1, 1) for isotropic light, (3 cos²β, 1.5 sin²β) for linear."""
    if angle_degrees is None:
        return 1.0, 1.0
    cosine = math.cos(math.radians(angle_degrees))
    return 3 * cosine**2, 1.5 * (1 - cosine**2)


class _Part(NamedTuple):
    """Lines of one pair of blocks: columns (fields, lines), or (lines,) of labels and M."""

    frequency: Floats
    shift: Floats
    strength: Floats
    intensity: Floats
    lower_energy: Floats
    names: tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]


def _lines_of(
    top: Top, solved: list[BlockStates], pair: BlockPair, factor: float, found: Populations, j_highest: int
) -> _Part:
    """Every pair of states of two blocks, its squares times `factor`."""
    up, low = solved[pair.up], solved[pair.low]
    assert top.dipole_abc_debye is not None
    elements = dipole_elements(up.block, low.block, top.dipole_abc_debye)[np.ix_(up.places, low.places)]
    moved = np.einsum("fis,ik,fkt->fst", up.vectors.conj(), elements, low.vectors, optimize=True)
    strength = factor * np.abs(moved) ** 2
    ours = [one.block.levels.j[one.rows] <= j_highest for one in (up, low)]
    first, second = np.nonzero(np.multiply.outer(*ours) & (_above(len(ours[0])) if pair.up == pair.low else True))
    frequency = up.energies[:, first] - low.energies[:, second]
    turned = frequency[-1] < 0
    levels = up.block.levels
    free = levels.energy_mhz[up.rows[first]] - levels.energy_mhz[low.rows[second]]
    sign = np.where(turned, -1.0, 1.0)
    difference = found.of_block[pair.low][:, second] - found.of_block[pair.up][:, first]
    intensity = INTENSITY_NM2_MHZ * frequency * strength[:, first, second] * difference
    return _Part(
        sign * frequency,
        sign * (frequency - free),
        strength[:, first, second],
        intensity,
        np.where(turned, up.energies[:, first], low.energies[:, second]),
        _names(up, low, (first, second), turned),
    )


def _names(
    up: BlockStates, low: BlockStates, states: tuple[Ints, Ints], turned: NDArray[np.bool_]
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Label and M of the upper and of the lower state of every line, exchanged where `turned`."""
    out: list[NDArray[Any]] = []
    for this, other in ((0, 1), (1, 0)):
        sides = (up, low)
        labels = [
            np.array([one.block.levels.label(int(row)) for row in one.rows[of]])
            for one, of in zip(sides, states, strict=True)
        ]
        out.append(np.where(turned, labels[other], labels[this]))
        out.append(np.where(turned, sides[other].block.m, sides[this].block.m))
    return out[0], out[1], out[2], out[3]


def _above(count: int) -> NDArray[np.bool_]:
    return np.tril(np.ones((count, count), dtype=bool), -1)


def _joined(parts: list[_Part]) -> dict[str, NDArray[Any]]:
    """Columns of all pairs, the fields of one pair after each other."""

    def column(pick: int) -> NDArray[Any]:
        return np.concatenate([np.asarray(part[pick]).T.ravel() for part in parts]) if parts else np.zeros(0)

    def name(pick: int) -> NDArray[Any]:
        return np.concatenate([np.repeat(part.names[pick], len(part.frequency)) for part in parts])

    values = ("frequency_mhz", "shift_mhz", "strength_debye2", "intensity_nm2_mhz", "lower_mhz")
    out = {one: column(place) for place, one in enumerate(values)}
    return {**out, **{one: name(place) for place, one in enumerate(("upper", "upper_m", "lower", "lower_m"))}}


def _strong(columns: dict[str, NDArray[Any]], fields: int) -> dict[str, NDArray[Any]]:
    """Without the pairs that are forbidden at every field."""
    strength = columns["strength_debye2"].reshape(-1, fields)
    allowed = np.repeat(strength.max(axis=1) > LEAST_STRENGTH * strength.max(initial=0.0), fields)
    return {name: column[allowed] for name, column in columns.items()}
