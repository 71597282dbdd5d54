"""The public face: a function for each verb, names that have moved, and what a result gives."""

import ast
import doctest
import inspect
import json
import re
import warnings

import numpy as np
import pytest
from places import PROJECT

import rotor
from rotor import api
from rotor.alignment.pulse import Kick
from rotor.calls import EXAMPLES
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import StateConstants
from rotor.verbs.common.verb import verb_of


def test_the_face_is_small():
    assert len(dir(rotor)) <= 40
    for name in set(dir(rotor)) - {"__version__"}:
        assert getattr(rotor, name).__doc__, name


@pytest.mark.parametrize("verb", rotor.VERBS)
def test_each_verb_is_a_documented_function_with_an_example(verb):
    function = getattr(rotor, verb)
    assert function.__name__ == verb
    assert "Parameters\n----------" in function.__doc__
    examples = doctest.DocTestParser().get_doctest(function.__doc__, {}, verb, None, 0)
    assert len(examples.examples) == 2
    results = doctest.DocTestRunner(verbose=False).run(examples)
    assert results.failed == 0
    assert verb in EXAMPLES


def test_every_field_is_an_argument():
    for verb in rotor.VERBS:
        for field in verb_of(verb).fields.values():
            if field.key and field.name:
                assert f"\n{field.name} : optional" in getattr(rotor, verb).__doc__


@pytest.mark.parametrize("verb", rotor.VERBS)
def test_editors_see_the_arguments(verb):
    """The signature has every documented argument once."""
    function = getattr(rotor, verb)
    names = list(inspect.signature(function).parameters)
    documented = re.findall(r"^(\w+) : ", function.__doc__.split("Returns")[0], re.MULTILINE)
    assert sorted(names) == sorted(set(documented))
    assert len(documented) == len(names)


def test_python_gives_the_numbers_of_the_command(call):
    code, out, _ = call("spectrum", "CO", "--temperature", "20", "--jmax", "5", "--json", "-")
    assert code == 0
    spectrum = rotor.spectrum("CO", temperature_k=20, jmax=5)
    assert [line["frequency_mhz"] for line in json.loads(out)["lines"]] == spectrum.table.frequency_mhz.tolist()
    assert spectrum.facts()["q"] == json.loads(out)["q"]


def test_a_text_with_a_unit_is_a_number():
    assert rotor.levels("CO", max_energy_mhz="50 cm-1").request.max_energy_mhz == pytest.approx(50 * 29979.2458)
    field = rotor.stark("OCS", fields_kv_per_cm="0:10kV/cm:3", j_highest=0).table.fields
    assert field.tolist() == [0.0, 5.0, 10.0]
    table = rotor.stark("OCS", fields_kv_per_cm=[0.0, 5.0, 10.0], j_highest=0).table
    assert (table.fields == field).all()


@pytest.mark.parametrize(
    ("verb", "typed", "meant"),
    [
        ("stark", "field", "fields_kv_per_cm"), ("stark", "states", "j_highest"), ("align", "pulse", "pulses"),
        ("tumble", "omega", "angular_velocity"), ("spectrum", "fwhm", "fwhm_mhz"),
    ],
)  # fmt: skip
def test_names_of_options_lead_to_arguments(verb, typed, meant):
    with pytest.raises(TypeError, match=rf"no argument '{typed}'; did you mean {meant}\w*\?"):
        getattr(rotor, verb)("water", **{typed: 1})


def test_wrong_arguments_are_named():
    with pytest.raises(TypeError, match=r"spectrum\(\): no argument 'temprature_k'; did you mean temperature_k"):
        rotor.spectrum("CO", temprature_k=3)
    with pytest.raises(ValueError, match="temperature_k: -3"):
        rotor.spectrum("CO", temperature_k=-3)
    with pytest.raises(ValueError, match="expected either"):
        rotor.levels()
    with pytest.raises(
        ValueError, match=r"^tolerance_mhz: 1e-13: energies at the highest field"
    ):  # while it is computed
        rotor.stark("OCS", fields_kv_per_cm="0:200kV/cm:3", tolerance_mhz=1e-13)


def test_notes_of_the_command_are_those_of_the_result(call):
    printed = [line.removeprefix("note: ") for line in call("spectrum", "water")[2].splitlines()]
    assert (
        list(rotor.spectrum("water").notes)
        == printed
        == ["15 lines of levels beyond the reach of the distortion constants are left out"]
    )
    assert rotor.spectrum("SMILES:C=O", jmax=1).notes[0].startswith("geometry from MMFF94, not measured")
    assert rotor.levels("CO").notes == ()


