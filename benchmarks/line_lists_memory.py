"""Line lists of many transitions into a local catalogue: peak resident memory, time, and ranges read from it.

A generator writes 200,000 levels and as many transitions as are stated in ExoMol's form (.states, .trans.bz2), or HITRAN records (.par);
`rotor catalogue add` runs in a process of its own, whose peak of resident memory the system counts. Then ranges that hold some
hundred lines are read, each by a fresh connection and by one that is open.

    python benchmarks/line_lists_memory.py exomol 1e7 /tmp/folder
    python benchmarks/line_lists_memory.py hitran 1e7 /tmp/folder
"""

from __future__ import annotations

import bz2
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

STATES = 200_000
PIECE = 200_000
B_CM = 0.2


def energies() -> tuple[np.ndarray, np.ndarray]:
    """Energies in cm⁻¹ and J of the levels, rising."""
    rng = np.random.default_rng(1)
    j = rng.integers(0, 150, STATES)
    energy = B_CM * j * (j + 1) + rng.uniform(0, 9000, STATES)
    order = np.argsort(energy)
    return np.round(energy[order] - energy.min(), 6), j[order]


def transitions(count: int, energy: np.ndarray):  # type: ignore[no-untyped-def]
    """Upper and lower rows, Einstein coefficients and wavenumbers of a piece at a time."""
    rng = np.random.default_rng(2)
    for start in range(0, count, PIECE):
        n = min(PIECE, count - start)
        a, b = rng.integers(0, STATES, (2, n))
        upper, lower = np.maximum(a, b), np.minimum(a, b)
        same = energy[upper] <= energy[lower]
        lower[same] = 0
        upper[same] = STATES - 1
        yield upper, lower, 10 ** rng.uniform(-8, 1, n)


def exomol(count: int, folder: Path) -> Path:
    """Files of ExoMol."""
    energy, j = energies()
    path = folder / "1H2-16O__MADE.states"
    with path.open("w") as handle:
        handle.writelines(
            f"{i + 1:12d} {e:12.6f} {2 * k + 1:6d} {k:7d} + {i % 97}\n" for i, (e, k) in enumerate(zip(energy, j, strict=True))
        )  # fmt: skip
    with bz2.open(folder / "1H2-16O__MADE.trans.bz2", "wb", compresslevel=1) as packed:
        for upper, lower, a in transitions(count, energy):
            rows = zip((upper + 1).tolist(), (lower + 1).tolist(), a.tolist(), strict=True)
            packed.write(b"".join(b"%12d %12d %10.4e\n" % row for row in rows))
    return path


def hitran(count: int, folder: Path) -> Path:
    """A file of HITRAN."""
    energy, j = energies()
    path = folder / "made.par"
    tail = " " * 15
    with path.open("w") as handle:
        for upper, lower, a in transitions(count, energy):
            nu, g_u, g_l = energy[upper] - energy[lower], 2.0 * j[upper] + 1, 2.0 * j[lower] + 1
            rows = zip(nu.tolist(), a.tolist(), energy[lower].tolist(), j[upper].tolist(), j[lower].tolist(), g_u.tolist(), g_l.tolist(),
                       strict=True)  # fmt: skip
            handle.writelines(
                f" 11{v:12.6f} 1.000E-22{x:10.3E}.07000.500{e:10.4f}0.70-.000000{tail}{tail}{ju:3d}            {jl:3d}            "
                f"000000 0 0 0 0 0 0 {gu:7.1f}{gl:7.1f}\n"
                for v, x, e, ju, jl, gu, gl in rows
            )
    return path


def ranges(catalogue: Path, count: int) -> None:
    """Times of ranges of some hundred lines."""
    from rotor.formats.catalogue.database import LineCatalogue

    rng, fresh, again = np.random.default_rng(3), [], []
    width = 9000 * 29979.2458 * 300 / count  # MHz
    for middle in rng.uniform(10e6, 100e6, 20).tolist():
        begin = time.perf_counter()
        with LineCatalogue(catalogue) as opened:
            first = sum(map(len, opened.species_between(middle, middle + width)))
            fresh.append(time.perf_counter() - begin)
            begin = time.perf_counter()
            opened.species_between(middle + 1e6, middle + 1e6 + width)
            again.append(time.perf_counter() - begin)
    for name, times in (("with opening the file", fresh), ("when open", again)):
        print(
            f"ranges of about {first} lines, {name}: {1e3 * np.median(times):.1f} ms, slowest {1e3 * max(times):.1f} ms"
        )


def watched(command: list[str]) -> tuple[list[tuple[float, int, int]], resource.struct_rusage]:
    """Seconds, anonymous and file-backed resident memory (MB) of a process until its end, and what the system counts of it."""
    rows, begin, process = [], time.perf_counter(), subprocess.Popen(command)
    status = Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        sizes = dict(line.split(":", 1) for line in status.read_text().splitlines() if line.startswith("Rss"))
        if sizes:  # none of a process that has just ended
            anonymous, mapped = (int(sizes[name].split()[0]) // 1024 for name in ("RssAnon", "RssFile"))
            rows.append((time.perf_counter() - begin, anonymous, mapped))
        time.sleep(0.02)
    if process.returncode:
        raise SystemExit(process.returncode)
    return rows, resource.getrusage(resource.RUSAGE_CHILDREN)


def add(source: Path, catalogue: Path) -> None:
    """`rotor catalogue add` in a process of its own: time, and the peak of its anonymous memory in each tenth of that time."""
    command = [
        sys.executable,
        "-m",
        "rotor",
        "catalogue",
        "add",
        os.fspath(source),
        "--catalogue",
        os.fspath(catalogue),
    ]
    rows, usage = watched(command)
    seconds, anonymous, mapped = np.array(rows).T
    tenths = [int(part.max()) for part in np.array_split(anonymous, 10)]
    print(
        f"added in {seconds[-1]:.0f} s ({usage.ru_utime + usage.ru_stime:.0f} s of processor time); peak of resident memory "
        f"{usage.ru_maxrss / 1024:.0f} MB, of its anonymous part {anonymous.max():.0f} MB, of mapped files {mapped.max():.0f} MB; "
        f"anonymous peak in each tenth of the run, MB: {tenths}; catalogue of {catalogue.stat().st_size / 1e9:.2f} GB",
        flush=True,
    )


def main(kind: str, count: int, folder: Path) -> None:
    begin = time.perf_counter()
    source = {"exomol": exomol, "hitran": hitran}[kind](count, folder)
    size = sum(path.stat().st_size for path in folder.glob(source.name.split(".")[0] + ".*"))
    print(
        f"{kind}: {count:.0e} transitions made in {time.perf_counter() - begin:.0f} s, {size / 1e9:.2f} GB", flush=True
    )
    catalogue = folder / f"{kind}.rotorcat"
    add(source, catalogue)
    ranges(catalogue, count)


if __name__ == "__main__":
    main(sys.argv[1], int(float(sys.argv[2])), Path(sys.argv[3]))
