"""Dictionaries out of EDS and DCF files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.emulators.canopen.eds.device_description import DeviceDescription
from tickrig.emulators.canopen.eds.predefined import predefined
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import COUNTS, read_device
from tickrig.wire.canopen.eds.eds_entry import EdsEntry
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_finding import EdsError


def read_eds(path: Path) -> DeviceDescription:
    """Read an EDS or DCF file.

    Raises:
        OSError: the file cannot be read.
        EdsError: it is malformed.
    """
    return describe(open_eds(path))


def describe(file: EdsFile) -> DeviceDescription:
    """Describe the device of an EDS or DCF.

    What is not by the standard is a warning of the description where it has one
    meaning. Where no default is given, a COB-ID gets that of the pre-defined
    connection set and a sub-index 0 the number of entries.

    Raises:
        EdsError: something has no meaning: it would be another device. All that is
            wrong stands in it.
    """
    device = read_device(file)
    if file.errors:
        raise EdsError(file.errors)
    return DeviceDescription(
        file.name,
        device.info,
        Dictionary(_entries(device.entries), dict(device.objects)),
        device.node_id,
        device.bit_rate,
        warnings=file.warnings,
    )


def _entries(found: Iterable[EdsEntry]) -> Iterable[Entry]:
    highest: dict[int, int] = {}
    for row in found:
        highest[row.index] = max(row.sub, highest.get(row.index, 0))
    return (_entry(row, highest[row.index]) for row in found)


def _entry(row: EdsEntry, highest: int) -> Entry:
    """Make an entry; `highest` is the last sub-index of its object."""
    default, relative = row.default, row.relative
    if default is None and row.data_type.is_integer:
        default, relative = _implied(row, highest)
    entry = Entry(
        *(row.index, row.sub, row.name, row.data_type, row.access),
        low=row.low,
        high=row.high,
        relative=relative,
        max_bytes=row.max_bytes,
    )
    if default is not None:
        entry.default = entry.data = default
    return entry


def _implied(row: EdsEntry, highest: int) -> tuple[bytes | None, bool]:
    """Return the power-on value of an object whose EDS gives none."""
    if row.sub == 0 and highest and row.index not in COUNTS:
        number, relative = highest, False
    elif known := predefined(row.index, row.sub):
        number, relative = known
    else:
        return None, False
    try:
        return row.data_type.encode(number), relative
    except ValueError:  # not of the type that such an object has
        return None, False
