"""A slave with a boot loader: stop, clear, download, start (CiA 302-3)."""

from __future__ import annotations

from tickrig.device.canopen.dictionary import Entry, SdoAbort
from tickrig.device.canopen.slave import Application, CanopenSlave
from tickrig.wire.canopen.sdo_frame import AbortCode

STOPPED, RUNS = 0, 1
CLEAR = 3
FLASHING_US = 250_000
HEAD = 4
"""The first bytes of a program are its identification."""


class BootLoader(Application):
    """Takes a program while it is stopped; flashing takes a while.

    Attributes:
        program: what it runs.
        error: of flashing, 1F57h.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.program, self.state, self.error = bytes((2, 0, 1, 0)), RUNS, 0
        self._busy_us = 0
        dictionary = node.dictionary
        control, data = dictionary[0x1F51, 1], dictionary[0x1F50, 1]
        control.source, control.written = lambda entry: bytes((self.state,)), self._command
        data.guard, data.written = self._check, self._flash
        dictionary[0x1F56, 1].source = lambda entry: self.program[:HEAD].ljust(HEAD, b"\0")
        dictionary[0x1F57, 1].source = self._status

    def _command(self, entry: Entry) -> None:
        command = entry.data[0]
        if command == CLEAR:
            self.program = b""
        else:
            self.state = command

    def _check(self, entry: Entry, value: object) -> None:
        if self.state is not STOPPED or self.program:
            raise SdoAbort(AbortCode.DEVICE_STATE)

    def _flash(self, entry: Entry) -> None:
        self.program, self._busy_us = entry.data, self.node.now_us + FLASHING_US

    def _status(self, entry: Entry) -> bytes:
        busy = self.node.now_us < self._busy_us
        return (busy | self.error << 1).to_bytes(4, "little")
