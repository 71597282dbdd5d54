"""Frozen dataclasses made by `rotor.frozen` behave as those of the standard library."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import subprocess
import sys
from dataclasses import FrozenInstanceError, asdict, field, fields, replace
from functools import cached_property

import pytest

from rotor import frozen


def made(dataclass):
    """The same classes by one or the other decorator."""

    @dataclass(frozen=True)
    class Point:
        """A field of each kind; `values` and `self_` are names that a generated function may use itself."""

        x: float
        values: tuple[float, ...] = (1.0,)
        made: list[int] = field(default_factory=list)
        hidden: int = field(default=3, repr=False, compare=False)
        later: int = field(init=False, default=7)
        named: int = field(default=0, kw_only=True)

        def __post_init__(self) -> None:
            object.__setattr__(self, "later", self.later + 1)

        @cached_property
        def double(self) -> float:
            return 2 * self.x

    return Point


@dataclasses.dataclass(frozen=True)
class Extended(
    frozen.dataclass(frozen=True)(type("Base", (), {"__annotations__": {"a": "int"}, "__module__": __name__}))
):
    """A class of the standard library that extends one of ours."""

    b: int = 2


@frozen.dataclass(frozen=True)
class Stored:
    """A class that pickles find."""

    a: int
    b: tuple[int, ...] = ()


@pytest.fixture(params=[dataclasses.dataclass, frozen.dataclass], ids=["standard", "ours"])
def point(request):
    return made(request.param)


def test_fields_are_set_and_read(point):
    one, other = point(1.5, named=4), point(1.5, named=4, hidden=9)
    assert (one.x, one.values, one.made, one.hidden, one.later, one.named, one.double) == (
        1.5,
        (1.0,),
        [],
        3,
        8,
        4,
        3.0,
    )
    assert point(1.0).made is not point(1.0).made
    assert one == other != point(2.0)
    assert repr(one) == "made.<locals>.Point(x=1.5, values=(1.0,), made=[], later=8, named=4)"
    assert [each.name for each in fields(point)] == ["x", "values", "made", "hidden", "later", "named"]
    assert asdict(one)["values"] == (1.0,)
    assert replace(one, x=3.0).x == 3.0
    assert copy.copy(one) == one
    if sys.version_info >= (3, 13):
        assert copy.replace(one, x=3.0) == replace(one, x=3.0)
    assert point.__match_args__ == ("x", "values", "made", "hidden")
    assert list(inspect.signature(point).parameters) == ["x", "values", "made", "hidden", "named"]


def test_nothing_can_be_changed(point):
    one = point(1.0)
    with pytest.raises(FrozenInstanceError):
        one.x = 2.0
    with pytest.raises(FrozenInstanceError):
        one.other = 2.0
    with pytest.raises(FrozenInstanceError):
        del one.x
    with pytest.raises(TypeError):
        point()
    with pytest.raises(TypeError):
        point(1.0, unknown=1)


def test_equal_objects_have_one_hash_and_pickle():
    assert len({Stored(1, (2,)), Stored(1, (2,)), Stored(2)}) == 2
    assert pickle.loads(pickle.dumps(Stored(1, (2,)))) == Stored(1, (2,))


def test_a_class_without_comparison_is_compared_by_identity():
    plain = frozen.dataclass(frozen=True, eq=False, repr=False)(type("Plain", (), {"__annotations__": {"a": "int"}}))
    assert plain(1) != plain(1)
    assert "object at" in repr(plain(1))


def test_functions_of_the_class_remain():
    @frozen.dataclass(frozen=True)
    class Named:
        a: int

        def __repr__(self) -> str:
            return "named"

        def __eq__(self, other: object) -> bool:
            return True

    assert repr(Named(1)) == "named"
    assert Named(1) == Named(2)
    assert isinstance(hash(Named(1)), int)


def test_a_standard_dataclass_extends_ours():
    extended = Extended(1)
    assert (extended.a, extended.b, extended == Extended(1, 2)) == (1, 2, True)
    with pytest.raises(FrozenInstanceError):
        extended.a = 3
    with pytest.raises(TypeError, match="non-frozen"):
        dataclasses.dataclass(type("Loose", (Stored,), {"__annotations__": {"c": "int"}, "c": 1}))


def test_ours_extends_ours_and_one_of_the_standard_library():
    for base in (frozen.dataclass, dataclasses.dataclass):
        below = base(frozen=True)(type("Below", (), {"__annotations__": {"a": "int"}, "__module__": __name__}))
        above = frozen.dataclass(frozen=True)(
            type("Above", (below,), {"__annotations__": {"b": "int"}, "b": 2, "__module__": __name__})
        )
        extended = above(1)
        assert (extended.a, extended.b, extended == above(1, 2), extended != above(1, 3)) == (1, 2, True, True)
        assert (repr(extended), hash(extended)) == ("Above(a=1, b=2)", hash(above(1)))
        for name in ("a", "b", "c"):
            with pytest.raises(FrozenInstanceError):
                setattr(extended, name, 3)
    with pytest.raises(TypeError, match="non-frozen"):
        frozen.dataclass(frozen=True)(
            type("Strict", (dataclasses.dataclass(type("Loose", (), {"__annotations__": {"a": "int"}})),), {})
        )


def test_annotations_may_be_types_and_names_that_follow_later():
    """Without `from __future__ import annotations`; Python 3.14 evaluates annotations only when they are read."""
    later = "Later" if sys.version_info >= (3, 14) else "'Later'"
    source = f"@dataclass(frozen=True)\nclass Early:\n    a: int\n    b: {later} = 2\n"
    names = {"dataclass": frozen.dataclass, "__name__": __name__}
    exec(compile(source, "early", "exec", dont_inherit=True), names)
    early = names["Early"](1)
    assert (early, fields(early)[0].type) == (names["Early"](1, b=2), int)
    assert repr(early) == "Early(a=1, b=2)"


def test_a_class_takes_less_time_than_one_of_the_standard_library():
    """Half of the processor time at the most, of 60 classes of six fields, best of five."""
    code = """
import dataclasses, time
from rotor import frozen
def seconds(dataclass):
    start = time.process_time()
    for k in range(60):
        names = {f"a{i}": "float" for i in range(6)}
        dataclass(frozen=True)(type(f"C{k}", (), {"__annotations__": names, "__doc__": "A class."}))
    return time.process_time() - start
print(min(seconds(frozen.dataclass) for _ in range(5)) / min(seconds(dataclasses.dataclass) for _ in range(5)))
"""
    ratio = float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
    assert ratio < (0.5 if sys.version_info < (3, 13) else 1.2)
