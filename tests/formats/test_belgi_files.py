"""Output of BELGI: its constants as a top, and its list of levels."""

import numpy as np
import pytest

import rotor
from rotor.formats.internal_rotation.belgi import read_belgi_levels

CM = rotor.units.MHZ_PER_CM
# constants and levels of wes648/Westerfit.jl @cd9d2e6, test/belgi (V3 = 200 cm-1), its layout
OUTPUT = """  THIS OUTPUT IS FROM BELGI38
   CONSTANTS IN CM-1 OR IN MHZ?  :DA
CM-1
 &CSTE
 OA      =  0.100069228559446     ,
 B       =  5.003461427972281E-002,
 C       =  3.335640951981520E-002,
 DJ      =  0.000000000000000E+000,
 F       =   5.10000000000000     ,
 RHO     =  0.000000000000000E+000,
 V3      =   200.000000000000     ,
 V6      =  0.000000000000000E+000,
 RHORHO  =  5.000000000000000E-002
 /
  N=            1 ISIG=            0

 TYPE A

 VT=   0 K=   0 E=    44.8127144584 CM-1  N=   1  PAR= +
 VT=   0 K=   1 E=    44.8632546651 CM-1  N=   1  PAR= +
 VT=   0 K=   1 E=    44.8799280308 CM-1  N=   1  PAR= -
  N=            1 ISIG=            1

 TYPE E

 VT=   0 K=   0 E=    44.9513233592 CM-1  N=   1  PURITY=
 VT=   0 K=   1 E=    44.9975998972 CM-1  N=   1  PURITY=
 VT=   0 K=  -1 E=    45.0212911669 CM-1  N=   1  PURITY=
"""


@pytest.fixture
def output(tmp_path):
    """An output of BELGI."""
    path = tmp_path / "fort.out"
    path.write_text(OUTPUT)
    return path


def test_the_constants_of_an_output_give_the_levels_that_it_lists(output):
    top = rotor.read(output)
    listed = read_belgi_levels(output)
    assert listed.k.tolist() == [0, 1, 1, 0, 1, -1]
    levels = rotor.api.solve_levels(top, 1)
    for species, name in enumerate("AE"):
        ours = levels.energy_mhz[
            (levels.quanta["species"] == name) & (levels.quanta["j"] == 1) & (levels.quanta["vt"] == 0)
        ]
        theirs = listed.energy_cm[listed.species == species] * CM
        assert np.abs(np.sort(ours) - np.sort(theirs)).max() < 1e-5  # MHz: ten decimals of cm-1 are 3e-6


def test_an_output_serves_wherever_a_molecule_is_named(output, call):
    code, out, error = call("levels", str(output), "--jmax", "1")
    assert code == 0, error
    assert "species" in out


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("DJ      =  0.0", "DJ      =  1.0", "DJ: rotor reads OA"),
        (" RHORHO  =  5.000000000000000E-002\n", "", "RHORHO missing"),
    ],
)
def test_terms_that_are_not_read_are_named(output, old, new, text):
    output.write_text(OUTPUT.replace(old, new))
    with pytest.raises(ValueError, match=text):
        rotor.read(output)


def test_a_file_without_levels_is_refused(tmp_path):
    path = tmp_path / "empty.txt"
    path.write_text("BELGI\n")
    with pytest.raises(ValueError, match="no levels"):
        read_belgi_levels(path)
