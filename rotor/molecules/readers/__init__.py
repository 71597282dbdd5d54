"""Molecules from files, SMILES, ASE and RDKit objects, and quantum-chemistry output."""
