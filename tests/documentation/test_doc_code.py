"""The Python blocks of some pages run, and their assertions hold."""

import re

import pytest
from places import PROJECT

DOCS = PROJECT / "docs"


@pytest.mark.parametrize(
    "page", ["classical", "gas", "geometry", "hamiltonian", "potential", "scenes", "spins_and_states"]
)
def test_blocks_of_code_in_pages_run(page):
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / f"{page}.md").read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:  # one after another, as a reader would
        exec(compile(block, f"{page}.md", "exec"), names)


def test_the_transcript_of_the_quick_start(call, folder):
    """What the page shows is what the commands print, but for seconds and memory, which are measured."""
    page = (DOCS / "quick_start.md").read_text(encoding="utf-8")
    part = page.split("## What to simulate, as a file\n")[1].split("## The same in Python")[0]
    start, plan, run = re.findall(r"```(?:toml|text)\n(.*?)\n```", part, re.DOTALL)
    scene = call("new", "spectrum")[1]
    assert scene.startswith(start)
    for old, new in (("water", "H2CO"), ("300 K", "30 K"), ("2:18GHz", "100:105GHz")):
        assert f'"{new}"' in part
        scene = re.sub(rf'^(?:# )?(\w+) = "{old}"', rf'\1 = "{new}"', scene, count=1, flags=re.MULTILINE)
    (folder / "s.toml").write_text(scene, encoding="utf-8")
    for verb, shown in (("plan", plan), ("run", run)):
        code, out, err = call(verb, "s.toml")
        assert code == 0, err
        assert _without_seconds(out) == _without_seconds(shown)


def _without_seconds(text: str) -> list[str]:
    lines = text.strip().splitlines()
    rows = [number for number, line in enumerate(lines) if line.startswith("seconds")]
    assert len(rows) == 1
    rest = [line for number, line in enumerate(lines) if number not in (rows[0], rows[0] + 1)]
    return [line for line in rest if not line.startswith("memory")]
