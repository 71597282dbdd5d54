"""The page docs/validation/full_run.md from the log of `.ci/run all`: what ran, how long each step took, and how it ended."""

from __future__ import annotations

import datetime
import os
import platform
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

STEP = re.compile(r"^== (.*) \((\d+)s\)$", re.MULTILINE)
PYTEST = re.compile(r"^=*\s*((?:\d+ \w+(?:, )?)+) in [\d.]+s.*$", re.MULTILINE)
ORACLES = re.compile(r"^oracles: (.*)$", re.MULTILINE)


def rows(log: str) -> list[tuple[str, int, str]]:
    """Each step with its seconds and what its tests came to.

    >>> rows("== lint (3s)\\nAll checks passed!\\n== tests (10s)\\n5 passed in 7.00s\\n== done (20s)\\n")
    [('lint', 7, ''), ('tests', 10, '5 passed')]
    """
    steps = list(STEP.finditer(log))
    out = []
    for here, following in pairwise(steps):
        text = log[here.end() : following.start()]
        counts = [*PYTEST.findall(text), *(f"oracles {found}" for found in ORACLES.findall(text))]
        out.append((here[1], int(following[2]) - int(here[2]), "; ".join(counts)))
    return out


def page(log: str, status: int) -> str:
    """The whole page; of a run that failed, its last lines too."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False)
    verdict = "Everything passed." if status == 0 else f"It failed with exit code {status}."
    lines = [
        "# The last full run",
        "",
        f"{verdict} `bash .ci/full` on {datetime.date.today()}, at commit {commit.stdout.strip()} with the changes that this",
        f"page was committed with; Python {platform.python_version()}, {os.cpu_count()} cores, {platform.system()}.",
        "",
        "| step | seconds | tests |",
        "|---|---|---|",
        *(f"| {name} | {seconds} | {counts} |" for name, seconds, counts in rows(log)),
        "",
    ]
    if status:
        lines += ["Its last lines:", "", "```", *log.rstrip().splitlines()[-30:], "```", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    print(page(Path(sys.argv[1]).read_text(encoding="utf-8", errors="replace"), int(sys.argv[2])), end="")
