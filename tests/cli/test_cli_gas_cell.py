"""`rotor emission --over` and `--fit` of a spectrum in absorbance, made by the law of Beer and Lambert in plain numbers."""

import json
from pathlib import Path

import numpy as np
import pytest

KELVIN, PATH_CM, PRESSURE_PA, WIDTH = 215.0, 40.0, 0.5, 1.4  # width in km/s
LINE = "{:13.4f}  0.0000{:8.4f} 3{:10.4f} 21  99501 303{:2d} 1{:2d}      {:2d} 1{:2d}\n"
ENERGIES_CM = np.array([12.0, 60.0, 140.0, 260.0, 420.0, 610.0])
LGINT = np.array([-3.4, -3.1, -3.0, -3.2, -3.3, -3.6])
LINES_MHZ = np.linspace(230212.0, 230328.0, 6)


def partition(kelvin: float) -> float:
    """Q of a nonlinear top, T^(3/2)."""
    return 1000.0 * (kelvin / 300.0) ** 1.5


def expected_absorbance(grid: np.ndarray, molecules_per_cm2: float) -> np.ndarray:
    """A = Σ I(T) N L φ/ln 10: I(T) from LGINT at 300 K, E_l in K by hc/k = 1.438777 cm K, hν/k = 4.799243e-5 K/MHz."""
    energy_k, photon_k = 1.438777 * ENERGIES_CM, 4.799243e-5 * LINES_MHZ

    def population(kelvin):
        return np.exp(-energy_k / kelvin) * -np.expm1(-photon_k / kelvin) / partition(kelvin)

    intensity_cm2_mhz = 1e-14 * 10**LGINT * population(KELVIN) / population(300.0)
    fwhm = LINES_MHZ * WIDTH / 299792.458
    shape = np.sqrt(4 * np.log(2) / np.pi) / fwhm * np.exp(-4 * np.log(2) * ((grid[:, None] - LINES_MHZ) / fwhm) ** 2)
    return molecules_per_cm2 * shape @ intensity_cm2_mhz / np.log(10)


MOLECULES = PRESSURE_PA / (1.380649e-23 * KELVIN) * 1e-6 * PATH_CM  # ideal gas, per cm²


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A catalogue of six lines, and a spectrum of the gas with noise of a hundredth of the strongest line."""
    kelvin = np.array([1000.0, 300.0, 225.0, 150.0, 75.0, 37.5, 18.75, 9.375])
    table = ",".join(f"{t:g}={partition(t):.8g}" for t in kelvin.tolist())
    rows = zip(LINES_MHZ, LGINT, ENERGIES_CM, range(6), strict=True)
    (tmp_path / "gas.cat").write_text("".join(LINE.format(f, i, e, 10 + j, j, 9 + j, j) for f, i, e, j in rows))
    (tmp_path / "q.txt").write_text(table)
    grid = np.arange(230200, 230340, 0.05)
    clean = expected_absorbance(grid, MOLECULES)
    seen = clean + np.random.default_rng(5).normal(0, 0.01 * clean.max(), len(grid))
    np.savetxt(tmp_path / "a.txt", np.stack([grid, seen], axis=1), header="frequency_mhz, absorbance", fmt="%.9g")
    return tmp_path


def command(folder: Path, *more: str) -> tuple[str, ...]:
    return ("emission", str(folder / "gas.cat"), "--partition", (folder / "q.txt").read_text(), *more)


def test_temperature_and_amount_of_a_gas_cell(call, folder):
    """The errors of twelve draws of noise are those stated (tests/observed); here each is within four of them."""
    files = [str(folder / name) for name in ("f.csv", "p.csv", "p.png")]
    code, out, err = call(
        *command(folder, "--fit", str(folder / "a.txt"), "--unit", "absorbance", "--json", "-"),
        "--csv", files[0], "--profile-csv", files[1], "--plot", files[2],
    )  # fmt: skip
    assert code == 0, err
    content = json.loads(out)
    rows = {row["name"].split()[-1]: row for row in content["parameters"]}
    for name, exact in (("excitation_k", KELVIN), ("column_per_cm2", MOLECULES), ("fwhm_km_s", WIDTH)):
        assert abs(rows[name]["value"] - exact) < 4 * rows[name]["error"], name
        assert rows[name]["error"] < 0.02 * exact
    assert content["reduced_chi_squared"] == pytest.approx(1.0, abs=0.1)
    assert content["spectrum"]["unit"] == "absorbance"
    assert "rms_k" not in content
    assert Path(files[1]).read_text().startswith("frequency_mhz,observed,noise,model,residual,optical_depth\n")
    assert all(Path(file).stat().st_size > 100 for file in files)
    code, out, _ = call(*command(folder, "--fit", str(folder / "a.txt"), "--unit", "absorbance"))
    assert code == 0
    assert "fitted parameters" in out
    assert "contributes" not in out


def test_a_model_over_absorbance_is_the_law_of_beer_and_lambert(call, folder):
    profile = folder / "p.csv"
    code, out, err = call(
        *command(folder, "--over", str(folder / "a.txt"), "--unit", "absorbance", "--column", str(MOLECULES)),
        "--excitation", str(KELVIN), "--width", str(WIDTH), "--profile-csv", str(profile), "--json", "-",
    )  # fmt: skip
    assert code == 0, err
    grid, _, _, made, _, depth = np.loadtxt(profile, delimiter=",", skiprows=1, unpack=True)
    exact = expected_absorbance(grid, MOLECULES)
    assert np.abs(made - exact).max() < 1e-4 * exact.max()  # Q between the points of its table
    assert np.allclose(depth, made * np.log(10), rtol=1e-9)
    assert json.loads(out)["rms"] == pytest.approx(0.01 * exact.max(), rel=0.1)


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (("--beam", "30"), "--beam: belongs to brightness in K"),
        (("--redshift", "1"), "--redshift: belongs to brightness in K"),
        (("--sample", "20"), "--sample: belongs to brightness in K"),
        (("--diagram", "d.png"), "--diagram: belongs to brightness in K"),
        (("--velocity", "3"), "--velocity: belongs to brightness in K"),
        (("--excitation", "100,200"), "--excitation: 2 numbers"),
        (("--column", "1e12,1e12"), "--column 1e+12,1e+12: 2 numbers for 1 species"),
        (("--range", "230330:230339"), "no lines from"),
    ],
)
def test_what_a_gas_cell_has_no_place_for_is_refused(call, folder, options, rule):
    code, out, err = call(*command(folder, "--fit", str(folder / "a.txt"), "--unit", "absorbance", *options))
    assert (code, out) == (2, "")
    assert rule in err.splitlines()[-1]


@pytest.mark.parametrize(
    ("unit", "rule"), [("V", "rotor spectrum MOLECULE --over FILE"), ("mV", "rotor spectrum MOLECULE --over FILE")]
)
def test_voltages_name_what_fits_them(call, folder, unit, rule):
    code, out, err = call(*command(folder, "--fit", str(folder / "a.txt"), "--unit", unit))
    assert (code, out) == (2, "")
    assert rule in err.splitlines()[-1]
