"""Program download into one node: 1F50h, 1F51h, 1F56h and 1F57h (CiA 302-3)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
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
"""The transfer ends after this many successive blocks without any acknowledged segment."""

Answer = TypeVar("Answer")

_OnProgress = Callable[[int], object]
"""Function that is called with the number of bytes that the server has acknowledged."""


def download_blocks(index: int, sub: int, data: bytes, on_progress: _OnProgress) -> Script[None]:
    """Write an object with an SDO block download, with CRC if the server supports it.

    If a segment within a block is lost, this segment and the ones after it are sent again. If the
    last segment of a block or its acknowledgement is lost, the transfer times out, because CiA 301
    defines no way to continue.

    Args:
        index: index of the object.
        sub: sub-index of the object.
        data: bytes to write.
        on_progress: function that is called with the number of bytes that the server has
            acknowledged.

    Raises:
        SdoAborted: the server refuses the transfer, or sends an unexpected answer. The code is
            `COMMAND_SPECIFIER` if the server does not support block transfer.
        SdoTimeout: the server does not answer.
    """
    request = sdo_frame.BlockDownloadInitiateRequest(index, sub, crc=True, size=len(data)).encode()
    first = SdoRequest(request, index, sub)
    begun = yield from _request(first, sdo_frame.BlockDownloadInitiateResponse)
    total = max(1, -(-len(data) // sdo_frame.SEGMENT_BYTES))
    block_size, taken, idle = begun.block_size, 0, 0
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
    """Send segments. Return the acknowledgement of the last segment."""
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
    """Send a request and return its response. Any other frame ends the transfer."""
    answer = yield request
    if isinstance(answer, kind):
        return answer
    if isinstance(answer, Abort):
        raise SdoAborted(request.index, request.sub, answer.code)
    return (yield from _abort(request.index, request.sub, sdo_frame.AbortCode.COMMAND_SPECIFIER))


def _abort(index: int, sub: int, code: sdo_frame.AbortCode) -> Script[NoReturn]:
    """Abort the transfer after a response of the server that is not allowed in this state."""
    yield SdoFrame(Abort(index, sub, code).encode())
    raise SdoAborted(index, sub, code)


COMMANDS: Final = {"stop": 0, "start": 1, "reset": 2, "clear": 3}
"""Commands of program control (object 1F51h) by name."""
_STATES: Final = {0: "stopped", 1: "running"}

_PATIENCE_US: Final = 60_000_000
"""Longest time that flash may be busy, and that a program may take to stop or start."""
_ANSWER_US: Final = 10_000_000
"""Longest time until a node that clears its flash answers."""

_LOOKS: Final = 3
_SILENCE_US: Final = 500_000
"""Time within which a node's answers to segments after an abort arrive."""

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
"""Bits 1 to 7 of 1F57h."""

_AGAIN: Final = (
    sdo_frame.AbortCode.CRC,
    sdo_frame.AbortCode.SEQUENCE_NUMBER,
    sdo_frame.AbortCode.TIMEOUT,
)
"""Abort codes of a disturbed transfer, as opposed to a refused one."""

_Say = Callable[[str], object]


class ProgramFailed(Exception):  # noqa: N818 - what the node did
    """The node did not do what was requested. The message contains the request."""


@dataclass(frozen=True, slots=True)
class ProgramStatus:
    """Status of one program (firmware) of a node, read from the node.

    Attributes:
        control: value of program control (object 1F51h), such as 1 for a running program.
        identification: program identification (object 1F56h), or None if the node has none.
        flash: flash status (object 1F57h), or None if the node has none.
    """

    control: int
    identification: int | None
    flash: int | None

    def __str__(self) -> str:
        """Return the status in words."""
        state = _STATES.get(self.control, f"state {self.control}")
        known = "none" if self.identification is None else f"{self.identification:08X}h"
        flash = "not reported" if self.flash is None else _flash_text(self.flash)
        return f"{state}; identification {known}; flash: {flash}"


