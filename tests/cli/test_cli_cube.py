"""`rotor emission --fit cube.fits --maps`, rotational diagrams and corner pictures of `--fit`."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

from rotor.formats.catalogue.cat_species import read_cat_species
from rotor.formats.spectra.axis import ReadChoices
from rotor.formats.spectra.cube_file import read_cube, read_mask
from rotor.observed.model.model import Component, model
from rotor.observed.spectrum import kelvin_per_jansky

fits = pytest.importorskip("astropy.io.fits")

CATDIR = (
    " 99501 XYZ         8   0.0     0.0     3.0000  2.8126  2.5485  2.0969  1.6454  1.1938  0.7423  0.3000  0.0000\n"
)
LINE = "{:13.4f}  0.0000{:8.4f} 3{:10.4f} 21  99501 303{:2d} 1{:2d}      {:2d} 1{:2d}\n"
SKY = {"CTYPE1": "RA---SIN", "CTYPE2": "DEC--SIN", "CRPIX1": 2.0, "CRPIX2": 3.0, "CRVAL1": 248.1, "CRVAL2": -24.5, "CDELT1": -1e-4,
       "CDELT2": 1e-4, "CUNIT1": "deg", "CUNIT2": "deg"}  # fmt: skip
NOISE = 0.05
SHAPE = (4, 3)  # y, x


def truth() -> tuple[np.ndarray, np.ndarray]:
    """Column density and velocity (y, x): the velocity field spans six widths, so that no single start would do."""
    y, x = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]]
    return 1e15 * (1 + 0.3 * x + 0.2 * y), 2.0 * (x - 1) + 3.0 * y


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A catalogue of six lines and a cube of falling frequencies with a degenerate Stokes axis, one pixel without numbers, one of noise."""
    rng = np.random.default_rng(11)
    (tmp_path / "cats").mkdir()
    (tmp_path / "cats" / "catdir.cat").write_text(CATDIR)
    rows = zip(np.linspace(230210, 230330, 6), rng.uniform(-3.8, -3, 6), rng.uniform(5, 150, 6), range(6), strict=True)
    (tmp_path / "cats" / "c099501.cat").write_text(
        "".join(LINE.format(f, i, e, 10 + j, j, 9 + j, j) for f, i, e, j in rows)
    )
    species = read_cat_species(tmp_path / "cats" / "c099501.cat")
    grid = np.arange(230200, 230340, 0.4)
    column, velocity = truth()
    cube = np.zeros((len(grid), *SHAPE))
    for y, x in np.ndindex(*SHAPE):
        cube[:, y, x] = model([Component(species, column[y, x], 90.0, velocity[y, x], 3.0)], grid).brightness_k
    cube[:, 3, 0] = 0.0
    cube += rng.normal(0, NOISE, cube.shape)
    cube[:, 0, 2] = np.nan
    cube[10:13, 2, 1] = np.nan
    header = fits.Header(
        SKY | {"CTYPE3": "FREQ", "CUNIT3": "Hz", "CRPIX3": 1.0, "CRVAL3": grid[-1] * 1e6, "CDELT3": -0.4e6, "CTYPE4": "STOKES",
               "CRPIX4": 1.0, "CRVAL4": 1.0, "CDELT4": 1.0, "BUNIT": "K", "SPECSYS": "LSRK"}
    )  # fmt: skip
    fits.PrimaryHDU(cube[None, ::-1].astype(np.float32), header).writeto(tmp_path / "cube.fits")
    return tmp_path


def command(folder: Path, *more: str) -> tuple[str, ...]:
    return ("emission", str(folder / "cats" / "c099501.cat"), "--fit", str(folder / "cube.fits"), *more)


