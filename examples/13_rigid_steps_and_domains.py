# %% [markdown]
# # Rigid parts: base pairs of DNA, domains of a protein, and the bracket that parks a car
#
# A base pair of DNA, a domain of a protein and a car on a street are rigid bodies; what differs is what joins them. This notebook uses
# the modules `base_pair_steps`, `rigid_parts` and `rigid_motions` of `rotor.geometry`.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import (
    adjoint,
    bracket,
    chasles_screw,
    compose,
    exp,
    mean_rotation,
    persistence_steps,
    power,
    rigid_parts,
    rotate,
    step_parameters,
    step_pose,
    to_matrix,
    twist_exp,
    twist_log,
)

# %matplotlib inline

rotor.api.use_style()

# %% [markdown]
# ## Base pairs of DNA: how stiff is the double helix?
#
# A step from one base pair to the next has six parameters, in the frame half way between the pairs: shift, slide, rise (Å) and tilt,
# roll, twist (degrees). W. K. Olson, A. A. Gorin, X. J. Lu, L. M. Hock and V. B. Zhurkin (Proc. Natl. Acad. Sci. USA 95, 11163 (1998))
# took their means, and from their covariances in crystals of DNA with proteins force constants F in units of kT: the energy of a step
# is ½ δᵀ F δ, and ⟨δ δᵀ⟩ = F⁻¹. The table holds the ten different steps, as they stand in the public source of a program that
# uses them (`deform_energy.c` by T. Gaillard, Case laboratory); the paper itself was not at hand. Upper triangles of F, order shift,
# slide, rise, tilt, roll, twist.

# %%
STEPS = {  # means; upper triangle of F
    "AA": ([-0.03, -0.08, 3.27, -1.4, 0.7, 35.1],
           [3.978, 1.559, 1.868, -0.149, 0.017, 0.175, 6.160, 1.330, -0.098, -0.137, 0.022, 21.748, -0.288, 0.087, 0.072,
            0.100, -0.001, 0.001, 0.049, 0.031, 0.092]),
    "AT": ([0.0, -0.59, 3.31, 0.0, 1.1, 29.3],
           [3.172, 0, 0, -0.151, 0, 0, 10.694, 0.487, 0, -0.060, -0.090, 25.547, 0, -0.030, -0.409, 0.166, 0, 0, 0.055, 0.029,
            0.070]),
    "AG": ([0.09, -0.25, 3.34, -1.7, 4.5, 31.9],
           [3.205, 1.380, 2.580, -0.282, 0.003, 0.164, 7.187, 4.501, -0.124, 0.100, 0.102, 29.496, -1.044, -0.018, -0.147,
            0.149, 0.026, 0.005, 0.096, 0.015, 0.064]),
    "AC": ([0.13, -0.58, 3.36, -0.1, 0.7, 31.5],
           [2.944, -0.102, -0.412, -0.033, -0.041, -0.044, 6.366, 2.510, -0.010, 0.049, -0.048, 23.860, 0.396, 0.245, -0.276,
            0.111, 0.014, 0.004, 0.080, 0.027, 0.073]),
    "TA": ([0.0, 0.05, 3.42, 0.0, 3.3, 37.8],
           [3.860, 0, 0, -0.176, 0, 0, 2.350, 0.234, 0, 0.061, -0.067, 21.914, 0, -0.102, -0.500, 0.148, 0, 0, 0.029, 0.013,
            0.052]),
    "GA": ([-0.28, 0.09, 3.37, -1.5, 1.9, 36.3],
           [6.542, 1.750, 0.148, -0.132, -0.009, 0.087, 2.780, -0.270, 0.068, -0.050, -0.069, 22.820, -0.502, 0.362, -0.408,
            0.087, -0.010, 0.000, 0.046, 0.011, 0.071]),
    "GG": ([0.05, -0.22, 3.42, -0.1, 3.6, 32.9],
           [2.425, 0.309, 1.563, -0.227, 0.119, 0.040, 3.542, 5.423, -0.160, 0.143, -0.061, 30.312, -0.851, 0.427, -0.196,
            0.119, -0.003, -0.008, 0.064, -0.001, 0.041]),
    "GC": ([0.0, -0.38, 3.40, 0.0, 0.3, 33.6],
           [3.350, 0, 0, -0.236, 0, 0, 6.244, 6.804, 0, 0.412, -0.159, 25.860, 0, 0.630, -0.239, 0.082, 0, 0, 0.082, 0.005,
            0.055]),
    "CA": ([0.09, 0.53, 3.33, 0.5, 4.7, 37.3],
           [3.733, 0.871, 1.747, -0.037, 0.018, -0.087, 2.395, 2.369, 0.062, 0.082, -0.183, 18.235, 0.189, 0.004, -0.321,
            0.082, -0.001, -0.016, 0.048, 0.007, 0.043]),
    "CG": ([0.0, 0.41, 3.39, 0.0, 5.4, 36.1],
           [1.586, 0, 0, -0.137, 0, 0, 3.301, 0.191, 0, 0.005, 0.056, 14.164, 0, -0.020, -0.162, 0.068, 0, 0, 0.050, 0.024,
            0.047]),
}  # fmt: skip
OTHER_STRAND = np.array([-1, 1, 1, -1, 1, 1])  # a step read along the other strand: shift and tilt change sign
PARTNER = {"A": "T", "T": "A", "G": "C", "C": "G"}


