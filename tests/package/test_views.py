"""`--plot-title`, `--plot-range`, `--plot-vertical` and `--plot-scale` of the verbs that draw."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

PULSE = ("--pulse", "1e13 W/cm2, 50 fs", "--until", "30ps", "--points", "31", "--tolerance", "1e-3")
BOX = (
    "water",
    "--molecules",
    "27",
    "--density",
    "0.3",
    "--cutoff",
    "4",
    "--step",
    "1fs",
    "--steps",
    "4",
    "--every",
    "1",
)
OCS = ("--field", "0:100kV/cm:6", "--states", "1")
GAS = ("OCS", "--molecules", "100", "--times", "0:3:4")
# arguments, which of the panels, the limits asked for, and those of the axes of that panel
DRAWN = {
    "levels": (("levels", "water", "--jmax", "3"), 0, ("1:2", "0:300"), (0.4, 2.8), (0, 300)),
    "raman": (("raman", "N2", "--jmax", "12"), 0, ("0:3THz", "0:1e-30"), (0, 100.069), (0, 1e-30)),
    "thermo": (("thermo", "CO", "--temperature", "10,100"), 0, ("20:80K", "0:2"), (20, 80), (0, 2)),
    "stark": (("stark", "OCS", *OCS), 0, ("20:80kV/cm", "-1:2"), (14.681, 81.2), (-1, 2)),
    "align": (("align", "OCS", *PULSE), 1, ("5:20ps", "0.2:0.6"), (5, 20), (0.2, 0.6)),
    "gas": (("gas", *GAS), 1, ("0:2ps", "-1:1"), (0, 2), (-1, 1)),
    "fluid": (("fluid", *BOX), 0, ("1:3fs", "0:900"), (0.001, 0.003), (0, 900)),
    "zeeman": (
        ("zeeman", "OCS", "--g", "-0.03", "--field", "0:5T:6", "--states", "1"),
        0,
        ("1:4T", "-1:2"),
        (1, 4),
        (-1, 2),
    ),
    "spectrum": (("spectrum", "CO", "--range", "0:2THz"), 0, ("0:1THz", "0:0.01"), (0, 1000), (0, 0.01)),
    "emission": (
        ("emission", "HC3N", "--range", "225:230GHz", "--column", "1e14"),
        0,
        ("226:229GHz", "0:3"),
        (226, 229),
        (0, 3),
    ),
    "cat": (("cat", "a.cat"), 0, ("1:20GHz", "-9:0"), (1, 20), (-9, 0)),
}


@pytest.fixture
def figures(monkeypatch):
    """The figures that were written."""
    results = []
    save = Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda self, *a, **k: (results.append(self), save(self, *a, **k))[1])
    return results


@pytest.fixture
def catalogue(folder):
    """A catalogue of one line of OCS."""
    (folder / "a.cat").write_text("   12162.9790  0.0100 -5.0000 2    0.0000  3  60001 101 1           0          \n")


@pytest.mark.parametrize(
    "verb", [pytest.param(name, marks=pytest.mark.slow if name in ("fluid", "gas") else ()) for name in DRAWN]
)
def test_the_part_asked_for_is_drawn(call, folder, catalogue, figures, verb):
    command, panel, (across, up), horizontal, vertical = DRAWN[verb]
    options = ("--plot-title", "cost: 5$ or 6$", "--plot-range", across, "--plot-vertical", up)
    code, _, err = call(*command, "--plot", "a.svg", *options)
    assert (code, err) == (0, "") or (code == 0 and err.startswith("note: "))
    axes = [axis for axis in figures[0].axes if verb != "fluid" or "Temperature" in axis.get_ylabel()][panel]
    assert axes.get_xlim() == pytest.approx(horizontal, rel=1e-4)  # of cm-1 in 3 THz; columns and names have a margin
    assert axes.get_ylim() == pytest.approx(vertical, rel=1e-12)
    assert "cost: 5$ or 6$" in Path("a.svg").read_text(encoding="utf-8")  # no formula between the signs


@pytest.mark.parametrize(
    ("command", "axis"),
    [(("raman", "N2", "--jmax", "12"), "y"), (("thermo", "CO", "--temperature", "10,100"), "x")],
)
@pytest.mark.parametrize("scale", ["linear", "log"])
def test_plot_scales_reach_the_axes(call, folder, figures, command, axis, scale):
    assert call(*command, "--plot", "a.png", "--plot-scale", scale)[0] == 0
    axes = figures[0].axes[0]
    assert getattr(axes, f"get_{axis}scale")() == scale
    low, high = getattr(axes, f"get_{axis}lim")()
    assert np.isfinite([low, high]).all()
    assert low < high
    assert scale == "linear" or low > 0


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("raman", "N2", "--plot-title", "x"), "--plot-title: expected with --plot"),
        (("stark", "OCS", *OCS, "--plot", "a.png", "--plot-range", "5:3"), "--plot-range: '5:3': the range must rise"),
        (("levels", "CO", "--plot", "a.png", "--plot-vertical", "1:2GHz"), "--plot-vertical: '1:2GHz': expected plain"),
        (("thermo", "CO", "--plot", "a.png", "--plot-scale", "square"), "--plot-scale: 'square': expected one of"),
        (("levels", "CO", "--plot", "a.png", "--plot-range", "50:60"), "no level inside the limits of the picture"),
        (("stark", "OCS", *OCS, "--plot", "a.png", "--plot-range", "1:2"), "the map has 0 of its fields from 1 to 2"),
        (("raman", "N2", "--plot", "a.png", "--plot-range", "1:2"), "there is no line between 1 and 2 cm-1"),
        (
            ("raman", "N2", "--plot", "a.png", "--plot-scale", "log", "--plot-vertical", "0:1"),
            "the vertical limits 0:1: a logarithmic axis",
        ),
        (
            ("spectrum", "CO", "--plot", "a.png", "--plot-scale", "log", "--plot-vertical", "0:1"),
            "the vertical limits 0:1: a logarithmic axis",
        ),
        (("zeeman", "OCS", "--g", "1", "--plot-title", "x"), "--plot-title: expected with --plot"),
        (
            ("cat", "a.cat", "--plot", "a.png", "--compare", "OCS", "--plot-vertical", "0:1"),
            "--plot-vertical: cannot be combined with --compare",
        ),
    ],
)
def test_plot_options_that_exclude_each_other_are_refused(call, folder, catalogue, command, said):
    code, _, err = call(*command)
    assert code == 2
    assert f"error: {said}" in err
    assert [path.name for path in folder.iterdir()] == ["a.cat"]


def test_names_of_levels_stand_left_of_the_fields_that_are_shown(call, folder, figures):
    assert (
        call("stark", "OCS", "--field", "0:100kV/cm:6", "--states", "1", "--plot", "a.png", "--plot-range", "20:80")[0]
        == 0
    )
    names = figures[0].axes[0].texts
    assert {name.xy[0] for name in names} == {20.0}
    assert {name.get_text() for name in names} >= {"0", "1"}


@pytest.mark.parametrize(
    ("command", "strongest"),
    [
        (("raman", "N2", "--jmax", "20"), "6 → 8"),
        (("raman", "water", "--jmax", "6", "--plot-scale", "log"), None),
        (("emission", "HC3N", "SO2", "--range", "225:230GHz", "--column", "1e14"), "25 – 24"),
        (("emission", "HCN", "--range", "88.6:88.66GHz", "--column", "1e14", "--plot-scale", "log"), "1 – 0"),
    ],
)
def test_the_strongest_line_has_its_name_and_names_lie_on_nothing(call, folder, figures, command, strongest):
    assert call(*command, "--plot", "a.png")[0] == 0
    axes = figures[0].axes[0]
    figures[0].canvas.draw()
    names = [text for text in axes.texts if text.get_text()]
    boxes = [text.get_window_extent() for text in names]
    assert names
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    assert all(axes.bbox.x0 <= b.x0 and b.x1 <= axes.bbox.x1 and b.y1 <= axes.bbox.y1 for b in boxes)
    if command[0] == "raman":
        tips = np.array([segment[1] for collection in axes.collections for segment in collection.get_segments()])
    else:
        tips = np.concatenate([line.get_xydata() for line in axes.lines])
    tallest = tips[tips[:, 1].argmax()]
    near = max(names, key=lambda text: text.xy[1])
    assert near.xy == pytest.approx(tuple(tallest), rel=5e-3)  # grid points lie beside the centre of a line
    assert strongest is None or near.get_text() == strongest
