"""`rotor.plot` draws whatever there is; the public functions take names of molecules; pictures take their options."""

from __future__ import annotations

import html
import inspect
import json
import re
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from matplotlib.figure import Figure

import rotor
from rotor.classical.tumble import TumbleRequest
from rotor.plots.show import MODULES
from rotor.plots.spectra.spectrum import spectrum_figure
from rotor.spectra.emission.emission import Source
from rotor.spectra.emission.request import EmissionRequest
from rotor.spectra.spectrum import resolving_grid
from rotor.tops.magnetic import MagneticTensors, tensor_for

CO = "B=57635.968 D=0.1835 MHz"


@pytest.fixture(scope="module")
def results() -> dict[str, object]:
    top, lines = rotor.read("water"), rotor.api.line_list("CO", jmax=8)
    gas = rotor.api.answer_gas(rotor.api.GasRequest(rotor.read("OCS"), 2000, times_ps=(0.0, 0.1, 0.2)))
    return {
        "lines": lines,
        "spectrum": rotor.Spectrum.from_lines(lines, resolving_grid(lines)),
        "spectrum answer": rotor.api.answer_spectrum(rotor.api.SpectrumRequest(top, jmax=5, fwhm_mhz=500.0)),
        "Raman lines": rotor.api.raman_lines("N2"),
        "levels": rotor.api.solve_levels("water", 4),
        "levels answer": rotor.api.answer_levels(rotor.api.LevelsRequest(rotor.read("CH3CN"), jmax=4)),
        "motion": rotor.api.free_motion([1.0, 2.0, 3.0], [0.1, 2.0, 0.1]),
        "tumble answer": rotor.api.answer_tumble(TumbleRequest((1.0, 2.0, 3.0), (0.1, 2.0, 0.1))),
        "thermodynamic functions": rotor.api.thermodynamic_functions("CO", np.linspace(5, 300, 30)),
        "correlations": gas.correlations,
        "equipartition": gas.test,
        "gas answer": gas,
        "emission answer": rotor.api.answer_emission(
            EmissionRequest((rotor.read("CO"),), (Source(1e16, 20.0, 5.0),), (110e3, 120e3))
        ),
        "stark answer": rotor.api.answer_stark(rotor.api.StarkRequest(rotor.read("OCS"), (0.0, 10.0, 20.0))),
        "zeeman answer": rotor.api.answer_zeeman(
            rotor.api.ZeemanRequest(
                replace(rotor.read("OCS"), magnetic=MagneticTensors(tensor_for("linear", [-0.03]))), (0.0, 1.0)
            )
        ),
    }


KINDS = (
    "lines", "spectrum", "spectrum answer", "Raman lines", "levels", "levels answer", "motion", "tumble answer",
    "thermodynamic functions", "correlations", "equipartition",
    "gas answer", "emission answer", "stark answer", "zeeman answer",
)  # fmt: skip


@pytest.mark.parametrize("kind", [kind for kind in KINDS if not kind.endswith("answer")])
def test_a_figure_of_everything(results, kind, tmp_path):
    """Of an answer: `test_face.py`."""
    figure = rotor.plot(results[kind], tmp_path / "a.png")
    assert isinstance(figure, Figure)
    labelled = any(axes.get_xlabel() or axes.get_xticklabels() for axes in figure.axes)
    assert labelled or kind == "motion"
    assert all(axes.lines or axes.collections or axes.patches for axes in figure.axes if axes.get_visible())
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("kind", KINDS)
def test_everything_has_a_short_text(results, kind):
    text = repr(results[kind])
    assert 1 <= len(text.splitlines()) <= 10
    assert len(text) < 1500
    if kind != "motion":
        assert "<" in results[kind]._repr_html_()
    if kind.endswith("answer"):
        assert html.escape(results[kind].errors.line()) in results[kind]._repr_html_()


def test_a_notebook_shows_how_far_a_result_can_be_trusted():
    result = rotor.levels("CO", jmax=2)
    line = f"<p>{html.escape(result.errors.line())}</p>"
    assert result._repr_html_().endswith(line)
    assert result.scene().run()._repr_html_().endswith(line)
    assert str(result.errors) == result.errors.line()


def test_tops_molecules_and_constants_are_one_line():
    top = rotor.read("water")
    assert repr(top) == (
        "Top(water, H2O, asymmetric: A 835852.4057, B 435264.025, C 278212.2207 MHz, 27 of distortion (S-reduction, Ir); "
        "dipole 0, 1.8507, 0 D)"
    )
    assert repr(top.molecule) == "Molecule(water, H2O, 3 atoms)"
    assert repr(rotor.Top.from_constants("B=1 GHz")) == "Top(linear: B 1000 MHz; dipole not known)"
    assert "<td>DJ</td>" in top._repr_html_()
    assert len(repr(rotor.api.SpectrumRequest(top))) < 800


@pytest.mark.parametrize("module", MODULES)
def test_a_module_draws_the_classes_that_it_lists(module):
    picture = import_module(f"rotor.plots.{module}").picture
    first = next(iter(inspect.signature(picture).parameters.values()))
    drawn = {name for name in re.findall(r"\w+", first.annotation) if name not in ("Sequence", "Panel")}
    assert drawn == set(MODULES[module])


