"""Draw `tickrig rtc edit` into an SVG file, on the system of the Reference Hardware 3 cart.

`python tools/rtc_edit_picture.py docs/pictures/rtc-edit.svg`
"""

from __future__ import annotations

import asyncio
import re
import sys
from pathlib import Path
from typing import Final

from tickrig.host.rtc.commands.system_control import describe_component
from tickrig.host.rtc.components import EXAMPLES
from tickrig.host.rtc.editor.app import SystemScreen
from tickrig.host.rtc.editor.system_link import SystemLink
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.system import restore
from tickrig.host.rtc.system.system_file import read_system

FONTS: Final = re.compile(r"\s*@font-face \{.*?\}", re.DOTALL)
"""Textual names fonts of another site; without them a reader's own are taken."""

MARKED: Final = "OmniTo2WD0.goal"
AT: Final = "PositionInput0.position"


def picture(system: Path) -> str:
    """Return the editor as SVG.

    Args:
        system: a system file.
    """
    manager = Manager()
    for kind in EXAMPLES:
        manager.register(kind)
    restore(manager, read_system(system))
    manager.run_for(1_000_000)
    link = SystemLink(Path("/tmp/cart"))
    link.components = [describe_component(manager, one) for one in manager.components]
    return asyncio.run(_draw(SystemScreen(link, "/tmp/cart")))


async def _draw(screen: SystemScreen) -> str:
    async with screen.run_test(size=(124, 38)) as pilot:
        screen.look()
        await pilot.pause()
        screen.view.marked = MARKED
        screen.view.go_to(AT)
        screen.look()
        await pilot.pause()
        return FONTS.sub("", screen.export_screenshot(title="tickrig rtc edit"))


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(picture(Path("examples/rh3_cart.toml")), "utf-8")
