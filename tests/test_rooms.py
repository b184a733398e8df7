"""The rooms of the house: neither narrow nor deep, named, and without circles."""

from __future__ import annotations

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

from tests.import_graph import FLOORS, ROOT, Graph, circles, imports, modules

MOST = 25
DEEPEST = 3
"""Folders below a floor."""
ROOMS = [
    folder
    for floor in FLOORS
    for folder in (ROOT / floor, *(ROOT / floor).rglob("*/"))
    if any(folder.glob("*.py"))
]
PACKAGES = sorted(name for name, path in modules().items() if path.name == "__init__.py")


@cache
def graph() -> Graph:
    """Read the imports, for the first test that asks: not each time that tests are collected."""
    return imports()


@pytest.mark.parametrize("room", ROOMS, ids=[str(room.relative_to(ROOT)) for room in ROOMS])
def test_a_room_has_a_size_and_says_what_lives_there(room: Path) -> None:
    assert len(room.relative_to(ROOT).parts) <= DEEPEST + 1
    modules = {path.name for path in room.glob("*.py")} - {"__init__.py"}
    rooms = {path.parent.name for path in room.glob("*/__init__.py")}
    assert len(modules | rooms) <= MOST
    assert ast.get_docstring(ast.parse((room / "__init__.py").read_text("utf-8")))


def test_a_folder_of_pages_is_small() -> None:
    for folder in (ROOT / "docs", *(ROOT / "docs").rglob("*/")):
        entries = [path.name for path in folder.iterdir() if path.name != "__pycache__"]
        assert len(entries) <= MOST, f"{folder.relative_to(ROOT)} holds {sorted(entries)}"


def test_a_circle_is_found() -> None:
    ring = {"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}
    assert circles({name: frozenset(used) for name, used in ring.items()}) == [["b", "c"]]


def test_no_modules_need_each_other_at_run_time() -> None:
    assert circles(graph()) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_rooms_side_by_side_need_each_other(package: str) -> None:
    assert circles(between(package)) == []


def between(package: str) -> dict[str, frozenset[str]]:
    """Return which entries of a package import which others of it."""

    def entry(name: str) -> str:
        return name.removeprefix(f"{package}.").partition(".")[0]

    found: defaultdict[str, set[str]] = defaultdict(set)
    for name, used in graph().items():
        if name.startswith(f"{package}."):
            inner = {entry(other) for other in used if other.startswith(f"{package}.")}
            found[entry(name)] |= inner - {entry(name)}
    return {name: frozenset(used & found.keys()) for name, used in found.items()}
