# %% [markdown]
# # A molecule in a static field
#
# The field mixes J and leaves M: a map of levels against field for each M, with labels that no grid can change.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.special import obl_cv

import rotor
from rotor import Top
from rotor.api import (
    MHZ_ANGSTROM3_W_PER_CM2,
    MHZ_PER_CM,
    MHZ_PER_DEBYE_KV_PER_CM,
    deflection_table,
    field_lines,
    field_mixture,
    line_coefficients,
    stark_figure,
    stark_map,
    zeeman_map,
)

# %matplotlib inline

rotor.api.use_style()

data = Path("data")  # reference values, beside this notebook
ocs = Top.from_constants("B=6081.492475 D=1.301777e-3 MHz", dipole_abc_debye=(0.71519, 0, 0))

# %% [markdown]
# ## OCS to 200 kV/cm
#
# At low field W = (μ²E²/2hB) [J(J+1) - 3M²]/[J(J+1)(2J-1)(2J+3)]; at high field every state seeks the field.
# The energies are compared with a map that an independent program made.

# %%
states = stark_map(ocs, np.linspace(0, 200, 201), j_highest=2)
last = [rows.stop - 1 for rows in states.curves()]
pd.DataFrame(
    {
        "J": states.label[last],
        "|M|": states.m[last],
        "energy at 200 kV/cm (MHz)": states.energy_mhz[last].round(3),
        "effective dipole (D)": states.slope[last].round(4),
        "⟨cosθ⟩": states.cosines["costheta"][last].round(4),
    }
)

# %%
stark_figure(states, title="OCS in a static field")

# %%
ground = states.curve("0", 0)
assert abs(states.energy_mhz[ground][-1] + 45547.643) < 0.001  # the last digit of the other program
with (data / "fields" / "stark_ocs.csv").open() as file:
    names = file.readline()[2:].split(";")[0].split(",")
    theirs = np.loadtxt(file, delimiter=",")
fields, differences = theirs[:, 0], {}
for name, column in zip(names[1:], theirs.T[1:], strict=True):
    ours = states.energy_mhz[states.curve(name[1], int(name[3]))][np.searchsorted(states.fields, fields)]
    differences[f"J = {name[1]}, M = {name[3]}"] = np.abs(ours - column).max()
    assert np.abs(ours - column).max() < 5e-6  # theirs are good to 1e-6 MHz
low = stark_map(ocs, [0.0, 0.1], j_highest=0).energy_mhz[1] / 0.01
b, dipole = ocs.constants["B"], ocs.dipole_abc_debye[0] * MHZ_PER_DEBYE_KV_PER_CM
print(f"J = 0: {low:.5f} MHz/(kV/cm)², second order {-(dipole**2) / (6 * b):.5f}")
assert abs(low + dipole**2 / (6 * b)) < 1e-4
pd.DataFrame({f"largest difference at {len(fields)} fields (MHz)": differences}).style.format("{:.1e}")

# %% [markdown]
# ## An asymmetric top
#
# Indole has two components of the dipole: half as many symmetries, twice as many avoided crossings.

# %%
indole = rotor.read("indole")
states = stark_map(indole, 100 * np.linspace(0, 1, 81) ** 2, j_highest=1, tolerance_mhz=1e-3)
print(f"indole: {len(states.curves())} states, J max {states.jmax}, edge population {states.edge_population.max():.1e}")
stark_figure(states, title="Indole in a static field")

# %%
assert states.edge_population.max() < 1e-6

# %% [markdown]
# ## Lines in the field
#
# A field switched on and off shows each line as its M components, the lobes. Light across the field lets M change by one, light along
# it does not. J = 1 - 0, M = 0 moves by (8/15) μ²E²/2hB, 5.684 MHz/(kV/cm)² of OCS.

