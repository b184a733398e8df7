"""Block upload of one object (CiA 301, SDO block upload)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.crc import crc16
from tickrig.wire.canopen.sdo.sdo_command import (
    BLOCK_ACKNOWLEDGE,
    BLOCK_CRC,
    BLOCK_END,
    BLOCK_ENDED,
    BLOCK_LAST,
    BLOCK_SIZE_INDICATED,
    BLOCK_START,
    MAX_BLOCK_SIZE,
    SEGMENT_BYTES,
    ServerCommand,
)

if TYPE_CHECKING:
    from tickrig.device.canopen.sdo.sdo_server import SdoServer


class BlockUpload:
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
