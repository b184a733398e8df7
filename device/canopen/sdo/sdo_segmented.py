"""Segmented transfer of one object (CiA 301, SDO download and SDO upload segment)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig.device.canopen.core.abort import SdoAbort
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


class DownloadSize:
    """Judges the size that a client announces, and that of what comes.

    Args:
        server: has the memory of the slave.
        entry: what is written.
        announced: bytes that the client is going to send, None if it does not say.

    Raises:
        SdoAbort: the entry cannot be written, or what is announced does not fit.

    Attributes:
        announced: as given.
    """

    def __init__(self, server: SdoServer, entry: Entry, announced: int | None) -> None:
        entry.check_writable()
        self.announced = announced
        self._most = entry.size or entry.description.max_bytes
        self._free = entry.size or server.free_bytes(entry)
        if announced is not None:
            entry.check_size(announced)
            self.check(announced)
            self._most = announced

    def check(self, size: int) -> None:
        """Raise SdoAbort if so many bytes are more than was announced, or than fits."""
        if size > self._most:
            raise SdoAbort(AbortCode.TOO_LONG)
        if size > self._free:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)


class SegmentedUpload:
    """Gives a value as it was when the client asked for it."""

    def __init__(self, server: SdoServer, data: bytes) -> None:
        self._server, self._data = server, data
        self._at = self._toggle = 0
        server.confirm(ServerCommand.UPLOAD | SIZE_INDICATED, len(data).to_bytes(4, "little"))
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Give the next segment."""
        if request[0] & SPECIFIER != ClientCommand.UPLOAD_SEGMENT:
            self._server.initiate(request)
            return
        if request[0] & TOGGLE != self._toggle:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        part = self._data[self._at : self._at + SEGMENT_BYTES]
        self._at += SEGMENT_BYTES
        last = LAST if self._at >= len(self._data) else 0
        head = self._toggle | SEGMENT_BYTES - len(part) << 1 | last
        self._server.respond(bytes([head]) + part.ljust(SEGMENT_BYTES, b"\0"))
        self._toggle ^= TOGGLE
        if last:
            self._server.end()
        else:
            self._server.wait(self._segment)


class SegmentedDownload:
    """Collects a value; the object changes when the last segment has come."""

    def __init__(self, server: SdoServer, entry: Entry, request: bytes) -> None:
        self._server, self._entry = server, entry
        self._data, self._toggle = bytearray(), 0
        announced = int.from_bytes(request[4:], "little") if request[0] & SIZE_INDICATED else None
        self._size = DownloadSize(server, entry, announced)
        server.confirm(ServerCommand.DOWNLOAD)
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Take the next segment."""
        command = request[0]
        if command & SPECIFIER != ClientCommand.DOWNLOAD_SEGMENT:
            self._server.initiate(request)
            return
        if command & TOGGLE != self._toggle:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        self._data += request[1 : FRAME_BYTES - (command >> 1 & 7)]
        self._size.check(len(self._data))
        if command & LAST:
            self._commit()
        self._server.respond(bytes([ServerCommand.DOWNLOAD_SEGMENT | self._toggle]) + bytes(7))
        self._toggle ^= TOGGLE
        if command & LAST:
            self._server.end()
        else:
            self._server.wait(self._segment)

    def _commit(self) -> None:
        """Write all that came; SdoAbort if it is too little, or the object refuses."""
        if len(self._data) < (self._size.announced or 0):
            raise SdoAbort(AbortCode.TOO_SHORT)
        self._entry.download(bytes(self._data))
