"""Places of the package where one token can be changed, and the text of each change: what benchmarks/mutation.py draws from.

Left out, as no number depends on them: docstrings, annotations, decorators, texts of any kind (so also every message), what stands inside
a `raise`, blocks under TYPE_CHECKING, and the numbers in rotor/plots (sizes and colours of pictures).
"""

from __future__ import annotations

import ast
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

COMPARED = {
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "in": "not in",
    "not in": "in",
    "is": "is not",
    "is not": "is",
}
ARITHMETIC = {"+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "%": "*", "**": "*"}
REDUCED = {"all": "any", "any": "all", "min": "max", "max": "min", "argmin": "argmax", "argmax": "argmin"}
OPERATORS = ("comparison", "boolean", "arithmetic", "constant", "all/any", "guard removed", "raise removed", "return removed",
             "arguments swapped", "sign")  # fmt: skip
COMPILED = re.compile(r"kernel|inlined|compiled|jit\b")


@dataclass(frozen=True)
class Mutant:
    """One change: bytes start to end of a file become `after`; tests are looked for at a statement, or at all users of some names."""

    file: str
    line: int
    operator: str
    start: int
    end: int
    before: str
    after: str
    statement: int  # its first line; 0 where names stand for it
    names: tuple[str, ...]
    compiled: bool

    def applied(self, source: bytes) -> bytes:
        """The file with the change."""
        assert source[self.start : self.end].decode() == self.before
        return source[: self.start] + self.after.encode() + source[self.end :]


@dataclass(frozen=True)
class Place:
    """Where a node stands: its statement, the functions and classes around it, whether these are compiled."""

    statement: ast.stmt | None = None
    around: tuple[str, ...] = ()
    function: bool = False
    compiled: bool = False


class Source:
    """A file of the package with its tree and its bytes."""

    def __init__(self, root: Path, path: Path, inlined: frozenset[str]) -> None:
        self.file, self.bytes, self.inlined = str(path.relative_to(root)), path.read_bytes(), inlined
        self.tree = ast.parse(self.bytes)
        self.starts = [0]
        for line in self.bytes.split(b"\n"):
            self.starts.append(self.starts[-1] + len(line) + 1)

    def span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        """First and last byte of a node."""
        return self.starts[node.lineno - 1] + node.col_offset, self.starts[(node.end_lineno or 1) - 1] + (
            node.end_col_offset or 0
        )

    def text(self, node: ast.expr | ast.stmt) -> str:
        """The node as it is written."""
        start, end = self.span(node)
        return self.bytes[start:end].decode()

    def mutants(self) -> Iterator[Mutant]:
        """Every change of the file."""
        for node, place in self.nodes(self.tree, Place()):
            if place.statement is None:
                continue
            for operator, start, end, after in self.changes(node):
                line = self.bytes[:start].count(b"\n") + 1
                names = () if place.function and not place.compiled else self.names(place)
                yield Mutant(self.file, line, operator, start, end, self.bytes[start:end].decode(), after,
                             0 if names else place.statement.lineno, names, place.compiled)  # fmt: skip

    def names(self, place: Place) -> tuple[str, ...]:
        """What a compiled function or a statement outside functions is known by."""
        targets = (
            place.statement.targets
            if isinstance(place.statement, ast.Assign)
            else [getattr(place.statement, "target", None)]
        )
        bound = [node.id for target in targets if target for node in ast.walk(target) if isinstance(node, ast.Name)]
        return tuple(place.around) or tuple(bound) or (Path(self.file).stem,)

    def nodes(self, node: ast.AST, place: Place) -> Iterator[tuple[ast.AST, Place]]:
        """Nodes that may be changed, with their places."""
        for child in _children(node):
            here = place
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                compiled = (
                    any(COMPILED.search(self.text(decorator)) for decorator in child.decorator_list)
                    or child.name in self.inlined
                )
                inside = not isinstance(child, ast.ClassDef)
                name = () if place.function else (child.name,)
                here = Place(child, place.around + name, place.function or inside, place.compiled or compiled)
                for default in getattr(getattr(child, "args", None), "defaults", ()):
                    outside = Place(child, (*place.around, child.name), False, here.compiled)
                    yield default, outside
                    yield from self.nodes(default, outside)
            elif isinstance(child, ast.stmt):
                here = Place(child, place.around, place.function, place.compiled)
            yield child, here
            if not isinstance(child, ast.Raise):
                yield from self.nodes(child, here)

    def changes(self, node: ast.AST) -> Iterator[tuple[str, int, int, str]]:
        """Operator, span and new text of every change of a node."""
        match node:
            case ast.Compare():
                ends = [node.left, *node.comparators]
                yield from (
                    change for pair in pairwise(ends) for change in self._between(*pair, COMPARED, "comparison")
                )
            case ast.BoolOp():
                for pair in pairwise(node.values):
                    yield from self._between(*pair, {"and": "or", "or": "and"}, "boolean")
            case ast.BinOp() if not any(
                isinstance(operand, ast.Constant | ast.JoinedStr) and not _is_number(operand)
                for operand in (node.left, node.right)
            ):
                yield from self._between(node.left, node.right, ARITHMETIC, "arithmetic")
            case ast.UnaryOp(op=ast.Not()):
                yield "boolean", *self.span(node), self.text(node.operand)
            case ast.UnaryOp(op=ast.USub()):
                yield "sign", *self.span(node), self.text(node.operand)
            case ast.Constant() if (_is_number(node) or isinstance(node.value, bool)) and not self.file.startswith(
                "rotor/plots"
            ):
                yield "constant", *self.span(node), _other_constant(node.value)
            case ast.Call():
                yield from self._of_call(node)
            case ast.Return(value=ast.expr() as value) if not (isinstance(value, ast.Constant) and value.value is None):
                yield "return removed", *self.span(value), "None"
            case ast.Raise():
                yield "raise removed", *self.span(node), "pass"
            case ast.If() if not node.orelse and isinstance(
                node.body[-1], ast.Raise | ast.Return | ast.Continue | ast.Break
            ):
                yield "guard removed", *self.span(node.test), "False"

    def _between(
        self, left: ast.expr, right: ast.expr, table: dict[str, str], operator: str
    ) -> Iterator[tuple[str, int, int, str]]:
        start, end = self.span(left)[1], self.span(right)[0]
        match = re.search(
            r"not\s+in|is\s+not|\b(?:in|is|and|or)\b|\*\*|//|[<>=!]=|[-+*/%<>]", self.bytes[start:end].decode()
        )
        if match and " ".join(match[0].split()) in table:
            before = len(self.bytes[start:end].decode()[: match.start()].encode())
            yield operator, start + before, start + before + len(match[0].encode()), table[" ".join(match[0].split())]

    def _of_call(self, node: ast.Call) -> Iterator[tuple[str, int, int, str]]:
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name in REDUCED:
            end = self.span(node.func)[1]
            yield "all/any", end - len(name), end, REDUCED[name]
        if len(node.args) >= 2 and not any(isinstance(arg, ast.Starred) for arg in node.args[:2]):
            first, second = node.args[:2]
            if self.text(first) != self.text(second) and name not in (
                "isinstance",
                "getattr",
                "hasattr",
                "add_argument",
            ):
                start, end = self.span(first)[0], self.span(second)[1]
                middle = self.bytes[self.span(first)[1] : self.span(second)[0]].decode()
                yield "arguments swapped", start, end, self.text(second) + middle + self.text(first)


def _children(node: ast.AST) -> Iterator[ast.AST]:
    """Children of a node in which a change counts."""
    for name, value in ast.iter_fields(node):
        if name in ("decorator_list", "returns", "annotation", "args") and not isinstance(node, ast.Call | ast.Lambda):
            continue
        for child in value if isinstance(value, list) else [value]:
            text = isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            typing = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)
            if isinstance(child, ast.AST) and not (text or typing or isinstance(child, ast.JoinedStr)):
                yield child


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


