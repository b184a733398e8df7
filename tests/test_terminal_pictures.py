"""The moving pictures of terminals show what their commands say."""

from __future__ import annotations

import re
import runpy
from html import unescape
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.environment import ROOT

TOOL = runpy.run_path(str(ROOT / "tools" / "terminal_picture.py"))


def shown(svg: str) -> list[str]:
    """Return the lines, without the width of rules and gaps, which is pytest's own.

    Of a number only the digits are left that every processor and every pytest shows.
    """
    rows = [
        "".join(row.itertext()) for row in ElementTree.fromstring(svg).iter() if "text" in row.tag
    ]
    rows = [re.sub(r"(\.\d{6})\d+", r"\1", unescape(row)) for row in rows]
    return [re.sub(r"[\s=_-]+", " ", row).strip() for row in rows]


@pytest.mark.parametrize("name", TOOL["SCRIPTS"])
def test_a_picture_shows_what_the_commands_say(name: str) -> None:
    picture = ROOT / "docs" / "pictures" / f"{name}.svg"
    now = TOOL["draw"](name)
    again = f"python tools/terminal_picture.py {name} {picture.relative_to(ROOT)}"
    assert shown(picture.read_text("utf-8")) == shown(now), again
    assert Path(picture).stat().st_size < 40_000


@pytest.mark.parametrize("name", TOOL["SCRIPTS"])
def test_a_picture_begins_with_its_last_screen(name: str) -> None:
    """Nothing is hidden but by an animation, and that begins later."""
    picture = (ROOT / "docs" / "pictures" / f"{name}.svg").read_text("utf-8")
    style, _, _ = picture.partition("@keyframes")
    assert f"animation:0s step-end {TOOL['READ_S']}s infinite" in style
    assert "opacity" not in re.sub(r"@keyframes \w+\{(?:[\d.]+%\{[^}]*\})+\}", "", picture)
