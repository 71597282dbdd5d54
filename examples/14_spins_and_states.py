# %% [markdown]
# # Spins and states
#
# A nucleus of spin 1 or more splits every rotational line; a second state, of tunnelling or of vibration, brings lines of its own
# and pushes the levels of the first. Five sections: Casimir's formula for HCN; measured components of formamide and vinyl
# cyanide; what the cheaper methods leave out; ammonia's inversion and an avoided crossing; sum rules.
# Names of constants and options: `docs/spins_and_states.md`; all molecules that were compared:
# `docs/validation/measured_lines.md`.

# %%
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import used_method

# %matplotlib inline

rotor.api.use_style()

data = Path("data")  # reference values, beside this notebook


def components(top, jmax, method="exact", temperature_k=300.0):
    """The lines of a top with its spins, and for each its quanta: upper, lower."""
    effects = rotor.api.effects_of(top, True, method)
    lines = rotor.api.line_list(top, jmax=jmax, temperature_k=temperature_k, min_lgint=None, effects=effects)
    pairs = zip(lines.quanta(lines.upper).tolist(), lines.quanta(lines.lower).tolist(), strict=True)
    return lines, [(tuple(upper), tuple(lower)) for upper, lower in pairs]


def measured(sample):
    """Components (MHz) of a file of measured lines by their quanta."""
    rows = (data / "hyperfine" / f"{sample}.csv").read_text(encoding="utf-8").splitlines()[1:]
    cells = [row.split(",") for row in rows]
    return {tuple(tuple(map(int, side.split())) for side in row[2:]): float(row[0]) for row in cells}


# %% [markdown]
# ## HCN J = 1 - 0 and Casimir's formula
#
# The charge of ¹⁴N (I = 1) is not a sphere; the field gradient of the electrons turns it. In first order a linear molecule has
#
# $$E_F = -\chi\,\frac{\frac34 C(C+1) - I(I+1)J(J+1)}{2I(2I-1)(2J-1)(2J+3)} + \frac{c}{2}\,C, \qquad C = F(F+1) - I(I+1) - J(J+1)$$
#
# with χ = eQq along the axis and c of the spin-rotation (C. H. Townes, A. L. Schawlow, *Microwave Spectroscopy*, 1955, ch. 6 and 8). J = 0
# is not split, so that there are three lines, as strong as 2F + 1.

# %%
hcn = rotor.read("HCN")
spin = hcn.spin_constants.values
chi, c = spin["chi_aa(14N)"], spin["C_bb(14N)"]


def casimir(f, j=1, i=1):
    """First-order energy in MHz of one nucleus on a linear molecule."""
    factor = f * (f + 1) - i * (i + 1) - j * (j + 1)
    whole = 0.75 * factor * (factor + 1) - i * (i + 1) * j * (j + 1)
    return -chi * whole / (2 * i * (2 * i - 1) * (2 * j - 1) * (2 * j + 3)) + c / 2 * factor


centre = float(rotor.api.line_list(hcn, jmax=1, min_lgint=None).frequency_mhz[0])
lines, quanta = components(hcn, 1)
first, _ = components(hcn, 1, "first-order")
laboratory = measured("hcn")
rows = []
for (upper, lower), frequency, plain, strength in zip(
    quanta, lines.frequency_mhz, first.frequency_mhz, lines.strength_debye2, strict=True
):
    f, seen = upper[-1], laboratory[upper, lower]
    rows.append(
        (f, frequency, plain - centre, casimir(f), 1e3 * (seen - frequency), strength / lines.strength_debye2.sum())
    )

names = (
    "F'",
    "computed (MHz)",
    "first-order shift (MHz)",
    "Casimir's formula (MHz)",
    "obs - calc (kHz)",
    "share of the strength",
)
pd.DataFrame(rows, columns=names).round(4)

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", width_ratios=(1, 1.4))
for f, _, shift, *_ in rows:
    left.plot([0.0, 0.6, 1.0, 2.0], [0, 0, shift, shift], color="C0", lw=1)
    left.text(2.05, shift, f"F = {f}", va="center")
