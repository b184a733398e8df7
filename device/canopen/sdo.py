"""The SDO servers of a slave: expedited, segmented and block transfer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Entry, SdoAbort, check_sdo_cob_id, is_valid
from tickrig.device.canopen.slave import ALIVE, Handler, Service
from tickrig.device.twin import Immutable, Part
from tickrig.wire.can import CanFrame, data_frame
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.nmt import CAN_ID_MASK, NmtState
from tickrig.wire.canopen.sdo_frame import (
    BLOCK_ACKNOWLEDGE,
    BLOCK_CRC,
    BLOCK_END,
    BLOCK_ENDED,
    BLOCK_LAST,
    BLOCK_SEQNO,
    BLOCK_SIZE_INDICATED,
    BLOCK_START,
    BLOCK_SUBCOMMAND,
    EXPEDITED,
    EXPEDITED_BYTES,
    FRAME_BYTES,
    LAST,
    MAX_BLOCK_SIZE,
    REQUEST_COB_ID,
    RESPONSE_COB_ID,
    SEGMENT_BYTES,
    SIZE_INDICATED,
    SPECIFIER,
    TOGGLE,
    AbortCode,
    ClientCommand,
    ServerCommand,
    crc16,
)
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.slave import CanopenSlave


# Theory of operation
# ===================
#
# A server is in one state at a time. A state is the method that takes the next request (`State`).
# Without a transfer the state is `_without_transfer`. A transfer object (segmented or block,
# upload or download) passes its own methods to `SdoServer.wait` and finishes with `end`. There is
# one transfer at a time, and its object holds everything about it, so that dropping the state
# drops the transfer.
#
# The table shows the frames, the client on the left and the server on the right (CiA 301,
# 7.2.4.3). The toggle bit is 10h, the last segment has 01h, n is the number of unused bytes. ii
# ii ss is the multiplexer: the index with its low byte first, then the sub-index.
#
# read, up to 4 bytes     40 17 10 00 ..             4B 17 10 00 E8 03   (43 47 4B 4F: 4 to 1)
# read, segments          40 08 10 00 ..             41 08 10 00 0A 00 00 00   10 bytes follow
#                         60                         00 d1 d2 d3 d4 d5 d6 d7
#                         70                         19 d8 d9 dA   toggle, n = 4, last
# write, up to 4 bytes    2B 17 10 00 E8 03          60 17 10 00   (22: size of the object)
# write, segments         21 ii ii ss 0A 00 00 00    60 ii ii ss   (20: no size)
#                         00 d1 d2 d3 d4 d5 d6 d7    20
#                         19 d8 d9 dA                30
# block write             C6 ii ii ss 11 00 00 00    A4 ii ii ss 7F   CRC; 127 in a block
#                         01 .., 02 .., 83 ..        A2 03 7F   3 came in sequence
#                         D1 crc crc   n = 4         A1
# block read              A4 ii ii ss 7F pst         C6 ii ii ss 11 00 00 00
#                         A3                         01 .., 02 .., 83 ..
#                         A2 03 7F                   D1 crc crc
#                         A1
# abort, either way       80 ii ii ss code
#
# Rules that hold for all transfers:
#
# - A value is read and written as a whole. An upload returns the value at the time of its first
#   request. A download changes the object with its last frame or not at all. Watchers and RPDOs
#   may change the object in between; a partly written value is never visible.
# - Refusals are exceptions. When anything that works on a request (entry, guard, size check,
#   transfer) raises SdoAbort, `receive` ends the transfer. The abort has the multiplexer of the
#   transfer, or 0 without a transfer.
# - `initiate` handles a request that does not continue the transfer. A new initiate request ends
#   the old transfer silently, an abort ends it, anything else is aborted with 0504 0001h. In
#   segmented transfers, a wrong toggle bit is checked first and aborted with 0503 0000h. Inside a
#   block there is no such check: each frame except 80h is a segment.
# - The time-out (`due_us`) starts again with each request. After `timeout_us` without a request
#   `tick` aborts with 0504 0000h. `wait` also schedules the service. `go_on` does not, because it
#   runs for each segment: the service wakes at the old deadline and finds that there is a later
#   one.
# - Received bytes are checked while they arrive (`_DownloadSize`): against the announced size,
#   the object and the memory. So a client cannot fill the memory before it is refused.
#
# `_without_transfer` itself answers the most common request: reading up to four bytes from an
# entry without a `source`. It must answer exactly as `initiate` would; for that reason
# `by_multiplexer` holds readable entries only. `answers` keeps the latest frame of each such
# entry. The frame is valid as long as the entry has the same bytes object that the frame was made
# of and the server has the same CAN-ID.
#
# Related files: `wire/canopen/sdo_frame.py` has the command bytes, `host/canopen` has the client.
# Before you change these rules, check the rules of `canmon` and the conformance checks, which
# judge exactly these points.

# Segmented transfer of one object (CiA 301, SDO download and SDO upload segment).

# Whole numbers and bytes at hand: segments come by the thousand.
_REQUESTED: Final = SPECIFIER | TOGGLE
_UPLOAD_SEGMENT: Final = int(ClientCommand.UPLOAD_SEGMENT)
_DOWNLOAD_SEGMENT: Final = int(ClientCommand.DOWNLOAD_SEGMENT)
_HEADS: Final = {toggle: bytes([toggle]) for toggle in (0, TOGGLE)}
"""First byte of an uploaded segment by toggle bit, except for the last segment."""
_TAKEN: Final = {
    toggle: bytes([ServerCommand.DOWNLOAD_SEGMENT | toggle]) + bytes(SEGMENT_BYTES)
    for toggle in (0, TOGGLE)
}
"""Response to a downloaded segment by toggle bit."""


class _DownloadSize(Part):
    """Checks the size that a client announces, and the size of the received data.

    Args:
        server: the server, with the memory limit of the slave.
        entry: the object to write.
        announced: number of bytes that the client announces, or None if it announces no number.

    Raises:
        SdoAbort: the entry is not writable, or the announced size does not fit.

    Attributes:
        announced: number of bytes that the client announces, as given.
        most: largest number of bytes. `check` raises the reason if there are more.
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
        """Raise SdoAbort if the size exceeds the announced size, or does not fit."""
        if size > self._long:
            raise SdoAbort(AbortCode.TOO_LONG)
        if size > self._free:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)


