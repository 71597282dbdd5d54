# %% [markdown]
# # Isotopologues
#
# Other isotopes leave the geometry and the charges where they are, but they move the centre of mass and turn the principal
# axes. From one molecule with measured constants, `rotor` predicts the constants, dipoles and spin weights of its
# isotopologues. Here the predictions are compared with measured constants and measured lines.

# %%
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import isotopologue, isotopologues

# %matplotlib inline

rotor.api.use_style()

published = Path("data/catalogues")  # measured lines of JPL and CDMS, beside this notebook

# %% [markdown]
# ## Water at natural abundance
#
# Four isotopologues are more abundant than one in ten thousand. Their constants are those of H₂O times the ratio that the
# geometry gives.

# %%
water = rotor.read("water")
family = isotopologues(water)
table = pd.DataFrame(
    {
        "abundance": [item.abundance for item in family],
        **{f"{name} (MHz)": [item.top.rotational_constants_mhz[i] for item in family] for i, name in enumerate("ABC")},
        **{f"|μ{name}| (D)": [abs(item.top.dipole_abc_debye[i]) for item in family] for i, name in enumerate("abc")},
        "axes turned by (°)": [item.turned_degrees for item in family],
    },
    index=[item.formula for item in family],
)
table.round(
    {"A (MHz)": 0, "B (MHz)": 0, "C (MHz)": 0, "|μa| (D)": 3, "|μb| (D)": 3, "|μc| (D)": 3, "axes turned by (°)": 1}
)

# %%
assert [one.formula for one in family] == ["H2O", "H2[18O]", "H2[17O]", "H[2H]O"]

# %% [markdown]
# HDO is no longer symmetric: the axes turn by 21°, the dipole gains a component along a, and ortho and para vanish.

# %%
hdo = isotopologue(water, "2=2H")
assert abs(hdo.turned_degrees - 21.1) < 0.1
assert abs(abs(hdo.top.dipole_abc_debye[0]) - 0.67) < 0.01
assert hdo.top.spin_weights.to_mapping() == {}
assert family[0].top.spin_weights.to_mapping() == {"ee": 1, "eo": 3, "oe": 3, "oo": 1}

# %% [markdown]
# How good is the prediction? The library has constants of HDO and D₂O from their own measured lines. The scaled ones are
# within 0.8 %, where the zero-point motion of D is not that of H; the rigid geometry alone is off by up to 3 %. Hydrogen is
# the hardest case there is.

# %%
off_percent = {}
for changes, name in (("2=2H", "HDO"), ("H=2H", "D2O")):
    scaled = np.array(isotopologue(water, changes).top.constants.rigid)
    measured = rotor.read(name)
    off = scaled / np.array(measured.constants.rigid) - 1
    bare = np.array(rotor.Top.from_molecule(measured.molecule).constants.rigid) / measured.constants.rigid - 1
    off_percent[name] = {
        "scaled constants (%)": 100 * np.abs(off).max(),
        "rigid geometry (%)": 100 * np.abs(bare).max(),
    }
    assert np.abs(off).max() < 0.008
    assert np.abs(off).max() < np.abs(bare).max()
pd.DataFrame(off_percent).T.round(2)

# %% [markdown]
# ## Carbon-13 in natural abundance: 2,3,4-trifluorotoluene
#
# The usual task of a microwave spectroscopist: the parent is assigned, where are the lines of the seven ¹³C species? The
# measured constants are those of Nair et al., Can. J. Phys. (2020), doi 10.1139/cjp-2019-0477. The geometry here is only
# RDKit's force field from a SMILES string, whose own constants are off by 1.2 %. Yet the *changes* on substitution, up to
# 27 MHz, are predicted to a few tenths of a megahertz: most of the error cancels in the ratio.

# %%
paper = tomllib.loads((published / "trifluorotoluene.toml").read_text())
sketch, parent = rotor.read(f"SMILES:{paper['smiles']}"), np.array(paper["parent"])
from_geometry = np.array(sketch.rotational_constants_mhz)
print("geometry against the measured parent:", ", ".join(f"{x:+.2%}" for x in from_geometry / parent - 1))

shifts, seen = [], []
for change, constants in paper["isotopologues"].items():
    ratio = np.array(isotopologue(sketch, change).top.rotational_constants_mhz) / from_geometry
    shifts.append(parent * ratio - parent)
    seen.append(np.array(constants) - parent)
shifts, seen = np.array(shifts), np.array(seen)

figure, axes = plt.subplots(figsize=(5, 4.5), layout="constrained")
for column, name in enumerate("ABC"):
    axes.plot(seen[:, column], shifts[:, column], "os^"[column], ms=6, label=name)
