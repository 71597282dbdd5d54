# %% [markdown]
# # Euler's wobble of a rigid Earth
# The pole of a rigid Earth would circle the axis of figure in 1/e sidereal days, e = (C - A)/A. With the dynamical
# ellipticity 0.0032845479 of the IAU 2000 nutation (P. M. Mathews, T. A. Herring, B. A. Buffett, J. Geophys. Res. 107,
# B4 (2002)) that is 304.456 sidereal days, 303.62 solar ones. The observed Chandler wobble takes 433: the Earth yields.

# %%
import numpy as np

from rotor.api import ExactDrift, integrate, precession_rates

ellipticity = 0.0032845479
moments = np.array([1.0, 1.0, 1.0 + ellipticity])
turn = 2.0 * np.pi  # per sidereal day
tilt = 1e-6  # rad, of the rotation axis against the axis of figure: some six metres at the pole
momentum = moments * turn * np.array([tilt, 0.0, 1.0])

days = np.linspace(0.0, 1000.0, 1001)
motion = integrate(ExactDrift(step=1.0), moments, momentum, days)
angle = np.unwrap(np.arctan2(motion.omega[:, 1], motion.omega[:, 0]))
period = 2.0 * np.pi * (days[-1] - days[0]) / (angle[-1] - angle[0])
solar = period * 86164.0905 / 86400.0
print(f"the pole circles once in {period:.3f} sidereal days = {solar:.2f} solar days")
assert abs(period - 304.456) < 5e-4
assert abs(solar - 303.62) < 5e-3
assert np.isclose(2.0 * np.pi / precession_rates(moments, momentum)[0], period, rtol=1e-9)  # 1e-16 x 1000 turns / tilt
