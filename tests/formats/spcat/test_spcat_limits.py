"""Requests at the limits of SPCAT's files: no level in range, a state without levels, weights that no line joins."""

from __future__ import annotations

import numpy as np
import pytest

from rotor.formats.spcat.predict import Prediction, predict
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par

ABC = "10099 9400.0\n20099 3100.0\n30099 2500.0\n"


def _predicted(text: str, dipoles: str, fend: int) -> Prediction:
    options = [line for line in text.splitlines() if line[0].isalpha()]
    values = [f"{line} 0" for line in text.splitlines() if not line[0].isalpha()]
    par = read_par("\n".join(["limits", f"{len(values)} 1 1 0", *options, *values, ""]).encode())
    return predict(par, read_int(f"limits\n0 1 1000 0 {fend} -15 -15 99999 100\n{dipoles}".encode()), as_spcat=True)


@pytest.mark.parametrize(
    "options",
    ["a 1 1 5 8", "a 1 2 5 8", "a 3 1 5 8", "a 3 1 0 8 0 1 0 0"],
    ids=["KNMIN", "KNMIN of two states", "KNMIN with a spin", "weights"],
)
def test_a_range_without_levels_is_refused(options):
    values = ABC + ("110010000 -3.0\n" if " 3 " in options[:5] else "11 900.0\n" if " 2 " in options else "")
    with pytest.raises(ValueError, match="no level exists from FBGN = 0 to FEND = 3: N must reach KNMIN"):
        _predicted(f"{options}\n{values}", "1 1.0\n", 3)


def test_levels_without_a_weight_to_maxv_are_refused():
    """State 0 has no weights, and MAXV = 0 leaves out state 1."""
    par = f"limits\n4 1 1 0\na 1 -2 0 8 0 1 0 0 -1\na 1 1 0 8 0 1 1 1 0\n{ABC.replace(chr(10), ' 0' + chr(10))}11 900.0 0\n"
    for maxv, message in ((0, "no level has a weight from FBGN = 0 to FEND = 3, MAXV = 0"), (1, None)):
        request = read_int(f"limits\n0 1 1000 0 3 -15 -15 99999 100 {maxv}\n111 1.0\n".encode())
        if message:
            with pytest.raises(ValueError, match=message):
                predict(read_par(par.encode()), request, as_spcat=True)
        else:
            assert len(predict(read_par(par.encode()), request, as_spcat=True).catalogue) > 0


def test_half_integer_f_begins_at_one_half():
    with pytest.raises(ValueError, match="no level exists from FBGN = 0 to FEND = 0"):
        _predicted(f"a 2 1 0 8\n{ABC}10010000 0.1\n", "1 1.0\n", 0)


@pytest.mark.parametrize("options", ["a 1 2 5 8 0 1 1 1 0", "a 1 2 0 8 0 1 0 0 0"], ids=["KNMIN", "weights"])
def test_a_state_without_levels_leaves_the_other(options):
    """State 0 has none to J = 3; state 1, which nothing couples with it, is as if it were alone."""
    alone = _predicted(f"a 1 1 0 8\n{ABC}", "1 1.0\n", 3).catalogue
    computed = _predicted(f"{options}\na 1 -1 0 8 0 1 1 1 0\n".replace(" 0\na", " -1\na") + ABC, "1 1.0\n111 1.0\n", 3)
    assert set(computed.catalogue.quanta_upper[:, 3].tolist()) == {1}
    assert np.array_equal(computed.catalogue.frequency_mhz, alone.frequency_mhz)


@pytest.mark.parametrize("spin", ["", "110010000 -3.0\n"], ids=["without a spin", "with a spin"])
def test_levels_of_two_weights_have_no_lines(spin):
    """A half turn about a leaves μ_a alone: where Ka even and odd weigh 1 and 3, a μ_b joins no levels of one weight."""
    options = f"a {3 if spin else 1} 1 0 8 0 1 "
    both = [_predicted(f"{options}{weights}\n{ABC}{spin}", "1 1.0\n2 1.0\n", 3) for weights in ("1 3", "1 1")]
    along = _predicted(f"{options}1 3\n{ABC}{spin}", "1 1.0\n", 3)
    assert 0 < len(both[0].catalogue) < len(both[1].catalogue)
    assert np.array_equal(both[0].catalogue.frequency_mhz, along.catalogue.frequency_mhz)


def test_lines_of_states_apart_stand_in_order_of_frequency():
    """State 1, which nothing couples with state 0, has its lines a little above those of it."""
    values = ABC + "11 900.0\n10011 1.0\n20011 1.0\n30011 1.0\n"
    listed = _predicted(f"a 1 2 0 8\n{values}", "1 1.0\n111 1.0\n", 3).catalogue
    assert set(listed.quanta_upper[:, 3].tolist()) == {0, 1}
    assert listed.quanta_upper[0, 3] == 0
    assert (np.diff(listed.frequency_mhz) >= 0).all()
