# %% [markdown]
# # A first lesson: things that turn
#
# A book thrown into the air, a hydrogen molecule and a cloud of carbon monoxide obey the same few laws of rotation. This lesson
# needs no more than first-year mechanics and a little quantum theory. Change the numbers and run the cells again.

# %%
import matplotlib.pyplot as plt
import numpy as np

import rotor

# %matplotlib inline

rotor.api.use_style()

# %% [markdown]
# ## A book in the air
#
# A book has three principal axes. The moment of inertia is smallest about the axis along the spine, largest about the axis through
# the cover, and in between about the third. Hold the book shut with a rubber band and throw it with a spin about each axis in turn.
# About two of them it turns steadily; about the third it flips over.
#
# `rotor.tumble` gives the exact motion. Each throw below starts at 10 rad/s about one axis, with 0.1 rad/s about the others, as a
# hand that is not perfect would give it.

# %%
throws = {
    "smallest moment": rotor.tumble(body="book", angular_velocity="10,0.1,0.1", times="0:4:801"),
    "intermediate moment": rotor.tumble(body="book", angular_velocity="0.1,10,0.1", times="0:4:801"),
    "largest moment": rotor.tumble(body="book", angular_velocity="0.1,0.1,10", times="0:4:801"),
}

figure, panels = plt.subplots(1, 3, figsize=(10, 3), sharey=True, layout="constrained")
for panel, (title, throw) in zip(panels, throws.items(), strict=True):
    motion = throw.to_pandas()
    momentum = motion.filter(like="kg_m2_per_s")  # columns m1, m2, m3 with their unit
    size = np.linalg.norm(momentum, axis=1)
    for (name, component), colour in zip(momentum.items(), ("C0", "C1", "C2"), strict=True):
        panel.plot(motion.t_s, component / size, color=colour, label=f"axis {name[1]}")
    panel.set(title=f"Axis of {title}", xlabel="Time (s)")
panels[0].set_ylabel("Angular momentum in the book / size")
panels[0].legend()

# %% [markdown]
# The angular momentum in space never changes, since no torque acts. Seen from the book it moves: in the middle panel it swings from
# one end of the axis to the other, and the book turns over. This is the theorem of the tennis racket.
#
# ## How fast does it flip?
#
# Near the intermediate axis Euler's equations are linear: a small error grows as $e^{\lambda t}$ with
#
# $$\lambda = \omega_2 \sqrt{\frac{(I_2 - I_1)(I_3 - I_2)}{I_1 I_3}}.$$
#
# A throw that is ten times more careful therefore delays the flip by only $\ln 10 / \lambda$. The cell below finds the first flip for
# throws that are more and more careful.

# %%
moments = np.array(throws["intermediate moment"].facts()["moments"])
growth = 10 * np.sqrt((moments[1] - moments[0]) * (moments[2] - moments[1]) / (moments[0] * moments[2]))

errors = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5]
flips = []
for error in errors:
    motion = rotor.tumble(body="book", angular_velocity=f"{error},10,{error}", times="0:6:6001").to_pandas()
    flips.append(motion.t_s[np.argmax(motion.m2_kg_m2_per_s < 0)])

figure, panel = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
panel.semilogx(errors, flips, "o", color="C1", label="first flip")
line = flips[0] + np.log(errors[0] / np.array(errors)) / growth
panel.semilogx(errors, line, color="black", lw=0.8, label=f"slope from λ = {growth:.2f} 1/s")
panel.set(xlabel="Angular velocity about the other axes (rad/s)", ylabel="Time of the first flip (s)")
panel.set_title("Care delays the flip, but only by its logarithm")
panel.legend()

# %% [markdown]
# ## A molecule turns in steps
#
# The angular momentum of a molecule is quantised. A linear molecule has the levels
#
# $$E_J = B J (J + 1) - D J^2 (J + 1)^2, \qquad \text{each } 2J + 1 \text{ times},$$
#
# where the second term is the stretching of the bond by the rotation. H₂ is the lightest molecule, so its steps are the largest. Its
# two nuclei are identical fermions of spin 1/2: the total wave function changes sign when they are exchanged. Levels of even J
# (*para*) go with one spin function, levels of odd J (*ortho*) with three.

