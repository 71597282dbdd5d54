# %% [markdown]
# # Equipartition: the same for every degree
#
# In a classical gas every degree of freedom holds ½ kT on average, whatever the mass or moment of inertia behind it: three
# translations, and three rotations, or two where the molecule is a line. Six gases are drawn at 300 K, moved for 10 ps, and
# tested.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import (
    ASE_TIME_PS,
    EV_PER_K,
    count_degrees,
    equipartition,
    equipartition_figure,
    kinetic_degrees,
    thermal_ensemble,
)

# %matplotlib inline

rotor.api.use_style()

kt = EV_PER_K * 300


def gas_of(name, molecules, seed):
    """A gas of a molecule of the library, 10 ps after it was drawn."""
    top = rotor.read(name)
    rng = np.random.default_rng(seed)
    gas = thermal_ensemble(top.moments_u_angstrom2, kt, molecules, rng=rng, mass=top.mass_u)
    return gas.moved(10.0 / ASE_TIME_PS)


# %% [markdown]
# ## Six gases
#
# Of n molecules Σ 2E/kT follows χ² with n degrees, exactly. The distance of each mean is given in σ; the sum of their squares is
# one statement for all degrees of a gas, the largest distance between distributions another.

# %%
tests, rows = {}, {}
for seed, name in enumerate(("water", "HCl", "CH4", "NH3", "CO2", "C6H6")):
    gas = gas_of(name, 10_000, seed)
    tests[name] = test = equipartition(gas.kinetic, kt)
    one = count_degrees([gas.moments])
    farthest = max(test.degrees, key=lambda degree: abs(degree.sigma))
    rows[name] = {
        "translations": one.translation,
        "rotations": one.rotation,
        "χ²": round(test.chi2, 2),
        "p of χ²": round(test.chi2_p, 2),
        "p of the distributions": round(test.ks_p, 2),
        "farthest degree": farthest.name,
        "its distance (σ)": round(farthest.sigma, 2),
    }
    assert test.accepted
    assert one.rotation == (2 if name in ("HCl", "CO2") else 3)

pd.DataFrame(rows).transpose()

# %%
equipartition_figure(tests)

# %% [markdown]
# Not only the mean is the same: a linear molecule has the distribution of rotational energies exp(-x), x = E/kT, that of two
# degrees, and a bent one 2√(x/π) exp(-x), that of three.

# %%
figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
edges = np.linspace(0, 6, 41)
middle = (edges[1:] + edges[:-1]) / 2
closed = {"CO2": np.exp(-middle), "water": 2 * np.sqrt(middle / math.pi) * np.exp(-middle)}
for color, (name, expected) in zip(("C0", "C1"), closed.items(), strict=True):
    gas = gas_of(name, 40_000, seed=11)
    moments = gas.moments[np.newaxis] if gas.moments.ndim == 1 else gas.moments
    energy = (
        np.divide(gas.momentum**2, 2 * moments, out=np.zeros_like(gas.momentum), where=moments > 0).sum(axis=1) / kt
    )
    seen = np.histogram(energy, edges)[0] / len(energy) / np.diff(edges)
    axes.stairs(seen, edges, color=color, label=f"{name}, 40,000 molecules")
    axes.plot(middle, expected, "--", color="black", lw=0.8)
    error = np.sqrt(expected / np.diff(edges) / len(energy))
    assert (
        np.abs((seen - expected) / error)[2:].max() < 4.5
    )  # σ of a bin; 76 bins. The first two bend within their width
axes.set(xlabel="Rotational energy / kT", ylabel="Probability density", title="Dashed: closed forms")
axes.legend()

# %% [markdown]
# ## A wrong count is caught
#
# A thermostat that takes CO2 for a body of six degrees puts 6/5 of the energy into the five that there are. And a box of ten
# molecules whose total momentum is held at zero has 27 translations, not 30: counted as 30 it seems a tenth too cold.

# %%
gas = gas_of("CO2", 10_000, seed=7)
wrong = equipartition({name: 6 / 5 * energies for name, energies in gas.kinetic.energies.items()}, kt)
print("six degrees of CO2:", wrong)
assert not wrong.accepted
assert len(wrong.failing) == 5

rng = np.random.default_rng(3)
velocities = rng.normal(size=(1000, 10, 3))  # 1000 boxes
velocities -= velocities.mean(axis=1, keepdims=True)
for removed in (True, False):
    box = kinetic_degrees(masses=np.ones(10), velocities=velocities, momentum_removed=removed)
    verdict = equipartition(box, 1.0)
    print(
        f"ten molecules counted as {box.total:.0f} translations: mean of 2E/kT {verdict.degrees[0].mean:.3f}, {verdict}"
    )
    assert verdict.accepted == removed

# %% [markdown]
# ## The stated confidence is the real one
#
# At 90 % confidence at most one honest gas in ten is rejected; somewhat fewer are, since a mean that is off takes the
# distribution along.

# %%
water = rotor.read("water")
rejected = 0
for seed in range(500):
    draw = thermal_ensemble(water.moments_u_angstrom2, kt, 200, rng=np.random.default_rng(seed), mass=water.mass_u)
    rejected += not equipartition(draw.kinetic, kt, confidence=0.9).accepted
print(f"{rejected} of 500 honest gases rejected at 90 % confidence")
assert 25 < rejected < 50 + 3 * math.sqrt(500 * 0.1 * 0.9)  # 3 σ of a binomial above what is allowed

# %% [markdown]
# On the command line this is `rotor gas water --molecules 20000 --temperature 300 --seed 7`.
