"""A link whose frames are shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.rtc_lite.config import NodeConfig
from tickrig.emulators.record.byte_text import escape
from tickrig.emulators.record.trace import Mark
from tickrig.emulators.rtc_lite.frame_log import frame_splitter
from tickrig.host.links.link import Link
from tickrig.wire.rtc_lite.codes import Command

_NAMES: Final = {command.value: command.name for command in Command}


class OverheardLink:
    """A `Link[bytes]` that tells each frame that passes through another one.

    Args:
        link: the other one.
        show: told a line of text, as `> AE  EXECUTE`.

    Attributes:
        shown: whether frames are told just now.
    """

    def __init__(self, link: Link[bytes], show: Callable[[str], None]) -> None:
        self._link, self._show, self.shown = link, show, False
        make = frame_splitter(NodeConfig())
        self._split = {mark: make(mark) for mark in (Mark.TO_DEVICE, Mark.FROM_DEVICE)}

    @property
    def now_us(self) -> int:
        """Time on the link below."""
        return self._link.now_us

    def send(self, traffic: bytes, /) -> None:
        """Send, and tell."""
        self._tell(Mark.TO_DEVICE, traffic)
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        """Receive, and tell."""
        data = self._link.receive(timeout_us)
        self._tell(Mark.FROM_DEVICE, data)
        return data

    def close(self) -> None:
        """Close the link below."""
        self._link.close()

    def _tell(self, mark: Mark, data: bytes) -> None:
        for body in self._split[mark](self.now_us, data):
            if self.shown:
                self._show(f"{mark.value} {escape(body):<12} {_NAMES.get(body[:2], '')}".rstrip())
