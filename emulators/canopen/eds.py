"""Object dictionaries from EDS and DCF files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Ds401, families
from tickrig.device.canopen.ds402 import Ds402, indices
from tickrig.device.canopen.ds402.modes.modes import MODES, supported
from tickrig.device.canopen.slave import Application, ServiceMaker
from tickrig.emulators.canopen.choices import AUTO
from tickrig.host.canopen.eds import open_eds, read_eds_bytes, sheet_of
from tickrig.host.text.values import Setting, counted
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_entry import COUNTS
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, Finding
from tickrig.wire.canopen.eds.eds_value import format_value
from tickrig.wire.canopen.eds.object_table import DeviceInfo, EntryDescription

# Device profiles of nodes, and their selection.

_DEVICE_TYPE: Final = 0x1000

PROFILES: Final[dict[str, ServiceMaker]] = {"none": Application, "401": Ds401, "402": Ds402}
"""Device profiles by the number in the low word of 1000h."""

PROFILE_AREA: Final = range(0x6000, 0xA000)
_AXIS: Final = 0x800
"""Offset between the objects of two axes, or logical devices (CiA 301)."""
_PDO_PARAMETERS: Final = (*range(0x1400, 0x1600), *range(0x1800, 0x1A00))
_TRANSMISSION_TYPE: Final = 2
_EVENT_DRIVEN: Final = 255
"""The transmission type of PDOs in CiA 401 and CiA 402."""

_DRIVE_DEFAULTS: Final = {**indices.DEFAULTS, (indices.SUPPORTED_MODES, 0): supported(MODES)}
_DRIVE_OBJECTS: Final = (*(indices.CONTROLWORD, indices.STATUSWORD, indices.MODES_OF_OPERATION),)
_MODULE_OBJECTS: Final = (
    *(families.READ_INPUT.by_8, families.WRITE_OUTPUT.by_8),
    *(families.ANALOGUE_INPUT.integers[1], families.ANALOGUE_OUTPUT.integers[1]),
)
"""Arrays of common inputs and outputs."""


def application_of(dictionary: Dictionary, profile: str = AUTO) -> ServiceMaker:
    """Return a profile of `choices.PROFILES`; `auto` selects the profile of the device type.

    >>> application_of(Dictionary([])).__name__
    'Application'
    """
    if profile == AUTO:
        entry = dictionary.find(_DEVICE_TYPE)
        number = entry.number & 0xFFFF if entry else 0
        return PROFILES.get(str(number), Application)
    return PROFILES[profile]


def profile_name(application: ServiceMaker) -> str:
    """Return the name of a profile, or `none` if it is not in `PROFILES`.

    >>> profile_name(Ds401)
    '401'
    """
    return next((name for name, make in PROFILES.items() if make is application), "none")


def _looks_like(dictionary: Dictionary) -> str:
    """Return the name of the profile with the objects of a dictionary; empty if there is none.

    >>> _looks_like(Dictionary([]))
    ''
    """
    if all(index in dictionary.objects for index in _DRIVE_OBJECTS):
        return "402"
    return "401" if any((index, 1) in dictionary for index in _MODULE_OBJECTS) else ""


def _default_of(application: ServiceMaker, index: int, sub: int) -> int | None:
    """Return the default of an entry in a profile (-1 for all bits), or None without a default.

    >>> _default_of(Ds402, 0x6081, 0), _default_of(Ds401, 0x6206, 1), _default_of(Ds402, 0x2000, 0)
    (10000, -1, None)
    """
    name = profile_name(application)
    if name == "none":
        return None
    if index not in PROFILE_AREA:
        is_transmission = index in _PDO_PARAMETERS and sub == _TRANSMISSION_TYPE
        of_communication = _EVENT_DRIVEN if is_transmission else None
        return int(name) if (index, sub) == (_DEVICE_TYPE, 0) else of_communication
    first = PROFILE_AREA.start + (index - PROFILE_AREA.start) % _AXIS
    if application is Ds401:
        of_all = first == families.DIGITAL_INTERRUPT_ENABLE
        return families.DEFAULTS.get(first) if sub or of_all else None
    return _DRIVE_DEFAULTS.get((first, sub))


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """Description of a device, from which slaves can be made.

    Attributes:
        file: path of the EDS or DCF, or name of the model.
        info: vendor, product and bit rates.
        template: objects with default values. The template is never given to a slave.
        node_id: node-ID in a DCF or of a model, or None if missing.
        bit_rate: bit rate in a DCF in bit/s, or None if missing.
        application: factory of the application.
        warnings: deviations of the file from the standard, and values that the file leaves open.
        start: initial values by name, for inputs whose initial values differ from the usual values.
        files: EDS or DCF of a node of a bus.yml, and the URDF with its joint.
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
        """Make the dictionary of a new slave."""
        return self.template.copy()


