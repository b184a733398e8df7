"""A folder has at most 15 entries, and says in a sentence what lives there."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MOST = 15
ROOMS = [
    folder
    for floor in ("wire", "device", "host", "emulators")
    for folder in (ROOT / floor, *(ROOT / floor).rglob("*/"))
    if any(folder.glob("*.py"))
]


@pytest.mark.parametrize("room", ROOMS, ids=[str(room.relative_to(ROOT)) for room in ROOMS])
def test_a_room_is_small_and_says_what_lives_there(room: Path) -> None:
    modules = {path.name for path in room.glob("*.py")} - {"__init__.py"}
    rooms = {path.parent.name for path in room.glob("*/__init__.py")}
    assert len(modules | rooms) <= MOST
    assert ast.get_docstring(ast.parse((room / "__init__.py").read_text("utf-8")))
