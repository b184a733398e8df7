"""Words that were given up stay away: `tests/retired.txt` against the names in the syntax trees.

Why, and which word stands for each now: docs/glossary.md.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.import_graph import ROOT, modules

RETIRED = frozenset(
    line
    for line in (Path(__file__).parent / "retired.txt").read_text("utf-8").splitlines()
    if line and not line.startswith("#")
)


def names(tree: ast.AST) -> Iterator[str]:
    """Yield the names of classes, functions, their arguments, attributes, fields."""
    for node in ast.walk(tree):
        match node:
            case ast.ClassDef(name=name, body=body):
                yield name
                yield from _fields(body)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name
            case ast.Attribute(attr=name) | ast.arg(arg=name):
                yield name
            case ast.Module(body=body):
                yield from _fields(body)


def _fields(body: list[ast.stmt]) -> Iterator[str]:
    """Yield what stands in the body of a class or a module: fields, constants."""
    for statement in body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name


def test_names_are_found() -> None:
    source = (
        "class A:\n    b = 1\n    c: int\n    def d(self, e):\n        self.f = l = e.g\nH = 1\n"
    )
    assert {*names(ast.parse(source))} == {"A", "b", "c", "d", "self", "e", "f", "g", "H"}


def retired(module: str, text: str) -> list[str]:
    """Return the retired names of a module; parsed is what has such a word at all."""
    words = {word.lstrip("_") for word in re.findall(r"\w+", text)}
    inside = () if RETIRED.isdisjoint(words) else names(ast.parse(text))
    return [name for name in (*module.split("."), *inside) if name.lstrip("_") in RETIRED]


def test_retired_names_are_found() -> None:
    assert retired("tickrig.drum", "def f(__Beat): ...\n") == ["__Beat"]
    assert retired("tickrig.Beat", "def f(a): Beat = a\n") == ["Beat"]


def test_no_retired_word_is_left() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {name}"
        for module, path in modules().items()
        for name in retired(module, path.read_text("utf-8"))
    ]
    assert found == []
