"""The documentation site: docs/*.md, one page a verb, the executed notebooks and the reference of the API.

    python docs/make_site.py [FOLDER]        # build/site unless a folder is given; a warning is an error

The pages are brought together in a folder of their own (MyST Markdown), then Sphinx makes HTML of them. Nothing is fetched. Needs
the extra `docs`.
"""

from __future__ import annotations

import contextlib
import io
import logging
import re
import shutil
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path.insert(0, str(DOCS / "site"))

CONTENTS = {
    "Tutorials": ["quick_start", "coming_from", "notebooks/*"],
    "How-to": ["how_to/*"],
    "Explanation": [],  # all pages of docs/ that no other part names
    "Reference: command line": ["command_line", "options", "scenes", "verbs/*"],
    "Reference: data and conventions": [
        "conventions",
        "library",
        "spcat_codes",
        "spin_weights",
        "migration",
        "dependencies",
    ],
    "Reference: API": ["api/index", "api/rotor*"],
    "Validation": ["validation/*"],
}


def prepare(folder: Path) -> None:
    """Write all pages, pictures and notebooks of the site into an empty folder."""
    (folder / "notebooks").mkdir(parents=True)
    (folder / "api").mkdir()
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        (folder / page.name).write_text(on_the_site(text), encoding="utf-8")
    for part in ("how_to", "validation"):
        (folder / part).mkdir()
        for page in sorted((DOCS / part).glob("*.md")):
            (folder / part / page.name).write_text(one_level_down(page.read_text("utf-8")), encoding="utf-8")
    (folder / "verbs").mkdir()
    for verb in verbs():
        (folder / "verbs" / f"{verb}.md").write_text(one_level_down(verb_page(verb)), encoding="utf-8")
    (folder / "conventions.md").write_text(
        on_the_site((ROOT / "CONVENTIONS.md").read_text(encoding="utf-8")), encoding="utf-8"
    )
    shutil.copytree(DOCS / "pictures", folder / "pictures")
    for notebook in sorted((ROOT / "examples").glob("[0-9][0-9]_*.ipynb")):
        shutil.copy(notebook, folder / "notebooks")
    write_reference(folder / "api")
    with (folder / "index.md").open("a", encoding="utf-8") as index:
        index.write(contents(folder))


def on_the_site(text: str) -> str:
    """Links that lead out of docs/ turned to where their target stands on the site."""
    text = re.sub(r"\]\((?:\.\./)?examples/(\d\d_\w+)\.py\)", r"](notebooks/\1.ipynb)", text)
    text = re.sub(r"\]\((?:\.\./)?CONVENTIONS\.md\)", "](conventions.md)", text)
    text = re.sub(r"\]\(docs/", "](", text)
    return re.sub(r"\[([^\]]+)\]\(\.\./[^)]*\)", r"\1", text)  # files that are not on the site: their name remains


def one_level_down(text: str) -> str:
    """Links of a page in a folder of docs: to pages and pictures of the site, elsewhere the name of the file alone."""
    text = re.sub(r"\]\(\.\./\.\./CONVENTIONS\.md\)", "](../conventions.md)", text)
    text = text.replace("```mermaid", "```text")  # Sphinx has no drawing of it
    return re.sub(r"\[([^\]]+)\]\(\.\./\.\./[^)]*\)", r"\1", text)


def contents(folder: Path) -> str:
    """The table of contents: hidden lists that Sphinx shows beside every page."""
    named = {page for pages in CONTENTS.values() for page in pages} | {"index"}
    subjects = [page.stem for page in sorted(DOCS.glob("*.md")) if page.stem not in named]
    parts = []
    for title, pages in CONTENTS.items():
        entries = "\n".join(pages or subjects)
        parts.append(f"\n```{{toctree}}\n:hidden:\n:glob:\n:caption: {title}\n\n{entries}\n```\n")
    return "".join(parts)


# ---- one page a verb


def verbs() -> list[str]:
    """The verbs of the command, in the order of its help."""
    import typer

    from rotor import cli

    return list(typer.main.get_command(cli._application()).commands)


