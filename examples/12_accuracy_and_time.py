# %% [markdown]
# # What accuracy costs
#
# Every approximation has a setting, and every setting a price. Each section varies one setting, measures the error against a
# calculation that is much finer, and the processor time. The times belong to the machine that made this
# notebook, so only their ratios matter.

# %%
import time

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import (
    EV_PER_K,
    MoserVeselov,
    RotationSplitting,
    SymmetricTopSplitting,
    distance,
    integrate,
    thermal_ensemble,
)

# %matplotlib inline

rotor.api.use_style()


def timed(work, repeats=3):
    """The answer, and the milliseconds of processor time of the fastest of several runs."""
    spent = []
    for _ in range(repeats):
        start = time.process_time()
        answer = work()
        spent.append(time.process_time() - start)
    return answer, 1e3 * min(spent)


def two_axes(x_label, title):
    """A diagram with errors on the left and times on the right."""
    _, left = plt.subplots(figsize=(7, 4), layout="constrained")
    right = left.twinx()
    right.spines["right"].set_visible(True)
    left.set(xlabel=x_label, ylabel="Error (solid)", yscale="log", title=title)
    right.set(ylabel="Processor time (ms, dashed)", yscale="log")
    return left, right


# %% [markdown]
# ## Highest J
#
# Levels up to J max cost what diagonalising four Wang blocks of each J costs. What is lost by stopping is the population above
# J max. The heavier the molecule, the higher J must go.

# %%
left, right = two_axes("J max", "Population above J max at 300 K")
for color, (name, counts) in zip(
    ("C0", "C1"), {"H2CO": range(10, 81, 10), "SO2": range(20, 161, 20)}.items(), strict=True
):
    top = rotor.read(name)
    rigid = rotor.Top(
        rotor.Constants(**dict(zip("ABC", top.constants.rigid, strict=True))), spin_weights=top.spin_weights
    )
    everything = rotor.api.solve_levels(rigid, 180)
    kelvin = (everything.energy_mhz - everything.ground_mhz) / (rotor.units.MHZ_PER_K * 300)
    population = everything.degeneracy * np.exp(-kelvin)
    lost, spent = [], []
    for jmax in counts:
        levels, milliseconds = timed(lambda top=rigid, jmax=jmax: rotor.api.solve_levels(top, jmax), 1)
        above = everything.quanta["j"] > levels.jmax
        lost.append(population[above].sum() / population.sum())
        spent.append(milliseconds)
    left.plot(counts, np.maximum(lost, 1e-16), "o-", ms=3, color=color, label=name)
    right.plot(counts, spent, "--", color=color)
    assert (np.diff(lost) < 0).all()
    assert lost[-1] < 1e-9
left.set_ylim(1e-16, 2)
left.legend(loc="center left")

# %% [markdown]
# Choose J max by the population that you may lose; `rotor.api.line_list` does so from the cut of the intensities, and
# `rotor.api.partition_function` from the error asked for.
#
# ## Tolerance of Q
#
# The sum ends where its estimated tail is below `relative_error`. The estimate is compared with the true error, from a sum to
# 1e-13: it must never be too small, and it should not be much too large.

# %%
asked = np.logspace(-2, -10, 5)
left, right = two_axes("Relative error asked for", "Partition functions at 300 K: error reached")
for color, name in zip(("C0", "C1", "C2"), ("OCS", "SO2", "CH3CN"), strict=True):
    top = rotor.read(name)
    full = float(rotor.api.partition_function(top, 300.0, 1e-13).q)
    reached, spent = [], []
    for tolerance in asked:
        answer, milliseconds = timed(
            lambda top=top, tolerance=tolerance: rotor.api.partition_function(top, 300.0, tolerance)
        )
        reached.append(abs(float(answer.q) / full - 1))
        spent.append(milliseconds)
    left.plot(asked, np.maximum(reached, 1e-14), "o-", ms=3, color=color, label=name)
    right.plot(asked, spent, "--", color=color)
    assert (np.array(reached) <= asked).all()
    assert np.median(np.array(reached) / asked) > 1e-3
left.plot(asked, asked, "k:", lw=1)
left.set_xscale("log")
left.invert_xaxis()
left.legend(loc="center left", bbox_to_anchor=(0.0, 0.3))

# %% [markdown]
# Where the error allows it, Q is the corrected classical limit, which needs no levels. A smaller error needs the sum over levels, and
# that takes some ten times as long (dashed: the step). More digits then cost little, since the terms of the sum fall as exp(-E/kT).
#
# ## The cut of a line list
#
# Lines below `min_lgint` are left out. What they would have absorbed together is the error; their number is the cost, in time
# and in the size of the file.

# %%
cuts = np.arange(-4.0, -14.1, -1.0)
so2 = rotor.read("SO2")
complete = rotor.api.line_list(so2, min_lgint=-16, range_mhz=(0, 2e6))
total = complete.intensity_nm2_mhz.sum()
missing, counts, table = [], [], {}
for cut in cuts:
    lines, milliseconds = timed(lambda cut=cut: rotor.api.line_list(so2, min_lgint=float(cut), range_mhz=(0, 2e6)), 1)
    missing.append(abs(1 - lines.intensity_nm2_mhz.sum() / total))
    counts.append(len(lines))
    table[f"{cut:.0f}"] = {
        "lines": len(lines),
        "processor time (ms)": f"{milliseconds:.0f}",
        "absorption left out": f"{missing[-1]:.1e}",
    }
