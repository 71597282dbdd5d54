"""Line lists of the rigid a+b+c top A=8572, B=3640, C=2790 MHz: seconds, lines per second, peak memory.

    python benchmarks/bench_lines.py [60 100 200]

Each figure comes from a process of its own, after one small run that loads and compiles what is needed; the best of five,
since whatever else the machine does only adds. Q is given, as it is in SPCAT's input. SPCAT's figures (gcc -O2, the same
kind of machine, quiet) are those of its 80-column sorted file, all lines or stronger than 1e-12; it lists round-off lines
and leaves out weak allowed ones, so rates per line are compared.
Results go to benchmarks/results/lines.json.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SPCAT = {  # J: (lines, seconds) of all lines, then of those stronger than 1e-12
    60: ((267_743, 0.57), (100_010, 0.18)),
    100: ((947_495, 3.75), (266_239, 0.63)),
    150: ((2_706_375, 30.0), (488_679, 1.6)),
    200: ((5_813_027, 128.0), (597_777, 2.8)),
}
Q = 93882.35  # given to both programs
WORK = ("memory, all", "memory, > -12", "sorted .cat, all", "sorted .cat, > -12")
RESULTS = Path(__file__).parent / "results" / "lines.json"


def measure(jmax: int, work: str) -> dict[str, float]:
    """One figure, in this process: seconds of the best of five runs, and how many lines."""
    import rotor
    from rotor.spectra.lines import line_list
    from rotor.spectra.transitions import pairs as transitions
    from rotor.tops.top import Top

    top = Top.from_constants("A=8572 B=3640 C=2790 MHz", dipole_abc_debye=(1.201, 1.916, 0.365))
    cut = -12.0 if work.endswith("-12") else None
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "out.cat"

        def run(j: int) -> int:
            lines = line_list(top, jmax=j, min_lgint=cut, q=Q, sort=work.startswith("sorted"))
            if work.startswith("sorted"):
                rotor.write(lines, path)
            return len(lines)

        long_list, transitions.LONG_LIST = transitions.LONG_LIST, 0
        run(40)
        transitions.LONG_LIST = long_list
        for _ in range(5):
            started = time.perf_counter()
            count = run(jmax)
            seconds.append(time.perf_counter() - started)
            path.unlink(missing_ok=True)
    return {"lines": count, "seconds": min(seconds), "peak_mb": peak_mb()}


def peak_mb() -> float:
    """The largest resident size of this process, where the system tells it."""
    try:
        import resource
    except ImportError:
        return float("nan")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main(jmaxes: list[int]) -> None:
    """Measure, compare, print a table, keep the figures."""
    machine = (
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    )
    print(machine)
    print(f"{'J max':>5} {'what':20} {'lines':>10} {'s':>8} {'M lines/s':>9} {'MB':>6} {'SPCAT M/s':>9} {'ratio':>6}")
    rows = []
    for jmax in jmaxes:
        for work in WORK:
            done = subprocess.run(
                [sys.executable, __file__, "--one", str(jmax), work], capture_output=True, text=True, check=True
            )
            row = json.loads(done.stdout)
            lines, seconds = SPCAT[jmax][work.endswith("-12")]
            rate, theirs = row["lines"] / row["seconds"], lines / seconds
            rows.append(row | {"jmax": jmax, "work": work, "ratio_to_spcat": rate / theirs})
            print(f"{jmax:5d} {work:20} {row['lines']:10,.0f} {row['seconds']:8.3f} {rate / 1e6:9.2f} {row['peak_mb']:6.0f} "
                  f"{theirs / 1e6:9.3f} {rate / theirs:6.1f}", flush=True)  # fmt: skip
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps({"machine": machine, "rows": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(measure(int(sys.argv[2]), sys.argv[3])))
    else:
        main([int(j) for j in sys.argv[1:]] or [60, 100, 200])
