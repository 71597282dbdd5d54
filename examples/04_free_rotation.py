# %% [markdown]
# # Free rotation: a book, a racket and a molecule
#
# Set spinning about its axis of smallest or of largest moment, a book keeps spinning about it; about the intermediate axis it
# turns over, again and again. The same equations turn a water molecule, some 10¹² times faster. Everything here is the exact
# motion, not stepped in time.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import (
    ASE_TIME_PS,
    EV_PER_K,
    HBAR_CLASSICAL,
    fixed_axes,
    growth_rate,
    invariants,
    level,
    mean_thermal_momentum,
    off_intermediate_axis,
    polhode_figure,
    rectangle,
    separatrix_ratio,
)

# %matplotlib inline

rotor.api.use_style()

# %% [markdown]
# ## The book
#
# A closed book in A5 is nearly a uniform plate with sides as 1 to √2. Its moments m h²/12, m w²/12 and their sum are as
# 1 : 2 : 3. It spins at one turn per second, tipped by a hundredth of a radian.

# %%
plate = rectangle(0.4, 0.21, 0.21 / math.sqrt(2))  # kg, m
book = np.sort(plate.tensor.diagonal())
assert np.allclose(book / book[0], [1, 2, 3], rtol=1e-14)

turn_per_s = 2 * math.pi
table = {}
for axis, fixed in enumerate(fixed_axes(book, 1.0)):
    spin = book[axis] * turn_per_s * np.cos(0.01) * np.eye(3)[axis]
    aside = book[axis] * turn_per_s * np.sin(0.01) * (1 - np.eye(3)[axis]) / math.sqrt(2)
    motion = rotor.api.free_motion(book, spin + aside)
    momentum, attitude = motion.at(np.linspace(0, 60, 6001))  # a minute
    direction = momentum / np.linalg.norm(momentum[0])
    tipped = np.degrees(np.arccos(np.clip(direction[:, axis], -1, 1)).max())
    table[f"axis {axis + 1}"] = {
        "motion": fixed.kind,
        "largest angle between L and the axis (°)": f"{tipped:.2f}",
        "period (s)": f"{motion.period:.3f}",
    }
    assert (tipped < 1.2) == (fixed.kind == "stable")  # 0.57° to start with
    assert (tipped > 178) == (fixed.kind == "unstable")  # turned over

    conserved = invariants(momentum, attitude, book)
    assert np.ptp(conserved.energy) < 1e-14 * conserved.energy[0]
    assert np.abs(conserved.space_momentum - (spin + aside)).max() < 1e-14 * conserved.momentum[0]

pd.DataFrame(table).transpose()

# %% [markdown]
# ## Rates in closed form
#
# Near an axis departures oscillate or grow at a rate of closed form. Measured on the exact motion: the time between returns
# for the stable axes, and for the one between them the growth along the separatrix from 10⁻⁷ to 10⁻⁴ of |L|.

# %%
rates = {}
for axis in (0, 2):
    size = book[axis] * turn_per_s  # of L: one turn per second
    nudged = rotor.api.free_motion(book, size * (np.eye(3)[axis] + 1e-5 * (1 - np.eye(3)[axis])))
    later, _ = nudged.at([0.0, 0.5 * nudged.period, nudged.period])
    assert np.allclose(later[2], later[0], atol=1e-15 * size)  # back after a period,
    assert np.abs(later[1] - later[0]).max() > 1e-5 * size  # and not before
    rate = fixed_axes(book, size)[axis].rate
    rates[f"axis {axis + 1}: oscillation, 2π/period (rad/s)"] = (2 * math.pi / nudged.period, rate)
    assert abs(2 * math.pi / nudged.period / rate - 1) < 1e-8  # amplitude squared is 1e-10

size = book[1] * turn_per_s
sigma = float(growth_rate(book, size))
out = np.array([math.sqrt(1 / book[1] - 1 / book[2]), 0, -math.sqrt(1 / book[0] - 1 / book[1])])  # the way it leaves
leaving = rotor.api.free_motion(book, size * (np.eye(3)[1] + 1e-7 * out / np.linalg.norm(out)))
times = np.linspace(0, math.log(1e3) / sigma, 50)
apart = np.linalg.norm(leaving.at(times)[0][:, [0, 2]], axis=1)
slope = np.polyfit(times, np.log(apart), 1)[0]
rates["axis 2: growth (1/s)"] = (slope, sigma)
assert abs(slope / sigma - 1) < 1e-6
assert abs(sigma / turn_per_s - math.sqrt(1 / 3)) < 1e-14  # a factor of 37.6 in every turn
pd.DataFrame(rates, index=["measured", "closed form"]).transpose().map("{:.6f}".format)

# %% [markdown]
# ## Polhodes
#
# L moves in the body where the sphere |L| = const meets the energy ellipsoid. The separatrix, two great circles through the
# intermediate axis, parts the curves about the first axis (blue) from those about the third (green).

# %%
tumbling = rotor.api.free_motion(book, off_intermediate_axis(book, book[1] * turn_per_s, math.radians(0.5)))
seconds = np.linspace(0, 2 * tumbling.period, 400)
polhode_figure(tumbling, seconds, time_label="Time (s)", title="A book, half a degree off")

# %%
path = tumbling.at(seconds)[0]
assert np.ptp(level(book, path)) < 1e-14 * level(book, path[0])  # one polhode
assert (np.diff(np.sign(path[:, 1])) != 0).sum() == 4  # turned over four times in two periods

