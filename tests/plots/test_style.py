"""--style: matplotlib's styles and .mplstyle files over the style of the package; wrong ones are refused before anything is computed."""

import json

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.image import imread
from places import PROJECT

import rotor
from rotor.observed.model.model import Sight
from rotor.observed.spectrum import ObservedSpectrum
from rotor.plots.spectra.overlay import overlay_figure
from rotor.plots.work_precision import Panel, Point, work_precision_figure

COLUMN = "figure.figsize: 3.35, 2.4\nfigure.dpi: 100\nfont.size: 7\n"


def test_a_file_sets_size_and_letters(call, folder):
    (folder / "journal.mplstyle").write_text(COLUMN)
    code, _, err = call("spectrum", "water", "--plot", "narrow.png", "--style", "journal.mplstyle")
    assert (code, err.count("error")) == (0, 0)
    height, width, _ = imread("narrow.png").shape
    assert (width, height) == (335, 240)


def test_all_letters_and_the_resolution_follow(folder):
    (folder / "small.mplstyle").write_text("font.size: 4.5\nsavefig.dpi: 50\n")
    figure = rotor.spectrum("OCS", jmax=5).plot("small.png", style="small.mplstyle")
    axes = figure.axes[0]
    assert (axes.xaxis.label.get_size(), axes.xaxis.get_ticklabels()[0].get_size()) == (4.5, 4.5)
    assert imread("small.png").shape[1] == 300  # 6 inches


def test_every_picture_takes_it(call, folder):
    """A background is seen in pictures with and without options of their axes."""
    for number, command in enumerate((("levels", "water", "--jmax", "2"), ("tumble", "water"), ("spectrum", "OCS"))):
        name = f"{number}.png"
        assert call(*command, "--plot", name, "--style", "dark_background")[0] == 0
        assert imread(name)[0, 0, :3].tolist() == [0.0, 0.0, 0.0], command
        assert call(*command, "--plot", name)[0] == 0
        assert imread(name)[0, 0, :3].tolist() == [1.0, 1.0, 1.0], command


def test_in_python_it_ends_with_the_picture():
    lines = rotor.spectrum("OCS", jmax=5)
    before = dict(mpl.rcParams)
    assert lines.plot(style="ggplot").axes[0].get_facecolor()[:3] == pytest.approx((229 / 255,) * 3)
    assert lines.plot().axes[0].get_facecolor()[:3] == (1.0, 1.0, 1.0)
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "--style 'wrong.mplstyle': expected an .mplstyle file, or a style of matplotlib, such as "),
        ("figure.figsze: 3, 2\n", "--style wrong.mplstyle: Bad key figure.figsze in file wrong.mplstyle, line 1"),
        ("font.size: big\n", "--style wrong.mplstyle: Bad value"),
    ],
)
def test_wrong_styles_are_refused(call, folder, text, message):
    if text is not None:
        (folder / "wrong.mplstyle").write_text(text)
    code, out, err = call("spectrum", "water", "--plot", "a.png", "--style", "wrong.mplstyle")
    assert (code, out) == (2, "")
    assert message in err
    assert not (folder / "a.png").exists()


def test_a_style_needs_a_picture(call):
    code, _, err = call("fit", "nothing.csv", "--start", "OCS", "--free", "B", "--style", "ggplot")
    assert code == 2
    assert "--style: expected with --plot" in err


LONG = "formamide in a cell of 300 K, lines of three isotopologues as measured by the group in Lille, second run"


@pytest.mark.parametrize(
    "title", [LONG, "/data/a_name_of_a_file_without_any_blank_that_is_wider_than_the_column_of_a_page.csv"]
)
@pytest.mark.parametrize("options", [{}, {"fwhm_mhz": 1.0, "range_mhz": (20000, 90000)}])
def test_titles_fit_a_column_of_a_page(folder, title, options):
    """8.5 cm: long titles break, long words shrink, and two titles of a panel do not meet."""
    (folder / "journal.mplstyle").write_text(COLUMN)
    figure = rotor.spectrum("formamide", jmax=5, **options).plot("a.png", style="journal.mplstyle", title=title)
    axes = figure.axes[0]
    boxes = [text.get_window_extent() for text in (axes._left_title, axes._right_title) if text.get_text()]
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.x1 + 1 and box.y1 <= figure.bbox.y1 + 1 for box in boxes)
    assert len(boxes) == 1 or not boxes[0].overlaps(boxes[1])


def test_a_short_title_stays_as_it_is(folder):
    figure = rotor.spectrum("OCS", jmax=5).plot("a.png", title="OCS")
    assert (figure.axes[0].get_title(loc="left"), figure.axes[0]._left_title.get_size()) == ("OCS", 10.0)


def _costs(subject):
    """The picture of a subject of docs/accuracy.md, from its stored figures."""
    stored = json.loads((PROJECT / "benchmarks" / "results" / "accuracy.json").read_text(encoding="utf-8"))[subject]
    return work_precision_figure([
        Panel(panel["title"], panel["of"], {name: [Point(**point) for point in curve] for name, curve in panel["curves"].items()})
        for panel in stored
    ])  # fmt: skip


def _overlay():
    frequency = np.linspace(1e5, 1.001e5, 400)
    spectrum = ObservedSpectrum(frequency, np.zeros(400), np.ones(400))
    return overlay_figure(spectrum, (), Sight(), (), 1, [0])


@pytest.mark.parametrize(
    "drawn",
    [
        lambda: rotor.spectrum("water", jmax=5).plot(),
        lambda: rotor.levels("NH3", jmax=3).plot(),
        lambda: rotor.stark("OCS", fields_kv_per_cm="0:100kV/cm:5").plot(),
        lambda: rotor.plot(rotor.api.field_lines(rotor.read("OCS"), [0.0, 0.5, 1.0])),
        lambda: rotor.thermo("H2", temperatures_k="10:300:5").plot(),
        lambda: rotor.gas("water", molecules=200, seed=1).plot(),
        lambda: _costs("driven"),
        lambda: _costs("ewald"),
        _overlay,
    ],
    ids=["spectrum", "levels", "stark", "lobes", "thermo", "gas", "costs", "four costs", "overlay"],
)
def test_letters_have_five_points_in_a_column(drawn):
    """Scaled to a column of 8.5 cm every letter is legible: 5 points or more."""
    from matplotlib.text import Text

    figure = drawn()
    figure.canvas.draw()
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    assert len(texts) > 5
    smallest = min(texts, key=Text.get_fontsize)
    assert smallest.get_fontsize() * (8.5 / 2.54) / figure.get_figwidth() >= 5.0, smallest.get_text()


@pytest.mark.parametrize("subject", ["driven", "pulse", "free", "orders"])
def test_names_of_settings_do_not_touch(subject):
    from matplotlib.text import Annotation

    figure = _costs(subject)
    boxes = [text.get_window_extent() for text in figure.findobj(Annotation)]
    assert len(boxes) > 5 or subject == "free"
    assert not [1 for i, box in enumerate(boxes) for other in boxes[:i] if box.overlaps(other)]
