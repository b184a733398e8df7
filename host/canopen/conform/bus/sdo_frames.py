"""SDO frames of a check, one by one: what is said, and what must be answered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.step_failed import StepFailed
from tickrig.host.canopen.conform.notation.names import Address
from tickrig.host.canopen.conform.notation.step_text import ANSWER_MS
from tickrig.wire.can import data_frame
from tickrig.wire.canopen.sdo.sdo_command import (
    EXPEDITED_BYTES,
    REQUEST_COB_ID,
    RESPONSE_COB_ID,
    SEGMENT_BYTES,
)

UPLOAD: Final = 0x40
UPLOADED: Final = 0x43
DOWNLOAD: Final = 0x23
ABORTED: Final = 0x80


class SdoFrames:
    """The default SDO server of a node, as a check sees it.

    Args:
        exchange: the bus.
        node_id: of the node, 1..127.
    """

    def __init__(self, exchange: Exchange, node_id: int) -> None:
        self.exchange = exchange
        self._request, self._response = REQUEST_COB_ID + node_id, f"{RESPONSE_COB_ID + node_id:03X}"

    def say(self, data: bytes) -> None:
        """Send a request."""
        self.exchange.send(data_frame(self._request, data))

    def answer(self, *patterns: str) -> bytes:
        """Wait for a response that matches one of the patterns; return its data."""
        wanted = [f"{self._response}#{pattern}" for pattern in patterns]
        return bytes.fromhex(self.exchange.expect(wanted, ANSWER_MS)[4:])

    def write(self, at: Address, data: bytes) -> None:
        """Write an object; StepFailed if that is not confirmed."""
        self.download(at, data)
        self.answer(f"60{multiplexer(at)}00000000")
        if len(data) > EXPEDITED_BYTES:
            self.download_segments(data)

    def refuse_write(self, at: Address, data: bytes, codes: Sequence[str]) -> None:
        """Write an object; StepFailed unless it is refused with one of the codes."""
        self.download(at, data)
        self.answer(*aborts(at, codes))

    def read(self, at: Address, data: str) -> None:
        """Read an object; StepFailed unless it holds what the pattern says."""
        size = len(data) // 2
        self.say(bytes([UPLOAD, *bytes.fromhex(multiplexer(at)), *bytes(4)]))
        if 1 <= size <= EXPEDITED_BYTES:
            self.answer(f"{_uploaded(size)}{multiplexer(at)}{data:.<8}")
            return
        self.answer(f"41{multiplexer(at)}{size.to_bytes(4, 'little').hex().upper()}")
        for number, start in enumerate(range(0, max(1, size), SEGMENT_BYTES)):
            toggle, part = (number & 1) << 4, data[2 * start : 2 * (start + SEGMENT_BYTES)]
            self.say(bytes([0x60 | toggle, *bytes(7)]))
            last = start + SEGMENT_BYTES >= size
            head = toggle | (SEGMENT_BYTES - len(part) // 2) << 1 | last
            self.answer(f"{head:02X}{part:.<14}")

    def read_other(self, at: Address, data: str) -> None:
        """Read an object of at most 4 bytes; StepFailed if it holds what it must not."""
        if self.read_data(at, len(data) // 2) == bytes.fromhex(data):
            raise StepFailed(f"{at[0]:04X}h:{at[1]:02X} is still {data}")

    def read_data(self, at: Address, size: int) -> bytes:
        """Read an object of 1 to 4 bytes, whatever it holds."""
        self.say(bytes([UPLOAD, *bytes.fromhex(multiplexer(at)), *bytes(4)]))
        return self.answer(f"{_uploaded(size)}{multiplexer(at)}........")[4 : 4 + size]

    def refuse_read(self, at: Address, codes: Sequence[str]) -> None:
        """Read an object; StepFailed unless it is refused with one of the codes."""
        self.say(bytes([UPLOAD, *bytes.fromhex(multiplexer(at)), *bytes(4)]))
        self.answer(*aborts(at, codes))

    def download(self, at: Address, data: bytes) -> None:
        """Send the request to write an object: expedited, or how many bytes will come."""
        mux = bytes.fromhex(multiplexer(at))
        if 1 <= len(data) <= EXPEDITED_BYTES:
            self.say(bytes([_sized(DOWNLOAD, len(data)), *mux]) + data.ljust(4, b"\0"))
        else:
            self.say(bytes([0x21, *mux]) + len(data).to_bytes(4, "little"))

    def download_segments(self, data: bytes) -> None:
        """Send the segments of a download that was begun, each when the one before is confirmed."""
        for number, start in enumerate(range(0, len(data), SEGMENT_BYTES)):
            part, toggle = data[start : start + SEGMENT_BYTES], (number & 1) << 4
            last = start + SEGMENT_BYTES >= len(data)
            head = toggle | (SEGMENT_BYTES - len(part)) << 1 | last
            self.say(bytes([head]) + part.ljust(SEGMENT_BYTES, b"\0"))
            self.answer(f"{0x20 | toggle:02X}00000000000000")


def multiplexer(at: Address) -> str:
    """Return index and sub-index in hex, as an SDO carries them.

    >>> multiplexer((0x1017, 0))
    '171000'
    """
    return f"{at[0] & 0xFF:02X}{at[0] >> 8:02X}{at[1]:02X}"


def aborts(at: Address, codes: Sequence[str]) -> list[str]:
    """Return the data of abort frames with codes.

    >>> aborts((0x1000, 0), ["06010002"])
    ['8000100002000106']
    """
    mux = multiplexer(at)
    return [f"{ABORTED:02X}{mux}{bytes.fromhex(code)[::-1].hex().upper()}" for code in codes]


def _uploaded(size: int) -> str:
    """Return a pattern: a server may leave out how many bytes are data (CiA 301, 7.2.4.3.5)."""
    return f"4[2{_sized(UPLOADED, size) & 0xF:X}]"


def _sized(command: int, size: int) -> int:
    return command | (EXPEDITED_BYTES - size) << 2
