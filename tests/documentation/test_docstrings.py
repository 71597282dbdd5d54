"""Functions of the public face describe their parameters and results; sections anywhere agree with the signature."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest
from places import PROJECT

import rotor

ROOT = PROJECT / "rotor"
MOST_WITHOUT = 3  # parameters that a function may have without sections
PUBLIC = {
    getattr(item, "__qualname__", "") for item in (getattr(rotor, name) for name in rotor.__all__) if callable(item)
}
MODULES = [path for path in sorted(ROOT.rglob("*.py")) if path.relative_to(ROOT).parts[0] != "cli"]

GOOD = '''"""Adds.

    Parameters
    ----------
    a, b : int
        Terms.
    *rest : int
        Further ones.
    sign : int, optional
        1 or -1.

    Returns
    -------
    int
        The sum.
    """'''


def functions(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Public functions and methods of public classes, overloads left out."""
    public = [node for node in tree.body if not getattr(node, "name", "").startswith("_")]
    members = [member for node in public if isinstance(node, ast.ClassDef) for member in node.body]
    for node in public + members:
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or node.name.startswith("_"):
            continue
        if not any(ast.unparse(decorator).endswith("overload") for decorator in node.decorator_list):
            yield node


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    """Names in the order of the signature, without self and cls."""
    arguments = function.args
    named = [*arguments.posonlyargs, *arguments.args, *filter(None, [arguments.vararg]), *arguments.kwonlyargs]
    return [
        argument.arg for argument in [*named, *filter(None, [arguments.kwarg])] if argument.arg not in ("self", "cls")
    ]


def sections(docstring: str) -> dict[str, str]:
    """The text under each heading that is underlined."""
    parts = re.split(r"^(\w[\w ]*)\n-{3,}$", docstring, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def described(section: str) -> list[str]:
    """The names that a section of parameters has entries for."""
    heads = [line.split(" :")[0] for line in section.splitlines() if line and not line[0].isspace()]
    return [name.strip().lstrip("*") for head in heads for name in head.split(",")]


def faults(function: ast.FunctionDef | ast.AsyncFunctionDef, is_public: bool = True) -> list[str]:
    """Missing sections of a function of the public face, and sections that disagree with the signature of any function."""
    computed, names = sections(ast.get_docstring(function) or ""), parameters(function)
    out = []
    if is_public and len(names) > MOST_WITHOUT:
        returns = function.returns is not None and ast.unparse(function.returns) != "None"
        expected = ("Parameters", "Returns") if returns else ("Parameters",)
        out += [f"no section {name}" for name in expected if name not in computed]
    if "Parameters" in computed:
        entries = described(computed["Parameters"])
        out += [f"{name} is not described" for name in names if name not in entries]
        out += [f"{name} is described but not a parameter" for name in entries if name not in names]
    lists = [name for name in ("Parameters", "Returns", "Raises") if name in computed]
    out += [
        f"text after {name} without a heading" for name in lists if re.search(r"\n\n(?=\S)", computed[name].rstrip())
    ]
    return out


@pytest.mark.parametrize("folder", sorted({path.relative_to(ROOT).parts[0] for path in MODULES}))
def test_sections_agree_with_signatures(folder: str) -> None:
    """Each module of one folder, by its source alone."""
    wrong = []
    for path in MODULES:
        within = path.relative_to(ROOT)
        if within.parts[0] != folder or (path.stem.startswith("_") and path.stem != "__init__"):
            continue
        for function in functions(ast.parse(path.read_text(encoding="utf-8"))):
            wrong += [
                f"rotor/{within}:{function.lineno} {function.name}: {fault}"
                for fault in faults(function, function.name in PUBLIC)
            ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("", "", None),
        ("    a, b : int", "    a : int", "b is not described"),
        ("    sign : int", "    signs : int", "signs is described but not a parameter"),
        ("    Returns\n    -------", "", "no section Returns"),
        ("    Parameters\n    ----------", "", "no section Parameters"),
        ("        The sum.", "        The sum.\n\n    >>> add(1, 2)\n    3", "text after Returns without a heading"),
    ],
)
def test_faults_of_a_docstring_are_found(old: str, new: str, fault: str | None) -> None:
    """A complete docstring has no fault; each change of it has the fault expected."""
    source = f"def add(a, b, *rest, sign=1) -> int:\n    {GOOD.replace(old, new) if old else GOOD}\n"
    (function,) = functions(ast.parse(source))
    assert (fault in faults(function)) if fault else faults(function) == []
