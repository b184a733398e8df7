from __future__ import annotations

from tests.host.canmon.tui.pilot import DRIVE
from tickrig.host.canmon.tui.picture import picture


def test_a_picture_shows_the_log_and_what_keys_do() -> None:
    svg = picture(str(DRIVE), ["o"])
    assert svg.startswith("<svg")
    text = svg.replace("&#160;", " ")
    assert "frames CAN-ID" in text
    assert "134 frames" in text
