"""The version of the package that is installed."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of


def version() -> str:
    """The version of the installed distribution, "0+source" where a source tree is run that was never installed."""
    try:
        return version_of("molrotor")
    except PackageNotFoundError:
        return "0+source"
