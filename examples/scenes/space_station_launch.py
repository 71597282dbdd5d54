# %% [markdown]
# # A ball let go, and one launched, in a spinning space station; and a centrifuge
# Seen from space a free ball flies straight. The station is a rigid body that turns freely, and its attitude at any time is
# exact; the path seen from inside is the straight one in the station's axes, bent by what people on board call centrifugal
# and Coriolis forces. A ball let go at radius r inside a floor of radius R flies √(R² - r²) at the speed Ω r, and lands
# behind the spot below it by R (x - atan x), x = √(R²/r² - 1). R = 100 m at one g, dropped from 2 m: 0.272 m behind.

# %%
import numpy as np

from rotor.api import conjugate, free_motion, gyroscopic_rate, rotate

radius, drop, g = 100.0, 2.0, 9.80665
spin = np.array([0.0, 0.0, np.sqrt(g / radius)])
moments = np.array([0.5, 0.5, 1.0])  # a ring, per mass and R²; the axis of the ring is the third
station = free_motion(moments, moments * spin)


def seen_inside(position, velocity, times):
    """Path (t, 3) in the station of a ball with position and velocity (3,) in the station at time 0."""
    straight = position + (velocity + np.cross(spin, position)) * np.asarray(times)[:, None]
    return rotate(conjugate(station.at(times)[1]), straight)


def landing(position, velocity):
    """When and where a ball reaches the floor, in the station: |position + v t| = R."""
    v = velocity + np.cross(spin, position)
    a, b, c = v @ v, 2.0 * position @ v, position @ position - radius**2
    time = (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    return time, seen_inside(position, velocity, [time])[0]


# %%
start = np.array([radius - drop, 0.0, 0.0])
time, place = landing(start, np.zeros(3))
x = np.sqrt((radius / start[0]) ** 2 - 1.0)
behind = -radius * np.arctan2(place[1], place[0])
print(f"lands after {time:.4f} s, {behind:.4f} m behind")
assert np.isclose(behind, radius * (x - np.arctan(x)), rtol=1e-12)
assert abs(behind - 0.272) < 5e-4

# %% [markdown]
# The acceleration seen inside, by differences along the path, is Coriolis' 2 v x Ω and the centrifugal (Ω x r) x Ω.

# %%
h = 1e-3
before, now, after = seen_inside(start, np.array([1.0, 2.0, 3.0]), [1.0 - h, 1.0, 1.0 + h])
velocity, acceleration = (after - before) / (2 * h), (after - 2 * now + before) / h**2
apparent = 2.0 * gyroscopic_rate(velocity, spin) + gyroscopic_rate(np.cross(spin, now), spin)
assert np.allclose(acceleration, apparent, atol=1e-6)  # h² of central differences, 1e-14 R/h² of rounding

# %% [markdown]
# Launched from the axis at speed v toward the floor, the ball lands Ω R/v radians behind; launched backwards along the
# floor at Ω R it does not fall at all.

# %%
_, place = landing(np.zeros(3), np.array([20.0, 0.0, 0.0]))
assert np.isclose(-np.arctan2(place[1], place[0]) % (2 * np.pi), spin[2] * radius / 20.0, atol=1e-12)
hover = seen_inside(np.array([90.0, 0.0, 0.0]), np.array([0.0, -90.0 * spin[2], 0.0]), np.linspace(0.0, 10.0, 11))
assert np.allclose(np.linalg.norm(hover, axis=1), 90.0, rtol=1e-14)

# %% [markdown]
# ## A centrifuge
#
# At 15,000 turns a minute, 8 cm from the axis, a sample weighs 20,128 times what it does at rest; the rule of laboratories,
# 1.118e-5 r/cm (turns a minute)², says 20,124. A bead that slides without friction from r₀ along a radial tube is at
# r₀ cosh Ωt, and reaches the bottom R after acosh(R/r₀)/Ω. Seen from space nothing pulls it outwards: the wall of the tube
# pushes it sideways, with 2Ωv.

# %%
rate, bottom, inner = 15_000 * 2 * np.pi / 60, 0.08, 0.04
drum = free_motion(moments, moments * [0.0, 0.0, rate])
arrival = np.arccosh(bottom / inner) / rate
h = 1e-3 / rate
times = 0.5 * arrival + np.array([-h, 0.0, h])


def acceleration_along_the_tube(radii):
    """Acceleration in space, by differences, of what is at these radii of the tube at the three times; in axes of the tube."""
    path = rotate(drum.at(times)[1], radii[:, None] * np.array([1.0, 0.0, 0.0]))
    return rotate(conjugate(drum.at(times[1])[1]), (path[0] - 2 * path[1] + path[2]) / h**2)


weight = -acceleration_along_the_tube(np.full(3, bottom))[0] / g
print(f"{weight:.0f} g at the bottom; a bead from half way arrives after {1e3 * arrival:.4f} ms")
assert np.isclose(weight, 1.118e-5 * 8 * 15_000**2, rtol=1e-3)  # the rule has four digits
bead, speed = inner * np.cosh(rate * times), inner * rate * np.sinh(rate * times[1])
assert np.allclose(acceleration_along_the_tube(bead), [0, 2 * rate * speed, 0], atol=1e-6 * rate**2 * bottom)  # h²
assert np.isclose(inner * np.cosh(rate * arrival), bottom, rtol=1e-14)
assert abs(1e3 * arrival - 0.8384) < 5e-5  # acosh 2/(500π s⁻¹)
