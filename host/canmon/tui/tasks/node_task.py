"""Sends NMT commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.canmon.tui.tasks.session import DecodedFrame, Task
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.nmt import NMT_COB_ID, NmtCommand
from tickrig.wire.instant import NEVER

NOW: Final = 0
"""When commands are due that have not been sent yet."""


class NodeTask(Task):
    """Sends what it is told to; what comes of it, the traffic says."""

    def __init__(self) -> None:
        self.channel = ""
        self._out: list[CanFrame] = []

    @property
    def due_us(self) -> int:
        """When it next wants to be called without a frame."""
        return NOW if self._out else NEVER

    def command(self, channel: str, node: int, command: NmtCommand) -> None:
        """Command a node on a bus, or all nodes there by 0."""
        self.channel = channel
        self._out.append(CanFrame(NMT_COB_ID, bytes((command, node))))

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Return what is to be sent."""
        out, self._out = tuple(self._out), []
        return out

    def stop(self) -> None:
        """Send nothing that was not sent yet."""
        self._out.clear()
