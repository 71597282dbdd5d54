# %% [markdown]
# # The tennis racket
# A body that spins about its intermediate axis turns over, again and again, each half period. The half period
# follows from the exact motion; a stepped motion finds the same.
#
# Moments 0.3, 0.35, 0.4 kg m², ω = (0.1, 15, 0.1) rad/s: the period of the momentum is 12.3349458 s.

# %%
import sys

import numpy as np

from rotor.api import SymmetricTopSplitting, free_motion, integrate

moments = np.array([0.3, 0.35, 0.4])
momentum = moments * [0.1, 15.0, 0.1]
period = float(free_motion(moments, momentum).period)
print(f"period {period:.10f} s: the racket turns over every {period / 2:.4f} s")
assert abs(period - 12.3349458093386) < 1e-9

# %% [markdown]
# The same from steps: the times at which the component along the intermediate axis changes sign.

# %%
times = np.linspace(0.0, 60.0, 6001)
motion = integrate(SymmetricTopSplitting(step=0.005, order=4), moments, momentum, times)
along = motion.momentum[:, 1]
before = np.flatnonzero(along[:-1] * along[1:] < 0.0)
flips = times[before] + 0.01 * along[before] / (along[before] - along[before + 1])
print("flips at", flips.round(4))
assert np.allclose(np.diff(flips), period / 2, atol=1e-4)  # linear interpolation over 0.01 s

# %%
if "--plot" in sys.argv:
    import matplotlib.pyplot as plt

    plt.plot(times, motion.omega, label=["axis 1", "axis 2", "axis 3"])
    plt.xlabel("time / s")
    plt.ylabel("angular velocity in the body / (rad/s)")
    plt.legend()
    plt.show()
