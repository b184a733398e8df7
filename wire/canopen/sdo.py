r"""SDO frames as values: expedited and segmented transfer, abort (CiA 301, SDO protocols).

The first byte from a client and the first byte from a server have different meanings, so each side
has a parser. A segment of a block transfer looks like any other frame: use `BlockSegment.parse`
while a block is running.

>>> parse_request(bytes.fromhex("2F002000A5000000"))
DownloadInitiateRequest(index=8192, sub=0, data=b'\xa5', size=1)
>>> parse_response(bytes.fromhex("8000100111000906"))
Abort(index=4096, sub=1, code=<AbortCode.NO_SUBINDEX: 101253137>)
>>> UploadInitiateRequest(0x1008, 0).encode().hex()
'4008100000000000'
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final, Self

from tickrig.wire.canopen.sdo_frame import (
    BLOCK_SUBCOMMAND,
    EXPEDITED,
    EXPEDITED_BYTES,
    FRAME_BYTES,
    LAST,
    SEGMENT_BYTES,
    SIZE_INDICATED,
    SPECIFIER,
    TOGGLE,
    AbortCode,
    BlockAcknowledge,
    BlockDownloadInitiateRequest,
    BlockDownloadInitiateResponse,
    BlockEnd,
    BlockEnded,
    BlockStart,
    BlockUploadInitiateRequest,
    BlockUploadInitiateResponse,
    ClientCommand,
    ServerCommand,
    check_frame,
    frame_at,
    index_sub,
    number_field,
)
from tickrig.wire.errors import FieldError, FramingError

_CODES: Final[dict[int, AbortCode]] = {int(code): code for code in AbortCode}


@dataclass(frozen=True, slots=True)
class Abort:
    """The SDO frame "abort SDO transfer", which the client or the server sends.

    Attributes:
        code: abort code as an `AbortCode`, or the received number if it is unknown.
    """

    index: int
    sub: int
    code: int

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return frame_at(ClientCommand.ABORT, self.index, self.sub, number_field(self.code))

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        code = int.from_bytes(frame[4:], "little")
        return cls(*index_sub(frame), _CODES.get(code, code))


@dataclass(frozen=True, slots=True)
class _Initiate:
    """Initiate frame of a transfer, with the data or its size.

    Attributes:
        data: data of an expedited transfer, 1 to 4 bytes, or None if segments follow.
        size: number of bytes, or None if the size is not indicated. Expedited data then have 4
            bytes.
    """

    COMMAND: ClassVar[int]

    index: int
    sub: int
    data: bytes | None = None
    size: int | None = None

    def __post_init__(self) -> None:
        if self.data is not None and not 1 <= len(self.data) <= EXPEDITED_BYTES:
            raise FieldError(f"{len(self.data)} bytes expedited, 1 to 4 fit")
        if self.data is not None and (self.size or EXPEDITED_BYTES) != len(self.data):
            raise FieldError(f"size {self.size} does not match {len(self.data)} bytes")

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        command = self.COMMAND | (SIZE_INDICATED if self.size is not None else 0)
        if self.data is None:
            return frame_at(command, self.index, self.sub, number_field(self.size or 0))
        command |= EXPEDITED | EXPEDITED_BYTES - len(self.data) << 2
        return frame_at(command, self.index, self.sub, self.data)

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        command, index, sub = frame[0], frame[1] | frame[2] << 8, frame[3]
        indicated = bool(command & SIZE_INDICATED)
        if not command & EXPEDITED:
            size = int.from_bytes(frame[4:], "little") if indicated else None
            return cls(index, sub, None, size)
        # 22h: no size is indicated, so all four bytes count as data.
        size = EXPEDITED_BYTES - (command >> 2 & 3) if indicated else EXPEDITED_BYTES
        return cls(index, sub, frame[4 : 4 + size], size if indicated else None)


class DownloadInitiateRequest(_Initiate):
    """Initiate SDO download."""

    __slots__ = ()
    COMMAND = ClientCommand.DOWNLOAD


class UploadInitiateResponse(_Initiate):
    """Response to `UploadInitiateRequest`."""

    __slots__ = ()
    COMMAND = ServerCommand.UPLOAD


@dataclass(frozen=True, slots=True)
class _Named:
    """A frame with an index and sub-index only."""

    COMMAND: ClassVar[int]

    index: int
    sub: int

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return frame_at(self.COMMAND, self.index, self.sub)

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls(*index_sub(frame))


class UploadInitiateRequest(_Named):
    """Initiate SDO upload."""

    __slots__ = ()
    COMMAND = ClientCommand.UPLOAD


class DownloadInitiateResponse(_Named):
    """Response to `DownloadInitiateRequest`: expedited data is written, or segments may follow."""

    __slots__ = ()
    COMMAND = ServerCommand.DOWNLOAD


@dataclass(frozen=True, slots=True)
class Segment:
    """An SDO frame with up to 7 bytes of a segmented transfer, from the client or the server.

    Attributes:
        last: whether no more segments follow.
    """

    toggle: bool
    data: bytes
    last: bool

    def __post_init__(self) -> None:
        if len(self.data) > SEGMENT_BYTES:
            raise FieldError(f"a segment of {len(self.data)} bytes, at most 7 fit")

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        command = self.toggle * TOGGLE | (SEGMENT_BYTES - len(self.data)) << 1 | self.last
        return bytes([command]) + self.data.ljust(SEGMENT_BYTES, b"\0")

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        command = frame[0]
        data = frame[1 : FRAME_BYTES - (command >> 1 & 7)]
        return cls(bool(command & TOGGLE), data, bool(command & LAST))


@dataclass(frozen=True, slots=True)
class _Toggled:
    """A frame with a toggle bit only."""

    COMMAND: ClassVar[int]

    toggle: bool

    def encode(self) -> bytes:
        """Return the 8 bytes."""
        return bytes([self.COMMAND | self.toggle * TOGGLE, *bytes(SEGMENT_BYTES)])

    @classmethod
    def parse(cls, frame: bytes) -> Self:
        """Read the 8 bytes."""
        return cls(bool(frame[0] & TOGGLE))


class UploadSegmentRequest(_Toggled):
    """Request for the next segment."""

    __slots__ = ()
    COMMAND = ClientCommand.UPLOAD_SEGMENT


class DownloadSegmentResponse(_Toggled):
    """Response to a `Segment` of a download."""

    __slots__ = ()
    COMMAND = ServerCommand.DOWNLOAD_SEGMENT


Request = (
    Abort
    | DownloadInitiateRequest
    | UploadInitiateRequest
    | Segment
    | UploadSegmentRequest
    | BlockDownloadInitiateRequest
    | BlockUploadInitiateRequest
    | BlockStart
    | BlockAcknowledge
    | BlockEnd
    | BlockEnded
)
"""Frames of a client, except the segments of a block download."""

Response = (
    Abort
    | DownloadInitiateResponse
    | UploadInitiateResponse
    | Segment
    | DownloadSegmentResponse
    | BlockDownloadInitiateResponse
    | BlockUploadInitiateResponse
    | BlockAcknowledge
    | BlockEnd
    | BlockEnded
)
"""Frames of a server, except the segments of a block upload."""

_REQUESTS: Final[dict[int, Callable[[bytes], Request]]] = {
    ClientCommand.DOWNLOAD_SEGMENT: Segment.parse,
    ClientCommand.DOWNLOAD: DownloadInitiateRequest.parse,
    ClientCommand.UPLOAD: UploadInitiateRequest.parse,
    ClientCommand.UPLOAD_SEGMENT: UploadSegmentRequest.parse,
    ClientCommand.ABORT: Abort.parse,
}
_RESPONSES: Final[dict[int, Callable[[bytes], Response]]] = {
    ServerCommand.UPLOAD_SEGMENT: Segment.parse,
    ServerCommand.DOWNLOAD_SEGMENT: DownloadSegmentResponse.parse,
    ServerCommand.UPLOAD: UploadInitiateResponse.parse,
    ServerCommand.DOWNLOAD: DownloadInitiateResponse.parse,
    ServerCommand.ABORT: Abort.parse,
}
# Bits 0 and 1 of a block command. In the direction of the data (client of a download,
# server of an upload) bit 0 is the subcommand, 0 initiate and 1 end, and bit 1 of an
# initiate says whether a size follows: C0h, C2h, C1h; hence `* 2`. Against it both bits are
# the subcommand: A0h initiate, A1h end, A2h acknowledge, and of a client A3h start.
_BLOCK_REQUESTS: Final[dict[int, tuple[Callable[[bytes], Request], ...]]] = {
    ClientCommand.BLOCK_UPLOAD: (
        BlockUploadInitiateRequest.parse,
        BlockEnded.parse,
        BlockAcknowledge.parse,
        BlockStart.parse,
    ),
    ClientCommand.BLOCK_DOWNLOAD: (BlockDownloadInitiateRequest.parse, BlockEnd.parse) * 2,
}
_BLOCK_RESPONSES: Final[dict[int, tuple[Callable[[bytes], Response] | None, ...]]] = {
    ServerCommand.BLOCK_DOWNLOAD: (
        BlockDownloadInitiateResponse.parse,
        BlockEnded.parse,
        BlockAcknowledge.parse,
        None,
    ),
    ServerCommand.BLOCK_UPLOAD: (BlockUploadInitiateResponse.parse, BlockEnd.parse) * 2,
}
"""Frames by subcommand, which has two bits in a block upload, including the size bit."""


def parse_request(frame: bytes) -> Request:
    """Read a frame of a client; raise FramingError if it is not a command."""
    check_frame(frame)
    specifier = frame[0] & SPECIFIER
    choice = _BLOCK_REQUESTS.get(specifier)
    parse = _REQUESTS.get(specifier) if choice is None else choice[frame[0] & BLOCK_SUBCOMMAND]
    if parse is None:
        raise FramingError(f"client command {frame[0]:02X}h is not of CiA 301")
    return parse(frame)


def parse_response(frame: bytes) -> Response:
    """Read a frame of a server; raise FramingError if it is not a command."""
    if len(frame) != FRAME_BYTES:
        check_frame(frame)
    specifier = frame[0] & SPECIFIER
    choice = _BLOCK_RESPONSES.get(specifier)
    parse = _RESPONSES.get(specifier) if choice is None else choice[frame[0] & BLOCK_SUBCOMMAND]
    if parse is None:
        raise FramingError(f"server command {frame[0]:02X}h is not of CiA 301")
    return parse(frame)
