# %% [markdown]
# # A molecule spun by an optical centrifuge
# The polarization of a strong pulse turns with a growing rate Ω = β t, and rods turn with it (J. Karczmarek, J. Wright,
# P. Corkum and M. Ivanov, Phys. Rev. Lett. 82, 3420 (1999)). In the turning frame a rod in the plane, at an angle δ behind
# the field, is a pendulum in a tilted well: I δ'' = I β - U0 sin 2δ. It is carried along for I β < U0, with L = I β t.
# O2 from rest to 10 THz in 100 ps at 1e13 W/cm² reaches L = 116 ħ; states up to N = 109 were made so (A. A. Milner,
# A. Korobenko and V. Milner, arXiv:1406.2668). Rigid: bonds stretch at such rates, which is left out.

# %%
import sys

import numpy as np

from rotor.api import LieRungeKutta, OpticalCentrifuge, SymmetricTopSplitting, integrate, rotate

# ps, ħ and rad/ps: I = 1/2B
rotational_constant = 2 * np.pi * 0.0431004  # rad/ps, of O2
inertia = 1 / (2 * rotational_constant)
moments = np.array([0.0, inertia, inertia])
anisotropy = 1.1  # Å³, along the bond, of O2
well = 1.98739 * 10 * anisotropy  # U0 in rad/ps at 1e13 W/cm²
rate = 2 * np.pi * 0.1  # β, rad/ps²: 10 THz after 100 ps
field = np.sqrt(2 * 1.98739 * 10)  # rms, where α is in Å³ and energies are in rad/ps


def centrifuge(acceleration):
    return OpticalCentrifuge([anisotropy, 0.0, 0.0], field, acceleration)


# %% [markdown]
# A rod that starts at the bottom of its tilted well stays there.

# %%
lag = np.arcsin(inertia * rate / well) / 2
times = np.linspace(0.0, 100.0, 201)
ride = integrate(
    LieRungeKutta(1e-11), moments, [0, 0, 0], times, [np.cos(lag / 2), 0, 0, -np.sin(lag / 2)], [centrifuge(rate)]
)
axis = rotate(ride.attitude, [1.0, 0.0, 0.0])
behind = np.angle(np.exp(0.5j * rate * times**2) / (axis[:, 0] + 1j * axis[:, 1]))
turns = rate * times[-1] ** 2 / (4 * np.pi)
print(f"{np.degrees(lag):.3f} degrees behind the field; L = {ride.momentum[-1, 2]:.2f} ħ after {turns:.0f} turns")
assert np.allclose(behind, lag, atol=1e-7)
assert np.allclose(ride.momentum[:, 2], inertia * rate * times, atol=1e-6)

# %% [markdown]
# Started along the field it swings, with the first integral ½ I δ'² - ½ U0 cos 2δ - I β δ. Above the threshold β = U0/I
# there is no well, and it is left behind.

# %%
for factor, carried in ((0.5, True), (1.01, False)):
    acceleration = factor * well / inertia
    short = np.linspace(0.0, 3.0, 301)
    swing = integrate(LieRungeKutta(1e-11), moments, [0, 0, 0], short, effects=[centrifuge(acceleration)])
    behind = acceleration * short**2 / 2 - np.unwrap(2 * np.arctan2(swing.attitude[:, 3], swing.attitude[:, 0]))
    slip = acceleration * short - swing.momentum[:, 2] / inertia
    first = inertia * slip**2 / 2 - well * np.cos(2 * behind) / 2 - inertia * acceleration * behind
    assert np.ptp(first) < 1e-6 * well
    assert (behind.max() < np.pi / 2) == carried

# %% [markdown]
# Of a gas of rods in all directions at 10 K, those that the well catches leave with L near I Ω along the beam.

# %%
rng = np.random.default_rng(1)
count, end, kt = 1000, 20.0, 2 * np.pi * 0.208366  # rad/ps, 10 K
momentum = rng.normal(0.0, np.sqrt(moments * kt), (count, 3))
attitude = rng.normal(size=(count, 4))
attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
gas = integrate(SymmetricTopSplitting(0.005), moments, momentum, [0.0, end], attitude, [centrifuge(rate)])
spin = rotate(gas.attitude[:, -1], gas.momentum[:, -1])[:, 2]
carried = np.abs(spin / (inertia * rate * end) - 1) < 0.35
print(
    f"{carried.mean():.0%} of the gas is carried along, with {spin[carried].mean():.1f} ħ; the others have {spin[~carried].mean():.1f} ħ"
)
assert 0.7 < carried.mean() < 0.95
assert abs(spin[~carried].mean()) < 5.0

if "--plot" in sys.argv:
    import matplotlib.pyplot as plt

    plt.hist(spin, 60)
    plt.xlabel("$L_Z$ (ħ)")
    plt.ylabel("molecules")
    plt.show()
