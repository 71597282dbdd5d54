# %% [markdown]
# # The unbalanced wheel
# A wheel whose axis of figure is tilted by ε against the axle shakes its bearings: L is not along ω, so the axle must
# supply the torque -L x ω, of size (I3 - I1) ω² sin ε cos ε, turning with the wheel
# (Euler's equations with ω constant: Landau and Lifshitz, Mechanics, section 36). A car's wheel, I3 = 1.0 and
# I1 = 0.6 kg m², tilted by one degree at 100 rad/s: 69.8 N m.

# %%
import numpy as np

from rotor.api import ConstantTorque, SymmetricTopSplitting, integrate, momentum_rate, rotate

moments, tilt, speed = np.array([0.6, 0.6, 1.0]), np.radians(1.0), 100.0
omega = speed * np.array([np.sin(tilt), 0.0, np.cos(tilt)])
torque = -momentum_rate(moments * omega, moments)
size = np.linalg.norm(torque)
print(f"the axle must hold {size:.2f} N m")
assert np.isclose(size, 0.4 * speed**2 * np.sin(tilt) * np.cos(tilt), rtol=1e-12)
assert abs(size - 69.8) < 0.05

# %% [markdown]
# With just this torque, fixed in the wheel, the wheel keeps turning steadily about the axle; without it, it would not.

# %%
times = np.linspace(0.0, 1.0, 11)
method = SymmetricTopSplitting(step=1e-3, order=4)
held = integrate(method, moments, moments * omega, times, effects=[ConstantTorque(torque)])
free = integrate(method, moments, moments * omega, times)
axle = omega / speed
assert np.max(np.abs(rotate(held.attitude, axle) - axle)) < 1e-7  # the axle stays
assert np.max(np.abs(rotate(free.attitude, axle) - axle)) > tilt  # and would wander
