"""Program download into one node: 1F50h, 1F51h, 1F56h and 1F57h (CiA 302-3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NoReturn, TypeVar

from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.dialogue import Script, SdoFrame, SdoRequest
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoTimeout
from tickrig.host.canopen.master import boot_slave
from tickrig.host.canopen.sdo_transfer import download
from tickrig.wire.canopen import sdo_frame
from tickrig.wire.canopen.sdo import Abort

# SDO block download as a script (CiA 301, SDO block download).

_MOST_IDLE: Final = 20
"""So many blocks in a row of which nothing came through end the transfer."""

Answer = TypeVar("Answer")

_OnProgress = Callable[[int], object]
"""Called with the number of bytes that the server has acknowledged."""


def download_blocks(index: int, sub: int, data: bytes, on_progress: _OnProgress) -> Script[None]:
    """Write an object in blocks, with CRC if the server can.

    What is lost within a block is sent again from there on. If the last segment of a block or
    its acknowledgement is lost, CiA 301 has no way to go on: the transfer times out.

    Args:
        index: of the object.
        sub: its sub-index.
        data: what is written.
        on_progress: is told how far it is.

    Raises:
        SdoAborted: the server refuses, or answers something else; `COMMAND_SPECIFIER` from
            one that does no block transfer.
        SdoTimeout: it does not answer.
    """
    request = sdo_frame.BlockDownloadInitiateRequest(index, sub, crc=True, size=len(data)).encode()
    first = SdoRequest(request, index, sub)
    begun = yield from _request(first, sdo_frame.BlockDownloadInitiateResponse)
    block_size, total, taken, idle = (
        begun.block_size,
        max(1, -(-len(data) // sdo_frame.SEGMENT_BYTES)),
        0,
        0,
    )
    while taken < total:
        if not 1 <= block_size <= sdo_frame.MAX_BLOCK_SIZE:
            yield from _abort(index, sub, sdo_frame.AbortCode.BLOCK_SIZE)
        count = min(block_size, total - taken)
        receipt = yield from _send_block(index, sub, data, taken, count)
        idle = 0 if receipt.ackseq else idle + 1
        if receipt.ackseq > count or idle == _MOST_IDLE:
            yield from _abort(index, sub, sdo_frame.AbortCode.SEQUENCE_NUMBER)
        taken, block_size = taken + receipt.ackseq, receipt.block_size
        on_progress(min(taken * sdo_frame.SEGMENT_BYTES, len(data)))
    end = sdo_frame.BlockEnd(
        total * sdo_frame.SEGMENT_BYTES - len(data), sdo_frame.crc16(data) if begun.crc else 0
    )
    yield from _request(SdoRequest(end.encode(), index, sub, goes_on=True), sdo_frame.BlockEnded)


def _send_block(
    index: int, sub: int, data: bytes, first: int, count: int
) -> Script[sdo_frame.BlockAcknowledge]:
    """Send segments; return the receipt of the last of them."""
    at = first * sdo_frame.SEGMENT_BYTES
    for seqno in range(1, count):
        yield SdoFrame(bytes((seqno,)) + data[at : at + sdo_frame.SEGMENT_BYTES])
        at += sdo_frame.SEGMENT_BYTES
    last = sdo_frame.BlockSegment(
        count, data[at : at + sdo_frame.SEGMENT_BYTES], at + sdo_frame.SEGMENT_BYTES >= len(data)
    )
    request = SdoRequest(last.encode(), index, sub, goes_on=True)
    return (yield from _request(request, sdo_frame.BlockAcknowledge))


def _request(request: SdoRequest, kind: type[Answer]) -> Script[Answer]:
    """Send, and return the answer; what is no such answer ends the transfer."""
    answer = yield request
    if isinstance(answer, kind):
        return answer
    if isinstance(answer, Abort):
        raise SdoAborted(request.index, request.sub, answer.code)
    return (yield from _abort(request.index, request.sub, sdo_frame.AbortCode.COMMAND_SPECIFIER))


def _abort(index: int, sub: int, code: sdo_frame.AbortCode) -> Script[NoReturn]:
    """End the transfer: the server has said what it may not."""
    yield SdoFrame(Abort(index, sub, code).encode())
    raise SdoAborted(index, sub, code)


COMMANDS: Final = {"stop": 0, "start": 1, "reset": 2, "clear": 3}
"""Program control, 1F51h."""
_STATES: Final = {0: "stopped", 1: "running"}

_PATIENCE_US: Final = 60_000_000
"""How long flash may be busy, and a program may take to stop or start."""
_ANSWER_US: Final = 10_000_000
"""How long a node that clears its flash may take to answer."""

_LOOKS: Final = 3
_SILENCE_US: Final = 500_000
"""What a node answers to segments behind an abort has come by then."""

_ERRORS: Final = {
    0: "no error",
    1: "no valid program",
    2: "data format unknown",
    3: "data format or CRC wrong",
    4: "flash not cleared before it was written",
    5: "flash write error",
    6: "address error",
    7: "flash secured",
    63: "unspecified error",
}
"""Of 1F57h, bits 1 to 7."""

_AGAIN: Final = (
    sdo_frame.AbortCode.CRC,
    sdo_frame.AbortCode.SEQUENCE_NUMBER,
    sdo_frame.AbortCode.TIMEOUT,
)
"""Aborts by which a transfer was disturbed, and not refused."""

_Say = Callable[[str], object]


class ProgramFailed(Exception):  # noqa: N818 - what the node did
    """The node did not do what was wanted; what, is in the text."""


@dataclass(frozen=True, slots=True)
class ProgramStatus:
    """What a node says of a program.

    Attributes:
        control: 1F51h.
        identification: 1F56h, None if it has none.
        flash: 1F57h, None if it has none.
    """

    control: int
    identification: int | None
    flash: int | None

    def __str__(self) -> str:
        """Return it in words."""
        state = _STATES.get(self.control, f"state {self.control}")
        known = "none" if self.identification is None else f"{self.identification:08X}h"
        flash = "not told" if self.flash is None else _flash_text(self.flash)
        return f"{state}; identification {known}; flash: {flash}"


class Program:
    """A program of a node.

    Args:
        bus: the bus.
        node_id: the node.
        number: of the program, 1..254: the sub-index.
        say: is told what is done.
    """

    def __init__(self, bus: NodeBus, node_id: int, number: int, say: _Say) -> None:
        self._bus, self._node_id, self._number, self._say = bus, node_id, number, say

    def status(self) -> ProgramStatus:
        """Read what the node says; SdoFailed if it has no 1F51h."""
        control = self._read(boot_slave.CONTROL)
        return ProgramStatus(
            control,
            self._optional(boot_slave.IDENTIFICATION),
            self._optional(boot_slave.FLASH_STATUS),
        )

    def command(self, command: int) -> None:
        """Write program control; who stops or starts may reset before it has answered.

        Raises:
            SdoAborted: the node refuses.
        """
        try:
            self._write(boot_slave.CONTROL, bytes((command,)))
        except SdoTimeout:
            if command == COMMANDS["clear"]:
                raise

    def stop(self) -> None:
        """Stop it, unless it is; wait until it is."""
        if self._read(boot_slave.CONTROL) == boot_slave.STOP:
            self._say("it is stopped already")
            return
        self.command(boot_slave.STOP)
        self.await_control(boot_slave.STOP)
        self._say("stopped: the boot loader runs")

    def clear(self) -> None:
        """Clear it, and wait until the flash is ready."""
        self.command(COMMANDS["clear"])
        self._await_flash(allowed=(0, 1))
        self._say("cleared")

    def start(self) -> None:
        """Start it, and wait until it runs."""
        self.command(COMMANDS["start"])
        self.await_control(COMMANDS["start"])
        self._say("started")

    def download(self, data: bytes, on_progress: _OnProgress, tries: int = 3) -> int:
        """Write it, and wait until the flash is written.

        Args:
            data: the program.
            on_progress: is told how far it is.
            tries: a transfer that was disturbed begins anew, so often in all: a client cannot
                go on in the middle (CiA 301).

        Returns:
            How often it was begun.

        Raises:
            SdoFailed: the node refuses, or the last try failed.
            ProgramFailed: the flash could not be written.
        """
        for number in range(1, tries + 1):
            try:
                self._transfer(data, on_progress)
                break
            except SdoFailed as error:
                disturbed = isinstance(error, SdoTimeout) or getattr(error, "code", 0) in _AGAIN
                if not disturbed or number == tries:
                    raise
                self._bus.gather(_SILENCE_US)
                if not self._is_there():
                    raise
                self._say(f"the transfer broke off ({error}); begun anew, {number + 1} of {tries}")
                on_progress(0)
        self._await_flash(allowed=(0,))
        return number

    def _is_there(self) -> bool:
        """Return whether the node answers at all; a frame or two may be lost."""
        for _ in range(_LOOKS):
            try:
                self._read(boot_slave.CONTROL)
            except SdoTimeout:
                continue
            except SdoAborted:
                return True
            return True
        return False

    def _transfer(self, data: bytes, on_progress: _OnProgress) -> None:
        at = (boot_slave.DATA, self._number)
        try:
            self._bus.run(self._node_id, download_blocks(*at, data, on_progress), _ANSWER_US)
        except SdoAborted as error:
            if error.code != sdo_frame.AbortCode.COMMAND_SPECIFIER:
                raise
            self._say("the node does no block transfer: in segments")
            self._bus.run(self._node_id, download(*at, data), _ANSWER_US)
            on_progress(len(data))

    def await_control(self, wanted: int) -> None:
        """Wait until program control reads so; a node that resets does not answer meanwhile."""
        until_us = self._bus.now_us + _PATIENCE_US
        while (control := self._optional(boot_slave.CONTROL)) != wanted:
            if self._bus.now_us >= until_us:
                found = "not told" if control is None else _STATES.get(control, f"{control}")
                raise ProgramFailed(
                    f"the program is not {_STATES[wanted]} after {_PATIENCE_US // 1_000_000} s:"
                    f" 1F51h:{self._number:02X} is {found}"
                )
            self._bus.gather(boot_slave.LOOK_US)

    def _await_flash(self, allowed: tuple[int, ...]) -> None:
        """Wait until the flash is ready; an error that is not allowed is raised."""
        until_us = self._bus.now_us + _PATIENCE_US
        while (
            status := self._optional(boot_slave.FLASH_STATUS)
        ) is not None and status & boot_slave.BUSY:
            if self._bus.now_us >= until_us:
                raise ProgramFailed(f"the flash is busy after {_PATIENCE_US // 1_000_000} s")
            self._bus.gather(boot_slave.LOOK_US)
        if status is not None and status >> 1 & 0x7F not in allowed:
            raise ProgramFailed(f"1F57h:{self._number:02X} flash status: {_flash_text(status)}")

    def _read(self, index: int) -> int:
        return int.from_bytes(self._bus.read(self._node_id, index, self._number), "little")

    def _optional(self, index: int) -> int | None:
        try:
            return self._read(index)
        except SdoFailed:
            return None

    def _write(self, index: int, data: bytes) -> None:
        self._bus.write(self._node_id, index, self._number, data, _ANSWER_US)


def _flash_text(status: int) -> str:
    """Say what 1F57h means.

    >>> _flash_text(0), _flash_text(1), _flash_text(0x0A)
    ('no error', 'busy', 'flash write error')
    """
    if status & boot_slave.BUSY:
        return "busy"
    error = status >> 1 & 0x7F
    return _ERRORS.get(error, f"error {error}")
