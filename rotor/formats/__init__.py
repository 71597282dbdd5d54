"""File formats of the field: one module for each format, or a folder for a format with several files.

`read` and `write` are loaded at first use, so that a single format does not load all others.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotor.formats.read_write import read as read
    from rotor.formats.read_write import write as write

__all__ = ["read", "write"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from rotor.formats import read_write

        return getattr(read_write, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
