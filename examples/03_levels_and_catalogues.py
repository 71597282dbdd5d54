# %% [markdown]
# # Levels and catalogues
#
# How the levels of an asymmetric top run between the symmetric limits; how they agree with the energies that the field's
# reference program prints; what each order of centrifugal distortion contributes to the spectrum of water; and why half of
# the levels of SO₂ are missing.

# %%
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import MHZ_PER_CM, read_egy

# %matplotlib inline

rotor.api.use_style()

data = Path("data")  # reference values, beside this notebook

# %% [markdown]
# ## From prolate to oblate
#
# The correlation diagram: energies of J = 4 against Ray's κ, A and C fixed. At κ = -1 levels are labelled by Ka, at κ = +1
# by Kc; the levels of one Wang block never cross, which is why labels by order inside a block are safe.

# %%
A, C, J = 10.0, 4.0, 4
kappas = np.linspace(-0.9999, 0.9999, 101)
curves = []
for kappa in kappas:
    top = rotor.Top(rotor.Constants(A=A, B=(A + C + kappa * (A - C)) / 2, C=C, representation="Ir"))
    levels = rotor.api.solve_levels(top, J, jmin=J)
    curves.append(levels.energy_mhz)
curves = np.array(curves)

figure, axis = plt.subplots(figsize=(7, 5), layout="constrained")
for i, ka in enumerate(levels.quanta["ka"]):
    axis.plot(kappas, curves[:, i], lw=1.4, color="#0072B2" if ka % 2 == 0 else "#D55E00")
for k in range(J + 1):
    left, right = curves[0][levels.quanta["ka"] == k].mean(), curves[-1][levels.quanta["kc"] == k].mean()
    axis.text(-1.03, left, f"$K_a={k}$", ha="right", va="center", fontsize=9)
    axis.text(1.03, right, f"$K_c={k}$", va="center", fontsize=9)
axis.set(xlabel="Ray's asymmetry parameter κ", xlim=(-1, 1), yticks=[])
axis.set_title(
    "Levels of J = 4 between the prolate and the oblate top\n(A = 10, C = 4; Ka even blue, odd orange)", fontsize=10
)
axis.spines[["top"]].set_visible(False)

# %%
prolate = np.sort([C * J * (J + 1) + (A - C) * k**2 for k in (0, 1, 1, 2, 2, 3, 3, 4, 4)])
assert np.allclose(np.sort(curves[0]), prolate, atol=0.02)  # B - C = 3e-4 MHz there
for block in levels.blocks:
    inside = curves[:, block.start : block.start + block.basis.size]
    assert (np.diff(inside, axis=1) > 0).all()  # levels of one block never cross

# %% [markdown]
# ## Against the reference program
#
# SPCAT (H. M. Pickett) prints level energies to 1e-6 cm⁻¹. For eight sets of constants (A and S reductions, prolate and oblate
# tops, sextic and octic distortion, J up to 150) samples of its `.egy` files are compared. The energies calculated
# from the same `.var` files are equal to the last printed digit, 5e-7 cm⁻¹ or 15 kHz.

# %%
cases = ("abc_sred", "abc_ared6", "h2co", "so2", "h2o_sextic", "h2o_octic", "pyridine_oblate_s", "hard_nearsym_j150")
off, by_case = {}, {}
for case in cases:
    top, printed = rotor.read(data / "levels" / f"{case}.var"), read_egy(data / "levels" / f"{case}.egy")
    j, ka, kc = printed.quanta.T
    levels = rotor.api.solve_levels(top, int(j.max()))
    rows = levels.rows_of(j=j, ka=ka, kc=kc)
    off[case] = levels.energy_mhz[rows] / MHZ_PER_CM - printed.energy_cm
    by_case[case] = {
        "levels": len(j),
        "highest J": j.max(),
        "largest difference (cm⁻¹)": f"{np.abs(off[case]).max():.1e}",
    }

figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
for place, values in enumerate(off.values()):
    axes.plot(np.full(len(values), place) + np.linspace(-0.3, 0.3, len(values)), 1e6 * values, ".", ms=4)
axes.axhspan(-0.5, 0.5, color="gray", alpha=0.2, lw=0)
axes.set_xticks(range(len(off)), [case.replace("_", "\n", 1) for case in off], fontsize=8)
axes.set(ylabel="Calculated - SPCAT (10⁻⁶ cm⁻¹)", title="Energies; grey: what rounding to six decimals allows")
pd.DataFrame(by_case).transpose()

# %%
assert all(np.abs(values).max() < 5.1e-7 for values in off.values())  # half of the last printed digit, and 1 % for ties

