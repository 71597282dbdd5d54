# %% [markdown]
# # Hard cases stay stable
#
# Each section takes a limit in which a plain formula or a plain program loses its digits, and measures how many are left
# here: two moments that become equal, J = 1000, a start within 1e-12 of the intermediate axis, a million periods of free
# rotation, rotations by 1e-8 rad, linear molecules in any orientation. The comparison is a closed form, an independent
# calculation with 40 or 50 digits, or the reference program.

# %%
import math
from decimal import Decimal, getcontext
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import MHZ_PER_CM, RotationSplitting, growth_rate, integrate, read_egy, rotations

# %matplotlib inline

rotor.api.use_style()

data = Path("data/levels")  # reference values, beside this notebook

# %% [markdown]
# ## B - C → 0: the asymmetric top becomes a symmetric one
#
# A = 10 GHz, B = 3 GHz, C = B (1 - δ). The levels with |Ka| = K split by an amount proportional to δ^K; for K = 1 the
# splitting is (B - C) J(J + 1)/2 to first order (S. C. Wang, Phys. Rev. 34 (1929) 243). Labels are by order inside Wang blocks,
# so none is exchanged on the way. A splitting below the round-off of the energies themselves (K = 3 below δ = 10⁻⁶) comes out
# as zero or a few units in the last place, of either sign; all larger ones are right.

# %%
A, B, J = 10_000.0, 3_000.0, 20
deltas = np.concatenate([np.logspace(-1, -16, 31), [0.0]])
splitting, joined = {1: [], 2: [], 3: []}, []
for delta in deltas:
    levels = rotor.api.solve_levels(
        rotor.Top(rotor.Constants(A=A, B=B, C=B * (1 - delta), kind="asymmetric")), J, jmin=J
    )
    energy = {
        (int(a), int(c)): e for a, c, e in zip(levels.quanta["ka"], levels.quanta["kc"], levels.energy_mhz, strict=True)
    }
    for k, found in splitting.items():
        found.append(energy[k, J - k] - energy[k, J - k + 1])
    mean = B * (1 - delta / 2)
    closed = np.array([mean * J * (J + 1) + (A - mean) * ka**2 for ka, _ in energy])
    joined.append(np.abs(np.array(list(energy.values())) - closed).max())
splitting = {k: np.array(found) for k, found in splitting.items()}
round_off = float(np.spacing(A * J**2))

figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
for k, found in splitting.items():
    axes.loglog(
        deltas[:-1], np.where(found[:-1] != 0, np.abs(found[:-1]), np.nan), "o-", ms=3, label=f"splitting of Ka = {k}"
    )
axes.loglog(deltas[:-1], B * deltas[:-1] * J * (J + 1) / 2, "k--", lw=1, label="(B - C) J (J + 1) / 2")
axes.axhline(round_off, color="gray", lw=1, ls=":", label="one unit in the last place of the highest level")
axes.invert_xaxis()
axes.set(
    xlabel="(B - C) / B",
    ylabel="Splitting (MHz)",
    title="J = 20: asymmetric to symmetric, without a jump",
    ylim=(1e-11, 1e6),
)
axes.legend(fontsize=8)

# %%
first_order = B * deltas * J * (J + 1) / 2
near = (deltas < 1e-4) & (deltas > 1e-12)
assert (
    np.abs(splitting[1][near] / first_order[near] - 1).max() < 2e-3
)  # the next order is δ J² / 8 (A/B - 1), 1e-3 at δ = 1e-4
assert all(found.min() > -4 * round_off for found in splitting.values())  # rounding of two levels
assert joined[-1] < 4 * round_off  # at δ = 0 the closed form of the symmetric top

# %% [markdown]
# The reference program's case: B - C = 10⁻⁶ B to J = 150. Sixty-one of its printed energies, to the last digit.

# %%
near_symmetric = rotor.read(data / "hard_nearsym_j150.var")
printed = read_egy(data / "hard_nearsym_j150.egy")
j, ka, kc = printed.quanta.T
levels = rotor.api.solve_levels(near_symmetric, 150)
worst = np.abs(levels.energy_mhz[levels.rows_of(j=j, ka=ka, kc=kc)] / MHZ_PER_CM - printed.energy_cm).max()
print(f"κ + 1 = {near_symmetric.kappa + 1:.1e}; {len(j)} levels, largest difference {worst:.1e} cm⁻¹")
assert worst < 5.1e-7  # half of the last digit printed

# %% [markdown]
# ## J = 1000
#
# A heavy top with A = 1000, B = 500, C = 499.9 MHz: 2001 levels of one J, up to 10⁹ MHz. The sum of the energies of each block
# is the trace of its matrix. And single levels, from the bottom to the top, are found again with 40 digits: the number of
# negative pivots of H - E counts the eigenvalues below E (Sylvester).

