"""One declaration of a quantity serves the option, the scene, the template, the schema, errors and Python; shown with a toy verb."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import sys
from contextlib import nullcontext
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path

import pytest
import toy_format
import toy_tool
import toy_verb
from places import ORACLES, PROJECT

import rotor
from rotor.formats import registry
from rotor.requests.field import all_fields
from rotor.requests.fill import Entries, read_fields, written_fields
from rotor.requests.lists import Numbers, Pairs
from rotor.requests.readers import Grid, Names, Quantity, Range, Text, Whole
from rotor.scenes.run import run_scene
from rotor.scenes.scene import parse_scene, scene_text
from rotor.scenes.template import template
from rotor.verbs import SCENE_VERBS
from rotor.verbs.common.verb import verb_of

OTHERWISE = (
    "align",
    "assign",
    "emission",
    "tumble",
    "fluid",
    "fit",
    "structure",
)  # kinds that are of more than a molecule
DECLARED = [kind for kind in SCENE_VERBS if find_spec(f"rotor.verbs.{kind}") is not None]


@pytest.fixture
def ring(monkeypatch):
    """The toy verb, entered as a module of the package: what a new file would be."""
    import rotor.cli
    import rotor.scenes.scene
    import rotor.scenes.schema
    import rotor.scenes.template
    import rotor.verbs

    monkeypatch.setitem(sys.modules, "rotor.verbs.ring", toy_verb)
    for module in (rotor.verbs, rotor.scenes.scene, rotor.scenes.schema, rotor.scenes.template):
        monkeypatch.setattr(module, "SCENE_VERBS", (*SCENE_VERBS, "ring"))
    monkeypatch.setitem(rotor.cli.VERBS, "ring", "A particle on a ring.")


def test_a_verb_is_two_files(ring, call, folder):
    code, out, err = call(
        "ring", "CO", "--radius", "100 pm", "--csv", "a.csv", "--save-scene", "s.toml", "--cut", "none"
    )
    assert (code, err) == (0, "")
    assert out == "levels  4\nfiles  a.csv, s.toml\n"
    written = (folder / "a.csv").read_bytes()
    assert 'cut = "none"' in (folder / "s.toml").read_text()
    assert call("run", "s.toml")[0] == 0
    assert (folder / "a.csv").read_bytes() == written
    content = json.loads(call("ring", "CO", "--json", "-")[1])
    assert [level["energy_mhz"] for level in content["levels"]] == [0.0, 505379.0]  # 4 B is above the cut of 1e6 MHz


def test_a_sweep_of_a_new_verb_has_its_results(ring, call, folder):
    (folder / "s.toml").write_text(
        'schema = 1\nkind = "ring"\nmolecule = "CO"\nsweep = { "conditions.radius" = ["1 Å", "1.5 Å"] }\n'
    )
    assert call("run", "s.toml", "--json", "a.json")[0] == 0
    points = json.loads((folder / "a.json").read_text())["points"]
    assert [point["highest_mhz"] for point in points] == pytest.approx([505379.0, 505379.0 * 4 / 2.25])


def test_a_verb_without_scenes_is_one_file(monkeypatch, call, folder):
    """Options, help, errors, files and JSON of a verb on files follow from its declaration too."""
    import rotor.cli

    monkeypatch.setitem(sys.modules, "rotor.verbs.count", toy_tool)
    monkeypatch.setitem(rotor.cli.VERBS, "count", "Words.")
    (folder / "a.txt").write_text("one two three\n")
    code, out, err = call("count", "a.txt", "--least", "4", "--out", "b.txt")
    assert (code, out, err, (folder / "b.txt").read_text()) == (0, "words  1\nfiles  b.txt\n", "", "1")
    assert json.loads(call("count", "a.txt", "--json", "-")[1]) == {
        "rotor_version": rotor.__version__, "command": "rotor count a.txt --json -", "input": "a.txt", "words": 3, "files": [],
    }  # fmt: skip
    assert "--least N  Letters of a word at least [1].\n" in call("count", "--help")[1]
    for words, number, said in (
        ((), 2, "FILE is missing; --help shows what the command takes"),
        (("a.txt", "--least", "10"), 2, "--least: 10: expected a whole number from 1 to 9"),
        (("a.txt", "--least", "9"), 1, "a.txt: no word of 9 letters"),
        (
            ("a.txt", "--out", "a.txt"),
            2,
            "--out a.txt: is an input of this command; give another name",
        ),
        (("a.txt", "--out", "a.csv"), 2, "--out a.csv: the name must end in .txt"),
    ):
        assert call("count", *words) == (number, "", f"error: {said}\n")
    assert "count" not in SCENE_VERBS


def test_a_format_is_one_file(monkeypatch, folder):
    """The toy format as a file of the folder of formats: read, written and refused as the others, without a row elsewhere."""
    table = rotor.levels("CO", jmax=3).table
    with pytest.raises(ValueError, match=r"a\.tabs: a .* can be written as"):
        rotor.write(table, "a.tabs")
    (folder / "formats").mkdir()
    shutil.copy(toy_format.__file__, folder / "formats" / "toy_format.py")
    monkeypatch.setattr(registry, "FOLDER", folder / "formats")
    monkeypatch.setattr(registry, "PACKAGE", "")
    rotor.write(table, "a.tabs")
    again = rotor.read("a.tabs")
    assert again.columns["energy_mhz"].tolist() == table.columns["energy_mhz"].tolist()
    assert ".tabs" in registry.suffixes_for(type(table))
    Path("b.tabs").write_text("#\na\tb\n1\n")
    with pytest.raises(ValueError, match=r"b\.tabs, line 3: 1 columns; expected 2"):
        rotor.read("b.tabs")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--radius", "-1 pm"), "error: --radius: -1 pm: expected a finite number above 0 Å\n"),
        (("--radius", "5 K"), "error: --radius: '5 K': unit 'K' does not measure the same thing as 'Å'"),
        (("--mmax", "51"), "error: --mmax: 51: expected a whole number from 0 to 50\n"),
        (("--axis", "d"), "error: --axis: 'd': expected one of a, b, c\n"),
        (("--field", "0:100V"), "error: --field: '0:100V': unit 'V' is not a known unit"),
        (("--cut", "x"), "error: --cut: 'x' is not a number"),
        (("--radius", "1", "--radius", "2"), "error: --radius: given more than once"),
    ],
)
def test_errors_quote_what_was_typed_and_name_the_option(ring, call, folder, words, said):
    code, out, err = call("ring", "CO", *words)
    assert (code, out) == (2, "")
    assert err.startswith(said)
    assert list(folder.iterdir()) == []


def test_the_same_errors_name_keys_of_a_scene_and_fields_of_a_request(ring):
    scene = parse_scene('schema = 1\nkind = "ring"\nmolecule = "CO"\n[conditions]\nradius = "-1 pm"\n')
    with pytest.raises(ValueError, match=r"^conditions\.radius: -1 pm: expected a finite number above 0 Å$"):
        run_scene(scene)
    with pytest.raises(ValueError, match=r"^radius_angstrom: -1: expected a finite number above 0 Å$"):
        toy_verb.RingRequest("CO", radius_angstrom=-1.0)


def test_the_template_and_the_help_have_every_quantity(ring, call):
    text, help_ = template("ring"), call("ring", "--help-all")[1]
    for field in all_fields(toy_verb.RingRequest).values():
        assert f"{field.last} = " in text
        assert f"{field.flag} " in help_
    assert 'radius = "2 Å"  # radius of the ring (Å)' in text
    assert parse_scene(text).kind == "ring"
    assert "--mmax" not in call("ring", "--help")[1]  # not common


def test_one_knob_serves_sweep_accuracy_and_plan(ring, call, folder):
    """A verb says nothing of accuracy but the knob of one field: `rotor accuracy`, an accuracy of a scene and `rotor plan` follow."""
    (folder / "s.toml").write_text('schema = 1\nkind = "ring"\nmolecule = "CO"\n[observables]\ncut = "none"\n')
    code, out, err = call("accuracy", "s.toml", "--json", "-")
    assert code == 0, err
    rows = json.loads(out)["settings"]
    assert [row["setting"] for row in rows] == ["100000", "10000", "1000", "1e-06"]
    # 505379 m² MHz: the third is 48411 off in multiples of 1e5, the first 4621 in those of 1e4, the second 484 in those of 1e3
    assert [row["error"] for row in rows] == [48411.0, 4621.0, 484.0, 0.0]
    (folder / "t.toml").write_text('schema = 1\nkind = "ring"\naccuracy = "1 MHz"\nmolecule = "CO"\n')
    content = json.loads(call("run", "t.toml", "--json", "-")[1])
    assert content["accuracy"] == {"asked": 1.0, "error": 0.5, "unit": "MHz", "how": "tolerance 1"}
    assert call("plan", "t.toml")[0] == 0
    (folder / "u.toml").write_text('schema = 1\nkind = "ring"\naccuracy = "1e-9 MHz"\nmolecule = "CO"\n')
    assert "cannot be given: the error here is 1e-06 (tolerance 1e-06)" in call("run", "u.toml")[2]
    (folder / "v.toml").write_text(
        'schema = 1\nkind = "ring"\naccuracy = "1 MHz"\nmolecule = "CO"\n[numerics]\ntolerance = "2 MHz"\n'
    )
    assert "accuracy and numerics.tolerance: give one of them" in call("run", "v.toml")[2]


@pytest.mark.parametrize("kind", [kind for kind in DECLARED if kind not in OTHERWISE])
def test_defaults_of_a_request_and_of_its_scene_agree(kind):
    """What a scene says of nothing is the default of the request, and an empty scene is saved as an empty scene."""
    verb = verb_of(kind)
    scene = parse_scene(f'schema = 1\nkind = "{kind}"\nmolecule = "OCS"\n')
    assert scene_text(scene).count("\n") == 3
    content = {"molecule.source": "OCS"} | ({"magnetic.g": (-0.03,)} if "magnetic.g" in verb.fields else {})
    if "observables.bond" in verb.fields:  # a linear molecule has none about which it turns
        content |= {"molecule.source": "C2H6", "observables.bond": "1-2"}
    values = read_fields(verb.request, Entries({}, "key"), verb.read(Entries(content), _place())[1])
    defaults = {field.name: field.default for field in fields(verb.request)}
    assert all(value == defaults[name] for name, value in values.items())


@pytest.mark.parametrize("kind", DECLARED)
def test_a_default_as_it_is_shown_is_the_default(kind):
    for field in verb_of(kind).fields.values():
        if field.typed is not None:
            assert field.reader.read(field.typed) == pytest.approx(field.default, rel=1e-15), (
                field.key
            )  # one rounding of a unit


def _place():
    from rotor.verbs.common.verb import Place

    return Place()


READERS = [
    (Quantity("K", above=0), "300", 300.0),
    (Quantity(least=0, most=1), "50 %", 0.5),
    (Quantity("g/cm3"), "997 kg/m3", 0.997),
    (Quantity("km/s"), "8000 m/s", 8.0),
    (Quantity("1/cm2"), "1e18 /m2", 1e14),
    (Quantity("1/ps"), "0.5 /ps", 0.5),
    (Quantity("deg"), "45", 45.0),
    (Grid("kV/cm", points=3), "0:100V/cm", (0.0, 0.05, 0.1)),
    (Grid("K"), [1, 2.5], (1.0, 2.5)),
    (Range("MHz"), "2:18GHz", (2000.0, 18000.0)),
    (Numbers("D", (3,)), "0,0,1.85", (0.0, 0.0, 1.85)),
    (Pairs(int), "ee=1,oo=3", {"ee": 1, "oo": 3}),
    (Names(), ["1=2H"], ("1=2H",)),
    (Whole(0), "7", 7),
    (Whole(0), "+1e3", 1000),
    (Whole(), "-1e3", -1000),
    (Text(("a", "b")), "a", "a"),
]


@pytest.mark.parametrize(
    ("reader", "text", "value"), READERS, ids=[f"{type(reader[0]).__name__} {reader[1]}" for reader in READERS]
)
def test_a_value_is_read_and_written_back(reader, text, value):
    read = reader.read(text)
    exact = not isinstance(value, float) and not isinstance(reader, Grid)
    assert read == (value if exact else pytest.approx(value, rel=1e-15))  # one rounding of a product
    assert reader.read(reader.write(read)) == read


@pytest.mark.parametrize("kind", DECLARED)
def test_every_number_takes_a_unit_and_its_errors_name_the_option(kind):
    """Of every option with a unit: a text with it is read, another unit and a word are refused, with the option and what was typed."""
    numbers = [
        option
        for option in verb_of(kind).options.values()
        if isinstance(option.reader, Quantity | Grid | Range) and option.reader.unit
    ]
    assert numbers or kind == "structure"  # whose settings are words
    for number in numbers:
        value = f"{2 * (getattr(number.reader, 'above', None) or 0.5):g}"  # such as 100 nm of a laser, above 50
        text = f"{'1:2' if isinstance(number.reader, Range) else value} {number.reader.unit}"
        assert number.read(text, "option") is not None
        for wrong in ("1 furlong", "x"):
            wrong = wrong.replace("1 ", "1:2 ") if isinstance(number.reader, Range) else wrong
            with pytest.raises(ValueError, match=f"^{number.flag}: '{wrong}'"):
                number.read(wrong, "option")


def test_the_page_of_options_is_that_of_the_declarations():
    """Where it is stale: python docs/make_options.py."""
    path = PROJECT / "docs" / "make_options.py"
    spec = importlib.util.spec_from_file_location("make_options", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.PAGE.read_text(encoding="utf-8") == module.page()


@pytest.mark.parametrize(
    "kind", ["spectrum", "levels", "raman", "thermo", "gas", "stark", "zeeman", "align", "fluid", "emission"]
)
def test_help_fits_on_two_screens(call, kind):
    assert call(kind, "--help")[1].count("\n") <= 100  # lines; two screens of 50
    assert call(kind, "--help-all")[1].count("\n") >= call(kind, "--help")[1].count("\n")


def test_what_is_the_default_is_not_written():
    assert written_fields(toy_verb.RingRequest("CO")) == {}
    assert written_fields(toy_verb.RingRequest("CO", cut_mhz=None)) == {"observables.cut": "none"}


def test_files_of_spcat_are_no_scene(call):
    """A scene cannot hold an .int file, which states the calculation itself."""
    (case, *_) = ORACLES.glob("**/co.int")
    code, _, err = call("spectrum", str(case), "--save-scene", "s.toml")
    assert code == 2
    assert "a scene cannot hold an .int file" in err
    assert not Path("s.toml").exists()


@pytest.mark.parametrize(
    ("style", "text"),
    [
        ("option", "--step: expected with --effect, not '{other}'"),
        ("key", "numerics.step: expected with effects, not '{other}'"),
        ("name", "step: expected with effects, not '{other}'"),
    ],
)
def test_an_error_names_fields_in_the_style_of_the_user(style, text):
    from rotor.requests.fill import NamedError, naming
    from rotor.verbs.common.turning_body import MOTION

    with pytest.raises(ValueError) as error, naming(MOTION.values(), style):
        raise NamedError("{numerics.step}: expected with {effects}, not '{other}'")
    assert str(error.value) == text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("step: too long", "--step: too long"),
        ("step and order: give one", "--step and order: give one"),
        ("step 5 is too long", "--step 5 is too long"),
        ("step.x: no field", "step.x: no field"),
        ("at 5, step: too long", "at 5, step: too long"),
        ("at 5 K of temperature_k", "at 5 K of --temperature"),
        ("--temperature_k: typed", "--temperature_k: typed"),
    ],
)
def test_plain_names_in_an_error_are_replaced(text, said):
    from rotor.requests.fill import naming
    from rotor.verbs.common.turning_body import MOTION

    with pytest.raises(ValueError) as error, naming(MOTION.values(), "option"):
        raise ValueError(text)
    assert str(error.value) == said


@pytest.mark.parametrize(
    ("style", "given", "text"),
    [
        ("option", ("a.light",), "--light: changes a file alone; expected with --lines"),
        ("option", ("a.light", "outputs.lines"), ""),
        ("key", ("a.light",), ""),  # a scene may hold settings that nothing uses
        ("name", ("a.light",), ""),  # Python writes files afterwards
        ("option", ("outputs.lines", "a.dark", "a.deep"), "--lines: expected without --dark"),
        ("key", ("outputs.lines", "a.dark"), "outputs.lines: expected without a.dark"),
        ("option", ("a.dark",), "--dark: expected with --deep"),
        ("name", ("a.dark",), "dark: expected with deep"),
    ],
)
def test_rules_of_fields_and_files(style, given, text):
    from rotor.requests.fill import refuse_misfits
    from rotor.requests.readers import Field, Rule
    from rotor.verbs.common.outputs import Output

    fields = (
        Field(Text(), "", "a.light", name="light", rule=Rule(("outputs.lines",), why="changes a file alone")),
        Field(Text(), "", "a.dark", name="dark", rule=Rule(("a.deep",))),
        Field(Text(), "", "a.deep", name="deep"),
        Output("lines", (".csv",), "", rule=Rule(excludes=("a.dark",))).field,
    )
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$") if text else nullcontext():
        refuse_misfits(fields, given, style)


def test_changed_fields_are_those_that_differ_from_their_defaults():
    from rotor.requests.field import changed_fields
    from rotor.verbs.cat import CatRequest

    request = CatRequest("a.cat", compare="b.int", as_spcat=True, top_lines=20)
    assert [field.flag for field in changed_fields(request)] == ["FILE", "--compare", "--as-spcat"]
    assert [field.name for field in changed_fields(request, ("as_spcat", "isotope"))] == ["as_spcat"]
