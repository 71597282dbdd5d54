"""Options that a help text names and docs/options.md does not."""

import re

from places import PROJECT

PAGE = PROJECT / "docs" / "options.md"


def undocumented(verb: str, help_text: str) -> set[str]:
    """Options in the help of a verb that neither the head of the page nor the part of the verb names."""
    head, *parts = PAGE.read_text(encoding="utf-8").split("\n## ")
    text = head + next(part for part in parts if part.startswith(f"{verb}\n"))
    return {flag for flag in re.findall(r"--[a-z][a-z-]+", help_text.split("Examples:")[0]) if f"`{flag}" not in text}
