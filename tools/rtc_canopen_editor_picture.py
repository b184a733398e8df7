"""Draw the System Editor into an SVG file, on Fig. 120 in virtual time.

`python tools/rtc_canopen_editor_picture.py docs/pictures/rtc-canopen-editor.svg`
"""

from __future__ import annotations

import asyncio
import re
import sys
from pathlib import Path
from typing import Any, Final

from tickrig import open_bench
from tickrig.host.rtc.canopen.editor.app import SystemEditor
from tickrig.host.rtc.canopen.editor.session import EditorSession
from tickrig.host.rtc.canopen.serve import open_server

FONTS: Final = re.compile(r"\s*@font-face \{.*?\}", re.DOTALL)
"""Textual names fonts of another site; without them a reader's own are taken."""

LOOKS: Final = 5
LOOK_US: Final = 100_000
STEPS: Final = ("end", "up", "up", "m")
"""The cursor goes to a port, and marks it."""

OBJECTS: Final = 0x6401
"""From here on, objects are in view."""


def picture(examples: Path) -> str:
    """Return the editor as SVG.

    Args:
        examples: the folder with rigs and System Definitions.
    """
    bench = open_bench(examples / "rigs" / "fig120.toml")
    bench["palette"].set("ai1_v", 2.5)
    path = examples / "rtc_canopen" / "fig120.yaml"
    link: Any = bench.link
    return asyncio.run(_draw(EditorSession(open_server(path), path, link), link))


async def _draw(session: EditorSession, link: Any) -> str:
    editor = SystemEditor(session, "can0")
    async with editor.run_test(size=(140, 32)) as pilot:
        _pass_time(editor, link)
        await pilot.press(*STEPS)
        rows = [row.item for row in editor.objects.rows_shown]
        editor.objects.put_cursor(next(n for n, row in enumerate(rows) if row[0] >= OBJECTS) + 12)
        _pass_time(editor, link)
        await pilot.pause()
        return FONTS.sub("", editor.export_screenshot(title="rtc-canopen-editor fig120.yaml"))


def _pass_time(editor: SystemEditor, link: Any) -> None:
    for _ in range(LOOKS):
        until_us = link.now_us + LOOK_US
        while link.now_us < until_us:
            editor.session.turn(until_us)
        editor.look()


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(picture(Path("examples")), "utf-8")
