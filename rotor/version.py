"""The version of the package; the distribution takes it from here."""

from __future__ import annotations

VERSION = "0.3.0.dev0"


def version() -> str:
    """The version of the package."""
    return VERSION
