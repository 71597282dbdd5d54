# %% [markdown]
# # From measured lines to constants
#
# Lines with their assignments go in; constants come out, with errors that follow from those of the lines, correlations, and what the
# lines leave open.

# %%
from pathlib import Path

import numpy as np
import pandas as pd

import rotor
from rotor import Constants
from rotor.api import (
    FitOptions,
    assignments,
    bootstrap,
    choose_constants,
    fit_figure,
    fit_lines,
    fitted_file,
    parameters,
    publication_table,
    read_assigned_lines,
    read_fit,
    report_text,
    suggest_lines,
)

# %matplotlib inline

rotor.api.use_style()

data = Path("data/fits")  # measured lines, beside this notebook

# %% [markdown]
# ## OCS: 61 measured lines up to J = 90
#
# B alone does not describe them, and the fit says so: it has found its minimum, and the minimum is no result.

# %%
lines, _ = read_assigned_lines(data / "ocs.csv", ("j",))
start = Constants(B=6000.0)
rigid = fit_lines(lines, start, parameters(start, ["B"]))
print(rigid.reason)
assert rigid.minimum.converged
assert not rigid.converged

# %% [markdown]
# Which constants do the lines call for? Each is added as long as an F test, Akaike's criterion and the residuals of left-out lines
# agree.

# %%
fit, steps = choose_constants(lines, start, ["B"], ["D", "H", "L"])
print(publication_table(fit))
assert fit.converged
assert [step.name for step in steps] == ["D", "H"]
assert abs(fit.constants["B"] - 6081.492114) < 2e-6  # of this catalogue: 6081.492114(6) MHz
assert fit.weighted_rms < 0.7
pd.DataFrame(
    {
        f"with {step.name}": {"F ratio": f"{step.f_ratio:.3g}", "weighted rms": f"{step.fit.weighted_rms:.4g}"}
        for step in steps
    }
).transpose()

# %%
fit_figure(fit, "OCS")

# %% [markdown]
# The covariance goes with the constants, so that every predicted line has its error: small where lines were measured, growing
# beyond.

# %%
top = rotor.Top.from_constants(fit.constants, dipole_abc_debye=(0.715, 0, 0), covariance=fit.covariance)
predicted = rotor.api.line_list(top, jmax=140, min_lgint=None)
upper = predicted.levels.quanta["j"][predicted.upper]
assert predicted.error_mhz[upper == 1][0] < 2e-5
assert predicted.error_mhz[upper == 140][0] > 3 * predicted.error_mhz[upper == 90][0]
pd.DataFrame(
    {
        f"J = {j} ← {j - 1}": {
            "frequency (MHz)": f"{predicted.frequency_mhz[upper == j][0]:.6f}",
            "error (kHz)": f"{1e3 * predicted.error_mhz[upper == j][0]:.2g}",
        }
        for j in (1, 30, 90, 140)
    }
).transpose()

# %% [markdown]
# The same errors without any assumption of normal errors: from fits to lines drawn anew.

# %%
_, spread = bootstrap(fit, 200, np.random.default_rng(1))
assert np.all(spread / fit.scaled_errors < 3)
pd.DataFrame(
    {
        "from the errors of the lines (MHz)": fit.errors,
        "from the residuals (MHz)": fit.scaled_errors,
        "from lines drawn anew (MHz)": spread,
    },
    index=fit.parameters.names,
).map("{:.2e}".format)

# %% [markdown]
# ## SPFIT's files
#
# CO in SPFIT's own input: the same minimum, and the .var file that SPCAT reads.

# %%
asked = read_fit(data / "co.par")
co = fit_lines(asked.lines, asked.constants, asked.parameters, asked.options)
print(report_text(co, "CO").splitlines()[1])
assert abs(co.weighted_rms - 0.90566) < 5e-6  # as SPFIT prints it
pd.DataFrame(
    [
        {"constant": row.label, "code": row.code, "value (MHz)": f"{row.value:.15E}", "error (MHz)": f"{row.error:.6E}"}
        for row in fitted_file(asked, co, variances=True).parameters
    ]
).set_index("constant")

# %% [markdown]
# ## What the lines do not know
#
# R lines of a symmetric top are blind for A and D_K. They are named, left at their start, and all other constants are as good as ever.

