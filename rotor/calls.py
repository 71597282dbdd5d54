"""Verbs as functions: `rotor.spectrum("water", temperature_k=100)`. Keyword arguments are the fields of the verb's declaration.

A value is a number in the unit of the field, or a text with a unit ("100 K"). A call returns a `Result`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from inspect import Parameter, Signature
from pathlib import Path
from typing import Any

from rotor.checks import did_you_mean
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import REQUIRED
from rotor.requests.fill import Entries
from rotor.requests.readers import Field
from rotor.verbs.common.calculation import Calculation, Outcome
from rotor.verbs.common.verb import Verb, Work, verb_of

EXAMPLES = {
    "spectrum": (
        'rotor.spectrum("CO", temperature_k="20 K", jmax=5).table.frequency_mhz[:1].round(3).tolist()', "[115271.202]",
    ),
    "levels": ('rotor.levels(constants="A=10 B=6 C=4 MHz", jmax=1).table.energy_mhz[1:].tolist()', "[10.0, 16.0, 14.0]"),
    "raman": ('len(rotor.raman("N2", jmax=4).table)', "6"),
    "thermo": ('rotor.thermo("CO", temperatures_k="300 K").table.columns["q_rot"].round(2).tolist()', "[108.87]"),
    "stark": (
        'rotor.stark("OCS", fields_kv_per_cm="0:10kV/cm:3", j_highest=0).table.energy_mhz.round(1).tolist()',
        "[0.0, -88.4, -348.0]",
    ),
    "zeeman": ('len(rotor.zeeman("OCS", g=[-0.0288], fields_tesla="0,1T", j_highest=1).table)', "8"),
    "emission": (
        'rotor.emission(["CO"], column_per_cm2="1e16", excitation_k="20 K", range_mhz="115:116GHz").table.names', "('carbon monoxide',)",
    ),
    "assign": ("rotor.assign([[7000.0, 1.0], [9000.0, 2.0]]).word", "'not found'"),
    "torsion": (
        'rotor.torsion("C2H6", bond="1-2", potential="V3=1013 cm-1", vmax=0).table.energy_cm.round(2).tolist()', "[150.15, 150.15]",
    ),
    "info": ('rotor.info("CO").facts()["kind"]', "'linear'"),
    "isotopologues": (
        'rotor.isotopologues("CO", min_abundance=1e-3).table.columns["label"].tolist()', "['CO', '[13C]O (1=13C)', 'C[18O] (2=18O)']",
    ),
    "structure": (
        'rotor.structure(rotor.api.family(rotor.Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.13]]), [("CO", "", {"B": 57635.968}, {})]), '
        'methods="r0").table.columns["value"].round(4).tolist()', "[1.1309]",
    ),
    "fit": (
        'rotor.fit([(1, 0, 20.0, 0.1), (2, 1, 40.0, 0.1)], constants="B=9 MHz", free="B").parameters.value_mhz.round(6).tolist()', "[10.0]",
    ),
    "tumble": (
        'rotor.tumble(moments="1,2,3", angular_velocity="0,1,0", times="0:1:2").motion_kind', "'steady'",
    ),
    "align": (
        'rotor.align("OCS", pulses="kick fluence=0.5J/cm2", temperature_k=1, points=3).table.columns["cos2theta"][:1].round(4).tolist()',
        "[0.3333]",
    ),
    "fluid": (
        'rotor.fluid("water", molecules=27, steps=2, every=1, equilibration=0, cutoff_angstrom=4).table.columns["time_ps"].tolist()',
        "[0.0, 0.002, 0.004]",
    ),
    "gas": ('rotor.gas("CO", molecules=100, seed=1).request.molecules', "100"),
}  # fmt: skip  # an example of each function and its value; a test evaluates them


class _Notes(list[str]):
    """Remarks of a calculation, in the order in which it makes them."""

    def __call__(self, text: str) -> None:
        self.append(text)


class Result(Outcome):
    """Result of a verb: tables, errors, pictures and files. Attributes of the answer are also attributes of the result."""

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of the main observable.

        Raises AttributeError for verbs from outside the package that state none.
        """
        budget = getattr(self.answer, "errors", None)
        if not isinstance(budget, ErrorBudget):
            raise AttributeError(f"{self.verb.name}: states no error budget; facts() has the errors that are known")
        return budget

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks that the command prints as `note:`, such as what was estimated."""
        made = self.calculation.work.note
        return tuple(dict.fromkeys([*(made if isinstance(made, _Notes) else ()), *self.verb.notes(self.answer)]))

    def facts(self) -> Mapping[str, Any]:
        """All content except the table, by the keys of the JSON."""
        return self.verb.facts(self.answer)

    def to_pandas(self) -> Any:
        """The table as a pandas DataFrame."""
        return self.table.to_pandas()

    def to_polars(self) -> Any:
        """The table as a polars DataFrame."""
        return self.table.to_polars()

    def plot(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Any:
        """Draw a matplotlib figure; with a path, the picture is also written."""
        from rotor.plots.show import plot

        return plot(self.answer, path, **options)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the table or picture in the format of the suffix.

        Raises ValueError for a suffix that the verb cannot write.
        """
        from rotor.formats.atomic_write import write_together

        target = Path(path)
        files = [output for output in self.verb.outputs if not output.grows or output.name == "csv"]
        outputs = [output for output in files if target.name.endswith(output.suffixes)]
        if not outputs:
            suffixes = ", ".join(dict.fromkeys(suffix for output in files for suffix in output.suffixes))
            raise ValueError(f"{target.name}: {self.verb.name} writes files that end in {suffixes}")
        write_together({target: self.writer(outputs[0])})

    def scene(self, folder: str | os.PathLike[str] = ".") -> Any:
        """The scene that repeats the calculation; `rotor.write_scene` writes it. folder: of the scene, for names of files."""
        from rotor.scenes.run import saved_scene

        return saved_scene(self, Path(folder), {})

    def plan(self) -> Any:
        """Method, cost and neglected effects, as `rotor plan` of a scene."""
        from rotor.scenes.plan import plan_of_calculation

        return plan_of_calculation(self.calculation)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.answer, name)

    def __repr__(self) -> str:
        return f"{self.verb.name} of {self.subject.text or 'no molecule'}: {self.table!r}"


