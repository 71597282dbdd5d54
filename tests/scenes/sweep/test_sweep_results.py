"""The results that a sweep shows of each kind of scene: a field that an answer has no more would make its points fail."""

from __future__ import annotations

from pathlib import Path

import pytest

from rotor.scenes.scene import parse_scene
from rotor.scenes.sweep import run_sweep
from rotor.verbs import SCENE_VERBS

MEASURED = "j_upper,j_lower,frequency_mhz,error_mhz\n1,0,20000.0,0.01\n2,1,40000.0,0.01\n3,2,60000.0,0.01\n"
FAMILY = """name = "carbon monoxide"
[geometry]
atoms = [["C", 0.0, 0.0, 0.0], ["O", 0.0, 0.0, 1.13]]
[[isotopologue]]
name = "CO"
constants = "B=57635.968 MHz"
"""
SMALL = {
    "assign": ('spectrum = { file = "peaks.csv" }\n', {"species", "peaks", "unexplained"}),
    "spectrum": ('molecule = "CO"\n[numerics]\njmax = 2\n', {"lines", "strongest_mhz", "strongest_lgint", "q", "jmax"}),
    "levels": ('molecule = "CO"\n[observables]\njmax = 2\n', {"levels", "lowest_cm", "highest_cm"}),
    "raman": ('molecule = "N2"\n[numerics]\njmax = 4\n', {"lines", "strongest_cm", "strongest_cm2_per_sr", "q"}),
    "thermo": (
        'molecule = "CO"\n[conditions]\ntemperature = [100.0, 300.0]\n',
        {"temperature_k", "q_rot", "entropy_j_per_mol_k", "cv_over_r"},
    ),
    "stark": (
        'molecule = "OCS"\n[conditions]\nfield = "0:10kV/cm:2"\n[observables]\njmax = 1\n',
        {"levels", "largest_shift_mhz"},
    ),
    "zeeman": (
        'molecule = "HCOOH"\n[magnetic]\ng = [-0.28, -0.09, -0.03]\n[conditions]\nfield = "0:2T:2"\n[observables]\njmax = 1\n',
        {"levels", "largest_shift_mhz"},
    ),
    "torsion": (
        'molecule = "C2H6"\n[observables]\nbond = "1-2"\npotential = "V3=1013 cm-1"\n',
        {"barrier_cm", "zero_point_cm", "reduced_moment_u_angstrom2", "cv_over_r"},
    ),
    "info": ('molecule = "water"\n', {"a_mhz", "b_mhz", "c_mhz", "mass_u", "kappa"}),
    "isotopologues": ('molecule = "water"\n', {"isotopologues"}),
    "structure": (
        '[observables]\nmethod = ["r0"]\n[family]\nfile = "family.toml"\n',
        {"coordinates", "rms_u_angstrom2"},
    ),
    "tumble": ('molecule = "water"\n', {"energy", "period", "turning_rate"}),
    "gas": ('molecule = "water"\n[numerics]\nmolecules = 100\n', {"p_value", "chi2"}),
    "emission": (
        'molecules = [{ source = "CO", column = 1e14 }]\n[conditions]\nexcitation = "10 K"\nwidth = 0.5\nband = "ALMA3"\n',
        {"lines", "peak_k", "peak_mhz"},
    ),
    "align": (
        'molecule = "OCS"\npulses = [{ shape = "gaussian", peak = "1e11 W/cm2", fwhm = "1 ps" }]\n[conditions]\n'
        'temperature = "1 K"\nlast_time = "5 ps"\npoints = 5\n',
        {"max_cos2theta", "min_cos2theta"},
    ),
    "fit": (
        'lines = { source = "lines.csv" }\nmolecule = { constants = "B=9999 MHz" }\nparameters = { free = ["B"] }\n',
        {"lines_used", "weighted_rms", "rms_mhz"},
    ),
    "fluid": (
        '[conditions]\nmodel = "spce"\nmolecules = 27\nsteps = 10\nevery = 5\n[numerics]\ncutoff = "4 Å"\n',
        {"conserved_drift_ev_per_ns"},
    ),
}


def test_every_kind_is_here():
    assert SMALL.keys() == set(SCENE_VERBS)


@pytest.mark.parametrize("kind", SMALL)
def test_a_point_of_each_kind_has_its_results(folder, kind):
    Path("lines.csv").write_text(MEASURED)
    Path("family.toml").write_text(FAMILY)
    Path("peaks.csv").write_text("".join(f"{7000 + 131.7 * n**1.5:.3f},{1 + n % 5}\n" for n in range(20)))
    text, names = SMALL[kind]
    result = run_sweep(parse_scene(f'schema = 1\nkind = "{kind}"\ntitle = "a"\nsweep = {{ title = ["b"] }}\n{text}'))
    assert result.failed == ()
    (record,) = result.records
    assert names <= record["results"].keys()
    assert record["rows"] > 0
