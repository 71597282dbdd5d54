# %% [markdown]
# # A molecule in a static field
#
# The field mixes J and leaves M: a map of levels against field for each M, with labels that no grid can change. Pictures go to
# the folder given on the command line, if one is.

# %%
import sys
from pathlib import Path

import numpy as np
from scipy.special import obl_cv

import rotor
from rotor.plots.stark import plot_stark
from rotor.quantum.effects.stark import MHZ_ANGSTROM3_W_PER_CM2, stark_map
from rotor.quantum.effects.zeeman import zeeman_map
from rotor.tops.top import Top
from rotor.units import MHZ_PER_CM, MHZ_PER_DEBYE_KV_PER_CM

folder = Path(sys.argv[1]) if len(sys.argv) > 1 and Path(sys.argv[1]).is_dir() else None
ocs = rotor.read("OCS")

# %% [markdown]
# ## OCS to 200 kV/cm
#
# At low field W = (μ²E²/2hB) [J(J+1) - 3M²]/[J(J+1)(2J-1)(2J+3)]; at high field every state seeks the field.

# %%
states = stark_map(ocs, np.linspace(0, 200, 201), j_highest=2)
for rows in states.curves():
    last = rows.stop - 1
    print(
        f"J = {states.label[last]}, |M| = {states.m[last]}: {states.energy_mhz[last]:12.3f} MHz at 200 kV/cm, "
        f"μ_eff = {states.slope[last]:+.4f} D, <cosθ> = {states.cosines['costheta'][last]:+.4f}"
    )
ground = states.curve("0", 0)
assert abs(states.energy_mhz[ground][-1] + 45547.64) < 0.02  # CMIstark: -45547.643 with B 0.4 kHz higher
low = stark_map(ocs, [0.0, 0.1], j_highest=0).energy_mhz[1] / 0.01
b, dipole = ocs.constants["B"], ocs.dipole_abc_debye[0] * MHZ_PER_DEBYE_KV_PER_CM
print(f"J = 0: {low:.5f} MHz/(kV/cm)², second order {-(dipole**2) / (6 * b):.5f}")
assert abs(low + dipole**2 / (6 * b)) < 1e-4
if folder:
    plot_stark(states, folder / "stark_ocs.png", title="OCS in a static field")

# %% [markdown]
# ## An asymmetric top
#
# Indole has two components of the dipole: half as many symmetries, twice as many avoided crossings.

# %%
indole = rotor.read("indole")
states = stark_map(indole, np.linspace(0, 100, 101), j_highest=2, tolerance_mhz=1e-3)
print(f"indole: {len(states.curves())} states, J max {states.jmax}, edge population {states.edge_population.max():.1e}")
assert states.edge_population.max() < 1e-6
if folder:
    plot_stark(states, folder / "stark_indole.png", title="indole in a static field")

# %% [markdown]
# ## Pendular states
#
# In the field of a laser alone the levels of a linear molecule are spheroidal characteristic values, E/B = obl_cv(M, J, √Δω).

# %%
rod = Top.from_constants("B=6 GHz").with_polarizability(np.diag([4.0, 0.0, 0.0]), "made up")
for omega in (1.0, 10.0, 100.0):
    intensity = omega * 6000.0 / (MHZ_ANGSTROM3_W_PER_CM2 * 4.0)
    found = stark_map(rod, [0.0], j_highest=0, intensity_w_per_cm2=intensity)
    exact = obl_cv(0, 0, np.sqrt(omega))
    print(
        f"Δω = {omega:5.0f}: E/B = {found.energy_mhz[0] / 6000:.8f}, spheroidal {exact:.8f}, <cos²θ> {found.cosines['cos2theta'][0]:.6f}"
    )
    assert abs(found.energy_mhz[0] / 6000 - exact) < 1e-9
assert abs(found.cosines["cos2theta"][0] - 0.89984260) < 1e-8

# %% [markdown]
# ## A magnetic field
#
# Rotation alone makes a moment: a linear molecule shifts by -g μ_N B M exactly.

# %%
magnetic = zeeman_map(ocs, [0.0, 1.0], -0.03, j_highest=1)
shift = np.ptp(magnetic.energy_mhz[magnetic.curve("1", 1)])
print(
    f"OCS, J = 1, M = 1 in 1 T, with g = -0.03 (a made-up value): {shift * 1e3:.2f} kHz; {shift / MHZ_PER_CM:.2e} cm⁻¹"
)
assert abs(shift - 0.03 * 7.6225932188) < 1e-8
