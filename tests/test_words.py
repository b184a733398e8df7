"""Words that were given up stay away: `tests/retired.txt` against the names in the syntax trees.

Why, and which word stands for each now: docs/glossary.md.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from tests.import_graph import ROOT, modules

RETIRED = frozenset(
    line
    for line in (Path(__file__).parent / "retired.txt").read_text("utf-8").splitlines()
    if line and not line.startswith("#")
)


def names(tree: ast.AST) -> Iterator[str]:
    """Yield the names that a module gives: classes, functions, arguments, attributes, values."""
    for node in ast.walk(tree):
        match node:
            case ast.ClassDef(name=name) | ast.FunctionDef(name=name):
                yield name
            case ast.AsyncFunctionDef(name=name) | ast.Attribute(attr=name):
                yield name
            case ast.Name(id=name, ctx=ast.Store()):
                yield name


def test_names_are_found() -> None:
    source = "class Old:\n    def tell(self, told):\n        self.late_us = taken = told.agenda\n"
    assert {*names(ast.parse(source))} == {"Old", "tell", "late_us", "taken", "agenda"}


def test_no_retired_word_is_left() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {name}"
        for module, path in modules().items()
        for name in (*module.split("."), *names(ast.parse(path.read_text("utf-8"))))
        if name.lstrip("_") in RETIRED
    ]
    assert found == []
