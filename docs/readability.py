"""Words, sentences over 30 words and grade (Flesch and Kincaid) of pages: a signal for whoever writes, never a threshold.

    python docs/readability.py README.md docs/*.md            # a row a page
    python docs/readability.py --long docs/fit.md             # with its long sentences

Code, tables and headings are left out. The grade is 0.39 words/sentence + 11.8 syllables/word - 15.59 (J. P. Kincaid et al.,
Research Branch Report 8-75, Naval Technical Training, 1975). Syllables are groups of vowels: grades compare pages with each other alone.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

LONG = 30  # words of a sentence
WORD = r"[^\W\d_][\w’'-]*"


def sentences(text: str) -> list[str]:
    """Sentences of the prose of a Markdown page."""
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    text = re.sub(r"^(    |\||#|!\[).*$", "\n", text, flags=re.MULTILINE)
    text = re.sub(r"`[^`]*`", "Code", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text))
    paragraphs = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", text)
    parts = [
        part
        for paragraph in paragraphs
        for part in re.split(r"(?<=[.!?:])\s+(?=[A-Z(`\d⟨])", " ".join(paragraph.split()))
    ]
    return [part for part in parts if len(re.findall(WORD, part)) > 2]


def syllables(word: str) -> int:
    """Groups of vowels, without a silent e at the end."""
    return max(1, len(re.findall(r"[aeiouy]+", re.sub(r"(?<![lL])e$", "", word.lower()))))


def grade(parts: list[str]) -> float:
    """Years of school of Flesch and Kincaid."""
    words = [word for part in parts for word in re.findall(WORD, part)]
    return 0.39 * len(words) / len(parts) + 11.8 * sum(map(syllables, words)) / len(words) - 15.59


def main() -> None:
    """Print a row for each page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--long", action="store_true", help=f"print the sentences of more than {LONG} words")
    arguments = parser.parse_args()
    print(f"{'words':>6} {'sentences':>9} {'over 30':>8} {'grade':>6}  page")
    for page in arguments.pages:
        text = page.read_text(encoding="utf-8")
        parts = sentences(text)
        if not parts:
            continue
        long = [part for part in parts if len(re.findall(WORD, part)) > LONG]
        print(f"{len(text.split()):6} {len(parts):9} {len(long):8} {grade(parts):6.1f}  {page}")
        if arguments.long:
            print("".join(f"    {part}\n" for part in long), end="")


if __name__ == "__main__":
    main()
