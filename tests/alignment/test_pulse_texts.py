"""Pulses as text: the numbers of the command line serve in Python too."""

from __future__ import annotations

import re

import pytest

import rotor
from rotor.alignment.pulse import PULSES, GaussianPulse, Kick
from rotor.verbs.align import read_pulses


@pytest.mark.parametrize(
    ("text", "option"),
    [
        ("1e13 W/cm2, 1 ps", "--pulse"),
        ("3e13 W/cm2, 50 fs, 8.38 ps", "--pulse"),
        ("switched 1e12 W/cm2, 1, 20, 1", "--switched"),
        ("kick 0.5 J/cm2, 2", "--kick"),
        ("thz 100 kV/cm, 1 ps, 0.3 THz", "--thz"),
    ],
)
def test_a_text_of_numbers_is_the_pulse_of_the_option(text, option):
    numbers = text if option == "--pulse" else text.partition(" ")[2]
    assert PULSES.read(text) == read_pulses({option: [numbers]})["pulses"]


def test_the_function_takes_a_text_or_a_list_of_both_forms():
    trace = rotor.align("OCS", pulses="1e13 W/cm2, 1 ps", temperature_k=0, until_ps=4).request
    assert trace.pulses == (GaussianPulse(1e13, 1.0),)
    both = ["kick fluence=0.5J/cm2", "1e13 W/cm2, 1 ps"]
    assert rotor.align("OCS", pulses=both, temperature_k=0, until_ps=4).request.pulses == (
        Kick(0.5), GaussianPulse(1e13, 1.0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1e13 W/cm2", "expected 2 to 3 numbers with commas between: peak (W/cm2), fwhm (ps), centre (ps); found 1"),
        ("1e13 W/m, 1 ps", "peak: '1e13 W/m': unit"),
        ("gausian 1e13, 1", "no shape is named 'gausian 1e13, 1'; the nearest is 'gaussian'"),
    ],
)
def test_a_wrong_text_is_named(text, reason):
    with pytest.raises(ValueError, match=re.escape(reason)):
        rotor.align("OCS", pulses=text)