# %% [markdown]
# ## Against other calculations
#
# Two bodies with the initial values of E. Hairer and G. Vilmart, J. Phys. A 39 (2006) 13225, at t = 10; the reference values
# are from a Taylor integration with 50 digits. And a racket with moments 0.3, 0.35, 0.4 kg m², ω = (0.1, 15, 0.1) rad/s.

# %%
problems = {
    (0.6, 0.8, 1.0): ((1.7659625085182075, -0.69546419703308912, 0.77955498148187109), 6.8626161780581164),
    (0.345, 0.653, 1.0): ((1.8057486941533169, -0.29315907005202235, 0.92915521481064942), 2.2146446558330431),
}
errors = {}
figure, panels = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
for panel, (moments, (expected, expected_period)) in zip(panels, problems.items(), strict=True):
    motion = rotor.api.free_motion(moments, (1.8, 0.4, -0.9))
    error = np.abs(motion.at(10.0)[0] - expected).max()
    errors[f"I = {moments}"] = {
        "error of L at t = 10": f"{error:.1e}",
        "error of the period": f"{abs(motion.period - expected_period):.1e}",
    }
    assert error < 2e-14  # roundings, 2e-16 each, of numbers near 2 in some forty operations
    assert abs(motion.period - expected_period) < 5e-15
    panel.plot(np.linspace(0, 10, 500), motion.at(np.linspace(0, 10, 500))[0], label=["$L_1$", "$L_2$", "$L_3$"])
    panel.plot([10] * 3, expected, "k.", ms=8)
    panel.set(title=f"I = {moments}; dots: 50 digits", ylabel="L in the body", xlim=(0, 10.2))
panels[0].legend(ncols=3, loc="lower right", bbox_to_anchor=(1, 1))
panels[1].set_xlabel("Time")

racket = np.array([0.3, 0.35, 0.4])
period = float(rotor.api.free_motion(racket, racket * [0.1, 15.0, 0.1]).period)
print(f"racket: it turns over every {period / 2:.6f} s")
assert abs(period - 12.3349458093386) < 1e-9
pd.DataFrame(errors).transpose()

# %% [markdown]
# ## Periodic, not chaotic
#
# The growth rate belongs to the unstable axis alone. A free tumble comes back to where it was in the body, a million periods
# later too, and two tumbles that start a little apart separate in proportion to time: no Lyapunov exponent is positive.

# %%
again, _ = tumbling.at(np.array([0.0, 1e6]) * tumbling.period)
print(
    f"after 10⁶ periods L in the body differs by {np.abs(again[1] - again[0]).max() / np.linalg.norm(again[0]):.1e} of |L|"
)
assert np.allclose(
    again[1], again[0], atol=1e-6 * np.linalg.norm(again[0])
)  # the period rounds: 1e-16 times 1e6 and σT

neighbour = rotor.api.free_motion(book, tumbling.momentum0 * (1 + 1e-12))
gaps = []
for periods in (100, 1000, 10000):
    window = (periods + np.linspace(0, 1, 1000)) * float(tumbling.period)
    gaps.append(np.linalg.norm(neighbour.at(window)[0] - tumbling.at(window)[0], axis=1).max())
print("gap after 100, 1000, 10000 periods:", ", ".join(f"{gap / gaps[0]:.2f}" for gap in gaps), "of the first")
assert np.allclose(np.array(gaps) / gaps[0], np.array([101, 1001, 10001]) / 101, rtol=0.02)  # linear, not e^(σt)

# %% [markdown]
# ## Water
#
# Water is a plate too, and its moments are nearly those of the book. It spins at 300 K with a mean of |L| of 4.3 ħ, a
# closed form for the classical gas; what takes the book seconds takes the molecule picoseconds.

# %%
water = rotor.read("water")
moments = np.array(water.moments_u_angstrom2)
size = float(mean_thermal_momentum(moments, EV_PER_K * 300))
molecule = rotor.api.free_motion(moments, off_intermediate_axis(moments, size, math.radians(0.5)))
period_ps = float(molecule.period) * ASE_TIME_PS
polhode_figure(
    molecule, np.linspace(0, 2 * molecule.period, 400), axis_names=("a", "b", "c"), time_label="Time (ps)",
    time_factor=ASE_TIME_PS, title="Water at 300 K, half a degree off its axis b",
)  # fmt: skip

# %%
rows = {
    "moments": [" : ".join(f"{m:.3g}" for m in body / body[0]) for body in (book, moments)],
    "ω3/ω1 on separatrix": [f"{float(separatrix_ratio(body)):.4f}" for body in (book, moments)],
    "growth per radian": [f"{float(growth_rate(body, body[1])):.4f}" for body in (book, moments)],
    "|L|": ["", f"{size / HBAR_CLASSICAL:.3f} ħ"],
    "one turn": ["1 s", f"{2 * math.pi * moments[1] / size * ASE_TIME_PS:.3f} ps"],
    "turned over after": [f"{tumbling.period / 2:.3f} s", f"{period_ps / 2:.3f} ps"],
}
pd.DataFrame(rows, index=["book", "water"]).transpose()

# %%
assert abs(size / HBAR_CLASSICAL - 4.298) < 0.001
assert abs(float(separatrix_ratio(book)) - math.sqrt(1 / 3)) < 1e-14
assert abs(period_ps - 1.798) < 0.001

drawn = np.random.default_rng(4).standard_normal((200_000, 3)) * np.sqrt(EV_PER_K * 300 * moments)
sizes = np.linalg.norm(drawn, axis=1)
assert abs(sizes.mean() - size) < 4 * sizes.std() / math.sqrt(len(sizes))  # 4 σ of a fixed seed

# %% [markdown]
# On the command line this is `rotor tumble water --plot water.png --gif water.gif`.
