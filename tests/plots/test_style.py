"""--style: matplotlib's styles and .mplstyle files over the style of the package; wrong ones are refused before anything is computed."""

import matplotlib as mpl
import pytest
from matplotlib.image import imread

import rotor

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
    assert imread("small.png").shape[1] == 360  # 7.2 inches


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
