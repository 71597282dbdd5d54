"""Labelled levels of a molecule with internal rotors, with or without nuclear spins, and their derivatives by its constants.

Blocks are those of `rotor.quantum.internal_rotation`, for the J (N with spins) of the labels. For one top in the rho-axis frame the
blocks are built once and solved at each iteration. F and ρ enter through the coefficients F, -2Fρ and Fρ² of linear blocks, so that
∂E/∂F and ∂E/∂ρ follow by the chain rule. The torsional basis functions are those of the start; they are rebuilt when F, ρ or V3
change by more than 1 %. Constants of principal axes, for one top or two, rotate the axis of ρ: their blocks are rebuilt at each
point (`rotor.quantum.internal_rotation.chain_rule`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, rows_of_keys
from rotor.fitting.top_constants import TopConstants
from rotor.quantum.internal_rotation.chain_rule import TILT, ChainRule, chain_rule, further_operators
from rotor.quantum.internal_rotation.hyperfine import (
    coupled_blocks,
    refuse_unlike_nuclei,
)
from rotor.quantum.internal_rotation.levels import (
    TorsionMoments,
    TurningTops,
    species_blocks,
    species_rotors,
    turning_model,
)
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.internal_rotation.rho_axis_tensors import slope_by_tilt
from rotor.quantum.internal_rotation.species import SpeciesHamiltonian, SpeciesLevels
from rotor.quantum.internal_rotation.terms import PRINCIPAL, Axes
from rotor.quantum.labels.labelled import LevelModel, MissingLevelsError
from rotor.quantum.labels.quanta import SPECIES_NUMBERS, value_text
from rotor.quantum.levels import SolvedBlock, placed
from rotor.quantum.spins.linear_blocks import slopes_by_rotation, slopes_by_spins
from rotor.quantum.spins.rotor import Terms, channels_of
from rotor.quantum.spins.scheme import Scheme, SpinTerm, scheme_of
from rotor.tops.internal_rotation import InternalRotationConstants, is_torsional, sigma_species

MOVED = 0.01  # relative change of a torsional constant above which the torsional functions are rebuilt
TORSIONAL = ("F", "rho", "V3", "V6")


@dataclass(frozen=True)
class LabelledSpecies:
    """The labels of one species: indices among all labels, columns J (or N), v_t, Ka, Kc, and with spins the doubled sums F1 ... F."""

    name: str
    places: Ints
    keys: Ints
    sums: Ints

    @property
    def vt_max(self) -> int:
        """The highest v_t of the labels."""
        return int(self.keys[:, 1].max())

    @property
    def twice_f(self) -> Ints:
        """Twice the total angular momenta that occur."""
        return np.unique(self.sums[:, -1])

    def rotations(self, twice_spins: int) -> Ints:
        """The J (or N) that the labels need; with spins, N from |F - I| to F + I."""
        if not self.sums.size:
            return np.unique(self.keys[:, 0])
        ranges = [range(abs(f - twice_spins), f + twice_spins + 1, 2) for f in self.twice_f.tolist()]
        return np.unique([twice_n // 2 for twice in ranges for twice_n in twice])


@dataclass(frozen=True, eq=False)
class Spins:
    """Nuclear spins and the terms of their constants."""

    scheme: Scheme
    terms: tuple[SpinTerm, ...]

    def valued(self, values: Mapping[str, float]) -> Terms:
        """The terms with the values of their constants."""
        return [(values[term.name] * term.factor, term) for term in self.terms if values[term.name]]

    def derivatives(self, values: Mapping[str, float], frame: Axes, chain: ChainRule) -> dict[str, Terms]:
        """Derivatives of the terms by each constant, and by the tilts of ρ, with which all tensors turn."""
        names = dict.fromkeys(term.name for term in self.terms)
        out: dict[str, Terms] = {name: [(t.factor, t) for t in self.terms if t.name == name] for name in names}
        for tilt in (q for q in chain.quantities if q.startswith(TILT)):
            towards = tilt.removeprefix(TILT)
            out[tilt] = [
                (value, replace(t, rotor=slope_by_tilt(t.rotor, frame, towards))) for value, t in self.valued(values)
            ]
        return out


@dataclass(frozen=True, eq=False)
class TorsionLevels(LevelModel):
    """Levels of all species by label, that of the dominant basis state, for any values of the constants."""

    names: tuple[str, ...]
    count: int
    constants: InternalRotationConstants
    spins: Spins | None
    species: tuple[LabelledSpecies, ...]
    _blocks: dict[str, tuple[Floats, SpeciesHamiltonian]] = field(default_factory=dict)

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`. Raises MissingLevelsError for labels without a level."""
        named = dict(zip(self.names, np.asarray(values_mhz).tolist(), strict=True))
        rotation = {name: value for name, value in named.items() if not is_torsional(name) and "(" not in name}
        internal = {name: value for name, value in named.items() if is_torsional(name)}
        model = turning_model(rotation, internal, self.constants)
        chain = chain_rule(model, rotation | internal)
        energies, slopes = np.empty(self.count), np.zeros((self.count, len(self.names)))
        for part in self.species:
            name = part.name if part.name in model.species else "AE"  # EA of equivalent tops
            energies[part.places], slopes[part.places] = self._species_levels(part, name, model, chain, named)
        return energies, slopes

    def _species_levels(
        self, part: LabelledSpecies, name: str, model: TurningTops, chain: ChainRule, named: Mapping[str, float]
    ) -> tuple[Floats, Floats]:
        """Energies and derivatives of the labels of one species."""
        levels = self._solved(part, name, model)
        moments = TorsionMoments(levels, model, chain, further_operators(model, name, chain))
        if self.spins is None:
            rows = _label_rows(levels.quanta, ("j", "vt", "ka", "kc"), part, part.keys)
            values, direct = levels.energies[rows], levels.slopes(rows, list(moments.further.values()))
            spin_slopes: dict[str, Floats] = {}
        else:
            spins = self.spins.derivatives(named, model.frame, chain)
            values, direct, spin_slopes = _with_spins(self.spins, part, moments, self.spins.valued(named), spins)
        slopes = moments.by_quantities(direct)
        slopes |= {key: slopes.get(key, 0.0) + slope for key, slope in spin_slopes.items()}
        return values, chain.slopes(self.names, slopes, len(values))

    def _solved(self, part: LabelledSpecies, name: str, model: TurningTops) -> SpeciesLevels:
        """The torsion-rotation levels of a species; with spins up to the v_t of predictions, as basis of the hyperfine levels."""
        vt_max = max(part.vt_max, self.constants.vt_max if self.spins else 0)
        by_energy = self.constants.names == "energy"
        if isinstance(model, RamModel) and model.frame == PRINCIPAL:
            return self._species_blocks(part, model).solve(model.coefficients, vt_max, by_energy)
        return self._new_blocks(part, name, model).solve_once(model.coefficients, vt_max, by_energy)

    def _species_blocks(self, part: LabelledSpecies, model: RamModel) -> SpeciesHamiltonian:
        """The blocks of a species, rebuilt if the torsional constants have changed."""
        torsion = np.array([model.values.get(name, 0.0) for name in TORSIONAL])
        cached = self._blocks.get(part.name)
        if cached is None or (np.abs(torsion - cached[0]) > MOVED * np.abs(cached[0])).any():
            self._blocks[part.name] = torsion, self._new_blocks(part, part.name, model)
        return self._blocks[part.name][1]

    def _new_blocks(self, part: LabelledSpecies, name: str, model: TurningTops) -> SpeciesHamiltonian:
        """New blocks for the J that the labels need."""
        j = part.rotations(self.spins.scheme.total if self.spins else 0)
        return species_blocks(model, name, int(j.min()), int(j.max()), self.constants.functions, j)