left.plot([0, 0.6], [0, 0], color="black", lw=2)
left.set(
    xlim=(-0.1, 2.7),
    xticks=[0.3, 1.5],
    xticklabels=["without", "with ¹⁴N"],
    ylabel="E - E(J = 1) (MHz)",
    title="HCN J = 1",
)
origin = 88_630.0
for f, frequency, *_, share in rows:
    right.vlines(frequency - origin, 0, share, color="C0", lw=3)
    right.text(frequency - origin, share + 0.01, f"F = {f} - 1", ha="center")
right.plot(
    [nu - origin for nu in laboratory.values()],
    [0.0] * 3,
    "^",
    color="C1",
    label="measured",
    clip_on=False,
    zorder=3,
)
right.axvline(centre - origin, color="gray", ls=":", lw=1, label="line without spins")
right.set(
    xlabel="Frequency − 88 630 MHz (MHz)",
    ylabel="Share of the strength",
    xlim=(0, 4.5),
    ylim=(0, 0.65),
    title="J = 1 - 0",
)
right.legend()

# %%
for f, _, shift, formula, off, share in rows:
    assert abs(shift - formula) < 1e-9  # first order is the formula; rounding of 88 GHz
    assert abs(share - (2 * f + 1) / 9) < 1e-5  # second order mixes J = 1 with 3 by χ/(10 B)
    assert abs(off) < 1.0  # kHz, the laboratory's error; χ and c come from these lines, the centre does not
assert abs(sum(share * shift for _, _, shift, _, _, share in rows)) < 1e-4  # the centre of gravity stays; second order

# %% [markdown]
# ## Measured components: formamide 1₁₀ - 1₁₁ and vinyl cyanide 2₁₁ - 2₁₂
#
# No constant was fitted here to the lines that are compared: χ of ¹⁴N is as published, and the centre comes from the constants in
# `data/molecules`. The frequencies are those of a list of rest frequencies for a radio telescope (sdhdfProc, G. Hobbs, 2019, 2020),
# which gives neither errors nor F: two of its last digit, 2 kHz, are taken for the error, and each frequency has the F of the only
# computed component within 20 kHz.

# %%
targets = {"formamide": ("hconh2", "1(1,0) - 1(1,1)"), "vinyl cyanide": ("ch2chcn", "2(1,1) - 2(1,2)")}
figure, panels = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
off_khz, rows = {}, []
for panel, (name, (sample, label)) in zip(panels, targets.items(), strict=True):
    laboratory = measured(sample)
    lines, quanta = components(rotor.read(name), 2)
    upper, lower = next(iter(laboratory))
    inside = [row for row, (up, low) in enumerate(quanta) if (up[:-1], low[:-1]) == (upper[:-1], lower[:-1])]
    strongest = lines.strength_debye2[inside].max()
    off_khz[name] = []
    for row in sorted(inside, key=lambda one: lines.frequency_mhz[one]):
        frequency, share = lines.frequency_mhz[row], lines.strength_debye2[row] / strongest
        tag = f"{quanta[row][0][-1]} - {quanta[row][1][-1]}"
        panel.vlines(frequency, 0, share, color="C0", lw=3)
        panel.text(frequency, share + 0.02, tag, ha="center", fontsize=8)
        if quanta[row] in laboratory:
            seen = laboratory[quanta[row]]
            off_khz[name].append(1e3 * (seen - frequency))
            rows.append((name, tag, seen, frequency, round(off_khz[name][-1], 2), share))
            panel.plot(
                seen,
                0,
                "^",
                color="C1",
                clip_on=False,
                zorder=3,
                label="measured" if len(off_khz[name]) == 1 else None,
            )
        else:
            rows.append((name, tag, "not in the list", frequency, "", share))
    panel.set(
        xlabel="Frequency (MHz)", ylabel="Strength, strongest = 1", ylim=(0, 1.15), title=f"{name} {label}, F' - F''"
    )
    panel.ticklabel_format(useOffset=False)
    panel.locator_params(axis="x", nbins=5)
    panel.margins(x=0.08)
    panel.legend(loc="upper left")
    assert len(off_khz[name]) == len(laboratory)  # each measured component is in the computed list
heading = ["molecule", "F' - F''", "measured (MHz)", "computed (MHz)", "obs - calc (kHz)", "relative strength"]
pd.DataFrame(rows, columns=heading).round(4)