# %%
prolate = Constants(A=158099.0, B=9198.9, DJ=3.8e-3, DJK=0.177, DK=2.8)
made = rotor.api.line_list(rotor.Top.from_constants(prolate, dipole_abc_debye=(1, 0, 0)), jmax=8, min_lgint=None)
labels = np.stack([made.levels.quanta[name] for name in ("j", "k")], axis=1)
noise = 0.002 * np.random.default_rng(0).normal(size=len(made))
seen = assignments(("j", "k"), labels[made.upper], labels[made.lower], made.frequency_mhz + noise, 0.002)
begin = prolate.replace(A=150000.0, B=9200.0)
blind = fit_lines(seen, begin, parameters(begin, ["A", "B", "DJ", "DJK", "DK"]))
print(blind.reason)
assert {one.text for one in blind.statistics.undetermined} == {"A", "DK"}
assert blind.constants["A"] == 150000.0
assert abs(blind.constants["B"] - 9198.9) < 5 * blind.constants.uncertainties["B"]

# %% [markdown]
# The R lines of a near-prolate chain do know A, through its small asymmetry, but badly: 138 MHz, and 201 MHz with distortion. A
# pseudo-inverse of unscaled normal equations would report 1e-10 MHz. One line of another kind would settle it: the table says by how
# much each unmeasured line reduces the error of A.

# %%
chain = Constants(A=300e3, B=4600.0, C=4500.0, DeltaJ=1e-3, DeltaJK=0.05, reduction="A")
made = rotor.api.line_list(rotor.Top.from_constants(chain, dipole_abc_debye=(1, 0, 0)), jmax=11, min_lgint=None)
labels = np.stack([made.levels.quanta[name] for name in ("j", "ka", "kc")], axis=1)
up, low = labels[made.upper], labels[made.lower]
chosen = (up[:, 0] == low[:, 0] + 1) & (low[:, 0] >= 1) & (up[:, 1] <= 2) & (up[:, 1] == low[:, 1])
seen = assignments(("j", "ka", "kc"), up[chosen], low[chosen], made.frequency_mhz[chosen], 0.005)
for free, expected in ((["A", "B", "C"], 138.0), (["A", "B", "C", "DeltaJ", "DeltaJK"], 201.0)):
    chain_fit = fit_lines(seen, chain, parameters(chain, free))
    print(f"{len(free)} constants: A ± {chain_fit.errors[0]:.0f} MHz")
    assert abs(chain_fit.errors[0] - expected) < 2

upper, lower = np.array([[1, 1, 0], [2, 1, 1], [12, 3, 9]]), np.array([[1, 0, 1], [2, 0, 2], [11, 3, 8]])
suggestions = suggest_lines(chain_fit, "A", upper, lower, error_mhz=0.005)
assert suggestions[0].error_ratio < 1e-3  # a b-type line has A itself
pd.DataFrame(
    [
        {
            "line": "{}({},{}) ← {}({},{})".format(*line.upper, *line.lower),
            "frequency (MHz)": f"{line.frequency_mhz:.1f}",
            "its error (MHz)": f"{line.error_mhz:.3g}",
            "factor on the error of A": f"{line.error_ratio:.2g}",
        }
        for line in suggestions
    ]
).set_index("line")

# %% [markdown]
# ## A line that is wrong
#
# One line 20 MHz off spoils a plain fit, and the fit says so. A robust loss finds it.

# %%
wrong = lines.frequency_mhz.copy()
wrong[20] += 20.0
spoiled = assignments(("j",), lines.upper, lines.lower, wrong, lines.error_mhz)
plain = fit_lines(spoiled, fit.constants, parameters(fit.constants, ["B", "D", "H"]))
robust = fit_lines(
    spoiled, fit.constants, parameters(fit.constants, ["B", "D", "H"]), FitOptions(loss="cauchy", poor_rms=1e6)
)
print(plain.reason)
print("furthest off:", spoiled.text(int(np.argmax(np.abs(robust.residuals)))))
assert not plain.converged
assert np.argmax(np.abs(robust.residuals)) == 20
assert abs(robust.constants["B"] - fit.constants["B"]) < 3 * fit.constants.uncertainties["B"]
