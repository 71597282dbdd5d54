# %% [markdown]
# # The physical pendulum
# A rod of one metre that swings about its end: I = m l²/3, centre at l/2, small period 2π √(2l/(3g)). From 90° the
# period is longer by 2 K(½)/π = 1.18034 (Landau and Lifshitz, Mechanics, section 11).

# %%
import numpy as np
from scipy.special import ellipk

from rotor.api import GravityAboutPivot, LieRungeKutta, exp, integrate

length, mass, gravity = 1.0, 2.0, 9.80665
moments = mass * length**2 / 3.0 * np.array([1.0, 1.0, 1e-6])
weight = GravityAboutPivot(mass, centre=[0.0, 0.0, -length / 2], gravity=[0.0, 0.0, -gravity])
small = 2.0 * np.pi * np.sqrt(2.0 * length / (3.0 * gravity))


def period(amplitude):
    """Twice the time between two passes through the vertical."""
    times = np.linspace(0.0, 2.0 * small, 401)
    swing = integrate(LieRungeKutta(1e-11), moments, [0.0, 0.0, 0.0], times, exp([amplitude, 0, 0]), [weight])
    angle = 2.0 * np.arctan2(swing.attitude[:, 1], swing.attitude[:, 0])
    k = np.flatnonzero(angle[:-1] * angle[1:] < 0.0)
    passes = times[k] - angle[k] * (times[k + 1] - times[k]) / (angle[k + 1] - angle[k])
    assert np.ptp(swing.energy) < 1e-8 * mass * gravity * length
    return 2.0 * (passes[1] - passes[0])


# %%
print(f"small swing {period(1e-3):.6f} s, closed form {small:.6f} s")
assert np.isclose(period(1e-3), small * (1 + 1e-6 / 16), rtol=1e-7)  # interpolated passes
ratio = period(np.pi / 2) / small
print(f"from 90 degrees {ratio:.5f} times longer")
assert abs(ratio - 2.0 * ellipk(0.5) / np.pi) < 1e-6
assert abs(ratio - 1.18034) < 1e-5