def table():
    """Means (16, 6) and covariances (16, 6, 6) of all steps of both strands, by name."""
    found = {}
    for name, (mean, upper) in STEPS.items():
        force = np.zeros((6, 6))
        force[np.triu_indices(6)] = upper
        force = force + np.triu(force, 1).T
        covariance = np.linalg.inv(force)
        assert np.all(np.linalg.eigvalsh(covariance) > 0)
        found[name] = np.array(mean), covariance
        found[PARTNER[name[1]] + PARTNER[name[0]]] = (
            np.array(mean) * OTHER_STRAND,
            covariance * np.outer(OTHER_STRAND, OTHER_STRAND),
        )
    return found


ALL = table()
assert len(ALL) == 16
means, covariances = (np.array([one[k] for one in ALL.values()]) for k in (0, 1))
rise = means[:, 2].mean()
spread = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2).mean(axis=0))
pd.DataFrame(
    {"mean step": means.mean(axis=0), "its spread": spread},
    index=["shift (Å)", "slide (Å)", "rise (Å)", "tilt (°)", "roll (°)", "twist (°)"],
).transpose().map("{:.2f}".format)

# %% [markdown]
# The steps of a random sequence are independent, so that ⟨z₀·zₙ⟩ = zᵀ⟨R⟩ⁿz with the mean ⟨R⟩ over steps and fluctuations: the
# direction decays with the largest real eigenvalue of ⟨R⟩, exactly. For small bends this is 2 rise/(var tilt + var roll).
# Three lengths follow: with fluctuations and sequence, with fluctuations about the mean step alone (dynamic), and with the sequence
# alone (static).


# %%
def nanometres(rotation):
    return persistence_steps(rotation) * rise / 10


angles, wobble = means[:, 3:], covariances[:, 3:, 3:]
whole = nanometres(mean_rotation(angles, wobble).mean(axis=0))
static = nanometres(to_matrix(step_pose(means)[0]).mean(axis=0))
straight = angles * [0, 0, 1]  # no mean bend: fluctuations alone
dynamic = nanometres(mean_rotation(straight, wobble).mean(axis=0))
rule = 2 * rise / 10 / (np.radians(1) ** 2 * (wobble[:, 0, 0] + wobble[:, 1, 1]).mean())
lengths = {
    "fluctuations and sequence": whole,
    "fluctuations alone (dynamic)": dynamic,
    "dynamic, small bends: 2 rise/(var tilt + var roll)": rule,
    "sequence alone (static)": static,
    "1/(1/dynamic + 1/static)": 1 / (1 / dynamic + 1 / static),
}
pd.DataFrame(
    {
        "persistence length (nm)": {name: f"{length:.1f}" for name, length in lengths.items()},
        "in base pairs": {name: f"{length * 10 / rise:.0f}" for name, length in lengths.items()},
    }
)