def verb_page(verb: str) -> str:
    """docs/verbs/VERB.md, then the help as the command prints it."""
    page = DOCS / "verbs" / f"{verb}.md"
    if not page.exists():
        raise ValueError(f"docs/verbs/{verb}.md is missing: write it, since the command has that verb")
    return f"{page.read_text(encoding='utf-8')}\n## Help\n\n```text\n{_help(verb)}```\n"


def _help(verb: str) -> str:
    from rotor import cli

    with contextlib.redirect_stdout(io.StringIO()) as printed:
        cli.run([verb, "--help"])
    return printed.getvalue()


# ---- the reference of the API


def write_reference(folder: Path) -> None:
    """One page a folder of the package, and the page of the public names."""
    import api_pages

    complaints = api_pages.Complaints()
    logging.getLogger("griffe").addHandler(complaints)
    package = api_pages.load(ROOT)
    for name in api_pages.packages(ROOT):
        (folder / f"{name}.md").write_text(api_pages.package_page(package, name, ROOT), encoding="utf-8")
    (folder / "index.md").write_text(public_page(package), encoding="utf-8")
    logging.getLogger("griffe").removeHandler(complaints)
    if complaints.texts:
        raise ValueError(
            "docstrings that cannot be read; correct their numpy-style sections:\n" + "\n".join(complaints.texts)
        )


def public_page(package: Any) -> str:
    """The names that `import rotor` gives, each leading to its entry."""
    import api_pages

    import rotor

    known, rows = api_pages.documented(package, ROOT), []
    names = [(rotor, name) for name in sorted(set(rotor.__all__) - {"__version__"})]
    for module, name in [*names, *((rotor.api, name) for name in rotor.api.__all__)]:
        thing = getattr(module, name)
        if module is rotor and name in (
            *rotor.VERBS,
            "api",
        ):  # made from the declaration of the verb; the options page has its arguments
            rows.append(f"| `rotor.{name}` | {thing.__doc__.strip().splitlines()[0]} |")
            continue
        if not hasattr(thing, "__qualname__"):  # a module of building blocks, or a constant
            rows.append(f"| `{module.__name__}.{name}` | {_of_constant(thing)} |")
            continue
        place = f"{thing.__module__}.{thing.__qualname__}"
        if isinstance(thing, type) and thing.__name__ not in vars(sys.modules[thing.__module__]):
            rows.append(
                f"| `{module.__name__}.{name}` | {thing.__doc__.strip().splitlines()[0]} The options page has its keys. |"
            )
            continue  # made from the declaration of a verb
        if place not in known:
            raise ValueError(
                f"{module.__name__}.{name} is {place}, which has no entry in the reference: its module must be public"
            )
        summary = (thing.__doc__ or "").strip().splitlines()[0].replace("|", "\\|")
        rows.append(f"| {{py:obj}}`{module.__name__}.{name} <{place}>` | {summary} |")
    table = "\n".join(["| name | what it is |", "|---|---|", *rows])
    return f"# API\n\nThe public names of the package:\n\n{table}\n\nThe other pages of this part have all modules, folder by folder.\n"


def _of_constant(thing: Any) -> str:
    """A module by its first line, a number by its value, others by what they hold."""
    if isinstance(thing, ModuleType):
        return (thing.__doc__ or "").strip().splitlines()[0].replace("|", "\\|")
    if isinstance(thing, float):
        return f"the number {thing!r}"
    return f"the {type(thing).__name__} of {', '.join(f'`{type(part).__name__}`' for part in thing)}"


def build(out: Path) -> int:
    """Make the site in `out`; the exit code of Sphinx, whose warnings are errors."""
    from sphinx.cmd.build import build_main

    with tempfile.TemporaryDirectory() as work:
        source = Path(work) / "source"
        prepare(source)
        options = ["-W", "--keep-going", "-q", "-c", str(DOCS / "site"), "-d", f"{work}/doctrees"]
        return build_main([*options, str(source), str(out)])


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "site"))
