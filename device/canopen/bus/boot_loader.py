"""Program download: a boot loader beside the program of the device (CiA 302-3)."""

from __future__ import annotations

from binascii import crc32
from enum import IntEnum
from typing import Final

from tickrig.device.canopen.bus.parameter_store import ParameterStore
from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.twin import Part
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import RO, RW, ObjectTable
from tickrig.wire.canopen.nmt import NmtCommand
from tickrig.wire.canopen.sdo.abort import AbortCode

DATA: Final = 0x1F50
CONTROL: Final = 0x1F51
IDENTIFICATION: Final = 0x1F56
FLASH_STATUS: Final = 0x1F57
PROGRAM: Final = 1
"""Sub-index of the one program."""

OBJECTS: Final = frozenset(
    (
        *(0x1000, 0x1001, 0x1008, 0x1009, 0x100A, 0x1014, 0x1017, 0x1018, 0x1200),
        *(DATA, CONTROL, IDENTIFICATION, FLASH_STATUS),
    )
)
"""All that there is while the program does not run."""

FLASHING_US: Final = 200_000
"""How long the flash is busy, whatever is written."""


class ProgramCommand(IntEnum):
    """What is written to 1F51h."""

    STOP = 0
    START = 1
    RESET = 2
    CLEAR = 3


class FlashError(IntEnum):
    """Error of 1F57h, bits 1 to 7."""

    NONE = 0
    NO_PROGRAM = 1
    NOT_CLEARED = 4


class BootLoader(Part):
    """Stops, clears, takes and starts the program of a device.

    A device whose program is stopped resets, and boots with the objects of the boot
    loader alone: all others do not exist, and NMT start is not obeyed. It does so at
    power-on too while there is no program. The program that is downloaded is kept, and
    told by its CRC-32 (1F56h); nothing is made of it: the device does as before when it
    runs. A command that does not fit the state is refused with 0800 0022h.

    Not emulated: verification of what is downloaded, several programs, 1F52h to 1F55h
    and 1F58h, writing by blocks of the flash.

    Args:
        node: its slave, with the objects of `add_program_objects`.
        built_in: the program that it is made with.
    """

    def __init__(self, node: CanopenSlave, built_in: bytes = b"") -> None:
        self._node, self._built_in = node, built_in
        self._error, self._busy_us = FlashError.NONE, 0
        self.runs = bool(self.program)
        control, data = node.dictionary[CONTROL, PROGRAM], node.dictionary[DATA, PROGRAM]
        control.source, control.guard, control.written = self._state, self._check, self._obey
        data.guard, data.written = self._check_data, self._flash
        node.dictionary[IDENTIFICATION, PROGRAM].source = self._identification
        node.dictionary[FLASH_STATUS, PROGRAM].source = self._status
        node.admits = self._admits

    @property
    def program(self) -> bytes:
        """What is in the flash."""
        kept = self._node.nonvolatile.program
        return self._built_in if kept is None else kept

    def power_on(self) -> None:
        """Start the program, if there is one."""
        ParameterStore.of(self._node).volatile.add(CONTROL)
        self._error, self._busy_us = FlashError.NONE, 0
        self.run(runs=bool(self.program))

    def run(self, *, runs: bool) -> None:
        """Let the program run, or the boot loader alone."""
        self.runs = runs
        self._node.dictionary.restrict(None if runs else OBJECTS)

    def _admits(self, command: NmtCommand) -> bool:
        return self.runs or command is not NmtCommand.START

    def _check(self, entry: Entry, value: Value) -> None:
        """Refuse what is no command, or does not fit the state."""
        if value not in ProgramCommand.__members__.values():
            raise SdoAbort(AbortCode.VALUE_RANGE)
        starts = value in (ProgramCommand.START, ProgramCommand.RESET)
        idle = self._node.now_us >= self._busy_us
        clears_what_runs = value == ProgramCommand.CLEAR and self.runs
        if not idle or clears_what_runs or (starts and not self.program):
            raise SdoAbort(AbortCode.DEVICE_STATE)

    def _obey(self, entry: Entry) -> None:
        command = ProgramCommand(entry.data[0])
        if command is ProgramCommand.CLEAR:
            self._keep(b"")
        elif command is ProgramCommand.RESET or (command is ProgramCommand.START) != self.runs:
            self.run(runs=command is not ProgramCommand.STOP)
            self._node.reset_node()

    def _check_data(self, entry: Entry, value: Value) -> None:
        if self.runs or self._node.now_us < self._busy_us:
            raise SdoAbort(AbortCode.DEVICE_STATE)
        if self.program:
            self._error = FlashError.NOT_CLEARED
            raise SdoAbort(AbortCode.DEVICE_STATE)

    def _flash(self, entry: Entry) -> None:
        self._keep(entry.data)
        entry.assign(b"")

    def _keep(self, program: bytes) -> None:
        memory = self._node.nonvolatile
        memory.program = program
        memory.changed()
        self._error = FlashError.NONE if program else FlashError.NO_PROGRAM
        self._busy_us = self._node.now_us + FLASHING_US

    def _state(self, entry: Entry) -> bytes:
        return bytes((ProgramCommand.START if self.runs else ProgramCommand.STOP,))

    def _identification(self, entry: Entry) -> bytes:
        program = self.program
        return (crc32(program) if program else 0).to_bytes(4, "little")

    def _status(self, entry: Entry) -> bytes:
        busy = self._node.now_us < self._busy_us
        return (busy | self._error << 1).to_bytes(4, "little")


def add_program_objects(objects: ObjectTable) -> None:
    """Add the objects of one program."""
    objects.array(DATA, "Program data", 1, DataType.DOMAIN, RW)
    objects.array(CONTROL, "Program control", 1, DataType.UNSIGNED8, RW)
    objects.array(IDENTIFICATION, "Program software identification", 1, DataType.UNSIGNED32, RO)
    objects.array(FLASH_STATUS, "Flash status identification", 1, DataType.UNSIGNED32, RO)
