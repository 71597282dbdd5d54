"""The Python blocks of the pages on classical motion and on scenes run, and their assertions hold."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"


@pytest.mark.parametrize("page", ["classical", "gas", "potential", "scenes"])
def test_blocks_run(page):
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / f"{page}.md").read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:  # one after another, as a reader would
        exec(compile(block, f"{page}.md", "exec"), names)
