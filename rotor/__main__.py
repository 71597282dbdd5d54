"""The console script `rotor`, and `python -m rotor`.

For a sweep with several processes their modules are loaded while this process loads the command line and reads the scene.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence


def start_workers_ahead(arguments: Sequence[str]) -> None:
    """Start loading the modules of a scene's worker processes. Wrong arguments start nothing; they are refused where they are read."""
    if arguments[:1] != ["run"] or not re.search(r"--workers[= ]0*([2-9]|[1-9]\d+)(?!\S)", " ".join(arguments)):
        return
    from rotor.scenes.worker_processes import start_ahead
    from rotor.verbs import first_file_text

    start_ahead(first_file_text(arguments[1:]))


def main() -> None:
    """The console script."""
    start_workers_ahead(sys.argv[1:])
    from rotor.cli import main as command  # after the start of the processes: typer takes 60 ms

    command()


if __name__ == "__main__":  # not when a tool imports all modules of the package
    main()
