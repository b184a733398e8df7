from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.host.canmon.tui.pilot import DRIVE

TOOL = Path(__file__).parents[4] / "tools" / "canmon_picture.py"


def test_a_picture_shows_the_log_and_what_keys_do(tmp_path: Path) -> None:
    picture = tmp_path / "picture.svg"
    subprocess.run([sys.executable, TOOL, DRIVE, picture, "o"], check=True)
    svg = picture.read_text("utf-8")
    assert svg.startswith("<svg")
    assert "@font-face" not in svg
    text = svg.replace("&#160;", " ")
    assert "frames CAN-ID" in text
    assert "134 frames" in text


TABS = Path(__file__).parents[4] / "tools" / "canmon_tabs_picture.py"


def test_the_pictures_of_the_tabs_are_drawn_from_the_same_run_to_the_same_bytes(
    tmp_path: Path,
) -> None:
    wanted = ("nodes", "alarms")
    for folder, seed in (("first", "1"), ("second", "2")):
        subprocess.run(
            [sys.executable, TABS, tmp_path / folder, *(f"{tab}-80x24" for tab in wanted)],
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        )
    for name in wanted:
        first, second = (
            (tmp_path / folder / "80x24" / f"canmon-{name}.svg").read_text("utf-8")
            for folder in ("first", "second")
        )
        assert first == second
    text = (tmp_path / "first/80x24/canmon-nodes.svg").read_text("utf-8")
    assert "2418/100\N{NO-BREAK SPACE}ms\N{NO-BREAK SPACE}LATE" in text
    assert len(text) < 20_000