@pytest.mark.parametrize("smiles", ["SMILES:C", "SMILES:N", "SMILES:CC#C"])  # spherical, oblate, prolate
def test_equal_constants_have_equal_digits_and_errors(smiles):
    row = rotor.info(smiles, temperatures_k=300).table.to_pandas().iloc[0]
    constants = {row[f"{name}_mhz"]: row[f"{name}_error_mhz"] for name in "abc"}
    assert len(constants) == (1 if smiles == "SMILES:C" else 2)
    assert np.isfinite(list(constants.values())).all()


def test_one_number_is_a_list_of_one():
    """TypeError before: 'float' object is not iterable."""
    given, typed = (rotor.zeeman("OCS", fields_tesla=(0.0, 1.0), g=g).table.energy_mhz for g in (-0.03, "-0.03"))
    assert given.tolist() == typed.tolist()


def test_a_result_has_tables_files_pictures_and_its_scene(folder):
    spectrum = rotor.spectrum("CO", temperature_k=20, jmax=5)
    assert spectrum.to_pandas()["frequency_mhz"].tolist() == spectrum.table.frequency_mhz.tolist()
    assert "<table>" in spectrum._repr_html_()
    assert repr(spectrum).startswith("spectrum of CO")
    assert spectrum.strongest(2).tolist() == spectrum.answer.strongest(2).tolist()  # attributes of the answer
    spectrum.write("co.cat")
    assert len((folder / "co.cat").read_text().splitlines()) == 5
    assert "rotor.spectrum" in json.dumps(rotor.read("co.cat").provenance) or (folder / "co.cat").stat().st_size
    with pytest.raises(ValueError, match="spectrum writes files that end in"):
        spectrum.write("co.docx")
    with pytest.raises(
        ValueError, match=r"rotor\.levels writes levels of anything else"
    ):  # an AssertionError without words before
        spectrum.write("co.egy")
    with pytest.raises(
        ValueError, match=r"^co\.hitran: HITRAN's records begin"
    ):  # named a folder of unfinished files before
        spectrum.write("co.hitran")
    again = rotor.run_scene(spectrum.scene())
    assert np.array_equal(again.table.frequency_mhz, spectrum.table.frequency_mhz)
    assert list(spectrum.plan().counts.values()) == [5]
    text = str(spectrum.plan())
    assert text.startswith("effects: rigid rotor, ")
    assert "\nseconds: " in text
    assert "\nleft out: Doppler width: about " in text
    assert spectrum.errors.numerical < 1e-6
    assert spectrum.plot() is not None


DRAWN = set(rotor.VERBS) - {"info", "isotopologues"}  # the verbs with --plot


@pytest.mark.parametrize("verb", rotor.VERBS)
def test_each_result_is_drawn_written_and_shown(verb, folder):
    """By the call of the example of each function."""
    result = eval(first_call(EXAMPLES[verb][0]), {"rotor": rotor})
    assert (verb in DRAWN) == any(output.name == "plot" for output in verb_of(verb).outputs)
    if verb in DRAWN:
        figure = result.plot("a.png")
        assert any(axes.get_xlabel() or axes.get_xticklabels() for axes in figure.axes) or verb == "tumble"
        assert all(axes.lines or axes.collections or axes.patches for axes in figure.axes if axes.get_visible())
        assert (folder / "a.png").stat().st_size > 1000
    else:
        with pytest.raises(ValueError, match="there is no picture of a"):
            result.plot()
    result.write("a.csv")
    assert len((folder / "a.csv").read_text().splitlines()) == len(result.table) + 1
    assert len(result.to_pandas()) == len(result.to_polars()) == len(result.table)
    assert "<table>" in result._repr_html_()
    assert len(repr(result).splitlines()) <= 10
    assert result.errors.line()
    if verb not in ("assign", "fit", "structure"):  # of numbers, which a scene has in a file
        assert len(rotor.run_scene(result.scene()).table) == len(result.table)
    assert result.plan().seconds >= 0  # of numbers and objects too, which no scene can hold


def first_call(text):
    """The call at the start of an expression or inside `len(...)`, up to its closing bracket."""
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    verbs = [node for node in nodes if ast.unparse(node.func) in {f"rotor.{verb}" for verb in rotor.VERBS}]
    return ast.get_source_segment(text, verbs[0])


@pytest.mark.parametrize("name", sorted(api.MOVED))
def test_names_that_moved_warn_and_say_where_they_are(name):
    assert callable(getattr(api, name))
    if name in rotor.VERBS:
        return
    with pytest.warns(DeprecationWarning, match=rf"rotor\.{name} is rotor\.api\.{name} from version 0\.3 on"):
        assert getattr(rotor, name) is getattr(api, name)


@pytest.mark.parametrize(
    ("call", "answer"),
    [
        (lambda: Kick.of_strength(5.0, 4.04), Kick.from_strength(5.0, 4.04)),
        (lambda: Constants(B=5.0).own_name("D_J"), "D"),
        (lambda: StateConstants({"E[1]": 5.0, "B[1]": 3.0}).of_state(1), {"E": 5.0, "B": 3.0}),
        (lambda: SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3}).of_irrep("F2"), 3),
    ],
)
def test_methods_with_new_names_warn_and_answer_under_their_former_names(call, answer):
    with pytest.warns(DeprecationWarning, match=r"\.\w+ is \w+ from version 0\.3 on"):
        assert call() == answer


