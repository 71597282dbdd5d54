"""Lines of a top in a static electric field, resolved in M, for a given polarization of the light.

Each pair of states that the dipole connects is a line: ΔM = 0 for light polarized along the field, ΔM = ±1 for light polarized
perpendicular to it. Strengths are scaled so that their mean over all directions of polarization is the S μ² of a catalogue:

    S(β) = 3 Σ [cos²β |⟨μ_Z⟩|² + ½ sin²β |⟨μ_±1⟩|²],      isotropic light: Σ [|⟨μ_Z⟩|² + |⟨μ_±1⟩|²]

(β between polarization and field; the sum is over coinciding pairs, M and -M). Circularly polarized light that travels along the field
counts as perpendicular. If a laser polarized at an angle to the static field mixes M, each pair of states is a line, and the polarization
may have any direction (`rotor.spectra.fields.light`). With spins the states are |F τ M_F⟩.
Intensities are those of `intensity`: 8π³/3hc ν S (p″ - p′), with p the population of one state.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.checks import require_choice, require_positive
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.stark import ELECTRIC, StarkRequest, Z, acting, checked_direction
from rotor.quantum.fields.block_states import BlockStates, pairs_of_blocks, states_of_both_signs
from rotor.quantum.fields.blocks import Contraction, FieldBlock
from rotor.quantum.fields.field_map import each_block, smallest_jmax
from rotor.quantum.fields.map_request import MapRequest
from rotor.spectra.fields.light import Light, LightText, Vector, light_components
from rotor.spectra.intensity import INTENSITY_NM2_MHZ
from rotor.table import Table
from rotor.thermodynamics.gas.field_mixture import POPULATIONS, Populations, populations_in_field

if TYPE_CHECKING:
    from rotor.tops.top import Top

DEFAULT_TOLERANCE_MHZ = 1e-4
SAME_MHZ = 1e-6  # energies of coinciding states differ by round-off only
LEAST_STRENGTH = 1e-10  # relative to the strongest line; round-off makes forbidden lines weaker than this


@dataclass(frozen=True, eq=False, repr=False)
class FieldLines(Table):
    """Lines in a field as columns of equal length: for each pair of states, all fields in order.

    frequency_mhz: E′ - E″, with the state that is higher at the last field as the upper one; negative where the states have crossed.
    shift_mhz: from the line of the free top. strength_debye2, intensity_nm2_mhz: for this light, summed over coinciding pairs.
    upper, lower: labels of the free levels. upper_m, lower_m: |M|, or |M_F| with spins; -1 if M is mixed. lower_mhz: E″. upper_state,
    lower_state: numbers of the states, counted through `blocks` of `request`.
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
    upper_state: Ints = field(repr=False)
    lower_state: Ints = field(repr=False)
    request: MapRequest = field(repr=False)
    blocks: tuple[FieldBlock, ...] = field(repr=False)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns by their names with unit."""
        names = (
            "field_kv_per_cm", "frequency_mhz", "shift_mhz", "strength_debye2", "intensity_nm2_mhz", "upper", "upper_m", "lower",
            "lower_m", "lower_mhz",
        )  # fmt: skip
        return {name: getattr(self, name) for name in names}

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @property
    def provenance(self) -> dict[str, Any]:
        """Light, temperature, populations, Q at each field, and the accuracy of the energies."""
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
        """The fields in rising order, without repetition."""
        return np.unique(self.field_kv_per_cm)

    def pairs(self) -> list[slice]:
        """Rows of each pair of states, all fields in order."""
        count = len(self.fields)
        return [slice(first, first + count) for first in range(0, len(self), count)]

    def lobes(self, upper: str, lower: str) -> FieldLines:
        """The M components of a single line of the free molecule (the lobes of Stark modulation).

        Raises ValueError if there are none.
        """
        chosen = ((self.upper == upper) & (self.lower == lower)) | ((self.upper == lower) & (self.lower == upper))
        if not chosen.any():
            known = sorted({f"{a} - {b}" for a, b in zip(self.upper, self.lower, strict=True)})
            raise ValueError(f"no line {upper} - {lower} in these fields; there are {', '.join(known)}")
        return self.where(chosen)

    def where(self, chosen: NDArray[np.bool_]) -> FieldLines:
        """The selected rows; `pairs` needs all rows of a pair of states."""
        names = (*self.columns, "upper_state", "lower_state")
        cut: dict[str, Any] = {name: getattr(self, name)[chosen] for name in names}
        return replace(self, **cut)


def field_lines(
    top: Top,
    fields_kv_per_cm: ArrayLike,
    *,
    j_highest: int = 2,
    light: LightText = "parallel",
    temperature_k: float = 300.0,
    populations: str = "equilibrium",
    intensity_w_per_cm2: float = 0.0,
    direction: Sequence[float] = Z,
    effects: Sequence[QuantumEffect] = (),
    jmax: int | None = None,
    tolerance_mhz: float = DEFAULT_TOLERANCE_MHZ,
    executor: Executor | None = None,
) -> FieldLines:
    """The lines between the states of a top in a static field.

    Parameters
    ----------
    top : Top
        With `dipole_abc_debye`.
    fields_kv_per_cm : (n,)
        Fields in rising order, without repetition.
    j_highest : int
        Highest J of the free levels of both states.
    light : str, float or (3,)
        Polarization: "parallel" or "perpendicular" to the static field, "isotropic", the angle with the field in degrees (averaged over
        the azimuth), or components along X, Y, Z.
    temperature_k : float
        Temperature of the populations.
    populations : str
        "equilibrium" in the field, or "adiabatic": populations of the free top, which each state carries into the field, as in a beam.
    intensity_w_per_cm2 : float
        Intensity of a laser polarized along Z, far from resonance.
    direction : (3,)
        Direction of the static field, of any length; at an angle to Z it mixes M.
    effects : sequence of QuantumEffect
        The Hamiltonian of a top with spins, as in `stark_map`.
    jmax : int, optional
        Highest J of the basis; by default chosen for the tolerance.
    tolerance_mhz : float
        Tolerance of the energies.
    executor : Executor, optional
        Shares the work over blocks.

    Returns
    -------
    FieldLines

    Raises
    ------
    ValueError
        As `stark_map`, and for an unknown polarization or kind of populations.

    Notes
    -----
    Q is that of the free top; in equilibrium it is corrected for the shifts of the computed states. The division of a strength between
    coinciding states of mixed M is arbitrary: lines that coincide at every field are therefore merged.

    >>> from rotor.tops.top import Top
    >>> found = field_lines(Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0)), [0.0, 1.0], j_highest=1)
    >>> found.frequency_mhz.round(2).tolist(), round(float(found.strength_debye2[0]), 4)  # S μ² = 0.49 D²
    ([12000.0, 12005.52], 0.49)
    """
    seen, unit = light_components(light), checked_direction(direction)
    require_positive("temperature_k", temperature_k, "K")
    require_choice("populations", populations, POPULATIONS)
    request = StarkRequest(
        top,
        tuple(ELECTRIC.checked(fields_kv_per_cm).tolist()),
        j_highest=j_highest,
        intensity_w_per_cm2=intensity_w_per_cm2,
        direction=unit,
        tolerance_mhz=tolerance_mhz,
        hamiltonian=tuple(effects),
    ).map
    jmax = smallest_jmax(request, executor) if jmax is None else jmax
    both = each_block(request, jmax, partial(states_of_both_signs, request, fields=request.fields, jmax=jmax), executor)
    solved = [states for pair in both for states in pair]
    populations_of_states = populations_in_field(top, solved, temperature_k, populations, effects)
    mixed = not solved[0].block.space.m_is_good
    seen = seen if mixed else seen.about(unit)
    parts = [
        _pair_lines(solved, pair, strength, populations_of_states, j_highest)
        for pair, strength in _strengths(acting(top, 0.0, unit, effects)[0], solved, seen, unit)
    ]
    columns = _joined(parts)
    if effects or mixed:
        columns = merged(columns, len(request.fields))
    columns = _strong(columns, len(request.fields))
    return FieldLines(
        top=top,
        light=light_components(light).text,
        temperature_k=temperature_k,
        populations=populations,
        field_kv_per_cm=np.tile(request.fields, len(columns["upper"]) // len(request.fields)),
        jmax=jmax,
        accuracy_mhz=2 * _largest_error(solved, j_highest),
        q=populations_of_states.q,
        request=request,
        blocks=tuple(states.block for states in solved),
        **columns,
    )


def _largest_error(solved: Sequence[BlockStates], j_highest: int) -> float:
    """Bound in MHz of the basis error of the energies of states that correlate with levels up to `j_highest`."""
    return max(float(states.error[:, states.j <= j_highest].max(initial=0.0)) for states in solved)


def _strengths(
    dipole: Contraction, solved: list[BlockStates], light: Light, unit: Vector
) -> Iterator[tuple[tuple[int, int], Floats]]:
    """Places of pairs of blocks and S (fields, up, low) of their states in D²."""
    blocks = [states.block for states in solved]
    space = blocks[0].space
    if not space.m_is_good:
        along = [replace(dipole, space=axis) for axis in np.eye(3)]
        for low, up in combinations_with_replacement(range(len(blocks)), 2):
            axes = [space.between(blocks[up], operator, blocks[low]) for operator in along]
            if any(elements.any() for elements in axes):
                between = [_between(solved[up], solved[low], elements) for elements in axes]
                yield (up, low), light.strength(between, unit)
        return
    for up, low, q, copies in pairs_of_blocks(blocks):
        factor = light.factors[q] * copies
        if factor > 1e-30:  # the cosine of 90 degrees is not quite 0
            elements = space.between(blocks[up], dipole, blocks[low])
            if elements.any():
                yield (up, low), factor * np.abs(_between(solved[up], solved[low], elements)) ** 2


def _between(up: BlockStates, low: BlockStates, elements: NDArray[Any]) -> NDArray[Any]:
    """Matrix elements between states in the field (fields, up, low), from those between free states."""
    held = elements[np.ix_(up.places, low.places)]
    return np.asarray(np.einsum("fis,ik,fkt->fst", up.vectors.conj(), held, low.vectors, optimize=True))


class _Part(NamedTuple):
    """Lines of a pair of blocks: columns (fields, lines); labels and M (lines,)."""

    frequency: Floats
    shift: Floats
    strength: Floats
    intensity: Floats
    lower_energy: Floats
    names: tuple[NDArray[Any], ...]


def _pair_lines(
    solved: list[BlockStates], pair: tuple[int, int], strength: Floats, populations: Populations, j_highest: int
) -> _Part:
    """Lines between the states of two blocks; strength: (fields, up, low)."""
    up, low = (solved[place] for place in pair)
    ours = [side.j <= j_highest for side in (up, low)]
    first, second = np.nonzero(np.multiply.outer(*ours) & (_above(len(ours[0])) if pair[0] == pair[1] else True))
    frequency = up.energies[:, first] - low.energies[:, second]
    turned = frequency[-1] < 0
    levels = up.block.levels
    free = levels.energy_mhz[up.rows[first]] - levels.energy_mhz[low.rows[second]]
    sign = np.where(turned, -1.0, 1.0)
    difference = populations.by_block[pair[1]][:, second] - populations.by_block[pair[0]][:, first]
    intensity = INTENSITY_NM2_MHZ * frequency * strength[:, first, second] * difference
    return _Part(
        sign * frequency,
        sign * (frequency - free),
        strength[:, first, second],
        intensity,
        np.where(turned, up.energies[:, first], low.energies[:, second]),
        (*_names(up, low, (first, second), turned), *_numbers(solved, pair, (first, second), turned)),
    )


def _names(
    up: BlockStates, low: BlockStates, states: tuple[Ints, Ints], turned: NDArray[np.bool_]
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Labels and M of the upper and lower state of each line, exchanged where `turned`."""
    out: list[NDArray[Any]] = []
    for this, other in ((0, 1), (1, 0)):
        sides = (up, low)
        labels = [
            np.array([side.block.levels.label(int(row)) for row in side.rows[rows]])
            for side, rows in zip(sides, states, strict=True)
        ]
        out.append(np.where(turned, labels[other], labels[this]))
        # M and -M have one energy where M is good
        m_values = [abs(side.block.m) if side.block.space.m_is_good else side.block.m for side in sides]
        out.append(np.where(turned, m_values[other], m_values[this]))
    return out[0], out[1], out[2], out[3]