def _with_spins(
    spins: Spins, part: LabelledSpecies, moments: TorsionMoments, terms: Terms, derivatives: Mapping[str, Terms]
) -> tuple[Floats, Floats, dict[str, Floats]]:
    """Energies of labels, and their derivatives by coefficients of the torsion-rotation and by those of terms with spins."""
    quanta = moments.levels.quanta
    names = np.column_stack([np.arange(len(quanta["vt"])), quanta["ka"], quanta["kc"]])
    free = placed(species_rotors(moments, 1))
    blocks = list(placed(coupled_blocks(free, names, spins.scheme, terms, part.twice_f.tolist())))
    labels = np.concatenate([block.labels for block in blocks])
    keys = [quanta["j"][labels[:, 0]], quanta["vt"][labels[:, 0]], labels[:, 1:3], labels[:, 4:]]
    columns = dict(zip(("n", "vt", "ka", "kc", *spins.scheme.names), np.column_stack(keys).T, strict=True))
    rows = _label_rows(columns, tuple(columns), part, np.hstack([part.keys, part.sums]))
    needed, places = np.unique(rows, return_inverse=True)
    chosen = list(placed(_states_at(blocks, needed)))
    channels = [channels_of(of_parameter, spins.scheme) for of_parameter in derivatives.values()]
    by_spins = slopes_by_spins(chosen, channels)
    direct = [slopes_by_rotation(block, moments.term_slopes) for block in chosen]
    energies = np.concatenate([block.energies_mhz for block in chosen])
    slopes = dict(zip(derivatives, by_spins[places].T, strict=True))
    return energies[places], np.concatenate(direct)[places], slopes


