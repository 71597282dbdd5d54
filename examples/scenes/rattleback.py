# %% [markdown]
# # The rattleback
# A celt whose principal axes are turned against the axes of its ellipsoid likes to spin one way only. Spun the other
# way it begins to rattle, stops and comes back. T. R. Kane and D. A. Levinson, Int. J. Non-Linear Mech. 17, 175 (1982),
# with their figures' numbers (cm, s, per unit of mass; rolling without slipping, a little drag σ). About the point of
# contact the motion is that of Euler's equations with an added inertia and a torque (`RollingEllipsoid`).
#
# Started with a tilt of half a degree at -5 rad/s it stops first after 2.390 s, tilted by 9.50° at most after 1.187 s;
# at +5 rad/s it does not turn back.

# %%
import sys

import numpy as np

from rotor.api import (
    LieRungeKutta,
    LinearDrag,
    RollingEllipsoid,
    conjugate,
    from_matrix,
    integrate,
    multiply,
    rotate,
    total_momentum,
)

inertia = np.array([[2.0, -0.2, 0.0], [-0.2, 16.0, 0.0], [0.0, 0.0, 17.0]])  # along the ellipsoid's axes
moments, columns = np.linalg.eigh(inertia)
columns[:, 2] *= np.linalg.det(columns)  # a rotation
to_principal = from_matrix(columns.T)
centre = rotate(to_principal, [0.0, 0.0, -1.0])  # the ellipsoid's centre is 1 cm above the mass centre, μ being down
celt = RollingEllipsoid(1.0, [20.0, 3.0, 2.0], gravity=[0.0, 0.0, 981.0], centre=centre, axes=to_principal)
drag = LinearDrag([1.0, 1.0, 1.0])


def spun(spin, times, effects):
    """The motion from a tilt of half a degree in both directions, the third axis of space pointing down."""
    c, s = np.cos(np.radians(0.5)), np.sin(np.radians(0.5))
    down = np.array([-c * s, s, c * c]) / np.linalg.norm([-c * s, s, c * c])  # along the ellipsoid's axes
    across = np.cross([0.0, 1.0, 0.0], down)
    across /= np.linalg.norm(across)
    attitude = multiply(from_matrix([across, np.cross(down, across), down]), conjugate(to_principal))
    start = total_momentum(rotate(to_principal, [0.0, 0.0, spin]), moments, effects, attitude)
    return integrate(LieRungeKutta(1e-7), moments, start, times, attitude, effects)


def spin_and_tilt(motion):
    """Rate about the ellipsoid's third axis, and its angle from the vertical in degrees."""
    third = rotate(to_principal, [0.0, 0.0, 1.0])
    upright = rotate(motion.attitude, third)[:, 2]
    return motion.omega @ third, np.degrees(np.arccos(np.clip(upright, -1.0, 1.0)))


def first_stop(motion):
    """When the spin first passes through zero, by interpolation; nan if it does not."""
    spin, _ = spin_and_tilt(motion)
    passes = np.flatnonzero(spin[:-1] * spin[1:] < 0.0)
    if not passes.size:
        return np.nan
    k = passes[0]
    return motion.times[k] + (motion.times[k + 1] - motion.times[k]) * spin[k] / (spin[k] - spin[k + 1])


def finer_in(seconds, *spans):
    """Times every 20 ms, and every 1 ms within the spans."""
    parts = [np.arange(0.0, seconds, 0.02), *(np.arange(*span, 0.001) for span in spans)]
    return np.unique(np.concatenate(parts).round(6))


# %%
times = finer_in(5.0, (1.17, 1.20), (2.37, 2.41))  # the largest tilt, the first stop
wrong_way = spun(-5.0, times, [celt, drag])
spin, tilt = spin_and_tilt(wrong_way)
stop, highest = first_stop(wrong_way), np.argmax(tilt)
print(f"stops after {stop:.3f} s; tilted at most {tilt[highest]:.2f}° at {times[highest]:.3f} s")
print(f"spins the other way, at {spin[-1]:.3f} rad/s after 5 s")
assert abs(stop - 2.390) < 1e-3
assert abs(tilt[highest] - 9.50) < 0.02
assert abs(times[highest] - 1.187) < 2e-3
assert spin[-1] > 1.0

# %%
assert np.isnan(first_stop(spun(5.0, times, [celt, drag])))

# %% [markdown]
# Without drag the energy is conserved, and both ways turn back in the end: after 2.353 s and after 11.46 s.

# %%
for rate, reversal in ((-5.0, 2.353), (5.0, 11.46)):
    free = spun(rate, finer_in(reversal + 0.05, (reversal - 0.03, reversal + 0.03)), [celt])
    assert abs(first_stop(free) - reversal) < 2e-3
    assert np.ptp(free.energy) < 1e-6 * free.energy[0]

# %%
if "--plot" in sys.argv:
    import matplotlib.pyplot as plt

    plt.plot(wrong_way.times, spin, label="spin / (rad/s)")
    plt.plot(wrong_way.times, tilt, label="tilt / degree")
    plt.xlabel("time / s")
    plt.legend()
    plt.show()