@pytest.mark.parametrize("workers", ["1", "2"])
def test_maps_have_the_source_and_the_sky_of_the_cube(call, folder, workers):
    maps = folder / "maps.fits"
    code, out, err = call(*command(folder, "--maps", str(maps), "--workers", workers, "--json", "-"))
    assert code == 0, err
    content = json.loads(out)
    assert (content["pixels"], content["converged"]) == (10, 10)
    assert content["cube"]["noise_k"] == pytest.approx(NOISE, rel=0.1)
    column, velocity = truth()
    with fits.open(maps) as opened:
        names = [hdu.name for hdu in opened[1:]]
        assert names[:2] == ["XYZ COLUMN_PER_CM2", "XYZ COLUMN_PER_CM2 ERROR"]
        assert names[-2:] == ["CHI2", "CONVERGED"]
        header = opened[1].header
        assert (header["BUNIT"], header["CRVAL1"], header["CTYPE2"]) == ("cm-2", 248.1, "DEC--SIN")
        fitted = opened["CONVERGED"].data.astype(bool)
        assert fitted.tolist() == [[True, True, False], [True] * 3, [True] * 3, [False, True, True]]
        for name, exact in (
            ("COLUMN_PER_CM2", column),
            ("VELOCITY_KM_S", velocity),
            ("EXCITATION_K", np.full(SHAPE, 90.0)),
        ):
            value, error = opened[f"XYZ {name}"].data, opened[f"XYZ {name} ERROR"].data
            assert np.isnan(value[~fitted]).all()
            assert np.abs((value - exact) / error)[fitted].max() < 4.5, (
                name
            )  # 30 numbers: 4.5 standard errors by chance in 1e-4


def test_mask_of_pixels(call, folder):
    mask = np.zeros((1, 1, *SHAPE))
    mask[0, 0, 1, 1] = mask[0, 0, 0, 2] = 1
    fits.PrimaryHDU(mask).writeto(folder / "mask.fits")
    code, out, err = call(
        *command(folder, "--maps", str(folder / "m.fits"), "--mask", str(folder / "mask.fits"), "--json", "-")
    )
    assert code == 0, err
    assert json.loads(out)["pixels"] == 1  # the other has no numbers
    assert read_mask(folder / "mask.fits", SHAPE)[1, 1]
    with pytest.raises(ValueError, match="3 by 5"):
        read_mask(folder / "mask.fits", (5, 3))


def test_jansky_per_beam_becomes_kelvin(folder):
    with fits.open(folder / "cube.fits") as opened:
        opened[0].header["BUNIT"] = "mJy/beam"
        opened[0].header["BMAJ"] = opened[0].header["BMIN"] = 2.0 / 3600
        opened.writeto(folder / "jy.fits")
    kelvin, jansky = read_cube(folder / "cube.fits"), read_cube(folder / "jy.fits", ReadChoices(noise=7.0))
    factor = 1e-3 * kelvin_per_jansky(kelvin.frequency_mhz, (2.0, 2.0))
    assert np.allclose(
        jansky.intensity_k, kelvin.intensity_k * factor[:, None, None], equal_nan=True, rtol=1e-6
    )  # single precision
    assert (
        np.nanmax(np.abs(jansky.noise_k / (7.0 * factor.mean()) - 1)) < 1e-3
    )  # over 140 MHz the factor changes by that
    assert (np.diff(kelvin.frequency_mhz) > 0).all()


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (("--maps", "m.fits", "--pixel", "1,1"), "--pixel: needs a single spectrum"),
        (("--maps", "m.fits", "--csv", "a.csv"), "--csv: needs a single spectrum"),
        (("--maps", "m.fits", "--mask", "none.fits"), "none.fits"),
        (("--maps", "m.fits", "--range", "100:101GHz"), "no channels from"),
        (("--mask", "cube.fits", "--pixel", "1,1"), "--mask: belongs to maps"),
        (("--corner", "c.png", "--pixel", "1,1"), "expected with --sample"),
        (("--workers", "2", "--pixel", "2,2"), "--workers: spreads the rows of a cube; expected with --maps"),
        ((), "emission --maps"),
    ],
)
def test_mistakes_are_one_line(call, folder, options, rule):
    named = [str(folder / word) if word.endswith((".fits", ".csv", ".png")) else word for word in options]
    code, _, err = call(*command(folder, *named))
    assert code == 2
    assert rule in err
    assert len([line for line in err.splitlines() if not line.startswith("rotor: note")]) == 1


