"""Store and restore parameters (CiA 301, object dictionary; objects 1010h and 1011h)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Access, Entry
from tickrig.device.canopen.core.service import Service
from tickrig.device.canopen.core.slave import COMMUNICATION_AREA, CanopenSlave
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.sdo.abort import AbortCode

STORE_PARAMETERS: Final = 0x1010
RESTORE_DEFAULTS: Final = 0x1011
LAST_SUB: Final = 0x7F

SAVE: Final = int.from_bytes(b"save", "little")
LOAD: Final = int.from_bytes(b"load", "little")

ON_COMMAND: Final = b"\x01"
"""What both objects read: bit 0, on command; bit 1, by itself, is never set."""

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
    It works in every NMT state that has SDOs.

    Not emulated: the time that it takes, a failing memory, saving by itself.

    Attributes:
        volatile: indices that are never stored; a device profile may add to them.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.volatile = set(VOLATILE)
        self._entries: list[Entry] = []
        self._hang(STORE_PARAMETERS, SAVE, self._save)
        self._hang(RESTORE_DEFAULTS, LOAD, self._load)

    def start(self) -> None:
        """Tell what it can."""
        for entry in self._entries:
            _tell(entry)

    def _hang(self, index: int, signature: int, act: Callable[[range], None]) -> None:
        for entry in self.node.dictionary.elements(index, LAST_SUB):
            entry.guard = partial(_check_signature, signature)
            entry.written = partial(self._act, entry, act)
            self._entries.append(entry)

    def _act(self, entry: Entry, act: Callable[[range], None]) -> None:
        _tell(entry)
        act(_AREAS.get(entry.sub, _MANUFACTURER_AREA))
        self.node.nonvolatile.changed()

    def _save(self, area: range) -> None:
        stored, node_id = self.node.nonvolatile.parameters, self.node.node_id
        for entry in self.node.dictionary:
            if entry.index not in area or not self._is_parameter(entry):
                continue
            if entry.data == entry.power_on_data(node_id):
                stored.pop(entry.key, None)
            else:
                stored[entry.key] = entry.data

    def _load(self, area: range) -> None:
        stored = self.node.nonvolatile.parameters
        for key in [key for key in stored if key >> 8 in area]:
            del stored[key]

    def _is_parameter(self, entry: Entry) -> bool:
        return (
            entry.readable
            and entry.writable
            and entry.index not in self.volatile
            and entry.data_type is not DataType.DOMAIN
            and (Access.RPDO not in entry.access or Access.TPDO in entry.access)
        )


def _tell(entry: Entry) -> None:
    """Put back what is read there; the signature was only a command."""
    entry.assign(ON_COMMAND.ljust(entry.size, b"\0"))


def _check_signature(signature: int, value: Value) -> None:
    if value != signature:
        raise SdoAbort(AbortCode.NOT_STORED)
