"""Names, types and power-on values out of an EDS or DCF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tickrig.host.canopen.eds import read_sound
from tickrig.host.monitor.decode.decoded import EDS
from tickrig.host.monitor.decode.objects.object_text import ObjectText, slug
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_entry import EdsEntry
from tickrig.wire.canopen.eds.eds_finding import Finding
from tickrig.wire.canopen.eds.eds_writer import VARIABLES

Entry = tuple[int, int]


@dataclass(frozen=True, slots=True)
class EdsObjects:
    """What a file says of a node.

    Attributes:
        texts: name, type and unit by index and sub-index.
        values: power-on values, as bytes on the wire, likewise.
        name: of the device, empty where the file has none.
        findings: what is wrong in the file, whose objects are then not used.
    """

    texts: Mapping[Entry, ObjectText] = field(default_factory=dict)
    values: Mapping[Entry, bytes] = field(default_factory=dict)
    name: str = ""
    findings: tuple[Finding, ...] = ()


def read_eds(path: Path, node_id: int) -> EdsObjects:
    """Read an EDS or DCF for a node.

    Raises:
        OSError: the file cannot be read.
        EdsError: it has no object that can be used.
    """
    device, findings = read_sound(path)
    return EdsObjects(
        {(row.index, row.sub): _text(device, row) for row in device.entries},
        {
            (row.index, row.sub): data
            for row in device.entries
            if (data := _power_on(row, node_id)) is not None
        },
        device.info.product_name or path.stem,
        findings,
    )


def _text(device: EdsDevice, row: EdsEntry) -> ObjectText:
    name = slug(row.name)
    info = device.objects[row.index]
    if info.code not in VARIABLES:
        name = f"{slug(info.name)}.{name or row.sub}"
    return ObjectText(name, row.data_type, row.unit, row.factor, EDS)


def _power_on(row: EdsEntry, node_id: int) -> bytes | None:
    """Return the bytes of a number; None where there is none."""
    if row.default is None or not row.data_type.is_integer:
        return None
    if not row.relative:
        return row.default
    number = int.from_bytes(row.default, "little") + node_id
    size = row.data_type.size
    return (number % (1 << 8 * size)).to_bytes(size, "little")
