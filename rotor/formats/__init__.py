"""File formats of the field, one file a format; a folder where a format has several files.

`read` and `write` are loaded when first used: what needs one format alone does not load them all.
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
