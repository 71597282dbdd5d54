"""How long it takes until something happens: whole processes, median and best of seven, against numpy and scipy alone.

python benchmarks/bench_start.py
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

COMMANDS = {
    "import numpy, scipy.linalg": ["-c", "import numpy, scipy.linalg"],
    "import rotor": ["-c", "import rotor"],
    "rotor spectrum water": ["-m", "rotor", "spectrum", "water"],
    "rotor info water": ["-m", "rotor", "info", "water"],
}
RESULTS = Path(__file__).parent / "results" / "start.json"


def main() -> None:
    """Measure, print a table, keep the figures."""
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(7):  # in turn, so that a change of the machine's speed meets all alike
        for name, arguments in COMMANDS.items():
            started = time.perf_counter()
            subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
            times[name].append(time.perf_counter() - started)

    base = statistics.median(times["import numpy, scipy.linalg"])
    rows = [
        {"what": name, "median_s": statistics.median(t), "best_s": min(t), "ratio": statistics.median(t) / base}
        for name, t in times.items()
    ]
    for row in rows:
        print(f"{row['what']:28} median {row['median_s']:.3f} s, best {row['best_s']:.3f} s, ratio {row['ratio']:.2f}")
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