# %%
rng = np.random.default_rng(11)
CHAINS, LENGTH = 1500, 400


def chains():
    """Directions (LENGTH, CHAINS, 3) and origins of the pairs of chains of random sequence."""
    q, p = np.tile([1.0, 0, 0, 0], (CHAINS, 1)), np.zeros((CHAINS, 3))
    roots = np.linalg.cholesky(covariances)
    directions, origins = [], []
    for _ in range(LENGTH):
        directions.append(rotate(q, np.array([0.0, 0.0, 1.0])))
        origins.append(p)
        kind = rng.integers(16, size=CHAINS)
        parameters = means[kind] + np.einsum("nij,nj->ni", roots[kind], rng.normal(size=(CHAINS, 6)))
        q, p = compose(q, p, *step_pose(parameters))
    return np.array(directions), np.array(origins)


directions, origins = chains()
n = np.arange(LENGTH)
correlation = directions @ np.array([0.0, 0.0, 1.0])
mean, error = correlation.mean(axis=1), correlation.std(axis=1) / np.sqrt(CHAINS)
matrix, powers = mean_rotation(angles, wobble).mean(axis=0), [np.eye(3)]
for _ in n[1:]:
    powers.append(powers[-1] @ matrix)
exact = np.array(powers)[:, 2, 2]

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
left.fill_between(
    n, mean - 2 * error, mean + 2 * error, color="#56B4E9", alpha=0.5, label="chains, two standard errors"
)
left.plot(n, exact, color="#D55E00", lw=1, label="$z^T\\langle R\\rangle^n z$")
left.set(xlabel="Base pairs", ylabel="$\\langle z_0\\cdot z_n\\rangle$", title=f"Persistence length {whole:.1f} nm")
left.legend()
for chain in range(6):
    right.plot(*(0.1 * origins[:, chain, [0, 2]].T), lw=1.5)
right.set(xlabel="x (nm)", ylabel="z (nm)", aspect="equal", title="Six random sequences of 400 pairs")
plt.show()

assert np.max(np.abs(mean - exact)[1:] / error[1:]) < 5  # standard errors, of 399 neighbouring values
assert abs(1 / (1 / dynamic + 1 / static) - whole) < 0.05 * whole  # curvatures of fluctuation and sequence add
assert abs(rule - dynamic) < 0.02 * dynamic  # the next term of the small angle is 0.3 %, and twist takes part
back = step_parameters(*step_pose(means))
assert np.allclose(back, means, atol=1e-12)
assert 30 < whole < 60

# %% [markdown]
# Experiments give about 50 nm, or 150 base pairs (BioNumbers 103112); N. B. Becker and R. Everaers (Phys. Rev. E 76, 021923
# (2007)) compute 42 nm from simulated fluctuations. The table's fluctuations are those of many crystals, not of one molecule at a
# temperature: F is in units of an effective kT, so that agreement within some ten nanometres is all that can be asked for.

# %% [markdown]
# ## Domains of a protein
#
# Two positions of the same points are given; which parts moved as one body, and about which line? The data are made here, with a known
# answer: two clouds of 120 and 90 points hinged by 37° about a line, with a shift of 2 Å along it, all of it turned and moved
# as a crystal would show it, 0.3 Å of noise, and a loop that follows neither.

# %%
HINGE, POINT, ANGLE, SHIFT, NOISE = np.array([0.0, 0.6, 0.8]), np.array([11.0, 3.0, -2.0]), np.radians(37.0), 2.0, 0.3
core, lid = rng.normal(size=(120, 3)) * [9, 8, 8], rng.normal(size=(90, 3)) * [6, 7, 6] + [24, 0, 0]
loop = rng.normal(size=(12, 3)) * 2 + [12, 0, 0]
before = np.concatenate([core, lid, loop])
moved = rotate(exp(ANGLE * HINGE), lid - POINT) + POINT + SHIFT * HINGE
after = np.concatenate([core, moved, loop + rng.normal(size=loop.shape) * 5])
after = rotate(exp([0.3, 1.2, -0.8]), after) + np.array([40.0, 10.0, -20.0]) + rng.normal(size=before.shape) * NOISE

