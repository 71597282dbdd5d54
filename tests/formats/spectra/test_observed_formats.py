"""Files of observed spectra: text, FITS images, cubes, tables, SDFITS, CLASS; and what is refused."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from rotor.formats.spectra.axis import ReadChoices, intensity_unit, velocity_to_frequency
from rotor.formats.spectra.read import read_spectrum

fits = pytest.importorskip("astropy.io.fits")
C = 299792458.0
REST = 230.538e9


def header_of(**cards: object) -> "fits.Header":
    header = fits.Header()
    for key, value in cards.items():
        header[key.replace("__", "-")] = value
    return header


def written(path: Path, data: np.ndarray, **cards: object) -> Path:
    fits.PrimaryHDU(data, header_of(**cards)).writeto(path)
    return path


VALUES = np.array([0.5, 1.0, np.nan, 4.0, 0.1], dtype=np.float32)
AXIS = {"CRPIX1": 1.0, "CRVAL1": REST, "CDELT1": -1e6, "CTYPE1": "FREQ", "CUNIT1": "Hz"}


def test_image_of_one_axis_with_descending_frequencies_and_nan(tmp_path: Path) -> None:
    path = written(tmp_path / "a.fits", VALUES, **AXIS, BUNIT="K", SPECSYS="LSRK", RESTFRQ=REST, OBJECT="Orion")
    spectrum = read_spectrum(path, ReadChoices(noise=0.1))
    assert spectrum.frequency_mhz.tolist() == [230534.0, 230535.0, 230537.0, 230538.0]
    assert spectrum.intensity.tolist() == pytest.approx([0.1, 4.0, 1.0, 0.5])
    assert (spectrum.frame, spectrum.rest_mhz, spectrum.header["object"]) == ("LSRK", 230538.0, "Orion")
    assert "1 channel without a finite number" in spectrum.notes[0]


@pytest.mark.parametrize(
    ("kind", "exact"),
    [
        ("VRAD", lambda v: REST * (1 - v / C)),
        ("VOPT", lambda v: REST / (1 + v / C)),
        ("VELO", lambda v: REST * np.sqrt((1 - v / C) / (1 + v / C))),
    ],
)
def test_velocity_axes_by_convention(tmp_path: Path, kind: str, exact) -> None:  # type: ignore[no-untyped-def]
    cards = {
        "CRPIX1": 2.0,
        "CRVAL1": 1e5,
        "CDELT1": 2e3,
        "CTYPE1": kind,
        "CUNIT1": "m/s",
        "BUNIT": "K",
        "RESTFRQ": REST,
    }
    spectrum = read_spectrum(written(tmp_path / "v.fits", np.arange(5.0), **cards), ReadChoices(noise=1.0))
    velocity = 1e5 + 2e3 * (np.arange(5) - 1)
    assert np.allclose(spectrum.frequency_mhz, np.sort(exact(velocity) * 1e-6), rtol=1e-12)


def test_class_export_counts_from_the_rest_frequency(tmp_path: Path) -> None:
    """ν_n = RESTFREQ + CRVAL1 + (n - CRPIX1) CDELT1, three degenerate axes behind."""
    cards = {
        "CRPIX1": 3.0,
        "CRVAL1": 0.5e6,
        "CDELT1": 0.1e6,
        "CTYPE1": "FREQ",
        "RESTFREQ": REST,
        "VELO__LSR": 4000.0,
        "BUNIT": "K",
        "LINE": "CO(2-1)",
    }
    cards |= {f"CTYPE{i}": kind for i, kind in ((2, "RA---GLS"), (3, "DEC--GLS"), (4, "STOKES"))}
    path = written(tmp_path / "class.fits", VALUES.reshape(1, 1, 1, 5), **cards)
    spectrum = read_spectrum(path, ReadChoices(noise=0.1))
    exact = 230538.0 + 0.5 + 0.1 * (np.array([1, 2, 4, 5]) - 3)
    assert np.allclose(spectrum.frequency_mhz, exact, rtol=1e-12)
    assert spectrum.frame == "SOURCE"
    assert spectrum.header["velo_lsr"] == 4000.0


def test_pixel_of_a_cube_and_beam(tmp_path: Path) -> None:
    data = np.arange(5 * 3 * 2, dtype=float).reshape(5, 3, 2)
    cards = {
        "CTYPE1": "RA---SIN",
        "CTYPE2": "DEC--SIN",
        "CTYPE3": "FREQ",
        "CRPIX3": 1.0,
        "CRVAL3": REST,
        "CDELT3": 1e6,
        "CUNIT3": "Hz",
    }
    path = written(tmp_path / "cube.fits", data, **cards, BUNIT="mJy/beam", BMAJ=0.5 / 3600, BMIN=0.4 / 3600)
    with pytest.raises(ValueError, match="state which spectrum"):
        read_spectrum(path)
    spectrum = read_spectrum(path, ReadChoices(pixel=(2, 3), noise=1.0))
    assert np.allclose(spectrum.intensity, data[:, 2, 1] * 1e-3)
    assert spectrum.unit == "Jy/beam"
    assert spectrum.noise[0] == pytest.approx(1e-3)  # stated in the unit of the file
    assert spectrum.beam_arcsec == pytest.approx((0.5, 0.4))
    with pytest.raises(ValueError, match="pixel 3,1"):
        read_spectrum(path, ReadChoices(pixel=(3, 1)))


def test_sdfits_rows(tmp_path: Path) -> None:
    columns = [
        fits.Column("DATA", "4E", unit="K", array=np.arange(8.0).reshape(2, 4)),
        fits.Column("CRVAL1", "D", array=[100e9, 110e9]),
        fits.Column("CDELT1", "D", array=[1e6, -1e6]),
        fits.Column("OBJECT", "8A", array=["W3OH", "L134N"]),
    ]
    table = fits.BinTableHDU.from_columns(
        columns, header=header_of(EXTNAME="SINGLE DISH", CRPIX1=2.0, CTYPE1="FREQ-OBS", RESTFREQ=109.9e9)
    )
    path = tmp_path / "sd.fits"
    fits.HDUList([fits.PrimaryHDU(), table]).writeto(path)
    with pytest.raises(ValueError, match="a table of 2 spectra"):
        read_spectrum(path)
    spectrum = read_spectrum(path, ReadChoices(row=2, noise=1.0))
    assert spectrum.frequency_mhz.tolist() == [109998.0, 109999.0, 110000.0, 110001.0]
    assert spectrum.intensity.tolist() == [7.0, 6.0, 5.0, 4.0]
    assert spectrum.header["object"] == "L134N"


def test_table_of_channels_as_specutils_writes_it(tmp_path: Path) -> None:
    specutils = pytest.importorskip("specutils")
    from astropy import units
    from astropy.nddata import StdDevUncertainty

    x = np.linspace(230.0, 230.4, 5)
    written_spectrum = specutils.Spectrum(
        flux=np.arange(5.0) * units.K, spectral_axis=x * units.GHz, uncertainty=StdDevUncertainty(np.full(5, 0.2))
    )
    written_spectrum.write(tmp_path / "t.fits", format="tabular-fits")
    for spectrum in (read_spectrum(tmp_path / "t.fits"), read_spectrum(written_spectrum)):
        assert np.allclose(spectrum.frequency_mhz, x * 1e3)
        assert spectrum.intensity.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
        assert spectrum.noise.tolist() == pytest.approx([0.2] * 5)


@pytest.mark.parametrize(
    ("text", "frequency", "unit"),
    [
        ("100 1\n101 2\n102 3\n", [100, 101, 102], "K"),
        ("frequency_ghz,intensity_mk\n0.1,1000\n0.101,2000\n0.102,3000\n", [100, 101, 102], "K"),
        ("freq (GHz), T (Jy/beam)\n0.102,3\n0.101,2\n0.100,1\n", [100, 101, 102], "Jy/beam"),
        (
            "#title: x\n#xLabel: frequency [MHz]\n#yLabel: (Jy/beam) Mean\n100 1\n101 2\n102 3\n",
            [100, 101, 102],
            "Jy/beam",
        ),
        ("# frequency (GHz)  T_B (K)\n0.100 1\n0.101 2\n0.102 3\n", [100, 101, 102], "K"),
        ("freq(GHz)\tS(mJy/beam)\n0.100\t1000\n0.101\t2000\n0.102\t3000\n", [100, 101, 102], "Jy/beam"),
        ("Frequency / GHz, T / mK\n0.100,1000\n0.101,2000\n0.102,3000\n", [100, 101, 102], "K"),
        ("f/GHz T/K\n0.100 1\n0.101 2\n0.102 3\n", [100, 101, 102], "K"),
        ("# Orion (KL) taken in May (2020)\n100 1\n101 2\n102 3\n", [100, 101, 102], "K"),
        ("# Sgr B2 in May 2020, beam (30 arcsec)\n100 1\n101 2\n102 3\n", [100, 101, 102], "K"),
        ("! MHz K\n100.0D0  1.0E0 \n101.0   2\n102 3\n", [100, 101, 102], "K"),
    ],
)
def test_text_spectra_are_read_with_units_of_their_headings(
    tmp_path: Path, text: str, frequency: list[float], unit: str
) -> None:
    (tmp_path / "a.txt").write_text(text)
    spectrum = read_spectrum(tmp_path / "a.txt", ReadChoices(noise=1.0))
    assert spectrum.frequency_mhz.tolist() == pytest.approx(frequency)
    assert spectrum.intensity.tolist() == pytest.approx([1.0, 2.0, 3.0])
    assert spectrum.unit == unit


def test_numbers_of_ghz_below_a_heading_of_mhz_have_a_hint(tmp_path: Path) -> None:
    """A band of ALMA in GHz, called MHz, was a poor fit without a word."""
    (tmp_path / "a.txt").write_text("frequency_mhz,t_k\n84.1,1\n84.2,2\n84.3,3\n")
    (note,) = read_spectrum(tmp_path / "a.txt", ReadChoices(noise=1.0)).notes
    assert note == (
        "frequencies of 84.1 to 84.3 MHz are lower than those of most spectra; if the numbers are GHz, --axis-unit GHz says so"
    )
    assert read_spectrum(tmp_path / "a.txt", ReadChoices(axis_unit="GHz", noise=1.0)).notes == ()


def test_text_in_velocities_with_noise_and_packed(tmp_path: Path) -> None:
    text = "#xLabel: radio velocity [km/s]\n#yLabel: [K] Mean\n# v, T, noise\n10 1 0.5\n0 2 0.25\n, , \n"
    with gzip.open(tmp_path / "a.txt.gz", "wt") as handle:
        handle.write(text.replace(", , \n", ""))
    spectrum = read_spectrum(tmp_path / "a.txt.gz", ReadChoices(rest_mhz=1e5))
    assert spectrum.frequency_mhz.tolist() == pytest.approx([1e5 * (1 - 1e4 / C), 1e5])
    assert spectrum.noise.tolist() == [0.5, 0.25]
    with pytest.raises(ValueError, match="velocities without a rest frequency"):
        read_spectrum(tmp_path / "a.txt.gz")


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("1 2\n1 x\n", r"line 2: '1 x': expected 2 numbers"),
        ("1 2 3\n1 2\n", "line 2"),
        ("nothing\n", "0 lines with numbers"),
        ("#xLabel: frequency [parsec]\n1 2\n2 3\n", "spectral axis in 'parsec'"),
        ("#yLabel: [mag] Mean\n1 2\n2 3\n", "intensity in 'mag'"),
    ],
)
def test_mistakes_in_text_are_named(tmp_path: Path, text: str, rule: str) -> None:
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(ValueError, match=rule):
        read_spectrum(tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("cards", "rule"),
    [
        (AXIS, "no unit of intensity"),
        (AXIS | {"BUNIT": "furlong"}, "intensity in 'furlong'"),
        ({"CTYPE1": "RA---SIN", "BUNIT": "K"}, "no spectral axis"),
        ({"CTYPE1": "VRAD", "CRVAL1": 0.0, "CDELT1": 1.0, "CUNIT1": "m/s", "BUNIT": "K"}, "without RESTFRQ"),
    ],
)
def test_missing_headers_are_named(tmp_path: Path, cards: dict, rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        read_spectrum(written(tmp_path / "a.fits", np.arange(5.0), **cards))


def test_binary_and_folder_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.30m").write_bytes(b"2A  \0\0\1\2")
    with pytest.raises(ValueError, match="exported with its command"):
        read_spectrum(tmp_path / "a.30m")
    with pytest.raises(ValueError, match="a folder"):
        read_spectrum(tmp_path)


def test_units_and_conventions() -> None:
    assert intensity_unit("K (Ta*)", "a") == ("K", 1.0)
    assert intensity_unit("Jy beam-1", "a") == ("Jy/beam", 1.0)
    with pytest.raises(ValueError, match="known are radio"):
        velocity_to_frequency(1.0, 1.0, "sideways")


@pytest.mark.parametrize(
    "text",
    [
        "frequency_mhz,intensity_k\n1000,1\n1001,2.5\n1002,-3e-1\n",
        "# xLabel: frequency [GHz]\n# yLabel: (Jy/beam) Mean\n1.0 1\n\n1.1 2\n1.2 3\n",
        "1000\t1\t0.1\n1001\t2\t0.2\n",
        "\ufefffreq (GHz), T (K), noise\n100,1,0.1\n101,2,0.1\n",
    ],
)
def test_columns_read_at_once_are_those_read_line_by_line(text: str) -> None:
    from rotor.formats.spectra import text as reader

    heading, numbers = reader._plain_columns(text) or ([], np.zeros(0))
    expected_heading, expected = reader._parsed_by_line(text, "a.csv")
    assert np.array_equal(numbers, expected)
    assert [line for line in heading if line] == expected_heading


@pytest.mark.parametrize(
    "text", ["1000 1\n1001 2 3\n", "1000 1\n# remark\n1001 2\n", "1000 1D0\n1001 2D0\n", "1000,1\n1001,\n", "", "a b\n"]
)
def test_what_is_no_plain_table_is_read_line_by_line(text: str) -> None:
    from rotor.formats.spectra import text as reader

    assert reader._plain_columns(text) is None


def test_a_long_spectrum_is_read_in_a_fraction_of_the_time() -> None:
    from time import process_time

    from rotor.formats.spectra import text as reader

    text = "\n".join(f"{1000 + 0.01 * i:.4f},{i % 17}" for i in range(40_000))
    times = []
    for read in (lambda: reader._plain_columns(text), lambda: reader._parsed_by_line(text, "a.csv")):
        begun = process_time()
        assert len(read()[1]) == 40_000
        times.append(process_time() - begun)
    assert times[1] > 4 * times[0]  # 20 measured