# %% [markdown]
# ## What each order contributes: water
#
# The 110 strongest measured lines with J ≤ 10 and Ka ≤ 5 (JPL catalogue c018003, Pickett et al. 1998), against the library's
# constants cut off after each order. The constants are one fit, so a truncated set is not the best set of its order; the
# point is how much of the spectrum each order carries.

# %%
measured = rotor.read(data / "catalogues" / "c018003_part.cat")
upper, lower = (
    dict(zip(("j", "ka", "kc"), q.T, strict=False)) for q in (measured.quanta_upper, measured.quanta_lower)
)  # v = 0
water = rotor.read("water")
orders = {
    "rigid": (),
    "quartic": ("DJ", "DJK", "DK", "d1", "d2"),
    "sextic": ("HJ", "HJK", "HKJ", "HK", "h1", "h2", "h3"),
    "octic": ("LJ", "LJJK", "LJK", "LKKJ", "LK", "l1", "l2", "l3", "l4"),
    "decic": ("PJ", "PJJK", "PJK", "PKJ", "PKKJ", "PK"),
}
taken: tuple[str, ...] = ("A", "B", "C")
off, by_order = {}, {}
for order, names in orders.items():
    taken += names
    part = {name: value for name, value in water.constants.values.items() if name in taken}
    levels = rotor.api.solve_levels(rotor.Top(rotor.Constants(**part, reduction="S", representation="Ir")), 10)
    calculated = levels.energy_mhz[levels.rows_of(**upper)] - levels.energy_mhz[levels.rows_of(**lower)]
    off[order] = np.abs(calculated - measured.frequency_mhz)
    by_order[order] = {
        "median difference (MHz)": f"{np.median(off[order]):.3f}",
        "largest difference (MHz)": f"{off[order].max():.3f}",
    }

figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for i, values in enumerate(off.values()):
    axis.semilogy(i + np.linspace(-0.25, 0.25, len(values)), values, ".", ms=4, color="#0072B2")
    axis.semilogy([i - 0.3, i + 0.3], [np.median(values)] * 2, color="#D55E00", lw=2)
axis.set_xticks(range(len(off)), list(off))
axis.set(ylabel="|Calculated - measured| (MHz)", title="110 measured lines of water, order by order (orange: median)")
pd.DataFrame(by_order).transpose()

# %%
medians = [float(np.median(values)) for values in off.values()]
assert medians[0] > 1e3
assert all(later < earlier for earlier, later in pairwise(medians))
assert medians[-1] < 1.0

# %% [markdown]
# ## Missing levels: SO₂
#
# ¹⁶O has no nuclear spin, so a level must keep its sign when both oxygens change places: only levels with Ka + Kc even exist.
# Filled circles in the term diagram exist, open ones do not. CDMS's catalogue c064502 lists no line of the others.

# %%
so2 = rotor.read("SO2")
levels = rotor.api.solve_levels(so2, 20)
exists = levels.weight > 0
print(f"SO2 to J = 20: {int(exists.sum())} of {len(levels)} levels exist")

ka, j, energy = levels.quanta["ka"], levels.quanta["j"], levels.energy_mhz / MHZ_PER_CM
shown = (j <= 8) & (ka <= 4)
figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
for chosen, face in ((exists, "C0"), (~exists, "none")):
    rows = shown & chosen
    axis.scatter(ka[rows] + 0.06 * (j[rows] - 4), energy[rows], s=18, facecolor=face, edgecolor="C0")
axis.set(xlabel="Ka (J grows to the right within each group)", ylabel="Energy (cm⁻¹)", title="Levels of SO₂, J ≤ 8")

# %%
assert ((levels.quanta["ka"] + levels.quanta["kc"]) % 2 == 0)[exists].all()
assert abs(exists.mean() - 0.5) < 0.03
published = rotor.read(data / "catalogues" / "c064502_part.cat")
assert ((published.quanta_upper[:, 1] + published.quanta_upper[:, 2]) % 2 == 0).all()

# %% [markdown]
# And the other way: with ¹⁸O in one place the oxygens are no longer alike, and every level is there.

# %%
mixed = rotor.read("SO2", isotopes="2=18O")
mixed_levels = rotor.api.solve_levels(mixed, 20)
print(f"¹⁸O=S=¹⁶O to J = 20: {int((mixed_levels.weight > 0).sum())} of {len(mixed_levels)} levels exist")
assert mixed.spin_weights.to_mapping() == {}
assert (mixed_levels.weight > 0).all()
