"""What a command may do only where the whole process is its own, not where another program calls `rotor.cli.run`."""

from __future__ import annotations

import os
import sys

_OWN = False  # set by the console script


def begin() -> None:
    """The process is that of the command."""
    global _OWN
    _OWN = True


def leave_compiler_out() -> None:
    """For short work: kernels run as the plain Python that they are written in; compiling them would take seconds, once.

    Numba reads its variable when it is loaded; where it is already there, or the process is another program's, nothing changes.
    """
    if _OWN and "numba" not in sys.modules:
        os.environ["NUMBA_DISABLE_JIT"] = "1"
