"""Rules for the head of a file: FileInfo, DeviceInfo, DummyUsage, Comments, commissioning."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePath
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import Edit, EditPlace, RuleFinding
from tickrig.host.canopen.data_sheet.rules import known_keys
from tickrig.host.canopen.data_sheet.rules.list_rules import are_whole
from tickrig.host.canopen.eds import eds_number
from tickrig.wire.canopen.eds import eds_value
from tickrig.wire.canopen.eds.eds_file import shorten

_NEEDED: Final = {
    "DeviceInfo": f"{known_keys.NAMES[0]}=",
    "MandatoryObjects": "SupportedObjects=0",
}
"""Sections that every tool needs, with the first line of each."""
_DATE: Final = re.compile(r"[0-9]{2}-[0-9]{2}-[0-9]{4}", re.ASCII)
_TIME: Final = re.compile(r"[0-9]{1,2}:[0-9]{2} ?[AP]M", re.ASCII | re.IGNORECASE)
_NUMBER: Final = re.compile(r"0|[1-9][0-9]*|0x[0-9a-f]+", re.ASCII | re.IGNORECASE)
_FORMS: Final = {
    **dict.fromkeys(("CreationDate", "ModificationDate"), (_DATE, "mm-dd-yyyy")),
    **dict.fromkeys(("CreationTime", "ModificationTime"), (_TIME, "hh:mmAM or hh:mmPM")),
    **dict.fromkeys(("FileVersion", "FileRevision"), (_NUMBER, "a number, as 1")),
    "EDSVersion": (re.compile(r"[34]\.[0-9]"), "3.0 or 4.0"),
}
_MOST_GRANULARITY: Final = 64
_WIDEST: Final = 32
_DUMMY: Final = re.compile(r"dummy([0-9a-f]{4})")
_DUMMY_TYPES: Final = range(1, 0x20)
_DUMMIES: Final = tuple(f"Dummy{kind:04d}" for kind in range(1, 8))
"""The dummy objects that CiA 306 lists."""
_PDO_AREAS: Final = (("NrOfRXPDO", range(0x1400, 0x1600)), ("NrOfTXPDO", range(0x1800, 0x1A00)))
_IDENTITY_OBJECT: Final = 0x1018
_IDENTITY: Final = (("VendorNumber", 1), ("ProductNumber", 2), ("RevisionNumber", 3))


def number(document: Document, section: str, key: str) -> int | None:
    """Return the value of a keyword in a section, or None if the value is not a 32-bit number."""
    found = eds_number(document.file.value(section, key))
    return None if found is None or found.bit_length() > _WIDEST else found


def sections(document: Document) -> Iterator[RuleFinding]:
    """Find missing sections that every tool needs."""
    for title, first in _NEEDED.items():
        if title not in document.file.sections:
            added = Edit(len(document.texts), EditPlace.AFTER, ("", f"[{title}]", first))
            edits = () if document.head_is_lost else (added,)
            yield document.found("section-missing", f"[{title}] is missing", "", 0, *edits)


def file_info(document: Document) -> Iterator[RuleFinding]:
    """Check [FileInfo]."""
    file = document.file
    for key in known_keys.FILE_INFO:
        if not file.has("FileInfo", key):
            what = f"{key} is missing"
            yield document.found("file-info-missing", what, "FileInfo", key)
    for key, (form, wanted) in _FORMS.items():
        text = eds_value.without_comment(file.value("FileInfo", key))
        if text and not form.fullmatch(text):
            what = f"{key}={shorten(text)} is not {wanted}"
            yield document.found("file-info-form", what, "FileInfo", key)
    said, name = file.value("FileInfo", "FileName"), PurePath(document.name).name
    if said and said.lower() != name.lower():
        what = f"FileName={shorten(said)}, the file is {shorten(name)}"
        yield document.found("file-name", what, "FileInfo", "FileName")


def device_info(document: Document) -> Iterator[RuleFinding]:
    """Check [DeviceInfo] without other sections."""
    file, title = document.file, "DeviceInfo"
    if title not in file.sections:
        return
    for key in known_keys.DEVICE_INFO:
        if not file.has(title, key):
            value = _missing(document, key)
            edit = document.add_to(title, [f"{key}={value}"])
            what = f"{key} is missing: {value or 'none'} is taken"
            if not file.is_xml:
                yield document.found("device-info-missing", what, title, key, edit)
    for key in (*known_keys.NUMBERS, *known_keys.FLAGS):
        line = document.keyword(title, key)
        if line is not None and not line.value:
            edit, what = document.with_value(line, "0"), f"{key} is empty: 0 is taken"
            yield document.found("empty-value", what, title, key, edit)
    for key in known_keys.FLAGS:
        if number(document, title, key) not in (None, 0, 1):
            what = f"{key}={shorten(file.value(title, key))} is not 0 or 1"
            yield document.found("flag", what, title, key)
    granularity = number(document, title, "Granularity")
    if granularity is not None and not 0 <= granularity <= _MOST_GRANULARITY:
        what = f"Granularity={granularity} is not in 0..{_MOST_GRANULARITY}"
        yield document.found("granularity", what, title, "Granularity")
    if not document.device.info.bit_rates:
        yield document.found("bit-rate-none", "no BaudRate_... is 1", title)


def _missing(document: Document, key: str) -> str:
    """Return the value that a missing keyword of [DeviceInfo] implies."""
    row = document.rows.get((_IDENTITY_OBJECT, dict(_IDENTITY).get(key, 0)))
    if key in dict(_IDENTITY) and row is not None and row.has_default:
        return f"0x{int.from_bytes(row.default, 'little'):08X}"
    return "" if key in known_keys.NAMES else "0"


def counts(document: Document) -> Iterator[RuleFinding]:
    """Compare the numbers in [DeviceInfo] with the objects."""
    title = "DeviceInfo"
    for key, area in _PDO_AREAS:
        present = sum(index in area for index in document.device.objects)
        said, line = number(document, title, key), document.keyword(title, key)
        if said is not None and line is not None and said != present:
            be = "is" if present == 1 else "are"
            what = f"{key}={said}, but of {area[0]:X}h to {area[-1]:X}h there {be} {present}"
            whole = present and are_whole(document)  # otherwise some may be lost
            edits = (document.with_value(line, str(present)),) if said < present or whole else ()
            yield document.found("pdo-count", what, title, key, *edits)
    for key, sub in _IDENTITY:
        row, said = document.rows.get((_IDENTITY_OBJECT, sub)), number(document, title, key)
        if row is None or not row.has_default or not said:
            continue
        value = int.from_bytes(row.default, "little")
        if value and value != said:
            what = f"{key}=0x{said:X}, but 1018h:{sub:02X} is 0x{value:X}"
            yield document.found("identity", what, title, key)


def features(document: Document) -> Iterator[RuleFinding]:
    """Check that the objects exist that [DeviceInfo] announces."""
    title, rows = "DeviceInfo", document.rows
    if number(document, title, "LSS_Supported") and any(
        (0x1018, sub) not in rows for sub in (2, 4)
    ):
        what = "LSS_Supported=1, but 1018h has no sub-indices 1 to 4"
        yield document.found("lss-identity", what, title, "LSS_Supported")
    if number(document, title, "SimpleBootUpMaster") and (0x1F80, 0) not in rows:
        what = "SimpleBootUpMaster=1, but there is no 1F80h"
        yield document.found("boot-up-master", what, title, "SimpleBootUpMaster")
    channels = number(document, title, "DynamicChannelsSupported")
    if channels and "DynamicChannels" not in document.file.sections and not document.file.is_xml:
        what = f"DynamicChannelsSupported={channels}, but there is no [DynamicChannels]"
        yield document.found("dynamic-channels", what, title, "DynamicChannelsSupported")


def dummy_usage(document: Document) -> Iterator[RuleFinding]:
    """Check [DummyUsage]."""
    for line in document.lines_of("DummyUsage"):
        match = _DUMMY.fullmatch(line.key.lower())
        said = eds_value.without_comment(line.value)
        if match is None or int(match[1], 16) not in _DUMMY_TYPES or said not in ("0", "1"):
            what = f"{shorten(line.content)} is not Dummy0001=0 to Dummy001F=1"
            yield document.found("dummy-usage", what, "DummyUsage", line.number)
    file, title = document.file, "DummyUsage"
    for key in _DUMMIES if title in file.sections and not file.is_xml else ():
        if not file.has(title, key):
            edit = document.add_to(title, [f"{key}=0"])
            what = f"{key} is missing: 0 is taken"
            yield document.found("dummy-usage", what, title, "", edit)


def comment_lines(document: Document) -> Iterator[RuleFinding]:
    """Count the lines of [Comments]."""
    lines = document.lines_of("Comments")
    numbers = {line.key.lower() for line in lines if line.key.lower() != "lines"}
    head = document.keyword("Comments", "Lines")
    if head is None:
        return
    said = number(document, "Comments", "Lines")
    wanted = {f"line{at}" for at in range(1, len(numbers) + 1)}
    if said != len(numbers) or numbers != wanted:
        edits = (document.with_value(head, str(len(numbers))),) if numbers == wanted else ()
        what = f"Lines={shorten(head.value)}, but there are {len(numbers)}, starting at Line1"
        yield document.found("comment-lines", what, "Comments", "Lines", *edits)


def commissioning(document: Document) -> Iterator[RuleFinding]:
    """Find commissioning keywords that a DCF lacks, or that an EDS must not have."""
    file, title = document.file, "DeviceComissioning"
    if document.name.lower().endswith(".dcf") and title not in file.sections:
        yield document.found("commissioning-missing", f"the DCF has no [{title}]")
    if document.name.lower().endswith(".eds") and title in file.sections:
        yield document.found("dcf-section", f"[{title}] stands in an EDS", title)
    if file.is_dcf:
        return
    for line in () if file.is_xml else file.lines:
        kept = line.is_keyword and eds_value.object_section(line.section) is not None
        if kept and line.key.lower() in _DCF_KEYS:
            what = f"{line.key} stands in an EDS"
            yield document.found("dcf-key", what, line.section, line.number)


_DCF_KEYS: Final = frozenset(key.lower() for key in known_keys.OF_DCF if key != "ParameterValue")
"""Keywords of commissioning that the reader reports."""