# %%
for name, off in off_khz.items():
    rms, worst = np.sqrt(np.mean(np.square(off))), np.abs(off).max()
    print(f"{name}: rms {rms:.2f} kHz, largest {worst:.2f} kHz")
    assert rms < 2.5  # kHz; 2 taken for the error of one line, and the centres are predicted to a few kHz
    assert worst < 4.0  # two errors

# %% [markdown]
# ## Exact, N-diagonal, first order, and what is left out
#
# χ also connects different N and different Ka. `first-order` leaves both out, `N-diagonal` only the first; the report states by how
# much lines may then differ from the exact ones. The stated figure is to be a bound: the largest difference lies below it, over six orders
# of magnitude in what is left out. The last molecule is made up: χ of bromine, with an axis off a, and a pair of close levels.

# %%
tops = {
    "HCN": rotor.read("HCN"),
    "formamide": rotor.read("formamide"),
    "vinyl cyanide": rotor.read("vinyl cyanide"),
    "CH₃Cl": rotor.read("CH3Cl"),
    "made up, ⁷⁹Br": rotor.Top.from_constants(
        {"A": 9400, "B": 3100, "C": 2500, "chi_aa(79Br)": 500, "chi_bb-cc(79Br)": -30, "chi_ab(79Br)": 150},
        dipole_abc_debye=(1, 0, 0),
    ),
}
found = []
for name, top in tops.items():
    lines, quanta = components(top, 5)
    exact = dict(zip(quanta, lines.frequency_mhz, strict=True))
    for method in ("N-diagonal", "first-order"):
        cheaper, own = components(top, 5, method)
        off = [abs(nu - exact[key]) for key, nu in zip(own, cheaper.frequency_mhz, strict=True) if key in exact]
        stated = used_method(cheaper.levels).estimate_mhz
        found.append((name, method, max(off), stated, len(off)))

figure, axes = plt.subplots(figsize=(8, 3.8), layout="constrained")
for method, marker, shift in (("N-diagonal", "o", -0.1), ("first-order", "s", 0.1)):
    here = [row for row in found if row[1] == method]
    place = np.arange(len(here)) + shift
    axes.plot(place, [row[2] for row in here], marker, color="C0", label=f"{method}, largest difference")
    axes.plot(place, [row[3] for row in here], marker, mfc="none", color="C1", ms=8, label=f"{method}, stated")
axes.axhline(1e-4, color="gray", ls=":", lw=1, label="tolerance of auto, 0.1 kHz")
axes.set(
    yscale="log",
    ylabel="Difference (MHz)",
    xticks=range(len(tops)),
    xticklabels=list(tops),
    title="Lines to J = 5: difference from exact",
)
axes.legend(fontsize=8)
heading = ["molecule", "method", "largest difference (MHz)", "stated (MHz)", "lines"]
pd.DataFrame(found, columns=heading).style.format(precision=2).format("{:.2e}", subset=heading[2:4])

# %%
assert all(largest <= stated for _, _, largest, stated, _ in found)
assert all(stated < 10 * largest for _, _, largest, stated, _ in found)  # and it is no empty bound
chosen = {name: used_method(components(top, 5, "auto")[0].levels) for name, top in tops.items()}
print(", ".join(f"{name}: {used.method}" for name, used in chosen.items()))
assert chosen["HCN"].method == "first-order"
assert chosen["made up, ⁷⁹Br"].method == "exact"

# %% [markdown]
# ## Two states: the inversion of ammonia
#
# Nitrogen tunnels through the plane of the protons; each level is a pair, 0⁺ and 0⁻, and the dipole connects the two halves. The
# library's ammonia has both states, with a table of energies that comes from measured lines; so the lines by that table test labels and
# selection rules more than physics. The constants of the two states alone, without the table, are the second column: a series in J and K.
# Measured: list of rest frequencies of F. J. Lovas, NIST 2004.

# %%
LAB = {(1, 1): 23694.4955, (2, 2): 23722.6333, (3, 3): 23870.1292, (2, 1): 23098.8190}  # (J, K): MHz
ammonia = rotor.read("NH3")
inversion = {}
for kind, top in {"table": ammonia, "constants": replace(ammonia, level_table=None)}.items():
    levels = rotor.api.solve_levels(top, 3)
    for j, k in LAB:
        pair = [levels.energy_mhz[levels.find(v=v, j=j, k=k)] for v in (0, 1)]
        inversion[kind, j, k] = pair[1] - pair[0]
