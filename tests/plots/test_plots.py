"""Pictures: they are files of their kind, name the right lines without overlap, and say where they are from."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rotor
from rotor.plots.picture import formula_text
from rotor.plots.show import write_picture
from rotor.plots.spectra import spectrum as plots
from rotor.spectra.spectrum import Spectrum, resolving_grid

START = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.fixture(scope="module")
def water():
    return rotor.api.line_list(rotor.read("water"), jmax=12)


@pytest.fixture
def figure(monkeypatch):
    """The figures that were drawn, kept when they are written."""
    from matplotlib.figure import Figure

    selected = []
    save = Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda self, *a, **k: (selected.append(self), save(self, *a, **k))[1])
    return selected


@pytest.mark.parametrize("suffix", START)
def test_the_suffix_names_the_format_and_the_same_picture_is_the_same_file(tmp_path, suffix):
    water = rotor.api.line_list(rotor.read("water"), jmax=2)
    for name in ("a", "b"):
        write_picture(water, tmp_path / f"{name}{suffix}", provenance={"command": "by hand"})
    content = (tmp_path / f"a{suffix}").read_bytes()
    assert content.startswith(START[suffix])
    assert content == (tmp_path / f"b{suffix}").read_bytes()
    if suffix != ".pdf":  # there the metadata are compressed text
        assert b"by hand" in content
        assert b"c018003" in content  # source of the dipole


@pytest.mark.parametrize("source", ["water", "CO", "CH3CN", "H2CO"])
def test_names_lie_on_nothing(figure, tmp_path, source):
    """Of a profile; `tests/verbs/test_show.py` has the sticks."""
    lines = rotor.api.line_list(rotor.read(source), temperature_k=100.0, jmax=25)
    write_picture(
        Spectrum.from_lines(lines, resolving_grid(lines, fwhm_mhz=2000.0), fwhm_mhz=2000.0), tmp_path / "a.png"
    )
    figure[0].canvas.draw()
    axes = figure[0].axes[0]
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) >= 5
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    assert all(axes.bbox.x0 <= b.x0 and b.x1 <= axes.bbox.x1 and b.y1 <= axes.bbox.y1 for b in boxes)


def test_the_strongest_line_of_water_is_named(water, figure, tmp_path):
    write_picture(water, tmp_path / "a.png")
    axes = figure[0].axes[0]
    strongest = water.strongest(1)
    upper, lower = water.quanta(strongest.upper)[0], water.quanta(strongest.lower)[0]
    j, ka, kc = upper.tolist()
    first = axes.texts[0]
    assert first.get_text().startswith(f"${j}_{{{ka},{kc}}}$ – ${lower[0]}_")
    assert first.xy[0] * 1e6 == pytest.approx(strongest.frequency_mhz[0])
    assert axes.get_title(loc="left") == "water, H$_{2}$O, 300 K"
    assert axes.get_xlabel() == "Frequency (THz)"
    assert axes.get_yscale() == "linear"


def test_an_axis_over_decades_is_logarithmic(figure, tmp_path):
    lines = rotor.api.line_list(rotor.read("water"), range_mhz=(0.0, 5e5))
    write_picture(lines, tmp_path / "a.png")
    axes = figure[0].axes[0]
    assert axes.get_yscale() == "log"
    assert axes.get_xlabel() == "Frequency (GHz)"
    assert axes.get_xlim() == (0.0, 500.0)


def test_a_profile_says_its_shape(water, figure, tmp_path):
    doppler = Spectrum.from_lines(water, resolving_grid(water))
    write_picture(doppler, tmp_path / "a.png")
    assert figure[0].axes[0].get_title(loc="right") == "Gaussian profile, Doppler width"
    assert figure[0].axes[0].get_ylabel() == "Absorption cross section (nm²)"


def test_a_spectrum_without_lines_is_drawn_without_names(figure, tmp_path):
    x = np.linspace(10.0, 1000.0, 50_001)
    write_picture(Spectrum(x, np.exp(-(((x - 400) / 10) ** 2)), unit="D^2 ps"), tmp_path / "a.png", title="tumbling")
    axes = figure[0].axes[0]
    assert axes.get_ylabel() == "Intensity (D^2 ps)"
    assert axes.get_title(loc="left") == "tumbling"
    assert not axes.texts


def test_thinning_keeps_every_peak():
    x = np.linspace(0.0, 1.0, 1_000_001)
    y = np.zeros(len(x))
    y[[3, 500_000, 999_990]] = [1.0, 2.0, 3.0]
    thin_x, thin_y = plots.thinned(x, y)
    assert len(thin_x) <= plots.MOST_VERTICES
    for peak, height in ((3e-6, 1.0), (0.5, 2.0), (0.99999, 3.0)):
        assert thin_y[np.abs(thin_x - peak) < 4 / plots.MOST_VERTICES].max() == height


@pytest.mark.parametrize(
    ("formula", "text"),
    [("CO", "CO"), ("[2H]2O", "$^{2}$H$_{2}$O"), ("C2H5OH", "C$_{2}$H$_{5}$OH"), ("Fe(2+)", "Fe$^{2+}$")],
)
def test_formulas_are_set_as_chemists_do(formula, text):
    assert formula_text(formula) == text


def test_nothing_to_draw_is_an_error(water, tmp_path):
    with pytest.raises(ValueError, match=r"\.png, \.pdf or \.svg"):
        write_picture(water, tmp_path / "a.gif")
    with pytest.raises(ValueError, match="no line to draw"):
        write_picture(water.where([]), tmp_path / "a.png")
    with pytest.raises(ValueError, match="nothing between"):
        write_picture(water, tmp_path / "a.png", range_mhz=(1.0, 2.0))
    assert not list(tmp_path.iterdir())
    assert math.isinf(water.range_mhz[1])


def test_a_picture_on_axes_of_the_user_is_that_of_its_own_figure(water):
    from matplotlib.figure import Figure

    axes = Figure(layout="constrained").subplots(1, 2)
    assert rotor.plot(water, ax=axes[1]) is axes[1].figure
    water_axes = rotor.plot(water).axes[0]
    drawn, true = (each.collections[0].get_segments() for each in (axes[1], water_axes))
    np.testing.assert_array_equal(drawn, true)
    assert not axes[0].collections  # nothing is drawn beside it
    assert axes[1].get_xlabel() == water_axes.get_xlabel()
    rotor.plot(rotor.api.solve_levels("water", 3), ax=axes[0])
    assert axes[0].collections


def test_axes_are_refused_for_a_picture_of_several_panels():
    from matplotlib.figure import Figure

    answer = rotor.api.answer_stark(rotor.api.StarkRequest(rotor.read("OCS"), (0.0, 10.0)))
    with pytest.raises(ValueError, match=r"ax: the picture of a StarkAnswer needs a figure of its own"):
        rotor.plot(answer, ax=Figure().subplots())


@pytest.mark.parametrize(
    ("molecule", "words"),
    [
        ("water", ["para, spin weight 1", "ortho, spin weight 3"]),
        ("NH3", ["ortho, K = 3n", "para, other K", "missing (spin weight 0)"]),
        ("OCS", []),
    ],
)
def test_spin_species_of_levels_have_a_legend(molecule, words):
    figure = rotor.plot(rotor.api.answer_levels(rotor.api.LevelsRequest(rotor.read(molecule), jmax=3)))
    assert [text.get_text() for legend in figure.legends for text in legend.get_texts()] == words


def test_both_inversion_states_of_ammonia_are_named():
    figure = rotor.plot(rotor.api.answer_levels(rotor.api.LevelsRequest(rotor.read("NH3"), jmax=2)))
    assert any("0,1" in text.get_text() for text in figure.axes[0].texts)


def test_lines_of_one_transition_are_named_by_their_spins_alone():
    from rotor.quantum.effects.of_top import effects_of

    top = rotor.read("HCN")
    axes = rotor.plot(rotor.api.line_list(top, jmax=1, temperature_k=300.0, effects=effects_of(top, True))).axes[0]
    assert axes.get_title(loc="right") == "1 – 0"
    assert {text.get_text() for text in axes.texts} == {f"$F = {f} – 1$" for f in (0, 1, 2)}


@pytest.mark.parametrize("molecule", ["indole", "CH3CN"])
def test_every_free_level_of_a_stark_map_is_named(molecule):
    request = rotor.api.StarkRequest(rotor.read(molecule), (0.0, 2.0, 4.0))
    answer = rotor.api.answer_stark(request)
    named = ", ".join(text.get_text() for text in rotor.plot(answer).axes[0].texts).split(", ")
    levels = [label.split() for label in answer.states.label.tolist()]
    expected = {f"${j}_{{{','.join(projections)}}}$" for j, *projections in levels}
    assert sorted(named) == sorted(expected)


@pytest.fixture(scope="module")
def turning():
    """A top with a methyl group and 14N."""
    from rotor.tops.internal_rotation import InternalRotationConstants

    constants = {"A": 9200.0, "B": 3000.0, "C": 2310.0, "chi_aa(14N)": 1.9, "chi_bb-cc(14N)": -0.1}
    rotors = InternalRotationConstants({"F0": 160000.0, "delta": 0.6, "V3": 9e6}, frame="PAM")
    return rotor.Top.from_constants(constants, dipole_abc_debye=(1.5, 1.0, 0.0), internal_rotation=rotors)


def test_a_stark_map_of_a_methyl_group_has_short_names_and_all_m(turning):
    """Levels of the same height share a name within the picture; M of E has both signs and is not mixed."""
    from rotor.plots.view import View

    figure = rotor.plot(
        rotor.stark(turning, fields_kv_per_cm="0:4kV/cm:3", j_highest=1), view=View(vertical=(0.0, 1000.0))
    )
    figure.canvas.draw()  # a warning where the layout fails is an error
    axes = figure.axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["|M| = 0", "|M| = 1"]
    names = [text.get_text() for text in axes.texts]
    assert any(name.endswith(")") and " … " in name for name in names)
    assert axes.bbox.width > 0.8 * figure.bbox.width
    assert all(text.get_window_extent().x0 > 0 for text in axes.texts)


def test_torsional_states_in_a_field_have_a_panel_each(turning):
    """Levels of v_t = 0 and 1 are 100 cm⁻¹ apart or more: on one axis all of them looked flat."""
    from dataclasses import replace

    from rotor.plots.view import View

    two = replace(turning, internal_rotation=replace(turning.internal_rotation, vt_max=1))
    result = rotor.stark(two, fields_kv_per_cm="0:4kV/cm:3", j_highest=1)
    figure = rotor.plot(result)
    figure.canvas.draw()
    *states, slopes = figure.axes
    names = ["".join(text.get_text() for text in axes.texts) for axes in states]
    assert ["v_t{=}1" in text for text in names] == [True, False]  # the upper state above
    assert ["v_t{=}0" in text for text in names] == [False, True]
    assert all(np.ptp(axes.get_ylim()) < 10 for axes in states)
    assert sum(len(axes.lines) for axes in states) >= len(slopes.lines) - 1  # every curve, and the line at zero
    assert all(text.get_window_extent().x0 > 0 for axes in states for text in axes.texts)
    assert len(rotor.plot(result, view=View(vertical=(0.0, 500.0))).axes) == 2


def test_levels_of_a_methyl_group_are_named_by_species(turning):
    """The legend had "mean spin weight 0.5" for E."""
    figure = rotor.plot(rotor.levels(turning, jmax=3))
    assert [text.get_text() for legend in figure.legends for text in legend.get_texts()] == ["species A", "species E"]


def test_the_result_of_a_verb_is_drawn_as_by_its_method():
    result = rotor.levels("CO", jmax=3)
    by_function, by_method = rotor.plot(result), result.plot()
    assert by_function.axes[0].get_title(loc="left") == by_method.axes[0].get_title(loc="left") != ""


def test_names_of_torsional_levels_end_before_the_next_column(turning):
    figure = rotor.plot(rotor.levels(turning, jmax=3))
    figure.canvas.draw()
    axes = figure.axes[0]
    names = [text for text in axes.texts if text.get_position()[0] < 3]
    pitch = axes.transData.transform((1, 0))[0] - axes.transData.transform((0, 0))[0]
    assert len(names) >= 4
    assert any("A,E" in text.get_text() for text in names)
    for text in names:
        column = math.floor(text.get_position()[0])
        next_step = axes.transData.transform((column + 1, 0))[0] - 0.1 * pitch
        assert text.get_window_extent().x1 < next_step + 1


def test_lines_in_a_field_that_lie_far_apart_have_a_panel_each():
    fields = np.linspace(0.0, 1.0, 5)
    figure = rotor.plot(rotor.api.field_lines(rotor.read("OCS"), fields))
    low = [axes.get_ylim()[0] for axes in figure.axes]
    assert len(figure.axes) == 3  # 1 - 0, 2 - 1, 3 - 2, 12 GHz apart, with shifts below 1 MHz
    assert low == sorted(low, reverse=True)  # the highest frequency above


@pytest.mark.parametrize(
    ("pulse", "title", "peak"),
    [
        (rotor.api.GaussianPulse(1e13, 0.05), "Intensity\n(TW/cm²)", "10"),
        (rotor.api.DipolePulse(100.0, 1.0), "Field\n(kV/cm)", "100"),
    ],
)
def test_pulses_have_a_scale(pulse, title, peak):
    trace = rotor.api.align(rotor.read("OCS"), [pulse], np.linspace(0.0, 10.0, 20), temperature_k=1.0)
    axes = rotor.plot(trace).axes[0]
    assert axes.get_ylabel() == title
    assert [label.get_text() for label in axes.get_yticklabels()] == ["0", peak]
