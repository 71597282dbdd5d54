# %% [markdown]
# # Levels and catalogues
#
# How the levels of an asymmetric top run between the symmetric limits, what each order of centrifugal distortion buys for
# water, and why half of the levels of SO2 are missing. Pictures go to the folder given on the command line, if one is.

# %%
import sys
from itertools import pairwise
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import rotor

folder = Path(sys.argv[1]) if len(sys.argv) > 1 and Path(sys.argv[1]).is_dir() else None


def keep(figure, name):
    """Write a picture where a folder was given."""
    if folder is not None:
        figure.savefig(folder / name, dpi=160, bbox_inches="tight")
    plt.close(figure)


# %% [markdown]
# ## From prolate to oblate
#
# The correlation diagram: energies of J = 4 against Ray's κ, A and C held. At κ = -1 levels are labelled by Ka, at κ = +1
# by Kc; each level of a Wang block keeps its place in the block all the way, which is what the labels rest on.

# %%
A, C, J = 10.0, 4.0, 4
kappas = np.linspace(-0.9999, 0.9999, 101)
curves = []
for kappa in kappas:
    top = rotor.Top(rotor.Constants(A=A, B=(A + C + kappa * (A - C)) / 2, C=C, representation="Ir"))
    levels = rotor.solve_levels(top, J, jmin=J)
    curves.append(levels.energy_mhz)
curves = np.array(curves)

figure, axis = plt.subplots(figsize=(5.5, 5))
for i, ka in enumerate(levels.quanta["ka"]):
    axis.plot(kappas, curves[:, i], lw=1.4, color="#0072B2" if ka % 2 == 0 else "#D55E00")
for k in range(J + 1):
    left, right = curves[0][levels.quanta["ka"] == k].mean(), curves[-1][levels.quanta["kc"] == k].mean()
    axis.text(-1.03, left, f"$K_a={k}$", ha="right", va="center", fontsize=9)
    axis.text(1.03, right, f"$K_c={k}$", va="center", fontsize=9)
axis.set(xlabel="Ray's asymmetry parameter κ", xlim=(-1, 1), yticks=[])
axis.set_title(
    "Levels of J = 4 between the prolate and the oblate top\n(A = 10, C = 4; Ka even blue, odd red)", fontsize=10
)
axis.spines[["top"]].set_visible(False)
keep(figure, "kappa.png")

prolate = np.sort([C * J * (J + 1) + (A - C) * k**2 for k in (0, 1, 1, 2, 2, 3, 3, 4, 4)])
assert np.allclose(np.sort(curves[0]), prolate, atol=0.02)  # B - C = 3e-4 MHz there
for block in levels.blocks:
    inside = curves[:, block.start : block.start + block.basis.size]
    assert (np.diff(inside, axis=1) > 0).all()  # levels of one block never cross

# %% [markdown]
# ## What each order buys: water
#
# Sixteen measured lines (JPL catalogue 18003, Pickett et al. 1998; frequency in MHz), against the library's constants cut
# off after each order. The constants are one fit of lines with Ka ≤ 5, so a truncated set is not the best set of its order,
# and the line 7(5,3) - 6(6,0) with Ka = 6 stays far off; the point is how much of the spectrum each order carries.

# %%
measured = {
    (1, 1, 0, 1, 0, 1): 556935.9877, (2, 1, 1, 2, 0, 2): 752033.143, (2, 0, 2, 1, 1, 1): 987926.759,
    (3, 1, 2, 3, 0, 3): 1097364.79, (1, 1, 1, 0, 0, 0): 1113343.007, (3, 1, 3, 2, 2, 0): 183310.087,
    (4, 1, 4, 3, 2, 1): 380197.3598, (5, 1, 5, 4, 2, 2): 325152.899, (6, 1, 6, 5, 2, 3): 22235.0798,
    (4, 2, 3, 3, 3, 0): 448001.0775, (6, 4, 3, 5, 5, 0): 439150.7948, (7, 5, 3, 6, 6, 0): 437346.664,
    (3, 3, 0, 2, 2, 1): 4512384.121, (5, 3, 2, 4, 4, 1): 620700.9549, (6, 4, 2, 5, 5, 1): 470888.903,
    (7, 4, 3, 7, 3, 4): 2664570.803,
}  # fmt: skip
water = rotor.read("water")
orders = {
    "rigid": (),
    "quartic": ("DJ", "DJK", "DK", "d1", "d2"),
    "sextic": ("HJ", "HJK", "HKJ", "HK", "h1", "h2", "h3"),
    "octic": ("LJ", "LJJK", "LJK", "LKKJ", "LK", "l1", "l2", "l3", "l4"),
    "decic": ("PJ", "PJJK", "PJK", "PKJ", "PKKJ", "PK"),
}


def misses(constants):
    """|calculated - measured| of the sixteen lines, in MHz."""
    top = rotor.Top(constants, water.dipole_abc_debye, water.spin_weights)
    lines = rotor.line_list(top, jmax=8, min_lgint=None)
    labels = np.hstack([lines.quanta(lines.upper), lines.quanta(lines.lower)])
    table = {tuple(label): f for label, f in zip(labels.tolist(), lines.frequency_mhz, strict=True)}
    # a line whose order of levels is turned round by a poor set is found under the turned label
    return np.array([abs(table.get(key, -table.get((*key[3:], *key[:3]), np.nan)) - f) for key, f in measured.items()])


kept: tuple[str, ...] = ("A", "B", "C")
off = {}
for order, names in orders.items():
    kept += names
    part = {name: value for name, value in water.constants.values.items() if name in kept}
    off[order] = misses(rotor.Constants(**part, reduction="S", representation="Ir"))
    print(f"{order:8} median {np.median(off[order]):12.3f} MHz, worst {off[order].max():14.3f} MHz")

figure, axis = plt.subplots(figsize=(6, 4))
for i, values in enumerate(off.values()):
    axis.semilogy(np.full(len(values), i) + np.linspace(-0.2, 0.2, len(values)), values, "o", ms=4, color="#0072B2")
    axis.semilogy([i - 0.3, i + 0.3], [np.median(values)] * 2, color="#D55E00", lw=2)
axis.set_xticks(range(len(off)), list(off))
axis.set(ylabel="|calculated - measured| (MHz)", title="Sixteen lines of water, order by order")
axis.spines[["top", "right"]].set_visible(False)
keep(figure, "water_orders.png")

medians = [np.median(values) for values in off.values()]
assert medians[0] > 1e3
assert all(later < earlier for earlier, later in pairwise(medians))
assert medians[-1] < 1.0

# %% [markdown]
# ## Missing levels: SO2
#
# ¹⁶O has no spin, so a level must keep its sign when both O change places: of all (Ka, Kc) only ee and oo exist.

# %%
so2 = rotor.read("SO2")
lines = rotor.line_list(so2, jmax=20)
for rows in (lines.upper, lines.lower):
    quanta = lines.quanta(rows)
    assert ((quanta[:, 1] + quanta[:, 2]) % 2 == 0).all()
levels = rotor.solve_levels(so2, 20)
print(f"SO2 to J = 20: {int((levels.weight > 0).sum())} of {len(levels)} levels exist")
assert abs((levels.weight > 0).mean() - 0.5) < 0.03

# %% [markdown]
# And the other way: give the oxygens a difference, ¹⁸O in one place, and every level is there.

# %%
mixed = rotor.read("SO2", isotopes="2=18O")
assert mixed.spin_weights.to_mapping() == {}