left, right = two_axes("Cut of the intensity, log₁₀ (nm² MHz)", "SO₂ below 2 THz, 300 K: absorption left out")
left.plot(cuts, missing, "o-", ms=4)
right.plot(cuts, counts, "--")
right.set(ylabel="Lines (dashed)", yscale="linear", ylim=(0, None))
left.invert_xaxis()
pd.DataFrame(table).transpose().rename_axis("min_lgint")

# %%
assert (np.diff(missing) <= 0).all()
assert (np.diff(counts) >= 0).all()
assert missing[4] < 1e-4  # at -8
assert missing[8] < 1e-8  # the default of -12

# %% [markdown]
# For a picture -6 is enough; for a search for weak lines keep the default of -12.
#
# ## Steps of classical motion
#
# A water-like top, I = (1, 1.875, 2.875), L = (0.5, 0.75, 1), error of the attitude after 100 periods against the exact motion.
# The slope of each curve is the order of the method.

# %%
moments, momentum, turns = np.array([1.0, 1.875, 2.875]), np.array([0.5, 0.75, 1.0]), 100
exact = rotor.api.free_motion(moments, momentum)
period = float(exact.period)
end = exact.at(turns * period)[1]
methods = {
    "rotations, order 2": (lambda n: RotationSplitting(period / n, 2), (80, 160, 320, 640)),
    "rotations, order 4": (lambda n: RotationSplitting(period / n, 4), (40, 80, 160, 320)),
    "symmetric top, order 4": (lambda n: SymmetricTopSplitting(period / n, 4), (40, 80, 160, 320)),
    "symmetric top, order 8": (lambda n: SymmetricTopSplitting(period / n, 8), (20, 40, 80)),
    "Moser-Veselov, order 8": (lambda n: MoserVeselov(period / n, 8), (40, 80, 160)),
}
figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
slopes, table = {}, {}
for marker, (name, (make, counts)) in zip("osv^D", methods.items(), strict=True):
    errors, spent = [], []
    for count in counts:
        motion, milliseconds = timed(
            lambda make=make, count=count: integrate(make(count), moments, momentum, [0.0, turns * period]), 2
        )
        errors.append(float(distance(motion.attitude[-1], end)))
        spent.append(1e3 * milliseconds / turns)
    slopes[name] = np.log(errors[-2] / errors[-1]) / np.log(counts[-1] / counts[-2])
    table[name] = {
        "steps per period": f"{counts[0]} to {counts[-1]}",
        "error, longest step (rad)": f"{errors[0]:.1e}",
        "error, shortest step (rad)": f"{errors[-1]:.1e}",
        "slope": f"{slopes[name]:.1f}",
    }
    axes.loglog(errors, spent, marker + "-", ms=5, label=f"{name}: slope {slopes[name]:.1f}")
answer, milliseconds = timed(lambda: exact.at(period * np.arange(1, turns + 1)))
fifty_digits = (0.18396472966240838, -0.12579834796681974, 0.37906201650949952, 0.89813347645481284)  # q at t = 10⁶
error = float(distance(exact.at(1e6)[1], fifty_digits))
axes.loglog([error], [1e3 * milliseconds / turns], "k*", ms=12, label="exact motion, after 48,000 periods")
axes.invert_xaxis()
axes.set(
    xlabel="Error of the attitude after 100 periods (rad)",
    ylabel="Processor time per period (µs)",
    title="Free asymmetric top",
)
axes.legend(fontsize=8)
pd.DataFrame(table).transpose()

# %%
for name, slope in slopes.items():
    assert abs(slope - int(name.split()[-1])) < 0.15 * int(name.split()[-1])  # two steps are not quite in the limit

# %% [markdown]
# A free body is never stepped: `rotor.api.free_motion` is exact at any time. With torques take a splitting of order 4; order 8 or
# Moser-Veselov where 1e-8 is asked for.
#
# ## Number of samples
#
# Averages of a classical gas come from samples; their error is that of statistics, 1/√N, whatever the method. The mean of
# 2E/kT of rotation of water, 40 gases for each N.

# %%
water, kt = rotor.read("water"), EV_PER_K * 300
counts = np.array([100, 300, 1000, 3000, 10000])
spread, spent = [], []
for count in counts:
    means, start = [], time.process_time()
    for seed in range(40):
        gas = thermal_ensemble(
            water.moments_u_angstrom2, kt, int(count), rng=np.random.default_rng(seed), mass=water.mass_u
        )
        means.append((gas.momentum**2 / gas.moments).sum(axis=1).mean() / kt / 3)
    spread.append(float(np.sqrt(np.mean((np.array(means) - 1) ** 2))))
    spent.append(1e3 * (time.process_time() - start) / 40)
left, right = two_axes("Molecules", "Mean rotational energy per degree: error of one gas")
left.plot(counts, spread, "o-", ms=4)
left.plot(counts, np.sqrt(2 / 3 / counts), "k:", lw=1)
left.set_xscale("log")
right.plot(counts, spent, "--")

# %%
assert np.abs(np.array(spread) / np.sqrt(2 / 3 / counts) - 1).max() < 4 / np.sqrt(80)  # 4 σ of a spread from 40 gases

# %% [markdown]
# Ten times the accuracy needs a hundred times the molecules; the dotted line is the closed form √(2/3N).
