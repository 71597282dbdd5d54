# %% [markdown]
# # Molecules that a laser pulse aligns
#
# A short pulse gives every molecule a push towards its polarization; what follows is a wave packet of rotational states that comes
# back after 1/(2Bc). A classical gas does the same at first and does not come back.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import qutip

import rotor
from rotor import Top
from rotor.api import (
    DipolePulse,
    GaussianPulse,
    Kick,
    align,
    alignment_figure,
    block_objects,
    classical_trace,
    elliptical,
    linear_objects,
    revival_period_ps,
    solve_windows,
)

# %matplotlib inline

rotor.api.use_style()

data = Path("data")  # reference values, beside this notebook
ocs = Top.from_constants("B=6081.492 MHz", dipole_abc_debye=(0.71519, 0, 0)).with_polarizability(
    np.diag([4.04, 0.0, 0.0]), "the anisotropy alone, which is all that turns"
)
period = revival_period_ps(ocs)

# %% [markdown]
# ## From one state and from a gas
#
# Compared with traces that an independent program made, and with their highest values on a fine grid of
# times: 0.8870 from J = 0, 0.7121 at 1 K, 0.4875 at 10 K.

# %%
pulse, times = GaussianPulse(1e13, 0.05), np.linspace(-0.5, 2 * period, 4001)
table = {}
figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
for kelvin, expected in ((0.0, 0.8870), (1.0, 0.7121), (10.0, 0.4875)):
    trace = align(ocs, pulse, times, temperature_k=kelvin)
    highest = trace.cosines["cos2theta"].max()
    table[f"{kelvin:.0f} K"] = {
        "states": trace.states,
        "highest J": trace.jmax,
        "steps": trace.steps[0],
        "highest ⟨cos²θ⟩": f"{highest:.4f}",
        "estimated error": f"{trace.error_estimate:.0e}",
    }
    assert abs(highest - expected) < 1e-3  # the grids of times differ
    axes.plot(times, trace.cosines["cos2theta"], lw=0.9, label=f"{kelvin:.0f} K")
    axes.axhline(expected, color=axes.lines[-1].get_color(), lw=0.6, ls=":")
for kelvin, file in ((0.0, "alignment_ocs_0k.csv"), (10.0, "alignment_ocs_10k.csv")):
    t, expected = np.loadtxt(data / "fields" / file, delimiter=",").T
    off = np.abs(align(ocs, pulse, t, temperature_k=kelvin).cosines["cos2theta"] - expected).max()
    axes.plot(t, expected, "k.", ms=3)
    table[f"{kelvin:.0f} K"]["difference from the independent program"] = f"{off:.1e}"
    assert off < 2e-5  # the tolerance of align, 1e-5, and the share of states left out
axes.set(
    xlabel="Time (ps)", ylabel="⟨cos²θ⟩", title="OCS, 50 fs, 10 TW/cm²; dots: the independent program", ylim=(0.0, 1.05)
)
axes.legend(ncols=3)
print(f"revival after {period:.3f} ps")
pd.DataFrame(table).transpose().fillna("")

# %% [markdown]
# ## Quantum and classical
#
# At 30 K both gases peak alike and dephase alike; then the classical one keeps its mean while the quantum one comes back.

# %%
times = np.linspace(-0.5, period, 401)
names = ("cos2theta", "cos2theta_2d")
quantum = align(ocs, pulse, times, temperature_k=30.0, observables=names)
classical = classical_trace(
    ocs, [pulse], times, temperature_k=30.0, molecules=8_000, observables=names, rng=np.random.default_rng(1)
)
early = times < 5
apart = np.abs(quantum.cosines["cos2theta"] - classical["cos2theta"])
print(f"30 K: apart by {apart[early].max():.4f} in the first 5 ps, by {apart.max():.4f} at the revivals")
alignment_figure(quantum, classical=classical, title="OCS at 30 K, 50 fs, 10 TW/cm²")

# %%
assert apart[early].max() < 0.02  # 8,000 bodies scatter by 0.003, and B/kT is 0.01
assert apart.max() > 0.05

# %% [markdown]
# ## Two pulses, an asymmetric top, a THz field
#
# Elliptical light holds all three axes of an asymmetric top: after each revival the a axis follows Z, b follows X, and c, for which
# no light is left, Y.

# %%
after = np.linspace(0.01, period, 20001)
best = align(ocs, Kick.from_strength(55.0, 4.04), after).cosines["cos2theta"].max()
delay = 0.45 * period
double = align(ocs, [Kick.from_strength(3.0, 4.04), Kick.from_strength(6.0, 4.04, delay)], delay + after)
print(f"the best of all single kicks, P = 55: {best:.4f}; P = 3 and then 6: {double.cosines['cos2theta'].max():.4f}")
assert abs(best - 0.92217) < 1e-4
assert double.cosines["cos2theta"].max() > best

