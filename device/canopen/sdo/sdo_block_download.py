"""Block download of one object (CiA 301, SDO block download)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.sdo.sdo_segmented import DownloadSize
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.crc import crc16
from tickrig.wire.canopen.sdo.sdo_command import (
    BLOCK_ACKNOWLEDGE,
    BLOCK_CRC,
    BLOCK_END,
    BLOCK_ENDED,
    BLOCK_LAST,
    BLOCK_SEQNO,
    BLOCK_SIZE_INDICATED,
    SEGMENT_BYTES,
    ClientCommand,
    ServerCommand,
)

if TYPE_CHECKING:
    from tickrig.device.canopen.core.entry import Entry
    from tickrig.device.canopen.sdo.sdo_server import SdoServer

_END_MASK: Final = 0xE1
"""Command specifier and subcommand of the end; n is between them."""


class BlockDownload:
    """Collects a value in blocks; the object changes when the client has ended the transfer.

    A segment out of sequence is dropped, and the block acknowledged at its end
    with the last one in sequence. If the end itself is lost, the client must
    notice, or the transfer times out: a client may be slow inside a block. The
    size is judged before the CRC. Inside a block every frame but an abort is a
    segment.
    """

    def __init__(self, server: SdoServer, entry: Entry, request: bytes) -> None:
        self._server, self._entry = server, entry
        self._data, self._in_sequence, self._finished = bytearray(), 0, False
        self._crc = request[0] & BLOCK_CRC
        indicated = request[0] & BLOCK_SIZE_INDICATED
        announced = int.from_bytes(request[4:], "little") if indicated else None
        self._size = DownloadSize(server, entry, announced)
        self._block_size = server.block_size
        command = ServerCommand.BLOCK_DOWNLOAD | self._crc
        server.confirm(command, bytes([self._block_size, 0, 0, 0]))
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Take a segment of the running block."""
        head = request[0]
        if head == ClientCommand.ABORT:
            self._server.end()
            return
        seqno = head & BLOCK_SEQNO
        if seqno == self._in_sequence + 1:
            self._in_sequence = seqno
            self._data += request[1:]
            self._finished = head >= BLOCK_LAST
        if head >= BLOCK_LAST or seqno >= self._block_size:
            self._acknowledge()
        else:
            self._server.wait(self._segment)

    def _acknowledge(self) -> None:
        """Say how far the block was received, and begin the next."""
        self._size.check(len(self._data) - SEGMENT_BYTES)
        self._block_size = self._server.block_size
        head = bytes([BLOCK_ACKNOWLEDGE, self._in_sequence, self._block_size])
        self._server.respond(head + bytes(5))
        self._in_sequence = 0
        self._server.wait(self._end if self._finished else self._segment)

    def _end(self, request: bytes) -> None:
        """Judge the whole, and write it."""
        if request[0] & _END_MASK != BLOCK_END:
            self._server.initiate(request)
            return
        data = bytes(self._data[: len(self._data) - (request[0] >> 2 & 7)])
        self._size.check(len(data))
        if len(data) < (self._size.announced or 0):
            raise SdoAbort(AbortCode.TOO_SHORT)
        if self._crc and crc16(data) != int.from_bytes(request[1:3], "little"):
            raise SdoAbort(AbortCode.CRC)
        self._entry.download(data)
        self._server.respond(bytes([BLOCK_ENDED]) + bytes(7))
        self._server.end()