class _SegmentedUpload(Part):
    """Uploads a value in segments; the value is that of the first request."""

    def __init__(self, server: SdoServer, data: bytes) -> None:
        self._server, self._data = server, data
        self._at, self._toggle = 0, 0
        server.confirm(ServerCommand.UPLOAD | SIZE_INDICATED, len(data).to_bytes(4, "little"))
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Send the next segment."""
        command, toggle, at = request[0], self._toggle, self._at
        if command & _REQUESTED != _UPLOAD_SEGMENT | toggle:
            self._server.go_on_otherwise(request, _UPLOAD_SEGMENT)
            return
        self._at = behind = at + SEGMENT_BYTES
        self._toggle = toggle ^ TOGGLE
        if behind < len(self._data):
            self._server.respond(_HEADS[toggle] + self._data[at:behind])
            self._server.go_on()
        else:
            self._give_last(toggle, self._data[at:])

    def _give_last(self, toggle: int, part: bytes) -> None:
        head = toggle | SEGMENT_BYTES - len(part) << 1 | LAST
        self._server.respond(bytes([head]) + part.ljust(SEGMENT_BYTES, b"\0"))
        self._server.end()


class SegmentedDownload(Part):
    """Downloads a value in segments; the object changes with the last segment."""

    def __init__(self, server: SdoServer, entry: Entry, request: bytes) -> None:
        self._server, self._entry = server, entry
        self._data, self._toggle = bytearray(), 0
        announced = int.from_bytes(request[4:], "little") if request[0] & SIZE_INDICATED else None
        self._size = _DownloadSize(server, entry, announced)
        self._most, self._put = self._size.most, server.node.put
        self._taken = {at: data_frame(server.response_id, _TAKEN[at]) for at in _TAKEN}
        server.confirm(ServerCommand.DOWNLOAD)
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Handle the next segment."""
        command, toggle, data = request[0], self._toggle, self._data
        if command & _REQUESTED != _DOWNLOAD_SEGMENT | toggle:
            self._server.go_on_otherwise(request, _DOWNLOAD_SEGMENT)
            return
        # Bits 3 to 1: how many of the seven bytes are no data.
        data += request[1 : FRAME_BYTES - (command >> 1 & 7)]
        if len(data) > self._most:
            self._size.check(len(data))
        # Written before the answer: the answer says that the object has the value.
        if command & LAST:
            self._commit()
        self._put(self._taken[toggle])
        self._toggle = toggle ^ TOGGLE
        if command & LAST:
            self._server.end()
        else:
            self._server.go_on()

    def _commit(self) -> None:
        """Write the received data; SdoAbort if data are missing, or the object refuses them."""
        if len(self._data) < (self._size.announced or 0):
            raise SdoAbort(AbortCode.TOO_SHORT)
        self._entry.download(bytes(self._data))


