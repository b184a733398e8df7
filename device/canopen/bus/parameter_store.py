"""Store and restore parameters (CiA 301, object dictionary; objects 1010h and 1011h)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import Service
from tickrig.device.canopen.core.slave import COMMUNICATION_AREA, CanopenSlave
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import RW, Access
from tickrig.wire.canopen.sdo.abort import AbortCode

STORE_PARAMETERS: Final = 0x1010
RESTORE_DEFAULTS: Final = 0x1011
LAST_SUB: Final = 0x7F

SAVE: Final = int.from_bytes(b"save", "little")
LOAD: Final = int.from_bytes(b"load", "little")

ON_COMMAND: Final = b"\x01"
"""What both objects read unless the device has a default: bit 0, on command."""

ALL, COMMUNICATION, APPLICATION = 1, 2, 3
"""Sub-indices."""

_AREAS: Final = {
    ALL: range(0x1_0000),
    COMMUNICATION: COMMUNICATION_AREA,
    APPLICATION: range(0x6000, 0xA000),
}
_MANUFACTURER_AREA: Final = range(0x2000, 0x6000)

VOLATILE: Final = frozenset((0x1003, 0x1010, 0x1011, 0x1013))
"""Communication objects that may be written but are no parameters."""


class ParameterStore(Service):
    """Stores parameters on "save", forgets them on "load".

    Sub-index 1 stands for all, 2 for 1000h to 1FFFh, 3 for 6000h to 9FFFh, 4 and
    above for 2000h to 5FFFh, where CiA 301 leaves the choice. A parameter is what
    the bus may read and write, but no domain and no process output (an object for
    RPDOs alone). What has its default value is not kept, so that COB-IDs go on
    following the node-ID. "load" acts with the next reset, of the node or, for
    1000h to 1FFFh, of communication. Another signature is refused with 0800 0020h.
    It works in every NMT state that has SDOs, and whatever the objects say of it when they are
    read: that is their default.

    Not emulated: the time that it takes, a failing memory, saving by itself.

    Attributes:
        volatile: indices that are never stored; a device profile may add to them.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.volatile = set(VOLATILE)
        dictionary = node.dictionary
        self._entries = [
            *dictionary.elements(STORE_PARAMETERS, LAST_SUB),
            *dictionary.elements(RESTORE_DEFAULTS, LAST_SUB),
        ]
        for entry in self._entries:
            entry.guard, entry.written = _check_signature, self._act
            entry.takes_commands = True

    def start(self) -> None:
        """Show what it can."""
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
    """Put back what is read there; the signature was only a command."""
    given = entry.description
    entry.assign(given.default if given.has_default else ON_COMMAND.ljust(entry.size, b"\0"))


def _check_signature(entry: Entry, value: Value) -> None:
    if value != (SAVE if entry.index == STORE_PARAMETERS else LOAD):
        raise SdoAbort(AbortCode.NOT_STORED)
