from __future__ import annotations

from tests.host.rtc_canopen.bench import EXAMPLES
from tickrig.emulators.canopen.editor_picture import picture


def test_the_picture_is_the_editor() -> None:
    svg = picture(EXAMPLES).replace("&#160;", " ")
    for text in ("16 Palette0", "16.tpdo2 → 32.rpdo2", "16384", "PdoLinked", "marked"):
        assert text in svg
