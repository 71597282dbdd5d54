"""`dataclass` of frozen classes, made in a third of the time: a short command makes ninety of them before it begins.

`dataclasses.dataclass` compiles six functions for each frozen class. Here `__init__` alone is compiled; the other five are the same for
all classes. What they do is the same, as is what `fields`, `replace`, `asdict` and pickles see. Where a class extends another dataclass,
`dataclasses` compiles the two that refuse changes.
"""

from __future__ import annotations

import dataclasses
from dataclasses import MISSING, FrozenInstanceError
from operator import attrgetter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, **settings):
        """As `dataclasses.dataclass`."""
        if cls is None:
            return lambda cls: dataclass(cls, frozen=frozen, **settings)
        if not frozen or settings.keys() - {"eq", "repr", "kw_only"}:
            return dataclasses.dataclass(cls, frozen=frozen, **settings)
        return _frozen(cls, **settings)


def _frozen(cls: type, eq: bool = True, repr: bool = True, kw_only: bool = False) -> type:
    """A frozen dataclass; functions that the class defines itself remain."""
    extends = any(dataclasses.is_dataclass(base) for base in cls.__mro__[1:])
    made: Any = dataclasses.dataclass(init=False, eq=False, repr=False, frozen=extends, kw_only=kw_only)(cls)
    settings: Any = made.__dataclass_params__  # read when another dataclass extends this one
    settings.init, settings.eq, settings.repr, settings.frozen = True, eq, repr, True
    fields = dataclasses.fields(made)
    names = frozenset(field.name for field in fields)
    functions = {"__init__": _compiled_init(made, fields)} | ({} if extends else _frozen_attributes(made, names))
    if eq:
        functions |= _comparison(tuple(field.name for field in fields if field.compare))
    if repr:
        functions["__repr__"] = _text_function(tuple(field.name for field in fields if field.repr))
    for name, function in functions.items():
        if name not in cls.__dict__ or cls.__dict__[name] is None:
            function.__qualname__ = f"{cls.__qualname__}.{name}"
            setattr(made, name, function)
    return cls


def _compiled_init(cls: Any, fields: tuple[dataclasses.Field[Any], ...]) -> Any:
    """The compiled `__init__`, which calls `__post_init__` if the class has it."""
    known: dict[str, Any] = {"_ABSENT": MISSING}
    parameters: dict[bool, list[str]] = {False: [], True: []}
    lines = []
    for field in fields:
        name, has_factory = field.name, field.default_factory is not MISSING
        known |= {f"_default_{name}": field.default, f"_make_{name}": field.default_factory}
        value, made = name, f"_make_{name}()"
        if field.init:
            default = "_ABSENT" if has_factory else f"_default_{name}"
            optional = has_factory or field.default is not MISSING
            parameters[bool(field.kw_only)].append(f"{name}={default}" if optional else name)
            value = f"{made} if {name} is _ABSENT else {name}" if has_factory else name
        elif has_factory:
            value = made
        if field.init or has_factory:
            lines.append(f" _attributes[{name!r}] = {value}")
    named = ["*", *parameters[True]] if parameters[True] else []
    head = ", ".join(["_self", *parameters[False], *named])
    last = [" _self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    exec("\n".join([f"def __init__({head}):", " _attributes = _self.__dict__", *lines, *last]), known)
    known["__init__"].__annotations__ = {field.name: field.type for field in fields if field.init} | {"return": None}
    return known["__init__"]


def _frozen_attributes(cls: Any, names: frozenset[str]) -> dict[str, Any]:
    """Functions that refuse to set or delete an attribute."""

    def __setattr__(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": __setattr__, "__delattr__": __delattr__}


def _comparison(names: tuple[str, ...]) -> dict[str, Any]:
    """Equality of objects of one class by these fields, and their hash."""
    read: Any = attrgetter(*names) if names else lambda _: None
    values = read if len(names) > 1 else lambda self: (read(self),)

    def __eq__(self: Any, other: object) -> Any:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return values(self) == values(other)

    def __hash__(self: Any) -> int:
        return hash(values(self))

    return {"__eq__": __eq__, "__hash__": __hash__}


def _text_function(names: tuple[str, ...]) -> Any:
    """The text of an object: its class and these fields."""

    def __repr__(self: Any) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__
