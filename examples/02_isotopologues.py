# %% [markdown]
# # A molecule and its family
#
# Other isotopes leave the geometry and the charges where they are, but they move the centre of mass and turn the
# principal axes. Every claim below is asserted.

# %%
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import rotor
from rotor.tops.isotopologues import isotopologue, isotopologues

pictures = Path(tempfile.mkdtemp())

# %% [markdown]
# ## Water
#
# Four isotopologues are more abundant than one in ten thousand. Their constants are those of H₂O times the ratio that the
# geometry gives.

# %%
water = rotor.read("water")
family = isotopologues(water)
for one in family:
    a, b, c = one.top.rotational_constants_mhz
    mu = ", ".join(f"{abs(x):.3f}" for x in one.top.dipole_abc_debye)
    print(
        f"{one.formula:10} {one.abundance:.2e}  A {a:10.1f}  B {b:10.1f}  C {c:10.1f} MHz  |μ| {mu} D, {one.turned_degrees:.1f}°"
    )

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
# How good the ratio is, the library's measured constants of HDO and D₂O say: within 0.8 %, where the zero-point motion of D
# is not that of H; the rigid geometry alone is off by up to 3 %.

# %%
for changes, name in (("2=2H", "HDO"), ("H=2H", "D2O")):
    scaled = np.array(isotopologue(water, changes).top.constants.rigid)
    measured = rotor.read(name)
    off = scaled / np.array(measured.constants.rigid) - 1
    bare = np.array(rotor.Top.from_molecule(measured.molecule).constants.rigid) / measured.constants.rigid - 1
    print(f"{name}: scaled off by {np.abs(off).max():.2%}, the geometry by {np.abs(bare).max():.2%}")
    assert np.abs(off).max() < 0.008
    assert np.abs(off).max() < np.abs(bare).max()

# %% [markdown]
# The whole family as sticks, one molecule of each at 300 K, from the heaviest water to the lightest.

# %%
members = ["H=2H", "2=2H", "O=18O", "O=17O"]
tops = [isotopologue(water, changes) for changes in members] + [isotopologue(water, "O=16O")]
figure = Figure(figsize=(8, 8), layout="constrained")
panels = figure.subplots(len(tops), 1, sharex=True)
strongest = {}
for panel, one in zip(panels, tops, strict=True):
    lines = rotor.line_list(one.top, temperature_k=300, jmax=12)
    panel.vlines(lines.frequency_mhz / 1e6, 0, lines.intensity_nm2_mhz, linewidth=0.7)
    panel.set_title(one.formula, loc="left", fontsize=9)
    panel.set_ylim(bottom=0)
    strongest[one.formula] = lines.frequency_mhz[np.argmax(lines.intensity_nm2_mhz)]
panels[-1].set_xlim(0, 15)
panels[-1].set_xlabel("frequency (THz)")
figure.supylabel("integrated absorption (nm² MHz)")
figure.savefig(pictures / "water_family.png")

assert (pictures / "water_family.png").stat().st_size > 10_000
assert strongest["[2H]2O"] < strongest["H[2H]O"] < strongest["H2O"]  # heavier molecules turn more slowly

# %% [markdown]
# ## Methyl chloride as it comes
#
# Three quarters of chlorine are ³⁵Cl, one quarter is ³⁷Cl. At natural abundance the spectrum is both.

# %%
chlorides = isotopologues(rotor.read("CH3Cl"), min_abundance=0.05)
print([(one.formula, round(one.abundance, 4)) for one in chlorides])
assert [one.formula for one in chlorides] == ["CH3Cl", "CH3[37Cl]"]

grid = np.linspace(25.9e3, 26.9e3, 4001)
parts = []
for one in chlorides:
    lines = rotor.line_list(one.top, temperature_k=300, jmax=2)
    curve = rotor.Spectrum.from_lines(lines, grid, fwhm_mhz=5.0)
    parts.append(one.abundance * curve.intensity)
mixture = sum(parts)

# %% [markdown]
# The line J = 1 - 0 of CH₃³⁷Cl lies where twice its measured B is, at 26176 MHz, but for 1 MHz; the quadrupole splitting of
# chlorine is left out here. The two areas are as the abundances.

# %%
peaks = [grid[np.argmax(part)] for part in parts]
areas = [np.trapezoid(part, grid) for part in parts]
print(f"J = 1 - 0: {peaks[0]:.1f} and {peaks[1]:.1f} MHz, areas {areas[0] / areas[1]:.2f} to 1")
assert abs(peaks[1] - 2 * 13088.17) < 1.5  # measured B of CH3(37Cl), memory
assert (
    abs(areas[0] / areas[1] / (chlorides[0].abundance / chlorides[1].abundance) - 1) < 0.05
)  # μ² ν² / Q are nearly alike

figure = Figure(figsize=(8, 4), layout="constrained")
axes = figure.subplots()
axes.plot(grid / 1e3, mixture, linewidth=1.0)
for one, place in zip(chlorides, peaks, strict=True):
    axes.annotate(f"{one.formula}\n{one.abundance:.0%}", (place / 1e3, np.interp(place, grid, mixture)), ha="left")
axes.set_ylim(top=1.2 * mixture.max())
axes.set_xlabel("frequency (GHz)")
axes.set_ylabel("cross section (nm²), natural abundance")
figure.savefig(pictures / "methyl_chloride.png")
assert (pictures / "methyl_chloride.png").stat().st_size > 10_000
