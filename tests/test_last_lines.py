"""The errors that a verb prints are those of its JSON and of the provenance of its files: every verb that can be a scene."""

import json
import re

import numpy as np
import pytest
from test_assignment import spectrum
from test_structure import OCS_SPECIES

from rotor.reports.error_table import error_rows
from rotor.requests.budget import ErrorBudget
from rotor.verbs.verb import SCENE_VERBS

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
    "fluid": ("argon", "--molecules", "8", "--steps", "2", "--cutoff", "3"),
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


@pytest.mark.parametrize("verb", [verb for verb in COMMANDS if verb not in SLOW])
def test_a_saved_scene_states_the_same(verb, call, folder):
    prepare(folder)
    assert call(verb, *COMMANDS[verb], "--json", "a.json", "--save-scene", "s.toml", "--csv", "a.csv")[0] == 0
    assert call("run", "s.toml", "--json", "b.json")[0] == 0
    content = json.loads((folder / "a.json").read_text())["errors"]
    found = json.loads((folder / "b.json").read_text())
    assert found.get("errors", found.get("facts", {}).get("errors")) == content
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
