"""EDS and XDD files with chance in them: bytes, lines, sections, keys, values, cut off."""

from __future__ import annotations

import re
from functools import partial
from random import Random
from typing import Final

from tests.host.canopen.data_sheet.corpus import CORPUS, ROOT
from tests.mutators import damaged, with_line, with_piece
from tests.wire.canopen.eds.xdd_text import EDITOR, XDD
from tickrig.emulators.canopen.eds import describe
from tickrig.host.canopen.data_sheet.check import check, failing
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.fix import fix
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.host.canopen.data_sheet.show import diff, entries, head, pdos
from tickrig.wire.canopen.eds.eds_file import EdsError

HEAD: Final = (
    "[FileInfo]\nFileName=s.eds\n[DeviceInfo]\nVendorName=x\nBaudRate_125=1\nNrOfRXPDO=1\n"
    "[Comments]\nLines=1\nLine1=MaxBytes of 2001 is 64\n"
)
IDENTITY: Final = (
    "[1000]\nParameterName=Device type\nDataType=0x0007\nAccessType=ro\nDefaultValue=0x191\n"
    "[1001]\nParameterName=Error\nDataType=5\nAccessType=ro\nPDOMapping=1\n"
    "[1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n"
    "[1018sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n"
    "[1018sub1]\nParameterName=vendor\nDataType=7\nAccessType=ro\nDefaultValue=0x7\n"
)
PDO: Final = (
    "[1400]\nParameterName=RPDO\nObjectType=9\nSubNumber=3\n"
    "[1400sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=2\n"
    "[1400sub1]\nParameterName=id\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x200\n"
    "[1400sub2]\nParameterName=type\nDataType=5\nAccessType=rw\nDefaultValue=255\n"
    "[1600]\nParameterName=map\nObjectType=9\nDataType=7\nAccessType=rw\nCompactSubObj=8\n"
    "[1600Value]\nNrOfEntries=1\n1=0x20000010\n"
)
OWN: Final = (
    "[2000]\nParameterName=speed\nDataType=3\nAccessType=rww\nPDOMapping=1\nLowLimit=-5\n"
    "HighLimit=5\n[2001]\nParameterName=text\nDataType=9\nAccessType=rw\nDefaultValue=abc\n"
    "[2002]\nParameterName=real\nObjectType=8\nDataType=8\nAccessType=rw\nCompactSubObj=3\n"
    "[2002Name]\nNrOfEntries=1\n2=second\n"
)
LISTS: Final = (
    "[MandatoryObjects]\nSupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018\n",
    "[OptionalObjects]\nSupportedObjects=2\n1=0x1400\n2=0x1600\n",
    "[ManufacturerObjects]\nSupportedObjects=3\n1=0x2000\n2=0x2001\n3=0x2002\n",
)
MODULES: Final = (
    "[SupportedModules]\nNrOfEntries=1\n[M1ModuleInfo]\nProductName=x\n[M1FixedObjects]\n"
    "NrOfEntries=1\n1=0x6423\n[M1Fixed6423]\nParameterName=x\nDataType=1\nAccessType=rw\n"
    "[M1SubExtends]\nNrOfEntries=1\n1=0x6000\n[M1SubExt6000]\nParameterName=x\nDataType=5\n"
    "AccessType=ro\nCount=0;4\nObjExtend=3\n[ConnectedModules]\nNrOfEntries=2\n1=1\n2=1\n"
)
PARTS: Final = (LISTS[0] + IDENTITY, LISTS[1] + PDO, LISTS[2] + OWN)
SMALL: Final = HEAD + "".join((*LISTS, IDENTITY, PDO, OWN))
SMALL_ONES: Final = tuple(
    text.encode()
    for text in (SMALL, XDD, EDITOR, PARTS[0] + MODULES, *PARTS, *PARTS, PARTS[0] + PARTS[2], HEAD)
)
LARGE: Final = (
    (ROOT / "examples" / "io_module.eds").read_bytes(),
    *(each.data for each in CORPUS[::7]),
)
NAMES: Final = ("a.eds", "a.dcf", "a.xdd")

