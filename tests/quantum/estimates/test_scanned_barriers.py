"""Barriers of methyl groups by a scan with MMFF94: independent of the side that turns, and as far off as answers say."""

from __future__ import annotations

import re

import numpy as np
import pytest

import rotor
from rotor.molecules import bond_scan
from rotor.molecules.bonds import bonded_atoms
from rotor.quantum.estimates.methyl_groups import barrier_beside
from rotor.quantum.internal_rotation.from_geometry import with_internal_rotation
from rotor.units import MHZ_PER_CM

MOLECULES = (
    "CO", "COC=O", "CSC=O", "CSC", "CS", "CN", "CC=O", "CC(=O)O", "CC=C", "CC=C=O", "Cc1ccc(C)s1", "CCC", "COCC#C",
)  # fmt: skip


@pytest.mark.parametrize("bond", ["1-2", "2-1"])
def test_a_scanned_barrier_is_the_energy_of_the_top_of_the_scan(bond):
    """V3 + V9 + ... is the energy at 60°; terms by sums over the angles of a relaxed scan, which are not equidistant, made it 585 cm⁻¹."""
    top = with_internal_rotation(rotor.read("SMILES:CC=C"), "mmff")
    torsion = rotor.torsion("SMILES:CC=C", bond=bond).torsion
    assert top.internal_rotation.values["V3"] == pytest.approx(torsion.barrier_mhz, rel=5e-3)


@pytest.mark.slow
def test_the_stated_error_is_that_of_the_table():
    """|V3(MMFF94)/V3 - 1| of the molecules of the table with a threefold barrier: the median, and the worst as a factor."""
    errors, factors = [], []
    for smiles in MOLECULES:
        read = rotor.read(f"SMILES:{smiles}")
        barrier = barrier_beside(read.molecule, bonded_atoms(read.molecule), 0)
        assert barrier.is_of(read.molecule)
        scanned = rotor.torsion(read, bond="2-1").torsion.barrier_mhz / MHZ_PER_CM
        errors.append(abs(scanned / barrier.v3_cm - 1))
        factors.append(max(scanned / barrier.v3_cm, barrier.v3_cm / scanned))
    assert len(errors) == int(re.search(r"half of (\d+) barriers", bond_scan.MMFF_DOUBT)[1])
    assert np.median(errors) == pytest.approx(bond_scan.MMFF_ERROR, abs=0.01)
    assert f"a factor of {max(factors):.0f}" in bond_scan.MMFF_DOUBT
