"""Cut samples of about 100 lines from the reference program's files: `python make_samples.py PATH_TO_SHARED`."""

import gzip
import json
import shutil
import sys
from pathlib import Path

WORDED = ("abc_rigid_j20_all", "hard_nearsym_j150", "h2o_quartic_diag3", "abc_sred", "ocs", "hc3n", "ch3cn")
OTHERS = ("abc_ared6", "h2co", "h2o_octic", "h2o_sextic", "pyridine_oblate_s", "so2")
COUPLED = (
    "asym_spinrot", "ch2cl2_2quad", "ch3cn_quad", "formamide_quad", "hcn_quad", "three_states_fermi_coriolis", "tunnelling_doublet_quad",
    "two_state_coriolis", "vinylcl35_quad",
)  # fmt: skip
KEYS = (
    "case", "molecule", "program", "parameters", "source", "reduction", "representation", "spin_statistics",
    "dipoles_debye", "fend", "frequency_limit_GHz", "str0", "str1", "temperature_K", "qrot_used",
)  # fmt: skip


def twins(lines: list[str], picked: set[int]) -> set[int]:
    """With a line, its K partner: the neighbour of the same frequency."""
    near = {i + step for i in picked for step in (-1, 1) if 0 <= i + step < len(lines)}
    return picked | {k for k in near if any(lines[k][:13] == lines[i][:13] for i in picked)}


def spread(lines: list[str], count: int) -> set[int]:
    """Places of about `count` lines, from first to last."""
    return set(range(0, len(lines), max(1, len(lines) // count if len(lines) > 2.5 * count else 1)))


def packed_lines(path: Path) -> list[str]:
    with gzip.open(path, "rt", newline="") as handle:
        return list(handle)


def main(shared: Path) -> None:
    for case in WORDED + OTHERS + COUPLED:
        folder, target = shared / "reference" / "spcat" / case, Path(__file__).parent / case
        target.mkdir(exist_ok=True)
        for suffix in (".int", ".var"):
            shutil.copyfile(folder / f"{case}{suffix}", target / f"{case}{suffix}")
        if case in WORDED:
            facts = json.loads((folder / "case.json").read_text())
            (target / "case.json").write_text(json.dumps({k: facts[k] for k in KEYS}, indent=1) + "\n")

        lines = [line for line in packed_lines(folder / f"{case}.cat.gz") if float(line[21:29]) > -28]
        if case == "three_states_fermi_coriolis":  # K doublets of higher N are closer than the program's rounding
            lines = [line for line in lines if int(line[55:57]) <= 6]
        picked = sorted(twins(lines, spread(lines, 60)))
        (target / "sample.cat").write_text("".join(lines[i] for i in picked), newline="")
        levels = packed_lines(folder / f"{case}.egy.gz")
        (target / "sample.egy").write_text("".join(levels[i] for i in sorted(spread(levels, 60))), newline="")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
