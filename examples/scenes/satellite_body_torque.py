# %% [markdown]
# # A satellite spun up by a crooked thruster
# A symmetric satellite at rest is spun up by a constant torque in body axes that is a little off its axis. With
# k = (I3 - I)/I and ω3 = τ3 t/I3 the transverse rate Ω = ω1 + i ω2 obeys Ω' = i k ω3 Ω + τ1/I, so
#
#     Ω(t) = (τ1/I) e^{iφ(t)} ∫ e^{-iφ(s)} ds,   φ = k τ3 t²/(2 I3),
#
# Fresnel's integral: it does not grow for ever but winds to |Ω| = (τ1/I) √(π I3 / (2 k τ3))
# (J. M. Longuski, Acta Astronaut. 25, 131 (1991), on self-excited bodies). The axis stays where it was, nearly.

# %%
import numpy as np
from scipy.special import fresnel

from rotor.api import ConstantTorque, LieRungeKutta, integrate

moments = np.array([100.0, 100.0, 180.0])  # kg m²
torque = np.array([0.05, 0.0, 2.0])  # N m
k = (moments[2] - moments[0]) / moments[0]
winding = np.sqrt(k * torque[2] / (np.pi * moments[2]))  # φ = ½ π (winding t)²

times = np.linspace(0.0, 300.0, 31)
motion = integrate(LieRungeKutta(1e-12), moments, [0.0, 0.0, 0.0], times, effects=[ConstantTorque(torque)])
sine, cosine = fresnel(winding * times)
phase = np.exp(0.5j * np.pi * (winding * times) ** 2)
closed = torque[0] / moments[0] * phase * (cosine - 1j * sine) / winding
measured = motion.omega[:, 0] + 1j * motion.omega[:, 1]
assert np.max(np.abs(measured - closed)) < 1e-8  # 1e-12 |L|/I a step, 2000 steps
assert np.allclose(motion.omega[:, 2], torque[2] * times / moments[2], rtol=1e-10)

# %%
limit = torque[0] / moments[0] * np.sqrt(np.pi * moments[2] / (2.0 * k * torque[2]))
print(f"transverse rate after 300 s {abs(measured[-1]):.6f} rad/s, its limit {limit:.6f} rad/s")
assert abs(abs(measured[-1]) - limit) < 0.02 * limit  # it winds in as 1/(winding t)