def result_of(verb: Verb, values: Mapping[str, Any], executor: Any = None) -> Result:
    """Carry out a verb with values by the names of its fields.

    Raises TypeError for an unknown name, and ValueError for an invalid value.
    """
    declared = {field.name: field for field in verb.fields.values()}
    unknown = [name for name in values if name not in declared]
    if unknown:
        raise TypeError(f"{verb.name}(): no argument {unknown[0]!r}{_meant(unknown[0], declared)}")
    entries = Entries({declared[name].identity: value for name, value in values.items() if value is not None}, "name")
    work = Work(shown=verb.read_shown(entries), note=_Notes(), provenance={"command": f"rotor.{verb.name}"})
    outcome = Calculation(verb, entries, work).run(executor)
    return Result(**{field.name: getattr(outcome, field.name) for field in fields(Outcome)})


def _meant(unknown: str, declared: Mapping[str, Field]) -> str:
    """End of a message on an unknown argument: that of the option or scene key with this name, else similar names."""
    option, key = f"--{unknown.replace('_', '-')}", f".{unknown}"
    same = [name for name, field in declared.items() if field.called("option") == option]
    same = same or [name for name, field in declared.items() if field.called("key").endswith(key)]
    if same:
        return f"; did you mean {same[0]}?"
    return did_you_mean(unknown, declared) or f"; it takes {', '.join(declared)}"


@cache
def function_of(name: str) -> Callable[..., Result]:
    """The function of a verb; signature and docstring are made from the declaration."""
    verb = verb_of(name)
    names = {field.name for field in verb.fields.values()}
    first = next((name for name in ("source", "names") if name in names), "")

    def call(source: Any = None, *, executor: Any = None, **values: Any) -> Result:
        return result_of(verb, values if source is None else {first: source, **values}, executor)

    def call_without_source(*, executor: Any = None, **values: Any) -> Result:
        return result_of(verb, values, executor)

    function = call if first else call_without_source
    function.__name__ = function.__qualname__ = name
    function.__module__ = "rotor"
    function.__doc__ = documentation(verb)
    function.__signature__ = _signature(verb, first)  # type: ignore[attr-defined]
    return function


def _signature(verb: Verb, first: str) -> Signature:
    """The signature of the function, for completion in editors and for `help`."""
    fields = [field for field in _arguments(verb) if field.name != first]
    source = [Parameter(first, Parameter.POSITIONAL_OR_KEYWORD, default=None)] if first else []
    defaults = [Parameter.empty if field.default is REQUIRED else field.default for field in fields]
    named = [
        Parameter(field.name, Parameter.KEYWORD_ONLY, default=value)
        for field, value in zip(fields, defaults, strict=True)
    ]
    return Signature([*source, *named, Parameter("executor", Parameter.KEYWORD_ONLY, default=None)])


def _arguments(verb: Verb) -> list[Field]:
    """The fields that are arguments in Python, each name once."""
    fields = {field.name: field for field in reversed(verb.fields.values()) if field.name}
    return [
        field
        for field in verb.fields.values()
        if fields.get(field.name) is field and not _is_display_option(verb, field)
    ]


def documentation(verb: Verb) -> str:
    """The docstring of a verb's function, with its arguments and their units."""
    rows = "\n".join(_argument(field) for field in _arguments(verb))
    expression, value = EXAMPLES.get(verb.name, ("", ""))
    example = f"\n\nExamples\n--------\n>>> import rotor\n>>> {expression}\n{value}" if value else ""
    return (
        f"{verb.about}\n\nNumbers are in the unit of the argument; a text may carry another unit.\n\n"
        f"Parameters\n----------\n{rows}\nexecutor : concurrent.futures.Executor, optional\n    Shares the work.\n\n"
        f"Returns\n-------\nResult\n    Table, errors, notes, plot(), write(), to_pandas(), plan(), scene().{example}\n"
    )


def _is_display_option(verb: Verb, field: Field) -> bool:
    """Whether a field only affects what the command line prints."""
    from rotor.requests.field import all_fields

    return field.identity in all_fields(verb.shown) and not field.key


def _argument(field: Field) -> str:
    """Name, default and one line of help of an argument."""
    default = "" if field.default is None else f", default {field.default!r}"
    return f"{field.name} : optional{default}\n    {field.help}."
