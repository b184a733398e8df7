"""Stored parameters (CiA 301) and program download with a boot loader (CiA 302-3)."""

from __future__ import annotations

from binascii import crc32
from enum import IntEnum
from typing import Final

from tickrig.device.canopen.dictionary import Entry, SdoAbort
from tickrig.device.canopen.slave import COMMUNICATION_AREA, CanopenSlave, Service
from tickrig.device.twin import Part
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import RO, RW, Access, ObjectTable
from tickrig.wire.canopen.nmt import NmtCommand
from tickrig.wire.canopen.sdo_frame import AbortCode

# Store and restore parameters (CiA 301, object dictionary; objects 1010h and 1011h).

STORE_PARAMETERS: Final = 0x1010
_RESTORE_DEFAULTS: Final = 0x1011
_LAST_SUB: Final = 0x7F

SAVE: Final = int.from_bytes(b"save", "little")
LOAD: Final = int.from_bytes(b"load", "little")

_ON_COMMAND: Final = b"\x01"
"""Value of 1010h and 1011h if the device has no default: bit 0, on command."""

ALL, COMMUNICATION, APPLICATION = 1, 2, 3
"""Sub-indices of the parameter groups."""

_AREAS: Final = {
    ALL: range(0x1_0000),
    COMMUNICATION: COMMUNICATION_AREA,
    APPLICATION: range(0x6000, 0xA000),
}
_MANUFACTURER_AREA: Final = range(0x2000, 0x6000)

_VOLATILE: Final = frozenset((0x1003, 0x1010, 0x1011, 0x1013))
"""Communication objects that are writable but are not parameters."""


