"""Run an emulator in a thread of its own, and the operator panel in this one."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence
from threading import Thread
from typing import Final

from tickrig.emulators.control import Control, Object
from tickrig.emulators.emulator import Emulator
from tickrig.emulators.inbox import Inbox
from tickrig.emulators.rrc.panel import RrcPanel

SWITCH_S: Final = 0.000_2
"""How long the screen may keep the rig from running, a tick being 10 ms."""


def run_panel(emulator: Emulator) -> None:
    """Show the panel until it is left or the emulator is stopped."""
    inbox = Inbox(Control(emulator))

    def run() -> None:
        try:
            while emulator.running:
                emulator.step()
                inbox.serve()
        finally:
            emulator.stop()
            inbox.close()

    async def ask(requests: Sequence[Object]) -> list[Object]:
        return await asyncio.wrap_future(inbox.post(requests))

    thread = Thread(target=run, name="rig")
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    try:
        RrcPanel(ask, thread.start).run()
    finally:
        emulator.stop()
        inbox.close()
        if thread.is_alive():
            thread.join()
        sys.setswitchinterval(before_s)
