# %% [markdown]
# # A ball let go, and one launched, in a spinning space station
# Seen from the station, centrifugal and Coriolis forces bend the path; seen from space it is straight. A ball let
# go at radius r inside a floor of radius R flies √(R² - r²) at the speed Ω r, and lands behind the spot below it by
# R (x - atan x), x = √(R²/r² - 1). R = 100 m at one g, dropped from 2 m: 0.272 m behind.

# %%
import numpy as np
from scipy.integrate import solve_ivp

from rotor.classical.euler import gyroscopic_term
from rotor.geometry.rotations import exp, rotate

radius, drop, g = 100.0, 2.0, 9.80665
spin = np.array([0.0, 0.0, np.sqrt(g / radius)])


def in_station(_, y):
    """Position and velocity in the turning frame: Coriolis 2 v x Ω, centrifugal (Ω x r) x Ω."""
    r, v = y[:3], y[3:]
    coriolis = 2.0 * np.array(gyroscopic_term(*v, *spin))
    centrifugal = np.array(gyroscopic_term(*np.cross(spin, r), *spin))
    return np.concatenate([v, coriolis + centrifugal])


def floor(_, y):
    """Height below the floor."""
    return np.hypot(y[0], y[1]) - radius


floor.terminal = True


def landing(position, velocity):
    """Where and when a ball reaches the floor, in the station."""
    start = np.concatenate([position, velocity])
    flight = solve_ivp(in_station, (0.0, 60.0), start, "DOP853", events=floor, rtol=1e-12, atol=1e-12)
    return flight.t[-1], flight.y[:3, -1]


# %%
start = np.array([radius - drop, 0.0, 0.0])
time, place = landing(start, np.zeros(3))
x = np.sqrt((radius / start[0]) ** 2 - 1.0)
behind = -radius * np.arctan2(place[1], place[0])
print(f"lands after {time:.4f} s, {behind:.4f} m behind")
assert np.isclose(behind, radius * (x - np.arctan(x)), rtol=1e-9)
assert abs(behind - 0.272) < 5e-4

# %% [markdown]
# Turned into space by the station's own rotation, the flight is straight and steady: start + (Ω x start) t.

# %%
assert np.allclose(rotate(exp(spin * time), place), start + np.cross(spin, start) * time, atol=1e-9)

# %% [markdown]
# Launched from the axis at speed v toward the floor, the ball lands Ω R/v radians behind; thrown backwards along the
# floor at Ω R it does not fall at all.

# %%
_, place = landing(np.array([1e-9, 0.0, 0.0]), np.array([20.0, 0.0, 0.0]))
assert np.isclose(-np.arctan2(place[1], place[0]) % (2 * np.pi), spin[2] * radius / 20.0, atol=1e-9)
hover = solve_ivp(
    in_station, (0.0, 10.0), [90.0, 0.0, 0.0, 0.0, -90.0 * spin[2], 0.0], "DOP853", rtol=1e-12, atol=1e-12
)
assert np.allclose(np.hypot(hover.y[0], hover.y[1]), 90.0, atol=1e-8)
