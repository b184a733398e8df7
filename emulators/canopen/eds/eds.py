"""Dictionaries out of EDS and DCF files."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.emulators.canopen.eds.device_description import DeviceDescription
from tickrig.emulators.canopen.eds.predefined import predefined
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import COUNTS, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_finding import EdsError
from tickrig.wire.canopen.eds.object_table import EntryDescription


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


def _entries(found: Iterable[EntryDescription]) -> Iterable[EntryDescription]:
    highest: dict[int, int] = {}
    for row in found:
        highest[row.index] = max(row.sub, highest.get(row.index, 0))
    return (_completed(row, highest[row.index]) for row in found)


def _completed(row: EntryDescription, highest: int) -> EntryDescription:
    """Return an entry with its power-on value; `highest` is the last sub-index of its object."""
    if row.has_default or not row.data_type.is_integer:
        return row
    if row.sub == 0 and highest and row.index not in COUNTS:
        number, relative = highest, False
    elif known := predefined(row.index, row.sub):
        number, relative = known
    else:
        return row
    with suppress(ValueError):  # not of the type that such an object has
        return EntryDescription(
            *(row.index, row.sub, row.name, row.data_type, row.access),
            default=number,
            low=row.low,
            high=row.high,
            relative=relative,
            max_bytes=row.max_bytes,
        )
    return row