parts = rigid_parts(before, after, tolerance=5 * NOISE)
first, second = parts[:2]
screw = second.screw_against(first)
print(f"parts of {[len(part.members) for part in parts]} points, rmsd {first.rmsd:.2f} and {second.rmsd:.2f} Å")
print(f"hinge: {np.degrees(screw.angle):.2f}° about {screw.axis.round(3)}, shift {screw.shift:.2f} Å")
off_line = np.linalg.norm(np.cross(screw.point - POINT, HINGE))
print(f"the line passes {off_line:.2f} Å from where it was put")

figure, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", sharex=False)
for where, cloud, title in ((axes[0], before, "Before, and the screw axis"), (axes[1], after, "After")):
    where.scatter(*cloud[:, :2].T, s=8, color="0.75", label="no part")
    for part, colour in zip(parts, ("#0072B2", "#D55E00", "#009E73"), strict=False):
        where.scatter(*cloud[part.members][:, :2].T, s=12, color=colour, label=f"{len(part.members)} points")
    where.set(xlabel="x (Å)", ylabel="y (Å)", aspect="equal", title=title)
ends = screw.point + np.outer([-30, 30], screw.axis)
axes[0].plot(ends[:, 0], ends[:, 1], color="black", lw=1.5)
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
plt.show()

assert set(range(120)) <= set(first.members)
assert set(range(120, 210)) <= set(second.members)
assert abs(np.degrees(screw.angle) - 37.0) < 1.0  # 0.3 Å over 90 points 9 Å from the line: 0.3/(9 √90) rad = 0.2°
assert abs(screw.axis @ HINGE) > 0.999
assert abs(screw.shift - SHIFT) < 0.4
assert off_line < 0.4
assert abs(first.rmsd - NOISE * np.sqrt(3)) < 0.1  # three components of noise

# %% [markdown]
# ## The bracket that parks a car
#
# A car of wheelbase ℓ with its front wheels at the angle φ drives along the twist X(φ): it moves ahead by 1 and turns by κ = tan φ/ℓ. It
# cannot move sideways: the wheels roll (a constraint on velocities that is none on positions). But
#
# $$e^{sX(φ)} e^{sX(-φ)} e^{-sX(φ)} e^{-sX(-φ)} = e^{s^2 [X(φ), X(-φ)] + O(s^4)},\qquad [X(φ), X(-φ)] = 2κ\,e_y :$$
#
# four moves of length s, the steering turned between them, put it 2κs² to the side. (The term of order s³ is half the bracket of
# X(φ) + X(-φ), driving straight, with a sideways motion: it vanishes, since translations commute.)

# %%
WHEELBASE, STEER = 2.6, np.radians(30.0)
CURVATURE = np.tan(STEER) / WHEELBASE


def driving(sign):
    """The twist of driving ahead with the wheels to one side."""
    return np.array([0.0, 0.0, sign * CURVATURE, 1.0, 0.0, 0.0])


def manoeuvre(s):
    """The four poses that end the moves."""
    pose, poses = (np.array([1.0, 0, 0, 0]), np.zeros(3)), []
    for twist in (driving(1), driving(-1), -driving(1), -driving(-1)):
        pose = compose(*pose, *twist_exp(s * twist))
        poses.append(pose)
    return poses


sideways = bracket(driving(1), driving(-1))
assert np.allclose(sideways, [0, 0, 0, 0, 2 * CURVATURE, 0], atol=1e-15)  # e_y alone
lengths = np.array([0.4, 0.2, 0.1, 0.05])
rest = [np.linalg.norm(twist_log(*manoeuvre(s)[-1]) - s**2 * sideways) for s in lengths]
orders = np.log2(np.array(rest[:-1]) / rest[1:])
print("what is left beside the bracket:", np.array(rest), "orders", orders.round(2))
assert np.allclose(orders, 4.0, atol=0.05)

