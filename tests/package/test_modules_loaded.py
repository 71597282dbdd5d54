"""Only the effects that a scene calls for are imported: of every kind, from the command and from Python."""

import os
import subprocess
import sys

import numpy as np
import pytest
from assignment_cases import spectrum
from places import PROJECT

FAMILIES = (
    "rotor.fluids", "rotor.alignment", "rotor.fitting", "rotor.structures", "rotor.assignment", "rotor.observed",
    "rotor.classical", "rotor.classical.gas", "rotor.classical.effects", "rotor.classical.lyapunov",
    "rotor.quantum.spins", "rotor.quantum.fields", "rotor.quantum.internal_rotation",
    "rotor.quantum.effects.spin_effect", "rotor.quantum.effects.stark", "rotor.quantum.effects.zeeman",
    "rotor.quantum.effects.interactions",
    "rotor.spectra", "rotor.spectra.raman.raman", "rotor.spectra.emission.emission", "rotor.spectra.fields",
    "rotor.thermodynamics.functions",
    "matplotlib", "ase", "rdkit", "qutip", "numba", "duckdb", "pandas", "polars", "openmm", "dask",
)  # fmt: skip
SPINS_NAMED = {
    "rotor.quantum.spins",
    "rotor.quantum.effects.spin_effect",
}  # constants of every effect may be free in a fit
LOADED = {  # of FAMILIES, what a kind has a use for
    "spectrum": {"rotor.spectra", "rotor.thermodynamics.functions"},
    "info": set(),
    "isotopologues": set(),
    "levels": set(),
    "raman": {"rotor.spectra", "rotor.spectra.raman.raman"},
    "stark": {"rotor.spectra", "rotor.spectra.fields", "rotor.quantum.effects.stark", "rotor.quantum.fields"},
    "zeeman": {"rotor.quantum.effects.stark", "rotor.quantum.effects.zeeman", "rotor.quantum.fields"},
    "thermo": {"rotor.thermodynamics.functions"},
    "tumble": {"rotor.classical", "rotor.classical.effects", "numba"},  # the tables of effects are made from their declarations
    "driven": {"rotor.classical", "rotor.classical.effects", "numba"},
    "torsion": {"rotor.thermodynamics.functions", "ase"},  # which reads the molecule
    "gas": {"rotor.classical", "rotor.classical.gas", "numba"},
    "align": {"rotor.alignment", "rotor.quantum.fields", "numba"},
    "emission": {"rotor.spectra", "rotor.spectra.emission.emission"},
    "fit": {"rotor.fitting", "rotor.spectra", "rotor.quantum.effects.interactions", *SPINS_NAMED},
    "fluid": {"rotor.fluids", "rotor.classical", "rotor.classical.gas", "ase", "numba"},
    "assign": {"rotor.assignment", "rotor.observed", "rotor.fitting", "rotor.spectra", "rotor.quantum.effects.interactions", "numba"}
    | SPINS_NAMED,
}  # fmt: skip
OCS = 'molecule = "OCS"\n'
BODY = "[body]\nmoments = [1.0, 2.0, 3.0]\nangular_velocity = [1.0, 2.0, 3.0]\n"
KIND_MODULES = {
    "assign": '[spectrum]\nfile = "p.csv"\nrange = "8000:18000"\n',
    "raman": 'molecule = "N2"\n',
    "zeeman": OCS + "[magnetic]\ng = [-0.02]\n[conditions]\nfield = [0.0, 1.0]\n",
    "tumble": BODY,
    "driven": BODY + '[[effects]]\neffect = "linear drag"\ncoefficients = [0.1, 0.1, 0.1]\n[conditions]\ntimes = "0:1:3"\n',
    "gas": OCS + "[numerics]\nmolecules = 100\n",
    "align": OCS + '[[pulses]]\nshape = "gaussian"\npeak = "1e11 W/cm2"\nfwhm = 0.3\n[conditions]\ntemperature = 0\npoints = 11\n',
    "emission": '[[molecules]]\nsource = "CO"\n[conditions]\nrange = "100:120GHz"\n',
    "torsion": 'molecule = "C2H6"\n[observables]\nbond = "1-2"\npotential = "V3=1013 cm-1"\n',
    "fit": '[molecule]\nconstants = "B=57600 D=0.18 MHz"\n[lines]\nsource = "l.csv"\n[parameters]\nfree = ["B", "D"]\n',
    "fluid": '[conditions]\nmolecules = 8\nsteps = 1\n[numerics]\ncutoff = "3 Å"\n',
}  # fmt: skip
QUICK = ("spectrum", "tumble", "fit")  # from Python in the usual run: a kind of lines, of motions and of fits
LINES_OF_CO = (
    "frequency_mhz,error_mhz,j_upper,j_lower\n115271.2018,0.0005,1,0\n230538.0,0.0005,2,1\n345795.9899,0.0005,3,2\n"
)
WAYS = {
    "Python": "from rotor.scenes.scene import read_scene\nread_scene('s.toml').run()",
    "command": "from rotor import cli\nassert cli.run(['run', 's.toml']) == 0",
}


def loaded_families(way: str) -> set[str]:
    code = f"import sys\n{WAYS[way]}\nprint('loaded', *sys.modules)"
    environment = os.environ | {"PYTHONPATH": str(PROJECT)}
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    modules = ran.stdout.rpartition("loaded ")[2].split()
    return {family for family in FAMILIES for name in modules if name == family or name.startswith(family + ".")}


@pytest.mark.parametrize(
    ("kind", "way"),
    [
        pytest.param(
            kind,
            way,
            marks=[pytest.mark.slow] if kind in ("fluid", "assign") or (way == "Python" and kind not in QUICK) else [],
        )
        for kind in LOADED
        for way in WAYS
    ],
)
def test_modules_of_absent_effects_are_not_imported(kind, way, folder):
    """Each kind of scene loads what it calls for and nothing else; the command runs what Python runs, and loads its report too."""
    (folder / "l.csv").write_text(LINES_OF_CO)
    if kind == "assign":
        columns = spectrum().columns
        np.savetxt(
            "p.csv", np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments=""
        )
    text = f'schema = 1\nkind = "{"tumble" if kind == "driven" else kind}"\n' + KIND_MODULES.get(kind, OCS)
    (folder / "s.toml").write_text(text)
    assert loaded_families(way) <= LOADED[kind]


def test_an_effect_that_is_called_for_is_imported(folder):
    """Control: the same spectrum with its spins."""
    (folder / "s.toml").write_text('schema = 1\nkind = "spectrum"\nmolecule = "HCN"\n[effects]\nhyperfine = true\n')
    assert loaded_families("Python") >= SPINS_NAMED