# %%
fields = np.linspace(0, 5, 26)
lobes = field_lines(ocs, fields, j_highest=3, light="isotropic", temperature_k=300.0).lobes("2", "1")
first = field_lines(ocs, fields, j_highest=1, light="parallel", temperature_k=300.0).lobes("1", "0")
slope = first.shift_mhz[1] / fields[1] ** 2
print(f"J = 1 - 0, M = 0: {slope:.4f} MHz/(kV/cm)²; formula {8 / 15 * dipole**2 / (2 * b):.4f}")
figure, axes = plt.subplots(figsize=(5.5, 2.8), layout="constrained")
for rows in lobes.pairs():
    upper, lower = int(lobes.upper_m[rows.start]), int(lobes.lower_m[rows.start])
    style = "-" if upper == lower else "--"
    axes.plot(fields, lobes.shift_mhz[rows], style, lw=1.0, label=f"|M| = {lower} to {upper}")
axes.set(xlabel="Field (kV/cm)", ylabel="Shift (MHz)", title="OCS, J = 1 to 2, unpolarized light")
axes.legend(fontsize=8)
line_coefficients(lobes).to_pandas()[
    ["upper", "upper_m", "lower", "lower_m", "c2_mhz_per_kv2_per_cm2", "valid_to_kv_per_cm"]
]

# %%
assert abs(slope - 8 / 15 * dipole**2 / (2 * b)) < 1e-3  # of fourth order in the field
assert len(lobes.pairs()) == 5  # M = 0 - 0, 1 - 1, 1 - 0, 0 - 1, 2 - 1

# %% [markdown]
# ## A gas, a beam, a deflector
#
# In equilibrium a gas is oriented by the field. In a beam each state is followed and keeps its population, so that states which the
# field pushes out take part. What a deflector needs is μ_eff of each state, as a table.

# %%
fields = np.linspace(0, 200, 41)
gas, beam = (field_mixture(ocs, fields, 2.0, populations=kind) for kind in ("equilibrium", "adiabatic"))
table = deflection_table(stark_map(ocs, fields, j_highest=2))
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 2.6), layout="constrained")
for mixture, name in ((gas, "gas, in equilibrium"), (beam, "beam, adiabatic")):
    left.plot(mixture.field_kv_per_cm, mixture.cosines["costheta"], label=name)
left.set(xlabel="Field (kV/cm)", ylabel="⟨cosθ⟩", title="OCS at 2 K")
left.legend(loc="lower right", fontsize=8)
share = table.populations(2.0)
for name, moment, population in zip(table.states, table.mu_eff_debye, share, strict=True):
    label = name.replace(" M", ", |M| = ")
    right.plot(fields, moment, lw=0.4 + 4 * population, label=f"J = {label}: {100 * population:.0f} %")
right.axhline(0, color="black", lw=0.5, ls=":")
right.set(
    xlabel="Field (kV/cm)",
    ylabel="Dipole $\\mu_\\mathrm{eff}$ (D)",
    title="Effective dipoles; width: population at 2 K",
)
right.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
print(f"at 200 kV/cm: gas {gas.cosines['costheta'][-1]:.3f}, beam {beam.cosines['costheta'][-1]:.3f}")

# %%
assert gas.cosines["costheta"][-1] > beam.cosines["costheta"][-1] > 0
assert abs(share.sum() - 1) < 1e-12
assert (table.mu_eff_debye[:, 1] < 0).any()  # low-field seekers

# %% [markdown]
# ## A field at an angle with a laser
#
# M is mixed then. The laser holds the axis along Z; the field chooses its sense, as long as it has a part along Z.

# %%
bright = ocs.with_polarizability(np.diag([4.04, 0.0, 0.0]), "the anisotropy alone")
angles, along, held = np.linspace(0, 90, 7), [], []
for angle in np.radians(angles):
    direction = (np.sin(angle), 0.0, np.cos(angle))
    tilted = stark_map(bright, [5.0], j_highest=0, intensity_w_per_cm2=2e11, direction=direction, tolerance_mhz=1.0)
    along.append(tilted.cosines["costheta"][0])
    held.append(tilted.cosines["cos2theta"][0])
