"""Request and answer for the rotation about a bond: potential, reduced moment, levels, splittings, thermodynamics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.checks import require_top
from rotor.molecules.bond_rotation import BondRotation, bond_rotation, bond_text, turning_bonds
from rotor.molecules.bond_scan import MMFF, POINTS, BondScan
from rotor.quantum.bond_torsion import BondTorsion
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.requests.field import check_fields, declared
from rotor.requests.fill import within
from rotor.requests.knob import Knob, Measure
from rotor.requests.readers import Custom, Grid, Quantity, Whole
from rotor.table import Table, TextOf
from rotor.thermodynamics.torsion.hindered_rotor import HinderedRotorFunctions, hindered_rotor_functions
from rotor.thermodynamics.torsion.potential import (
    TABLE,
    Progress,
    is_scan,
    parse_potential,
    potential_and_kinetic,
    similar_barrier,
    table_barrier,
)
from rotor.tops.facts import top_facts

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.thermodynamics.torsion.classical_torsion import ClassicalTorsion
    from rotor.tops.top import Top

MOST_BONDS = 6  # in an error
TEMPERATURES_K = (50.0, 100.0, 200.0, 298.15, 400.0, 600.0, 800.0, 1000.0)
SAME_WELLS = 0.05  # largest difference between the well probabilities of the two components of a tunnelling doublet
FAR = 0.2  # relative difference of a scanned barrier from a measured one that is named
SHARED = 0.75  # largest probability in one well for a component of a tunnelling doublet


def _level_error(answer: Any, reference: Any) -> float:
    """Largest difference of the levels above the lowest one, cm⁻¹."""
    levels, other = (np.sort(each.levels.columns["above_lowest_cm"]) for each in (answer, reference))
    count = min(len(levels), len(other))
    return float(np.max(np.abs(levels[:count] - other[:count])))


ANGLES = Knob(
    (12, 18, 24, 36, 48, 72), 144, (Measure("levels", "cm-1", _level_error),), "{:g} angles",
    used=lambda request: is_scan(request.potential),
)  # fmt: skip


@dataclass(frozen=True)
class TorsionRequest:
    """The rotation about a bond of a molecule; all fields are checked when the request is made.

    top: with a geometry. bond: atoms "i-j" or (i, j), from 1; j turns. potential: "V3=400 V6=-10 cm-1", "table", "mmff", the name
    of an ASE calculator, or (in Python) a `FourierSeries` in MHz or a calculator. points: angles of a scan per turn. vmax: highest
    torsional level. temperatures_k: of the thermodynamic functions. classical_k: temperature of a classical gas of `molecules`,
    propagated for `duration_ps`; None: no gas.
    """

    top: Top
    bond: str | Sequence[int] = declared(
        "", Custom(bond_text, metavar="I-J"), "Bond between atoms I-J, counted from 1; the group at J turns", "observables.bond",
        common=True, example="1-2",
    )  # fmt: skip
    potential: Any = declared(
        MMFF, Custom(lambda value: value, metavar="TEXT"),
        "'V3=400 V6=-10 cm-1', 'table' (V3 of a similar molecule), or a relaxed scan: mmff or an ASE calculator", "observables.potential",
        common=True, example="V3=400 cm-1",
    )  # fmt: skip
    points: int = declared(
        POINTS, Whole(6, 720), "Number of angles of a scan, in a whole turn", "numerics.points", knob=ANGLES
    )
    vmax: int = declared(
        3,
        Whole(0, 200),
        "Highest level v of each symmetry species; without symmetry, of each well",
        "numerics.vmax",
        common=True,
    )
    temperatures_k: Sequence[float] = declared(
        TEMPERATURES_K, Grid("K", each=Quantity("K", above=0)), "Temperatures: 10:1000K:100 or 10,20,50 K", "conditions.temperature",
        common=True, example="10:1000K:100",
    )  # fmt: skip

    classical_k: float | None = declared(
        None, Quantity("K", above=0, metavar="T"), "Move a classical gas over the barrier at this temperature (K)", "observables.classical",
        example="300 K",
    )  # fmt: skip
    duration_ps: float = declared(
        10.0, Quantity("ps", above=0), "Duration of the classical motion (ps)", "numerics.duration"
    )
    molecules: int = declared(300, Whole(2, 100_000), "Molecules of the classical gas", "numerics.molecules")
    seed: int = declared(1, Whole(0), "Seed of the classical gas", "numerics.seed")

    def __post_init__(self) -> None:
        require_top(self.top)
        check_fields(self)
        with within("bond"):
            object.__setattr__(self, "bond", bond_text(self.bond))
        if self.top.molecule is None:
            raise ValueError("bond: constants alone have no bonds; give a molecule with its geometry")
        if not self.bond:
            object.__setattr__(self, "bond", _only_bond(self.top.molecule))
        rotation = self.rotation
        if isinstance(self.potential, str) and "=" in self.potential:
            parse_potential(self.potential, rotation)
        elif self.potential == TABLE:
            table_barrier(rotation)
        if self.classical_k is not None:
            from rotor.thermodynamics.torsion.classical_torsion import refuse_changing_moments

            refuse_changing_moments(rotation)

    @property
    def rotation(self) -> BondRotation:
        """The rotation about the bond; ValueError for a bond without internal rotation."""
        assert self.top.molecule is not None
        with within("bond"):
            return bond_rotation(self.top.molecule, self.bond)


def _only_bond(molecule: Molecule) -> str:
    """The bond about which groups turn, "1-2"; ValueError unless it is the only one."""
    bonds = list(islice(turning_bonds(molecule), MOST_BONDS))
    if len(bonds) != 1:
        symbols = molecule.symbols
        texts = [f"{first}-{last} ({symbols[first - 1]}-{symbols[last - 1]})" for first, last in bonds]
        turn = f"groups turn about {', '.join(texts)}" if texts else "nothing turns about any bond of this molecule"
        raise ValueError(f"bond: none is named; give two atom numbers, such as 1-2; {turn}")
    return "{}-{}".format(*bonds[0])


@dataclass(frozen=True, eq=False, repr=False)
class TorsionLevels(Table):
    """Torsional levels. v: number within the species. species: σ of m = s k + σ. energy_cm: above the minimum of the potential.

    splitting_mhz: energy relative to σ = 0 with the same v; without symmetry, relative to the other component of the tunnelling doublet
    (nan without a partner).
    """

    v: Ints
    species: Ints
    degeneracy: Ints
    energy_cm: Floats
    splitting_mhz: Floats

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Labels, degeneracies, energies and splittings."""
        return {
            "v": self.v,
            "species": self.species,
            "degeneracy": self.degeneracy,
            "energy_cm": self.energy_cm,
            "above_lowest_cm": self.energy_cm - self.energy_cm.min(),
            "splitting_mhz": self.splitting_mhz,
        }