# Block transfer of one object (CiA 301, SDO block download and SDO block upload).

_END_MASK: Final = 0xE1
"""Command specifier and subcommand of the end request; n is between them."""


class _BlockDownload(Part):
    """Downloads a value in blocks; the object changes when the client has ended the transfer.

    A segment out of sequence is dropped. At the end of the block the server acknowledges the last
    segment in sequence. If the last segment of the block is lost, the client must notice the
    loss, or the transfer times out. The server waits until then, because a client may be slow
    inside a block. The size is checked before the CRC. Inside a block every frame except an abort
    is a segment.
    """

    def __init__(self, server: SdoServer, entry: Entry, request: bytes) -> None:
        self._server, self._entry = server, entry
        self._data, self._in_sequence, self._finished = bytearray(), 0, False
        self._crc = request[0] & BLOCK_CRC
        # C2: size indicated; C4: the client can do the CRC; C0: neither.
        indicated = request[0] & BLOCK_SIZE_INDICATED
        announced = int.from_bytes(request[4:], "little") if indicated else None
        self._size = _DownloadSize(server, entry, announced)
        self._block_size = server.block_size
        command = ServerCommand.BLOCK_DOWNLOAD | self._crc
        server.confirm(command, bytes([self._block_size, 0, 0, 0]))
        server.wait(self._segment)

    def _segment(self, request: bytes) -> None:
        """Handle a segment of the running block."""
        head, due = request[0], self._in_sequence + 1
        if head == due and due < self._block_size:  # most are: in sequence, and not the last
            self._in_sequence = due
            self._data += request[1:]
            self._server.go_on()
        # 80h would be segment 0, which there is not: sequence numbers begin with 1.
        elif head == ClientCommand.ABORT:
            self._server.end()
        else:
            self._end_block(head, request)

    def _end_block(self, head: int, request: bytes) -> None:
        """Handle the last segment of a block, or drop a segment that is out of sequence."""
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
        """Acknowledge the received part of the block, and start the next block."""
        # The number of data bytes in the last segment is known only at the end of the transfer:
        # up to seven bytes may be padding.
        self._size.check(len(self._data) - SEGMENT_BYTES)
        self._block_size = self._server.block_size
        # A2, the last one in sequence (0 for none), segments of the next block.
        head = bytes([BLOCK_ACKNOWLEDGE, self._in_sequence, self._block_size])
        self._server.respond(head + bytes(5))
        self._in_sequence = 0
        self._server.wait(self._end if self._finished else self._segment)

    def _end(self, request: bytes) -> None:
        """Check the whole value, and write it."""
        if request[0] & _END_MASK != BLOCK_END:
            self._server.initiate(request)
            return
        # C1 with n in bits 4 to 2: number of bytes in the last segment that contain no data. The
        # CRC is in bytes 1 and 2.
        data = bytes(self._data[: len(self._data) - (request[0] >> 2 & 7)])
        self._size.check(len(data))
        if len(data) < (self._size.announced or 0):
            raise SdoAbort(AbortCode.TOO_SHORT)
        if self._crc and crc16(data) != int.from_bytes(request[1:3], "little"):
            raise SdoAbort(AbortCode.CRC)
        self._entry.download(data)
        self._server.respond(bytes([BLOCK_ENDED]) + bytes(7))
        self._server.end()


