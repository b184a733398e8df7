"""Who a node is, and what its PDOs carry, as far as anybody said it.

>>> from tickrig.host.canmon.model.decode.node_memory import EdsObjects, NodeMemory
>>> values = {(0x1000, 0): 0x20192, (0x1018, 1): 0x13F, (0x1018, 3): 0x10002, (0x1A00, 0): 1}
>>> values[0x1A00, 1] = 0x60410010
>>> eds = EdsObjects({}, {at: value.to_bytes(4, "little") for at, value in values.items()})
>>> row = NodeStatus("can0", 5, NodeMemory(eds))
>>> identity_words(row)
'CiA 402 drive, vendor 0000013Fh, revision 1.2'
>>> [(pdo.kind, hex(pdo.can_id), pdo.text) for pdo in pdo_contents(row)]
[('tpdo1', '0x185', 'statusword (eds)')]
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.node_board import NodeStatus
from tickrig.host.canmon.model.decode.node_memory import DEVICE_TYPE, NodeMemory
from tickrig.host.canmon.model.decode.pdos import DUMMIES, MPDO, can_id_of, mapped_objects, pdos_of
from tickrig.host.canmon.model.decode.sdo.transfer import write_entry
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS

IDENTITY: Final = 0x1018
PROFILES: Final = {401: "I/O", 402: "drive", 405: "PLC", 406: "encoder", 410: "inclinometer"}


class PdoContent(NamedTuple):
    """A PDO that has a CAN-ID.

    Attributes:
        kind: as of `Decoded`.
        can_id: its own.
        receives: the node takes it.
        names: of the objects in it; none where the mapping is not known.
        text: these, with their latest values where it was heard, and where they are known from.
    """

    kind: str
    can_id: int
    receives: bool
    names: tuple[str, ...]
    text: str


def pdo_contents(row: NodeStatus) -> list[PdoContent]:
    """Return the PDOs of a node that are known, those that it sends first."""
    return list(_pdos(row))


def _pdos(row: NodeStatus) -> Iterator[PdoContent]:
    memory = row.memory
    for pdo in sorted(pdos_of(row.node, memory.indices)):
        can_id, count = can_id_of(pdo, memory), memory.number(pdo.mapping, 0)
        if can_id is None or count == 0:
            continue
        source = memory.source(pdo.mapping) or memory.source(pdo.parameter)
        names: tuple[str, ...] = ()
        if count is None:
            text = "mapping was not heard"
        elif count in MPDO:
            text = f"multiplexed: each frame names its object ({source})"
        else:
            names = _names(memory, pdo.mapping, min(count, MAX_MAPPED_OBJECTS))
            heard = row.pdos.get(pdo.kind)
            text = f"{heard.text if heard else ', '.join(names)} ({source})"
        yield PdoContent(pdo.kind, can_id, pdo.receives, names, text)


def _names(memory: NodeMemory, mapping: int, count: int) -> tuple[str, ...]:
    """Return the names of what is mapped; what is left out goes by."""
    mapped = mapped_objects(memory, mapping, count)
    entries = [(item.index, item.sub) for item in mapped if item.index not in DUMMIES]
    return tuple(memory.describe(*entry).name or write_entry(entry) for entry in entries)


def maker_text(row: NodeStatus) -> str:
    """Return vendor and product in short: names where a file has them, else numbers."""
    vendor, product = row.memory.number(IDENTITY, 1), row.memory.number(IDENTITY, 2)
    words = [row.memory.eds.vendor or ("" if not vendor else f"{vendor:08X}h")]
    words += [f"{product:08X}h"] if product else []
    return " ".join(filter(None, words))


def identity_words(row: NodeStatus) -> str:
    """Return profile, vendor, product, revision and serial number, as far as they are known."""
    memory = row.memory
    vendor, product, revision, serial = (memory.number(IDENTITY, sub) for sub in range(1, 5))
    maker = " ".join(filter(None, [memory.eds.vendor, _hex(vendor)]))
    device_type = memory.number(*DEVICE_TYPE)
    words = ["" if device_type is None else profile_text(device_type)]
    words += [f"vendor {maker}"] * bool(maker)
    words += [f"product {_hex(product)}"] * (product is not None)
    if revision is not None:
        words.append(f"revision {revision >> 16}.{revision & 0xFFFF}")
    words += [f"serial {serial}"] * bool(serial)
    return ", ".join(filter(None, words)) or "not known: no EDS, and nobody has read 1000h or 1018h"


def _hex(number: int | None) -> str:
    return "" if number is None else f"{number:08X}h"


def profile_text(device_type: int) -> str:
    """Say which profile a device type (1000h) names.

    >>> profile_text(0x20192), profile_text(0x0), profile_text(0xFFFF0191)
    ('CiA 402 drive', 'no profile', 'CiA 401 I/O')
    """
    profile = device_type & 0xFFFF
    name = PROFILES.get(profile, "")
    return f"CiA {profile} {name}".rstrip() if profile else "no profile"
