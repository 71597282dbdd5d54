# %% [markdown]
# # The rattleback
# A celt whose principal axes are turned against the axes of its ellipsoid likes to spin one way only. Spun the other
# way it begins to rattle, stops and comes back. T. R. Kane and D. A. Levinson, Int. J. Non-Linear Mech. 17, 175 (1982),
# with their figures' numbers (cm, s, per unit of mass; rolling without slipping, a little drag σ):
#
#     I(x) ω' = (I0 ω) x ω + x x (x' x ω + ω x (x x ω)) + g μ x x - σ ω,   μ' = μ x ω,   I(x) = I0 + x² - x xᵀ,
#
# μ the downward vertical, x from mass centre to contact, both in body axes. Started with a tilt of half a degree at
# -5 rad/s it stops first after 2.390 s, tilted by 9.50° at most after 1.187 s; at +5 rad/s it does not turn back.

# %%
import sys

import numpy as np
from scipy.integrate import solve_ivp

from rotor.classical.euler import gyroscopic_term

semiaxes_squared, height, g = np.array([20.0, 3.0, 2.0]) ** 2, 1.0, 981.0
inertia = np.array([[2.0, -0.2, 0.0], [-0.2, 16.0, 0.0], [0.0, 0.0, 17.0]])


def cross(a, b):
    """a x b of two vectors (3,), which is Euler's gyroscopic term where a is a momentum."""
    return np.array(gyroscopic_term(*a, *b))


def contact(mu, mu_rate):
    """Vector from mass centre to contact and its rate in body axes."""
    e = np.sqrt(semiaxes_squared @ mu**2)
    e_rate = semiaxes_squared @ (mu * mu_rate) / e
    x = semiaxes_squared * mu / e - [0.0, 0.0, height]
    return x, semiaxes_squared * (mu_rate - mu * e_rate / e) / e


def rates(_, y, drag):
    """d(μ, ω)/dt."""
    mu, omega = y[:3], y[3:]
    mu_rate = cross(mu, omega)
    x, x_rate = contact(mu, mu_rate)
    rolling = cross(x_rate, omega) + cross(omega, cross(x, omega))
    torque = cross(inertia @ omega, omega) + cross(x, rolling) + g * cross(mu, x) - drag * omega
    return np.concatenate([mu_rate, np.linalg.solve(inertia + x @ x * np.eye(3) - np.outer(x, x), torque)])


def energy(y):
    """Kinetic energy of rolling and height of the mass centre above the table, per unit of mass."""
    mu, omega = y[:3], y[3:]
    x, _ = contact(mu, np.zeros(3))
    velocity = cross(x, omega)
    return 0.5 * omega @ inertia @ omega + 0.5 * velocity @ velocity + g * (x @ mu)


def stop(_, y, drag):
    """The spin about axis 3, zero where the celt stops."""
    return y[5]


def spun(spin, seconds, drag):
    """The motion from a tilt of half a degree in both directions."""
    c, s = np.cos(np.radians(0.5)), np.sin(np.radians(0.5))
    start = [-c * s, s, c * c, 0.0, 0.0, spin]
    return solve_ivp(rates, (0.0, seconds), start, "DOP853", events=stop, rtol=1e-8, atol=1e-9, args=(drag,))


# %%
wrong_way = spun(-5.0, 6.0, drag=1.0)
first = wrong_way.t_events[0][0]
tilt = np.degrees(np.arccos(wrong_way.y[2]))
early = wrong_way.t < 3.0
print(f"stops after {first:.3f} s; tilted at most {tilt.max():.2f}° at {wrong_way.t[np.argmax(tilt)]:.2f} s")
print(f"spins the other way, at {wrong_way.y[5, -1]:.3f} rad/s after 6 s")
assert abs(first - 2.390) < 1e-3
assert abs(tilt[early].max() - 9.50) < 0.02
assert wrong_way.y[5, -1] > 1.0

# %%
right_way = spun(5.0, 6.0, drag=1.0)
assert right_way.t_events[0].size == 0

# %% [markdown]
# Without drag the energy is kept, and both ways turn back in the end: after 2.353 s and after 11.46 s.

# %%
for spin, reversal in ((-5.0, 2.353), (5.0, 11.46)):
    free = spun(spin, 1.02 * reversal, drag=0.0)
    assert abs(free.t_events[0][0] - reversal) < 5e-3
    assert abs(energy(free.y[:, -1]) / energy(free.y[:, 0]) - 1.0) < 1e-6

# %%
if "--plot" in sys.argv:
    import matplotlib.pyplot as plt

    plt.plot(wrong_way.t, wrong_way.y[5], label="spin / (rad/s)")
    plt.plot(wrong_way.t, tilt, label="tilt / degree")
    plt.xlabel("time / s")
    plt.legend()
    plt.show()