def test_maps_need_a_fit(call, folder):
    code, _, err = call("emission", "CO", "--maps", str(folder / "m.fits"))
    assert (code, len(err.splitlines())) == (2, 1)
    assert "--maps: belongs to a cube; expected with --fit" in err


def test_rotational_diagram_of_a_pixel(call, folder):
    picture = folder / "d.png"
    code, out, err = call(*command(folder, "--pixel", "2,2", "--diagram", str(picture), "--json", "-"))
    assert code == 0, err
    assert picture.stat().st_size > 5000
    (diagram,) = json.loads(out)["diagrams"]
    assert abs(diagram["excitation_k"] - 90.0) < 4 * diagram["excitation_error_k"]
    code, out, err = call(*command(folder, "--pixel", "2,2", "--diagram", str(folder / "d.csv")))
    assert "rotational diagrams" in out
    assert (folder / "d.csv").read_text().startswith("species,frequency_mhz,energy_upper_k,log_population")


def test_a_fit_without_a_diagram_is_printed(call, folder):
    """A single line in the range: a note, no picture, and the fit all the same."""
    picture = folder / "d.png"
    code, out, err = call(*command(folder, "--pixel", "2,2", "--range", "230220:230245", "--diagram", str(picture)))
    assert code == 0, err
    assert "fitted parameters" in out
    assert "not written: no species has a rotational diagram" in err
    assert not picture.exists()


def test_corner_of_a_sample(call, folder, monkeypatch):
    pytest.importorskip("emcee")
    corner = pytest.importorskip("corner")
    drawn = []
    monkeypatch.setattr(
        corner,
        "corner",
        lambda draws, plain=corner.corner, **given: drawn.append((draws, given)) or plain(draws, **given),
    )
    picture = folder / "corner.png"
    code, out, err = call(*command(folder, "--pixel", "2,2", "--sample", "60", "--corner", str(picture), "--json", "-"))
    assert code == 0, err
    assert min(image.imread(picture).shape[:2]) > 300  # pixels
    (draws, given) = drawn[0]
    fitted = {row["name"]: row for row in json.loads(out)["parameters"]}
    symbols = [r"$\log_{10} N$ (cm$^{-2}$)", r"$T_\mathrm{ex}$ (K)", "$v$ (km/s)", r"$\Delta v$ (km/s)"]
    assert given["labels"] == symbols  # all of one species, which is the title
    assert [name.rpartition(" ")[2] for name in fitted] == [
        "column_per_cm2",
        "excitation_k",
        "velocity_km_s",
        "fwhm_km_s",
    ]
    draws = np.column_stack([10 ** draws[:, 0], draws[:, 1:]])
    for name, values in zip(fitted, draws.T, strict=True):  # few steps: the middle within two errors
        assert abs(np.median(values) - fitted[name]["value"]) < 2 * fitted[name]["error"], name


def test_a_picture_of_draws_without_its_package_is_refused_before_the_fit(call, folder, monkeypatch):
    from rotor.observed import fit

    monkeypatch.setitem(sys.modules, "corner", None)
    monkeypatch.setattr(fit, "fit_source", None)
    picture = folder / "corner.png"
    code, out, err = call(*command(folder, "--pixel", "2,2", "--sample", "20", "--corner", str(picture)))
    assert (code, out, len(err.splitlines())) == (1, "", 1)  # not a mistake of the input
    assert (
        err == 'error: corner is not installed: python -m pip install "molrotor[sampling]"\n'
    )  # no defect of the program
    assert not picture.exists()
