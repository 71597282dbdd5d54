"""Figures of docs/assign.md and docs/validation/assign.md from the rows of `bench_assign.py`.

    python benchmarks/assign_figures.py

Reads benchmarks/results/assign.json (own cases) and assign_13c.json; writes docs/pictures/assign_success.png, assign_reliability.png and
assign_13c.png. Bars are Wilson's intervals of 95 %.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from bench_assign import has, reliability, share

from rotor.plots.picture import BLUE, GREY, ORANGE, new_figure, save, styled

ROOT = Path(__file__).resolve().parents[1]
RESULTS, PICTURES = ROOT / "benchmarks" / "results", ROOT / "docs" / "pictures"
Row = dict[str, Any]
Groups = list[tuple[str, Callable[[Row], bool]]]


def between(name: str, edges: list[float], form: str = "{:g}") -> Groups:
    """Groups of rows by a number between edges."""

    def group(low: float, high: float) -> Callable[[Row], bool]:
        return lambda row: low <= row[name] < high

    return [
        (f"{form.format(low)}\nto {form.format(high)}", group(low, high)) for low, high in itertools.pairwise(edges)
    ]


def row_selector(letter: str) -> Callable[[Row], bool]:
    """Whether the greatest dipole component of the strongest species is this."""
    return lambda row: bool(row["type"] == letter)


PANELS: dict[str, Groups] = {
    "Signal-to-noise ratio": between("signal_to_noise", [100, 300, 1000, 3001]),
    "Share of foreign peaks": between("foreign", [0.0, 0.1, 0.2, 0.35]),
    "κ": between("kappa", [-1.0, -0.9, -0.5, 0.0, 1.0]),
    "Strongest type": [(letter, row_selector(letter)) for letter in "abc"],
}


def with_bars(axes: Any, places: Any, shares: list[dict[str, Any]], colour: str) -> None:
    """Shares in per cent with their intervals."""
    y = np.array([100 * item["share"] for item in shares])
    low, high = (np.array([100 * item[end] for item in shares]) for end in ("low", "high"))
    axes.errorbar(
        places, y, yerr=[np.maximum(y - low, 0), np.maximum(high - y, 0)], fmt="o", ms=4, capsize=3, color=colour
    )


def success(rows: list[Row]) -> Any:
    """Share of lists whose strongest species is found, by what the list is like."""
    with styled():
        figure = new_figure((6.0, 4.8))
        panels = figure.subplots(2, 2, sharey=True)
        for axes, (title, groups) in zip(panels.flat, PANELS.items(), strict=True):
            chosen = [[row for row in rows if inside(row)] for _, inside in groups]
            with_bars(
                axes, range(len(groups)), [share(sum(has(row, 0) for row in part), len(part)) for part in chosen], BLUE
            )
            names = [f"{name}\n({len(part)})" for (name, _), part in zip(groups, chosen, strict=True)]
            axes.set_xticks(range(len(groups)), names)
            axes.set_xlabel(title)
            axes.set_xlim(-0.5, len(groups) - 0.5)
            axes.axhline(90, color=GREY, lw=0.6, ls=":")
        figure.supylabel("Strongest species found (%)")
        figure.axes[0].set_ylim(60, 101)
        return figure


def diagram(rows: list[Row]) -> Any:
    """Share of wrong answers against the probability of being wrong that they state, both in per cent on logarithmic axes."""
    with styled():
        figure = new_figure((4.0, 3.4))
        axes = figure.add_subplot()
        for group in (group for group in reliability(rows) if group["of"]):
            stated, wrong = 100 * (1 - group["stated"]), 100 * (1 - group["share"])
            low, high = 100 * (1 - group["high"]), 100 * (1 - group["low"])
            axes.errorbar(stated, wrong, yerr=[[wrong - low], [high - wrong]], fmt="o", ms=4, capsize=3, color=BLUE)
            axes.annotate(f"  {group['of']}", (stated, wrong), va="center")
        axes.plot([1e-3, 100], [1e-3, 100], color=GREY, lw=0.6, ls=":")
        axes.set(xscale="log", yscale="log", xlim=(1e-3, 100), ylim=(0.03, 100))
        axes.set(xlabel="Stated probability of being wrong (%)", ylabel="Wrong answers (%)")
        return figure


NAMES = {
    "COc1ccccc1": "anisole",
    "CC(=O)c1ccccc1": "acetophenone",
    "CC1CCCCC1=O": "2-methylcyclohexanone",
    "CC1=CCC(CC1)C(C)=C": "limonene",
    "COc1ccccc1O": "guaiacol",
    "O=Cc1ccc(OC)cc1": "anisaldehyde",
    "OC1CCCCC1C": "2-methylcyclohexanol",
    "CC1CCC(C(C)C)CC1=O": "menthone",
    "C1CCc2ncccc2C1": "tetrahydroquinoline",
    "CCOC(=O)C1CC1": "ethyl cyclopropanecarboxylate",
}  # by SMILES


def isotopologues(result: dict[str, Any]) -> Any:
    """¹³C species of each molecule: all, those with enough lines, those found."""
    rows, least = result["rows"][::-1], result["summary"]["enough_lines"]
    y = np.arange(len(rows))
    enough = [sum(component["lines"] >= least for component in row["species"]) for row in rows]
    right = [sum(component["right"] for component in row["species"]) for row in rows]
    wrong = [row["wrong"] for row in rows]
    with styled():
        figure = new_figure((6.0, 4.2))
        axes = figure.add_subplot()
        axes.barh(y, [len(row["species"]) for row in rows], color=GREY, alpha=0.35, label="all")
        axes.barh(y, enough, color=GREY, alpha=0.6, label=f"{least} lines or more above the threshold")
        axes.barh(y, right, height=0.45, color=BLUE, label="found, right")
        axes.barh(y, wrong, height=0.45, left=right, color=ORANGE, label="found, wrong")
        axes.set_yticks(y, [NAMES[row["smiles"]] for row in rows])
        axes.set_xlabel("Number of $^{13}$C species")
        figure.legend(loc="outside lower right", ncols=2)
        return figure


def main() -> None:
    """Draw all figures."""
    rows = json.loads((RESULTS / "assign.json").read_text())["rows"]
    save(success(rows), PICTURES / "assign_success.png", "rotor assign: success", {})
    save(diagram(rows), PICTURES / "assign_reliability.png", "rotor assign: reliability", {})
    substituted = json.loads((RESULTS / "assign_13c.json").read_text())
    save(isotopologues(substituted), PICTURES / "assign_13c.png", "rotor assign: 13C species", {})


if __name__ == "__main__":
    main()
