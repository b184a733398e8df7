"""Draw the monitor into an SVG file, as it shows a log.

`python tools/canmon_picture.py run.log picture.svg o` presses `o`, too.
"""

from __future__ import annotations

import asyncio
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.panel import make_panels
from tickrig.host.canmon.tui.session import Model, open_session
from tickrig.host.cli.can_options import BusOptions

SIZE: Final = (110, 26)
FONTS: Final = re.compile(r"\s*@font-face \{.*?\}", re.DOTALL)
"""Textual names fonts of another site; without them a reader's own are taken."""


def picture(log: str, keys: Sequence[str] = ()) -> str:
    """Return the monitor as SVG when it has read a log and keys were pressed."""
    return asyncio.run(_draw(log, keys))


async def _draw(log: str, keys: Sequence[str]) -> str:
    session = open_session([log], BusOptions(), Model())
    while not session.model.ended:
        session.step()
    monitor = MonitorApp(session, make_panels(session, print))
    async with monitor.run_test(size=SIZE) as pilot:
        await pilot.press(*keys)
        monitor.refresh_view()
        await pilot.pause()
        svg = FONTS.sub("", monitor.export_screenshot(title="canmon tui"))
    session.close()
    session.source.close()
    return svg


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(picture(sys.argv[1], sys.argv[3:]), "utf-8")
