"""Rules for mandatory objects of the communication area and of profiles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_entry import StandardObject, standard_object
from tickrig.wire.canopen.eds.eds_writer import VARIABLES
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

_MANDATORY: Final = (0x1000, 0x1001, 0x1018)
_DEVICE_TYPE: Final = (0x1000, 0)
_IDENTITY: Final = 0x1018
_COMMUNICATION: Final = range(0x1000, 0x2000)
_WRITE_ONLY: Final = (0x1024, 0x1026, *range(0x1F50, 0x1F60))
"""Write-only objects, which hold commands or programs."""
_PROFILE_AREA: Final = range(0x6000, 0xA000)
_TEXTS: Final = (
    *(DataType.VISIBLE_STRING, DataType.UNICODE_STRING, DataType.OCTET_STRING, DataType.DOMAIN),
)
"""Data types without a fixed length."""
_INPUTS_OUTPUTS: Final = (
    (1 << 16, "digital inputs", (0x6000, 0x6020, 0x6100, 0x6120)),
    (1 << 17, "digital outputs", (0x6200, 0x6220, 0x6300, 0x6320)),
    (1 << 18, "analogue inputs", (0x6400, 0x6401, 0x6402, 0x6403, 0x6404)),
    (1 << 19, "analogue outputs", (0x6410, 0x6411, 0x6412, 0x6413, 0x6414)),
)
_DRIVE: Final = (0x6040, 0x6041)
_IO_PROFILE: Final = 401
_DRIVE_PROFILE: Final = 402
_MANY_AXES: Final = 0x800
_GUESSED: Final = (
    *("data-type-missing", "data-type-unknown", "empty-value", "no-number"),
    *("access-missing", "access-form"),
)
"""Rules that, if broken, mean that the reader assumed a value that the file lacks."""


def mandatory(document: Document) -> Iterator[RuleFinding]:
    """Find missing objects that each CANopen device must have."""
    objects = document.device.objects
    if not objects:
        return
    for index in _MANDATORY:
        if index not in objects:
            yield document.found("mandatory-missing", f"there is no {index:04X}h")
    if _IDENTITY in objects and (_IDENTITY, 1) not in document.rows:
        what = "there is no 1018h:01 (vendor-ID)"
        yield document.found("mandatory-missing", what, f"{_IDENTITY:04X}")
    if 0x1017 not in objects and 0x100C not in objects:
        what = "there is no 1017h (heartbeat) and no 100Ch (node guarding)"
        yield document.found("error-control", what)


def communication(document: Document) -> Iterator[RuleFinding]:
    """Compare the objects of the communication area with CiA 301."""
    for index, described in document.device.objects.items():
        standard = standard_object(index)
        if standard is not None and standard.composed == (described.code in VARIABLES):
            kind = "an ARRAY or RECORD" if standard.composed else "a VAR"
            what = f"it is a {described.code.name}, {kind} was allowed"
            yield document.found("communication-kind", what, f"{index:04X}", "ObjectType")
    file = document.file
    findings = (*file.errors, *file.warnings)
    guessed = {(one.section, one.line) for one in findings if one.rule in _GUESSED}
    for row in document.rows.values():
        if row.index in _COMMUNICATION:
            found = _entry(document, row, standard_object(row.index))
            yield from (one for one in found if (one.section, one.line) not in guessed)


def _entry(
    document: Document, row: EntryDescription, standard: StandardObject | None
) -> Iterator[RuleFinding]:
    place = document.section_of(row)
    if standard is not None and (row.sub == 0 or standard.composed):
        wanted = standard.types.get(row.sub, standard.others)
        both_texts = wanted in _TEXTS and row.data_type in _TEXTS
        if wanted not in (None, row.data_type) and not both_texts and _is_composed(document, row):
            what = f"its DataType is {row.data_type.name}, {wanted.name} was allowed"
            yield document.found("communication-type", what, place, "DataType")
    if Access.WRITE in row.access and standard is not None and standard.fixed:
        what = "the bus may write it; it must be read-only"
        yield document.found("communication-access", what, place, "AccessType")
    elif Access.READ not in row.access and row.index not in _WRITE_ONLY and standard is not None:
        what = "the bus may not read it"
        yield document.found("communication-access", what, place, "AccessType")


def _is_composed(document: Document, row: EntryDescription) -> bool:
    """Return whether an object has the kind to which its known types belong."""
    standard, described = standard_object(row.index), document.device.objects[row.index]
    return standard is not None and standard.composed == (described.code not in VARIABLES)


def profile(document: Document) -> Iterator[RuleFinding]:
    """Compare the device type with the objects of the profile."""
    row, objects = document.rows.get(_DEVICE_TYPE), document.device.objects
    if row is None or row.data_type is not DataType.UNSIGNED32:
        return
    if not row.has_default:
        drive = ", but 6040h and 6041h of a drive" if set(_DRIVE) <= objects.keys() else ""
        text = f"1000h has no value: no profile{drive}"
        yield document.found("device-type-missing", text, "1000")
        return
    device_type = int.from_bytes(row.default, "little")
    number, more = device_type & 0xFFFF, device_type & 0xFFFF_0000
    if number == _IO_PROFILE:
        for flag, what, some in _INPUTS_OUTPUTS:
            if more & flag and not any(index in objects for index in some):
                text = f"it declares {what}, but has none of {some[0]:04X}h to {some[-1]:04X}h"
                yield document.found("profile-objects", text, "1000", "DefaultValue")
    elif number == _DRIVE_PROFILE:
        for index in _DRIVE:
            if not any(index + axis * _MANY_AXES in objects for axis in range(8)):
                text = f"it is a drive, but there is no {index:04X}h"
                yield document.found("profile-objects", text, "1000", "DefaultValue")
    elif number == 0 and any(index in _PROFILE_AREA for index in objects):
        text = "it has no profile, but objects of 6000h to 9FFFh"
        yield document.found("profile-none", text, "1000", "DefaultValue")
