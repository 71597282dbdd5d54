"""Calculators and boxes for the tests of the fluid: smooth, cheap, with closed forms."""

import numpy as np
from ase import Atoms
from ase.build import molecule
from ase.calculators.calculator import Calculator, all_changes

from rotor.geometry import rotations


class Springs(Calculator):
    """Every atom on a spring to its anchor: E = ½ k Σ |r - a|², k one number or one for each atom."""

    implemented_properties = ("energy", "forces")

    def __init__(self, anchors, k):
        super().__init__()
        self.anchors, self.k = np.array(anchors), np.broadcast_to(k, len(anchors))[:, None]

    def calculate(self, atoms=None, properties=("energy",), system_changes=all_changes):
        super().calculate(atoms, properties, system_changes)
        away = atoms.positions - self.anchors
        self.results = {"energy": float(0.5 * np.sum(self.k * away**2)), "forces": -self.k * away}


class Free(Springs):
    """No forces at all."""

    def __init__(self, atoms):
        super().__init__(atoms.positions, 0.0)


class SoftSites(Calculator):
    """Smooth bumps between atoms of different molecules, nearest images: E = Σ c_i c_j exp(-r²/2w²); at half a cell 1e-7 of it."""

    implemented_properties = ("energy", "forces", "stress")

    def __init__(self, strength=0.5, width=0.55):
        super().__init__()
        self.strength, self.width = strength, width

    def calculate(self, atoms=None, properties=("energy",), system_changes=all_changes):
        super().calculate(atoms, properties, system_changes)
        edge = atoms.cell.lengths()
        apart = atoms.positions[:, None] - atoms.positions[None]
        apart -= edge * np.round(apart / edge)
        charge = np.where(atoms.numbers == 1, -0.6, 1.0)
        other = atoms.arrays["molecule"][:, None] != atoms.arrays["molecule"][None]
        bump = self.strength * np.outer(charge, charge) * other
        bump = bump * np.exp(-0.5 * np.sum(apart**2, axis=-1) / self.width**2)
        pulls = bump[..., None] * apart / self.width**2
        stress = -0.5 * np.einsum("ijk,ijl->kl", pulls, apart) / atoms.get_volume()
        self.results = {
            "energy": float(0.5 * bump.sum()),
            "forces": pulls.sum(axis=1),
            "stress": stress.ravel()[[0, 4, 8, 5, 2, 1]],
        }


def box_of(*names, spacing=3.2, seed=1):
    """Molecules of ASE's set (or atoms), turned at random, on a cubic lattice with periodic edges."""
    rng = np.random.default_rng(seed)
    across = int(np.ceil(len(names) ** (1 / 3) - 1e-9))
    box = Atoms(cell=[across * spacing] * 3, pbc=True)
    labels = []
    for number, (name, site) in enumerate(zip(names, np.ndindex(across, across, across), strict=False)):
        atoms = Atoms(name) if name == "Ar" else molecule(name)
        atoms.positions = rotations.rotate(rotations.uniform(rng=rng), atoms.positions - atoms.positions.mean(axis=0))
        atoms.positions += (np.array(site) + 0.5) * spacing
        box += Atoms(atoms.get_chemical_symbols(), atoms.positions)
        labels += [number] * len(atoms)
    box.arrays["molecule"] = np.array(labels)
    return box


MIXED = ("H2O", "N2", "Ar", "CO2", "CH4", "NH3", "H2O", "Ar")