@dataclass(frozen=True, repr=False)
class TorsionAnswer(TextOf):
    """Potential, levels and thermodynamic functions of the rotation about a bond."""

    shown = "levels"

    request: TorsionRequest
    rotation: BondRotation
    torsion: BondTorsion
    source: str
    scan: BondScan | None
    misfit_cm: float
    waves: int

    @cached_property
    def symmetry_number(self) -> int:
        """The symmetry number of the rotation; isotopes are distinguished."""
        return self.rotation.symmetry_number()

    @cached_property
    def levels(self) -> TorsionLevels:
        """Levels up to v = vmax of each species; without symmetry, vmax + 1 levels per well."""
        if self.torsion.fold == 1:
            return self._levels_without_symmetry()
        count, fold = self.request.vmax + 1, self.torsion.fold
        energies = np.array([self.torsion.states(species, self.waves)[0][:count] for species in range(fold // 2 + 1)]).T
        species = np.arange(fold // 2 + 1)
        single = (species == 0) | (2 * species == fold)
        v = np.repeat(np.arange(count), len(species))
        return TorsionLevels(
            v,
            np.tile(species, count),
            np.tile(np.where(single, 1, 2), count),
            energies.ravel() / units.MHZ_PER_CM,
            (energies - energies[:, :1]).ravel(),
        )

    def _levels_without_symmetry(self) -> TorsionLevels:
        wells = self.torsion.wells()
        count = (self.request.vmax + 1) * max(1, len(wells))
        energies, vectors, m = self.torsion.states(0, self.waves)
        splitting = np.full(count, np.nan)
        shares = _shares(self.torsion, vectors[:, :count], m) if len(wells) > 1 else np.ones((count, 1))
        lowest_top = self.torsion.lowest_barrier_mhz
        for upper in range(1, count):
            alike = np.abs(shares[upper] - shares[upper - 1]).max() < SAME_WELLS and shares[upper].max() < SHARED
            if alike and energies[upper - 1] < lowest_top and np.isnan(splitting[upper - 1]):
                splitting[upper] = energies[upper] - energies[upper - 1]
        single = np.ones(count, dtype=np.int64)
        return TorsionLevels(
            np.arange(count), np.zeros(count, dtype=np.int64), single, energies[:count] / units.MHZ_PER_CM, splitting
        )

    def wave_functions(self, angles: Floats) -> Floats:
        """Real wave functions (angles, levels) in the order of `levels`; for a pair ±σ the combination of even phase."""
        by_species = []
        for species in range(self.torsion.fold // 2 + 1):
            rows = np.flatnonzero(self.levels.species == species)
            _, vectors, m = self.torsion.states(species, self.waves)
            waves = np.exp(1j * np.outer(angles, m)) @ vectors[:, : len(rows)] / math.sqrt(2 * math.pi)
            by_species.append((rows, _real(waves)))
        functions = np.empty((len(angles), len(self.levels)))
        for rows, values in by_species:
            functions[:, rows] = values
        return functions

    @cached_property
    def classical(self) -> ClassicalTorsion | None:
        """The classical gas; None if the request has no temperature for it."""
        if self.request.classical_k is None:
            return None
        from rotor.thermodynamics.torsion.classical_torsion import classical_torsion, turning_top

        request, body = self.request, turning_top(self.rotation, self.torsion.potential)
        return classical_torsion(body, self.request.classical_k, request.duration_ps, request.molecules, request.seed)

    @cached_property
    def functions(self) -> HinderedRotorFunctions:
        """Thermodynamic functions at the temperatures of the request."""
        return hindered_rotor_functions(self.torsion, self.request.temperatures_k, self.symmetry_number)

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the level energies."""
        smaller = self._species_levels(self.torsion, max(3 * self.waves // 4, self.torsion.fold))
        larger = self._species_levels(self.torsion, self.waves)
        size = min(map(len, smaller))
        change = max(float(np.abs(a[:size] - b[:size]).max()) for a, b in zip(smaller, larger, strict=True))
        largest = float(self.torsion.kinetic.values(np.zeros(1))[0]) * self.waves**2 + self.torsion.barrier_mhz
        rest = self.misfit_cm * units.MHZ_PER_CM if self.scan is not None else 0.0
        return ErrorBudget(
            "torsional levels",
            "MHz",
            ErrorTerm(8 * float(np.finfo(float).eps) * largest, "eigenvalues"),
            ErrorTerm(
                change + rest,
                f"functions up to m = {self.waves}, from three quarters of them, and terms of the Fourier series",
            ),
            ErrorTerm(None, "coupling with other vibrations and with the rotation of the whole"),
            self._error_of_potential(larger),
            ErrorTerm(0.0, "nothing is sampled"),
        )

    def _error_of_potential(self, levels: list[Floats]) -> ErrorTerm:
        """The shift of levels (of each species) above the lowest one by one standard deviation of the potential, where that is known."""
        if self.scan is not None:
            relative, why, hint = self.scan.relative_error, self.scan.doubt, "measured levels or a better calculator"
            unknown = "the error of the scanned energies is not known"
        else:
            barrier = similar_barrier(self.rotation) if self.request.potential == TABLE else None
            relative, why, hint = barrier.relative_error(self.rotation.molecule) if barrier else 0.0, self.source, ""
            unknown = "the potential has no stated error"
        if not relative:
            return ErrorTerm(None, unknown, hint)
        potential = self.torsion.potential
        changed = replace(potential, cosines=potential.cosines * (1 + relative), sines=potential.sines * (1 + relative))
        other = self._species_levels(replace(self.torsion, potential=changed), self.waves)
        shifts = [(new - other[0][0]) - (old - levels[0][0]) for new, old in zip(other, levels, strict=True)]
        return ErrorTerm(float(np.abs(np.concatenate(shifts)).max()), f"levels above the lowest, {why}", hint)

    def _species_levels(self, torsion: BondTorsion, waves: int) -> list[Floats]:
        """Levels up to vmax of each species, MHz above the foot of the potential."""
        return [torsion.states(species, waves)[0][: self.request.vmax + 1] for species in range(torsion.fold)]

    def facts(self) -> dict[str, Any]:
        """Facts of the answer except its tables, by the keys of docs/verbs."""
        torsion, potential = self.torsion, self.torsion.potential
        moments = units.ROTATIONAL_MHZ_U_ANGSTROM2 / torsion.sampled()[1]
        wells, levels = torsion.wells(), self.levels
        return {
            **top_facts(self.request.top),
            "bond": self.request.bond,
            "turning_atoms": (self.rotation.top + 1).tolist(),
            "potential_source": self.source,
            "potential_cosines_cm": dict(zip(map(str, potential.n.tolist()), (potential.cosines / units.MHZ_PER_CM).tolist(), strict=True)),
            "potential_sines_cm": dict(zip(map(str, potential.n.tolist()), (potential.sines / units.MHZ_PER_CM).tolist(), strict=True)),
            "barrier_cm": torsion.barrier_mhz / units.MHZ_PER_CM,
            "wells": [
                {"angle_degrees": math.degrees(well.angle), "energy_cm": well.energy_mhz / units.MHZ_PER_CM,
                 "harmonic_cm": well.quantum_mhz / units.MHZ_PER_CM} for well in wells
            ],
            "reduced_moment_u_angstrom2": self.rotation.reduced_moment(),
            "reduced_moment_range_u_angstrom2": [float(moments.min()), float(moments.max())],
            "f_mhz": units.ROTATIONAL_MHZ_U_ANGSTROM2 / self.rotation.reduced_moment(),
            "fold": torsion.fold,
            "symmetry_number": self.symmetry_number,
            "zero_point_cm": float(levels.energy_cm.min()),
            "scan_misfit_cm": self.misfit_cm if self.scan is not None else None,
            "scan_closure_cm": self.scan.closure_cm if self.scan is not None else None,
            "waves": self.waves,
            "errors": self.errors.as_json(),
            "classical": self.classical.facts() if self.classical else None,
        }  # fmt: skip

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about the scan: a barrier far from the measured one, and a path that does not close."""
        if self.scan is None:
            return ()
        barrier, molecule = self.torsion.barrier_mhz / units.MHZ_PER_CM, self.rotation.molecule
        measured, texts = similar_barrier(self.rotation), list[str]()
        if measured is not None and abs(measured.v3_cm - barrier) > max(FAR * measured.v3_cm, 1.0):
            texts.append(
                f"the scanned barrier is {barrier:.4g} cm⁻¹, the measured V3 {measured.v3_cm:g} cm⁻¹, {measured.text(molecule)}: the "
                f"potential '{TABLE}' takes that"
            )
        if abs(self.scan.closure_cm) >= max(1.0, 0.01 * barrier):
            texts.append(
                f"the scan does not close: after a whole period the energy differs by {self.scan.closure_cm:.3g} cm⁻¹, so that another "
                "part of the molecule has moved into another valley; start from its lowest conformer"
            )
        return tuple(texts)


def answer_torsion(request: TorsionRequest, progress: Progress | None = None) -> TorsionAnswer:
    """Compute the torsion of a request. progress: called with the numbers of scan points done and in total.

    >>> from rotor.molecules.readers.read import read_molecule
    >>> from rotor.tops.top import Top
    >>> answer = answer_torsion(TorsionRequest(Top.from_molecule(read_molecule("C2H6")), "1-2", "V3=1013 cm-1", vmax=0))
    >>> answer.symmetry_number, round(answer.facts()["barrier_cm"], 6)
    (3, 1013.0)
    """
    rotation = request.rotation
    potential, kinetic, source, scan, misfit = potential_and_kinetic(
        request.potential, request.points, rotation, progress
    )
    fold = int(np.gcd.reduce([rotation.symmetry_number(), *(int(n) for n in (*potential.n, *kinetic.n))]))
    torsion = BondTorsion(kinetic, potential, fold)
    wells = max(1, len(torsion.wells()))
    highest = 4 * float(kinetic.values(np.zeros(1))[0]) * ((request.vmax + 1) * max(wells, fold)) ** 2
    return TorsionAnswer(request, rotation, torsion, source, scan, misfit, torsion.waves_for(highest))


def _shares(torsion: BondTorsion, vectors: NDArray[np.complex128], m: Ints) -> Floats:
    """Probabilities (levels, wells) between neighbouring maxima of V."""
    angles = torsion.sampled()[0]
    density = np.abs(np.exp(1j * np.outer(angles, m)) @ vectors) ** 2 / len(angles)
    place = np.searchsorted(torsion.potential.extrema(-1.0), angles)
    wells = place % max(1, len(torsion.wells()))
    return np.array([density[wells == i].sum(axis=0) for i in range(len(torsion.wells()))]).T


def _real(waves: NDArray[np.complex128]) -> Floats:
    """Real functions (angles, levels) of norm 1: real at the largest value; √2 Re for a running wave."""
    size = np.abs(waves)
    peak = np.argmax(size > (1 - 1e-6) * size.max(axis=0), axis=0)  # the first of equal maxima
    phase = waves[peak, np.arange(waves.shape[1])]
    real = (waves * np.conj(phase / np.abs(phase))).real
    norm = np.sqrt(2 * np.pi * np.mean(real**2, axis=0))
    return np.asarray(real / norm)
