"""Dictionaries out of EDS and DCF files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.slave import ServiceMaker
from tickrig.host.canopen.eds import open_eds
from tickrig.host.text.values import Setting
from tickrig.wire.canopen.eds.eds_device import read_device
from tickrig.wire.canopen.eds.eds_entry import COUNTS
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, Finding
from tickrig.wire.canopen.eds.object_table import DeviceInfo, EntryDescription


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """A device that slaves can be made of.

    Attributes:
        file: the EDS or DCF, or the name of the model.
        info: vendor, product, bit rates.
        template: the objects with default values; never given to a slave.
        node_id: of a DCF or model, None if it gives none.
        bit_rate: of a DCF in bit/s, None if it gives none.
        application: what the device does with its objects.
        warnings: what is not by the standard in its file.
        start: inputs that are not as usual when a slave of it begins, by name.
        files: of a node of a bus.yml: its EDS or DCF, and the URDF that has its joint.
    """

    file: str
    info: DeviceInfo
    template: Dictionary
    node_id: int | None = None
    bit_rate: int | None = None
    application: ServiceMaker = Application
    warnings: tuple[Finding, ...] = ()
    start: Mapping[str, Setting] = field(default_factory=dict)
    files: tuple[Path, ...] = ()

    def make_dictionary(self) -> Dictionary:
        """Make the dictionary of one more slave."""
        return self.template.copy()


INVALID: Final = 1 << 31

FIXED: Final = {(0x1005, 0): 0x80, (0x1012, 0): 0x100}
RELATIVE: Final = {
    (0x1014, 0): 0x80,
    (0x1200, 1): 0x600,
    (0x1200, 2): 0x580,
    **{(0x1400 + number, 1): 0x200 + 0x100 * number for number in range(4)},
    **{(0x1800 + number, 1): 0x180 + 0x100 * number for number in range(4)},
}
COB_IDS: Final = (
    (range(0x1201, 0x1300), (1, 2)),
    (range(0x1404, 0x1600), (1,)),
    (range(0x1804, 0x1A00), (1,)),
)
"""Objects that are not valid until somebody gives them a COB-ID, and its sub-indices."""


def predefined(index: int, sub: int) -> tuple[int, bool] | None:
    """Return a default, and whether the node-ID is added to it; None if there is none.

    >>> predefined(0x1800, 1), predefined(0x1809, 1), predefined(0x2000, 0)
    ((384, True), (2147483648, False), None)
    """
    at = (index, sub)
    if at in FIXED:
        return FIXED[at], False
    if at in RELATIVE:
        return RELATIVE[at], True
    invalid = any(index in objects and sub in subs for objects, subs in COB_IDS)
    return (INVALID, False) if invalid else None


def read_eds(path: Path) -> DeviceDescription:
    """Read an EDS or DCF file (CiA 306).

    Args:
        path: the file; what its name ends with does not matter.

    Returns:
        What it says of the device; `make_dictionary()` of it is what `make_slave` takes.

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


Version = tuple[int, int]
"""Time and size of a file."""


class EdsCache:
    """Reads each EDS or DCF once, and again when the file has changed.

    Attributes:
        others: what else was read, by what it was read of, with the versions of its files.
    """

    def __init__(self) -> None:
        self._known: dict[Path, tuple[Version, DeviceDescription]] = {}
        self.others: dict[object, tuple[Mapping[Path, Version], object]] = {}

    def read(self, path: Path) -> DeviceDescription:
        """Return what a file describes.

        Raises:
            OSError: the file cannot be read.
            EdsError: it is malformed.
        """
        version = version_of(path)
        known = self._known.get(path)
        if known is None or known[0] != version:
            known = version, read_eds(path)
            self._known[path] = known
        return known[1]


def version_of(path: Path) -> Version:
    """Return what tells whether a file has changed; OSError if it cannot be looked at."""
    status = path.stat()
    return status.st_mtime_ns, status.st_size
