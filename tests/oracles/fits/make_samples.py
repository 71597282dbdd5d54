"""Measured lines for tests and examples: `python make_samples.py PATH_TO_SHARED`.

co.par, co.lin: the CDMS example co_4 (G. Winnewisser et al.), SPFIT's input as it is. ocs.csv and its isotopologues: the measured lines
(negative tag) of CDMS c060503, c061502, c062505, c062506 (Müller et al. 2001, 2005; Endres et al. 2016).
"""

import shutil
import sys
from pathlib import Path

from rotor.formats.lines.assigned_lines import read_assigned_lines, write_assigned_lines

HERE = Path(__file__).parent
CATALOGUES = {"ocs": "c060503", "o13cs": "c061502", "oc34s": "c062505", "18ocs": "c062506"}


def main(shared: Path) -> None:
    for suffix in (".par", ".lin"):
        shutil.copyfile(shared / "reference" / "fits" / "co_4" / f"co_4{suffix}", HERE / f"co{suffix}")
    for name, tag in CATALOGUES.items():
        lines, _ = read_assigned_lines(shared / "reference" / "catalogues" / f"{tag}.cat.gz", ("j",))
        write_assigned_lines(lines, HERE / f"{name}.csv")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
