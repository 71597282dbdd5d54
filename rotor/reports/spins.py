"""Treatment of nuclear spins, as a line of a report."""

from __future__ import annotations

from typing import Any


def hyperfine_lines(used: dict[str, Any] | None) -> list[tuple[str, str]]:
    """The method that split the levels, and the estimated difference from the exact one."""
    if used is None:
        return []
    if used["method"] == "exact":
        return [("hyperfine", "exact: all N that a tensor connects")]
    estimate = f"{1000 * used['estimate_mhz']:.2g} kHz"
    return [("hyperfine", f"{used['method']}: differs from exact by less than {estimate}, estimated")]