class _BlockUpload(Part):
    """Uploads a value in blocks, one block in a tick.

    The client receives the value at the time of its first request.

    A value that is not longer than the protocol switch threshold of the client is sent by
    expedited or segmented upload. After a lost segment, a new block starts with the lost segment.
    The block size in the last acknowledgement is ignored. The server indicates CRC support only
    to clients with CRC support, because some clients check the CRC whenever the server supports
    it.
    """

    def __init__(self, server: SdoServer, data: bytes, request: bytes) -> None:
        self._server, self._data = server, data
        self._next = self._sent = 0
        self._segments = max(1, -(-len(data) // SEGMENT_BYTES))
        self._use_block_size(request[4])
        # Protocol switch threshold: 0 forbids the switch (CiA 301, initiate SDO block
        # upload).
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
        """Handle the request that starts the upload."""
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
        """Continue after the last segment that the client has received."""
        if request[0] != BLOCK_ACKNOWLEDGE:
            self._server.initiate(request)
            return
        if request[1] > self._sent:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        # Segments behind the acknowledged one are sent again, first in the next block.
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
        """Handle the end of the transfer, after the client has checked the data."""
        if request[0] == BLOCK_ENDED:
            self._server.end()
        else:
            self._server.initiate(request)


# One SDO server: takes requests on one CAN-ID and answers on another (CiA 301, SDO).

_TIMEOUT_US: Final = 5_000_000
_MEMORY_BYTES: Final = 64 << 20


@dataclass(frozen=True, slots=True)
class SdoLimits(Immutable):
    """Limits of the SDO servers of a device, which CiA 301 does not define.

    Attributes:
        timeout_us: time without a request after which a transfer is aborted, at least 1.
        memory_bytes: memory for all strings and domains of the slave together. The limit of a
            single object is in its description.
    """

    timeout_us: int = _TIMEOUT_US
    memory_bytes: int = _MEMORY_BYTES

    def __post_init__(self) -> None:
        if self.timeout_us < 1:
            raise ValueError(f"an SDO time-out of {self.timeout_us} us is less than 1 us")
        if self.memory_bytes < 0:
            raise ValueError(f"a memory of {self.memory_bytes} bytes is less than 0")


USUAL: Final = SdoLimits()


State = Callable[[bytes], None]
"""The state of the server: the method that handles the next request."""

_NO_MULTIPLEXER: Final = bytes(3)
_INITIATE: Final[dict[int, int]] = {
    ClientCommand.DOWNLOAD: 0,
    ClientCommand.UPLOAD: 0,
    ClientCommand.BLOCK_UPLOAD: BLOCK_SUBCOMMAND,
    ClientCommand.BLOCK_DOWNLOAD: BLOCK_END & BLOCK_SUBCOMMAND,
}
"""Commands that begin a transfer.

The value of a block command is the mask of the bits that are 0 in its initiate request.
"""
_UPLOAD: Final = int(ClientCommand.UPLOAD)
_EXPEDITED: Final = tuple(
    bytes([ServerCommand.UPLOAD | EXPEDITED | SIZE_INDICATED | EXPEDITED_BYTES - size << 2])
    for size in range(EXPEDITED_BYTES + 1)
)
"""First byte of an expedited response, by the number of bytes."""
_FILL: Final = tuple(bytes(EXPEDITED_BYTES - size) for size in range(EXPEDITED_BYTES + 1))


class SdoServer(Part):
    """Serves one client, one transfer at a time, with all transfer types of CiA 301.

    The server decides these cases, which CiA 301 leaves open:

    - A request without exactly 8 bytes is ignored.
    - A new initiate request ends a running transfer silently.
    - A request that is invalid in the present state is aborted with 0504 0001h. The multiplexer
      of the abort is 0 if no transfer runs.
    - Reserved bits are ignored.

    Not emulated: network indication, the time that a real server needs.

    Args:
        node: the slave.
        wake: function that schedules a check of `due_us`.
        limits: limits that CiA 301 leaves to the device.

    Attributes:
        request_id: CAN-ID from client to server.
        response_id: CAN-ID from server to client.
        block_size: number of segments in a block that the server offers for block download,
            1..127.
        due_us: time at which the transfer times out.
    """

    def __init__(self, node: CanopenSlave, wake: Callable[[int], None], limits: SdoLimits) -> None:
        self.node, self._wake = node, wake
        self.limit(limits)
        self.request_id: int
        self.response_id: int
        self.block_size = MAX_BLOCK_SIZE
        self._entries = node.dictionary.by_multiplexer
        self._answers = node.dictionary.answers
        self._multiplexer: bytes
        self._idle: State = self._without_transfer
        self._state: State
        self.due_us: int

    def limit(self, limits: SdoLimits) -> None:
        """Apply other limits from the next request on."""
        self._memory_bytes, self._timeout_us = limits.memory_bytes, limits.timeout_us

    def receive(self, frame: CanFrame) -> None:
        """Handle a request or the next segment."""
        request = frame[1]
        if len(request) == FRAME_BYTES:
            try:
                self._state(request)
            except SdoAbort as refused:
                self.abort(refused.code)

    def respond(self, response: bytes) -> None:
        """Send a frame to the client."""
        self.node.send(self.response_id, response)

    def confirm(self, command: int, rest: bytes = bytes(4)) -> None:
        """Send a response that names the object of the transfer."""
        self.respond(bytes([command]) + self._multiplexer + rest)

    def wait(self, state: State) -> None:
        """Wait for the next request of the transfer, with the time-out."""
        self._state = state
        self.go_on()
        self._wake(self.due_us)

    def go_on(self) -> None:
        """Wait for the next request of the same kind, and restart the time-out."""
        self.due_us = self.node.now_us + self._timeout_us

    def go_on_otherwise(self, request: bytes, specifier: int) -> None:
        """Handle a request that is not the expected segment; wrong toggle bits raise SdoAbort."""
        if request[0] & SPECIFIER == specifier:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        self.initiate(request)

    def free_bytes(self, entry: Entry) -> int:
        """Return the memory that the other strings and domains leave for an entry."""
        others = (one for one in self.node.dictionary if not one.size and one is not entry)
        return self._memory_bytes - sum(len(one.data) for one in others)

    def end(self) -> None:
        """End the transfer."""
        self._state, self._multiplexer, self.due_us = self._idle, _NO_MULTIPLEXER, NEVER

    def abort(self, code: AbortCode) -> None:
        """End the transfer with an abort to the client."""
        self.confirm(ServerCommand.ABORT, code.to_bytes(4, "little"))
        self.end()

    def initiate(self, request: bytes) -> None:
        """Handle a request that starts an SDO transfer, or that aborts the present one.

        Requests within a transfer are handled elsewhere.

        Args:
            request: eight bytes of the client's frame.

        Raises:
            SdoAbort: the request is invalid, or the access is refused.
        """
        command = request[0]
        if command == ClientCommand.ABORT:
            self.end()
            return
        specifier = command & SPECIFIER
        if specifier not in _INITIATE or command & _INITIATE[specifier]:
            raise SdoAbort(AbortCode.COMMAND_SPECIFIER)
        self._multiplexer = request[1:4]
        entry = self.node.dictionary.look_up(self._multiplexer)
        match specifier:
            case ClientCommand.DOWNLOAD:
                self._begin_download(entry, request)
            case ClientCommand.UPLOAD:
                self.upload(entry.upload())
            case ClientCommand.BLOCK_UPLOAD:
                _BlockUpload(self, entry.upload(), request)
            case _:
                _BlockDownload(self, entry, request)

    def upload(self, data: bytes) -> None:
        """Upload a value in one response, or start a segmented upload."""
        size = len(data)
        if 0 < size <= EXPEDITED_BYTES:
            self.respond(_EXPEDITED[size] + self._multiplexer + data + _FILL[size])
            self.end()
        else:
            _SegmentedUpload(self, data)

    def _without_transfer(self, request: bytes) -> None:
        """Handle a request while no transfer runs, with a short path for reading a small value."""
        if request[0] == _UPLOAD:
            multiplexer = request[1:4]
            answer = self._answers.get(multiplexer)
            if answer is not None:
                entry, data, frame = answer
                # The frame of the same bytes is sent again: a third of an upload in process.
                if entry.data is data and entry.source is None and frame[0] == self.response_id:
                    self.node.put(frame)
                    return
            found = self._entries.get(multiplexer)
            if found is not None and found.source is None:
                data = found.data
                size = len(data)
                if 0 < size <= EXPEDITED_BYTES:
                    response = _EXPEDITED[size] + multiplexer + data + _FILL[size]
                    frame = data_frame(self.response_id, response)
                    self._answers[multiplexer] = found, data, frame
                    self.node.put(frame)
                    return
        self.initiate(request)

    def _begin_download(self, entry: Entry, request: bytes) -> None:
        """Download a value at once, or start a segmented download.

        Expedited data without an indicated size fill the object; additional bytes are ignored.
        """
        command = request[0]
        if not command & EXPEDITED:
            SegmentedDownload(self, entry, request)
            return
        # 23, 27, 2B, 2F: 4, 3, 2, 1 bytes. Without bit 0 (22h) the number of bytes is the size of
        # the object.
        size = EXPEDITED_BYTES - (command >> 2 & 3)
        if not command & SIZE_INDICATED:
            size = min(entry.size or EXPEDITED_BYTES, EXPEDITED_BYTES)
        entry.download(request[4 : 4 + size])
        self.respond(bytes([ServerCommand.DOWNLOAD]) + request[1:4] + bytes(4))
        self.end()


# All SDO servers of a slave (CiA 301, SDO server parameter; objects 1200h to 127Fh).

_DEFAULT_SERVER: Final = 0x1200
_ADDITIONAL_SERVERS: Final = range(0x1201, 0x1280)
_CLIENT_TO_SERVER: Final = 1
_SERVER_TO_CLIENT: Final = 2


class _Additional(NamedTuple):
    """An additional server with its two COB-IDs."""

    server: SdoServer
    request: Entry
    response: Entry

    @property
    def exists(self) -> bool:
        return is_valid(self.request.number) and is_valid(self.response.number)

    def configure(self) -> None:
        """Apply the CAN-IDs; a server that is switched off ends its transfer."""
        if self.exists:
            self.server.request_id = self.request.number & CAN_ID_MASK
            self.server.response_id = self.response.number & CAN_ID_MASK


@mypyc_attr(allow_interpreted_subclasses=True)
class SdoServers(Service):
    """The SDO servers of a slave: the default server (1200h) and the additional servers (1201h on).

    The default server exists even without 1200h. If 1200h exists, it is read-only and shows the
    COB-IDs of the default server. An additional server is active when both its COB-IDs are valid.
    The CAN-ID in a COB-ID can be changed only while this COB-ID is invalid. Bit 30 (dynamic) is
    stored and has no effect. When the slave leaves the NMT states Pre-operational and Operational,
    its transfers end without an abort frame.

    29-bit CAN-IDs are not emulated. The slave does not check whether two servers have the same
    CAN-ID.

    Attributes:
        default: server of 1200h.
        limits: limits of all servers.
    """

    def __init__(self, node: CanopenSlave, slot: int, limits: SdoLimits = USUAL) -> None:
        super().__init__(node, slot)
        self._due_us, self.limits = NEVER, limits
        self.default = SdoServer(node, self._wake, limits)
        self._additional = [
            _Additional(SdoServer(node, self._wake, limits), request, response)
            for index in node.dictionary.within(_ADDITIONAL_SERVERS)
            if (request := node.dictionary.find(index, _CLIENT_TO_SERVER))
            and (response := node.dictionary.find(index, _SERVER_TO_CLIENT))
        ]
        for additional in self._additional:
            for entry in (additional.request, additional.response):
                entry.guard = check_sdo_cob_id
                entry.written = self._configure
        self.servers = [self.default, *(additional.server for additional in self._additional)]

    def limit(self, limits: SdoLimits) -> None:
        """Apply other limits from the next request on.

        Args:
            limits: new limits.
        """
        self.limits = limits
        for server in self.servers:
            server.limit(limits)

    def start(self) -> None:
        """Apply the power-on values."""
        self._due_us = NEVER
        self._end_all()
        self.default.request_id = REQUEST_COB_ID + self.node.node_id
        self.default.response_id = RESPONSE_COB_ID + self.node.node_id
        # After a change of the node-ID 1200h follows; it is made read-only whatever the EDS
        # says.
        self._describe(_CLIENT_TO_SERVER, self.default.request_id)
        self._describe(_SERVER_TO_CLIENT, self.default.response_id)
        for additional in self._additional:
            additional.configure()

    def _describe(self, sub: int, can_id: int) -> None:
        entry = self.node.dictionary.find(_DEFAULT_SERVER, sub)
        if entry is not None and entry.data_type is DataType.UNSIGNED32:
            entry.assign(can_id.to_bytes(entry.size, "little"))
            entry.guard = _refuse

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the clients in Pre-operational and Operational."""
        if state in ALIVE:
            yield self.default.request_id, self.default.receive
            for additional in self._additional:
                if additional.exists:
                    yield additional.server.request_id, additional.server.receive

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Return the CAN-IDs of the clients, which can write COB-IDs, consumers and mappings."""
        return (can_id for can_id, _ in self.handlers(state))

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Drop transfers when the slave leaves the NMT states with SDO."""
        if new not in ALIVE:
            self._end_all()

    def tick(self, now_us: int) -> None:
        """Abort transfers of clients whose time-out has passed."""
        for server in self.servers:
            if server.due_us <= now_us:
                server.abort(AbortCode.TIMEOUT)
        self._due_us = min(server.due_us for server in self.servers)
        self.schedule(self._due_us)

    def _wake(self, due_us: int) -> None:
        """Schedule the earliest time-out; waking too early does no harm."""
        if due_us < self._due_us:
            self._due_us = due_us
            self.schedule(due_us)

    def _configure(self, entry: Entry) -> None:
        """Apply a COB-ID that the bus has changed."""
        for additional in self._additional:
            additional.configure()
            # The CAN-IDs stay in the server until it is valid again; until then nothing listens to
            # them.
            if not additional.exists:
                additional.server.end()
        self.node.rewire()

    def _end_all(self) -> None:
        for server in self.servers:
            server.end()


def _refuse(_entry: Entry, _value: Value) -> None:
    raise SdoAbort(AbortCode.READ_ONLY)
