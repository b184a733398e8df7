"""One SDO server: takes requests on one CAN-ID and answers on another (CiA 301, SDO)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.sdo.sdo_block import BlockDownload, BlockUpload
from tickrig.device.canopen.sdo.sdo_segmented import SegmentedDownload, SegmentedUpload
from tickrig.device.twin import Immutable, Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo_command import (
    BLOCK_END,
    BLOCK_SUBCOMMAND,
    EXPEDITED,
    EXPEDITED_BYTES,
    FRAME_BYTES,
    MAX_BLOCK_SIZE,
    SIZE_INDICATED,
    SPECIFIER,
    ClientCommand,
    ServerCommand,
)
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.core.entry import Entry
    from tickrig.device.canopen.core.slave import CanopenSlave


TIMEOUT_US: Final = 5_000_000
MEMORY_BYTES: Final = 64 << 20


@dataclass(frozen=True, slots=True)
class SdoLimits(Immutable):
    """What CiA 301 leaves to the device.

    Attributes:
        timeout_us: silence of the client after which a transfer is aborted, at least 1.
        memory_bytes: what all strings and domains of the slave hold together; what an
            object itself may hold stands in its description.
    """

    timeout_us: int = TIMEOUT_US
    memory_bytes: int = MEMORY_BYTES

    def __post_init__(self) -> None:
        if self.timeout_us < 1:
            raise ValueError(f"an SDO time-out of {self.timeout_us} us is less than 1 us")
        if self.memory_bytes < 0:
            raise ValueError(f"a memory of {self.memory_bytes} bytes is less than 0")


USUAL: Final = SdoLimits()


State = Callable[[bytes], None]
"""What the next request means; a transfer is in one of these at a time."""

NO_MULTIPLEXER: Final = bytes(3)
_INITIATE: Final[dict[int, int]] = {
    ClientCommand.DOWNLOAD: 0,
    ClientCommand.UPLOAD: 0,
    ClientCommand.BLOCK_UPLOAD: BLOCK_SUBCOMMAND,
    ClientCommand.BLOCK_DOWNLOAD: BLOCK_END & BLOCK_SUBCOMMAND,
}
"""Commands that begin a transfer; bits of a block command that are 0 in an initiate request."""
_UPLOAD: Final = int(ClientCommand.UPLOAD)
_EXPEDITED: Final = tuple(
    bytes([ServerCommand.UPLOAD | EXPEDITED | SIZE_INDICATED | EXPEDITED_BYTES - size << 2])
    for size in range(EXPEDITED_BYTES + 1)
)
"""First byte of an expedited answer, by the number of bytes."""
_FILL: Final = tuple(bytes(EXPEDITED_BYTES - size) for size in range(EXPEDITED_BYTES + 1))


class SdoServer(Part):
    """Serves one client: one transfer at a time, every kind of CiA 301.

    Where CiA 301 leaves it open: requests that do not have 8 bytes are ignored.
    A new initiate request ends a running transfer silently. What is no request
    in the present state is aborted with 0504 0001h, with multiplexer 0 if no
    transfer runs. Reserved bits are not looked at.

    Not emulated: network indication, the time that a real server needs.

    Args:
        node: the slave.
        wake: asks for a look at `due_us` at that time.
        limits: what CiA 301 leaves to the device.

    Attributes:
        request_id: CAN-ID from client to server.
        response_id: CAN-ID from server to client.
        block_size: segments in a block that it offers for block download, 1..127.
        due_us: when the transfer times out.
    """

    def __init__(self, node: CanopenSlave, wake: Callable[[int], None], limits: SdoLimits) -> None:
        self.node, self._wake = node, wake
        self.limit(limits)
        self.request_id: int
        self.response_id: int
        self.block_size = MAX_BLOCK_SIZE
        self._entries = node.dictionary.by_multiplexer
        self._multiplexer: bytes
        self._idle: State = self._without_transfer
        self._state: State
        self.due_us: int

    def limit(self, limits: SdoLimits) -> None:
        """Put up with other limits, from the next request on."""
        self._memory_bytes, self._timeout_us = limits.memory_bytes, limits.timeout_us

    def receive(self, frame: CanFrame) -> None:
        """Take a request, or the next segment."""
        request = frame[1]
        if len(request) == FRAME_BYTES:
            try:
                self._state(request)
            except SdoAbort as refused:
                self.abort(refused.code)

    def respond(self, response: bytes) -> None:
        """Send to the client."""
        self.node.send(self.response_id, response)

    def confirm(self, command: int, rest: bytes = bytes(4)) -> None:
        """Send a response that names the object of the transfer."""
        self.respond(bytes([command]) + self._multiplexer + rest)

    def wait(self, state: State) -> None:
        """Let the transfer wait for a request, but not for ever."""
        self._state = state
        self.go_on()
        self._wake(self.due_us)

    def go_on(self) -> None:
        """Let the transfer wait for the next request of the same meaning, as long again."""
        self.due_us = self.node.now_us + self._timeout_us

    def go_on_otherwise(self, request: bytes, specifier: int) -> None:
        """Take what is not the segment that was due: SdoAbort if only its toggle bit is wrong."""
        if request[0] & SPECIFIER == specifier:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        self.initiate(request)

    def free_bytes(self, entry: Entry) -> int:
        """Return what a string or domain may hold beside all others."""
        others = (one for one in self.node.dictionary if not one.size and one is not entry)
        return self._memory_bytes - sum(len(one.data) for one in others)

    def end(self) -> None:
        """End the transfer."""
        self._state, self._multiplexer, self.due_us = self._idle, NO_MULTIPLEXER, NEVER

    def abort(self, code: AbortCode) -> None:
        """End the transfer; the client gets the reason."""
        self.confirm(ServerCommand.ABORT, code.to_bytes(4, "little"))
        self.end()

    def initiate(self, request: bytes) -> None:
        """Take a request that does not go on with a transfer: it begins one, or ends it."""
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
                BlockUpload(self, entry.upload(), request)
            case _:
                BlockDownload(self, entry, request)

    def upload(self, data: bytes) -> None:
        """Give a value in one answer, or begin to give it in segments."""
        size = len(data)
        if 0 < size <= EXPEDITED_BYTES:
            self.respond(_EXPEDITED[size] + self._multiplexer + data + _FILL[size])
            self.end()
        else:
            SegmentedUpload(self, data)

    def _without_transfer(self, request: bytes) -> None:
        """Take a request while no transfer runs; reading a small value is the short way."""
        if request[0] == _UPLOAD:
            multiplexer = request[1:4]
            entry = self._entries.get(multiplexer)
            if entry is not None and entry.source is None:
                data = entry.data
                size = len(data)
                if 0 < size <= EXPEDITED_BYTES:
                    response = _EXPEDITED[size] + multiplexer + data + _FILL[size]
                    self.node.send(self.response_id, response)
                    return
        self.initiate(request)

    def _begin_download(self, entry: Entry, request: bytes) -> None:
        """Write at once, or begin to take segments.

        Expedited data without a size fills the object: the bytes beyond are not looked at.
        """
        command = request[0]
        if not command & EXPEDITED:
            SegmentedDownload(self, entry, request)
            return
        size = EXPEDITED_BYTES - (command >> 2 & 3)
        if not command & SIZE_INDICATED:
            size = min(entry.size or EXPEDITED_BYTES, EXPEDITED_BYTES)
        entry.download(request[4 : 4 + size])
        self.respond(bytes([ServerCommand.DOWNLOAD]) + request[1:4] + bytes(4))
        self.end()
