"""Block transfer of one object (CiA 301, SDO block download and SDO block upload)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.sdo.sdo_segmented import DownloadSize
from tickrig.device.twin import Part
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo_block import crc16
from tickrig.wire.canopen.sdo.sdo_command import (
    BLOCK_ACKNOWLEDGE,
    BLOCK_CRC,
    BLOCK_END,
    BLOCK_ENDED,
    BLOCK_LAST,
    BLOCK_SEQNO,
    BLOCK_SIZE_INDICATED,
    BLOCK_START,
    MAX_BLOCK_SIZE,
    SEGMENT_BYTES,
    ClientCommand,
    ServerCommand,
)

if TYPE_CHECKING:
    from tickrig.device.canopen.core.entry import Entry
    from tickrig.device.canopen.sdo.sdo_server import SdoServer


_END_MASK: Final = 0xE1
"""Command specifier and subcommand of the end; n is between them."""


class BlockDownload(Part):
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
        head, due = request[0], self._in_sequence + 1
        if head == due and due < self._block_size:  # most are: in sequence, and not the last
            self._in_sequence = due
            self._data += request[1:]
            self._server.go_on()
        elif head == ClientCommand.ABORT:
            self._server.end()
        else:
            self._end_block(head, request)

    def _end_block(self, head: int, request: bytes) -> None:
        """Take the last segment of a block, or drop one that is out of sequence."""
        seqno = head & BLOCK_SEQNO
        if seqno == self._in_sequence + 1:
            self._in_sequence = seqno
            self._data += request[1:]
            self._finished = head >= BLOCK_LAST
        if head >= BLOCK_LAST or seqno >= self._block_size:
            self._acknowledge()
        else:
            self._server.go_on()

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


class BlockUpload(Part):
    """Gives a value as it was when the client asked for it, a block in one tick.

    A value no longer than the client's protocol switch threshold is given by
    expedited or segmented upload. A lost segment is sent again from there on,
    in a new block. The block size of the last acknowledgement is not looked at.
    The server says that it can do the CRC to clients that can: there are clients
    that check it whenever the server can.
    """

    def __init__(self, server: SdoServer, data: bytes, request: bytes) -> None:
        self._server, self._data = server, data
        self._next = self._sent = 0
        self._segments = max(1, -(-len(data) // SEGMENT_BYTES))
        self._use_block_size(request[4])
        threshold = request[5]
        if threshold and len(data) <= threshold:
            server.upload(data)
            return
        with_crc = request[0] & BLOCK_CRC
        self._crc = crc16(data) if with_crc else 0
        command = ServerCommand.BLOCK_UPLOAD | with_crc | BLOCK_SIZE_INDICATED
        server.confirm(command, len(data).to_bytes(4, "little"))
        server.wait(self._start)

    def _use_block_size(self, block_size: int) -> None:
        if not 1 <= block_size <= MAX_BLOCK_SIZE:
            raise SdoAbort(AbortCode.BLOCK_SIZE)
        self._block_size = block_size

    def _start(self, request: bytes) -> None:
        """Wait until the client is ready."""
        if request[0] == BLOCK_START:
            self._send_block()
        else:
            self._server.initiate(request)

    def _send_block(self) -> None:
        data, respond = self._data, self._server.respond
        self._sent = min(self._block_size, self._segments - self._next)
        at = self._next * SEGMENT_BYTES
        for seqno in range(1, self._sent):
            respond(bytes([seqno]) + data[at : at + SEGMENT_BYTES])
            at += SEGMENT_BYTES
        last = BLOCK_LAST if self._next + self._sent == self._segments else 0
        respond(bytes([self._sent | last]) + data[at : at + SEGMENT_BYTES].ljust(7, b"\0"))
        self._server.wait(self._acknowledge)

    def _acknowledge(self, request: bytes) -> None:
        """Go on after the last segment that the client has received."""
        if request[0] != BLOCK_ACKNOWLEDGE:
            self._server.initiate(request)
            return
        if request[1] > self._sent:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        self._next += request[1]
        if self._next == self._segments:
            self._finish()
        else:
            self._use_block_size(request[2])
            self._send_block()

    def _finish(self) -> None:
        fill = self._segments * SEGMENT_BYTES - len(self._data)
        head = bytes([BLOCK_END | fill << 2])
        self._server.respond(head + self._crc.to_bytes(2, "little") + bytes(5))
        self._server.wait(self._end)

    def _end(self, request: bytes) -> None:
        """Wait until the client has checked what it has."""
        if request[0] == BLOCK_ENDED:
            self._server.end()
        else:
            self._server.initiate(request)
