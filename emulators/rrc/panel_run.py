"""Run an emulator in a thread of its own, and the operator panel in this one."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Final

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.inbox import Inbox
from tickrig.emulators.rrc.panel import RrcPanel
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.requests import Object

SWITCH_S: Final = 0.000_2
"""How long the screen may keep the rig from running, a tick being 10 ms."""


def run_panel(emulator: Emulator) -> None:
    """Show the panel until it is left or the emulator is stopped."""
    inbox = Inbox(EmulatorControl(emulator))

    def run() -> None:
        with _ending(emulator, inbox):
            while emulator.running:
                emulator.step()
                inbox.serve()

    async def send(requests: Sequence[Object]) -> list[Object]:
        return await asyncio.wrap_future(inbox.post(requests))

    started: list[Future[None]] = []
    panel = RrcPanel(send, lambda: started.append(pool.submit(run)))
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    try:
        with (
            panel.ended_by_signals(),
            ThreadPoolExecutor(1, "rig") as pool,
            _ending(emulator, inbox),
        ):
            panel.run()
    finally:
        sys.setswitchinterval(before_s)
    for rig in started:
        rig.result()


@contextmanager
def _ending(emulator: Emulator, inbox: Inbox) -> Iterator[None]:
    """Let the emulator end, and nobody wait for it, however this ends."""
    try:
        yield
    finally:
        emulator.stop()
        inbox.close()