figure, axes = plt.subplots(figsize=(5, 2.7), layout="constrained")
axes.plot(angles, held, "s-", ms=4, label="⟨cos²θ⟩ with the laser")
axes.plot(angles, along, "o-", ms=4, label="⟨cosθ⟩ with the field")
axes.plot(angles, along[0] * np.cos(np.radians(angles)), "k:", lw=0.8, label="the projection of an axis along Z")
axes.set(xlabel="Angle between field and laser (degrees)", title="OCS, ground state, 5 kV/cm and 0.2 TW/cm²")
axes.legend(fontsize=8)
print("<cosθ>:", np.round(along, 3), "<cos²θ>:", np.round(held, 3))

# %%
assert along[0] > 0.5 > 0.2 > along[-1]
assert np.ptp(held) < 0.05  # the laser alone decides how well the axis is held

# %% [markdown]
# ## Pendular states
#
# In the field of a laser alone the levels of a linear molecule are spheroidal characteristic values, E/B = obl_cv(M, J, √Δω).

# %%
rod = Top.from_constants("B=6 GHz").with_polarizability(np.diag([4.0, 0.0, 0.0]), "made up")
aligned, energies, omegas = [], [], (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
for omega in omegas:
    intensity = omega * 6000.0 / (MHZ_ANGSTROM3_W_PER_CM2 * 4.0)
    found = stark_map(rod, [0.0], j_highest=0, intensity_w_per_cm2=intensity)
    exact = obl_cv(0, 0, np.sqrt(omega))
    assert abs(found.energy_mhz[0] / 6000 - exact) < 1e-9
    energies.append(found.energy_mhz[0] / 6000)
    aligned.append(found.cosines["cos2theta"][0])

figure, (left, right) = plt.subplots(1, 2, figsize=(6, 2.4), layout="constrained")
fine = np.logspace(-1, 2, 200)
left.semilogx(fine, [obl_cv(0, 0, np.sqrt(omega)) / omega for omega in fine], "k-", lw=0.8, label="spheroidal function")
left.semilogx(omegas, np.array(energies) / omegas, "o", ms=4, label="stark_map")
left.set(xlabel="Anisotropy Δω", ylabel="Energy / (B Δω)", title="Ground state in the field of a laser")
left.legend(loc="lower left", fontsize=7)
right.semilogx(omegas, aligned, "o-", ms=4)
right.axhline(1 / 3, color="black", lw=0.5, ls="--")
right.set(xlabel="Anisotropy Δω", ylabel="⟨cos²θ⟩", title="Alignment; dashed: free, 1/3")
spheroidal = [obl_cv(0, 0, np.sqrt(omega)) for omega in omegas]
pd.DataFrame({"Δω": omegas, "E/B": energies, "spheroidal": spheroidal, "⟨cos²θ⟩": aligned}).round(8)

# %%
assert abs(found.cosines["cos2theta"][0] - 0.89984260) < 1e-8

# %% [markdown]
# ## A magnetic field
#
# Rotation alone makes a moment: a linear molecule shifts by -g μ_N B M exactly.

# %%
magnetic = zeeman_map(ocs, np.linspace(0, 1, 5), -0.03, j_highest=1)
shift = np.ptp(magnetic.energy_mhz[magnetic.curve("1", 1)])
print(
    f"OCS, J = 1, M = 1 in 1 T, with g = -0.03 (a made-up value): {shift * 1e3:.2f} kHz; {shift / MHZ_PER_CM:.2e} cm⁻¹"
)
symmetric = Top.from_constants("A=20 B=6 GHz")
components = zeeman_map(symmetric, np.linspace(0, 20, 21), (0.5, -0.2, -0.2), magnetisability=(-3, -7, -7), j_highest=1)
figure, axes = plt.subplots(figsize=(5.5, 2.6), layout="constrained")
for rows in components.curves():
    if components.label[rows.start] == "1 1":
        shifts = components.energy_mhz[rows] - components.free_mhz[rows]
        axes.plot(components.field[rows], shifts, label=f"M = {components.m[rows.start]}")
axes.set(xlabel="Magnetic field (T)", ylabel="Shift (MHz)", title="J = K = 1 of a symmetric top, made-up g and χ")
axes.legend(fontsize=8)

# %%
assert abs(shift - 0.03 * 7.6225932188) < 1e-8
