from __future__ import annotations

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
    text = svg.replace("&#160;", " ")
    assert "frames CAN-ID" in text
    assert "134 frames" in text