axes.plot([-28, 0], [-28, 0], color="black", lw=0.5)
axes.set(
    xlabel="Measured change (MHz)", ylabel="Predicted change (MHz)", title="Seven ¹³C isotopologues of trifluorotoluene"
)
axes.legend()
columns = [f"Δ{name} {kind} (MHz)" for name in "ABC" for kind in ("measured", "predicted")]
pd.DataFrame(np.stack([seen, shifts], axis=2).reshape(len(seen), 6), list(paper["isotopologues"]), columns).round(2)

# %%
assert np.abs(from_geometry / parent - 1).max() > 0.01  # the geometry alone would miss lines by tens of MHz
assert np.abs(shifts - seen).max() < 0.6  # MHz
assert np.median(np.abs(shifts - seen)) < 0.1

# %% [markdown]
# ## Methyl chloride as it comes
#
# Three quarters of chlorine are ³⁵Cl, one quarter is ³⁷Cl. At natural abundance the spectrum is both. JPL's catalogue lists
# J = 1 - 0 of each in three hyperfine components, which chlorine's quadrupole splits; this model leaves the splitting out,
# so its line is compared with their centre of gravity, Σ (2F + 1) ν / Σ (2F + 1).

# %%
chlorides = isotopologues(rotor.read("CH3Cl"), min_abundance=0.05)
assert [one.formula for one in chlorides] == ["CH3Cl", "CH3[37Cl]"]

centres = []
for file in ("c050007_part.cat", "c052009_part.cat"):
    lines = rotor.read(published / file).take(slice(0, 3))
    centres.append(float(np.average(lines.frequency_mhz, weights=lines.g_upper)))

grid = np.linspace(25.9e3, 26.9e3, 4001)
parts, places = [], []
for one in chlorides:
    lines = rotor.api.line_list(one.top, temperature_k=300, jmax=2)
    places.append(float(lines.frequency_mhz[lines.levels.quanta["j"][lines.upper] == 1][0]))
    parts.append(one.abundance * rotor.Spectrum.from_lines(lines, grid, fwhm_mhz=5.0).intensity)
areas = [np.trapezoid(part, grid) for part in parts]

figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
axes.plot(grid / 1e3, sum(parts), lw=1)
for one, place, centre in zip(chlorides, places, centres, strict=True):
    height = float(np.interp(place, grid, sum(parts)))
    axes.plot([centre / 1e3], [height * 1.04], "v", color="C1")
    axes.annotate(f"{one.formula}, {one.abundance:.0%}", (place / 1e3 + 0.02, height), va="top")
axes.set(ylim=(0, 1.2 * sum(parts).max()), xlabel="Frequency (GHz)", ylabel="Cross section (nm²), natural abundance")
axes.set_title("J = 1 - 0 of methyl chloride (orange: centres of JPL's components)")
pd.DataFrame(
    {
        "abundance": [one.abundance for one in chlorides],
        "J = 1 - 0 (MHz)": places,
        "centre of JPL's components (MHz)": centres,
    },
    index=[one.formula for one in chlorides],
).round(4)

# %%
assert abs(places[0] - centres[0]) < 0.5  # MHz; the library's own constants
assert abs(places[1] - centres[1]) < 1.5  # scaled by the geometry: 4e-5
assert (
    abs(areas[0] / areas[1] / (chlorides[0].abundance / chlorides[1].abundance) - 1) < 0.05
)  # μ² ν² / Q are nearly alike

# %% [markdown]
# ## The family of water in one picture
#
# One molecule of each at 300 K, from the lightest to the heaviest; the strongest lines move down as the molecule turns more
# slowly.

# %%
tops = [isotopologue(water, changes) for changes in ("O=16O", "O=18O", "2=2H", "H=2H")]
figure, panels = plt.subplots(len(tops), 1, figsize=(8, 6), sharex=True, layout="constrained")
strongest = {}
for panel, one in zip(panels, tops, strict=True):
    lines = rotor.api.line_list(one.top, temperature_k=300, jmax=12)
    panel.vlines(lines.frequency_mhz / 1e6, 0, lines.intensity_nm2_mhz, linewidth=0.7)
    panel.set_title(one.formula, loc="left", fontsize=9)
    panel.set_ylim(bottom=0)
    strongest[one.formula] = lines.frequency_mhz[np.argmax(lines.intensity_nm2_mhz)]
panels[-1].set(xlim=(0, 15), xlabel="Frequency (THz)")
figure.supylabel("Integrated absorption (nm² MHz)")

# %%
assert strongest["[2H]2O"] < strongest["H[2H]O"] < strongest["H2O"]

# %% [markdown]
# On the command line: `rotor isotopologues water`.
