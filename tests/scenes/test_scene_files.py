"""Scene files: what is read is what is written; mistakes are named with the nearest key; templates are scenes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotor.classical import effect
from rotor.requests.readers import Field, Whole
from rotor.scenes.scene import checked_table, make_scene, parse_scene, read_scene, scene_text, tables_of, write_scene
from rotor.scenes.schema import json_schema, table_schema
from rotor.scenes.sweep.points import points
from rotor.scenes.template import template
from rotor.verbs import SCENE_VERBS
from rotor.verbs.common.verb import verb_of

HEAD = 'schema = 1\nkind = "spectrum"\nmolecule = "water"\n'


def test_a_file_is_read_as_it_was_written(tmp_path):
    scene = make_scene(
        "align",
        molecule={"source": "OCS", "isotopes": ["O=18O"], "spin_weights": {"even": 1, "odd": 3}},
        pulses=[
            {"shape": "gaussian", "peak": "1e13 W/cm2", "fwhm": 1},
            {"shape": "kick", "fluence": 0.1, "axis": [[1, 0], [0, 1], [0, 0]]},
        ],
        title='a "quoted" title\\ with µ and\ta tab',
        sweep={"conditions.temperature": ["1 K", 2.5]},
    )
    write_scene(scene, tmp_path / "s.toml")
    assert read_scene(tmp_path / "s.toml") == scene


@settings(max_examples=200)
@given(st.floats(allow_nan=False, allow_infinity=False), st.text(st.characters(exclude_categories=["Cs"]), max_size=20))
def test_every_number_and_text_comes_back(number, text):
    scene = make_scene("stark", molecule={"source": text}, conditions={"field": [number]}, title=text)
    again = parse_scene(scene_text(scene))
    assert again == scene
    assert repr(again.content["conditions"]) == repr(scene.content["conditions"])  # the sign of zero too


BAD = [
    ("", "expected schema = 1, the version of the format, and it has none"),
    ("schema = 2", "expected schema = 1, the version of the format, and this one has 2"),
    ("schema = 1", "expected kind, one of spectrum, levels"),
    ('schema = 1\nkind = "spectrun"', "'spectrun' is none; the nearest is 'spectrum'"),
    ('schema = 1\nkind = "spectrum"', "the key 'molecule' is missing"),
    (HEAD + "[condition]\ntemperature = 3", "a scene of this kind has no key 'condition'; the nearest is 'conditions'"),
    (HEAD + "[conditions]\ntemprature = 3", "[conditions] has no key 'temprature'; the nearest is 'temperature'"),
    (HEAD + '[numerics]\njmax = "5"', "numerics.jmax: expected a whole number, found a text"),
    (HEAD + "[numerics]\njmax = 5.5", "numerics.jmax: expected a whole number, found a number with a decimal point"),
    (
        HEAD + "[conditions]\ntemperature = true",
        "conditions.temperature: expected a number or a text, found true or false",
    ),
    (HEAD + "[conditions]\ntemperature = ", "not a TOML file"),
    (HEAD + "[observables]\njmax = 3", "[observables] has no key 'jmax'; it is a key of [numerics]"),
    (HEAD + "jmax = 3", "a scene of this kind has no key 'jmax'; it is a key of [numerics]"),
    (HEAD + '[conditions]\naccuracy = "1 kHz"', "[conditions] has no key 'accuracy'; it stands before the first table"),
    ('schema = 1\nkind = "align"\nmolecule = "OCS"', "s.toml: the key 'pulses' is missing"),
    (
        'schema = 1\nkind = "tumble"\n[[effects]]\neffect = "linear drg"\ncoefficients = [1.0, 1.0, 1.0]',
        "effects[0].effect: 'linear drg' is none; the nearest is 'linear drag'",
    ),
    (
        'schema = 1\nkind = "align"\nmolecule = "OCS"\n[[pulses]]\nshape = "square"',
        "pulses[0].shape: 'square' is none; there are gaussian, switched, kick, table, thz",
    ),
    (
        'schema = 1\nkind = "align"\nmolecule = "OCS"\n[[pulses]]\nshape = "kick"\nfluense = 1',
        "pulses[0] has no key 'fluense'; the nearest is 'fluence'",
    ),
]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sweep = " + "[" * 3000 + "]" * 3000, "lists or tables more than 50 deep"),
        ("[observables]\njmax = " + "9" * 6000, "a whole number of thousands of digits"),
        ("[observables]\nmax_energy = " + "9" * 400, "a whole number of 400 digits is too large"),
    ],
)
def test_extremes_are_no_defects(text, said):
    """They ended in an error of recursion, of Python's bound for digits, or of an overflow."""
    with pytest.raises(ValueError, match=f"^s.toml: .*{said}"):
        parse_scene(f'schema = 1\nkind = "levels"\nmolecule = "CO"\n{text}\n', "s.toml")