_OPEN: Final[Mapping[tuple[int, int], int]] = {}
_INVALID: Final = 1 << 31

_FIXED: Final = {(0x1005, 0): 0x80, (0x1012, 0): 0x100}
_RELATIVE: Final = {
    (0x1014, 0): 0x80,
    (0x1200, 1): 0x600,
    (0x1200, 2): 0x580,
    **{(0x1400 + number, 1): 0x200 + 0x100 * number for number in range(4)},
    **{(0x1800 + number, 1): 0x180 + 0x100 * number for number in range(4)},
}
_COB_IDS: Final = (
    (range(0x1201, 0x1300), (1, 2)),
    (range(0x1404, 0x1600), (1,)),
    (range(0x1804, 0x1A00), (1,)),
)
"""Objects that are invalid until they get a COB-ID, and its sub-indices."""


def _predefined(index: int, sub: int) -> tuple[int, bool] | None:
    """Return a default and whether to add the node-ID, or None without a default.

    >>> _predefined(0x1800, 1), _predefined(0x1809, 1), _predefined(0x2000, 0)
    ((384, True), (2147483648, False), None)
    """
    at = (index, sub)
    if at in _FIXED:
        return _FIXED[at], False
    if at in _RELATIVE:
        return _RELATIVE[at], True
    invalid = any(index in objects and sub in subs for objects, subs in _COB_IDS)
    return (_INVALID, False) if invalid else None


def read_eds(path: Path, profile: str = AUTO) -> DeviceDescription:
    """Read an EDS or DCF file (CiA 306), and return the device that it describes.

    Args:
        path: path of the file, with any name.
        profile: profile for defaults that are missing in the file: `auto` to use the profile of the
            device type, or `401`, `402` or `none`.

    Returns:
        The description of the device; pass its `make_dictionary()` to `make_slave`.

    Raises:
        OSError: the file cannot be read.
        EdsError: the file is malformed.
    """
    return describe(open_eds(path), profile)


def describe(file: EdsFile, profile: str = AUTO) -> DeviceDescription:
    """Return the device that an EDS or DCF describes, with a value for each missing default.

    A deviation from the standard with a clear meaning is a warning of the description. If a default
    is missing:

    - a COB-ID gets the default of the pre-defined connection set;
    - a sub-index 0 gets the number of entries;
    - an object of the device profile gets its default in the profile;
    - any other object gets the value nearest to 0 within its limits.

    Args:
        file: the EDS or DCF.
        profile: profile for missing defaults, which is a name of `choices.PROFILES`.

    Raises:
        EdsError: the file has errors that would change the device. The message lists all of them.
    """
    return in_profile(_describe(file, read_device(file)), profile)


@lru_cache(maxsize=16)  # most benches of a test run have nodes of the same few files
def _description_of(name: str, data: bytes) -> DeviceDescription:
    return _describe(*sheet_of(name, data))


def _describe(file: EdsFile, device: EdsDevice) -> DeviceDescription:
    """Describe a device by its file only; values may be missing."""
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


def in_profile(
    description: DeviceDescription, profile: str, defaults: Mapping[tuple[int, int], int] = _OPEN
) -> DeviceDescription:
    """Apply a device profile to the description of a device from an EDS.

    The profile supplies the default values that are missing in the file. It also supplies the
    application: what the device does besides communication.

    Args:
        description: description of the device by its file alone, from `EdsCache.read`.
        profile: profile of the device, which is a name of `choices.PROFILES`.
        defaults: defaults by (index, sub-index), which have priority over the defaults of the
            profile.

    Returns:
        The description with the profile. Its warnings list the chosen values.
    """
    given = description.template.description
    application = application_of(description.template, profile)
    entries = [_in_profile(row, application, defaults) for row in given]
    chosen = [row for row, before in zip(entries, given, strict=True) if row is not before]
    template = description.template if not chosen else Dictionary(entries, given.objects)
    limited = [row for row in entries if not row.has_default and any(row.default)]
    which = f"of CiA {profile_name(application)}: those of the profile are taken"
    told = (
        *_told_of_type(description.template, application, profile),
        *_told_of_values(chosen, which),
        *_told_of_values(limited, "whose limits leave 0 out: the limit next to 0 is taken"),
    )
    findings = (Finding(description.file, "", reason) for reason in told)
    return replace(
        description,
        template=template,
        application=application,
        warnings=(*description.warnings, *findings),
    )