PIECES: Final = (
    *("[", "]", "=", ";", "#", "\n", "\r", "\r\n", "\x00", "\ufeff", "\u2028", "é", "€", " "),
    *("\t", "\x1a", '"', "0", "-", "+", "$NODEID", "sub", "<", ">", "&", "\ud800", "٣", "²"),
)
VALUES: Final = (
    *("", "0", "1", "-1", "2", "7", "8", "9", "255", "0xFF", "0xFFFFFFFF", "0xFFFFFFFFFFFFFFFFF"),
    *("0x10UL", "010", "0099", "0x", "0x 1 2", "1Ah", "1_0", "1e999", "nan", "inf", "-0", "1.5"),
    *("$NODEID", "$NODEID+0x180", "0x180+$NODEID", "$NODEID+$NODEID", "NODEID+", "+", "yes", "ro"),
    *("rw", "wo", "rwr", "const", "R", "€", "µ", "9" * 5_000, "0x" + "F" * 5_000, "x" * 300),
    *("20000010", "0x20000108", "0x00050008", "254", "٣", "²", "x ; y", "0x60400010"),
    *("0x07 # VAR", "7//x", "7;x", "#", "0x0102FF", "0x0", "-128", "0;4", "007", "0x6000", "50000"),
)
KEYS: Final = (
    *("ParameterName", "ObjectType", "DataType", "AccessType", "PDOMapping", "DefaultValue"),
    *("LowLimit", "HighLimit", "SubNumber", "CompactSubObj", "ParameterValue", "DefaultBytes"),
    *("MaxBytes", "Factor", "Unit", "SupportedObjects", "Lines", "NodeID", "Baudrate", "1", "2"),
    *("NrOfEntries", "CompactPDO", "NrOfTXPDO", "Granularity", "٣", "²", "", "01", "Line02"),
    *("Count", "ObjExtend"),
)
TITLES: Final = (
    *("1000", "1000sub0", "1018sub1", "1600", "1600sub1", "1600Value", "1A00", "1A00sub0", "2000"),
    *("2000sub1", "2000subFF", "2000SUB0A", "FFFF", "0005", "A0", "A0sub1", "DeviceInfo"),
    *("DeviceComissioning", "devicecommissioning", "FileInfo", "Comments", "DummyUsage", "Tools"),
    *("MandatoryObjects", "OptionalObjects", "ManufacturerObjects", "M1Comments", "x", " ", "1003"),
    *("SupportedModules", "ConnectedModules", "M1FixedObjects", "M1Fixed6000", "M1SubExtends"),
    *("M1SubExt6000", "M1Fixed6000sub1", "A0sub2", "1027", "1018sub0001"),
)
_VALUE: Final = re.compile(r"""(=)([^\n\r]*)|(")([^"]*)(?=")""")
_TITLE: Final = re.compile(r"\[[^\]\n]*\]|<[A-Za-z:]+")


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return a file with a few things done to it, and its name."""
    data = chance.choice(LARGE if chance.random() < 0.004 else SMALL_ONES)
    text = disturbed(data.decode("utf-8", "replace"), chance)
    return chance.choice(NAMES), _bytes(text, chance)


def disturbed(text: str, chance: Random) -> str:
    """Return the text of a file with a few things done to it."""
    for _ in range(chance.choice([1, 1, 2, 3, 8])):
        text = chance.choice(CHANGES)(text, chance)
    return text


def _bytes(text: str, chance: Random) -> bytes:
    match chance.randrange(20):
        case 0:
            return text.encode("utf-16", "replace")
        case 1:
            return text.encode("cp1252", "replace")
        case 2:
            return text.replace("\n", chance.choice(["\r", "\r\n"])).encode("utf-8", "replace")
    data = text.encode("utf-8", "surrogatepass" if chance.random() < 0.5 else "replace")
    return damaged(data, chance, chance.randrange(12))


def _value(text: str, chance: Random) -> str:
    found = list(_VALUE.finditer(text))
    if not found:
        return text
    one, other = chance.choice(found), chance.choice(found)
    at = one.start(2) if one[1] else one.start(4)
    new = chance.choice([chance.choice(VALUES), other[2] or other[4] or ""])
    return text[:at] + new + text[one.end() :]


def _key(text: str, chance: Random) -> str:
    lines = text.split("\n")
    line = f"{chance.choice(KEYS)}={chance.choice(VALUES)}"
    lines.insert(chance.randrange(len(lines) + 1), line)
    return "\n".join(lines)


def _title(text: str, chance: Random) -> str:
    found = list(_TITLE.finditer(text))
    if not found:
        return text
    one, other = chance.choice(found), chance.choice(found)
    new = chance.choice([other[0], f"[{chance.choice(TITLES)}]"])
    return text[: one.start()] + new + text[one.end() :]


def _section(text: str, chance: Random) -> str:
    """Tear the text at two titles, and put its parts together in another order."""
    places = sorted(match.start() for match in _TITLE.finditer(text))
    if len(places) < 2:
        return text
    first, second = sorted(chance.sample(places, 2))
    a, b, c = text[:first], text[first:second], text[second:]
    return chance.choice([a + c + b, a + b + b + c, a + c, b + a + c])


CHANGES: Final = (
    *(partial(with_piece, PIECES), with_line),
    *(_value, _value, _key, _title, _section),
)


def judge(name: str, data: bytes) -> str:
    """Check, mend, read, compare and show a file; AssertionError unless all goes well.

    Returns:
        `clean`, `mended`, `left` or `refused`.
    """
    document = Document(name, data)
    found = check(document)
    for one in found:
        assert 0 <= one.line <= max(len(document.texts), 1), one
        assert str(one).isprintable() or name not in str(one), one
    _read(document, found)
    fixed = fix(document)
    again = fix(fixed.document)
    assert (again.mended, again.document.data) == ((), fixed.document.data)
    assert again.left == fixed.left
    if not fixed.mended:
        assert fixed.document.data == data
    other = Document(name, data)
    assert diff(document, other) == []
    list(map(str, diff(document, fixed.document)))
    entries(document, None, None), head(document), pdos(document, 5)
    if document.file.errors:
        return "refused"
    return "left" if fixed.left else "mended" if fixed.mended else "clean"


def _read(document: Document, found: list[RuleFinding]) -> None:
    """Make a device of a file: what the reader refuses, the check has told as an error."""
    try:
        describe(document.file)
        refused: set[str] = set()
    except EdsError as error:
        refused = {one.rule for one in error.findings}
    assert refused <= {one.rule.name for one in failing(found)}