@pytest.mark.parametrize(("text", "said"), BAD, ids=[said for _, said in BAD])
def test_a_mistake_is_named(text, said):
    with pytest.raises(ValueError, match=r".") as caught:
        parse_scene(text, "s.toml")
    assert str(caught.value).startswith("s.toml: ")
    assert said in str(caught.value)


def test_a_scene_file_that_is_no_text(tmp_path):
    (tmp_path / "s.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match=r"UTF-8"):
        read_scene(tmp_path / "s.toml")


@pytest.mark.parametrize("kind", SCENE_VERBS)
def test_a_template_is_a_scene_of_its_kind(kind):
    scene = parse_scene(template(kind))
    assert scene.kind == kind


@pytest.mark.parametrize("kind", SCENE_VERBS)
def test_every_key_of_a_template_may_be_switched_on(kind):
    """With the # taken away, every line is of a right type; only what excludes each other is left to the requests."""
    lines = template(kind).splitlines()
    switched = [re.sub(r"^# (?=[\w.]+ = |\[)", "", line) for line in lines]
    assert len([a for a, b in zip(lines, switched, strict=True) if a != b]) > 5
    assert parse_scene("\n".join(switched)).kind == kind


def test_the_effect_of_a_template_has_its_own_keys_in_any_order_of_classes(monkeypatch):
    """The keys were those of the class that was imported first, beside the name of a constant torque."""
    subclasses = effect._subclasses
    monkeypatch.setattr(effect, "_subclasses", lambda base: reversed(list(subclasses(base))))
    shown = template("tumble").partition("constant torque")[2].partition("[[")[0]
    assert "# vector = " in shown


@pytest.mark.parametrize("kind", SCENE_VERBS)
def test_the_sweep_of_a_template_is_one_of_its_kind(kind):
    """`rotor new structure` swept a temperature that a structure has not."""
    lines = [line.removeprefix("# ") if line.startswith("# sweep") else line for line in template(kind).splitlines()]
    scene = parse_scene("\n".join(lines).partition("\n[outputs]")[0])
    assert len(list(points(scene))) >= 2
    assert next(iter(scene.sweep)).partition(".")[0] in ("molecule", *tables_of(verb_of(kind)))


def test_defaults_of_a_template_are_the_defaults():
    """A template with all comments that are no examples switched on is the same scene."""
    for kind in SCENE_VERBS:
        text = template(kind)
        on = "\n".join(
            line.removeprefix("# ") if re.match(r"# [\w.]+ = ", line) and "# example:" not in line else line
            for line in text.splitlines()
        )
        assert parse_scene(on) == parse_scene(text)


def test_the_json_schema_knows_every_key():
    schema = json.dumps(json_schema())
    for kind in SCENE_VERBS:
        for table, keys in tables_of(verb_of(kind)).items():
            for name in (table or kind, *keys):
                assert f'"{name}"' in schema
    assert '"description"' in schema


def test_tables_that_are_examples_are_comments():
    lines = template("tumble").splitlines()
    assert {"# [body]", "# [[effects]]"} <= set(lines)
    assert {"[molecule]", "[conditions]", "[outputs]"} <= set(lines)


@pytest.mark.parametrize("kind", SCENE_VERBS)
def test_the_json_schema_takes_templates_and_refuses_what_a_scene_refuses(kind):
    """Another program reads the schema: jsonschema, with all keys of the template switched on."""
    jsonschema = pytest.importorskip("jsonschema")
    schema = json_schema()["$defs"][kind]
    jsonschema.Draft202012Validator.check_schema(schema)
    lines = (re.sub(r"^# (?=[\w.]+ = |\[)", "", line) for line in template(kind).splitlines())
    content = tomllib.loads("\n".join(lines))
    jsonschema.validate(content, schema)
    for wrong in ({"title": 3}, {"unknown": 1}, {"outputs": {"csv": 1.5}}, {"kind": "none"}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(content | wrong, schema)


def test_the_word_for_none_is_a_value_of_any_type():
    """A whole number may have such a word too, in a scene and in the schema."""
    count = {"count": Field(Whole(), "Number of lines", "numerics.count", none="all")}
    assert checked_table(count, {"count": "all"}, "numerics") == {"count": "all"}
    assert table_schema(count, "Settings.")["properties"]["count"]["anyOf"] == [{"type": "integer"}, {"type": "string"}]
    with pytest.raises(ValueError, match=r"numerics\.count: expected a whole number or a text, found a list"):
        checked_table(count, {"count": [1]}, "numerics")


def test_nothing_heavy_is_loaded_by_a_scene_alone():
    code = (
        "import sys\nfrom rotor.scenes.scene import parse_scene\n"
        f"parse_scene({HEAD!r})\n"
        "print(sorted(m for m in sys.modules if '.' not in m))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in eval(ran.stdout)}
    assert loaded.isdisjoint({"scipy", "pydantic", "numba", "ase", "rdkit", "matplotlib"})


def test_defaults_are_left_out_of_a_file():
    assert scene_text(make_scene("spectrum", molecule="CO")).count("\n") == 3
    assert scene_text(make_scene("levels", molecule="CO")).count("\n") == 3