def _in_profile(
    row: EntryDescription, application: ServiceMaker, defaults: Mapping[tuple[int, int], int]
) -> EntryDescription:
    if row.has_default or not row.data_type.size:
        return row
    value = defaults.get((row.index, row.sub))
    if value is None:
        value = _default_of(application, row.index, row.sub)
    return row if value is None else row.with_default(fitting(row, value))


def fitting(row: EntryDescription, value: int) -> Value:
    """Return a number, limited to the range of values that an entry allows.

    Args:
        row: description of the entry.
        value: the number. For an unsigned integer entry, -1 stands for the largest number of the
            data type, in which all bits are set.
    """
    low, high = row.low, row.high
    nearest: int | float = value
    if row.data_type.is_integer:
        lowest, highest = row.data_type.limits
        nearest = highest if value == -1 and not row.signed else max(lowest, min(highest, value))
    if high is not None:
        nearest = min(nearest, high)
    if low is not None:
        nearest = max(nearest, low)
    return round(nearest) if row.data_type.is_integer else nearest


_SHOWN: Final = 3
"""Number of entries that a warning names."""


def _told_of_values(rows: Sequence[EntryDescription], what: str) -> Iterator[str]:
    """Return one warning with the chosen values."""
    if rows:
        named = (
            f"{_place(row)}={format_value(row.data_type, row.default)}" for row in rows[:_SHOWN]
        )
        more = ", ..." if rows[_SHOWN:] else ""
        values = counted(len(rows), "value")
        yield f"no DefaultValue for {values} {what}, as {', '.join(named)}{more}"


def _place(row: EntryDescription) -> str:
    return f"{row.index:04X}h" + (f":{row.sub:02X}" if row.sub else "")


def _told_of_type(dictionary: Dictionary, application: ServiceMaker, profile: str) -> Iterator[str]:
    """Warn that a device looks like one with a profile, or serves other modes than listed."""
    row, likely = dictionary.find(_DEVICE_TYPE), _looks_like(dictionary)
    if profile == AUTO and likely and (row is None or not row.number & 0xFFFF):
        said = "has no value" if row and not row.description.has_default else "names none"
        what = f"1000h {said}" if row else "there is no 1000h"
        yield f'{what}: no profile; use --profile {likely} (in a rig file: profile = "{likely}")'
    modes = dictionary.find(indices.SUPPORTED_MODES)
    if application is Ds402 and modes and modes.description.has_default and not modes.number:
        yield f"6502h=0 lists no mode of operation: 0x{supported(MODES):08X} is served"


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
    elif known := _predefined(row.index, row.sub):
        number, relative = known
    else:
        return row
    with suppress(ValueError):  # not of the type that such an object has
        return row.with_default(number, relative=relative)
    return row


Version = tuple[int, int]
"""Time and size of a file."""


class EdsCache:
    """Cache of EDS and DCF files: reads each file once, and again when it has changed.

    Attributes:
        others: cached results of functions that read several files, such as `read_bus`. A key
            contains the arguments that determine the result, such as the path of the bus.yml. Each
            result is stored with the versions of the files from which it was made.
    """

    def __init__(self) -> None:
        self._known: dict[tuple[Path, str | None], tuple[Version, DeviceDescription]] = {}
        self.others: dict[object, tuple[Mapping[Path, Version], object]] = {}

    def read(self, path: Path, profile: str | None = AUTO) -> DeviceDescription:
        """Return the description of the device in an EDS or DCF file, as `read_eds` does.

        Args:
            path: path of the file.
            profile: name of a device profile, which supplies the default values that are missing in
                the file. None means that only the file describes the device.

        Raises:
            OSError: the file cannot be read.
            EdsError: the file is malformed.
        """
        version = version_of(path)
        known = self._known.get((path, profile))
        if known is None or known[0] != version:
            found = _description_of(str(path), read_eds_bytes(path))
            known = version, found if profile is None else in_profile(found, profile)
            self._known[path, profile] = known
        return known[1]


def version_of(path: Path) -> Version:
    """Return the time and size of a file, which change when the file is written.

    Raises:
        OSError: the file is not accessible.
    """
    status = path.stat()
    return status.st_mtime_ns, status.st_size
