"""Line lists in ExoMol's form: the reader, which was written apart from it, gives the same lines and Q(T)."""

from pathlib import Path

import numpy as np
import pytest

from rotor.formats import write
from rotor.formats.catalogue.exomol import exomol_species, read_states
from rotor.formats.read_write import read
from rotor.observed.model.species import species_from_lines
from rotor.quantum.effects.of_top import effects_of
from rotor.spectra.lines import line_list
from rotor.tops.top import Top

TOPS = {
    "linear": Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11011, 0, 0), name="CO"),
    "symmetric": Top.from_constants("A=158099 B=9198.9 C=9198.9 MHz", dipole_abc_debye=(3.92, 0, 0), name="CH3CN"),
    "asymmetric": Top.from_constants("A=60778 B=10318 C=8799 MHz", dipole_abc_debye=(0, 1.63, 0), name="SO2"),
}


@pytest.mark.parametrize("kind", TOPS)
def test_written_and_read_again(tmp_path: Path, kind: str) -> None:
    lines = line_list(TOPS[kind], temperature_k=300.0, jmax=12, min_lgint=-9)
    path = tmp_path / "made.states"
    write(lines, path)
    states = read_states(path)
    (species,) = exomol_species(path, states)
    exact = species_from_lines(lines)
    order, same = (np.lexsort((each.energy_lower_k.round(4), each.frequency_mhz.round(0))) for each in (species, exact))
    step_mhz = 0.5e-6 * 2 * 29979.2458  # two energies of six decimals in 1/cm
    assert np.abs(species.frequency_mhz[order] - exact.frequency_mhz[same]).max() < 1.01 * step_mhz
    assert np.allclose(
        species.einstein_a_per_s[order], exact.einstein_a_per_s[same], rtol=1e-4
    )  # five digits in the file
    assert np.allclose(species.energy_lower_k[order], exact.energy_lower_k[same], atol=1e-6)
    assert np.array_equal(species.g_upper[order], exact.g_upper[same])
    for kelvin in (20.0, 150.0, 300.0):
        assert species.partition.at(kelvin) == pytest.approx(exact.partition.at(kelvin), rel=1e-4)
    assert states.label[0].split()[0] == "0"
    assert (tmp_path / "made.states.provenance.json").exists()


def test_wavenumbers_of_the_fourth_column(tmp_path: Path) -> None:
    lines = line_list(TOPS["linear"], temperature_k=300.0, jmax=3, min_lgint=-9)
    write(lines, tmp_path / "co.states")
    rows = [line.split() for line in (tmp_path / "co.trans").read_text().splitlines()]
    assert [float(row[3]) for row in rows] == pytest.approx((lines.frequency_mhz / 29979.2458).tolist(), abs=5e-7)
    assert [(int(row[0]), int(row[1])) for row in rows] == [(2, 1), (3, 2), (4, 3)]


def test_lines_split_by_spins_are_refused(tmp_path: Path) -> None:
    top = read("HCN")
    lines = line_list(top, temperature_k=300.0, jmax=2, min_lgint=-9, effects=effects_of(top, True))
    assert "n" in lines.levels.quanta
    with pytest.raises(ValueError, match="split by spins"):
        write(lines, tmp_path / "hcn.states")
    assert not list(tmp_path.iterdir())
