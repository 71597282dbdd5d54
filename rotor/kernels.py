"""The compiler of the package's kernels, with a cache on disk that follows every file compiled into a kernel.

numba stores a compiled kernel under a stamp of the kernel's own file, although functions and constants of other files become part of
it (numba issue 1833). Here the stamp also covers the modules of the package that the file imports, directly or through others.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any, TypeVar, cast

from numba import njit
from numba.core import event

Function = TypeVar("Function", bound=Callable[..., Any])

PACKAGE = __name__.partition(".")[0]
IMPORT = re.compile(rf"^(?:from ({PACKAGE}[.\w]*) import (\([^)]*\)|.*)|import ({PACKAGE}[.\w]*))", re.MULTILINE)


class Compilations(event.Listener):
    """Count of the compilations that are running, for displays of progress."""

    running = 0

    def on_start(self, event: Any) -> None:
        """Count a compilation, or one within it."""
        self.running += 1

    def on_end(self, event: Any) -> None:
        """Count its end."""
        self.running -= 1


compilations = Compilations()
event.register("numba:compile", compilations)  # type: ignore[no-untyped-call]


def kernel(**options: Any) -> Callable[[Function], Function]:
    """Decorator of a kernel: `numba.njit` with these options and a cache that follows all its source files."""

    def compiled(function: Function) -> Function:
        dispatcher: Any = njit(cache=True, **options)(function)
        # the function itself where numba is switched off; in a frozen program numba's stamp is that of the program
        if dispatcher is not function and not getattr(sys, "frozen", False):
            file = dispatcher._cache._cache_file
            file._source_stamp = (file._source_stamp, source_stamp(function.__module__))
        return cast(Function, dispatcher)

    return compiled


def inlined(function: Callable[..., Any], **callees: Any) -> Any:
    """The compiled form of a plain function, inlined into its caller and optimised with it.

    `callees` : compiled forms of the plain functions that it calls, by name.
    """
    plain: Any = function
    copy = FunctionType(plain.__code__, {**plain.__globals__, **callees}, plain.__name__, plain.__defaults__)
    copy.__module__, copy.__qualname__ = plain.__module__, plain.__qualname__
    return njit(inline="always")(copy)


@cache
def source_stamp(module: str) -> str:
    """Hash of the sources of a module and of all modules of the package imported at its top, directly or through others."""
    sources: dict[str, bytes] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in sources:
            sources[name], imported = source_and_imports(name)
            waiting += imported
    return hashlib.sha256(b"".join(sources[name] for name in sorted(sources))).hexdigest()


@cache
def source_and_imports(module: str) -> tuple[bytes, frozenset[str]]:
    """The source of a loaded module, and the modules of the package that it imports at its top."""
    spec: Any = sys.modules[module].__spec__
    source = spec.loader.get_data(spec.origin)
    names: set[str] = set()
    for parent, listed, plain in IMPORT.findall(source.decode("utf-8")):
        names |= {parent or plain, *(f"{parent}.{name}" for name in re.findall(r"\w+", listed))}
    return source, frozenset(names & sys.modules.keys())
