"""docs/hard_cases.md and the systems of docs/validation/index.md: every row is there, and every test that it names exists."""

from __future__ import annotations

import re
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
PAGE = (TESTS.parent / "docs" / "hard_cases.md").read_text(encoding="utf-8")
SYSTEMS = (TESTS.parent / "docs" / "validation" / "index.md").read_text(encoding="utf-8")
NAMED = re.findall(r"`((?:\w+/)*test_\w+\.py)::(test_\w+)`", PAGE + SYSTEMS)


def test_every_case_has_its_row():
    assert [int(number) for number in re.findall(r"^\| (\d+)\*? ", PAGE, re.MULTILINE)] == list(range(1, 39))
    assert [int(number) for number in re.findall(r"^\| (\d+) \w", SYSTEMS, re.MULTILINE)] == list(range(1, 20))


def test_every_test_named_exists():
    assert len(NAMED) > 100
    for file, name in NAMED:
        assert re.search(rf"^def {name}\(", (TESTS / file).read_text(encoding="utf-8"), re.MULTILINE), (file, name)


def test_the_marked_cases_are_those_with_a_mutation():
    text = Path(__file__).with_name("mutations.py").read_text(encoding="utf-8")
    mutated = sorted({int(number) for number in re.findall(r"Mutation\(\n\s+(\d+),", text)})
    assert [int(number) for number in re.findall(r"^\| (\d+)\* ", PAGE, re.MULTILINE)] == mutated
