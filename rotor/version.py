"""Version of the package, also read by the build of the distribution."""

from __future__ import annotations

VERSION = "0.3.0.dev0"


def version() -> str:
    """The version of the package."""
    return VERSION