rows = []
for (j, k), seen in LAB.items():
    table, alone = inversion["table", j, k], inversion["constants", j, k]
    rows.append((f"({j}, {k})", seen, table, 1e3 * (seen - table), alone, 1e3 * (seen - alone)))
    assert abs(seen - table) < 5e-4  # MHz: rounding of two energies of the table
    assert abs(seen - alone) < 0.2  # MHz: what the file says of the constants

lines = rotor.api.line_list(ammonia, jmax=8, temperature_k=300, range_mhz=(20e3, 27e3))
up, low = lines.quanta(lines.upper), lines.quanta(lines.lower)
assert (up[:, 0] != low[:, 0]).all()  # the dipole connects the halves of a pair and nothing else
assert (up[:, 2] > 0).all()  # K = 0 has no pairs: protons leave one half of each

figure, axes = plt.subplots(figsize=(9, 3.6), layout="constrained")
for ortho, color in ((True, "C1"), (False, "C0")):
    here = (up[:, 2] % 3 == 0) == ortho
    label = "ortho, K = 3, 6" if ortho else "para"
    axes.vlines(lines.frequency_mhz[here] / 1e3, 0, 10.0 ** lines.lgint[here] * 1e4, color=color, lw=2, label=label)
for row in np.flatnonzero((up[:, 1] == up[:, 2]) & (up[:, 1] <= 6)):
    height = 10.0 ** lines.lgint[row] * 1e4
    axes.text(
        lines.frequency_mhz[row] / 1e3, height, f"({up[row, 1]},{up[row, 2]})", ha="center", va="bottom", fontsize=8
    )
axes.set(xlabel="Frequency (GHz)", ylabel="Intensity at 300 K (10⁻⁴ nm² MHz)", title="Inversion lines of NH₃, (J, K)")
axes.set_ylim(bottom=0)
axes.margins(y=0.1)
axes.legend()
heading = [
    "(J, K)",
    "measured (MHz)",
    "by table (MHz)",
    "obs - calc (kHz)",
    "by constants (MHz)",
    "obs - calc of these (kHz)",
]
pd.DataFrame(rows, columns=heading).round(4)

# %% [markdown]
# ## Two states that cross
#
# Two states of a prolate top, the second 1.2 GHz higher with a smaller B: for J near 15 they meet. The Coriolis term i G_a N_a
# has the element i G_a K, so that with Δ = E₁ - E₀ before coupling
#
# $$E_\pm = \tfrac12 (E_0 + E_1) \pm \tfrac12\sqrt{\Delta^2 + 4 G_a^2 K^2}.$$
#
# K = 0 does not feel it and the states cross; the others avoid each other by 2 G_a K, and the lines J + 1 - J leave their regular course.

# %%
a, b, energy, db, g, highest = 9000.0, 3000.0, 1200.0, -5.0, 40.0, 24
pair = rotor.Top.from_constants(
    {"A": a, "B": b, "C": b, "E[1]": energy, "A[1]": a, "B[1]": b + db, "C[1]": b + db, "G_a[0,1]": g},
    dipole_abc_debye=(1, 0, 0),
)
levels = rotor.api.solve_levels(pair, highest)
js = np.arange(6, highest + 1)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
worst, gaps = 0.0, {}
for k, color in ((0, "gray"), (1, "C0"), (3, "C1")):
    curves = []
    for j in js:
        mine = (levels.quanta["j"] == j) & (levels.quanta["ka"] == k)
        curves.append(np.sort(levels.energy_mhz[mine])[:: 2 if k else 1])  # of a K doublet one
    curves = np.array(curves)
    own = np.array([b * js * (js + 1) + (a - b) * k**2, energy + (b + db) * js * (js + 1) + (a - b - db) * k**2])
    root = np.hypot(own[1] - own[0], 2 * g * k)
    closed = own.mean(axis=0) + np.array([[-0.5], [0.5]]) * root
    worst = max(worst, np.abs(curves.T - closed).max())
    gaps[k] = (curves[:, 1] - curves[:, 0]).min()
    middle = own.mean(axis=0)
    for branch in (0, 1):
        left.plot(js, curves[:, branch] - middle, "o-", ms=3, lw=1, color=color, label=f"K = {k}" if branch else None)
    if k:
        left.plot(js, (own - middle).T, color=color, ls=":", lw=0.8)
    lower = np.diff(curves[:, 0]) / (2 * (js[:-1] + 1))
    right.plot(js[:-1], lower, "o-", ms=3, lw=1, color=color, label=f"K = {k}")