# %%
getcontext().prec = 40
a, b, c, J = Decimal(1000), Decimal(500), Decimal("499.9"), 1000
levels = rotor.api.solve_levels(rotor.Top(rotor.Constants(A=1000.0, B=500.0, C=499.9)), J, jmin=J)
ulp = float(np.spacing(1000.0 * J**2))


def matrix(block):
    """Diagonal and squared off-diagonal elements of a Wang block in Ir (Wang 1929), in 40 digits."""
    x, mean, quarter = J * (J + 1), (b + Decimal(float(c))) / 2, (b - Decimal(float(c))) / 4
    k = [int(value) for value in block.basis.k]
    diagonal = [mean * (x - n * n) + a * n * n for n in k]
    squared = [quarter**2 * (x - n * (n + 1)) * (x - (n + 1) * (n + 2)) for n in k[:-1]]
    if k[0] == 0:
        squared[0] *= 2
    if k[0] == 1:
        diagonal[0] += block.basis.sign * quarter * x
    return diagonal, squared


def below(diagonal, squared, energy):
    """How many eigenvalues lie below an energy."""
    pivot = diagonal[0] - energy
    count = int(pivot < 0)
    for d, e in zip(diagonal[1:], squared, strict=True):
        pivot = d - energy - e / pivot
        count += pivot < 0
    return count


rows = []
for block in levels.blocks:
    diagonal, squared = matrix(block)
    traced = abs(sum(Decimal(e) for e in block.energies_mhz.tolist()) - sum(diagonal))
    assert float(traced) < 4 * ulp * block.basis.size  # a few roundings a level
    for rank in (0, 1, 60, 250, 400, block.basis.size - 1):
        energy = block.energies_mhz[rank]
        for width in (1, 2, 4):  # how many units in the last place of the highest level enclose the exact eigenvalue
            low, high = Decimal(float(energy)) - Decimal(width * ulp), Decimal(float(energy)) + Decimal(width * ulp)
            if below(diagonal, squared, low) <= rank < below(diagonal, squared, high):
                rows.append((rank, width))
                break
        else:
            raise AssertionError(f"level {rank} is not within 4 units in the last place")
print(
    f"{len(levels)} levels; {len(rows)} of them enclosed: {sum(w == 1 for _, w in rows)} within 1 unit, all within 4, of {ulp:.1e} MHz"
)

# %%
bottom = levels.energy_mhz - (500 - 0.05) * J * (J + 1)
figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
for parity, color, name in ((0, "C0", "even"), (1, "C1", "odd")):
    chosen = (levels.quanta["ka"] + levels.quanta["kc"] - J) % 2 == parity
    axes.plot(
        levels.quanta["ka"][chosen],
        bottom[chosen] / 1e3,
        ".",
        ms=3 + 2 * (1 - parity),
        color=color,
        label=f"Ka + Kc {name}",
    )
axes.set(
    xlim=(-1, 30.5),
    ylim=(-60, 470),
    xlabel="Ka",
    ylabel="E - (B + C) J(J + 1)/2 (GHz)",
    title="J = 1000: the lowest levels",
)
axes.legend()

# %%
energies = [block.energies_mhz for block in levels.blocks]
assert all((np.diff(energy) > 0).all() for energy in energies)
assert np.isfinite(levels.energy_mhz).all()
assert len(levels) == 2 * J + 1

# %% [markdown]
# ## Within 1e-12 of the intermediate axis
#
# A body that spins nearly about its intermediate axis stays there for a while, and turns over; the nearer, the later: each of
# the two passages in a period takes (2/σ) ln(1/d) longer, σ the growth rate, d the distance. So the period grows by (4/σ) ln 10
# for each decade. Stepped motion cannot follow: its round-off of 1e-16 grows by e^σt too, and soon exceeds d. The exact motion
# does, and keeps energy and momentum.

# %%
moments = np.array([1.0, 1.875, 2.875])
distances = np.logspace(-1, -15, 29)
periods, drift, stepped, closed = [], [], [], []
for d in distances:
    start = moments * [d, 1.0, d]
    motion = rotor.api.free_motion(moments, start)
    periods.append(float(motion.period))
    later, _ = motion.at(np.linspace(0, 1e6, 2001) * motion.period / 7)
    energy = 0.5 * (later**2 / moments).sum(axis=1)
    drift.append(max(np.ptp(energy) / energy[0], np.ptp(np.linalg.norm(later, axis=1)) / np.linalg.norm(start)))
    back, _ = motion.at(motion.period)
    closed.append(np.abs(back - start).max())
    if d > 1e-13:
        end = integrate(RotationSplitting(motion.period / 4000, 4), moments, start, [0.0, float(motion.period)])
        stepped.append(np.linalg.norm(end.momentum[-1] - start))
