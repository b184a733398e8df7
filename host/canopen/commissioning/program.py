"""Program download into one node: 1F50h, 1F51h, 1F56h and 1F57h (CiA 302-3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.block_download import OnProgress, download_blocks
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoTimeout
from tickrig.host.canopen.master.program_update import (
    BUSY,
    CONTROL,
    DATA,
    FLASH_STATUS,
    IDENTIFICATION,
    LOOK_US,
    STOP,
)
from tickrig.host.canopen.sdo_transfer import download
from tickrig.wire.canopen.sdo.abort import AbortCode

COMMANDS: Final = {"stop": 0, "start": 1, "reset": 2, "clear": 3}
"""Program control, 1F51h."""
STATES: Final = {0: "stopped", 1: "running"}

PATIENCE_US: Final = 60_000_000
"""How long flash may be busy, and a program may take to stop or start."""
ANSWER_US: Final = 10_000_000
"""How long a node that clears its flash may take to answer."""

LOOKS: Final = 3
SILENCE_US: Final = 500_000
"""What a node answers to segments behind an abort has come by then."""

ERRORS: Final = {
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

AGAIN: Final = (AbortCode.CRC, AbortCode.SEQUENCE_NUMBER, AbortCode.TIMEOUT)
"""Aborts by which a transfer was disturbed, and not refused."""

Say = Callable[[str], object]


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
        state = STATES.get(self.control, f"state {self.control}")
        known = "none" if self.identification is None else f"{self.identification:08X}h"
        flash = "not told" if self.flash is None else flash_text(self.flash)
        return f"{state}; identification {known}; flash: {flash}"


class Program:
    """A program of a node.

    Args:
        bus: the bus.
        node_id: the node.
        number: of the program, 1..254: the sub-index.
        say: is told what is done.
    """

    def __init__(self, bus: NodeBus, node_id: int, number: int, say: Say) -> None:
        self._bus, self._node_id, self._number, self._say = bus, node_id, number, say

    def status(self) -> ProgramStatus:
        """Read what the node says; SdoFailed if it has no 1F51h."""
        control = self._read(CONTROL)
        return ProgramStatus(control, self._optional(IDENTIFICATION), self._optional(FLASH_STATUS))

    def command(self, command: int) -> None:
        """Write program control; who stops or starts may reset before it has answered.

        Raises:
            SdoAborted: the node refuses.
        """
        try:
            self._write(CONTROL, bytes((command,)))
        except SdoTimeout:
            if command == COMMANDS["clear"]:
                raise

    def stop(self) -> None:
        """Stop it, unless it is; wait until it is."""
        if self._read(CONTROL) == STOP:
            self._say("it is stopped already")
            return
        self.command(STOP)
        self.await_control(STOP)
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

    def download(self, data: bytes, on_progress: OnProgress, tries: int = 3) -> int:
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
                disturbed = isinstance(error, SdoTimeout) or getattr(error, "code", 0) in AGAIN
                if not disturbed or number == tries:
                    raise
                self._bus.gather(SILENCE_US)
                if not self._is_there():
                    raise
                self._say(f"the transfer broke off ({error}); begun anew, {number + 1} of {tries}")
                on_progress(0)
        self._await_flash(allowed=(0,))
        return number

    def _is_there(self) -> bool:
        """Say whether the node answers at all; a frame or two may be lost."""
        for _ in range(LOOKS):
            try:
                self._read(CONTROL)
            except SdoTimeout:
                continue
            except SdoAborted:
                return True
            return True
        return False

    def _transfer(self, data: bytes, on_progress: OnProgress) -> None:
        at = (DATA, self._number)
        try:
            self._bus.run(self._node_id, download_blocks(*at, data, on_progress), ANSWER_US)
        except SdoAborted as error:
            if error.code != AbortCode.COMMAND_SPECIFIER:
                raise
            self._say("the node does no block transfer: in segments")
            self._bus.run(self._node_id, download(*at, data), ANSWER_US)
            on_progress(len(data))

    def await_control(self, wanted: int) -> None:
        """Wait until program control reads so; a node that resets does not answer meanwhile."""
        until_us = self._bus.now_us + PATIENCE_US
        while (control := self._optional(CONTROL)) != wanted:
            if self._bus.now_us >= until_us:
                found = "not told" if control is None else STATES.get(control, f"{control}")
                raise ProgramFailed(
                    f"the program is not {STATES[wanted]} after {PATIENCE_US // 1_000_000} s:"
                    f" 1F51h:{self._number:02X} is {found}"
                )
            self._bus.gather(LOOK_US)

    def _await_flash(self, allowed: tuple[int, ...]) -> None:
        """Wait until the flash is ready; an error that is not allowed is raised."""
        until_us = self._bus.now_us + PATIENCE_US
        while (status := self._optional(FLASH_STATUS)) is not None and status & BUSY:
            if self._bus.now_us >= until_us:
                raise ProgramFailed(f"the flash is busy after {PATIENCE_US // 1_000_000} s")
            self._bus.gather(LOOK_US)
        if status is not None and status >> 1 & 0x7F not in allowed:
            raise ProgramFailed(f"1F57h:{self._number:02X} flash status: {flash_text(status)}")

    def _read(self, index: int) -> int:
        return int.from_bytes(self._bus.read(self._node_id, index, self._number), "little")

    def _optional(self, index: int) -> int | None:
        try:
            return self._read(index)
        except SdoFailed:
            return None

    def _write(self, index: int, data: bytes) -> None:
        self._bus.write(self._node_id, index, self._number, data, ANSWER_US)


def flash_text(status: int) -> str:
    """Say what 1F57h means.

    >>> flash_text(0), flash_text(1), flash_text(0x0A)
    ('no error', 'busy', 'flash write error')
    """
    if status & BUSY:
        return "busy"
    error = status >> 1 & 0x7F
    return ERRORS.get(error, f"error {error}")
