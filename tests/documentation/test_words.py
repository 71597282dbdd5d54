"""Names and texts of the package use the words of the field and of ordinary software, no metaphors."""

from __future__ import annotations

import re

import pytest
from places import PROJECT

PACKAGE = PROJECT / "rotor"
WORDS = (
    "wanted", "wants", "unwanted", "kept", "told", "handed", "mended", "mend", "thrown", "house", "houses",
    "room", "rooms", "door", "doors", "whoever", "nobody", "anybody", "somebody",
)  # fmt: skip
FORBIDDEN = re.compile(rf"(?<![A-Za-z])({'|'.join(WORDS)})(?![A-Za-z])", re.IGNORECASE)
VAGUE = re.compile(r"^\s*def (?:\w*_)?(?:of|one|some|every|found|own|asked|given)(?:_\w*)?\(", re.MULTILINE)
MOST_VAGUE = 230  # functions with such a name; lower it with each one that is renamed
ORDINARY = re.compile(r"(left|right)[-_]handed|room[-_ ]temperature", re.IGNORECASE)  # of frames and of samples


def found_in(text: str) -> list[str]:
    """The words that do not belong, in identifiers (between underscores too) and in prose."""
    return FORBIDDEN.findall(ORDINARY.sub("", text))


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_module_uses_ordinary_words(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [f"line {i}: {line.strip()}" for i, line in enumerate(lines, 1) if found_in(line)] == []


@pytest.mark.parametrize(
    "text", ["kept = 1", "_kept(x)", "q_wanted", "def door_of():", "# it wants A", "message: 'told'", "ROOM_WIDTH = 3"]
)
def test_the_guard_sees_words_in_names_and_texts(text):
    assert found_in(text)


@pytest.mark.parametrize(
    "text", ["right-handed frames", "ROOM_TEMPERATURE_K", "_right_handed(frame)", "bedroom", "handedness", "indoors"]
)
def test_the_guard_leaves_ordinary_words_alone(text):
    assert not found_in(text)


def test_functions_with_vague_names_do_not_increase():
    assert sum(len(VAGUE.findall(path.read_text(encoding="utf-8"))) for path in PACKAGE.rglob("*.py")) <= MOST_VAGUE


@pytest.mark.parametrize(
    "name", ["of", "of_strength", "rows_of", "lines_of_block", "_one_way", "every_limit", "own_name"]
)
def test_the_guard_counts_vague_names(name):
    assert VAGUE.search(f"    def {name}(self):")
    assert not VAGUE.search(f"    def {name.replace('_', '')}x(self):")
