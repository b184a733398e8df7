from __future__ import annotations

import runpy

from tests.host.rtc.canopen.bench import EXAMPLES

TOOL = EXAMPLES.parent / "tools" / "rtc_edit_picture.py"


def test_the_picture_is_the_editor() -> None:
    svg = runpy.run_path(str(TOOL))["picture"](EXAMPLES / "rh3_cart.toml").replace("&#160;", " ")
    for text in ("RefHardRh30", "PathFollower0", "6 components", "marked: OmniTo2WD0.goal", "▶"):
        assert text in svg
    assert "@font-face" not in svg
