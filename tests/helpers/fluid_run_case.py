"""A short run of a box of water, with its files."""

import numpy as np

from rotor.fluids.forces.models import find_model
from rotor.fluids.initial_box import lattice_box
from rotor.fluids.run import Outputs
from rotor.fluids.settings import Settings

SETTINGS = Settings(steps=60, every=4, step_fs=1.0, cutoff_angstrom=4.5, friction_per_ps=5.0)

FILES = Outputs(csv="run.csv", trajectories=("run.traj", "run.xyz"), checkpoint="run.npz", checkpoint_every=14)


def box(molecules=27, seed=3):
    """A thin vapour of SPC/E water that needs no relaxing."""
    return lattice_box(find_model("spce"), molecules, 0.3, np.random.default_rng(seed))
