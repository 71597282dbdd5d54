"""Cut measured hyperfine lines from the reference files: `python make_samples.py PATH_TO_SHARED`."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

from rotor.formats.spcat.text.cat import read_cat

HEAD = "frequency_mhz,error_mhz,upper,lower\n"  # quanta N (Ka Kc | K) F as the files have them, F rounded up
HERE = Path(__file__).parent


def catalogue_rows(path: Path, n_max: int, k_max: int) -> list[str]:
    """The measured lines (negative tag) of a catalogue up to N and K max."""
    catalogue = read_cat(gzip.decompress(path.read_bytes()))
    rows = []
    for i in range(len(catalogue)):
        quanta = [
            [int(abs(x)) for x in side[i] if x > -100] for side in (catalogue.quanta_upper, catalogue.quanta_lower)
        ]
        width = {2: 3, 3: 4}[int(catalogue.qnfmt[i]) // 100]
        up, low = (side[:width] for side in quanta)
        if catalogue.tag[i] < 0 and max(up[0], low[0]) <= n_max and max(up[1], low[1]) <= k_max:
            rows.append(_row(float(catalogue.frequency_mhz[i]), float(catalogue.error_mhz[i]), up, low))
    return rows


def measured_rows(path: Path, columns: list[int], count: int) -> list[str]:
    """The first lines of a .lin file; columns: which of its quanta are N, K, F."""
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines()[:count]:
        words = [int(line[i : i + 3]) for i in range(0, 36, 3) if line[i : i + 3].strip()]
        half = len(words) // 2
        frequency, error = map(float, line[36:].split()[:2])
        rows.append(_row(frequency, error, *([side[c] for c in columns] for side in (words[:half], words[half:]))))
    return rows


def _row(frequency: float, error: float, up: list[int], low: list[int]) -> str:
    return f"{frequency},{error},{' '.join(map(str, up))},{' '.join(map(str, low))}\n"


def main(shared: Path) -> None:
    reference = shared / "reference"
    samples = {
        "ch3cl": catalogue_rows(reference / "catalogues" / "c050007.cat.gz", 8, 9),
        "hnco": catalogue_rows(reference / "library_lines" / "c043002.cat.gz", 4, 1),
        "ch3cn": measured_rows(reference / "fits" / "ch3cn_MeCN" / "ch3cn_MeCN.lin", [0, 1, 3], 99),
        "csf": measured_rows(reference / "fits" / "csf" / "csf.lin", [0, 1, 2], 14),
    }
    for name, rows in samples.items():
        (HERE / f"{name}.csv").write_text(HEAD + "".join(rows), encoding="utf-8")
        print(name, len(rows))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