left.set(xlabel="J", ylabel="E - (E₀ + E₁)/2 (MHz)", title="Two states that meet near J = 15 (dotted: not coupled)")
left.set_ylim(-500, 500)
for axes in (left, right):
    axes.set_xticks(range(6, highest + 1, 3))
left.legend()
right.set(xlabel="J", ylabel="ν(J + 1 - J) / 2(J + 1) (MHz)", title="Lines of the lower levels")
right.ticklabel_format(useOffset=False)
right.legend()

# %%
print(
    f"largest difference from the closed form {worst:.1e} MHz; smallest distances "
    + str({k: round(float(gap), 2) for k, gap in gaps.items()})
)
assert worst < 1e-7  # rounding of 2e6 MHz, a few times 2e-10, in matrices of 60 rows
assert gaps[0] < 1e-7  # K = 0 meets at J = 15, where J(J + 1) = 240
assert all(2 * g * k <= gap < 2 * g * k + 5 for k, gap in gaps.items() if k)  # smallest at a whole J, not at Δ = 0

# %% [markdown]
# ## Sum rules
#
# The components of one line have together (2I + 1) times its strength, and Q with spins is (2I + 1) times Q without, so that the
# intensity of the whole line does not change. Nor does its centre of gravity, to first order. The two lines of formamide below 1 MHz
# are left out: both of their levels are split by more than that, so that some components have upper and lower level exchanged.

# %%
formamide = rotor.read("formamide")
plain = rotor.api.line_list(formamide, jmax=4, temperature_k=20, min_lgint=None, range_mhz=(1.0, 1e7))
split, quanta = components(formamide, 4, temperature_k=20)
keys = [(upper[:-1], lower[:-1]) for upper, lower in quanta]
own = zip(plain.quanta(plain.upper).tolist(), plain.quanta(plain.lower).tolist(), strict=True)
ratios, moved, brightness = [], [], []
for row, (upper, lower) in enumerate(own):
    inside = [i for i, key in enumerate(keys) if key == (tuple(upper), tuple(lower))]
    strength = split.strength_debye2[inside]
    ratios.append(strength.sum() / plain.strength_debye2[row])
    moved.append(np.average(split.frequency_mhz[inside], weights=strength) - plain.frequency_mhz[row])
    brightness.append(split.intensity_nm2_mhz[inside].sum() / plain.intensity_nm2_mhz[row])
ratios, moved, brightness = map(np.array, (ratios, moved, brightness))
q = {
    temperature: [
        rotor.api.partition_function(formamide, temperature, effects=rotor.api.effects_of(formamide, hyperfine)).q
        for hyperfine in (False, True)
    ]
    for temperature in (5, 20, 100)
}
print(f"{len(ratios)} lines; strength of all components / line - 3: at most {np.abs(ratios - 3).max():.1e}")
print(
    f"centres move by at most {1e3 * np.abs(moved).max():.1e} kHz; intensities by {np.abs(brightness - 1).max():.1e} of themselves"
)
print("; ".join(f"Q with / without at {kelvin} K: {each / plain:.10g}" for kelvin, (plain, each) in q.items()))

# %%
assert len(ratios) > 90
assert np.abs(ratios - 3).max() < 1e-6  # 2I + 1 of ¹⁴N; χ of 5 MHz over rotational distances of 10 GHz, squared
assert np.abs(moved).max() < 1e-3  # MHz; second order, χ² over those distances
narrow = plain.frequency_mhz < 1000  # here a splitting of some MHz counts in ν² of the intensity
assert np.abs(brightness[narrow] - 1).max() < 2e-3  # (splitting / ν)², 1e-3 for the line at 2.3 MHz
assert np.abs(brightness[~narrow] - 1).max() < 1e-5
assert all(abs(with_spin / without / 3 - 1) < 1e-9 for without, with_spin in q.values())  # (χ/kT)² at 5 K is 2e-9
