"""What a rule for EDS files is, and what it finds."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple


class Severity(Enum):
    """How much a finding matters."""

    ERROR = "error"
    """A tool misreads or refuses the file."""
    WARNING = "warning"
    """Tools differ in what they make of it."""
    NOTE = "note"
    """Style, or something that may be left out."""


class EdsRule(NamedTuple):
    """One rule.

    Attributes:
        name: as findings show it.
        severity: of its findings.
        clause: the document and clause that it is from; `practice` where none says it.
        breaks: what goes wrong where it is broken.
        fix: what to do, in words.
    """

    name: str
    severity: Severity
    clause: str
    breaks: str
    fix: str


_Rules = tuple[tuple[str, str, str, str], ...]
"""Name, clause, what breaks, what to do."""


def rules_of(errors: _Rules, warnings: _Rules, notes: _Rules) -> dict[str, EdsRule]:
    """Return rules by name, in the order of their severity."""
    tables = zip(Severity, (errors, warnings, notes), strict=True)
    return {
        name: EdsRule(name, severity, clause, breaks, fix)
        for severity, rules in tables
        for name, clause, breaks, fix in rules
    }


class EditPlace(Enum):
    """What an edit does with a line."""

    REPLACE = "replace"
    AFTER = "after"
    ENCODING = "encoding"
    LINE_ENDS = "line ends"


class Edit(NamedTuple):
    """One change of a file.

    Attributes:
        line: its number; 0 stands before the first one.
        place: whether the line is replaced, or lines are put behind it; or the file as a whole.
        lines: what stands there then, without line ends.
    """

    line: int
    place: EditPlace = EditPlace.REPLACE
    lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RuleFinding:
    """What breaks a rule.

    Attributes:
        rule: which one.
        file: what the file is called.
        line: its number, 0 for the file as a whole.
        section: empty outside of one.
        text: what came, and what was allowed.
        edits: what mends it; empty where that takes knowledge of the device.
    """

    rule: EdsRule
    file: str
    line: int
    section: str
    text: str
    edits: tuple[Edit, ...] = ()

    def __str__(self) -> str:
        """Say it in one line, as compilers do."""
        name, severity, clause, _, fix = self.rule
        where = f"[{self.section}] " if self.section else ""
        head = f"{self.file}:{max(self.line, 1)}: {severity.value}: [{name}] "
        return f"{head}{where}{self.text}; fix: {fix} ({clause})"


# All rules of `canmon eds check`: name, clause, what breaks, what to do.

_PRACTICE: Final = "practice"
_FILE_INFO: Final = "CiA 306-1, [FileInfo]"
_DEVICE_INFO: Final = "CiA 306-1, [DeviceInfo]"
_LISTS: Final = "CiA 306-1, lists of objects"
_VALUES: Final = "CiA 306-1, interpretation of values"
_OBJECT: Final = "CiA 306-1 4.6.3"
_OBJECT_KEYS: Final = "CiA 306-1 4.6.3.2"
_DICTIONARY: Final = "CiA 301 7.4"
_RPDO_MAPPING: Final = "CiA 301 7.5.2.36 and 7.5.2.38"
_PDO_PARAMETER: Final = "CiA 301 7.5.2.35 and 7.5.2.37"
_RESTRICTED: Final = "CiA 301, restricted CAN-IDs"

_ERRORS: Final = (
    ("utf-16", _PRACTICE, "nearly every reader sees noise", "write it as ASCII or UTF-8"),
    ("line-ends", _PRACTICE, "most readers see one long line", "end lines with CR LF or LF"),
    (
        "xml",
        "CiA 311",
        "it cannot be read",
        "give an XDD with a CANopenObjectList, without DOCTYPE",
    ),
    ("object-index", "CiA 311", "the object is lost", "four hexadecimal digits, as 1018"),
    ("truncated", _PRACTICE, "the rest of the device is lost", "take the whole file"),
    ("no-objects", _OBJECT, "there is no device", "describe its objects"),
    ("no-keyword", "CiA 306-1, structure", "parsers stop here, or skip it", "KEY=VALUE or ; text"),
    ("doubled-section", _PRACTICE, "parsers refuse it, or take either", "merge the sections"),
    ("doubled-key", _PRACTICE, "parsers refuse it, or take either", "keep one"),
    ("section-missing", "CiA 306-1, structure", "tools refuse the file", "add it"),
    ("list-count", _LISTS, "tools stop early or refuse the list", "count its entries"),
    ("list-gap", _LISTS, "tools stop at the gap", "number the entries from 1 on"),
    ("list-missing", _LISTS, "tools that follow the lists do not see it", "add it to its list"),
    ("list-extra", _LISTS, "tools refuse the file", "describe the object, or take it off the list"),
    ("list-entry", _LISTS, "tools refuse the list", "give an index, as 0x1018"),
    ("object-type", _OBJECT_KEYS, "tools refuse the object", "0x7 VAR, 0x8 ARRAY, 0x9 RECORD, ..."),
    ("data-type-missing", _OBJECT_KEYS, "tools refuse the object", "add DataType, as 0x0007"),
    ("access-missing", _OBJECT_KEYS, "tools refuse the object", "add AccessType"),
    ("access-form", _OBJECT_KEYS, "tools refuse the object", "ro, wo, rw, rwr, rww or const"),
    ("name-missing", _OBJECT_KEYS, "tools refuse the object", "add ParameterName"),
    ("empty-value", _VALUES, "tools refuse the file", "give it a value, or leave it out"),
    ("no-number", _VALUES, "tools refuse the file", "write a number"),
    ("number-word", _VALUES, "tools refuse the file", "write the number that it stands for"),
    (
        "leading-zero",
        _VALUES,
        "octal for some, decimal for others, and others refuse the file",
        "write 0x or no 0",
    ),
    ("number-form", _VALUES, "tools refuse the number", "write 10, 0xA or 012, and nothing else"),
    ("sub-number", _OBJECT_KEYS, "tools lose sub-indices or refuse them", "count the sub-indices"),
    ("sub-orphan", _OBJECT, "tools refuse or lose it", "describe the object as well"),
    ("sub0-missing", _DICTIONARY, "nobody can read how many there are", "describe sub-index 0"),
    ("sub0-type", _DICTIONARY, "tools read another length", "make it an UNSIGNED8"),
    ("default-value", _VALUES, "tools refuse it, or the device has another", "fit it to DataType"),
    ("limit-order", _OBJECT_KEYS, "no value is allowed", "exchange LowLimit and HighLimit"),
    ("mandatory-missing", "CiA 301 7.5.2", "it is no CANopen device", "add 1000h, 1001h and 1018h"),
    (
        "communication-type",
        "CiA 301 7.5.2",
        "hosts send another length",
        "take the type of CiA 301",
    ),
    ("communication-kind", "CiA 301 7.5.2", "hosts address other sub-indices", "as CiA 301 has it"),
    ("cob-id-range", _PDO_PARAMETER, "no CAN-ID has so many bits", "give 11 bits, or set bit 29"),
    ("pdo-length", _RPDO_MAPPING, "such a PDO cannot be sent", "map at most 64 bits"),
    ("mapped-missing", _RPDO_MAPPING, "the device refuses its own default", "map what is there"),
    (
        "mapped-length",
        _RPDO_MAPPING,
        "PDOs are taken apart wrongly",
        "give the length of the object",
    ),
)
_WARNINGS: Final = (
    (
        "not-utf-8",
        _PRACTICE,
        "the canopen library and dcf-tools refuse the file",
        "write it as UTF-8 or ASCII",
    ),
    ("bom", _PRACTICE, "the first section has another name for some", "leave the mark out"),
    ("control-character", _PRACTICE, "some readers end at it", "leave it out"),
    ("section-form", _OBJECT, "case-sensitive readers miss it", "write it as CiA 306 does"),
    ("key-case", _PRACTICE, "case-sensitive readers miss it", "write it as CiA 306 does"),
    ("inline-comment", _PRACTICE, "readers take it for the value", "give it a line of its own"),
    ("device-info-missing", _DEVICE_INFO, "tools guess, or refuse", "add it"),
    ("bit-rate-none", _DEVICE_INFO, "tools offer none", "set what it supports to 1"),
    ("granularity", _DEVICE_INFO, "tools map what it refuses", "0 to 64; 8 for whole bytes"),
    ("flag", _DEVICE_INFO, "tools differ in what is true", "write 0 or 1"),
    ("compact-pdo", _DEVICE_INFO, "tools imply other PDOs, or none", "0x01 to 0x3F, and how many"),
    ("pdo-count", _DEVICE_INFO, "tools show too many or too few", "count the PDO parameters"),
    ("identity", _DEVICE_INFO, "masters refuse the node", "give 1018h and DeviceInfo one number"),
    ("dynamic-channels", "CiA 302-4", "tools look for segments", "add [DynamicChannels], or 0"),
    ("dummy-usage", "CiA 306-1, [DummyUsage]", "tools skip it", "Dummy0001=0 or =1, by data type"),
    ("comment-lines", "CiA 306-1, [Comments]", "tools lose comments", "count the lines"),
    ("commissioning-missing", "CiA 306-1, DCF", "it is of no node", "add [DeviceComissioning]"),
    ("bit-rate-unit", "CiA 306-1, DCF", "tools set another bit rate", "give kbit/s, as 500"),
    ("dcf-key", "CiA 306-1, DCF", "EDS readers skip it, or take it", "DefaultValue, or a DCF"),
    ("dcf-section", "CiA 306-1, DCF", "EDS readers skip it", "name the file .dcf"),
    ("node-id", "CiA 301 7.2", "no node has it", "1 to 127"),
    (
        "modules",
        "CiA 306-1, modular devices",
        "objects of modules are missing",
        "a DCF with [ConnectedModules], and each of them described",
    ),
    (
        "list-wrong",
        _LISTS,
        "tools show it elsewhere",
        "by its index: 2000h to 5FFFh manufacturer's",
    ),
    ("list-doubled", _LISTS, "tools count it twice", "list it once"),
    ("object-type-missing", _OBJECT_KEYS, "it counts as VAR: sub-indices are lost", "add it"),
    ("data-type-unknown", _DICTIONARY, "tools take bytes, or refuse it", "take one of CiA 301"),
    ("data-type-derived", _DICTIONARY, "most tools take bytes, or refuse it", "one of CiA 301"),
    ("name-length", _OBJECT_KEYS, "tools cut it off", "at most 241 characters"),
    ("compact-record", _OBJECT, "tools refuse it, or see one entry", "describe each entry"),
    ("value-place", _OBJECT_KEYS, "the value is lost", "give it to the sub-index that is meant"),
    ("sub0-value", _DICTIONARY, "tools read too many or too few", "the highest sub-index"),
    ("nodeid-form", _VALUES, "tools find no node-ID, or fail", "$NODEID first"),
    ("value-sign", _VALUES, "tools refuse it, or differ", "write it as its DataType has it"),
    ("byte-form", _VALUES, "tools refuse it, or take other bytes", "two hexadecimal digits a byte"),
    ("boolean-value", _DICTIONARY, "tools differ in what is true", "write 0 or 1"),
    ("text-value", _DICTIONARY, "the bytes depend on the reader", "ASCII in a VISIBLE_STRING"),
    ("factor", _PRACTICE, "readers divide by it", "a number that is not 0"),
    ("default-limits", _OBJECT_KEYS, "the device refuses its own default", "mend one of them"),
    ("limit-value", _OBJECT_KEYS, "tools fail, or take no limit", "a number of its DataType"),
    ("limit-range", _OBJECT_KEYS, "tools fail, or take no limit", "a number of its DataType"),
    ("communication-access", "CiA 301 7.5.2", "hosts write, or fail to read", "as CiA 301 has it"),
    (
        "cob-id-restricted",
        _RESTRICTED,
        "it clashes with a service",
        "another CAN-ID, or set bit 31",
    ),
    ("sdo-server", "CiA 301 7.5.2.33", "no client finds it", "$NODEID+0x600, $NODEID+0x580"),
    ("cob-id-unique", _RESTRICTED, "one CAN-ID means two things", "another CAN-ID, or set bit 31"),
    ("pdo-half", _PDO_PARAMETER, "hosts cannot take the PDO apart", "parameter and mapping"),
    ("mapping-count", _RPDO_MAPPING, "hosts map what is not there", "at most its sub-indices"),
    ("mapped-mappable", _RPDO_MAPPING, "tools refuse the default", "PDOMapping=1"),
    (
        "mapped-direction",
        _RPDO_MAPPING,
        "tools refuse the default",
        "AccessType that goes that way",
    ),
    (
        "device-type-missing",
        "CiA 301 7.5.2.1",
        "masters see no profile, and an emulator has none",
        "name the profile in 1000h",
    ),
    ("profile-objects", "CiA 401, CiA 402-2, 1000h", "masters fail", "add them, or mend 1000h"),
    ("lss-identity", "CiA 305", "the node cannot be selected", "1018h with four numbers, or 0"),
    ("boot-up-master", "CiA 302-2 1F80h", "it cannot be configured", "add 1F80h, or 0"),
    ("error-control", "CiA 301 7.2.8", "nobody notices that it is lost", "add 1017h"),
)
_NOTES: Final = (
    ("non-ascii", _PRACTICE, "other letters in other readers", "ASCII"),
    ("mixed-line-ends", _PRACTICE, "nothing", "one kind"),
    ("hash-comment", _PRACTICE, "it is a keyword for some", "begin with ;"),
    ("unknown-key", _PRACTICE, "tools skip it", "leave it, if it is the vendor's own"),
    ("unknown-section", _PRACTICE, "tools skip it", "leave it, if it is the vendor's own"),
    ("file-info-missing", _FILE_INFO, "tools show nothing", "add it"),
    ("file-info-form", _FILE_INFO, "tools show it as it is", "mm-dd-yyyy, hh:mmAM, EDSVersion=4.0"),
    ("file-name", _FILE_INFO, "people look for another file", "the name of the file"),
    ("name-empty", _OBJECT_KEYS, "tools show nothing", "give it a name"),
    ("pdo-mapping-missing", _OBJECT_KEYS, "it counts as 0", "add PDOMapping=0"),
    ("limit-type", _OBJECT_KEYS, "tools skip it", "limits are for numbers"),
    ("pdo-reserved", _PDO_PARAMETER, "conformance tests report it", "leave out sub-index 4"),
    ("profile-none", "CiA 301 7.5.2.1", "masters see no profile", "name the profile in 1000h"),
)

RULES: Final = rules_of(_ERRORS, _WARNINGS, _NOTES)
"""By name, errors first."""