def _other_constant(value: float) -> str:
    if isinstance(value, bool):
        return str(not value)
    return str(value + 1) if isinstance(value, int) else repr(1.5 * value if value else 1.0)


def sample(root: Path, count: int, seed: int) -> list[Mutant]:
    """Mutants drawn at random: as many of each operator, at most one a line, each another program."""
    paths = sorted((root / "rotor").rglob("*.py"))
    texts = "\n".join(path.read_text(encoding="utf-8") for path in paths)
    inlined = frozenset(re.findall(r"= inlined\(\w+\.(\w+)", texts))
    sources = {source.file: source for source in (Source(root, path, inlined) for path in paths)}
    pools: dict[str, list[Mutant]] = {operator: [] for operator in OPERATORS}
    for source in sources.values():
        for mutant in source.mutants():
            pools[mutant.operator].append(mutant)
    rng = random.Random(seed)
    drawn: list[Mutant] = []
    lines: set[tuple[str, int]] = set()
    for pool in pools.values():
        rng.shuffle(pool)
    while len(drawn) < count and any(pools.values()):
        for pool in pools.values():
            mutant = _next(pool, lines, sources)
            if mutant is not None:
                lines.add((mutant.file, mutant.line))
                drawn.append(mutant)
    rng.shuffle(drawn)  # a run that is cut off is a fair sample, too
    return drawn[:count]


def _next(pool: list[Mutant], lines: set[tuple[str, int]], sources: dict[str, Source]) -> Mutant | None:
    """The next mutant of an operator on another line than those drawn."""
    while pool:
        mutant = pool.pop()
        if (mutant.file, mutant.line) not in lines and _is_other(mutant, sources[mutant.file]):
            return mutant
    return None


def _is_other(mutant: Mutant, source: Source) -> bool:
    """Whether the change leaves a program, and another one."""
    try:
        return ast.dump(ast.parse(mutant.applied(source.bytes))) != ast.dump(source.tree)
    except SyntaxError:
        return False