S = 1.2
q, place = manoeuvre(S)[-1]
assert abs(2 * np.arctan2(q[3], q[0])) < 1e-14  # the turns of the four moves cancel
print(f"moves of {S} m: {place[1]:.3f} m to the side (bracket {2 * CURVATURE * S**2:.3f}), {place[0]:+.3f} m ahead")


# %%
def parked(gap, s=0.5):
    """Repeat the four moves until the car is `gap` to the side; the path of its rear axle."""
    pose, path = (np.array([1.0, 0, 0, 0]), np.zeros(3)), [np.zeros(3)]
    while pose[1][1] < gap:
        for twist in (driving(1), driving(-1), -driving(1), -driving(-1)):
            for _ in range(10):
                pose = compose(*pose, *twist_exp(0.1 * s * twist))
                path.append(pose[1])
    return pose, np.array(path)


(attitude, place), path = parked(2.0)
figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
axes.plot(path[:, 0], path[:, 1], color="#0072B2", lw=1)
box = np.array([[-0.8, -0.9, 0], [3.4, -0.9, 0], [3.4, 0.9, 0], [-0.8, 0.9, 0], [-0.8, -0.9, 0]])
for pose, colour in ((([1.0, 0, 0, 0], np.zeros(3)), "0.6"), ((attitude, place), "#D55E00")):
    outline = rotate(np.array(pose[0]), box) + pose[1]
    axes.plot(outline[:, 0], outline[:, 1], color=colour)
axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="The rear axle on the way to the kerb")
plt.show()
rounds = (len(path) - 1) // 40
expected = 2.0 / (2 * CURVATURE * 0.5**2)
print(f"{rounds} rounds of four moves; the bracket alone asks for {expected:.1f}")
assert 0 <= rounds - expected < 0.02 * expected + 1.5  # 2% less than the bracket a round, and rounds are whole
velocity = np.diff(path, axis=0)[::10]
assert np.all(np.abs(np.linalg.norm(velocity, axis=1) / 0.05 - 1) < 1e-3)  # chords of arcs of 0.05 m: it never skids

# %% [markdown]
# ## Joints and a contact
#
# A serial arm is a product of exponentials of its joint twists (R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to
# Robotic Manipulation, chapter 3); the closed form of two links in a plane is known from trigonometry. A contact without friction
# carries a force along its normal alone, and the torques that hold it are those whose power vanishes with it.

# %%
L1, L2, T1, T2 = 1.3, 0.9, 0.7, -1.1
elbow = np.array([L1, 0.0, 0.0])
joints = [np.array([0, 0, 1.0, 0, 0, 0]), np.array([0, 0, 1.0, *np.cross(elbow, [0, 0, 1.0])])]
pose = compose(*twist_exp(T1 * joints[0]), *twist_exp(T2 * joints[1]))
hand = rotate(pose[0], np.array([L1 + L2, 0, 0])) + pose[1]
closed = np.array([L1 * np.cos(T1) + L2 * np.cos(T1 + T2), L1 * np.sin(T1) + L2 * np.sin(T1 + T2), 0])
assert np.allclose(hand, closed, atol=1e-14)  # round-off

second_now = adjoint(*twist_exp(T1 * joints[0])) @ joints[1]  # the second joint's twist where the arm is
normal = np.array([0.6, 0.8, 0.0])  # of the wall that the hand touches
wrench = np.array([*np.cross(hand, normal), *normal])
torques = np.array([power(joints[0], wrench), power(second_now, wrench)])
jacobian = np.array([[-closed[1], closed[0]], [-L2 * np.sin(T1 + T2), L2 * np.cos(T1 + T2)]])
assert np.allclose(torques, jacobian @ normal[:2], atol=1e-14)  # Jᵀ f
print(f"the hand at {hand.round(4)}; a unit push of the wall is held by joint torques {torques.round(4)}")
half_turn = chasles_screw([0, 0, 0, 1.0], [2.0, 0, 0])  # the elbow straight back
assert np.allclose(half_turn.point, [1, 0, 0], atol=1e-15)
assert np.isclose(half_turn.angle, np.pi)
