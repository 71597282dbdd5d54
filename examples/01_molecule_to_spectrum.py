# %% [markdown]
# # From a molecule to its spectrum
#
# A molecule goes in, a rotational spectrum comes out. This notebook takes the library's water and OCS to their spectra and
# compares them, line by line, with lines that were measured in laboratories; then it does the same for molecules of which
# only a geometry, or a SMILES string, is known. Partition functions are compared with those of the catalogues.

# %%
import math
import tempfile
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import agreement, compare

# %matplotlib inline

rotor.api.use_style()

published = Path("data/catalogues")  # measured lines of JPL and CDMS, beside this notebook


def beside(lines, file):
    """Calculated lines and the published lines of a catalogue, matched by quantum numbers."""
    with tempfile.TemporaryDirectory() as folder:
        rotor.write(lines, Path(folder) / "calculated.cat")
        return compare(rotor.read(published / file), rotor.read(Path(folder) / "calculated.cat"))


# %% [markdown]
# ## Water: constants from experiment, intensities at 300 K
#
# 1₁₀ - 1₀₁ at 556.9 GHz is the ground-state line of ortho-water.

# %%
water = rotor.read("water")
lines = rotor.api.line_list(water, temperature_k=300, jmax=20)
print(f"{water.name}: {water.kind} top, κ = {water.kappa:.3f}, {len(lines)} lines, Q(300 K) = {lines.q:.2f}")
lines.strongest(5).to_pandas()[["frequency_mhz", "lgint", "energy_lower_cm", "einstein_a_per_s", "strength_debye2"]]

# %%
up, low = lines.levels.find(j=1, ka=1, kc=0), lines.levels.find(j=1, ka=0, kc=1)
ground = int(np.flatnonzero((lines.upper == up) & (lines.lower == low))[0])
print(f"1(1,0) - 1(0,1): {lines.frequency_mhz[ground]:.3f} MHz, A = {lines.einstein_a_per_s[ground]:.3e} 1/s")

assert water.kind == "asymmetric"
assert abs(lines.frequency_mhz[ground] - 556935.988) < 3  # measured; the constants meet measured lines to 0.8 MHz rms

# %% [markdown]
# ## Against measured lines
#
# JPL's catalogue c018003 (Pickett et al. 1998) marks the lines that were measured. 110 of them with J ≤ 10 and Ka ≤ 5 are
# used here. In the picture the calculated spectrum points up, the catalogue down. Below, the differences in
# frequency and intensity: the line strengths agree within 6 %, since JPL's dipole
# depends on J and K and ours is one number.

# %%
matched = beside(lines, "c018003_part.cat")
found = agreement(matched)
shift, strength = matched.differences("frequency_mhz"), matched.differences("lgint")
measured = matched.reference.take(matched.reference_rows)
figure, (spectrum, residuals) = plt.subplots(2, 1, figsize=(8, 6), height_ratios=(2, 1), layout="constrained")
spectrum.vlines(lines.frequency_mhz / 1e6, 0, lines.intensity_nm2_mhz, color="C0", lw=1, label="calculated")
spectrum.vlines(measured.frequency_mhz / 1e6, 0, -(10.0**measured.lgint), color="C1", lw=1, label="JPL, measured")
spectrum.set(xlim=(0, 10), xlabel="Frequency (THz)", ylabel="Absorption (nm² MHz)", title="Water at 300 K")
spectrum.axhline(0, color="black", lw=0.5)
spectrum.legend()
residuals.plot(measured.frequency_mhz / 1e6, shift, "o", ms=4, color="C0")
residuals.axhline(0, color="black", lw=0.5)
residuals.set(xlim=(0, 10), xlabel="Frequency (THz)", ylabel="Calculated - measured (MHz)")
pd.DataFrame(
    {
        "measured lines": [found.lines],
        "median difference (MHz)": [found.median_mhz],
        "rms (MHz)": [found.rms_mhz],
        "median ratio of intensities": [10 ** np.median(strength)],
        "largest |Δ log₁₀|": [np.abs(strength).max()],
    }
).round(4)

# %%
assert found.lines == 110
assert not len(matched.missing)
assert found.median_mhz < 1.0
assert np.abs(strength).max() < 0.026  # 6 %: JPL's dipole depends on J and K, ours is one number

# %% [markdown]
# ## OCS: a linear molecule
#
# Three constants describe 74 lines from 12 GHz to 0.9 THz, 52 of them measured, most to a few kilohertz.

# %%
ocs = rotor.read("OCS")
matched = beside(rotor.api.line_list(ocs, temperature_k=300, jmax=80), "c060503_part.cat")
found, error = agreement(matched), matched.reference.error_mhz[matched.reference_rows]
off = matched.differences("frequency_mhz")
print(
    f"{found.lines} measured lines: rms {1e3 * found.rms_mhz:.1f} kHz, {found.within_3_sigma:.0%} within three errors"
)

figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
j = matched.reference.quanta_upper[matched.reference_rows, 0]
axes.errorbar(j[matched.measured], 1e3 * off[matched.measured], 1e3 * error[matched.measured], fmt="o", ms=3, lw=1)
axes.axhline(0, color="black", lw=0.5)
axes.set(xlabel="J of the upper level", ylabel="Calculated - measured (kHz)", title="OCS, lines of c060503 (CDMS)")

