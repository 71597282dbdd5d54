"""Peak lists with 13C species of a known molecule in natural abundance, for `bench_assign.py --isotopologues`.

The geometry of a SMILES by its force field is the truth; the search gets it strained by about 1 %. The parent has a signal-to-noise
ratio of 1000.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from broadband_cases import LOWEST, Species, case_with, lines_of, quartic

from rotor.assignment.peaks.peak_list import PeakList, peak_list
from rotor.molecules.molecule import Molecule
from rotor.molecules.readers.smiles import from_smiles
from rotor.tops.isotopes.isotopologues import isotopologues
from rotor.tops.top import Top

SMILES = (
    "COc1ccccc1", "CC(=O)c1ccccc1", "CC1CCCCC1=O", "CC1=CCC(CC1)C(C)=C", "COc1ccccc1O",
    "O=Cc1ccc(OC)cc1", "OC1CCCCC1C", "CC1CCC(C(C)C)CC1=O", "C1CCc2ncccc2C1", "CCOC(=O)C1CC1",
)  # fmt: skip
SIGNAL_TO_NOISE, TEMPERATURE_K, BAND_MHZ, STRAIN = 1000.0, 2.0, (6000.0, 18000.0), 0.01
CARBON_13 = 5e-3  # least abundance: 13C, no 18O


@dataclass(frozen=True)
class IsotopologueCase:
    """A list, the strained geometry, and constants (3,) of the parent and by label of the 13C species, with the
    number of their lines above six times the noise, blends among them."""

    smiles: str
    peaks: PeakList
    molecule: Molecule
    parent: tuple[float, ...]
    substituted: dict[str, tuple[float, ...]]
    visible: dict[str, int]


def isotopologue_cases() -> Iterator[IsotopologueCase]:
    """One for each molecule."""
    for seed, smiles in enumerate(SMILES):
        yield _case(smiles, np.random.default_rng([seed, 13]))


def _case(smiles: str, rng: np.random.Generator) -> IsotopologueCase:
    molecule = from_smiles(smiles)
    top = Top.from_molecule(molecule)
    rigid = np.array([top.constants[name] for name in "ABC"])
    distortion = quartic(rigid, rng)
    dipole = (rng.permutation([2.0, 0.6, 0.3]) * rng.uniform(0.7, 1.3, 3)).round(3)
    components = (float(dipole[0]), float(dipole[1]), float(dipole[2]))
    singles = [
        isotopologue
        for isotopologue in isotopologues(top, min_abundance=CARBON_13)[1:]
        if len(isotopologue.substituted) == 1
    ]
    none, floor = np.zeros((0, 4)), LOWEST * 100 / SIGNAL_TO_NOISE
    species = [Species(np.concatenate([rigid, distortion]), components, 1.0, none)]
    whole = isotopologues(top, min_abundance=CARBON_13)[0].abundance
    truth, visible = dict[str, tuple[float, ...]](), dict[str, int]()
    for single in singles:
        changed = np.array([single.top.constants[name] for name in "ABC"])
        quartics = distortion * ((changed[1:] / rigid[1:]).mean() ** 2)
        species.append(Species(np.concatenate([changed, quartics]), components, single.abundance / whole, none, 0))
        truth[single.label] = tuple(changed.tolist())
        visible[single.label] = len(lines_of(species[-1], TEMPERATURE_K, BAND_MHZ, floor)[0])
    rows = case_with(0, BAND_MHZ, TEMPERATURE_K, SIGNAL_TO_NOISE, floor, species, 1, rng).peaks
    strain = rng.normal(size=(3, 3)) * STRAIN
    moved = molecule.positions_angstrom @ (np.eye(3) + (strain + strain.T) / 2)
    guess = replace(molecule, positions_angstrom=moved)
    return IsotopologueCase(smiles, peak_list(*rows.T, band_mhz=BAND_MHZ), guess, tuple(rigid.tolist()), truth, visible)
