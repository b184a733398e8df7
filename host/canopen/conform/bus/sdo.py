"""SDO frames of a check: requests and expected answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from tickrig.host.canopen.conform.bus.exchange import BusExchange, StepFailed
from tickrig.host.canopen.conform.check import ANSWER_MS, Address
from tickrig.host.canopen.dialogue import Script
from tickrig.host.canopen.errors import SdoFailed, SdoTimeout
from tickrig.host.canopen.network import NodeSession
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.can import data_frame
from tickrig.wire.canopen import sdo_frame
from tickrig.wire.canopen.sdo import Abort

# Reads and writes objects of the node under test, apart from its checks.

T = TypeVar("T")

SizeOf = Callable[[Address], int | None]
"""Function that returns an object's size in bytes by index and sub-index; 0 or None if unknown."""


_NUMBER_BYTES: Final = range(1, 5)
"""Sizes of a number that the tester requests. A node may send anything."""
_MOST_MISNAMED: Final = 20
"""Number of answers to keep that name another object."""


def number_of(data: bytes) -> int | None:
    """Return bytes as an unsigned number of at most 32 bits, or None for any other length."""
    return int.from_bytes(data, "little") if len(data) in _NUMBER_BYTES else None


class SdoClient:
    """SDO client of the tester, which reads and writes objects of the node under test.

    Its methods block until the transfer ends. Frames that are not SDO answers of the node are
    ignored.

    Args:
        exchange: bus with the node.
        node_id: node-ID of the node, 1..127.

    Attributes:
        misnamed: texts about answers that name another object than the requested one.
        size_of: function that returns the size of an object in bytes. It is used for answers that
            do not indicate their size.
    """

    def __init__(self, exchange: BusExchange, node_id: int) -> None:
        self._exchange, self._node_id = exchange, node_id
        self._session = NodeSession(node_id, self._send, on_misnamed=self._keep_misnamed)
        self.misnamed: dict[str, None] = {}
        self.size_of: SizeOf = dict[Address, int]().get

    def upload(self, index: int, sub: int) -> bytes:
        """Read an object of the node. If the node does not answer, the request is repeated once.

        Raises:
            SdoAborted: the node refuses the request.
            SdoTimeout: the node answers neither the first nor the repeated request.
            SdoMisnamed: the answer of the node names another object.
            LinkClosed: the connection to the bus is lost.
        """
        size = self.size_of((index, sub)) or 0
        try:
            return self.run(upload(index, sub, size))
        except SdoTimeout:  # one frame may be lost
            return self.run(upload(index, sub, size))

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write an object. The errors are those of `upload`."""
        try:
            self.run(download(index, sub, data))
        except SdoTimeout:
            self.run(download(index, sub, data))

    def number(self, index: int, sub: int) -> int | None:
        """Read an object as an unsigned number of 1 to 4 bytes.

        Return None if the transfer fails, or if the value has no bytes or more than 4 bytes.
        """
        try:
            return number_of(self.upload(index, sub))
        except SdoFailed:
            return None

    def abort(self) -> None:
        """Abort the SDO transfer that a check has left open.

        The abort message names the object of this transfer, because some CANopen stacks check the
        object.
        """
        at = sdo_frame.index_sub(self._exchange.transfer)
        frame = Abort(*at, sdo_frame.AbortCode.GENERAL).encode()
        self._send(sdo_frame.REQUEST_COB_ID + self._node_id, frame)

    def run(self, script: Script[T]) -> T:
        """Run a script of SDO requests with the node, and return the result of the script.

        If the script raises an exception, this method raises the same exception.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        exchange, talk = self._exchange, self._session.dialogue
        for request in exchange.unanswered:  # by the check, which talks for itself
            talk.remember(sdo_frame.index_sub(request))
        try:
            return self._session.run(script, exchange.listen)
        finally:
            if talk.job is not None:
                talk.clear()
            exchange.unanswered.clear()

    def _keep_misnamed(self, at: tuple[int, int], data: bytes) -> None:
        """Keep an answer that names another object."""
        asked, named = (f"{index:04X}h:{sub:02X}" for index, sub in (at, sdo_frame.index_sub(data)))
        frame = data_frame(sdo_frame.RESPONSE_COB_ID + self._node_id, data)
        if len(self.misnamed) < _MOST_MISNAMED:
            self.misnamed[f"{asked} was answered with {frame}, which names {named}"] = None

    def _send(self, can_id: int, data: bytes) -> None:
        self._exchange.send(data_frame(can_id, data))


_UPLOAD: Final = 0x40
_UPLOADED: Final = 0x43
_DOWNLOAD: Final = 0x23
ABORTED: Final = 0x80


