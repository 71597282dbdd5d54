"""Stated errors against actual ones in 100 random cases of each of twelve kinds, and how often stated intervals cover the truth.

    python benchmarks/bounds_and_coverage.py [--only KIND ...] [--page]

The cases and their references are those of tests/helpers/stated_bounds.py and tests/helpers/stated_coverage.py, which the tests run
too. All of them need about six minutes of one core. benchmarks/results/stated_bounds.json and docs/validation/stated_bounds.md are
written; --page measures nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

from stated_bounds import CASES  # noqa: E402
from stated_coverage import CONFIDENCE, COVERED, covered  # noqa: E402

RESULTS = ROOT / "benchmarks" / "results" / "stated_bounds.json"
PAGE = ROOT / "docs" / "validation" / "stated_bounds.md"
EACH = 100
MOST_MEDIAN, MOST_95 = 10.0, 100.0  # of stated over actual, or over the rounding where that is larger

HEAD = """# Stated errors in random cases

Made by `python benchmarks/bounds_and_coverage.py`; the cases and their references are in `tests/helpers/stated_bounds.py` and
`tests/helpers/stated_coverage.py`, and every full run of the tests computes all of them anew.

## Rounding and truncation are bounds

100 cases a kind, each a request drawn from a seed. "Above" counts the cases whose actual error, the difference from the reference, is
larger than the stated one. The ratios are stated over actual, or over the stated rounding where that is larger; a bound is not wasteful
where their median is at most 10 and 95 % are below 100. The last but one column compares with the actual error alone: closed forms
without truncation (tumble, gas) state a rounding for the worst case.

"""
COVERAGE = """
## Data and statistics state a confidence

The truth is drawn with the stated standard deviations, or the sample is drawn anew, 300 times a row. Intervals of 95 % are 1.96
standard deviations wide on each side; with 300 draws their coverage is known within 1.3 %.

| standard deviation of | draws | inside the interval of 95 % |
|---|---|---|
"""


def measured(kind: str) -> dict[str, Any]:
    """The figures of one kind."""
    start = time.process_time()
    cases = [CASES[kind](seed) for seed in range(EACH)]
    ratios = np.array([case.stated / max(case.actual, case.floor) for case in cases])
    plain = [case.stated / case.actual for case in cases if case.actual > 0]
    return {
        "cases": len(cases),
        "above": sum(case.actual > case.stated for case in cases),
        "median": float(np.median(ratios)),
        "of_95": float(np.sort(ratios)[int(0.95 * (len(ratios) - 1))]),
        "plain_median": float(np.median(plain)) if plain else None,
        "seconds": time.process_time() - start,
    }


def row(kind: str, summary: dict[str, Any]) -> str:
    """A row of the table of bounds."""
    doc = (CASES[kind].__doc__ or "").splitlines()[0].rstrip(".")
    plain = "-" if summary["plain_median"] is None else f"{summary['plain_median']:.2g}"
    return (
        f"| {kind.replace('_', ' ')} | {doc} | {summary['cases']} | {summary['above']} | {summary['median']:.2g} "
        f"| {summary['of_95']:.2g} | {plain} "
        f"| {summary['seconds']:.0f} |"
    )


def page(results: dict[str, Any]) -> str:
    """The whole page."""
    kinds = results["bounds"]
    above, cases = sum(kind["above"] for kind in kinds.values()), sum(kind["cases"] for kind in kinds.values())
    lines = [
        "| kind | actual error | cases | above | median ratio | 95 % below | median of stated over actual | seconds |",
        "|---|---|---|---|---|---|---|---|",
        *(row(kind, item) for kind, item in kinds.items()),
        "",
        f"{above} of {cases} cases are above their bound.",
    ]
    rows = [
        f"| {name} | {entry['draws']} | {100 * entry['inside']:.1f} % |" for name, entry in results["coverage"].items()
    ]
    return HEAD + "\n".join(lines) + "\n" + COVERAGE + "\n".join(rows) + "\n"


def write(results: dict[str, Any]) -> None:
    """Figures and page, kinds in their order."""
    results["bounds"] = {kind: results["bounds"][kind] for kind in CASES if kind in results["bounds"]}
    RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(results), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", choices=[*CASES, "coverage"])
    parser.add_argument("--page", action="store_true")
    arguments = parser.parse_args()
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {"bounds": {}, "coverage": {}}
    for kind in (
        []
        if arguments.page
        else CASES
        if arguments.only is None
        else [chosen_kind for chosen_kind in arguments.only if chosen_kind in CASES]
    ):
        results["bounds"][kind] = measured(kind)
        write(results)
        print(row(kind, results["bounds"][kind]), flush=True)
    if not arguments.page and (arguments.only is None or "coverage" in arguments.only):
        for name in COVERED:
            inside = covered(name)
            results["coverage"][name] = {
                "draws": len(inside),
                "inside": float(np.mean(inside)),
                "confidence": CONFIDENCE,
            }
            print(name, results["coverage"][name], flush=True)
    write(results)


if __name__ == "__main__":
    main()
