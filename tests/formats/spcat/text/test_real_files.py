"""Files as people have them: zeros behind the quantum numbers, J above 99, texts behind the parameters, held parameters, wrong lines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

from rotor.fitting.fit import fit_lines
from rotor.formats.spcat.fits.fit_input import fitted_file, read_fit, spfit_input
from rotor.formats.spcat.fits.fit_states import FileLevels, left_at_zero, stay_at_zero
from rotor.formats.spcat.solved_groups import variance_factor
from rotor.formats.spcat.text.lin import line_list, read_lin
from rotor.formats.spcat.text.par import format_par, read_par

GS = ORACLES / "kinds" / "cyanomethcycloprop"  # its README says from where
FREE = ("B_gs", "C_gs", "-DJ_gs", "-DJK_gs", "-dJ_gs")
TEXT = "!\n! put aside\n20000406  0.0 1E-37 /Ga\n"


def with_free(file, names, errtst):
    """The file with these parameters free and all others held."""
    parameters = tuple(p if p.label in names else replace(p, error=1e-37) for p in file.parameters)
    return replace(file, parameters=parameters, header=replace(file.header, errtst=errtst))


def fitted(file, lines):
    fit_input = spfit_input(file, lines)
    return fit_input, fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )


@pytest.fixture(scope="module")
def gs():
    file = with_free(read_par(GS / "gs.par"), FREE, 20.0)
    return file, *fitted(file, read_lin(GS / "gs.lin", 4))


def test_wrong_lines_of_a_published_list_stay_out_and_the_constants_are_those_of_spfit(gs):
    """96 lines in 76 frequencies, 20 of them wrong: together they lead nowhere, and SPFIT leaves the wrong ones out at the start.

    SPFIT (H. M. Pickett's public C source, gcc -O2) on the same files: RMS ERROR 0.74898, 20 lines rejected, and these constants.
    """
    theirs = {
        "B_gs": (2.566799272370336e03, 7.72006248e-03), "C_gs": (2.132052022281615e03, 3.39305653e-04),
        "-DJ_gs": (-1.244499430856368e-03, 7.06289045e-06), "-DJK_gs": (7.793312508919792e-03, 2.11549002e-04),
        "-dJ_gs": (-3.354649754210488e-04, 3.53771171e-06),
    }  # fmt: skip
    _, _, fit = gs
    assert fit.converged, fit.reason
    assert fit.weighted_rms == pytest.approx(0.74898, abs=6e-6)  # digits printed
    assert len(set(fit.lines.blend.tolist())) - len({fit.lines.blend[i] for i in fit.left_out}) == 56
    for name, value, error in zip(fit.parameters.names, fit.values, fit.errors, strict=True):
        assert value == pytest.approx(theirs[name][0], abs=1e-4 * error)  # where SPFIT ends; 1e-7 of an error was found
        assert error == pytest.approx(theirs[name][1], rel=1e-6)  # digits of the .var


def test_without_a_limit_the_wrong_lines_count_and_the_fit_says_that_it_failed():
    file = with_free(read_par(GS / "gs.par"), FREE, 1e6)
    _, fit = fitted(file, read_lin(GS / "gs.lin", 4))
    assert not fit.converged
    assert not fit.left_out


def test_zeros_behind_the_quantum_numbers_and_three_digits_of_j(gs):
    _, fit_input, _ = gs
    assert fit_input.lines.names == ("j", "ka", "kc", "v")
    assert [100, 1, 100, 0] in fit_input.lines.upper.tolist()
    assert [100, 0, 100, 0] in fit_input.lines.lower.tolist()
    plain = line_list(fit_input.lines.upper, fit_input.lines.lower, fit_input.lines.frequency_mhz, 0.05)
    again = spfit_input(gs[0], plain).lines
    assert (again.upper == fit_input.lines.upper).all()
    assert (again.blend == fit_input.lines.blend).all()


def test_numbers_behind_the_quantum_numbers_that_are_no_zeros_are_an_error(tmp_path: Path):
    text = (GS / "gs.lin").read_bytes().replace(b"  0  0  0  0   ", b"  0  0  0  7   ", 1)
    (tmp_path / "gs.lin").write_bytes(text)
    (tmp_path / "gs.par").write_bytes((GS / "gs.par").read_bytes())
    with pytest.raises(ValueError, match="line 1 has 6 quantum numbers"):
        read_fit(tmp_path / "gs.par")


def test_a_line_without_digits_ends_the_parameters(gs):
    """NPAR = 900, and `!` behind 25 parameters: SPFIT reads up to there. What is written says 25, and can be read again."""
    whole = read_par(GS / "gs.par")
    assert whole.rest.startswith("!\n!   S-reduction backup")
    many = read_par(format_par(whole).replace(b"  25  878", b" 900  878", 1))
    assert many.parameters == whole.parameters
    assert many.header.npar == 900
    _, fit = fitted(with_free(many, FREE, 20.0), read_lin(GS / "gs.lin", 4))
    fit_input = replace(gs[1], file=with_free(many, FREE, 20.0))
    for variances in (True, False):
        again = read_par(format_par(fitted_file(fit_input, fit, variances=variances)))
        assert again.header.npar == len(again.parameters) == 25


def test_a_text_behind_the_parameters_is_no_table_of_correlations(gs):
    held = replace(gs[0], rest=TEXT)
    factor = variance_factor(held)
    assert factor is not None
    assert np.count_nonzero(factor) == len(FREE)  # as without correlations: the errors alone
    fewer = replace(held, header=replace(held.header, npar=900), rest=" 1.0000000 0.5000000 1.0000000\n")
    assert np.array_equal(variance_factor(fewer), factor)  # as SPCAT: none is read where fewer than NPAR stand there


def test_the_correlations_of_a_var_file_are_of_all_parameters_held_ones_too(gs):
    """SPCAT reads as many as there are parameters without a minus sign, and takes none where fewer stand there."""
    file, fit_input, fit = gs
    written = fitted_file(fit_input, fit, variances=True)
    count = len(file.parameters)
    assert len(written.rest.replace("\n", "")) == 10 * count * (count + 1) // 2
    factor = variance_factor(read_par(format_par(written)))
    free = [i for i, p in enumerate(file.parameters) if p.label in FREE]
    covariance = (factor @ factor.T)[np.ix_(free, free)]
    assert np.allclose(covariance, fit.statistics.covariance, rtol=3e-5)  # seven digits of correlations of 0.99


TWO = """two states
 13 1 10 0 0 1E6 1 1
a 1 2 0 60
 10000 7800. 1E+36 /A0
 20000 2560. 1E+36 /B0
 30000 2130. 1E+36 /C0
 10011 7850. 1E+36 /A1
 20011 2566. 1E+36 /B1
 30011 2137. 1E+36 /C1
 11 229000. 1E-37 /E1
 1 {w} 1E-37 /W
 200001 0.0 1E+00 /Ga
 400001 0.0 1E+00 /Gb
 610001 0.0 {held} /Fab
 10001 0.0 1E+00 /WK
 610000 0.0 1E+00 /Dab
"""


@pytest.mark.parametrize(
    ("w", "left"),
    [("160000.", {"Ga", "Gb", "Fab", "Dab"}), ("0.0", {"W", "Ga", "Gb", "Fab", "WK", "Dab"})],
    ids=["states joined by W", "states apart"],
)
def test_parameters_at_zero_that_move_no_level_to_first_order_stay_out(w: str, left: set[str]):
    """Their derivatives, with each of them in the Hamiltonian at 1e-7 MHz: those that stay out have none, the others have one."""
    file = read_par(TWO.format(w=w, held="1E-37").encode())
    assert {file.parameters[i].label for i in left_at_zero(file)} == left
    labels = np.array([[j, ka, j - ka, v] for j in (8, 20) for ka in (0, 2, 5) for v in (0, 1)])
    small = replace(file, parameters=tuple(replace(p, value=p.value or 1e-7, error=1.0) for p in file.parameters))
    model = FileLevels.from_labels(small, labels)
    _, slopes = model.levels(np.array([p.value for p in small.parameters]))
    for i, parameter in enumerate(file.parameters):
        if parameter.value == 0:
            largest = np.abs(slopes[:, i]).max()
            assert (largest < 1e-3) == (parameter.label in left), parameter.label  # second order: 1e-7 N^2 over 1 MHz
    assert not left_at_zero(small)
    free = read_par(TWO.format(w=w, held="1E+00").encode())
    assert set(stay_at_zero(free)) == left - {"W"}  # W is held


def test_what_two_couplings_join_a_parameter_at_zero_may_move():
    """G_a and G_b lead from one state to the other and back by a product of the symmetry of N_a N_b + N_b N_a: D_ab acts, F_ab does not."""
    text = TWO.format(w="0.0", held="1E-37").replace("200001 0.0", "200001 30.").replace("400001 0.0", "400001 20.")
    file = read_par(text.encode())
    assert {file.parameters[i].label for i in left_at_zero(file)} == {"W", "Fab", "WK"}