class SdoFrames:
    """Single SDO frames between a check and the node, for checks that judge each frame.

    A client for whole transfers is `SdoClient`.

    Args:
        exchange: bus with the node.
        node_id: node-ID of the node, 1..127.
    """

    def __init__(self, exchange: BusExchange, node_id: int) -> None:
        self.exchange = exchange
        self._request = sdo_frame.REQUEST_COB_ID + node_id
        self._response = f"{sdo_frame.RESPONSE_COB_ID + node_id:03X}"

    def say(self, data: bytes) -> None:
        """Send a request."""
        self.exchange.send(data_frame(self._request, data))

    def answer(self, *patterns: str) -> bytes:
        """Wait for an SDO response that matches one of the patterns. Return its data bytes."""
        wanted = [f"{self._response}#{pattern}" for pattern in patterns]
        return bytes.fromhex(self.exchange.expect(wanted, ANSWER_MS)[4:])

    def write(self, at: Address, data: bytes) -> None:
        """Write an object. Raise StepFailed if the node does not confirm the write."""
        self.download(at, data)
        self.answer(f"60{multiplexer(at)}00000000")
        if len(data) > sdo_frame.EXPEDITED_BYTES:
            self.download_segments(data)

    def refuse_write(self, at: Address, data: bytes, codes: Sequence[str]) -> None:
        """Write an object. Raise StepFailed unless the node refuses with one of the codes."""
        self.download(at, data)
        self.answer(*_aborts(at, codes))

    def read(self, at: Address, data: str) -> None:
        """Read an object. Raise StepFailed unless the value matches the pattern."""
        size = len(data) // 2
        self.say(bytes([_UPLOAD, *bytes.fromhex(multiplexer(at)), *bytes(4)]))
        if 1 <= size <= sdo_frame.EXPEDITED_BYTES:
            self.answer(f"{_uploaded(size)}{multiplexer(at)}{data:.<8}")
            return
        self.answer(f"41{multiplexer(at)}{size.to_bytes(4, 'little').hex().upper()}")
        for number, start in enumerate(range(0, max(1, size), sdo_frame.SEGMENT_BYTES)):
            toggle = (number & 1) << 4
            part = data[2 * start : 2 * (start + sdo_frame.SEGMENT_BYTES)]
            self.say(bytes([0x60 | toggle, *bytes(7)]))
            last = start + sdo_frame.SEGMENT_BYTES >= size
            head = toggle | (sdo_frame.SEGMENT_BYTES - len(part) // 2) << 1 | last
            self.answer(f"{head:02X}{part:.<14}")

    def read_other(self, at: Address, data: str) -> None:
        """Read an object of at most 4 bytes, and fail if the object still has the value `data`.

        The value `data` is in hex, in the byte order of the bus.

        Raises:
            StepFailed: the object has the value `data`.
        """
        if self.read_data(at, len(data) // 2) == bytes.fromhex(data):
            raise StepFailed(f"{at[0]:04X}h:{at[1]:02X} is still {data}")

    def read_data(self, at: Address, size: int) -> bytes:
        """Read an object of 1 to 4 bytes, with any value."""
        self.say(bytes([_UPLOAD, *bytes.fromhex(multiplexer(at)), *bytes(4)]))
        return self.answer(f"{_uploaded(size)}{multiplexer(at)}........")[4 : 4 + size]

    def refuse_read(self, at: Address, codes: Sequence[str]) -> None:
        """Read an object. Raise StepFailed unless the node refuses with one of the codes."""
        self.say(bytes([_UPLOAD, *bytes.fromhex(multiplexer(at)), *bytes(4)]))
        self.answer(*_aborts(at, codes))

    def download(self, at: Address, data: bytes) -> None:
        """Send the first request of an SDO download.

        If the value has 1 to 4 bytes, the request contains the value (expedited transfer). For any
        other value, the request contains only the number of bytes, and the bytes follow in
        segments.
        """
        mux = bytes.fromhex(multiplexer(at))
        if 1 <= len(data) <= sdo_frame.EXPEDITED_BYTES:
            self.say(bytes([_sized(_DOWNLOAD, len(data)), *mux]) + data.ljust(4, b"\0"))
        else:
            self.say(bytes([0x21, *mux]) + len(data).to_bytes(4, "little"))

    def download_segments(self, data: bytes) -> None:
        """Send the segments of an SDO download that has been started.

        The node must acknowledge each segment before the next segment is sent.
        """
        for number, start in enumerate(range(0, len(data), sdo_frame.SEGMENT_BYTES)):
            part, toggle = data[start : start + sdo_frame.SEGMENT_BYTES], (number & 1) << 4
            last = start + sdo_frame.SEGMENT_BYTES >= len(data)
            head = toggle | (sdo_frame.SEGMENT_BYTES - len(part)) << 1 | last
            self.say(bytes([head]) + part.ljust(sdo_frame.SEGMENT_BYTES, b"\0"))
            self.answer(f"{0x20 | toggle:02X}00000000000000")


def multiplexer(at: Address) -> str:
    """Return index and sub-index in hex, as an SDO carries them.

    >>> multiplexer((0x1017, 0))
    '171000'
    """
    return f"{at[0] & 0xFF:02X}{at[0] >> 8:02X}{at[1]:02X}"


def _aborts(at: Address, codes: Sequence[str]) -> list[str]:
    """Return the data of abort frames with codes.

    >>> _aborts((0x1000, 0), ["06010002"])
    ['8000100002000106']
    """
    mux = multiplexer(at)
    return [f"{ABORTED:02X}{mux}{bytes.fromhex(code)[::-1].hex().upper()}" for code in codes]


def _uploaded(size: int) -> str:
    """Return a pattern for an answer.

    A server may omit the number of data bytes (CiA 301, 7.2.4.3.5).
    """
    return f"4[2{_sized(_UPLOADED, size) & 0xF:X}]"


def _sized(command: int, size: int) -> int:
    return command | (sdo_frame.EXPEDITED_BYTES - size) << 2
