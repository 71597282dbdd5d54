"""docs/validation/reviews.md: each item of the reviews is there, its tests exist, and its commands print what the page says."""

from __future__ import annotations

import math
import re

import pytest
from doc_scripts import script
from places import PROJECT

MAKE = script("make_reviews")
CONTENT = MAKE.content()
PAGE = MAKE.TARGET.read_text(encoding="utf-8")
TESTS = PROJECT / "tests"
RUN = [(item["item"], shown) for item in CONTENT["items"] for shown in item.get("shown", ()) if "measured" not in shown]
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def test_every_item_is_there():
    numbers = [int(number) for number in re.findall(r"^### [A-E](\d+)\b", PAGE, re.MULTILINE)]
    assert sorted(set(numbers)) == list(range(1, 31))
    assert numbers == sorted(numbers)


def test_every_test_named_exists():
    names = [name for item in CONTENT["items"] for name in item["tests"]]
    assert len(names) > 100
    for name in names:
        file, test = name.split("::")
        assert re.search(rf"^def {test}\(", (TESTS / file).read_text(encoding="utf-8"), re.MULTILINE), name


def test_the_page_is_made_of_its_items():
    """Texts, tests and commands are those of the items; what the commands print is in the next test."""
    blocks = re.findall(r"```text\n(.*?)\n```\n", PAGE, re.DOTALL)
    shown = [shown for item in CONTENT["items"] for shown in item.get("shown", ())]
    assert [re.findall(r"^\$ (.*)$", block, re.MULTILINE) for block in blocks] == [s["typed"] for s in shown]
    following = iter(blocks)
    made = [
        [MAKE.block(next(following).split("\n"), "measured" in shown) for shown in item.get("shown", ())]
        for item in CONTENT["items"]
    ]
    assert MAKE.page(CONTENT["items"], made) == PAGE


def same(line: str, other: str) -> bool:
    """Equal texts, and numbers equal to eight digits or to half a unit of the last digit: round-off differs between machines."""
    if NUMBER.sub("#", line) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(line), NUMBER.findall(other), strict=True)
    return all(math.isclose(float(a), float(b), rel_tol=1e-8, abs_tol=1e-9) for a, b in pairs)


@pytest.mark.parametrize(("item", "shown"), RUN, ids=[item for item, _ in RUN])
def test_commands_print_what_the_page_says(item, shown, folder, monkeypatch):
    MAKE.lay_out(folder, CONTENT["inputs"])
    absent = [name for name in CONTENT["inputs"]["files"] if not (folder / name).exists()]
    if any(name in command for name in absent for command in shown["typed"]):
        pytest.skip("no ../shared beside the project: reference files are not on this machine")
    monkeypatch.setenv("COLUMNS", "120")
    printed = MAKE.transcript(shown)
    start = f"### {item}: "
    section = PAGE[PAGE.index(start) :].split("\n### ")[0]
    block = next(
        block
        for block in re.findall(r"```text\n(.*?)\n```\n", section, re.DOTALL)
        if block.startswith(f"$ {shown['typed'][0]}\n")
    )
    said = block.split("\n")
    assert len(printed) == len(said), "\n".join(printed)
    for line, expected in zip(printed, said, strict=True):
        assert same(line, expected), (line, expected)


def test_another_number_is_seen():
    assert same("lines 233, from 1.7428 MHz", "lines 233, from 1.7428 MHz")
    assert not same("lines 233, from 1.7428 MHz", "lines 234, from 1.7428 MHz")
    assert not same("lines 233, from 1.7428 MHz", "lines 233, from 1.7429 MHz")
    assert not same("note: left out", "note: kept")


def test_round_off_does_not_change_the_page():
    """The last bits of a sum differ between machines: a step of round-off is a bound, and a line is cut between values."""
    steps = [f"converged: the next step would be {size} standard errors" for size in ("2.1e-07", "2.6e-07", "0.012")]
    bounded = "converged: the next step would be below 1e-06 standard errors"
    assert [MAKE._shown(text, None) for text in steps] == [bounded, bounded, steps[2]]
    values = ("1 1,-987.1147471466119,-15.889,0.284", "1 1,-987.114747146612,-15.889,0.284")
    assert [MAKE._shown(text, 28) for text in values] == [f"{text[: text.index('-15')]} ..." for text in values]