# %%
assert found.lines == 52
assert found.rms_mhz < 0.02  # errors given are 0.1 to 50 kHz
assert found.within_3_sigma > 0.99

# %% [markdown]
# ## Partition functions
#
# log₁₀ Q of seven molecules at seven temperatures. They are equal to the catalogues' within the last digit, but for two:
# water and HDO at high temperature, where the last levels matter, by 2 units of it; and SO₂, whose sum in the catalogue
# includes the first excited bending state. The difference at 300 K gives its energy, and that energy explains the difference
# at 225 and 150 K.

# %%
tables = tomllib.loads((published / "partition.toml").read_text())
differences, computed = {}, {}
for table in tables.values():
    kelvin = np.array(table["temperature_k"])
    for name in [key for key in table if key not in ("source", "temperature_k")]:
        top = rotor.read(name)
        ours = np.array([math.log10(float(rotor.api.partition_function(top, t).q)) for t in kelvin.tolist()])
        differences[name] = ours - np.array(table[name])
        computed[name] = [*ours, np.abs(differences[name]).max()]

excess = 10.0 ** -differences["SO2"] - 1  # population of the excited state
bending_cm = -np.log(excess[:3]) * kelvin[:3] / 1.438777  # hc/k in cm K
print("SO2: energy of the excited state from the excess at 300, 225, 150 K:", np.round(bending_cm, 0), "cm⁻¹")

figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
for name, values in differences.items():
    axes.plot(kelvin, np.abs(values) + 1e-5, "o-", label=name)
axes.axhline(5e-5, color="black", lw=0.5, ls="--")
axes.set(
    xscale="log",
    yscale="log",
    xlabel="Temperature (K)",
    ylabel="|Δ log₁₀ Q| + 10⁻⁵",
    title="Q against JPL and CDMS; dashed: last digit",
)
axes.legend(ncols=4, fontsize=8)
pd.DataFrame.from_dict(computed, orient="index", columns=[*(f"{t:g} K" for t in kelvin), "largest difference"]).round(4)

# %%
for name, values in differences.items():
    if name != "SO2":
        assert np.abs(values).max() < 3e-4  # the catalogues print four decimals
assert np.abs(differences["SO2"][3:]).max() < 1e-4  # at 75 K and below the excited state is empty
assert np.ptp(bending_cm[:2]) < 3  # cm⁻¹; one energy explains both temperatures

# %% [markdown]
# ## Carbon monoxide: a geometry is enough for a rigid top
#
# The equilibrium distance gives B within half a per cent of the measured ground-state value: the difference is what
# vibration does.

# %%
geometry = rotor.Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128323]], dipole_debye=[0, 0, 0.11011])
rigid, ground_state = rotor.Top.from_molecule(geometry), rotor.read("CO")
print(f"B from the geometry {rigid.constants['B']:.1f} MHz, measured {ground_state.constants['B']:.1f} MHz")

assert abs(rigid.constants["B"] / ground_state.constants["B"] - 1) < 0.006

# %% [markdown]
# ## Formaldehyde from a SMILES string
#
# RDKit builds the geometry (ETKDGv3, MMFF94). The notes say what that costs: good for a first look, never for an assignment.

# %%
sketch, real = rotor.read("SMILES:C=O"), rotor.read("H2CO")
for note in sketch.notes:
    print("note:", note)
table = pd.DataFrame(
    {"from SMILES (MHz)": sketch.rotational_constants_mhz, "measured (MHz)": [real.constants[name] for name in "ABC"]},
    index=list("ABC"),
)
table["difference (%)"] = 100 * (table.iloc[:, 0] / table.iloc[:, 1] - 1)
table.round(1)

# %%
estimated = np.array(sketch.rotational_constants_mhz) / [real.constants[name] for name in "ABC"]
assert np.abs(estimated - 1).max() < 0.04

# %% [markdown]
# ## A spectrum on a grid, and files
#
# Gaussian lines of 20 GHz width: the area under them is the sum of the intensities. The suffix of a file names its format.

# %%
grid = np.linspace(0, 6e6, 60001)
curve = rotor.Spectrum.from_lines(lines, grid, fwhm_mhz=20e3)
area, inside = np.trapezoid(curve.intensity, grid), lines.intensity_nm2_mhz[lines.frequency_mhz < 6e6].sum()
print(f"area {area:.3f}, sum of lines {inside:.3f} nm² MHz")
with tempfile.TemporaryDirectory() as folder:
    rotor.write(lines, Path(folder) / "water.cat")
    print(Path(folder, "water.cat").read_text().splitlines()[0])
    assert len(rotor.read(Path(folder) / "water.cat")) == len(lines)

figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
axes.plot(grid / 1e6, curve.intensity)
axes.set(
    xlim=(0, 6),
    ylim=(0, None),
    xlabel="Frequency (THz)",
    ylabel="Cross section (nm²)",
    title="Water, lines 20 GHz wide",
)

# %%
assert abs(area / inside - 1) < 0.02  # lines at the end of the grid are cut