def test_the_picture_of_an_answer_is_that_of_the_command(call, folder):
    """Gas: the test and the correlations, with title; heat capacity: a smooth curve from two temperatures."""
    code, _, err = call("thermo", "CO", "--temperature", "10,300", "--plot", "command.svg")
    assert code == 0, err
    rotor.thermo("CO", temperatures_k=(10.0, 300.0)).plot("answer.svg")
    pictures = [
        re.sub("<metadata>.*?</metadata>", "", (folder / name).read_text(), flags=re.S)
        for name in ("command.svg", "answer.svg")
    ]
    assert pictures[0] == pictures[1]
    figure = rotor.gas("CO", molecules=200, seed=1, times_ps=(0.0, 0.1)).plot()
    assert len(figure.axes) == 2
    assert figure.get_suptitle() == "carbon monoxide, CO, 300 K, 200 molecules"


def test_what_cannot_be_drawn_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"there is no picture of a int; there are pictures of .*Catalogue, .*Lines"):
        rotor.plot(3)
    with pytest.raises(ValueError, match=r"\.png, \.pdf or \.svg"):
        rotor.plot(rotor.api.line_list("CO", jmax=3), tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("by_word", "by_top"),
    [
        (
            lambda: rotor.api.line_list("water", jmax=3).frequency_mhz,
            lambda t: rotor.api.line_list(t, jmax=3).frequency_mhz,
        ),
        (lambda: rotor.api.solve_levels("H2O", 2).energy_mhz, lambda t: rotor.api.solve_levels(t, 2).energy_mhz),
        (lambda: rotor.api.partition_function("water", 100.0).q, lambda t: rotor.api.partition_function(t, 100.0).q),
        (
            lambda: rotor.api.thermal_tumble("water").angular_momentum,
            lambda t: rotor.api.thermal_tumble(t).angular_momentum,
        ),
    ],
)
def test_names_of_molecules_are_tops(by_word, by_top):
    assert np.array_equal(by_word(), by_top(rotor.read("water")))


def test_a_catalogue_is_no_top(tmp_path):
    rotor.write(rotor.api.line_list("CO", jmax=3), tmp_path / "co.cat")
    with pytest.raises(
        ValueError, match=r"holds a catalogue of lines \(rotor cat shows it\), not a molecule or constants"
    ):
        rotor.api.line_list(str(tmp_path / "co.cat"))


def test_constants_from_a_mapping():
    top = rotor.Top.from_constants({"A": "9.2 GHz", "B": 3000, "C": 2500.0, "DeltaJ": "1 kHz"})
    assert dict(top.constants.values) == {"A": 9200.0, "B": 3000.0, "C": 2500.0, "DeltaJ": 1e-3}
    with pytest.raises(ValueError, match="parsec"):
        rotor.Top.from_constants({"B": "9 parsec"})


@pytest.mark.parametrize(
    ("unit", "label", "mhz"), [("MHz", "Frequency (MHz)", 1.0), ("cm-1", "Wavenumber (cm⁻¹)", 29979.2458)]
)
def test_the_picture_takes_unit_scale_title_and_range(unit, label, mhz):
    lines = rotor.api.line_list("CO", jmax=8)
    axes = spectrum_figure(lines, unit=unit, log=True, title="CO", range_mhz=(1e5, 6e5)).axes[0]
    assert axes.get_xlabel() == label
    assert axes.get_xlim() == pytest.approx((1e5 / mhz, 6e5 / mhz), rel=1e-12)
    assert axes.get_yscale() == "log"
    assert axes.get_title(loc="left") == "CO"
    assert spectrum_figure(lines, log=False).axes[0].get_yscale() == "linear"


@pytest.mark.parametrize("source", ["CO", "OCS", "water", "CH3CN", "HC3N", "SO2", "H2CO"])
@pytest.mark.parametrize("edge", [False, True])
def test_the_strongest_line_is_always_named(source, edge):
    """Even where it stands at the edge of the range that is shown."""
    lines = rotor.api.line_list(source, temperature_k=100.0, jmax=30)
    strongest = lines.strongest(1)
    place = float(strongest.frequency_mhz[0])
    figure = spectrum_figure(lines, range_mhz=(0.3 * place, 1.0001 * place) if edge else None)
    figure.canvas.draw()
    axes = figure.axes[0]
    named = [text.xy[0] for text in axes.texts]
    assert (
        min(abs(np.array(named) * {"MHz": 1, "GHz": 1e3, "THz": 1e6}[axes.get_xlabel()[11:14]] - place)) < 1e-6 * place
    )
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) >= (1 if edge else 5)
    assert all(axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1 and box.y1 <= axes.bbox.y1 for box in boxes)
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_the_command_draws_as_asked(call, folder):
    options = ("--plot-unit", "cm-1", "--plot-scale", "log", "--plot-title", "a title", "--plot-range", "100:900GHz")
    assert call("spectrum", "CO", "--plot", "a.svg", *options)[0] == 0
    text = (folder / "a.svg").read_text(encoding="utf-8")
    assert "a title" in text
    assert "Wavenumber" in text
    assert json.dumps("a title")[1:-1] in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--plot-unit", "GHz"), "--plot-unit: expected with --plot"),
        (("--plot", "a.png", "--plot-unit", "eV"), "--plot-unit: 'eV': expected one of MHz, GHz, THz, cm-1"),
        (("--plot", "a.png", "--plot-scale", "square"), "--plot-scale: 'square': expected one of linear, log"),
        (("--plot", "a.png", "--plot-range", "5"), "--plot-range: '5' is not a range"),
    ],
)
def test_mistakes_of_the_picture(call, folder, arguments, said):
    code, _, err = call("spectrum", "CO", *arguments)
    assert code == 2
    assert err.startswith(f"error: {said}")
    assert not list(folder.iterdir())
