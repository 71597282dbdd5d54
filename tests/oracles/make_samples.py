"""Cut samples of about 100 lines from the reference catalogues: `python make_samples.py PATH_TO_SHARED`."""

import gzip
import json
import sys
from pathlib import Path

CASES = ("abc_rigid_j20_all", "hard_nearsym_j150", "h2o_quartic_diag3", "abc_sred", "ocs", "hc3n", "ch3cn")
KEYS = (
    "case", "molecule", "program", "parameters", "source", "reduction", "representation", "spin_statistics",
    "dipoles_debye", "fend", "frequency_limit_GHz", "str0", "str1", "temperature_K", "qrot_used",
)  # fmt: skip


def twins(lines: list[str], picked: set[int]) -> set[int]:
    """With a line, its K partner: the neighbour of the same frequency."""
    near = {i + step for i in picked for step in (-1, 1) if 0 <= i + step < len(lines)}
    return picked | {k for k in near if any(lines[k][:13] == lines[i][:13] for i in picked)}


def main(shared: Path) -> None:
    for case in CASES:
        folder = shared / "reference" / "spcat" / case
        facts = json.loads((folder / "case.json").read_text())
        with gzip.open(folder / f"{case}.cat.gz", "rt", newline="") as handle:
            lines = [line for line in handle if float(line[21:29]) > -28]
        picked = twins(lines, set(range(0, len(lines), max(1, len(lines) // 60 if len(lines) > 150 else 1))))
        target = Path(__file__).parent / case
        target.mkdir(exist_ok=True)
        (target / "case.json").write_text(json.dumps({k: facts[k] for k in KEYS}, indent=1) + "\n")
        (target / "sample.cat").write_text("".join(lines[i] for i in sorted(picked)), newline="")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
