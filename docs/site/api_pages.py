"""The reference of the API as MyST pages: one a folder of rotor, made from signatures and docstrings by griffe.

Docstrings are plain text in Markdown; numpy-style sections become headed lists. Nothing is imported to make a page.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

OMITTED = ("cli",)  # the command line has pages of its own


def packages(root: Path) -> list[str]:
    """Dotted names of the folders of rotor that hold public modules, from the root down."""
    return [".".join(folder.relative_to(root).parts) for folder in _folders(root) if _modules(folder)]


def _folders(root: Path) -> Iterator[Path]:
    for init in sorted((root / "rotor").rglob("__init__.py"), key=lambda path: path.parent.parts):
        if not set(init.parent.relative_to(root / "rotor").parts) & set(OMITTED):
            yield init.parent


def _modules(folder: Path) -> list[str]:
    return [path.stem for path in sorted(folder.glob("*.py")) if not path.stem.startswith("_")]


def load(root: Path) -> Any:
    """The package as griffe reads it, without running it."""
    import griffe

    extensions = griffe.load_extensions()  # those built in: fields of dataclasses are parameters
    return griffe.load(
        "rotor", search_paths=[str(root)], docstring_parser="numpy", extensions=extensions, allow_inspection=False
    )


class Complaints(logging.Handler):
    """What griffe says about docstrings that it cannot read; texts collects it."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Collect one."""
        self.texts.append(record.getMessage())


def package_page(package: Any, name: str, root: Path) -> str:
    """All public modules of the folder `name`."""
    folder = package if name == "rotor" else package[name.removeprefix("rotor.")]
    parts = [f"# {name}", _plain(folder.docstring)]
    for stem in _modules(root.joinpath(*name.split("."))):
        parts += [f"## {name}.{stem}", f"```{{py:module}} {name}.{stem}\n```", _text(folder.modules[stem])]
        parts += [_member(member, 8) for member in _public(folder.modules[stem])]
    return "\n\n".join(part for part in parts if part) + "\n"


def documented(package: Any, root: Path) -> set[str]:
    """Dotted names of all classes and functions that have an entry."""
    names = set()
    for name in packages(root):
        folder = package if name == "rotor" else package[name.removeprefix("rotor.")]
        for stem in _modules(root.joinpath(*name.split("."))):
            names |= {member.path for member in _public(folder.modules[stem])}
    return names


def first_line(member: Any) -> str:
    """What a docstring says first."""
    return _plain(member.docstring).splitlines()[0] if member.docstring else ""


def _public(parent: Any) -> list[Any]:
    """Classes, functions and documented attributes that are defined here, in the order of the source."""
    own = [one for one in parent.members.values() if not one.is_alias and not one.name.startswith("_")]
    own = [one for one in own if one.is_class or one.is_function or (one.is_attribute and one.docstring)]
    return sorted(own, key=lambda one: one.lineno or 0)


def _member(member: Any, fence: int) -> str:
    """One entry: a directive of Sphinx's Python domain with the docstring, and the members of a class, inside it."""
    kind = {"class": "class", "function": "method" if member.parent.is_class else "function"}.get(
        member.kind.value, "attribute"
    )
    name = f"{member.parent.name}.{member.name}" if member.parent.is_class else member.name
    if "property" in member.labels or kind == "attribute":
        kind, signature = ("property" if "property" in member.labels else "attribute" if "." in name else "data"), ""
    else:
        signature = _signature(member)
    inside = [_text(member)]
    if member.is_class:
        inside += [_member(one, fence - 1) for one in _public(member)]
    body = "\n\n".join(part for part in inside if part)
    ticks = "`" * fence
    return f"{ticks}{{py:{kind}}} {name}{signature}\n\n{body}\n{ticks}"


def _signature(member: Any) -> str:
    """(a, b=1, *, c: int) -> float, as the source spells it."""
    texts, star = [], False
    for one in member.parameters:
        if one.name in ("self", "cls"):
            continue
        if one.kind and one.kind.value == "keyword-only" and not star:
            texts.append("*")
        star = star or (one.kind is not None and one.kind.value in ("keyword-only", "variadic positional"))
        prefix = {"variadic positional": "*", "variadic keyword": "**"}.get(one.kind.value if one.kind else "", "")
        kind = f": {_spelled(one.annotation)}" if one.annotation is not None else ""
        default = f" = {one.default}" if one.default is not None and not prefix else ""
        texts.append(f"{prefix}{one.name}{kind}{default}")
    returns = f" -> {_spelled(member.returns)}" if member.is_function and member.returns is not None else ""
    return f"({', '.join(texts)}){returns}".replace("\n", " ")


def _spelled(annotation: Any) -> str:
    """An annotation with full names of what rotor defines, so that each leads to one entry; Sphinx shows the last part."""
    if isinstance(annotation, str):
        return annotation
    path = getattr(annotation, "canonical_path", "")
    if type(annotation).__name__ in ("ExprName", "ExprAttribute"):
        return path if path.startswith("rotor.") else str(annotation)
    return "".join(_spelled(part) for part in annotation.iterate(flat=False))


def _text(member: Any) -> str:
    """A docstring as Markdown: text, then the numpy-style sections as headed lists."""
    if not member.docstring:
        return ""
    return "\n\n".join(_section(section) for section in member.docstring.parsed)


def _section(section: Any) -> str:
    kind = section.kind.value
    if kind == "text":
        return _markdown(section.value)
    if kind == "examples":
        return "\n\n".join(_markdown(text) for _, text in section.value)
    if kind == "admonition":
        return f"**{section.title or 'Note'}**\n\n{_markdown(section.value.contents)}"
    return f"**{kind.capitalize()}**\n\n" + "\n".join(_item(one) for one in section.value)


def _item(one: Any) -> str:
    name = getattr(one, "name", "") or ""
    kind = f"`{one.annotation}`" if one.annotation is not None else ""
    text = _markdown(one.description).replace("\n", "\n  ")
    return f"- {f'**{name}** ' if name else ''}{kind}: {text}"


def _plain(docstring: Any) -> str:
    return docstring.value.split("\n\n")[0].replace("\n", " ") if docstring else ""


def _markdown(text: str) -> str:
    """Sessions that begin with >>> become code; a name in angle brackets is no tag of HTML, an asterisk no emphasis."""
    parts = re.split(r"(^>>> .*?(?:\n\n|\Z))", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(_session(part) if part.startswith(">>> ") else _escaped(part) for part in parts)


def _session(part: str) -> str:
    return f"```pycon\n{part.rstrip()}\n```\n\n"


def _escaped(part: str) -> str:
    lines = [line if line.startswith("    ") else _escaped_line(line) for line in part.split("\n")]
    return "\n".join(lines)


def _escaped_line(line: str) -> str:
    pieces = re.split(r"(`[^`]*`)", line)
    return "".join(piece if piece.startswith("`") else re.sub(r"([*<_\[\]])", r"\\\1", piece) for piece in pieces)