@pytest.mark.parametrize("function", ["run_scene", "run_sweep", "plan_of"])
def test_the_path_of_a_scene_is_told_from_a_scene(function):
    with pytest.raises(TypeError, match=r"'s\.toml': expected a scene: read_scene reads one from its file"):
        getattr(rotor, function)("s.toml")


def test_a_command_without_a_function_names_the_building_block():
    with pytest.raises(AttributeError, match=r"no attribute 'identify'; there is rotor\.api\.identify"):
        rotor.identify  # noqa: B018


def test_what_must_be_given_has_no_default_in_the_signature():
    signature = inspect.signature(rotor.align)
    assert signature.parameters["pulses"].default is inspect.Parameter.empty
    assert "MISSING" not in str(signature)


def test_further_building_blocks_are_in_one_place():
    assert sorted(api.modules()) == dir(api)
    for name in set(api.modules()) - api.MOVED:
        assert getattr(api, name) is not None


def test_unknown_names_are_no_surprise():
    with pytest.raises(AttributeError, match="did you mean"):
        rotor.spektrum  # noqa: B018
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rotor.spectrum, rotor.Top, rotor.api  # noqa: B018


def imports_of(path):
    """The lines of a script, of the cells of a notebook, or of a page, that import from the package, as (module, names)."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        text = "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "code")
    pattern = r"^[ \t>]*(?:from (rotor[\w.]*) import (?:\(([^)]*)\)|([^\n(#]+))|import (rotor[\w.]*))"
    for computed in re.finditer(pattern, text, re.MULTILINE):
        listed = re.sub("#.*", "", computed[2] or computed[3] or "")
        names = [name.split(" as ")[0].strip() for name in listed.split(",")]
        yield computed[1] or computed[4], [name for name in names if name]


def documents(root):
    pages = [*root.glob("*.md"), *root.glob("docs/**/*.md")]
    return [*pages, *root.glob("examples/**/*.py"), *root.glob("examples/**/*.ipynb")]


def test_no_example_imports_from_inside(root):
    """README, pages, scripts and notebooks import from `rotor` or `rotor.api` alone, and what they name is there."""
    seen = 0
    for path in documents(root):
        for module, names in imports_of(path):
            assert module in ("rotor", "rotor.api"), f"{path.name}: {module} {names}"
            where = rotor if module == "rotor" else api
            assert not [name for name in names if name not in dir(where)], path.name
            seen += len(names)
    assert seen > 300


def test_an_import_from_inside_is_seen(tmp_path):
    (tmp_path / "a.py").write_text("from rotor.quantum.solve import (\n    solve_levels,\n)\nimport rotor.units\n")
    assert list(imports_of(tmp_path / "a.py")) == [("rotor.quantum.solve", ["solve_levels"]), ("rotor.units", [])]


@pytest.fixture
def root():

    return PROJECT


def _sources(folder):
    """The same geometry as nuclei, ase.Atoms, an RDKit molecule, a path and a text."""
    from ase import Atoms
    from rdkit import Chem

    molecule = rotor.read("CO").molecule
    atoms = Atoms(molecule.symbols, molecule.positions_angstrom)
    path = folder / "co.xyz"
    atoms.write(path)
    drawn, places = Chem.MolFromSmiles("[C-]#[O+]"), Chem.Conformer(2)
    for number, place in enumerate(molecule.positions_angstrom.tolist()):
        places.SetAtomPosition(number, place)
    drawn.AddConformer(places)
    return [molecule, atoms, drawn, path, str(path)]


def test_a_verb_takes_every_object_that_names_a_molecule(tmp_path):
    """README: a name, a file, SMILES, ase.Atoms, an RDKit molecule; and a top or its nuclei. The same geometry gives the same levels."""
    results = [rotor.levels(source, jmax=2) for source in _sources(tmp_path)]
    energies = [result.table.energy_mhz for result in results]
    assert {result.plan().counts["levels"] for result in results} == {3}
    for other in energies[1:]:
        np.testing.assert_allclose(other, energies[0], rtol=1e-6)  # an .xyz file has 15 decimals or fewer
    top = rotor.read("CO")
    np.testing.assert_array_equal(
        rotor.levels(top, jmax=2).table.energy_mhz, rotor.levels("CO", jmax=2).table.energy_mhz
    )


@pytest.mark.parametrize("source", [3, ["CO"], {"source": "CO"}, b"CO"])
def test_what_is_no_molecule_is_refused(source):
    with pytest.raises(ValueError, match=r"source: .*: expected a text"):
        rotor.levels(source, jmax=2)
