# %% [markdown]
# # From isotopologues to a structure
#
# Moments of inertia of isotopologues hold the places of the atoms. OCS, from measured lines to bond lengths, with no number typed in
# between; then what vibration does to them, and symmetry.

# %%
from pathlib import Path

import pandas as pd

import rotor
from rotor import Molecule, Top
from rotor.api import (
    family,
    fit_structure,
    named,
    read_family,
    structure_figure,
    substitution_structure,
    symmetric_displacements,
)

# %matplotlib inline

rotor.api.use_style()

data = Path("data/fits")  # measured lines, beside this notebook

# %% [markdown]
# ## OCS
#
# The family file names a list of measured lines for each isotopologue (CDMS); B of each is fitted on the way.

# %%
file = read_family(data / "ocs.toml")
pd.DataFrame(
    {
        one.name: {
            "B (MHz)": f"{one.constants_mhz['B']:.6f}",
            "error (MHz)": f"{one.errors_mhz['B']:.0e}",
            "source": one.source,
        }
        for one in file.family.species
    }
).transpose()

# %% [markdown]
# Each atom replaced says where it is (Kraitchman): the substitution structure r_s, with Costain's error for vibration.

# %%
rs = substitution_structure(file.family, coordinates=file.coordinates)
values = {value.name: value for value in rs.values}
pd.DataFrame([{"bond": v.name, "r_s (Å)": f"{v.value:.5f}", "error (Å)": f"{v.error:.4f}"} for v in rs.values])

# %%
assert abs(values["CO"].value - 1.16054) < 1e-5  # published
assert abs(values["CS"].value - 1.55967) < 1e-5

# %% [markdown]
# All moments at once: r_0 leaves vibration where it is; r_m lets each moment have a part c √I of vibration.

# %%
fits = {method: fit_structure(file.family, method, coordinates=file.coordinates) for method in ("r0", "rm1")}
pd.DataFrame(
    {
        method: {
            **{f"{v.name} (Å)": f"{v.value:.4f} ± {v.error:.4f}" for v in result.values},
            "rms (u Å²)": f"{result.rms_u_angstrom2:.1e}",
            "degrees of freedom": result.degrees_of_freedom,
        }
        for method, result in fits.items()
    }
).transpose()

# %%
assert fits["rm1"].values[0].value < values["CO"].value  # r_m is nearer to equilibrium, 1.156 Å, than r_s

# %%
structure_figure(fits["rm1"].molecule, values=fits["rm1"].values, title="OCS, $r_m^{(1)}$")

# %% [markdown]
# ## Symmetry
#
# Formaldehyde: twelve Cartesian coordinates, three totally symmetric changes of shape. Its exact moments give its exact geometry back,
# from a start that is 2 % off, though D on one side turns the axes and breaks the symmetry of that isotopologue.

# %%
truth = rotor.read("H2CO").molecule
measured = []
for isotopes in ("", "1=18O", "2=13C", "3=2H", "H=2H"):
    changed = truth.with_isotopes(isotopes) if isotopes else truth
    constants = dict(zip("ABC", Top.from_molecule(changed).rotational_constants_mhz, strict=True))
    measured.append((changed.formula, isotopes, constants, {}))
start = Molecule(truth.symbols, truth.positions_angstrom * 1.02)
formaldehyde = family(start, measured, name="H2CO")
coordinates = [named(start, "CO", [1, 2]), named(start, "CH", [2, 3]), named(start, "HCO", [1, 2, 3])]
found = fit_structure(formaldehyde, "r0", coordinates=coordinates, leave_out="c")
for value, one in zip(found.values, coordinates, strict=False):
    print(f"{value.name}: {value.value:.6f} {value.unit}, true {one.value(truth.positions_angstrom):.6f}")
    assert abs(value.value - one.value(truth.positions_angstrom)) < 1e-4
assert symmetric_displacements(start).shape == (12, 3)
assert len(coordinates[1].alike) == 2  # both C-H bonds are one coordinate

# %%
structure_figure(found.molecule, values=found.values, title="H₂CO")

# %% [markdown]
# ## What cannot be seen
#
# An atom near an axis hardly moves it: with vibration its square may come out negative. It is reported, not hidden. O of HNCO is such an
# atom. O of H2CO lies on the axis by symmetry: its coordinate across is 0, without an error.

# %%
isocyanic = rotor.read("HNCO").molecule
shifted = []
for name, isotopes, change in (("HNCO", "", 0.0), ("HN13CO", "3=13C", 0.0), ("HNC18O", "4=18O", 1e-4)):
    rigid = Top.from_molecule(isocyanic.with_isotopes(isotopes) if isotopes else isocyanic).rotational_constants_mhz
    shifted.append((name, isotopes, {k: v * (1 + change) for k, v in zip("ABC", rigid, strict=True)}, {}))
doubtful = substitution_structure(family(isocyanic, shifted))
for note in doubtful.notes:
    print(note)
assert any("imaginary" in note for note in doubtful.notes)
exact = substitution_structure(formaldehyde)
assert not exact.positions_angstrom[:2, 1:].any()
assert not exact.errors_angstrom[:2, 1:].any()
