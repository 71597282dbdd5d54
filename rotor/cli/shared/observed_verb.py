"""`rotor emission` with the options of an observed spectrum: with --over or --fit they take the place of the plain course."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, fields, replace
from typing import Any, get_type_hints

import typer

from rotor.cli.shared.observed_emission import EmissionInputs, ObservedOptions, run_observed
from rotor.cli.shared.observed_options import SpectrumOptions
from rotor.cli.shared.options import name_of, value_of
from rotor.cli.shared.runner import asked_files, run_verb
from rotor.requests.fill import Given
from rotor.requests.readers import INFINITE
from rotor.verbs import emission
from rotor.verbs.verb import Extra, Verb

PANEL = "Observed spectrum"
GROUPS: tuple[type, ...] = (ObservedOptions, SpectrumOptions)


def _extra(one: Field[Any]) -> Extra:
    parameter = one.metadata["parameter"]
    return Extra(name_of(one), parameter.metavar or "", (parameter.help or "").rstrip("."), panel=PANEL)


VERB = replace(
    emission.VERB,
    extras=tuple(_extra(one) for group in GROUPS for one in fields(group)),
    examples=emission.EXAMPLES_OBSERVED,
)


def run(verb: Verb, context: typer.Context, typed: Mapping[str, Any]) -> None:
    """The verb, over or fitted to a spectrum where one is given."""
    observed, spectrum = (_group(one, typed) for one in GROUPS)
    if observed.file is None:
        run_verb(verb, context, typed)
        return
    if "save_scene" in typed:
        raise ValueError("--save-scene: an observed spectrum is no part of a scene; expected without --over and --fit")
    run_observed(context, _requested(verb, typed), observed, spectrum, asked_files(verb, typed))


def _group(group: Any, typed: Mapping[str, Any]) -> Any:
    """A group of options from what was typed."""
    types = get_type_hints(group)
    given = [one for one in fields(group) if name_of(one) in typed]
    return group(**{one.name: value_of(one, types[one.name], typed[name_of(one)]) for one in given})


def _requested(verb: Verb, typed: Mapping[str, Any]) -> EmissionInputs:
    """What was typed of the source; a fit estimates the rest."""
    given = Given(typed, "option")
    window = [
        verb.fields[name].read(given.values.get(name), "option") for name in ("conditions.range", "conditions.band")
    ]
    if all(window):
        raise ValueError("--range and --band: give one of them")
    range_mhz = next((one for one in window if one is not None and one != INFINITE), None)
    names = {
        "column": "column_per_cm2",
        "excitation": "conditions.excitation",
        "velocity": "conditions.velocity",
        "width": "conditions.width",
    }
    if not typed.get("names"):
        raise ValueError("SOURCE: expected one molecule or several, such as 'rotor emission CO HCN --band ALMA3'")
    redshift = verb.fields["conditions.redshift"].read(typed.get("conditions.redshift"), "option")
    return EmissionInputs(
        sources=typed["names"],
        background=typed.get("conditions.background", "2.725"),
        redshift=redshift or 0.0,
        range_mhz=range_mhz,
        partition=typed.get("partition"),
        **{name: typed.get(identity) for name, identity in names.items()},
    )