iodobenzene = Top.from_constants("A=5669.126 B=750.414293 C=662.636162 MHz").with_polarizability(
    np.diag([21.5, 15.3, 10.2]), "as in the reference"
)
trace = align(
    iodobenzene, GaussianPulse(1e12, 0.3), np.linspace(1.05, 400, 2001), observables=("cos2_aZ", "cos2_bX", "cos2_cY")
)
print(f"iodobenzene from 0₀₀: highest <cos²> of the a axis {trace.cosines['cos2_aZ'].max():.5f}")
assert abs(trace.cosines["cos2_aZ"].max() - 0.709876) < 2e-4  # at 339.05 ps on a finer grid

times_3d, axes_3d = np.linspace(1.05, 801, 2001), ("cos2_aZ", "cos2_bX", "cos2_cY")
held = align(
    iodobenzene, GaussianPulse(1e12, 0.3, axis=elliptical(1 / 3)), times_3d, observables=axes_3d, tolerance=1e-4
)
figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
for name, label in zip(axes_3d, ("a with Z", "b with X", "c with Y"), strict=True):
    axes.plot(times_3d, held.cosines[name], lw=0.7, label=label)
axes.axhline(1 / 3, color="black", lw=0.5, ls=":")
axes.set(xlabel="Time (ps)", ylabel="⟨cos²⟩", title="Iodobenzene from $0_{00}$, 0.3 ps, 1 TW/cm², $I_X : I_Z$ = 1 : 3")
axes.legend(ncols=3)
highest = [float(held.cosines[name].max()) for name in axes_3d]
print("elliptical light: highest <cos²> of a with Z, b with X, c with Y:", np.round(highest, 4))
assert (
    np.abs(np.array(highest) - (0.7231, 0.6493, 0.5690)).max() < 3e-4
)  # an independent program, on its own grid of times

oriented = align(
    ocs, DipolePulse(500.0, 1.0, 0.3), np.linspace(-3, period, 801), temperature_k=1.0, observables=("costheta",)
)
print(f"500 kV/cm at 0.3 THz, 1 K: <cosθ> to {np.abs(oriented.cosines['costheta']).max():.4f}")
assert abs(oriented.permanent["costheta"]) < 1e-6  # orientation does not last

# %% [markdown]
# ## With QuTiP
#
# The same pulse by `sesolve`, in its window alone; and collisions, which `mesolve` has as Lindblad terms √γ D¹.

# %%
objects = block_objects(ocs, [pulse], jmax=30)
times = np.linspace(-20, period, 401)
theirs = solve_windows(objects, objects.state("0"), times)["cos2theta"]
ours = align(ocs, pulse, times, state={"j": 0}, tolerance=1e-9, jmax=30).cosines["cos2theta"]
naive = qutip.sesolve(
    objects.hamiltonian(objects.windows[0]),
    objects.state("0"),
    times,
    e_ops=list(objects.cosines.values()),
    options={"progress_bar": ""},
).expect[0]
print(
    f"apart by {np.abs(theirs - ours).max():.1e}; a list of times from -20 ps given to sesolve alone finds {naive.max():.4f}"
)
assert np.abs(theirs - ours).max() < 1e-8
assert naive.max() < 0.34

gas = linear_objects(ocs, 8)
kick = (1.5j * gas.cosine_squared).expm()
start = kick * gas.thermal(0.5) * kick.dag()
times = np.linspace(0, period, 161)
left, table = [], {}
figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
for rate in (0.0, 0.01, 0.03):
    solved = qutip.mesolve(
        gas.free,
        start,
        times,
        gas.collisions(rate),
        e_ops=[gas.cosine_squared],
        options={"progress_bar": "", "matrix_form": True},
    )
    cosine = np.real(solved.expect[0])
    left.append(float(cosine[times > 0.8 * period].max()))
    axes.plot(times, cosine, lw=0.9, label=f"{rate:g} collisions a ps")
    table[f"{rate:.2f}"] = {"highest ⟨cos²θ⟩ at the revival": f"{left[-1]:.4f}"}
axes.axhline(1 / 3, color="black", lw=0.5, ls=":")
axes.set(
    xlabel="Time (ps)", ylabel="⟨cos²θ⟩", title="OCS at 0.5 K after a kick, its axis turned by collisions (mesolve)"
)
axes.legend()
assert left[0] > left[1] > left[2]
assert abs(rotor.read("OCS").constants["B"] - 6081.492) < 1e-3
pd.DataFrame(table).transpose().rename_axis("collisions per ps")
