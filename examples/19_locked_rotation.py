# long: 60
# %% [markdown]
# # When is rotation locked?
#
# Every single bond is an axis of rotation. Whether something turns about it is a question of the barrier, of the temperature and of the
# time that one looks: a methyl group turns in picoseconds, a peptide bond in seconds. Here: ethane, the two rings of biphenyl (a unit of
# many dyes), and the peptide bond of N-methylacetamide, with potentials of the force field MMFF94.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy import constants

import rotor
from rotor.api import TurningTop, torsion_figure, turning_motion

# %matplotlib inline

rotor.api.use_style()

U_ANGSTROM2_PS2 = constants.atomic_mass * 1e-20 / 1e-24  # J
CM = constants.h * constants.c * 100 / U_ANGSTROM2_PS2  # of 1 cm-1, in u Å²/ps²
K = constants.k / U_ANGSTROM2_PS2  # of kT, in u Å²/ps²

# %% [markdown]
# ## Three bonds
#
# Relaxed scans. The lowest barrier decides: through it the molecule leaves its valley.

# %%
bonds = {"ethane": ("CC", "1-2"), "biphenyl": ("c1ccccc1-c1ccccc1", "6-7"), "peptide bond": ("CNC(C)=O", "2-3")}
answers = {name: rotor.torsion(f"SMILES:{smiles}", bond=bond, points=24) for name, (smiles, bond) in bonds.items()}
figure, axes = plt.subplots(1, 3, figsize=(11, 3.2))
for axis, (name, answer) in zip(axes, answers.items(), strict=True):
    angles, _, v = answer.torsion.sampled()
    axis.plot(np.degrees(angles), v / rotor.units.MHZ_PER_CM)
    axis.set(title=name, xlabel="Angle (degrees)", ylabel="Potential (cm⁻¹)", xticks=range(0, 361, 90))
figure.tight_layout()
assert 6000 < answers["peptide bond"].facts()["barrier_cm"] < 8500  # 20 kcal/mol: 7000 cm-1
facts = {name: answer.facts() for name, answer in answers.items()}
pd.DataFrame(
    {
        name: {
            "barrier (cm⁻¹)": f"{fact['barrier_cm']:.0f}",
            "reduced moment (u Å²)": f"{fact['reduced_moment_u_angstrom2']:.2f}",
        }
        for name, fact in facts.items()
    }
).transpose()

# %% [markdown]
# ## How often
#
# In a gas at equilibrium the angular velocity about the bond has ⟨|α'|⟩ = √(2kT/πI), whatever the potential is (equipartition), and the
# density at an angle goes as exp(-V/kT). Over a point α* a molecule passes in either direction at the rate
#
#     k = ⟨|α'|⟩ exp(-V(α*)/kT) / ∮ exp(-V/kT) dα.
#
# Rotation is locked where 1/k is longer than what one looks at: the nanoseconds in which a dye fluoresces, the seconds of a chemist.


# %%
def crossings_per_s(answer, temperature_k):
    """Passages over the lowest barrier of the potential, per second and molecule."""
    _, f_mhz, v = answer.torsion.sampled()
    kt = temperature_k * rotor.units.MHZ_PER_K
    moment = rotor.units.ROTATIONAL_MHZ_U_ANGSTROM2 / np.mean(f_mhz)
    speed = math.sqrt(2 * K * temperature_k / (math.pi * moment)) * 1e12
    weight = np.exp(-v / kt)
    return speed * math.exp(-answer.torsion.lowest_barrier_mhz / kt) / (weight.mean() * 2 * math.pi)


temperatures = np.linspace(100, 600, 51)
figure, axis = plt.subplots(figsize=(7, 4))
for name, answer in answers.items():
    axis.semilogy(temperatures, [crossings_per_s(answer, t) for t in temperatures], label=name)
for rate, text in ((1e9, "fluorescence, 1 ns"), (1.0, "1 s")):
    axis.axhline(rate, color="grey", lw=0.8, ls="--")
    axis.text(595, rate * 3, text, ha="right", color="grey")
