"""Energy, forces and stress of rigid molecules as an ASE calculator: Lennard-Jones sites, charges, a cutoff by sites.

Charges interact by reaction field, damped shifted forces, or Ewald sum. The Lennard-Jones part is switched off over the last
ångström before the cutoff, so that forces are smooth and a run at 2 fs conserves its energy; the removed part is added back for a
uniform liquid. The stress is molecular: Σ F_ij ⊗ R_ij with centres of mass R, to which the dynamics of rigid bodies adds the kinetic part
of the centres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from ase.calculators.calculator import Calculator, PropertyNotImplementedError, all_changes

from rotor.arrays import Floats
from rotor.fluids.forces.assembly import Assembly, assemble
from rotor.fluids.forces.ewald import (
    EwaldParameters,
    WaveVectors,
    fourier_virial,
    parameters_for,
    self_energy,
    wave_vectors,
)
from rotor.fluids.forces.interactions import PairTables, pair_tables, reaction_field, screened, switched, tail
from rotor.fluids.forces.models import RigidModel, find_models
from rotor.fluids.forces.neighbours import CLOSEST_ANGSTROM, Neighbours
from rotor.fluids.settings import ELECTROSTATICS

VOIGT = [0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]


@dataclass(frozen=True)
class Evaluation:
    """Results for a set of positions.

    terms_ev: energies by name. forces_ev_per_angstrom: (atoms, 3). virial_ev: (3, 3) molecular, Σ F_ij ⊗ R_ij, symmetric part,
    without the tail. tail_pressure_ev_per_angstrom3: of the dispersion beyond the cutoff.
    """

    terms_ev: dict[str, float]
    forces_ev_per_angstrom: Floats
    virial_ev: Floats
    tail_pressure_ev_per_angstrom3: float

    @property
    def energy_ev(self) -> float:
        """The sum of all terms."""
        return math.fsum(self.terms_ev.values())


class RigidPotential(Calculator):
    """Lennard-Jones and charges between rigid molecules: an ASE calculator.

    Parameters
    ----------
    models : str, RigidModel or sequence of them
        Names of `rotor.fluids.forces.models.MODELS` (several joined by commas for a mixture), or other models.
    cutoff_angstrom : float
        Cutoff of site distances; inf for a non-periodic box.
    electrostatics : str
        reaction-field, ewald or shifted.
    dielectric : float
        Dielectric constant outside the reaction-field sphere; inf for a conductor.
    switch_width_angstrom : float
        Width of the Lennard-Jones switch; 0 for a hard cut.
    damping_per_angstrom : float
        Damping of shifted forces.
    ewald : EwaldParameters, optional
        α and k_cut; without it they follow from `tolerance` (`rotor.fluids.forces.ewald.parameters_for`).
    tolerance : float
        Relative error of the forces of Ewald's sum.
    long_range_correction : bool
        Whether the dispersion beyond the cutoff is added.
    skin_angstrom : float
        Skin of the neighbour lists.
    threads : int
        Results are reproducible bit for bit with the same number of threads and the same history; `reset()` discards the lists, so
        that a run can be continued bit for bit.

    Notes
    -----
    Molecules may be broken by the cell's edges. Cells have right angles; directions without pbc are open.

    >>> from ase import Atoms
    >>> pair = Atoms("Ar2", positions=[(0, 0, 0), (3.405 * 2 ** (1 / 6), 0, 0)])
    >>> pair.calc = RigidPotential("argon", cutoff_angstrom=float("inf"))
    >>> round(pair.get_potential_energy() / 8.617333262e-5, 3)  # minus the depth, in K
    -119.8
    """

    implemented_properties = ["energy", "forces", "stress"]  # noqa: RUF012

    def __init__(
        self, models: str | RigidModel | Sequence[str | RigidModel] = "spce", *, cutoff_angstrom: float = 9.0,
        electrostatics: str = "reaction-field", dielectric: float = math.inf, switch_width_angstrom: float = 1.0,
        damping_per_angstrom: float = 0.2, ewald: EwaldParameters | None = None, tolerance: float = 1e-5,
        long_range_correction: bool = True, skin_angstrom: float = 2.0, threads: int = 1, **kwargs: Any,
    ) -> None:  # fmt: skip
        self.models = find_models(models)
        self.cutoff_angstrom, self.electrostatics, self.dielectric = cutoff_angstrom, electrostatics, dielectric
        self.switch_width_angstrom, self.damping_per_angstrom = switch_width_angstrom, damping_per_angstrom
        self.ewald, self.tolerance = ewald, tolerance
        self.long_range_correction, self.skin_angstrom, self.threads = long_range_correction, skin_angstrom, threads
        self._check()
        self._tables: PairTables = pair_tables(self.models)
        self._assembly: Assembly | None = None
        self._known: Any = None
        self._neighbours: Neighbours | None = None
        self._waves: WaveVectors | None = None
        self._ewald: EwaldParameters | None = None
        self._tail = (0.0, 0.0)
        self._cut, self._field = switched(cutoff_angstrom, switch_width_angstrom), np.zeros(6)
        self._pool: ThreadPoolExecutor | None = None
        self.last: Evaluation | None = None
        super().__init__(**kwargs)

    def _check(self) -> None:
        for name in ("cutoff_angstrom", "damping_per_angstrom", "skin_angstrom", "dielectric", "threads"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} = {getattr(self, name)}: expected a number above 0")
        if self.electrostatics not in ELECTROSTATICS:
            raise ValueError(
                f"{self.electrostatics!r}: expected a treatment of charges, one of {', '.join(ELECTROSTATICS)}"
            )
        if math.isinf(self.cutoff_angstrom) and self.electrostatics != "reaction-field":
            raise ValueError("a cutoff of inf is for open boxes with the reaction field (which is then none)")
        if not 0 <= self.switch_width_angstrom < self.cutoff_angstrom:
            raise ValueError(f"switch_width_angstrom = {self.switch_width_angstrom}: expected 0 up to the cutoff")

    def reset(self) -> None:
        """Discard results, lists and data of this box: the next forces are bit for bit those of a new calculator."""
        super().reset()
        self._assembly = self._neighbours = self._ewald = None

    def check_state(self, atoms: Any, tol: float = 0.0) -> list[str]:
        """Changes since the last calculation, compared exactly (called by ASE)."""
        old: Any = self.atoms
        if old is None or not _same_atoms(old, atoms):
            return list(all_changes)
        now = {"positions": atoms.positions, "cell": atoms.cell.array, "pbc": atoms.pbc}
        was = {"positions": old.positions, "cell": old.cell.array, "pbc": old.pbc}
        return [name for name in now if not np.array_equal(now[name], was[name])]

    def get_property(self, name: str, atoms: Any = None, allow_calculation: bool = True) -> Any:
        """A property of atoms, cached if nothing changed (called by ASE); changes do not discard the lists."""
        if name not in self.implemented_properties:
            raise PropertyNotImplementedError(f"{name}: there are {', '.join(self.implemented_properties)}")
        if atoms is not None and self.check_state(atoms):
            self.results = {}
        if name not in self.results:
            if not allow_calculation:
                return None
            self.calculate(atoms)
        if name not in self.results:
            raise PropertyNotImplementedError(f"{name} is there for a box that repeats in all directions (pbc)")
        return np.copy(self.results[name]) if name != "energy" else self.results[name]

    def calculate(
        self, atoms: Any = None, properties: Sequence[str] = ("energy",), system_changes: Sequence[str] = all_changes
    ) -> None:
        """Fill `results` with all properties."""
        box: Any = self.atoms if atoms is None else atoms
        if box is None:
            raise ValueError("no atoms were given to this calculator yet")
        evaluation = self.last = self.evaluate(box)
        self.results = {"energy": evaluation.energy_ev, "forces": evaluation.forces_ev_per_angstrom}
        if box.pbc.all():
            volume = float(box.cell.array.diagonal().prod())
            stress = -(evaluation.virial_ev / volume)[VOIGT]
            stress[:3] -= evaluation.tail_pressure_ev_per_angstrom3
            self.results["stress"] = stress
        self._remember(box)

    def _remember(self, atoms: Any) -> None:
        """Keep a copy for `check_state`; most often only positions changed."""
        remembered: Any = self.atoms
        if remembered is None or not _same_atoms(remembered, atoms):
            self.atoms = atoms.copy()
            return
        remembered.positions[:] = atoms.positions
        remembered.cell[:] = atoms.cell.array
        remembered.pbc[:] = atoms.pbc

    @property
    def rebuilds(self) -> int:
        """Number of times the lists of this box were built."""
        return self._neighbours.rebuilds if self._neighbours else 0

    @property
    def terms_ev(self) -> dict[str, float]:
        """Energies by name of the last calculation: dispersion, long_range_correction, reaction_field, shifted, or
        real_space, fourier, self, intramolecular."""
        if self.last is None:
            raise ValueError("no energy was asked for yet")
        return dict(self.last.terms_ev)

    def evaluate(self, atoms: Any) -> Evaluation:
        """Energies, forces and virial of atoms."""
        neighbours = self._prepared(atoms)
        neighbours.update(np.ascontiguousarray(atoms.positions, dtype=float))
        forces, totals = self._pair_sum(neighbours)
        centres = self._mass_centres(neighbours, atoms.get_masses())
        virial = self._pair_virial(neighbours, forces, totals, centres)
        volume = math.prod(neighbours.box_angstrom.tolist())
        terms = {"dispersion": float(totals[0])}
        if volume and self.long_range_correction:
            terms["long_range_correction"] = float(self._tail[0] / volume)
        name = {"reaction-field": "reaction_field", "ewald": "real_space", "shifted": "shifted"}[self.electrostatics]
        terms[name] = float(totals[1])
        if self.electrostatics == "ewald":
            virial += self._ewald_rest(neighbours, forces, centres, terms)
        pressure = self._tail[1] / volume**2 if volume and self.long_range_correction else 0.0
        return Evaluation(terms, self._on_atoms(neighbours, forces), 0.5 * (virial + virial.T), pressure)

    def _prepared(self, atoms: Any) -> Neighbours:
        """The lists for this box; data that depend on atoms and cell are recomputed if these changed."""
        if self._assembly is None or not _same_atoms(self._known, atoms):
            self._assembly, self._known = assemble(atoms, self.models), atoms.copy()
            self._neighbours, self._ewald = None, self.ewald
            if not math.isinf(self.cutoff_angstrom):
                self._tail = tail(self.models, self._assembly.numbers, self.cutoff_angstrom, self.switch_width_angstrom)
        box = right_angled(atoms)
        if self._neighbours is None or not np.array_equal(box, self._neighbours.box_angstrom):
            self._refuse_open_box(box)
            rebuilds = self._neighbours.rebuilds if self._neighbours else 0
            self._neighbours = Neighbours(self._assembly, box, self.cutoff_angstrom, self.skin_angstrom, rebuilds)
            if self.electrostatics == "ewald":
                charges = self._assembly.charges_e
                self._ewald = self._ewald or parameters_for(
                    self.tolerance, self.cutoff_angstrom, charges[charges != 0], box
                )
                self._waves = wave_vectors(self._ewald, box)
            self._field = self._charge_parameters()
        return self._neighbours

    def _refuse_open_box(self, box: Floats) -> None:
        if math.isinf(self.cutoff_angstrom) and box.any():
            raise ValueError("a cell that repeats needs a finite cutoff, at most half its smallest edge")
        if self.electrostatics == "ewald" and not box.all():
            raise ValueError("Ewald's sum needs a cell that repeats in all three directions (pbc)")

    def _charge_parameters(self) -> Floats:
        """Parameters of the kernel of charges."""
        if self.electrostatics == "reaction-field":
            return reaction_field(self.cutoff_angstrom, self.dielectric)
        if self.electrostatics == "shifted":
            return screened(self.cutoff_angstrom, self.damping_per_angstrom, shifted=True)
        assert self._ewald is not None
        return screened(self.cutoff_angstrom, self._ewald.alpha_per_angstrom, shifted=False)

    def _run(self, jobs: Sequence[Any]) -> list[Any]:
        """Results of the jobs, in their order."""
        if self.threads == 1:
            return [job() for job in jobs]
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.threads)
        return [future.result() for future in [self._pool.submit(job) for job in jobs]]

    def _pair_sum(self, neighbours: Neighbours) -> tuple[Floats, Floats]:
        """Forces on all sites, and energies and virial of the pairs."""
        from rotor.fluids.forces import _pair_kernels

        a, t = neighbours.assembly, self._tables
        forces = np.zeros((self.threads, *neighbours.sites.shape))
        totals = np.zeros((self.threads, 8))
        bounds = [len(a) * i // self.threads for i in range(self.threads + 1)]
        reach2 = (neighbours.within_angstrom**2).ravel()

        def share(i: int) -> None:
            _pair_kernels.pair_forces(
                bounds[i], bounds[i + 1], neighbours.starts, neighbours.entries, neighbours.images, reach2,
                neighbours.local.ravel(), neighbours.centres, a.first_site, a.kinds, a.counts,
                t.starts, t.sites, t.numbers, self._cut, self._field, self.electrostatics != "reaction-field",
                forces[i].ravel(), totals[i],
            )  # fmt: skip

        self._run([lambda i=i: share(i) for i in range(self.threads)])
        if not np.isfinite(totals).all():
            closest = neighbours.closest(2 * a.reach_angstrom.max() + CLOSEST_ANGSTROM)
            near = (
                f"atoms {closest[1]} and {closest[2]} are {closest[0]:.3g} Å apart" if closest else "no atoms are near"
            )
            raise ValueError(f"the energy is not finite; {near}")
        return (forces[0], totals[0]) if self.threads == 1 else (forces.sum(axis=0), totals.sum(axis=0))

    def _mass_centres(self, neighbours: Neighbours, masses: Floats) -> Floats:
        """Centres of mass, near the molecules' sites."""
        from rotor.fluids.forces import _pair_kernels

        a, centres = neighbours.assembly, np.empty((len(neighbours.assembly), 3))
        _pair_kernels.mass_centres(neighbours.sites, a.first_atom, a.first_site, masses, centres)
        return centres

    def _pair_virial(self, neighbours: Neighbours, forces: Floats, totals: Floats, centres: Floats) -> Floats:
        """Σ F ⊗ R with centres of mass: the sum over list's centres, and Σ F (R - c) of each molecule's total force."""
        from rotor.fluids.forces import _pair_kernels

        xx, yy, zz, yz, xz, xy = totals[2:].tolist()
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        first_site = neighbours.assembly.first_site
        return tensor + _pair_kernels.lever_tensor(forces, centres, neighbours.centres, first_site, True)

    def _ewald_rest(self, neighbours: Neighbours, forces: Floats, centres: Floats, terms: dict[str, float]) -> Floats:
        """Add Fourier, self and intramolecular terms to forces and terms; the molecular virial of the Fourier part."""
        from rotor.fluids.forces import _ewald_kernels, _pair_kernels
        from rotor.fluids.forces.ewald import COULOMB_EV_ANGSTROM

        assert self._waves is not None
        assert self._ewald is not None
        a, waves, alpha = neighbours.assembly, self._waves, self._ewald.alpha_per_angstrom
        charged = np.flatnonzero(a.charges_e)
        bounds = np.linspace(0, len(charged), self.threads + 1).astype(int)
        parts = [charged[bounds[i] : bounds[i + 1]] for i in range(self.threads)]
        factors = np.zeros((self.threads, len(waves.weights_ev), 2))
        pushed = np.zeros_like(forces)
        turn, columns, highest = waves.turn_per_angstrom, waves.columns, waves.highest
        phases = [_ewald_kernels.unit_phases(neighbours.sites, part, turn) for part in parts]
        charges = [a.charges_e[part] for part in parts]

        def sum_up(i: int) -> None:
            _ewald_kernels.structure_factors(phases[i], charges[i], highest, columns, factors[i])

        def push(i: int) -> None:
            _ewald_kernels.fourier_forces(phases[i], parts[i], charges[i], turn, highest, columns, weighted, pushed)

        self._run([lambda i=i: sum_up(i) for i in range(self.threads)])
        structure = factors.sum(axis=0)
        energies = waves.weights_ev * np.sum(structure**2, axis=1)
        weighted = 2 * waves.weights_ev[:, None] * structure
        self._run([lambda i=i: push(i) for i in range(self.threads)])
        virial = fourier_virial(waves, energies, alpha)
        virial -= _pair_kernels.lever_tensor(pushed, neighbours.sites, centres, a.first_site, False)
        forces += pushed
        terms["fourier"] = float(energies.sum())
        terms["self"] = self_energy(alpha, a.charges_e)
        terms["intramolecular"] = _ewald_kernels.inner_correction(
            neighbours.sites, a.first_site, a.charges_e, alpha, COULOMB_EV_ANGSTROM, forces
        )
        return virial

    def _on_atoms(self, neighbours: Neighbours, forces: Floats) -> Floats:
        from rotor.fluids.forces import _pair_kernels

        a = neighbours.assembly
        out = np.empty((a.first_atom[-1], 3))
        _pair_kernels.carry_to_atoms(forces, a.first_atom, a.first_site, a.kinds, a.weights, a.atoms, a.counts, out)
        return out


def _same_atoms(old: Any, new: Any) -> bool:
    """Whether elements and labels of molecules are the same."""
    was, now = old.arrays.get("molecule"), new.arrays.get("molecule")
    same_labels = was is now or (was is not None and now is not None and np.array_equal(was, now))
    return same_labels and np.array_equal(old.numbers, new.numbers)


def right_angled(atoms: Any) -> Floats:
    """Edges of the cell, Å, 0 along directions without pbc; ValueError unless all angles are 90°."""
    cell, repeats = atoms.cell.array.tolist(), atoms.pbc.tolist()
    edges = [cell[c][c] for c in range(3)]
    askew = max(abs(cell[c][d]) for c in range(3) for d in range(3) if c != d)
    if any(repeats) and not askew <= 1e-10 * max(1.0, *edges):
        raise ValueError(
            f"angles of the cell are {np.round(atoms.cell.angles(), 4).tolist()} degrees; expected right angles along x, y, z"
        )
    if any(repeat and not edge > 0 for repeat, edge in zip(repeats, edges, strict=True)):
        raise ValueError(f"edges of the cell are {edges} Å; periodic directions (pbc) need an edge above 0")
    return np.array([edge if repeat else 0.0 for repeat, edge in zip(repeats, edges, strict=True)])
