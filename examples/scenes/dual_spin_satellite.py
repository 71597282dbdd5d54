# %% [markdown]
# # The dual-spin satellite
# A rotor inside a slowly turning platform stiffens it. For a rotor of momentum h along axis 3 and a platform rate Ω the
# axis nods at λ² = [(I3 - I2) Ω + h] [(I3 - I1) Ω + h] / (I1 I2), and is stable if both brackets have one sign
# (P. C. Hughes, Spacecraft Attitude Dynamics, 1986). I = (1, 1.2, 1.5), h = 0.7, Ω = 0.3: λ = 0.7480530284.

# %%
import numpy as np

from rotor.api import LieRungeKutta, SpinningRotor, integrate

moments, rotor, rate = np.array([1.0, 1.2, 1.5]), 0.7, 0.3
brackets = [(moments[2] - moments[k]) * rate + rotor for k in (0, 1)]
nutation = np.sqrt(brackets[0] * brackets[1] / (moments[0] * moments[1]))
assert abs(nutation - 0.748053028423342) < 1e-14

# %% [markdown]
# Measured: a push of 1e-5 rad/s, and the crossings of ω1 through zero over twenty periods.

# %%
push = 1e-5
momentum = moments * [push, 0.0, rate] + [0.0, 0.0, rotor]
times = np.linspace(0.0, 20 * 2 * np.pi / nutation, 801)
motion = integrate(LieRungeKutta(1e-12), moments, momentum, times, effects=[SpinningRotor([0.0, 0.0, rotor])])
across = motion.omega[:, 0]
rising = np.flatnonzero((across[:-1] < 0.0) & (across[1:] >= 0.0))
cycle = np.mean(np.diff(times[rising] - across[rising] * np.diff(times)[0] / (across[rising + 1] - across[rising])))
print(f"nutation {2 * np.pi / cycle:.8f} rad/s measured, {nutation:.8f} from the closed form")
assert abs(2 * np.pi / cycle - nutation) < 1e-6  # interpolation of crossings; the push shifts λ by 1e-10
assert np.ptp(motion.energy) < 1e-11  # the rotor is conservative

# %% [markdown]
# Without the rotor the same platform about its intermediate axis is lost; with it, it stays.

# %%
about_middle = np.array([1.0, 1.2, 1.1])
lone = integrate(LieRungeKutta(1e-12), about_middle, about_middle * [push, 0.0, rate], [0.0, 300.0])
with_rotor = about_middle * [push, 0.0, rate] + [0.0, 0.0, rotor]
wheel = [SpinningRotor([0.0, 0.0, rotor])]
held = integrate(LieRungeKutta(1e-12), about_middle, with_rotor, [0.0, 300.0], effects=wheel)
assert np.linalg.norm(lone.omega[-1, :2]) > 100 * push
assert np.linalg.norm(held.omega[-1, :2]) < 2 * push