axis.set(xlabel="Temperature (K)", ylabel="Passages per second", ylim=(1e-10, 1e14))
axis.legend(loc="lower right")
at_room = {name: crossings_per_s(answer, 298.0) for name, answer in answers.items()}
assert at_room["ethane"] > 1e9  # turns while one looks
assert at_room["peptide bond"] < 10  # locked
pd.DataFrame({"passages per second at 298 K": at_room, "mean time (s)": {n: 1 / r for n, r in at_room.items()}}).map(
    "{:.1e}".format
)

# %% [markdown]
# The force field's barrier of the peptide bond is 21 kcal/mol. Tunnelling does not help: F is 1.5 cm⁻¹ and the valleys are different, cis
# 780 cm⁻¹ above trans. Below are the levels of biphenyl, whose four valleys are alike: 48 cm⁻¹ apart, and split only near the top.

# %%
torsion_figure(answers["biphenyl"])

# %% [markdown]
# ## A rigid dye
#
# The rings of biphenyl pass each other many times in the nanoseconds of a fluorescence. A bridge makes a rigid dye of them: in fluorene the
# same bond is part of a ring, no group turns about it, and rotor says so.

# %%
try:
    rotor.torsion("SMILES:C1c2ccccc2-c2ccccc12", bond="7-8")
except ValueError as error:
    print(error)
else:
    raise AssertionError("a bond in a ring does not turn")

# %% [markdown]
# ## The motion over the barrier
#
# The classical molecule: a rigid body with a top that turns in it against V(α), and angular momentum that both exchange
# (`rotor.classical.internal_rotor`). Ethane, with the measured barrier of 1013 cm⁻¹: at 100 K the methyl groups swing, at 3000 K they turn.

# %%
moments = rotor.read("C2H6").moments_u_angstrom2
ethane = TurningTop(moments, np.eye(3)[int(np.argmin(moments))], min(moments) / 2, {3: 1013 * CM})
rng, times = np.random.default_rng(4), np.arange(0, 2.001, 0.01)  # ps
figure, axes = plt.subplots(1, 3, figsize=(11, 3), sharey=False)
for axis, temperature in zip(axes, (100, 1000, 3000), strict=True):
    momentum, p, angle = ethane.thermal(K * temperature, 6, rng=rng)
    motion = turning_motion(ethane, momentum, p, angle, times, 0.005)
    axis.plot(times, motion.angle / (2 * np.pi / 3), lw=0.9)
    axis.set(title=f"{temperature} K", xlabel="Time (ps)", ylabel="Angle / 120°")
    swing = np.ptp(motion.energy, axis=0).max() / (K * temperature)
    print(f"{temperature} K: energy within {swing:.1e} kT")
    assert swing < 0.1
figure.tight_layout()

# %% [markdown]
# The passages of a gas of such molecules, counted, against the formula above: the gas stays at equilibrium, so that equipartition holds
# at any time, although each molecule keeps its own energy and angular momentum for ever.

# %%
temperature = 1500.0
momentum, p, angle = ethane.thermal(K * temperature, 2000, rng=rng)
motion = turning_motion(ethane, momentum, p, angle, np.arange(0, 1.0001, 0.02), 0.01)
sector = np.floor(motion.angle / (2 * np.pi / 3) + 0.5)  # maxima at 60°, 180°, 300°
counted = np.abs(np.diff(sector, axis=0)).sum() / (2000 * 1.0)  # per ps
angles = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
weight = np.exp(-ethane.potential(angles) / (K * temperature))
speed = math.sqrt(2 * K * temperature / (math.pi * ethane.reduced_moment))
expected = 3 * speed * math.exp(-1013 * CM / (K * temperature)) / (weight.mean() * 2 * math.pi)
slip = motion.p[-1] * ethane.angle_rate(motion.momentum[-1], motion.p[-1])
print(f"passages {counted:.3f} per ps, expected {expected:.3f}; p ∂H/∂p = {slip.mean() / (K * temperature):.3f} kT")
assert abs(counted / expected - 1) < 0.1
assert abs(slip.mean() / (K * temperature) - 1) < 4 * slip.std() / math.sqrt(2000) / (K * temperature)