class Program:
    """One program (firmware) of a node, which a host replaces over the bus (CiA 302-3).

    Args:
        bus: bus of the node.
        node_id: node-ID of the node.
        number: number of the program, 1..254. It is the sub-index in the objects 1F50h to 1F57h.
        say: function that is called with a text about each step.
    """

    def __init__(self, bus: NodeBus, node_id: int, number: int, say: _Say) -> None:
        self._bus, self._node_id, self._number, self._say = bus, node_id, number, say

    def status(self) -> ProgramStatus:
        """Read the status of the program from the node.

        Raises:
            SdoFailed: the node does not answer, or has no program control (object 1F51h).
        """
        control = self._read(boot_slave.CONTROL)
        return ProgramStatus(
            control,
            self._optional(boot_slave.IDENTIFICATION),
            self._optional(boot_slave.FLASH_STATUS),
        )

    def command(self, command: int) -> None:
        """Write a command, such as stop or start, to program control (object 1F51h).

        A missing answer is no error for commands that stop or start the program, because the node
        may reset before it answers.

        Raises:
            SdoAborted: the node refuses the command.
        """
        try:
            self._write(boot_slave.CONTROL, bytes((command,)))
        except SdoTimeout:
            if command == COMMANDS["clear"]:
                raise

    def stop(self) -> None:
        """Stop the program unless it is already stopped. Wait until it has stopped."""
        if self._read(boot_slave.CONTROL) == boot_slave.STOP:
            self._say("it is already stopped")
            return
        self.command(boot_slave.STOP)
        self.await_control(boot_slave.STOP)
        self._say("stopped: the boot loader runs")

    def clear(self) -> None:
        """Clear the program, and wait until the flash is ready."""
        self.command(COMMANDS["clear"])
        self._await_flash(allowed=(0, 1))
        self._say("cleared")

    def start(self) -> None:
        """Start the program, and wait until it runs."""
        self.command(COMMANDS["start"])
        self.await_control(COMMANDS["start"])
        self._say("started")

    def download(self, data: bytes, on_progress: _OnProgress, tries: int = 3) -> int:
        """Transfer a program to the node, and wait until the node has written its flash memory.

        Args:
            data: bytes of the program.
            on_progress: function that is called with the number of bytes that the node has
                acknowledged.
            tries: maximum number of attempts. Each attempt starts from the beginning, because a
                client cannot resume a transfer (CiA 301).

        Returns:
            The number of attempts.

        Raises:
            SdoFailed: the node refuses the program, or the last attempt failed.
            ProgramFailed: the node reports that it could not write its flash memory.
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
                self._say(f"the transfer failed ({error}); starting again, {number + 1} of {tries}")
                on_progress(0)
        self._await_flash(allowed=(0,))
        return number

    def _is_there(self) -> bool:
        """Return whether the node answers any request. Up to two frames may be lost."""
        for _ in range(_LOOKS):
            with suppress(SdoTimeout):
                with suppress(SdoAborted):
                    self._read(boot_slave.CONTROL)
                return True
        return False

    def _transfer(self, data: bytes, on_progress: _OnProgress) -> None:
        at = (boot_slave.DATA, self._number)
        try:
            self._bus.run(self._node_id, download_blocks(*at, data, on_progress), _ANSWER_US)
        except SdoAborted as error:
            if error.code != sdo_frame.AbortCode.COMMAND_SPECIFIER:
                raise
            self._say("the node does not support block transfer; using segments")
            self._bus.run(self._node_id, download(*at, data), _ANSWER_US)
            on_progress(len(data))

    def await_control(self, wanted: int) -> None:
        """Wait until program control (1F51h) has the wanted value.

        Missing answers are ignored, because a node does not answer during a reset.
        """
        until_us = self._bus.now_us + _PATIENCE_US
        while (control := self._optional(boot_slave.CONTROL)) != wanted:
            if self._bus.now_us >= until_us:
                found = "not reported" if control is None else _STATES.get(control, f"{control}")
                raise ProgramFailed(
                    f"the program is not {_STATES[wanted]} after {_PATIENCE_US // 1_000_000} s:"
                    f" 1F51h:{self._number:02X} is {found}"
                )
            self._bus.gather(boot_slave.LOOK_US)

    def _await_flash(self, allowed: tuple[int, ...]) -> None:
        """Wait until the flash is ready. Raise an error that the caller does not allow."""
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
    """Return the meaning of a flash status word (1F57h).

    >>> _flash_text(0), _flash_text(1), _flash_text(0x0A)
    ('no error', 'busy', 'flash write error')
    """
    if status & boot_slave.BUSY:
        return "busy"
    error = status >> 1 & 0x7F
    return _ERRORS.get(error, f"error {error}")
