r"""Frames out of a byte stream, cut anywhere.

>>> from tickrig.wire.rtc_lite.layout import REQUESTS
>>> decoder = LiteDecoder(REQUESTS)
>>> decoder.push(b"noise\n\x43"), decoder.begun
([], True)
>>> decoder.push(b"\x58\x9b")
[LiteFrame(command=<LiteCommand.STATE: b'CX'>, data=b'')]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault
from tickrig.wire.rtc_lite.frame import HEADER, Checksum, LiteFrame
from tickrig.wire.rtc_lite.layout import MAX_DATA_BYTES, Layout

_COMMANDS: Final = {command.value: command for command in LiteCommand}


@dataclass(slots=True)
class LiteDecoder:
    """Reads the frames of one direction (DECISION L6, L7).

    It knows no time. Whoever owns it watches the line and calls `clear` after
    100 ms without a byte while a frame has `begun`, and after 20 ms without a
    byte while it is `lost`.

    Args:
        layouts: `REQUESTS` at the device, `REPLIES` at the proxy.
        checksum: how frames are summed up.

    Attributes:
        lost: an unknown command came, or more data than fit: nobody knows where
            the next frame begins, and all is thrown away until `clear`.
    """

    layouts: Mapping[LiteCommand, Layout]
    checksum: Checksum = Checksum.SUM8
    lost: bool = field(default=False, init=False)
    _frame: bytearray = field(default_factory=bytearray, init=False)  # header and what follows

    @property
    def begun(self) -> bool:
        """Whether a frame has begun that is not whole."""
        return bool(self._frame)

    def clear(self) -> None:
        """Forget a frame that has only begun, and look for a header again."""
        self.lost = False
        self._frame.clear()

    def push(self, data: bytes) -> list[LiteFrame | LiteLinkFault]:
        """Take bytes in; give whole frames out, and what was wrong with others."""
        out = []
        for code in data:
            if not self.lost and (self._frame or code == HEADER[0]):
                self._frame.append(code)
                if (found := self._parse()) is not None:
                    out.append(found)
                    self._frame.clear()
                    self.lost = found is LiteLinkFault.UNKNOWN
        return out

    def _parse(self) -> LiteFrame | LiteLinkFault | None:
        """Return what the latest byte completed."""
        frame = self._frame
        if len(frame) < 3:
            return None
        command = _COMMANDS.get(bytes(frame[1:3]))
        layout = None if command is None else self.layouts.get(command)
        if command is None or layout is None:  # taken as having no data (DECISION L7)
            return LiteLinkFault.UNKNOWN if len(frame) == 4 else None
        size = layout(frame[3:])
        if size > MAX_DATA_BYTES:
            return LiteLinkFault.UNKNOWN
        if len(frame) < 4 + size:
            return None
        if frame[-1] != self.checksum.of(frame[1:-1]):
            return LiteLinkFault.CHECKSUM
        return LiteFrame(command, bytes(frame[3:-1]))
