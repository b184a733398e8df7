"""The deviations of real files, each made of a good EDS.

A row says how it is made, which rule has to report it, what the reader has to make of it, and
whether `fix` mends it. Every rule has one.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from tests.wire.canopen.eds.xdd_text import XDD
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.wire.canopen.datatypes import DataType

ROOT: Final = Path(__file__).parents[4]
GOOD: Final = (ROOT / "tests" / "golden" / "canopen" / "r1.eds").read_text("utf-8")
DRIVE: Final = (ROOT / "examples" / "eds" / "epos.eds").read_text("utf-8")
NAME: Final = "reference-slave-r1.eds"


class Deviation(NamedTuple):
    """One row.

    Attributes:
        rule: that reports it.
        make: the file, of the good one.
        mended: `fix` mends it, so that nothing is left.
        reads: what is so of the document; None where it is read as the good one.
        name: what the file is called.
        keeps: what still stands in it when it is mended.
    """

    rule: str
    make: Callable[[str], str | bytes]
    mended: bool = True
    reads: Callable[[Document], bool] | None = None
    name: str = NAME
    keeps: tuple[str, ...] = ()

    @property
    def data(self) -> bytes:
        """The file."""
        made = self.make(GOOD)
        return made if isinstance(made, bytes) else made.encode()


Change = Callable[[str], str]


def put(old: str, new: str) -> Change:
    """Replace the first place of a text, which has to be there."""

    def change(text: str) -> str:
        assert old in text, old
        return text.replace(old, new, 1)

    return change


def coded(page: str, old: str, new: str) -> Callable[[str], bytes]:
    """Replace a text, and write it all in a code page."""
    return lambda text: put(old, new)(text).encode(page)


def within(section: str, old: str, new: str) -> Change:
    """Replace a text within a section."""

    def change(text: str) -> str:
        head, title, rest = text.partition(f"[{section}]\n")
        block, blank, tail = rest.partition("\n[")
        assert title, section
        assert old in block, (section, old)
        return f"{head}{title}{block.replace(old, new, 1)}{blank}{tail}"

    return change


def put_in(section: str, *lines: str) -> Change:
    """Add lines to the beginning of a section."""
    return put(f"[{section}]\n", "\n".join((f"[{section}]", *lines, "")))


def out(section: str, key: str) -> Change:
    """Take a keyword out of a section."""

    def change(text: str) -> str:
        head, title, rest = text.partition(f"[{section}]\n")
        block, blank, tail = rest.partition("\n[")
        assert f"{key}=" in block, (section, key)
        left = re.sub(rf"{key}=.*\n?", "", block, count=1)
        return f"{head}{title}{left}{blank}{tail}"

    return change


def without(section: str) -> Change:
    """Take a section out."""
    return lambda text: re.sub(rf"\[{section}\]\n[^\[]*", "", text, count=1)


def without_object(index: str) -> Change:
    """Take an object out, with all of its sections."""
    return lambda text: re.sub(rf"\[{index}(sub.)?\]\n[^\[]*", "", text)


def cut_in(text: str) -> Change:
    """End the file within a text."""
    return lambda whole: whole[: whole.index(text) + 9]


def in_xdd(old: str, new: str) -> Change:
    """Make an XDD instead, with one text replaced."""
    return lambda _: put(old, new)(XDD)


def all_of(*changes: Change) -> Change:
    """Do one after the other."""

    def change(text: str) -> str:
        for each in changes:
            text = each(text)
        return text

    return change


def section(title: str, *lines: str) -> Change:
    """Add a section to the end."""
    return lambda text: "\n".join((text.rstrip("\n"), "", f"[{title}]", *lines, ""))


def entry(index: int, sub: int, **fields: object) -> Callable[[Document], bool]:
    """Ask whether an entry has these fields."""

    def holds(document: Document) -> bool:
        row = document.rows[index, sub]
        return {name: getattr(row, name) for name in fields} == fields

    return holds


def lacks(index: int, sub: int = 0) -> Callable[[Document], bool]:
    """Ask whether an entry is not there."""
    return lambda document: (index, sub) not in document.rows


def anything(document: Document) -> bool:
    """Ask nothing."""
    return True


COMPACT: Final = """
ParameterName=TPDO3 map
ObjectType=0x9
DataType=0x0007
AccessType=rw
PDOMapping=0
CompactSubObj=8
"""


def compact(text: str) -> str:
    """Write a mapping record in the compact way."""
    head, _, rest = text.partition("[1A02]\n")
    return f"{head}[1A02]{COMPACT}\n{rest[rest.index('[1A03]') :]}"


COUNTED: Final = put_in("DeviceInfo", "CompactPDO=0x37")
"""PDOs that are not described are implied."""


def counted_only(text: str) -> str:
    """Take the fourth RPDO and TPDO out of the good file, and out of its list, and count them."""
    for index in ("1403", "1603", "1803", "1A03"):
        text = without_object(index)(re.sub(rf"\d+=0x{index}\n", "", text))
    lines = iter(range(1, 1_000))
    head, title, rest = text.partition("[OptionalObjects]\n")
    block, blank, tail = rest.partition("\n[")
    listed = re.sub(r"\d+=0x", lambda _: f"{next(lines)}=0x", block)
    count = f"SupportedObjects={next(lines) - 1}"
    return COUNTED(f"{head}{title}{re.sub('SupportedObjects=.*', count, listed)}{blank}{tail}")


def without_pdo(number: str) -> Change:
    """Take an RPDO out, and out of its list: only the count tells that there was one."""

    def change(text: str) -> str:
        for index in (f"140{number}", f"160{number}"):
            text = without_object(index)(text)
            listed = re.search(rf"([0-9]+)=0x{index}\n", text)
            assert listed is not None
            at, last = int(listed[1]), int(re.findall(r"Objects=([0-9]+)", text)[1])
            text = text.replace(listed[0], "", 1).replace(f"Objects={last}", f"Objects={last - 1}")
            for follows in range(at + 1, last + 1):
                text = re.sub(rf"(?m)^{follows}=0x1", f"{follows - 1}=0x1", text, count=0)
        return text

    return change


def doubled(text: str) -> str:
    """Tear a section in two."""
    torn = out("1017", "AccessType")(text)
    return section("1017", "AccessType=rw", "DataType=0x0006")(torn)


LONG: Final = "x" * 300
RPDO_OBJECT: Final = "DefaultValue=0x62000108"
COB_ID: Final = "DefaultValue=$NODEID+0x200"

CORPUS: Final = (
    # bytes
    Deviation("utf-16", lambda text: text.encode("utf-16")),
    Deviation("utf-16", lambda text: text.encode("utf-16-be")),
    Deviation("bom", lambda text: f"\ufeff{text}"),
    Deviation(
        "bom",
        lambda text: b"\xef\xbb\xbf" + put("u8 w", "µ8 w")(text).encode("cp1252"),
        True,
        anything,
    ),
    Deviation("line-ends", lambda text: text.replace("\n", "\r")),
    Deviation("mixed-line-ends", put("\n[DeviceInfo]\n", "\r\n[DeviceInfo]\r\n")),
    Deviation("control-character", put("=Device type", "=Device\x00\x07 type"), True, anything),
    Deviation("non-ascii", lambda text: put("u8 w", "µ8 w")(text).encode("cp1252"), True, anything),
    Deviation("non-ascii", put("=u8 write", "=µ8 write"), True, anything),
    *(
        Deviation(
            "not-utf-8",
            coded(page, "u8 write", "u8 für Öl"),
            True,
            entry(0x2004, 0, name="u8 für Öl only"),
            keeps=("u8 für Öl only",),
        )
        for page in ("cp1252", "cp850")
    ),
    # lines
    Deviation("no-keyword", put("AccessType=ro\n", "AccessType=ro\nAccess type is ro\n")),
    Deviation("no-keyword", put("AccessType=ro\n", "AccessType=ro\n=ro\n")),
    Deviation("no-keyword", put("[FileInfo]\n", "hello\nFileName=x\n[FileInfo]\n")),
    Deviation("no-keyword", lambda text: f"x{text}", False, anything),
    Deviation("no-keyword", put("[Comments]\n", "[Comments]\nfree text\n")),
    Deviation("doubled-section", doubled),
    Deviation("doubled-section", section("1017", "AccessType=ro"), False),
    Deviation("doubled-section", section("1017", "DataType=0x0006", "AccessType=ro"), False),
    Deviation("doubled-section", section("DummyUsage", "Dummy0001=1", "Dummy0010=1")),
    Deviation("doubled-key", put_in("1017", "AccessType=rw", "DataType=0x0006")),
    Deviation(
        "doubled-key", within("1017", "AccessType=rw", "AccessType=rw\naccesstype=ro"), False
    ),
    Deviation("doubled-key", put_in("FileInfo", "FileVersion=1")),
    Deviation("section-form", put("[1018sub1]", "[1018SUB01]")),
    *(
        Deviation("section-form", put("[1018sub1]", title))
        for title in ("[1018 sub 1]", "[ 1018 Sub1 ]", "[1018_sub_01]", "[0x1018sub1]")
    ),
    Deviation("section-form", put("[DeviceInfo]", "[deviceinfo]")),
    Deviation("section-form", put("[1017]", "[1017] heartbeat")),
    Deviation("inline-comment", within("1017", "AccessType=rw", "AccessType=rw   ; or ro?")),
    *(
        Deviation("inline-comment", within(place, text, f"{text}{remark}"), keeps=(f"\n{text}\n",))
        for place, text, remark in (
            ("1017", "DataType=0x0006", " # UNSIGNED16"),
            ("1017", "ObjectType=0x7", " // VAR"),
            ("1017", "AccessType=rw", " # rw;"),
            ("1018", "SubNumber=5", "//five"),
            ("2006", "DefaultValue=0x10", ";16"),
            ("1400sub1", "DefaultValue=$NODEID+0x200", "#RPDO1"),
            ("200A", "DefaultValue=0", " # V"),
            ("DeviceInfo", "VendorNumber=0x0000AB01", " #"),
            ("OptionalObjects", "1=0x1003", "// errors"),
            ("MandatoryObjects", "SupportedObjects=3", " # three"),
            ("DummyUsage", "Dummy0001=1", ";BOOLEAN"),
            ("Comments", "Lines=2", " # two"),
        )
    ),
    Deviation("hash-comment", put("[1017]\n", "# heartbeat\n[1017]\n")),
    Deviation("key-case", put("NrOfRXPDO", "NrOfRxPDO")),
    Deviation("unknown-key", put_in("1017", "Colour=blue")),
    Deviation("unknown-section", section("Vendor", "Colour=blue")),
    # head
    Deviation("section-missing", without("DeviceInfo"), False),
    Deviation("section-missing", without("MandatoryObjects")),
    Deviation("file-info-missing", out("FileInfo", "CreatedBy")),
    Deviation("file-info-form", put("CreationDate=01-01-1970", "CreationDate=1970-01-01")),
    Deviation("file-info-form", put("FileRevision=1", "FileRevision=01")),
    Deviation("file-name", put("FileName=reference-slave-r1.eds", "FileName=other.eds")),
    Deviation("device-info-missing", out("DeviceInfo", "OrderCode")),
    Deviation("device-info-missing", out("DeviceInfo", "GroupMessaging")),
    Deviation(
        "device-info-missing",
        out("DeviceInfo", "ProductNumber"),
        keeps=("ProductNumber=0x00000002",),
    ),
    Deviation("bit-rate-none", lambda text: re.sub(r"(BaudRate_\d+)=1", r"\1=0", text), False),
    Deviation("granularity", put("Granularity=1", "Granularity=65"), False),
    Deviation("flag", put("SimpleBootUpSlave=1", "SimpleBootUpSlave=2"), False),
    Deviation("pdo-count", put("NrOfRXPDO=4", "NrOfRXPDO=8")),
    Deviation(
        "pdo-count", without_object("1403"), False, lacks(0x1403), keeps=("NrOfRXPDO=4", "=0x1403")
    ),
    Deviation("pdo-count", all_of(COUNTED, put("NrOfRXPDO=4", "NrOfRXPDO=3"))),
    Deviation(
        "pdo-count",
        all_of(*(without_pdo(number) for number in ("0", "1", "2", "3"))),
        False,
        lacks(0x1403),
        keeps=("NrOfRXPDO=4",),
    ),
    Deviation(
        "pdo-count",
        all_of(counted_only, put("NrOfTXPDO=4", "NrOfTXPDO=513")),
        True,
        entry(0x19FF, 1, default=b"\0\0\0\x80"),
    ),
    Deviation("compact-pdo", put_in("DeviceInfo", "CompactPDO=0x3C"), False),
    Deviation("compact-pdo", put_in("DeviceInfo", "CompactPDO=0xFF"), False),
    Deviation(
        "compact-pdo",
        all_of(COUNTED, put("NrOfRXPDO=4", "NrOfRXPDO=0"), put("NrOfTXPDO=4", "NrOfTXPDO=0")),
    ),
    Deviation("empty-value", put_in("DeviceInfo", "CompactPDO=")),
    Deviation(
        "identity", all_of(COUNTED, put("ProductNumber=0x00000002", "ProductNumber=3")), False
    ),
    Deviation("identity", put("ProductNumber=0x00000002", "ProductNumber=3"), False),
    Deviation("dynamic-channels", put("ChannelsSupported=0", "ChannelsSupported=2"), False),
    Deviation("boot-up-master", put("UpMaster=0", "UpMaster=1"), False),
    Deviation("lss-identity", without("1018sub4"), False, lacks(0x1018, 4)),
    Deviation("dummy-usage", put("Dummy0001=1", "Dummy0001=yes"), False),
    Deviation("dummy-usage", put("Dummy0001=1", "Dummy0100=1"), False),
    Deviation("dummy-usage", put("Dummy0001=1\n", "")),
    Deviation("empty-value", put("ProductNumber=0x00000002", "ProductNumber=")),
    Deviation("comment-lines", put("Lines=2", "Lines=7")),
    Deviation("comment-lines", put("Line2=", "Line3="), False),
    Deviation("key-case", put("Line2=", "line2=")),
    Deviation("commissioning-missing", lambda text: text, False, None, "r1.dcf"),
    Deviation(
        "dcf-key", put_in("1017", "ParameterValue=5"), False, entry(0x1017, 0, default=b"\5\0")
    ),
    Deviation("dcf-section", section("DeviceComissioning", "NodeID=5"), False),
    Deviation(
        "bit-rate-unit",
        section("DeviceComissioning", "NodeID=5", "Baudrate=500000"),
        True,
        lambda document: document.device.bit_rate == 500_000,
        "r1.dcf",
        ("Baudrate=500\n",),
    ),
    Deviation(
        "bit-rate-unit",
        section("DeviceComissioning", "NodeID=5", "Baudrate=5000"),
        False,
        lambda document: document.device.bit_rate is None,
        "r1.dcf",
    ),
    Deviation("modules", section("SupportedModules", "NrOfEntries=2"), False),
    Deviation("node-id", section("DeviceCommissioning", "NodeID=128"), False, None, "r1.dcf"),
    # lists
    Deviation("list-count", put("SupportedObjects=12", "SupportedObjects=11")),
    Deviation("list-count", put("SupportedObjects=12\n", "")),
    Deviation(
        "list-count",
        all_of(put("12=0x200C\n", ""), without_object("200C")),
        False,
        lacks(0x200C, 1),
        keeps=("SupportedObjects=12",),
    ),
    Deviation("list-gap", put("12=0x200C", "14=0x200C")),
    Deviation("list-missing", put("12=0x200C\n", "")),
    Deviation("list-missing", without("ManufacturerObjects")),
    Deviation(
        "list-extra",
        put("SupportedObjects=12\n", "SupportedObjects=13\n13=0x2FFF\n"),
        False,
        keeps=("=13\n13=0x2FFF\n",),
    ),
    Deviation(
        "list-extra",
        all_of(put("12=0x200C\n", "12=0x200C\n12=0x2FFF\n"), put("1=0x1003", "1=0x2000")),
        False,
        keeps=("0x2FFF\n",),
    ),
    Deviation("list-entry", put("12=0x200C", "12=bits")),
    Deviation("list-wrong", put("1=0x1003", "1=0x2000")),
    Deviation("list-doubled", put("12=0x200C", "12=0x2000")),
    # objects
    Deviation("object-type", within("1018", "ObjectType=0x9", "ObjectType=0x7")),
    Deviation("object-type", within("1017", "ObjectType=0x7", "ObjectType=3"), False),
    Deviation("object-type-missing", out("1018", "ObjectType")),
    Deviation(
        "data-type-missing",
        out("2009", "DataType"),
        False,
        entry(0x2009, 0, data_type=DataType.DOMAIN),
    ),
    Deviation("data-type-missing", out("1017", "DataType"), keeps=("DataType=0x0006",)),
    Deviation("data-type-missing", out("1A00sub1", "DataType")),
    Deviation(
        "data-type-derived",
        all_of(
            within("2006", "DataType=0x0005", "DataType=0x00A0"),
            section("A0sub1", "ParameterName=Type", "DefaultValue=0x05"),
        ),
        False,
    ),
    Deviation("data-type-missing", out("1018sub0", "DataType")),
    Deviation(
        "data-type-unknown",
        within("2000", "DataType=0x0005", "DataType=0x0040"),
        False,
        entry(0x2000, 0, data_type=DataType.DOMAIN),
    ),
    Deviation("access-missing", out("1017", "AccessType"), False),
    Deviation("access-form", within("1017", "AccessType=rw", "AccessType=read"), False),
    Deviation("access-form", within("2004", "AccessType=wo", "AccessType=W")),
    Deviation("access-form", within("1017", "AccessType=rw", "AccessType="), False),
    Deviation("name-missing", out("1017", "ParameterName"), False, entry(0x1017, 0, name="")),
    Deviation(
        "name-empty", within("1017", "Producer heartbeat time", ""), True, entry(0x1017, 0, name="")
    ),
    Deviation("name-length", within("1017", "Producer", LONG), False, anything),
    Deviation("empty-value", within("1017", "PDOMapping=0", "PDOMapping=")),
    Deviation(
        "empty-value",
        within("2009", "DataType=0x0003", "DataType="),
        False,
        entry(0x2009, 0, data_type=DataType.DOMAIN),
    ),
    Deviation("empty-value", within("1017", "DataType=0x0006", "DataType=")),
    Deviation("number-word", within("2005", "PDOMapping=1", "PDOMapping=yes")),
    Deviation("number-word", within("1017", "DataType=0x0006", "DataType=UNSIGNED16")),
    Deviation("number-word", within("1018", "ObjectType=0x9", "ObjectType=record")),
    Deviation("no-number", within("1017", "PDOMapping=0", "PDOMapping=off"), False),
    Deviation("pdo-mapping-missing", out("1017", "PDOMapping")),
    Deviation("sub-number", within("1018", "SubNumber=5", "SubNumber=4")),
    *(
        Deviation(
            "sub-number", without(f"1018sub{sub}"), False, lacks(0x1018, sub), keeps=("=5\n",)
        )
        for sub in (1, 2, 4)
    ),
    Deviation("sub-number", within("1018", "SubNumber=5", "SubNumber=6")),
    Deviation("sub-number", out("1018", "SubNumber")),
    Deviation("sub-number", put_in("1017", "SubNumber=1")),
    Deviation(
        "sub-orphan",
        section("2FFFsub1", "ParameterName=x", "DataType=5", "AccessType=rw"),
        False,
        entry(0x2FFF, 1, name="x"),
    ),
    Deviation(
        "sub0-missing",
        all_of(without("1018sub0"), put("SubNumber=5", "SubNumber=4")),
        False,
        lacks(0x1018),
    ),
    Deviation(
        "sub0-type",
        within("1018sub0", "DataType=0x0005", "DataType=0x0006"),
        False,
        entry(0x1018, 0, data_type=DataType.UNSIGNED16),
    ),
    Deviation("value-place", put_in("1018", "ParameterValue=5"), False),
    Deviation(
        "sub0-value",
        within("1018sub0", "DefaultValue=0x04", "DefaultValue=5"),
        False,
        entry(0x1018, 0, default=b"\5"),
        keeps=("DefaultValue=5",),
    ),
    Deviation(
        "sub0-value",
        within("1018sub0", "DefaultValue=0x04", "DefaultValue=3"),
        True,
        entry(0x1018, 0, default=b"\3"),
    ),
    Deviation("compact-record", compact, True, entry(0x1A02, 8, default=bytes(4))),
    Deviation("limit-type", put_in("1008", "LowLimit=1")),
    # values
    Deviation("number-form", within("1018sub1", "0x0000AB01", "0x0000AB01UL")),
    Deviation("number-form", within("1018sub1", "0x0000AB01", "0x 0000 AB01")),
    Deviation("number-form", within("1018sub1", "0x0000AB01", "0AB01h")),
    Deviation("number-form", within("1018sub1", "0x0000AB01", "+0x0000AB01")),
    Deviation("number-form", within("1018sub1", "0x0000AB01", "+43777")),
    Deviation("number-form", within("1018sub1", "0x0000AB01", "43777.0")),
    Deviation(
        "number-form", within("2006", "0x10", "0018"), True, entry(0x2006, 0, default=b"\x12")
    ),
    Deviation("leading-zero", within("2006", "DefaultValue=0x10", "DefaultValue=020"), False),
    Deviation("leading-zero", within("1018sub0", "DefaultValue=0x04", "DefaultValue=04")),
    Deviation("leading-zero", put("ProductNumber=0x00000002", "ProductNumber=002")),
    Deviation("leading-zero", put("ProductNumber=0x00000002", "ProductNumber=010"), False),
    Deviation("leading-zero", put("NrOfRXPDO=4", "NrOfRXPDO=04")),
    Deviation("leading-zero", put("BaudRate_125=1", "BaudRate_125=01")),
    Deviation("leading-zero", put("Lines=2", "Lines=02")),
    Deviation("leading-zero", put("Line2=", "Line02="), True, entry(0x2008, 0, max_bytes=20_000)),
    Deviation("leading-zero", put("Dummy0001=1", "Dummy0001=01")),
    Deviation("leading-zero", put("SupportedObjects=3\n", "SupportedObjects=03\n")),
    Deviation("leading-zero", put("\n1=0x1003", "\n01=0x1003")),
    Deviation("leading-zero", within("1018", "SubNumber=5", "SubNumber=05")),
    Deviation("leading-zero", put_in("2009", "HighLimit=07"), True, entry(0x2009, 0, high=7)),
    Deviation(
        "leading-zero",
        section("DeviceComissioning", "NodeID=05", "Baudrate=0125"),
        False,
        None,
        "r1.dcf",
    ),
    Deviation("leading-zero", put(COB_ID, "DefaultValue=$NODEID+01000"), False),
    Deviation(
        "value-sign",
        within("2000", "DefaultValue=0x00", "DefaultValue=-1"),
        True,
        entry(0x2000, 0, default=b"\xff"),
        keeps=("DefaultValue=0xFF",),
    ),
    Deviation(
        "value-sign",
        within("2009", "DefaultValue=0", "DefaultValue=0xFFFFFFFE"),
        True,
        entry(0x2009, 0, default=b"\xfe\xff"),
        keeps=("DefaultValue=-2",),
    ),
    Deviation("value-sign", put_in("2000", "HighLimit=-1"), True, entry(0x2000, 0, high=255)),
    Deviation(
        "byte-form",
        within("2008", "DefaultValue=", "DefaultValue=0x0102FF"),
        True,
        entry(0x2008, 0, default=b"\1\2\xff"),
        keeps=("DefaultValue=0102FF",),
    ),
    Deviation(
        "byte-form",
        within("2008", "DefaultValue=", "DefaultValue=0x0"),
        True,
        entry(0x2008, 0, default=b"\0"),
        keeps=("DefaultValue=00",),
    ),
    Deviation(
        "byte-form",
        within("2008", "DefaultValue=", "DefaultValue=0x1, 0xFF"),
        True,
        entry(0x2008, 0, default=b"\1\xff"),
        keeps=("DefaultValue=01FF",),
    ),
    Deviation(
        "byte-form",
        within("2008", "DefaultValue=", "DefaultValue=0102 # two"),
        False,
        entry(0x2008, 0, default=b"\1\2"),
        keeps=("DefaultValue=0102 # two",),
    ),
    Deviation(
        "byte-form",
        within("2008", "DefaultValue=", "DefaultValue=0x or more"),
        False,
        entry(0x2008, 0, default=b"0x or more"),
        keeps=("DefaultValue=0x or more",),
    ),
    Deviation(
        "byte-form",
        within("2008", "DefaultValue=", "DefaultValue=hello"),
        False,
        entry(0x2008, 0, default=b"hello"),
    ),
    Deviation("nodeid-form", put(COB_ID, "DefaultValue=0x200+$NODEID")),
    Deviation("nodeid-form", put(COB_ID, "DefaultValue=$nodeid+0x200")),
    Deviation("nodeid-form", put(COB_ID, "DefaultValue=NODEID + 512")),
    Deviation(
        "default-value",
        put("0x0000AB01\n\n", "0x10000AB01\n\n"),
        False,
        entry(0x1018, 1, has_default=False),
    ),
    Deviation(
        "default-value",
        within("2000", "DefaultValue=0x00", "DefaultValue=none"),
        False,
        entry(0x2000, 0, has_default=False),
    ),
    Deviation(
        "default-limits",
        within("2006", "DefaultValue=0x10", "DefaultValue=9"),
        False,
        entry(0x2006, 0, default=b"\t"),
    ),
    Deviation(
        "limit-order",
        within("2006", "LowLimit=16", "LowLimit=48"),
        False,
        entry(0x2006, 0, low=None, high=None),
    ),
    Deviation("limit-value", put_in("1017", "LowLimit=none"), False),
    Deviation(
        "limit-value", put_in("1017", "LowLimit=$NODEID+1"), False, entry(0x1017, 0, low=None)
    ),
    Deviation(
        "limit-range", put_in("1017", "HighLimit=65536"), False, entry(0x1017, 0, high=65536)
    ),
    Deviation(
        "boolean-value",
        within("200Csub1", "DefaultValue=0", "DefaultValue=0xFF"),
        False,
        entry(0x200C, 1, default=b"\1"),
    ),
    Deviation("text-value", within("1008", "reference slave", "Sklave für 5 °C"), False, anything),
    Deviation("factor", put_in("1017", "Factor=0"), False),
    # PDOs
    Deviation("cob-id-range", put(COB_ID, "DefaultValue=$NODEID+0x7FF"), False, anything),
    Deviation("cob-id-restricted", put(COB_ID, "DefaultValue=0x180"), False, anything),
    Deviation("sdo-server", within("1200sub2", "+0x580", "+0x5C0"), False, anything),
    Deviation("cob-id-restricted", within("1005", "=0x00000080", "=0"), False, anything),
    Deviation("cob-id-unique", put(COB_ID, "DefaultValue=$NODEID+0x300"), False, anything),
    Deviation(
        "pdo-half", lambda text: re.sub(r"\[1603(sub.)?\]\n[^\[]*", "", text), False, lacks(0x1603)
    ),
    Deviation(
        "pdo-reserved",
        lambda text: (
            text + "\n[1800sub4]\nParameterName=reserved\nObjectType=7\nDataType=5\n"
            "AccessType=rw\nDefaultValue=0\nPDOMapping=0\n"
        ),
        False,
        entry(0x1800, 4, default=b"\0"),
    ),
    Deviation(
        "pdo-reserved",
        all_of(counted_only, put("CompactPDO=0x37", "CompactPDO=0x3F")),
        False,
        entry(0x1803, 4, default=b"\0"),
    ),
    Deviation(
        "mapping-count", within("1A00sub0", "DefaultValue=0x02", "DefaultValue=9"), False, anything
    ),
    Deviation(
        "mapping-count", within("1A00sub0", "DefaultValue=0x02", "DefaultValue=99"), False, anything
    ),
    Deviation("pdo-length", all_of(put(RPDO_OBJECT, "DefaultValue=0x20030040")), False, anything),
    Deviation("mapped-missing", put(RPDO_OBJECT, "DefaultValue=0x62000908"), False, anything),
    Deviation("mapped-length", put(RPDO_OBJECT, "DefaultValue=0x62000110"), False, anything),
    Deviation("mapped-mappable", put(RPDO_OBJECT, "DefaultValue=0x20060008"), False, anything),
    Deviation("mapped-direction", put(RPDO_OBJECT, "DefaultValue=0x20050008"), False, anything),
    # standards
    Deviation("mandatory-missing", without("1001"), False, lacks(0x1001)),
    Deviation("mandatory-missing", without("1018sub1"), False, lacks(0x1018, 1)),
    Deviation("error-control", all_of(without("1017"), without("100C")), False, lacks(0x1017)),
    Deviation("communication-type", within("1017", "0x0006", "0x0007"), False, anything),
    Deviation(
        "communication-kind",
        all_of(
            without("1010sub0"),
            without("1010sub1"),
            within(
                "1010",
                "ObjectType=0x8\nSubNumber=2",
                "ObjectType=7\nDataType=7\nAccessType=rw\nPDOMapping=0",
            ),
        ),
        False,
        anything,
    ),
    Deviation(
        "communication-access", within("1000", "AccessType=ro", "AccessType=rw"), False, anything
    ),
    Deviation(
        "communication-access", within("1017", "AccessType=rw", "AccessType=wo"), False, anything
    ),
    Deviation("profile-objects", put("0x000F0191", "0x00020192"), False, anything),
    Deviation(
        "profile-objects",
        lambda _: re.sub(r"\[6041\]\n[^\[]*", "", DRIVE),
        False,
        anything,
        "epos.eds",
    ),
    Deviation(
        "device-type-missing",
        within("1000", "DefaultValue=0x000F0191", "DefaultValue="),
        False,
        entry(0x1000, 0, has_default=False),
    ),
    Deviation("profile-none", put("0x000F0191", "0"), True, anything),
    # what is cut off
    *(
        Deviation("truncated", cut_in(at), False, anything)
        for at in (
            "\n5=0x1008",
            "[1001]\nPar",
            "[1018sub2]\n",
            "[1400]\nPar",
            "[1A02sub0]\n",
            "[200Csub2]\n",
        )
    ),
    # what is no device
    Deviation("no-objects", lambda _: "[DeviceInfo]\n", False, anything),
    Deviation("no-objects", lambda _: "", False, anything),
    Deviation("xml", lambda _: "<a/>", False, anything, "a.xdd"),
    *(
        Deviation("object-index", in_xdd(*new), False, anything, "a.xdd")
        for new in (
            ('index="2001"', 'index="60G0"'),
            ('index="2001"', 'index="70000"'),
            ('index="2001"', 'index=""'),
        )
    ),
    Deviation(
        "xml", lambda _: XDD.replace("<ISO", "<!DOCTYPE x><ISO", 1), False, anything, "a.xdd"
    ),
)
