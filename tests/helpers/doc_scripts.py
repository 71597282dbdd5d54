"""The scripts that make pages of the documentation, as modules."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import sys
from types import ModuleType

from places import PROJECT

DOCS = PROJECT / "docs"


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
