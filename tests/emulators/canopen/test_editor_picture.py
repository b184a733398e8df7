from __future__ import annotations

import runpy

from tests.host.rtc.canopen.bench import EXAMPLES

TOOL = EXAMPLES.parent / "tools" / "rtc_canopen_editor_picture.py"


def test_the_picture_is_the_editor() -> None:
    svg = runpy.run_path(str(TOOL))["picture"](EXAMPLES).replace("&#160;", " ")
    for text in ("16 Palette0", "16.tpdo2 → 32.rpdo2", "16384", "PdoLinked", "marked"):
        assert text in svg
    assert "@font-face" not in svg