def _states_at(blocks: Sequence[SolvedBlock], rows: Ints) -> Iterator[SolvedBlock]:
    """Blocks with only the states at these rows, which rise."""
    for block in blocks:
        here = rows[(rows >= block.start) & (rows < block.start + len(block.energies_mhz))] - block.start
        yield replace(block, energies_mhz=block.energies_mhz[here], vectors=block.vectors[:, here])


def torsion_levels(constants: TopConstants, labels: Ints) -> LevelModel:
    """The model for labels (levels, k) by `constants.quanta`; species are numbered by `rotor.quantum.labels.quanta.SPECIES_NUMBERS`.

    Raises MissingLevelsError for labels without a level.
    """
    internal = constants.top.internal_rotation
    assert internal is not None
    spins = None
    if constants.hyperfine:
        terms = tuple(term for effect in constants.effects for term in effect.spin_terms(constants.top))
        spins = Spins(scheme_of(constants.top, constants.effects), terms)
        refuse_unlike_nuclei(spins.scheme, terms)
    columns = dict(zip(constants.quanta, labels.T, strict=True))
    keys = np.column_stack([columns[name] for name in ("j" if spins is None else "n", "vt", "ka", "kc")])
    sums = _doubled_sums(columns, spins, constants.halves)
    numbers = {SPECIES_NUMBERS[name]: name for name in sigma_species(internal.tops)}
    meaning = ", ".join(f"{number} is {name}" for number, name in numbers.items())
    rules = [
        (f"species: {meaning}", np.isin(columns["species"], list(numbers))),
        (f"Ka + Kc is {'J' if spins is None else 'N'} or one more", _exist(keys)),
        (f"v_t is at most {internal.functions - 2}", keys[:, 1] <= internal.functions - 2),
        (
            "each sum of angular momenta goes from their difference to their sum, |N - I| to N + I",
            _coupled(keys[:, 0], sums, spins),
        ),
    ]
    for rule, right in rules:
        if not right.all():
            places = np.flatnonzero(~right)
            first = {name: int(column[places[0]]) for name, column in columns.items()}
            text = ", ".join(f"{name} = {value_text(value, name in constants.halves)}" for name, value in first.items())
            raise MissingLevelsError(f"there is no level with {text}: {rule}", places)
    parts = [
        LabelledSpecies(name, here, keys[here], sums[here])
        for number, name in numbers.items()
        if len(here := np.flatnonzero(columns["species"] == number))
    ]
    return TorsionLevels(tuple(constants.values), len(labels), internal, spins, tuple(parts))


def _coupled(n: Ints, sums: Ints, spins: Spins | None) -> NDArray[np.bool_]:
    """Whether each doubled sum (labels, sums) can be coupled from the preceding sum (first N) and its spin."""
    right, before = np.ones(len(n), dtype=bool), 2 * n
    for spin, total in zip(spins.scheme.spins if spins else (), sums.T, strict=True):
        right &= (
            (total >= np.abs(before - spin.twice))
            & (total <= before + spin.twice)
            & ((total - before - spin.twice) % 2 == 0)
        )
        before = total
    return right


def _doubled_sums(columns: Mapping[str, Ints], spins: Spins | None, halves: frozenset[str]) -> Ints:
    """The doubled sums F1 ... F (labels, sums); empty without spins."""
    if spins is None:
        return np.zeros((len(columns["species"]), 0), dtype=np.int64)
    return np.column_stack([columns[name] if name in halves else 2 * columns[name] for name in spins.scheme.names])


def _label_rows(quanta: Mapping[str, Ints], names: Sequence[str], part: LabelledSpecies, keys: Ints) -> Ints:
    """Indices of the labelled levels among those of a species; MissingLevelsError for labels without a level."""
    rows = rows_of_keys(np.column_stack([quanta[name] for name in names]), keys)
    if (rows < 0).any():
        missing = np.flatnonzero(rows < 0)
        label = ", ".join(f"{name} = {value}" for name, value in zip(names, keys[missing[0]].tolist(), strict=True))
        raise MissingLevelsError(
            f"there is no level {part.name} with {label} (sums twice) in this model", part.places[missing]
        )
    return rows


def _exist(keys: Ints) -> NDArray[np.bool_]:
    """Whether (J, v_t, Ka, Kc) is a valid label: Ka + Kc is J or J + 1."""
    j, vt, ka, kc = keys.T
    return np.asarray((keys >= 0).all(axis=1) & (ka <= j) & (kc <= j) & np.isin(ka + kc - j, (0, 1)) & (vt >= 0))
