"""Defects of SDO: expedited, segmented, several servers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tests.host.canopen.conform.defects.defect import (
    Bends,
    Defect,
    Plant,
    hears,
    refuses,
    says,
    unguarded,
)
from tickrig.device.canopen.dictionary import Entry
from tickrig.device.canopen.sdo import SdoLimits, SdoServers
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import RO, RW, Access, EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode

U8, U32 = DataType.UNSIGNED8, DataType.UNSIGNED32
TEXT, DOMAIN = DataType.VISIBLE_STRING, DataType.DOMAIN
NO_MULTIPLEXER: Final = "000000"


class Patient(SdoServers):
    """Waits for a client for ever."""

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot, SdoLimits(timeout_us=1 << 60))


class Open(SdoServers):
    """Lets its COB-IDs be written."""

    def start(self) -> None:
        super().start()
        self.node.dictionary[0x1200, 1].guard = None


def right_toggles(slave: CanopenSlave) -> Bends:
    """Take segments with any toggle bit."""
    due = [0]

    def hear(text: str) -> Iterable[str]:
        if not text.startswith("605#"):
            return (text,)
        command = int(text[4:6], 16)
        if command & 0xE0 in (0x20, 0x40):
            due[0] = 0
        elif command & 0xE0 in (0x00, 0x60):
            command = command & ~0x10 | due[0]
            due[0] ^= 0x10
        return (f"605#{command:02X}{text[6:]}",)

    return Bends(hear)


def takes_any_size(slave: CanopenSlave) -> Bends:
    """Take as many bytes as the object has, whatever comes."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#2") and int(text[4:6], 16) & 0x03 == 0x03:
            entry = slave.dictionary.find(int(text[8:10] + text[6:8], 16), int(text[10:12], 16))
            if entry is not None and 0 < entry.size <= 4:
                return (f"605#{0x23 | 4 - entry.size << 2:02X}{text[6:]}",)
        return (text,)

    return Bends(hear)


