"""The errors that a verb prints are those of its JSON and of the provenance of its files: every verb that can be a scene."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from assignment_cases import spectrum
from ocs_species import OCS_SPECIES
from places import ORACLES

from rotor import units
from rotor.formats.spcat.compare import catalogue_budget
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Layout
from rotor.reports.top_facts import error_rows
from rotor.requests.budget import ErrorBudget
from rotor.verbs import SCENE_VERBS

LINES_OF_CO = (
    "frequency_mhz,error_mhz,j_upper,j_lower\n115271.2018,0.0005,1,0\n230538.0,0.0005,2,1\n345795.9899,0.0005,3,2\n"
)
COMMANDS = {
    "spectrum": ("CO",),
    "levels": ("CO",),
    "raman": ("N2",),
    "thermo": ("CO", "--temperature", "20"),
    "stark": ("OCS", "--field", "0,10"),
    "zeeman": ("OCS", "--g", "-0.0287", "--field", "0,1"),
    "align": ("OCS", "--temperature", "0", "--pulse", "1e12 W/cm2, 0.3 ps"),
    "tumble": ("water",),
    "gas": ("water", "--molecules", "100"),
    "emission": ("CO", "--range", "115:116GHz"),
    "torsion": ("C2H6", "--bond", "1-2", "--potential", "V3=1013 cm-1"),
    "info": ("OCS",),
    "isotopologues": ("OCS",),
    "structure": ("family.toml",),
    "fit": ("l.csv", "--constants", "B=57600 D=0.18 MHz", "--free", "B,D"),
    "assign": ("p.csv", "--range", "8000:18000"),
    "fluid": ("argon", "--model", "argon", "--molecules", "8", "--steps", "2", "--cutoff", "3"),
}
SLOW = {"assign", "fluid"}


def prepare(folder) -> None:
    """The files that commands read."""
    (folder / "l.csv").write_text(LINES_OF_CO)
    columns = spectrum().columns
    header = ",".join(columns)
    np.savetxt("p.csv", np.column_stack(list(columns.values())), delimiter=",", header=header, comments="")
    rows = [
        (f'isotopes = "{isotopes}"\n' if isotopes else "", constants["B"]) for _, isotopes, constants, _ in OCS_SPECIES
    ]
    species = "".join(f'[[isotopologue]]\n{isotopes}constants = "B={b} MHz"\n' for isotopes, b in rows)
    atoms = '[["O", 0, 0, 1.16], ["C", 0, 0, 0], ["S", 0, 0, -1.56]]'
    (folder / "family.toml").write_text(f'name = "OCS"\n[geometry]\natoms = {atoms}\n{species}')


def plain(text: str) -> str:
    """A text as one line."""
    return " ".join(text.split())


def test_every_verb_is_here():
    assert COMMANDS.keys() == set(SCENE_VERBS)


@pytest.mark.parametrize(
    "verb", [pytest.param(verb, marks=pytest.mark.slow) if verb in SLOW else verb for verb in COMMANDS]
)
def test_the_same_errors_on_the_screen_in_the_json_and_in_the_provenance(verb, call, folder):
    prepare(folder)
    code, out, err = call(verb, *COMMANDS[verb], "--errors", "--json", "a.json", "--csv", "a.csv")
    assert code == 0, err
    content = json.loads((folder / "a.json").read_text())["errors"]
    budget, screen = ErrorBudget.from_json(content), plain(out)
    assert plain(budget.line().removeprefix("errors ")) in screen
    for name, text in error_rows(content):
        assert plain(f"{name} {text}") in screen
    assert json.loads((folder / "a.csv.provenance.json").read_text())["errors"] == content
    known = [term.value for _, term in budget.shown() if term.value is not None]
    assert known == sorted(known, reverse=True)  # the largest is named first
    assert not re.search(r"accuracy reached|reached, .* asked", screen)


CATALOGUE = ORACLES / "ocs" / "sample.cat"
TOOLS = {
    "cat": ("cat", str(CATALOGUE), "--csv", "a.csv"),
    "catalogue": ("catalogue", "show", "--catalogue", "l.rotorcat", "--csv", "a.csv"),
    "convert": ("convert", "water", "w.toml"),
    "identify": ("identify", "s.csv", "--catalogue", "co", "--width", "3", "--noise", "0.01", "--csv", "a.csv"),
}


@pytest.mark.parametrize("tool", TOOLS)
def test_commands_on_files_state_their_errors_too(tool, call, folder):
    if tool == "catalogue":
        assert call("catalogue", "add", str(CATALOGUE), "--catalogue", "l.rotorcat")[0] == 0
    if tool == "identify":
        (folder / "co").mkdir()
        assert call("spectrum", "CO", "--cat", "co/c028001.cat")[0] == 0
        emission = ("emission", "CO", "--range", "115.2:115.35GHz", "--width", "3", "--excitation", "20")
        assert call(*emission, "--profile-csv", "s.csv")[0] == 0
    code, out, err = call(*TOOLS[tool], "--errors", "--json", "a.json")
    assert code == 0, err
    content = json.loads((folder / "a.json").read_text())["errors"]
    assert plain(ErrorBudget.from_json(content).line().removeprefix("errors ")) in plain(out)
    for name, text in error_rows(content):
        assert plain(f"{name} {text}") in plain(out)
    if tool != "convert":
        assert json.loads((folder / "a.csv.provenance.json").read_text())["errors"] == content


def test_errors_of_a_catalogue_are_those_of_its_strong_lines(call, folder):
    """Half of the last printed decimal, and the largest error of the file above a tenth of the strongest line."""
    lines = read_cat(CATALOGUE)
    strong = lines.lgint >= lines.lgint.max() - 1.0
    uncertain = replace(lines, error_mhz=np.where(strong, 0.002, 5.0), layout=Layout())
    budget = catalogue_budget(uncertain)
    assert (budget.rounding.value, budget.data.value) == (5e-5, 0.002)
    strong_budget = catalogue_budget(
        replace(uncertain, error_mhz=np.where(lines.lgint == lines.lgint.max(), 0.0, 0.002))
    )
    assert (
        strong_budget.data.source
        == f"1 of {strong.sum()} strong lines have no error; the largest of the others is 0.002 MHz"
    )
    infrared = catalogue_budget(replace(uncertain, layout=Layout(decimals=(6, 6, 4, 4))))
    assert infrared.rounding.value == pytest.approx(5e-7 * units.MHZ_PER_CM)


@pytest.mark.parametrize("verb", [verb for verb in COMMANDS if verb not in SLOW])
def test_a_saved_scene_states_the_same(verb, call, folder):
    prepare(folder)
    assert call(verb, *COMMANDS[verb], "--json", "a.json", "--save-scene", "s.toml", "--csv", "a.csv")[0] == 0
    assert call("run", "s.toml", "--json", "b.json")[0] == 0
    content = json.loads((folder / "a.json").read_text())["errors"]
    report = json.loads((folder / "b.json").read_text())
    assert report.get("errors", report.get("facts", {}).get("errors")) == content
    assert json.loads((folder / "a.csv.provenance.json").read_text())["errors"] == content


WITH_ACCURACY = {
    "levels": ("1 kHz", 'molecule = "OCS"\n'),
    "spectrum": ("1 kHz", 'molecule = "OCS"\n'),
    "raman": ("1 kHz", 'molecule = "N2"\n'),
    "thermo": ("0.1 %", 'molecule = "CO"\n[conditions]\ntemperature = "20 K"\n'),
    "stark": ("1 kHz", 'molecule = "OCS"\n[conditions]\nfield = "0:50:3"\n'),
    "torsion": ("1 kHz", 'molecule = "C2H6"\n[observables]\nbond = "1-2"\npotential = "V3=1013 cm-1"\n'),
    "emission": ("1 mK", '[[molecules]]\nsource = "CO"\n[conditions]\nrange = "115:116GHz"\n'),
    "tumble": (
        "1e-6 rad",
        "[body]\nmoments = [1.0, 2.0, 2.5]\nangular_velocity = [1.0, 2.0, 3.0]\n"
        '[[effects]]\neffect = "linear drag"\ncoefficients = [0.1, 0.1, 0.1]\n[conditions]\ntimes = "0:5:6"\n',
    ),
}


@pytest.mark.parametrize("kind", WITH_ACCURACY)
def test_an_accuracy_is_compared_with_the_numerical_error_that_is_stated(kind, call, folder):
    """The last line has the number of the budget, of this answer; where settings were tried, at least that."""
    accuracy, body = WITH_ACCURACY[kind]
    (folder / "s.toml").write_text(f'schema = 1\nkind = "{kind}"\naccuracy = "{accuracy}"\n{body}')
    code, out, err = call("run", "s.toml", "--json", "a.json")
    assert code == 0, err
    content = json.loads((folder / "a.json").read_text())
    budget, reached = ErrorBudget.from_json(content["errors"]), content["accuracy"]
    scale = 100.0 if reached["unit"] == "%" and budget.unit != "%" else 1.0
    assert reached["error"] == pytest.approx(scale * budget.numerical, rel=1e-9)
    assert f"numerical error at most {reached['error']:.2g}" in plain(out)
