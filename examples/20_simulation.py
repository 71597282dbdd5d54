# %% [markdown]
# # A box of water: is my simulation right?
#
# For whoever runs molecular dynamics. Rigid water molecules attract and repel in a periodic box; this notebook makes a liquid, looks at
# its temperatures, and shows how the length of the step and the cutoff change what comes out.

# %%
import matplotlib.pyplot as plt
import numpy as np

import rotor

# %matplotlib inline

rotor.api.use_style()

# %% [markdown]
# ## A liquid
#
# 64 molecules of SPC/E at the density of the liquid. The box is made on a lattice and equilibrated with a thermostat for 2 ps; the run
# that follows has constant energy. A real run takes more molecules and a longer equilibration: leave `equilibration` out, and the
# thermostat acts until the energy shows no trend.

# %%
box = {"molecules": 64, "cutoff_angstrom": 6.0, "equilibration": 2.0, "seed": 3}
run = rotor.fluid("water", steps=1000, every=5, **box)
run.plot()

# %% [markdown]
# ## Three temperatures
#
# The kinetic energy of the translations and that of the rotations each give a temperature. In equilibrium they are equal; where they
# differ by more than their scatter, the run is not stationary, the step is too long, or degrees of freedom are counted wrongly.

# %%
rows = run.to_pandas()
spread = rows[["temperature_k", "translation_k", "rotation_k"]].agg(["mean", "std"])
spread.round(1)

# %%
assert (
    abs(spread.translation_k["mean"] - spread.rotation_k["mean"]) < 60
)  # K: 1 ps of 64 molecules has a scatter of about 30
assert spread.temperature_k["mean"] > 200

# %% [markdown]
# With N molecules the temperature itself scatters: the variance of the kinetic energy of f degrees of freedom is $f (kT)^2/2$, so the
# relative scatter is $\sqrt{2/f}$, at constant energy less, since potential energy takes it up. The scatter is not an error.

# %%
degrees = 6 * 64 - 3
scatter = spread.temperature_k["std"] / spread.temperature_k["mean"]
print(f"canonical scatter {np.sqrt(2 / degrees):.1%}, in this run {scatter:.1%}")

# %% [markdown]
# ## The step
#
# The energy of a correct run at constant energy is conserved up to an oscillation that shrinks with the square of the step. That is the
# test of forces and integrator: a drift, or an error that does not shrink, means a mistake.

# %%
steps_fs = np.array([4.0, 2.0, 1.0])
errors = []
for step in steps_fs.tolist():
    energy = rotor.fluid("water", steps=int(400 / step), every=1, step_fs=step, **box).to_pandas().total_ev
    errors.append(96.485 / 64 * float((energy - energy.mean()).std()))

figure, axes = plt.subplots(figsize=(5, 3.2), layout="constrained")
axes.loglog(steps_fs, errors, "o-", label="64 molecules of SPC/E")
axes.loglog(steps_fs, errors[0] * (steps_fs / steps_fs[0]) ** 2, color="black", lw=0.7, ls=":", label="slope 2")
axes.set(
    xlabel="Step (fs)", ylabel="Error of the energy, rms\nper molecule (kJ/mol)", title="Conserved energy over 0.4 ps"
)
axes.set_xticks(steps_fs, [f"{step:g}" for step in steps_fs])
axes.minorticks_off()
axes.legend()

# %%
assert errors[0] / errors[1] > 2.5  # 4 for an error of order h²; the beginning of the run differs
assert errors[1] / errors[2] > 2.5

# %% [markdown]
# `rotor accuracy` does this for every setting of a scene, and `accuracy = "0.1 K"` in a scene chooses the step.
#
# ## Is every degree of freedom at one temperature?
#
# The equipartition test compares each translation and each rotation with what chance allows. Here it looks at a classical gas, drawn
# from the Boltzmann distribution: it has to pass. With the trajectory of your own engine the same test finds "flying ice cubes",
# wrong thermostats and rotations that are colder than translations.

# %%
gas = rotor.gas("water", molecules=20_000)
gas.plot()

# %% [markdown]
# ## Where to go on
#
# | question | command |
# |---|---|
# | the same box with OpenMM or LAMMPS | `rotor fluid water --molecules 216 --engine openmm` |
# | a box of mine | `rotor fluid box.extxyz --steps 50000 --csv rows.csv` |
# | a run that may be interrupted | `--checkpoint run.npz`, then `--resume` |
# | what accuracy costs | `rotor accuracy scene.toml` |
#
# Methods: `docs/fluid.md`, `docs/fluid_engines.md`; equipartition: `docs/gas.md`.