# %%
hydrogen = rotor.levels("H2", jmax=5)
hydrogen.to_pandas()[["j", "energy_cm", "energy_k", "weight", "degeneracy"]]

# %%
table = hydrogen.to_pandas()
figure, panel = plt.subplots(figsize=(5, 4), layout="constrained")
for row in table.itertuples():
    colour = "C0" if row.j % 2 == 0 else "C1"
    panel.hlines(row.energy_cm, row.weight - 0.4, row.weight + 0.4, color=colour, lw=2)
    panel.annotate(f"J = {row.j}", (row.weight + 0.45, row.energy_cm), va="center", fontsize=9)
panel.set(xticks=[1, 3], xticklabels=["para (weight 1)", "ortho (weight 3)"], xlim=(0.2, 4.2), ylabel="Energy (cm⁻¹)")
panel.set_title("Rotational levels of H₂")

# %% [markdown]
# No ordinary collision turns ortho into para hydrogen. A gas that is cooled quickly keeps three quarters of its molecules in odd J,
# even at 20 K where equilibrium has none there.
#
# ## The heat capacity of hydrogen
#
# A classical linear rotor has the heat capacity R. At low temperature the steps are too large for collisions, and the rotation freezes
# out. Hydrogen that is cooled without a catalyst is a mixture of two gases, ortho and para, that do not exchange molecules: the thick
# curve. With a catalyst it follows the curve called equilibrium.

# %%
figure, panel = plt.subplots(figsize=(6, 3.6), layout="constrained")
for species in ("para", "ortho", "normal", "equilibrium"):
    heat = rotor.thermo("H2", temperatures_k="10:600K:119", species=species).to_pandas()
    panel.plot(heat.temperature_k, heat.cv_over_r, lw=2.5 if species == "normal" else 1.2, label=species)
panel.axhline(1, color="black", lw=0.7, ls=":")
panel.annotate("classical", (590, 0.92), ha="right", fontsize=9)
panel.set(xlabel="Temperature (K)", ylabel="Rotational heat capacity / R", ylim=(0, 2.3))
panel.set_title("Rotational heat capacity of hydrogen")
panel.legend()

# %% [markdown]
# ## The spectrum of carbon monoxide
#
# Light changes J by one. The lines of a linear molecule are then nearly 2B apart: a comb. The distance of its teeth measures the
# moment of inertia, and so the bond.

# %%
spectrum = rotor.spectrum("CO", temperature_k=300, jmax=40)
lines = spectrum.to_pandas()
figure, panel = plt.subplots(figsize=(8, 3), layout="constrained")
panel.vlines(lines.frequency_mhz / 1e6, 0, 10**lines.lgint, color="C0")
panel.set(xlabel="Frequency (THz)", ylabel="Absorption (nm² MHz)", xlim=(0, 4), ylim=(0, None))
panel.set_title("Carbon monoxide at 300 K")

# %%
b_hz = lines.frequency_mhz[0] * 1e6 / 2  # the first line is at 2B - 4D, and D is tiny
planck, atomic_mass_kg = 6.62607015e-34, 1.66053906660e-27  # SI; CODATA 2018
reduced_mass = 12.0 * 15.99491461957 / (12.0 + 15.99491461957) * atomic_mass_kg
bond = np.sqrt(planck / (8 * np.pi**2 * reduced_mass * b_hz))
print(f"B = {b_hz / 1e9:.3f} GHz, bond length {bond * 1e10:.4f} Å")

# %% [markdown]
# ## How far can these numbers be trusted?
#
# Each answer has its own list of errors: rounding, what the numerical method leaves out, what the model leaves out, the constants.

# %%
print(spectrum.errors.line())

# %% [markdown]
# ## To try
#
# 1. Throw a racket, a phone and a wing nut (`body="racket"`). Which of them flips fastest?
# 2. Exchange the protons of H₂ for deuterons: `rotor.levels("D2")`. Which levels have the larger weight now?
# 3. At which temperature is the strongest line of CO that of J = 3 - 2? `temperature_k` is the knob.
# 4. HCl, HCN, OCS: which has the widest comb, and why?