sigma = float(growth_rate(moments, moments[1]))
slope = np.polyfit(np.log10(distances[8:]), periods[8:], 1)[0]
print(f"period per decade: measured {-slope:.6f}, closed form (4/σ) ln 10 = {4 / sigma * math.log(10):.6f}")

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
left.semilogx(distances, periods, "o-", ms=3)
left.set(xlabel="Distance from the axis (rad)", ylabel="Period", title="The period grows as ln(1/d)")
right.loglog(distances, np.maximum(closed, 1e-18), "o-", ms=3, label="exact: return after a period")
right.loglog(distances, np.maximum(drift, 1e-18), "s-", ms=3, label="exact: energy, |L| to 10⁵ periods")
right.loglog(distances[: len(stepped)], stepped, "^-", ms=3, label="stepped: return after a period")
for axes in (left, right):
    axes.invert_xaxis()
right.set(xlabel="Distance from the axis (rad)", ylabel="Error", title="Errors; 10⁻¹⁸ stands for 0")
right.legend(fontsize=8)
largest = {
    "exact: return after a period": max(closed),
    "exact: energy and |L| to 10⁵ periods": max(drift),
    "stepped: return after a period": max(stepped),
}
pd.DataFrame({"largest error": largest}).map("{:.1e}".format)

# %%
assert abs(-slope / (4 / sigma * math.log(10)) - 1) < 1e-6
assert max(drift) < 1e-14
assert max(closed) < 1e-12  # the period rounds to 1e-16 of itself, and L leaves the axis at a rate σ only near a turn
assert stepped[-1] > 0.1  # the stepped motion is lost

reference = rotor.api.free_motion(moments, moments * [1e-12, 1.0, 1e-12])  # 50 digits: Taylor integration
assert abs(reference.period - 207.39643991872882) < 1e-12
assert np.allclose(
    reference.at(100.0)[0], [-1.0765111111172092e-11, -1.875, 1.7241803476116202e-11], rtol=1e-12, atol=0
)

# %% [markdown]
# ## A million time units, fifty thousand periods
#
# The attitude after t = 10⁶ against a calculation with 50 digits. Phases are held in two doubles, so that nothing is lost.

# %%
motion = rotor.api.free_motion(moments, [0.5, 0.75, 1.0])
table = {}
truth = {
    1e3: (0.89834997892268562, 0.024997933189805489, 0.10192471267223579, -0.42656039625418872),
    1e6: (0.18396472966240838, -0.12579834796681974, 0.37906201650949952, 0.89813347645481284),
}
for t, expected in truth.items():
    error = float(rotations.distance(motion.at(t)[1], expected))
    table[f"t = {t:.0e}"] = {
        "periods": f"{t / float(motion.period):.0f}",
        "error of the attitude (rad)": f"{error:.1e}",
    }
    assert error < 5e-15  # the quaternion's own rounding, twice

pd.DataFrame(table).transpose()

# %% [markdown]
# ## Small rotations, and those by nearly π
#
# The angle of a rotation from the scalar part alone, 2 arccos w, loses all digits below 1e-8; with arctan2(|v|, w) none is lost.

# %%
angles = np.concatenate([np.logspace(-12, 0, 49), math.pi - np.logspace(-1, -12, 23)])
axis = np.array([1.0, 2.0, 2.0]) / 3
quaternions = rotations.exp(angles[:, None] * axis)
ours = np.linalg.norm(rotations.log(quaternions), axis=1)
plain = 2 * np.arccos(np.clip(quaternions[:, 0], -1, 1))
figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
axes.loglog(angles, np.maximum(np.abs(plain / angles - 1), 1e-17), "v-", ms=3, label="2 arccos w")
axes.loglog(angles, np.maximum(np.abs(ours / angles - 1), 1e-17), "o-", ms=3, label="rotor.geometry.rotations.log")
axes.set(
    xlabel="Angle of the rotation (rad)", ylabel="Relative error of the angle", title="The logarithm of a quaternion"
)
axes.legend()

# %%
assert np.abs(ours / angles - 1).max() < 1e-15
assert np.abs(plain / angles - 1).max() > 0.5

# %% [markdown]
# ## Linear molecules in any orientation
#
# The smallest moment of HCl is zero, but an eigenvalue routine returns ±1e-17. The kind of top must not depend on that sign, nor
# on the orientation.

# %%
rng = np.random.default_rng(5)
straight = np.array([[0.0, 0, 0], [0, 0, 1.2746]])
signs = 0
for turn in rotations.uniform(200, rng=rng):
    molecule = rotor.Molecule(("H", "Cl"), rotations.rotate(turn, straight) + rng.normal(size=3))
    top = rotor.Top.from_molecule(molecule)
    assert top.kind == "linear"
    assert math.isinf(top.rotational_constants_mhz[0]) or math.isnan(top.rotational_constants_mhz[0])
    centred = molecule.positions_angstrom - molecule.positions_angstrom.mean(axis=0)
    inertia = np.eye(3) * (centred**2).sum() - centred.T @ centred
    signs += np.linalg.eigvalsh(inertia)[0] < 0
print(f"plain eigenvalues: I_a < 0 in {signs} of 200 orientations; here always linear, and A is never computed")
assert signs > 20