class ParameterStore(Service):
    """Stores parameters on "save", restores the defaults on "load".

    Sub-index 1 stands for all parameters, 2 for 1000h to 1FFFh, 3 for 6000h to 9FFFh. CiA 301
    leaves sub-indices from 4 on to the device: here they stand for 2000h to 5FFFh. A parameter is
    an object that the bus may read and write, except domains and process outputs (objects for
    RPDOs only). Default values are not stored, so that COB-IDs continue to follow the node-ID.

    "load" takes effect at the next reset of the node. For 1000h to 1FFFh, a reset of communication
    is enough. A wrong signature is refused with 0800 0020h. Storing works in every NMT state in
    which SDOs work, regardless of the value that is read from the objects, which is their default.

    Not emulated: the time that storing takes, failing memory, automatic saving.

    Attributes:
        volatile: indices that are never stored. A device profile may add indices.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.volatile = set(_VOLATILE)
        dictionary = node.dictionary
        self._entries = [
            *dictionary.elements(STORE_PARAMETERS, _LAST_SUB),
            *dictionary.elements(_RESTORE_DEFAULTS, _LAST_SUB),
        ]
        for entry in self._entries:
            entry.guard, entry.written = _check_signature, self._act
            # "save" is 65766173h, outside any limits of the value that the object reads as.
            entry.takes_commands = True

    def start(self) -> None:
        """Set the values that a client reads from the objects."""
        for entry in self._entries:
            _show_capability(entry)

    def _act(self, entry: Entry) -> None:
        _show_capability(entry)
        area = _AREAS.get(entry.sub, _MANUFACTURER_AREA)
        (self._save if entry.index == STORE_PARAMETERS else self._load)(area)
        self.node.nonvolatile.changed()

    def _save(self, area: range) -> None:
        stored, node_id = self.node.nonvolatile.parameters, self.node.node_id
        for entry in self.node.dictionary:
            if entry.index not in area or not self._is_parameter(entry):
                continue
            # A default that was stored as a number would stay with the old node-ID for
            # ever.
            if entry.data == entry.description.power_on_data(node_id):
                stored.pop(entry.key, None)
            else:
                stored[entry.key] = entry.data

    def _load(self, area: range) -> None:
        stored = self.node.nonvolatile.parameters
        for key in [key for key in stored if key >> 8 in area]:
            del stored[key]

    def _is_parameter(self, entry: Entry) -> bool:
        access = entry.description.access
        return (
            RW in access
            and entry.index not in self.volatile
            and entry.data_type is not DataType.DOMAIN
            and (Access.RPDO not in access or Access.TPDO in access)
        )


def _show_capability(entry: Entry) -> None:
    """Restore the value that is read, because the signature was only a command."""
    given = entry.description
    entry.assign(given.default if given.has_default else _ON_COMMAND.ljust(entry.size, b"\0"))


def _check_signature(entry: Entry, value: Value) -> None:
    if value != (SAVE if entry.index == STORE_PARAMETERS else LOAD):
        raise SdoAbort(AbortCode.NOT_STORED)


_DATA: Final = 0x1F50
_CONTROL: Final = 0x1F51
_IDENTIFICATION: Final = 0x1F56
_FLASH_STATUS: Final = 0x1F57
_PROGRAM: Final = 1
"""Sub-index of the only program."""

_OBJECTS: Final = frozenset(
    (
        *(0x1000, 0x1001, 0x1008, 0x1009, 0x100A, 0x1014, 0x1017, 0x1018, 0x1200),
        *(_DATA, _CONTROL, _IDENTIFICATION, _FLASH_STATUS),
    )
)
"""Objects that exist while the program does not run."""

FLASHING_US: Final = 200_000
"""Time for which the flash is busy after each write."""


class ProgramCommand(IntEnum):
    """Commands written to 1F51h."""

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
    """Stops, clears, downloads and starts the program of a device.

    A device whose program is stopped resets and boots with the objects of the boot loader only.
    All other objects are missing, and NMT start is ignored. A device without a program does the
    same at power-on. A downloaded program is stored and identified by its CRC-32 (1F56h) but not
    executed: a running device behaves as before the download. A command that does not fit the
    state is refused with 0800 0022h.

    Not emulated: verification of the download, several programs, 1F52h to 1F55h
    and 1F58h, writing by blocks of the flash.

    Args:
        node: the slave, with the objects of `add_program_objects`.
        built_in: the program of a new device.
    """

    def __init__(self, node: CanopenSlave, built_in: bytes = b"") -> None:
        self._node, self._built_in = node, built_in
        self._error, self._busy_us = FlashError.NONE, 0
        self.runs = bool(self.program)
        control, data = node.dictionary[_CONTROL, _PROGRAM], node.dictionary[_DATA, _PROGRAM]
        control.source, control.guard, control.written = self._state, self._check, self._obey
        data.guard, data.written = self._check_data, self._flash
        node.dictionary[_IDENTIFICATION, _PROGRAM].source = self._identification
        node.dictionary[_FLASH_STATUS, _PROGRAM].source = self._status
        node.admits = self._admits

    @property
    def program(self) -> bytes:
        """The program in the flash."""
        kept = self._node.nonvolatile.program
        return self._built_in if kept is None else kept

    def power_on(self) -> None:
        """Start the program, if there is one."""
        ParameterStore.of(self._node).volatile.add(_CONTROL)
        self._error, self._busy_us = FlashError.NONE, 0
        self.run(runs=bool(self.program))

    def run(self, *, runs: bool) -> None:
        """Enable the program, or the boot loader only."""
        self.runs = runs
        self._node.dictionary.restrict(None if runs else _OBJECTS)

    def _admits(self, command: NmtCommand) -> bool:
        return self.runs or command is not NmtCommand.START

    def _check(self, entry: Entry, value: Value) -> None:
        """Refuse an unknown command, or a command that does not fit the state."""
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
        # The program is in the flash; 1F50h itself holds nothing to be read or stored.
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
        # 1F57h: bit 0 busy, bits 1 to 7 the error.
        return (busy | self._error << 1).to_bytes(4, "little")


def add_program_objects(objects: ObjectTable) -> None:
    """Add the objects of one program."""
    objects.array(_DATA, "Program data", 1, DataType.DOMAIN, RW)
    objects.array(_CONTROL, "Program control", 1, DataType.UNSIGNED8, RW)
    objects.array(_IDENTIFICATION, "Program software identification", 1, DataType.UNSIGNED32, RO)
    objects.array(_FLASH_STATUS, "Flash status identification", 1, DataType.UNSIGNED32, RO)