def _numbers(
    solved: list[BlockStates], pair: tuple[int, int], states: tuple[Ints, Ints], turned: NDArray[np.bool_]
) -> tuple[Ints, Ints]:
    """Numbers of the upper and lower state of each line, counted through the blocks."""
    first = np.cumsum([0, *(len(block.rows) for block in solved)])
    up, low = (first[place] + rows for place, rows in zip(pair, states, strict=True))
    return np.where(turned, low, up), np.where(turned, up, low)


def _above(count: int) -> NDArray[np.bool_]:
    return np.tril(np.ones((count, count), dtype=bool), -1)


def _joined(parts: list[_Part]) -> dict[str, NDArray[Any]]:
    """Columns of all pairs; for each pair, all fields in order."""

    def column(pick: int) -> NDArray[Any]:
        return np.concatenate([np.asarray(part[pick]).T.ravel() for part in parts]) if parts else np.zeros(0)

    def name(pick: int) -> NDArray[Any]:
        return np.concatenate([np.repeat(part.names[pick], len(part.frequency)) for part in parts])

    values = ("frequency_mhz", "shift_mhz", "strength_debye2", "intensity_nm2_mhz", "lower_mhz")
    out = {name: column(place) for place, name in enumerate(values)}
    names = ("upper", "upper_m", "lower", "lower_m", "upper_state", "lower_state")
    return {**out, **{key: name(place) for place, key in enumerate(names)}}


