"""Errors of predicted lines are made for all parameters and blocks together: work counted in calls of functions, which no load changes."""

from __future__ import annotations

import cProfile
import pstats
from dataclasses import replace

import numpy as np
import pytest
from places import ORACLES

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.estimates.derivatives import level_derivatives

KINDS = ORACLES / "kinds"
SPAN = 6  # F above FBGN


def _files(name: str, span: int = SPAN):
    folder = KINDS / name if (KINDS / name).is_dir() else KINDS.parent / name
    par, request = read_par(folder / f"{name}.var"), read_int(folder / f"{name}.int")
    first = request.request.fbgn
    return par, replace(request, request=replace(request.request, fend=min(request.request.fend, first + span)))


def _calls(par, request) -> int:
    profile = cProfile.Profile()
    profile.enable()
    assert predict(par, request).notes is not None  # made when they are read
    profile.disable()
    return int(pstats.Stats(profile).total_calls)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["fso3", "oc33s", "h2coh", "patterns_of_i_tot", "ch3cn_quad", "euler_series"])
def test_errors_cost_no_more_calls_than_the_prediction_does(name: str):
    """Calls with errors over those without: 2.5, 1.7, 3.9, 3.3 and 1.7 where derivatives were made block by block; 2.3 for series where
    each operator was made for the levels and again for their derivatives."""
    par, request = _files(name)
    held = replace(par, parameters=tuple(replace(p, error=1e-37) for p in par.parameters), rest="")
    par = replace(par, parameters=tuple(replace(p, error=max(p.error, abs(p.value) * 1e-4)) for p in par.parameters))
    for file in (held, par):  # what is made once for a process is there
        predict(file, request)
    assert _calls(par, request) < 2.0 * _calls(held, request)


def test_functions_beyond_knmax_are_left_out_before_they_become_blocks(monkeypatch):
    """CH3CN with ¹⁴N to F = 30, K to 3 of 31: 4 functions an N; all became blocks, and most of these were discarded."""
    from rotor.quantum.spins import rotor

    made = []
    original = rotor._axial_blocks

    def counted(v, n, k, energies_mhz):
        made.append(k)
        return original(v, n, k, energies_mhz)

    monkeypatch.setattr(rotor, "_axial_blocks", counted)
    par, request = _files("ch3cn_quad", span=30)
    par = replace(par, options=tuple(replace(option, knmax=3) for option in par.options))
    (group,) = connected_groups(par, request)
    levels = group.levels((0, 60))
    assert set(made[-1].tolist()) == set(levels.quanta["k"].tolist()) == {0, 1, 2, 3}


def test_an_axial_top_with_spins_is_solved_in_whole_arrays():
    """CH3CN with ¹⁴N to F = 30, in calls of functions a level: 34; 146 where every block was solved by itself."""
    par, request = _files("ch3cn_quad", span=30)
    group = connected_groups(par, request)[0]
    group.levels((0, 60))
    profile = cProfile.Profile()
    profile.enable()
    levels = group.levels((0, 60))
    profile.disable()
    assert pstats.Stats(profile).total_calls < 45 * len(levels)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "name",
    [
        "fso3",
        "o2",
        "oc33s",
        "eighteen_states",
        "methyl_i_tot",
        "l_doubled_quad",
        "phase_with_spins",
        "ch3cn_quad",
        "h2coh",
        "weights_of_states_i_tot",
    ],
)
def test_derivatives_are_differences(name: str):
    """∂E/∂c of every parameter beside central differences of solved levels, for each way that a file is solved."""
    par, request = _files(name)
    for group in connected_groups(par, request):
        twice_f = (2 * SPAN + sum(group.spins) % 2,) * 2
        levels, names = group.levels(twice_f), tuple(group.effect.parameters(group.top))
        slopes = level_derivatives(group.top, levels, names)
        values = group.effect.parameters(group.top)
        for column in np.linspace(0, len(names) - 1, min(len(names), 6)).astype(int).tolist():
            name_of, size = names[column], np.abs(slopes[:, column]).max()
            if not size:
                continue
            step = min(1e-3 * abs(values[name_of]), 1.0 / size)  # levels move by 1 MHz
            both = []
            for sign in (1, -1):
                shifted = group.effect.values | {name_of: values[name_of] + sign * step}
                moved = replace(group, effect=replace(group.effect, values=shifted))
                both.append(np.sort(moved.levels(twice_f).energy_mhz))
            difference = (both[0] - both[1]) / (2 * step)
            order = np.argsort(levels.energy_mhz, kind="stable")
            gaps = np.diff(levels.energy_mhz[order])
            alone = np.concatenate([[True], gaps > 100]) & np.concatenate(
                [gaps > 100, [True]]
            )  # MHz: they do not cross
            if alone.any():
                expected = slopes[order, column][alone]
                # second order: (1 MHz)^2/100 MHz; round-off of energies of 1e7 MHz
                assert difference[alone] == pytest.approx(expected, abs=0.02 * size + 1e-8 / step)


def test_an_operator_of_a_series_is_evaluated_for_all_n_together(monkeypatch):
    """Once for levels, once for their derivatives; the derivatives made it again for each N, and took 2.3 times the prediction."""
    from rotor.quantum.basis.wang_functions import BetweenStates

    made = []
    original = BetweenStates.elements

    def counted(self, operator, factors):
        made.append(operator)
        return original(self, operator, factors)

    monkeypatch.setattr(BetweenStates, "elements", counted)
    par, request = _files("euler_series")
    counts = []
    for error in (1e-37, 1e-3):
        made.clear()
        predict(replace(par, parameters=tuple(replace(p, error=error) for p in par.parameters), rest=""), request)
        counts.append(len(made))
    assert counts == [2, 2 + 2 * 7]  # the sum of the terms in each of two states; then each of the seven terms
