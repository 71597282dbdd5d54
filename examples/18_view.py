# %% [markdown]
# # From a raw spectrum to a table
#
# A spectrum of an unknown molecule, `rotor assign` for the first lines, a few more by hand, a fit, and the table for a paper: all in the
# page of `rotor view`, here as a widget. What a click does, `widget.do(...)` does from Python. The spectrum is made here, with noise, so
# that the answer can be compared with the truth. Background: `docs/view.md`.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import display

import rotor

# %matplotlib inline

rotor.api.use_style()

truth = rotor.Constants(
    A=5210.331, B=2012.874, C=1533.209, DeltaJ=0.00021, DeltaJK=0.0009, DeltaK=0.0031, deltaJ=0.00006, deltaK=0.0007
)
top = rotor.Top.from_constants(truth, dipole_abc_debye=(1.6, 0.9, 0.0))
lines = rotor.api.line_list(top, temperature_k=2.0, range_mhz=(6000, 18000))

frequency = np.arange(6000.0, 18000.0, 0.02)
intensity = 0.004 * np.random.default_rng(7).normal(size=len(frequency))
for centre, height in zip(lines.frequency_mhz, lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max(), strict=True):
    near = slice(*np.searchsorted(frequency, (centre - 0.6, centre + 0.6)))
    intensity[near] += height * np.exp(-(((frequency[near] - centre) / 0.06) ** 2))
folder = Path(tempfile.mkdtemp())
np.save(folder / "spectrum.npy", np.column_stack([frequency, intensity]))
print(len(frequency), "points")

# %% [markdown]
# ## The page
#
# In a live notebook the next cell shows the page: drag and wheel move through the spectrum, Shift and drag over a peak fits it. The
# session is saved beside the spectrum after each action.

# %%
widget = rotor.view(folder / "spectrum.npy", noise=0.004)
display(widget)

# %% [markdown]
# ## First lines by `rotor assign`
#
# The button *Search unknown molecules*. What it finds becomes a species with its lines, ready for the fit.

# %%
widget.do("search", seconds=15)
species = widget.session.state.species[1]
print(", ".join(f"{name} = {species.constants[name]:.3f} MHz" for name in "ABC"))
print(len(widget.session.state.lines), "lines assigned")
assert all(abs(species.constants[name] - truth[name]) < 0.05 for name in "ABC")
assert len(widget.session.state.lines) > 20

# %% [markdown]
# ## More lines by hand
#
# A drag over a peak is the query `peak`; its answer has the fitted peak and the lines that it may be. `assign` is what Enter does. Here
# every predicted line that stands alone, rises above the noise and is not assigned yet.

# %%
predicted = widget.do("window", first_mhz=6000, last_mhz=18000, pixels=100)["sticks"]["1"]
known = {(line.upper, line.lower) for line in widget.session.state.lines.values()}
more = 0
for f, height, upper, lower in zip(*(predicted[name] for name in ("x", "height", "upper", "lower")), strict=True):
    alone = (
        sum(
            abs(other - f) < 1.0 and h > 0.1 * height
            for other, h in zip(predicted["x"], predicted["height"], strict=True)
        )
        == 1
    )
    if height > 0.006 and alone and (tuple(upper), tuple(lower)) not in known:
        peak = widget.do("peak", first_mhz=f - 0.4, last_mhz=f + 0.4)["peak"]
        if peak and peak["height"] > 0.3 * height:
            target = {"species": 1, "upper": upper, "lower": lower}
            widget.do("assign", frequency_mhz=peak["frequency_mhz"], error_mhz=peak["error_mhz"], to=[target])
            more += 1
print(more, "more lines")

# %% [markdown]
# ## The fit
#
# *Refit*, with the constants in S reduction that `rotor assign` has freed. A step that does not help is undone.

# %%
widget.do("refit", species=1)
fit = widget.session.state.species[1].fit
print(f"{fit.lines} lines, rms {1e3 * fit.rms_mhz:.2f} kHz, weighted rms {fit.weighted_rms:.2f}")
assert fit.weighted_rms < 2.5
residuals = widget.service.facts()["lines"]
numbers = sorted(widget.session.state.lines)
far = [n for n in numbers if abs(residuals[str(n)]["difference_mhz"]) > 4 * widget.session.state.lines[n].error_mhz]
if far:
    widget.do("reject", lines=far, rejected=True)
    widget.do("refit", species=1)
fitted = widget.session.state.species[1]
assert all(abs(fitted.constants[name] - truth[name]) < 0.02 for name in "ABC")
pd.DataFrame(
    {
        name: {"fitted (MHz)": fitted.constants[name], "error (MHz)": fitted.errors[name], "true (MHz)": truth[name]}
        for name in "ABC"
    }
).transpose().round(4)

# %%
figure, axes = plt.subplots(2, 1, figsize=(8, 4.5), sharex=True)
axes[0].plot(frequency[::5], intensity[::5], lw=0.5)
axes[0].set_ylabel("Intensity")
state, residuals = widget.session.state, widget.service.facts()["lines"]
axes[1].errorbar(
    [line.frequency_mhz for line in state.lines.values()],
    [1e3 * residuals[str(n)]["difference_mhz"] for n in state.lines],
    [1e3 * line.error_mhz for line in state.lines.values()],
    fmt="o",
    ms=3,
)
axes[1].set(xlabel="Frequency (MHz)", ylabel="Observed − calculated (kHz)")
# %% [markdown]
# ## The table
#
# *Export* writes lines, SPFIT's files, a molecule file and tables; the page itself as one file that opens without a server.

# %%
print(widget.do("export", species=1, what="md")["text"])
widget.export(folder / "page.html")
assert (folder / "page.html").stat().st_size > 1e6
assert (folder / "spectrum.view.json").exists()

# %% [markdown]
# All of it can be undone, and is still there when the session is opened again.

# %%
count = len(widget.session.state.lines)
widget.close()
again = rotor.view(folder / "spectrum.view.json")
assert len(again.session.state.lines) == count
assert not again.session.warnings
again.close()
