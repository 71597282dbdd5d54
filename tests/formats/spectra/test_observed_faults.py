"""The same spectrum in every format: channels without a number, a falling axis, a unit that is missing or unknown."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rotor.formats.spectra.axis import ReadChoices
from rotor.formats.spectra.read import read_spectrum

fits = pytest.importorskip("astropy.io.fits")

REST = 230.538e9
HZ = REST + 1e6 * np.array([3.0, 2.0, 1.0, 0.0, -1.0])  # falling
KELVIN = np.array([0.5, np.nan, 2.0, 4.0, 0.25])
EXPECTED = ([230537.0, 230538.0, 230539.0, 230541.0], [0.25, 4.0, 2.0, 0.5])


def image(path: Path, unit: str | None, **more: Any) -> None:
    axis = {"CTYPE1": "FREQ", "CUNIT1": "Hz", "CRPIX1": 1.0, "CRVAL1": HZ[0], "CDELT1": -1e6}
    fits.PrimaryHDU(KELVIN, fits.Header(axis | ({"BUNIT": unit} if unit else {}) | more)).writeto(path)


def class_export(path: Path, unit: str | None) -> None:
    """An offset from RESTFREQ, and -1000 (BLANK) where CLASS has no number."""
    axis = {
        "CTYPE1": "FREQ",
        "CRPIX1": 4.0,
        "CRVAL1": 0.0,
        "CDELT1": -1e6,
        "RESTFREQ": REST,
        "VELO-LSR": 0.0,
        "BLANK": -1000,
    }
    values = np.nan_to_num(KELVIN, nan=-1000.0).reshape(1, 1, 1, 5).astype(np.float32)
    header = fits.Header(axis | ({"BUNIT": unit} if unit else {}))
    with np.errstate(all="ignore"):
        hdu = fits.PrimaryHDU(values, header)
        hdu.header["BLANK"] = -1000
        hdu.writeto(path, output_verify="ignore")


def sdfits(path: Path, unit: str | None) -> None:
    columns = [
        fits.Column("DATA", "5D", unit=unit, array=KELVIN[None]),
        fits.Column("CRVAL1", "D", array=[HZ[0]]),
        fits.Column("CDELT1", "D", array=[-1e6]),
    ]
    header = fits.Header({"EXTNAME": "SINGLE DISH", "CRPIX1": 1.0, "CTYPE1": "FREQ-OBS", "RESTFREQ": REST})
    fits.HDUList([fits.PrimaryHDU(), fits.BinTableHDU.from_columns(columns, header=header)]).writeto(path)


def channel_table(path: Path, unit: str | None) -> None:
    columns = [
        fits.Column("frequency", "D", unit="Hz", array=HZ),
        fits.Column("flux", "D", unit=unit, array=KELVIN),
    ]
    fits.HDUList([fits.PrimaryHDU(), fits.BinTableHDU.from_columns(columns)]).writeto(path)


def rows(separator: str) -> str:
    return "".join(f"{x / 1e9:.6f}{separator}{y}\n" for x, y in zip(HZ, KELVIN, strict=True))


def casa(path: Path, unit: str | None) -> None:
    label = f"#yLabel: [{unit}] Mean\n" if unit else ""
    path.write_text(f"#title: spectral profile\n#xLabel: frequency [GHz]\n{label}" + rows(" "))


def csv(path: Path, unit: str | None) -> None:
    path.write_text(
        f"frequency_ghz,intensity_{unit.lower()}\n" + rows(",") if unit else "frequency_ghz,x\n" + rows(",")
    )


FORMATS: dict[str, tuple[Callable[[Path, str | None], None], str]] = {
    "image": (image, ".fits"),
    "class": (class_export, ".fits"),
    "sdfits": (sdfits, ".fits"),
    "table": (channel_table, ".fits"),
    "casa": (casa, ".txt"),
    "csv": (csv, ".csv"),
}


@pytest.mark.filterwarnings("ignore")  # astropy on BLANK of floating point, which CLASS writes
@pytest.mark.parametrize("name", FORMATS)
def test_falling_axis_and_channels_without_a_number(tmp_path: Path, name: str) -> None:
    write, suffix = FORMATS[name]
    write(tmp_path / f"a{suffix}", "K")
    spectrum = read_spectrum(tmp_path / f"a{suffix}", ReadChoices(noise=0.1))
    assert spectrum.frequency_mhz.tolist() == pytest.approx(EXPECTED[0], rel=1e-12)
    assert spectrum.intensity.tolist() == EXPECTED[1]
    assert any("1 channel without a finite number" in note for note in spectrum.notes)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["image", "class", "sdfits", "table"])
def test_a_missing_unit_is_an_error_and_can_be_stated(tmp_path: Path, name: str) -> None:
    write, suffix = FORMATS[name]
    write(tmp_path / f"a{suffix}", None)
    with pytest.raises(ValueError, match="no unit of intensity"):
        read_spectrum(tmp_path / f"a{suffix}", ReadChoices(noise=0.1))
    assert read_spectrum(tmp_path / f"a{suffix}", ReadChoices(noise=100.0, unit="mK")).intensity.max() == 4e-3


@pytest.mark.parametrize("name", ["casa", "csv"])
def test_text_without_a_unit_is_in_kelvin_and_says_so(tmp_path: Path, name: str) -> None:
    write, suffix = FORMATS[name]
    write(tmp_path / f"a{suffix}", None)
    spectrum = read_spectrum(tmp_path / f"a{suffix}", ReadChoices(noise=0.1))
    assert spectrum.unit == "K"
    assert any("K" in note for note in spectrum.notes)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["image", "class", "sdfits", "table", "casa"])
def test_an_unknown_unit_is_named(tmp_path: Path, name: str) -> None:
    write, suffix = FORMATS[name]
    write(tmp_path / f"a{suffix}", "furlong")
    with pytest.raises(ValueError, match="furlong"):
        read_spectrum(tmp_path / f"a{suffix}", ReadChoices(noise=0.1))
