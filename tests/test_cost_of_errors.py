"""Errors of predicted lines are made for all parameters and blocks together: work counted in calls of functions, which no load changes."""

from __future__ import annotations

import cProfile
import pstats
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rotor.formats.spcat.file_model import groups_of
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.estimates.derivatives import level_derivatives

KINDS = Path(__file__).parent / "oracles" / "kinds"
SPAN = 6  # F above FBGN


def _files(name: str):
    par, asked = read_par(KINDS / name / f"{name}.var"), read_int(KINDS / name / f"{name}.int")
    first = asked.request.fbgn
    return par, replace(asked, request=replace(asked.request, fend=min(asked.request.fend, first + SPAN)))


def _calls(par, asked) -> int:
    profile = cProfile.Profile()
    profile.enable()
    predict(par, asked)
    profile.disable()
    return int(pstats.Stats(profile).total_calls)  # type: ignore[attr-defined]


@pytest.mark.parametrize(("name", "most"), [("fso3", 3.5), ("oc33s", 2.2), ("h2coh", 5.0)])
def test_errors_cost_few_more_calls_than_the_prediction_does(name: str, most: float):
    """Calls with errors over those without. Each parameter had its own coefficients of coupling in every block before: 7.6, 2.5, 28."""
    par, asked = _files(name)
    held = replace(par, parameters=tuple(replace(p, error=1e-37) for p in par.parameters), rest="")
    for file in (held, par):  # what is made once for a process is there
        predict(file, asked)
    assert _calls(par, asked) < most * _calls(held, asked)


@pytest.mark.parametrize(
    "name", ["fso3", "o2", "oc33s", "eighteen_states", "methyl_i_tot", "l_doubled_quad", "phase_with_spins"]
)
def test_derivatives_are_differences(name: str):
    """∂E/∂c of every parameter beside central differences of solved levels, for each way that a file is solved."""
    par, asked = _files(name)
    for group in groups_of(par, asked):
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
                lines = tuple(
                    line._replace(value=line.value + sign * step) if line.name == name_of else line
                    for line in group.effect.lines
                )
                moved = replace(group, effect=replace(group.effect, lines=lines))
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
