"""Accuracy goals and sweeps of a request, as its verb declares them: knobs of its fields, and `rotor.requests.numerics.Numerics`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rotor.requests.fill import Entries
from rotor.requests.knob import Sweeps, knobs_of_fields
from rotor.requests.numerics import Numerics
from rotor.verbs.verb import Work, verb_of


def numerics_of(kind: str) -> Numerics:
    """The numerics of a kind of scene."""
    numerics: Numerics = verb_of(kind).load_numerics()
    return numerics


def answering(kind: str) -> Callable[[Any], Any]:
    """Function that answers a request of a kind, with default display options."""
    verb = verb_of(kind)
    work = Work(shown=verb.read_shown(Entries()))
    return lambda request: verb.answer(request, work)


def sweeps_of(kind: str, request: Any) -> Sweeps:
    """All sweeps of a request: knobs of its fields first, then further sweeps of its verb."""
    answer = answering(kind)
    declared = [knob.sweep(field, request, answer) for field, knob in knobs_of_fields(request)]
    further = numerics_of(kind).sweeps(request)
    return Sweeps((*declared, *further.knobs), further.remarks)