def _strong(columns: dict[str, NDArray[Any]], fields: int) -> dict[str, NDArray[Any]]:
    """The columns without pairs of states that are forbidden at every field."""
    strength = columns["strength_debye2"].reshape(-1, fields)
    # strengths are squares of elements: round-off leaves no exact zeros
    allowed = np.repeat(strength.max(axis=1) > LEAST_STRENGTH * strength.max(initial=0.0), fields)
    return {name: column[allowed] for name, column in columns.items()}


def merged(columns: dict[str, NDArray[Any]], fields: int) -> dict[str, NDArray[Any]]:
    """Merge lines of equal labels and |M| that coincide at every field, as do their lower states: strengths and intensities add up."""
    names = ("upper", "upper_m", "lower", "lower_m")
    keys = [np.unique(columns[name], return_inverse=True)[1].reshape(-1, fields)[:, 0] for name in names]
    # (2, lines, fields)
    place = np.stack([columns[name].reshape(-1, fields) for name in ("lower_mhz", "frequency_mhz")])
    first: list[int] = []  # first line of each group
    groups: dict[tuple[int, ...], list[int]] = {}
    number = np.zeros(place.shape[1], dtype=np.int64)
    for line, key in enumerate(zip(*(key.tolist() for key in keys), strict=True)):
        known = groups.setdefault(key, [])
        same = [earlier for earlier in known if np.abs(place[:, first[earlier]] - place[:, line]).max() <= SAME_MHZ]
        if not same:
            known.append(len(first))
            first.append(line)
        number[line] = (same or known[-1:])[0]
    out = {name: column.reshape(-1, fields)[first].ravel() for name, column in columns.items()}
    for name in ("strength_debye2", "intensity_nm2_mhz"):
        total = np.zeros((len(first), fields))
        np.add.at(total, number, columns[name].reshape(-1, fields))
        out[name] = total.ravel()
    return out
