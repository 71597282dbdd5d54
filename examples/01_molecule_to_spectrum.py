# %% [markdown]
# # From a molecule to its spectrum
#
# A molecule goes in, a rotational spectrum comes out: water of the library, carbon monoxide from a geometry, and
# formaldehyde from a SMILES string. Every claim below is asserted.

# %%
import tempfile
from pathlib import Path

import numpy as np

import rotor

# %% [markdown]
# ## Water: constants from experiment, intensities at 300 K

# %%
water = rotor.read("water")
lines = rotor.line_list(water, temperature_k=300, jmax=20)
print(f"{water.name}: {water.kind} top, κ = {water.kappa:.3f}, {len(lines)} lines, Q(300 K) = {lines.q:.2f}")
print(lines.strongest(5))

assert water.kind == "asymmetric"
assert abs(lines.q - 178.1) < 0.5  # JPL: 178.12, rotation alone

# %% [markdown]
# The line at 556.9 GHz, 1₁₀ - 1₀₁, is the ground-state line of ortho-water. It is measured at 556935.988 MHz.

# %%
quanta = np.hstack([lines.quanta(lines.upper), lines.quanta(lines.lower)])
ground = int(np.flatnonzero((quanta == [1, 1, 0, 1, 0, 1]).all(axis=1))[0])
print(f"1(1,0) - 1(0,1): {lines.frequency_mhz[ground]:.3f} MHz, A = {lines.einstein_a_per_s[ground]:.3e} 1/s")

assert abs(lines.frequency_mhz[ground] - 556935.988) < 3  # the constants meet measured lines to 0.8 MHz rms
assert abs(lines.einstein_a_per_s[ground] / 3.46e-3 - 1) < 0.02

# %% [markdown]
# ## Carbon monoxide: a geometry is enough for a rigid top
#
# The equilibrium distance gives B within half a per cent of the measured ground-state value, the difference being what
# vibration does.

# %%
geometry = rotor.Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128323]], dipole_debye=[0, 0, 0.11011])
rigid = rotor.Top.from_molecule(geometry)
measured = rotor.read("CO")
print(f"B from the geometry {rigid.constants['B']:.1f} MHz, measured {measured.constants['B']:.1f} MHz")

assert abs(rigid.constants["B"] / measured.constants["B"] - 1) < 0.006

# %% [markdown]
# ## Formaldehyde from a SMILES string
#
# RDKit builds it with ETKDGv3 and MMFF94. What that costs is said in the notes: half a per cent of the constants in the
# median is 700 MHz on a line at 145 GHz, good for a look, never for an assignment.

# %%
sketch = rotor.read("SMILES:C=O")
real = rotor.read("H2CO")
for name, ours in zip("ABC", sketch.rotational_constants_mhz, strict=True):
    print(f"{name}: {ours:10.1f} MHz from SMILES, {real.constants[name]:10.1f} MHz measured")
for note in sketch.notes:
    print("note:", note)

assert all(
    abs(ours / real.constants[n] - 1) < 0.04 for n, ours in zip("ABC", sketch.rotational_constants_mhz, strict=True)
)

# %% [markdown]
# ## Files
#
# The suffix names the format. A catalogue in the 80-column format has its provenance in a file beside it.

# %%
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "water.cat"
    rotor.write(lines, path)
    print(path.read_text().splitlines()[0])
    again = rotor.read(path)
    assert len(again) == len(lines)
    assert Path(f"{path}.provenance.json").exists()

# %% [markdown]
# ## A spectrum on a grid
#
# Gaussian lines of 20 GHz width, and the area under them is the sum of the intensities.

# %%
grid = np.linspace(0, 6e6, 60001)
spectrum = rotor.Spectrum.from_lines(lines, grid, fwhm_mhz=20e3)
area = np.trapezoid(spectrum.intensity, grid)
inside = lines.intensity_nm2_mhz[lines.frequency_mhz < 6e6].sum()
print(f"area {area:.3f}, sum of lines {inside:.3f} nm² MHz")

assert abs(area / inside - 1) < 0.02  # lines at the ends of the grid are cut
