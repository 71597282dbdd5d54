# %% [markdown]
# # The centre of percussion
# A blow at a distance b from the mass centre leaves a point on the other side, at distance d, at rest if b = k²/d,
# k the radius of gyration (E. J. Routh, Elementary Rigid Dynamics). A uniform rod held at one end is struck without
# jar at two thirds of its length.

# %%
import numpy as np
from scipy.optimize import brentq

from rotor.api import angular_velocity, free_motion, rotate

length, mass, blow = 0.9, 1.5, np.array([0.0, 3.0, 0.0])  # m, kg, N s
moments = mass * length**2 / 12.0 * np.array([1e-6, 1.0, 1.0])
hand = np.array([-length / 2, 0.0, 0.0])  # from the mass centre


def speed_of_hand(b):
    """Velocity of the held end, across the rod, just after a blow at b from the mass centre."""
    omega = angular_velocity(np.cross([b, 0.0, 0.0], blow), moments)
    return (blow / mass + np.cross(omega, hand))[1]


struck = brentq(speed_of_hand, 0.0, length / 2, xtol=1e-15)
print(f"no jar {(struck + length / 2) / length:.6f} of the length from the hand")
assert np.isclose(struck + length / 2, 2.0 * length / 3.0, rtol=1e-12)
assert speed_of_hand(0.9 * struck) > 0.0 > speed_of_hand(1.1 * struck)  # hit short: the hand is pushed along

# %% [markdown]
# The motion after the blow is free, and exact: the held end starts at rest and leaves its place with the square of time,
# towards the middle of the rod, which turns at ω: by ½ ω² (length/2) t².

# %%
momentum = np.cross([struck, 0.0, 0.0], blow)
time = 1e-3
_, attitude = free_motion(moments, momentum).at(time)
moved = blow / mass * time + rotate(attitude, hand) - hand
turning = momentum[2] / moments[2]
assert np.allclose(moved, [0.5 * turning**2 * length / 2 * time**2, 0.0, 0.0], rtol=0.0, atol=1e-8)  # (ω t)³ length/12
