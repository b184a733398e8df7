"""Segmented transfer of one object (CiA 301, SDO download and SDO upload segment)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.twin import Part
from tickrig.wire.can import data_frame
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo_command import (
    FRAME_BYTES,
    LAST,
    SEGMENT_BYTES,
    SIZE_INDICATED,
    SPECIFIER,
    TOGGLE,
    ClientCommand,
    ServerCommand,
)

if TYPE_CHECKING:
    from tickrig.device.canopen.core.entry import Entry
    from tickrig.device.canopen.sdo.sdo_server import SdoServer

# Whole numbers and bytes at hand: segments come by the thousand.
REQUESTED: Final = SPECIFIER | TOGGLE
UPLOAD_SEGMENT: Final = int(ClientCommand.UPLOAD_SEGMENT)
DOWNLOAD_SEGMENT: Final = int(ClientCommand.DOWNLOAD_SEGMENT)
HEADS: Final = {toggle: bytes([toggle]) for toggle in (0, TOGGLE)}
"""First byte of an uploaded segment that is not the last one, by its toggle bit."""
TAKEN: Final = {
    toggle: bytes([ServerCommand.DOWNLOAD_SEGMENT | toggle]) + bytes(SEGMENT_BYTES)
    for toggle in (0, TOGGLE)
}
"""Response to a downloaded segment, by its toggle bit."""


class DownloadSize(Part):
    """Judges the size that a client announces, and that of what comes.

    Args:
        server: has the memory of the slave.
        entry: what is written.
        announced: bytes that the client is going to send, None if it does not say.

    Raises:
        SdoAbort: the entry cannot be written, or what is announced does not fit.

    Attributes:
        announced: as given.
        most: bytes that may come; with more `check` says what is wrong.
    """

    def __init__(self, server: SdoServer, entry: Entry, announced: int | None) -> None:
        entry.check_writable()
        self.announced = announced
        self._long = entry.size or entry.description.max_bytes
        self._free = entry.size or server.free_bytes(entry)
        if announced is not None:
            entry.check_size(announced)
            self.check(announced)
            self._long = announced
        self.most = min(self._long, self._free)

    def check(self, size: int) -> None:
        """Raise SdoAbort if so many bytes are more than was announced, or than fits."""
        if size > self._long:
            raise SdoAbort(AbortCode.TOO_LONG)
        if size > self._free:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)


class SegmentedUpload(Part):
    """Gives a value as it was when the client asked for it."""

    def __init__(self, server: SdoServer, data: bytes) -> None:
        self._server, self._data = server, data
        self._at, self._toggle = 0, 0
        server.confirm(ServerCommand.UPLOAD | SIZE_INDICATED, len(data).to_bytes(4, "little"))
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Give the next segment."""
        command, toggle, at = request[0], self._toggle, self._at
        if command & REQUESTED != UPLOAD_SEGMENT | toggle:
            self._server.go_on_otherwise(request, UPLOAD_SEGMENT)
            return
        self._at = behind = at + SEGMENT_BYTES
        self._toggle = toggle ^ TOGGLE
        if behind < len(self._data):
            self._server.respond(HEADS[toggle] + self._data[at:behind])
            self._server.go_on()
        else:
            self._give_last(toggle, self._data[at:])

    def _give_last(self, toggle: int, part: bytes) -> None:
        head = toggle | SEGMENT_BYTES - len(part) << 1 | LAST
        self._server.respond(bytes([head]) + part.ljust(SEGMENT_BYTES, b"\0"))
        self._server.end()


class SegmentedDownload(Part):
    """Collects a value; the object changes when the last segment has come."""

    def __init__(self, server: SdoServer, entry: Entry, request: bytes) -> None:
        self._server, self._entry = server, entry
        self._data, self._toggle = bytearray(), 0
        announced = int.from_bytes(request[4:], "little") if request[0] & SIZE_INDICATED else None
        self._size = DownloadSize(server, entry, announced)
        self._most, self._put = self._size.most, server.node.put
        self._taken = {at: data_frame(server.response_id, TAKEN[at]) for at in TAKEN}
        server.confirm(ServerCommand.DOWNLOAD)
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Take the next segment."""
        command, toggle, data = request[0], self._toggle, self._data
        if command & REQUESTED != DOWNLOAD_SEGMENT | toggle:
            self._server.go_on_otherwise(request, DOWNLOAD_SEGMENT)
            return
        data += request[1 : FRAME_BYTES - (command >> 1 & 7)]
        if len(data) > self._most:
            self._size.check(len(data))
        if command & LAST:
            self._commit()
        self._put(self._taken[toggle])
        self._toggle = toggle ^ TOGGLE
        if command & LAST:
            self._server.end()
        else:
            self._server.go_on()

    def _commit(self) -> None:
        """Write all that came; SdoAbort if it is too little, or the object refuses."""
        if len(self._data) < (self._size.announced or 0):
            raise SdoAbort(AbortCode.TOO_SHORT)
        self._entry.download(bytes(self._data))