def answers_aborts(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        return (text, text.replace("605#80", "605#E0", 1)) if text[:6] == "605#80" else (text,)

    return Bends(hear)


def grows(slave: CanopenSlave) -> Bends:
    commands = [0]

    def hear(text: str) -> Iterable[str]:
        commands[0] += text.startswith("000#")
        return (text,)

    def say(text: str) -> Iterable[str]:
        long = commands[0] and text.startswith("585#4B1710")
        return (f"585#43{text[6:]}",) if long else (text,)

    return Bends(hear, say)


def flickers_shortly(slave: CanopenSlave) -> Bends:
    reads = [0]

    def say(text: str) -> Iterable[str]:
        if text.startswith("585#4B0910"):
            reads[0] += 1
            return (f"585#4B091000{reads[0] % 256:02X}310000",)
        return (text,)

    return Bends(say=say)


def flickers(slave: CanopenSlave) -> Bends:
    """Give another value each time that 64 bits are read."""
    reads = [0]

    def say(text: str) -> Iterable[str]:
        if text.startswith("585#41"):
            reads[0] += 1
        elif text.startswith("585#00"):
            return (f"585#00{reads[0]:02X}{text[8:]}",)
        return (text,)

    return Bends(say=say)


def clings_to_transfer(slave: CanopenSlave) -> Bends:
    """Refuse a new transfer while one runs."""
    running = [False]

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#40") and running[0]:
            return ("605#E0" + text[6:],)
        return (text,)

    def say(text: str) -> Iterable[str]:
        if text.startswith("585#41"):
            running[0] = True
        elif text.startswith(("585#80", "585#01", "585#11")):
            running[0] = False
        return (text,)

    return Bends(hear, say)


def forgets_end_of_domains(slave: CanopenSlave) -> Bends:
    entry = slave.dictionary[0x2008, 0]

    def cut(entry: Entry) -> None:
        entry.assign(entry.data[:889])

    entry.written = cut
    return Bends()


def cannot_end_server(slave: CanopenSlave) -> Bends:
    """Serve on after the second server was switched off."""
    server = SdoServers.of(slave).servers[1]

    def hear(text: str) -> Iterable[str]:
        if text.startswith("6A0#"):
            server.receive(CanFrame.parse(text))
        return (text,)

    return Bends(hear)


def row(  # noqa: PLR0913, PLR0917 - a row
    index: int,
    sub: int,
    kind: DataType,
    access: Access,
    default: Value | None = None,
    most: int = 1 << 30,
) -> EntryDescription:
    return EntryDescription(*(index, sub, "changed", kind, access), default=default, max_bytes=most)


def wrong_code(right: str, wrong: str) -> Plant:
    """Refuse with another code."""
    right, wrong = (bytes.fromhex(code)[::-1].hex().upper() for code in (right, wrong))
    return says(f"585#80(......){right}", rf"585#80\g<1>{wrong}")


DEFECTS: Final = (
    Defect("wrong size in upload", ("UE-02", "OD-1001.00-type"), says("585#4F(.*)", r"585#4B\1")),
    Defect("u32 is sent as 3 bytes", ("UE-01", "OD-1000.00-type"), says("585#43(.*)", r"585#47\1")),
    Defect("u16 is sent as 4 bytes", ("OD-1017.00-type", "UE-03"), says("585#4B(.*)", r"585#43\1")),
    Defect("1017h is sent as 4 bytes after an NMT command", ("UE-03",), grows),
    Defect("a short string is never the same", ("UE-04",), flickers_shortly, left=True),
    Defect(
        "short strings are sent in segments of one",
        ("UE-04", "OD-1009.00-type"),
        says("585#4B0910(.*)", r"585#430910\1"),
    ),
    Defect("absent object: wrong code", ("UE-06", "OD-absent"), wrong_code("06020000", "06090011")),
    Defect(
        "absent sub-index: wrong code",
        ("UE-08", "UE-07", "DE-10"),
        wrong_code("06090011", "06020000"),
    ),
    Defect(
        "sub-index of a variable is answered",
        ("UE-07", "OD-1000-subs"),
        rows=(row(0x1000, 1, U32, RO, 5),),
    ),
    Defect("hidden sub-index", ("UE-08", "OD-1018-subs"), rows=(row(0x1018, 5, U32, RO, 5),)),
    Defect("write-only is read", ("UE-09", "OD-2004.00-read"), rows=(row(0x2004, 0, U8, RW, 5),)),
    Defect("1200h lies", ("UE-11",), says("585#43001201.*", "585#4300120106060000")),
    Defect(
        *("short requests are answered", ("UE-12",)),
        hears("605#([0-9A-F]{2,14})", r"605#\g<1>00000000"),
        left=True,
    ),
    Defect("29-bit requests are answered", ("UE-13",), hears("00000605#(.*)", r"605#\1")),
    Defect("remote frames are requests", ("SG-07",), hears("605#R.*", "605#4000100000000000")),
    Defect(
        "high limit unchecked", ("DE-11", "OD-2006.00-high"), rows=(row(0x2006, 0, U8, RW, 16),)
    ),
    Defect(
        "wrong code beyond a limit",
        ("DE-11", "OD-2006.00-high"),
        wrong_code("06090031", "08000000"),
    ),
    Defect(
        "low limit: wrong code", ("DE-12", "OD-2006.00-low"), wrong_code("06090032", "06010000")
    ),
    Defect("limits themselves are refused", ("DE-13",), refuses(AbortCode.VALUE_RANGE, "2006:00")),
    Defect("read-only is written silently", ("DE-07",), rows=(row(0x1000, 0, U32, RW, 0xF0191),)),
    Defect("read-only: wrong code", ("DE-07", "DE-17"), wrong_code("06010002", "08000020")),
    Defect(
        "constant string is written",
        ("DE-08",),
        rows=(row(0x1008, 0, TEXT, RW, "reference slave"),),
    ),
    Defect("absent object is written", ("DE-09",), hears("605#2FFF[35]F(.*)", r"605#2F0020\1")),
    Defect("too long is taken", ("DE-05", "DE-06"), takes_any_size),
    Defect("too long: wrong code", ("DE-05",), wrong_code("06070012", "06090030")),
    Defect("too short: wrong code", ("DE-06",), wrong_code("06070013", "06090030")),
    Defect("no size is no download", ("DE-04",), hears("605#22(.*)", r"605#E0\1")),
    Defect("1003h:00 = 1 is accepted", ("DE-14",), unguarded("1003:00")),
    Defect(
        "1003h:00 = 0 is refused", ("DE-15", "EM-06"), refuses(AbortCode.VALUE_RANGE, "1003:00")
    ),
    Defect(
        *("1200h is written", ("DE-16",)),
        rows=(row(0x1200, 1, U32, RW, 0x605),),
        services={SdoServers: Open},
    ),
    Defect("u8 cannot be written", ("DE-01",), refuses(AbortCode.GENERAL, "2000:00", "100D:00")),
    Defect(
        "u16 cannot be written",
        ("DE-02",),
        refuses(AbortCode.GENERAL, "2001:00", "1015:00", "1017:00"),
    ),
    Defect("u32 cannot be written", ("DE-03",), refuses(AbortCode.GENERAL, "2002:00", "1007:00")),
    Defect(
        "download is answered with data",
        ("DE-01",),
        says("585#60(......)00000000", r"585#60\g<1>01000000"),
    ),
    Defect("toggle ignored", ("US-03", "DS-04", "DS-05"), right_toggles),
    Defect(
        "toggle stuck in upload", ("US-01", "OD-1008.00-type"), says("585#1(.{15})", r"585#0\1")
    ),
    Defect("toggle stuck in download", ("DS-12", "DS-02"), says("585#30(.*)", r"585#20\1")),
    Defect(
        "wrong size of a segmented upload",
        ("US-01",),
        says("585#41(......)0F(.*)", r"585#41\g<1>10\2"),
    ),
    Defect(
        "last segment is not marked",
        ("US-01", "US-02", "OD-1008.00-type"),
        says("585#([01])([13579BDF])(.*)", r"585#\g<1>0\3"),
    ),
    Defect(
        "segment without transfer is not answered",
        ("US-04", "DS-09", "US-05"),
        says("585#8000000001000405"),
    ),
    Defect("abort is answered", ("US-06", "SG-02", "DS-10", "BU-12"), answers_aborts),
    Defect("no new transfer while one runs", ("US-07",), clings_to_transfer, left=True),
    Defect("no SDO time-out", ("US-08",), services={SdoServers: Patient}, left=True),
    Defect("long domains are cut", ("US-09", "BD-10", "BU-11"), forgets_end_of_domains, left=True),
    Defect("announced size is ignored", ("DS-07", "DS-06"), hears("605#21(.*)", r"605#20\1")),
    Defect("no download without size", ("DS-03",), hears("605#20(.*)", r"605#E0\1")),
    Defect(
        "read-only refused at the end only", ("DS-08",), rows=(row(0x1000, 0, U32, RW, 0xF0191),)
    ),
    Defect(
        "strings of any length",
        ("DS-11",),
        hears("605#21(......)0000007F", r"605#21\g<1>10000000"),
        rows=(row(0x2007, 0, TEXT, RW, "short", 5000),),
        left=True,
    ),
    Defect("unknown command is not answered", ("SG-01",), hears("605#E0.*")),
    Defect("wrong code for an unknown command", ("SG-01",), wrong_code("05040001", "08000000")),
    Defect("second server does not serve", ("SG-03", "SG-04"), hears("6A0#.*")),
    Defect("second server cannot be ended", ("SG-05",), cannot_end_server),
    Defect("second server takes any CAN-ID", ("SG-06",), unguarded("1201:01", "1201:02")),
    Defect("strings are not written", ("DE-18", "DS-02"), refuses(AbortCode.GENERAL, "2007:00")),
    Defect("no segmented download", ("DS-01", "DS-02"), hears("605#2[01](.*)", r"605#E0\1")),
    Defect("no error: wrong code", ("UE-10",), wrong_code("08000024", "08000022")),
    Defect(
        "the highest sub-index is wrong", ("UE-05",), says("585#4F181000.*", "585#4F18100005000000")
    ),
    Defect("other initial values", ("UE-14", "US-02"), flickers),
)
