"""Scripts that set up a node (ours: K16; PDO procedure: CiA 301, PDO mapping parameter)."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import Final

from tickrig.host.canopen.dialogue import Pause, Script
from tickrig.host.canopen.errors import SdoAborted, SdoTimeout, WrongIdentity
from tickrig.host.canopen.sdo_transfer import download, download_number, upload_number
from tickrig.host.rtc.canopen.definition import DeviceFile, NodeEntry, PdoEntry, PdoName, SdoEntry
from tickrig.host.rtc.canopen.pdo_layout import PARAMETERS, PdoLayout, lay_out
from tickrig.wire.canopen.nmt import CAN_ID_MASK, EXTENDED, INVALID
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS, MappedObject

_DEVICE_TYPE: Final = 0x1000
_HEARTBEAT: Final = 0x1017
_SERIAL_NUMBER: Final = (0x1018, 4)

_COB_ID: Final = 1
_TYPE: Final = 2
_INHIBIT: Final = 3
_EVENT: Final = 5
"""Sub-indices of a communication parameter."""

_PROBE_US: Final = 1_000_000
"""Interval between device type requests to a node that has not sent anything yet."""


def probe() -> Script[None]:
    """Script (generator of SDO requests) that requests a node's device type until the node answers.

    An SDO abort is an answer too.
    """
    while True:
        try:
            yield from upload_number(_DEVICE_TYPE, 0)
        except SdoTimeout:
            yield Pause(_PROBE_US)
        except SdoAborted:
            return
        else:
            return


def boot(
    entry: NodeEntry, file: DeviceFile, writes: Iterable[SdoEntry]
) -> Script[tuple[PdoLayout, ...]]:
    """Script that sets up a node after its boot-up, and returns the layouts of its enabled PDOs.

    It checks the identity of the node, and writes its heartbeat time, configured values and PDOs.

    Raises:
        WrongIdentity: the node is another device.
        SdoAborted: the node refuses an access.
        SdoTimeout: the node does not answer.
    """
    yield from _check_identity(file)
    yield from download_number(_HEARTBEAT, 0, entry.heartbeat_ms, 2)
    for write in writes:
        yield from download(write.index, write.sub, write.data)
    for name, pdo in entry.pdos.items():
        yield from set_pdo(PdoName(entry.id, name).index, pdo)
    layouts = []
    for index in file.pdos:
        if (layout := (yield from _read_pdo(index, file))) is not None:
            layouts.append(layout)
    return tuple(layouts)


def set_pdo(index: int, pdo: PdoEntry) -> Script[None]:
    """Script that configures a PDO of a node: disable it, write its parameters, enable it.

    The PDO stays disabled if it has no CAN-ID.

    Args:
        index: index of the communication parameter, such as 1800h.
        pdo: parameters to write. A value of None is not written.
    """
    cob_id = pdo.cob_id
    if cob_id is None:
        cob_id = (yield from upload_number(index, _COB_ID)) & ~INVALID
    yield from download_number(index, _COB_ID, cob_id | INVALID, 4)
    if pdo.mapping is not None:
        yield from _set_mapping(index + PARAMETERS, pdo.mapping)
    for sub, value, size in (
        (_TYPE, pdo.type, 1),
        (_INHIBIT, pdo.inhibit_100us, 2),
        (_EVENT, pdo.event_ms, 2),
    ):
        if value is not None:
            yield from download_number(index, sub, value, size)
    if cob_id & CAN_ID_MASK:
        yield from download_number(index, _COB_ID, cob_id, 4)


def _set_mapping(index: int, mapping: tuple[MappedObject, ...]) -> Script[None]:
    yield from download_number(index, 0, 0, 1)
    for sub, mapped in enumerate(mapping, 1):
        yield from download_number(index, sub, mapped.encode(), 4)
    yield from download_number(index, 0, len(mapping), 1)


def _check_identity(file: DeviceFile) -> Script[None]:
    for (index, sub), wanted in file.identity.items():
        found = yield from upload_number(index, sub)
        if found != wanted:
            raise WrongIdentity(f"{index:04X}h:{sub:02X} is {found:08X}h, not {wanted:08X}h")
    if _SERIAL_NUMBER in file.data_types:  # two nodes of one node-ID give two answers
        with suppress(SdoAborted):
            yield from upload_number(*_SERIAL_NUMBER)


def _read_pdo(index: int, file: DeviceFile) -> Script[PdoLayout | None]:
    """Read a PDO. Return None if it is off, multiplexed, or has a 29-bit CAN-ID."""
    cob_id = yield from upload_number(index, _COB_ID)
    if cob_id & (INVALID | EXTENDED):
        return None
    count = yield from upload_number(index + PARAMETERS, 0)
    mapping = []
    if count > MAX_MAPPED_OBJECTS:
        return None
    for sub in range(1, count + 1):
        entry = yield from upload_number(index + PARAMETERS, sub)
        mapping.append(MappedObject.parse(entry))
    return lay_out(index, cob_id & CAN_ID_MASK, tuple(mapping), file.data_types)
