"""Work-precision pictures of the whole package: measured, drawn, and written as docs/accuracy.md.

    python benchmarks/accuracy.py [--shared FOLDER] [--only SUBJECT ...] [--page]

All subjects need about three minutes of one core; --only measures some of them and leaves the figures of the others as they are in
benchmarks/results/accuracy.json. --page measures nothing and writes pictures and page from that file. --shared: the folder of
reference files, for the orders of distortion, whose figures stay as they are without it. Times are those of the processor, without
start-up and compilation.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict
from pathlib import Path

from accuracy_subjects import SUBJECTS, Subject

from rotor.plots.work_precision import Panel, Point, plot_work_precision

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "accuracy.json"
PAGE, PICTURES = ROOT / "docs" / "accuracy.md", ROOT / "docs" / "pictures"

HEAD = """# Accuracy and what it costs

Made by `python benchmarks/accuracy.py`, from the functions behind [`rotor accuracy`](verbs/accuracy.md), which does the
same for a scene of yours. Every picture shows error against processor time, without start-up and compilation. A setting stands
beside its point; the usual setting has a ring. An open point has no difference from the reference. Times are medians of five rounds
where they are short; neighbours whose times differ by less than their scatter have one time. Errors are numerical: the
constants are taken as given, except where measured lines are named. Times are of one core of a shared machine: their ratios
inside one picture mean something, no more.

| subject | what to choose |
|---|---|
"""


def page(results: dict[str, list[Panel]]) -> str:
    """The whole page."""
    rows = "".join(
        f"| [{subject.title}](#{anchor(subject.title)}) | {subject.choose} |\n"
        for subject in SUBJECTS
        if subject.name in results
    )
    return (
        HEAD
        + rows
        + "".join(section(subject, results[subject.name]) for subject in SUBJECTS if subject.name in results)
    )


def anchor(title: str) -> str:
    """What a heading is linked by.

    >>> anchor("Q(T)"), anchor("Hyperfine structure: exact or not")
    ('qt', 'hyperfine-structure-exact-or-not')
    """
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c == "-")


def section(subject: Subject, panels: list[Panel]) -> str:
    """Picture, sentence and table of the errors of one subject."""
    head = f"\n## {subject.title}\n\n{subject.what}\n\n![{subject.title}](pictures/accuracy_{subject.name}.png)\n\n**{subject.choose}**\n"
    return head + "".join(table(panel) for panel in panels)


def table(panel: Panel) -> str:
    """The errors of a panel, a row a curve."""
    rows = [
        f"| {name} | "
        + ", ".join(
            f"{point.setting}: {point.error:.1e}" if point.setting else f"{point.error:.1e}" for point in points
        )
        + " |"
        for name, points in panel.curves.items()
    ]
    return f"\n| {panel.title} | error of {panel.of} |\n|---|---|\n" + "\n".join(rows) + "\n"


def read_results() -> dict[str, list[Panel]]:
    """The figures of the last measurements."""
    if not RESULTS.exists():
        return {}
    content = json.loads(RESULTS.read_text(encoding="utf-8"))
    return {name: [panel_of(panel) for panel in panels] for name, panels in content.items()}


def panel_of(record: dict) -> Panel:
    """A panel from its record."""
    curves = {name: [Point(**point) for point in points] for name, points in record["curves"].items()}
    return Panel(record["title"], record["of"], curves, record.get("joined", True))


def _by_panel(content: dict) -> str:
    """JSON with one panel a line."""
    entries = (
        f"{json.dumps(name)}: [\n" + ",\n".join(json.dumps(panel, ensure_ascii=False) for panel in panels) + "\n]"
        for name, panels in content.items()
    )
    return "{\n" + ",\n".join(entries) + "\n}\n"


def write(results: dict[str, list[Panel]]) -> None:
    """Figures, pictures and page."""
    ordered = {subject.name: results[subject.name] for subject in SUBJECTS if subject.name in results}
    content = {name: [asdict(panel) for panel in panels] for name, panels in ordered.items()}
    RESULTS.write_text(_by_panel(content), encoding="utf-8")
    for subject in SUBJECTS:
        if subject.name in results:
            picture = PICTURES / f"accuracy_{subject.name}.png"
            plot_work_precision(
                results[subject.name], picture, title=subject.title, facts={"made by": "benchmarks/accuracy.py"}
            )
    PAGE.write_text(page(results), encoding="utf-8", newline="\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shared", type=Path)
    parser.add_argument("--only", nargs="*", choices=[subject.name for subject in SUBJECTS])
    parser.add_argument("--page", action="store_true")
    arguments = parser.parse_args()
    results = read_results()
    for subject in SUBJECTS:
        if (
            arguments.page
            or (arguments.only and subject.name not in arguments.only)
            or (subject.name == "orders" and arguments.shared is None)
        ):
            continue
        start = time.perf_counter()
        results[subject.name] = subject.panels(arguments.shared)
        print(f"{subject.name}: {time.perf_counter() - start:.0f} s")
        write(results)
    write(results)


if __name__ == "__main__":
    main()
