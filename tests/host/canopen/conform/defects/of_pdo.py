"""Defects of PDOs: their parameters, their mapping, when they go over the bus."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tests.host.canopen.conform.defects.defect import (
    Bends,
    Defect,
    Plant,
    acts_as,
    hears,
    refuses,
    says,
    together,
    tolerant,
    unguarded,
)
from tickrig.device.canopen.dictionary import Entry
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import RW, Access, EntryDescription
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode

BOTH: Final = Access.TPDO | Access.RPDO
INVALID: Final = 1 << 31
PDOS: Final = range(4)
EVENT_DRIVEN: Final = (254, 255)

RPDO_IDS: Final = tuple(f"{0x1400 + n:04X}:01" for n in PDOS)
TPDO_IDS: Final = tuple(f"{0x1800 + n:04X}:01" for n in PDOS)
COUNTS: Final = tuple(f"{base + n:04X}:00" for base in (0x1600, 0x1A00) for n in PDOS)
PLACES: Final = tuple(
    f"{base + n:04X}:{sub:02X}" for base in (0x1600, 0x1A00) for n in PDOS for sub in range(1, 9)
)


def row(index: int, kind: DataType, access: Access, default: int = 0) -> EntryDescription:
    return EntryDescription(index, 0, "changed", kind, access, default=default)


def all_act_as(base: int, sub: int, value: dict[int, int] | int) -> Plant:
    """Let PDOs act as if a parameter had another value: one for all, or some for others."""

    def other(number: int) -> int:
        return value if isinstance(value, int) else value.get(number, number)

    return together(*(acts_as(f"{base + n:04X}:{sub:02X}", other) for n in PDOS))


def forgets_can_id(slave: CanopenSlave) -> Bends:
    """Lose the CAN-ID of a PDO that is switched off."""

    def forget(entry: Entry) -> None:
        if entry.number & INVALID:
            entry.assign(INVALID.to_bytes(4, "little"))

    for place in (*RPDO_IDS, *TPDO_IDS):
        index, sub = place.split(":")
        slave.dictionary[int(index, 16), int(sub, 16)].written = forget
    return Bends()


def seems_event_driven(slave: CanopenSlave) -> Bends:
    """Say that TPDOs are event-driven, whoever writes that too, and wait for SYNC."""
    for number in PDOS:
        entry = slave.dictionary[0x1800 + number, 2]
        entry.assign(b"\xff")
        acts_as(f"{0x1800 + number:04X}:02", lambda kind: 0 if kind in EVENT_DRIVEN else kind)(
            slave
        )
        entry.assign(b"\0")
    return Bends()


def waits_for_sync(slave: CanopenSlave) -> Bends:
    """Give RPDOs to their objects with the next SYNC."""
    kept: list[str] = []

    def hear(text: str) -> Iterable[str]:
        if text.startswith("205#"):
            kept.append(text)
            return ()
        if text.startswith("080#"):
            frames = (*kept, text)
            kept.clear()
            return frames
        return (text,)

    return Bends(hear)


def wants_exact_length(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        mapping = slave.dictionary.object(0x1600)
        bits = sum(entry.number & 0xFF for entry in mapping[1 : mapping[0].number + 1])
        too_long = text.startswith("205#") and "R" not in text and 4 * len(text[4:]) > bits
        return () if too_long else (text,)

    return Bends(hear)


def stays_on_old_id(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        can_id = f"{slave.dictionary[0x1400, 1].number & 0x7FF:03X}"
        if can_id != "205" and text.startswith("205#"):
            return (can_id + text[3:],)
        return (text,)

    return Bends(hear)


def first_counts(slave: CanopenSlave) -> Bends:
    """Keep the first of several RPDOs before a SYNC."""
    kept = [False]

    def hear(text: str) -> Iterable[str]:
        if text.startswith("080#"):
            kept[0] = False
        elif text.startswith("205#"):
            if kept[0]:
                return ()
            kept[0] = True
        return (text,)

    return Bends(hear)


def lags(slave: CanopenSlave) -> Bends:
    """Send each time what should have been sent the time before."""
    last = ["185#0000"]

    def say(text: str) -> Iterable[str]:
        if not text.startswith("185#"):
            return (text,)
        said, last[0] = last[0], text
        return (said,)

    return Bends(say=say)


def sends_when_off(slave: CanopenSlave) -> Bends:
    """Send a TPDO that is switched off."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("000#01") and slave.dictionary[0x1800, 1].number & INVALID:
            slave.send(0x185, bytes(2))
            slave.due_us = 0
        return (text,)

    return Bends(hear)


def answers_all_rtr(slave: CanopenSlave) -> Bends:
    """Answer remote frames whatever bit 30 says."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("185#R") and slave.state is NmtState.OPERATIONAL:
            PdoProducer.of(slave).tpdos[0].send()
            slave.due_us = 0
        return (text,)

    return Bends(hear)


def packs_backwards(slave: CanopenSlave) -> Bends:
    def say(text: str) -> Iterable[str]:
        if text.startswith("185#"):
            return (f"185#{bytes.fromhex(text[4:])[::-1].hex().upper()}",)
        return (text,)

    return Bends(say=say)


def unpacks_backwards(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        if text.startswith("205#") and "R" not in text:
            return (f"205#{bytes.fromhex(text[4:])[::-1].hex().upper()}",)
        return (text,)

    return Bends(hear)


def cuts_bits(slave: CanopenSlave) -> Bends:
    """Send every bit as a byte."""

    def say(text: str) -> Iterable[str]:
        if text.startswith("185#") and len(text) == 6:
            number = int(text[4:], 16)
            return (f"185#{number & 1:02X}{number >> 1 & 1:02X}{number >> 2:02X}",)
        return (text,)

    return Bends(say=say)


ABORT: Final = AbortCode

DEFECTS: Final = (
    Defect(
        "RPDO has another default",
        ("PC-01",),
        says("585#43001401.*", "585#4300140106020000"),
        left=True,
    ),
    Defect(
        "mapping is not the default",
        ("PC-02",),
        says("585#43001A01.*", "585#43001A0108010070"),
        left=True,
    ),
    Defect("RPDO cannot be remapped", ("PC-03",), refuses(ABORT.READ_ONLY, *PLACES[:32])),
    Defect("TPDO cannot be remapped", ("PC-04",), refuses(ABORT.READ_ONLY, *PLACES[32:])),
    Defect(
        *("mapping is changed while active", ("PC-05", "PC-06", "PC-07")),
        tolerant(ABORT.UNSUPPORTED_ACCESS, *COUNTS, *PLACES),
    ),
    Defect("nine objects are mapped", ("PC-08", "PC-09"), unguarded(*COUNTS)),
    Defect(
        "absent objects are mapped",
        ("PC-10",),
        tolerant(ABORT.NO_OBJECT, *COUNTS, *PLACES),
        left=True,
    ),
    Defect(
        *("absent sub-indices are mapped", ("PC-21",)),
        tolerant(ABORT.NO_SUBINDEX, *COUNTS, *PLACES),
    ),
    Defect(
        *("unmappable objects are mapped", ("PC-11", "PC-12", "PC-13", "PC-14")),
        tolerant(ABORT.NOT_MAPPABLE, *COUNTS, *PLACES),
    ),
    Defect(
        *("dummies are mapped into TPDOs", ("PC-29",)),
        tolerant(ABORT.NO_OBJECT, *COUNTS, *PLACES),
        left=True,
    ),
    Defect(
        *("read-only objects go into RPDOs", ("PC-11",)),
        rows=(
            row(0x1001, DataType.UNSIGNED8, Access.READ | BOTH),
            row(0x2005, DataType.UNSIGNED8, Access.READ | BOTH, 0x55),
        ),
    ),
    Defect(
        *("write-only objects go into TPDOs", ("PC-12",)),
        rows=(row(0x2004, DataType.UNSIGNED8, Access.WRITE | BOTH),),
    ),
    Defect(
        *("dummies are not mapped", ("PC-15",)),
        hears("605#23..16..(..)000500(.*)", r"605#230016\g<1>000580\2"),
    ),
    Defect("CAN-ID is changed while valid", ("PC-16", "PC-17"), unguarded(*RPDO_IDS, *TPDO_IDS)),
    Defect("29-bit CAN-ID is taken", ("PC-18", "PC-20"), unguarded(*RPDO_IDS, *TPDO_IDS)),
    Defect(
        *("reserved transmission types", ("PC-19", "PC-27")),
        unguarded(*(place[:5] + "02" for place in (*RPDO_IDS, *TPDO_IDS))),
    ),
    Defect(
        *("not all transmission types", ("PC-28",)),
        refuses(ABORT.VALUE_RANGE, *(place[:5] + "02" for place in TPDO_IDS)),
        left=True,
    ),
    Defect(
        *("sub-index 4 of a TPDO", ("PC-22",)),
        lambda _: Bends(),
        rows=tuple(
            EntryDescription(0x1800 + n, 4, "reserved", DataType.UNSIGNED8, RW) for n in PDOS
        ),
    ),
    Defect(
        *("inhibit time and SYNC start change while valid", ("PC-23", "PC-24")),
        unguarded(*(place[:5] + sub for place in TPDO_IDS for sub in ("03", "06"))),
    ),
    Defect(
        *("event timer cannot change while valid", ("PC-25",)),
        refuses(ABORT.DEVICE_STATE, *(place[:5] + "05" for place in TPDO_IDS)),
    ),
    Defect("an invalid PDO forgets its CAN-ID", ("PC-26",), forgets_can_id),
    Defect(
        *("no TPDO on a change", ("PR-01", "PR-22"), seems_event_driven),
        rows=tuple(
            EntryDescription(0x1800 + n, 2, "type", DataType.UNSIGNED8, RW, default=0) for n in PDOS
        ),
    ),
    Defect("no TPDOs at all", ("PR-01", "PR-02", "PR-04"), says("185#.*")),
    Defect("event timer off", ("PR-02",), all_act_as(0x1800, 5, 0)),
    Defect("event timer 30 % too slow", ("PR-02",), all_act_as(0x1800, 5, {100: 130})),
    Defect("inhibit time ignored", ("PR-03",), all_act_as(0x1800, 3, 0)),
    Defect("SYNC type 1 counts two", ("PR-04",), all_act_as(0x1800, 2, {1: 2})),
    Defect("SYNC type n counts wrong", ("PR-05", "PR-23"), all_act_as(0x1800, 2, {3: 4, 240: 239})),
    Defect("SYNC type 240 counts wrong", ("PR-06",), all_act_as(0x1800, 2, {240: 239})),
    Defect("type 0 sends with each SYNC", ("PR-07",), all_act_as(0x1800, 2, {0: 1})),
    Defect(
        "type 252 sends the present value", ("PR-08",), all_act_as(0x1800, 2, {252: 253}), left=True
    ),
    Defect("remote request of PDO unanswered", ("PR-09", "PR-08"), hears("185#R.*"), left=True),
    Defect("remote request is answered in spite of bit 30", ("PR-24",), answers_all_rtr),
    Defect("SYNC start value ignored", ("PR-10",), all_act_as(0x1800, 6, 0)),
    Defect("RPDO type 255 waits for SYNC", ("PR-11", "PC-03"), waits_for_sync),
    Defect("RPDO type 1 acts at once", ("PR-12", "PR-21"), all_act_as(0x1400, 2, 255)),
    Defect(
        *("of two RPDOs before SYNC the first counts", ("PR-13",)),
        first_counts,
    ),
    Defect("short RPDO is applied", ("PR-14",), hears("205#(..)", r"205#\g<1>00")),
    Defect("EMCY 8210h missing", ("PR-14",), says("085#1082.*")),
    Defect("long RPDO is dropped", ("PR-15",), wants_exact_length),
    Defect("RPDO event timer off", ("PR-16",), says("085#5082.*")),
    Defect("bits fill bytes", ("PR-17",), cuts_bits),
    Defect("TPDO is packed backwards", ("PR-18", "PC-04"), packs_backwards),
    Defect("RPDO is unpacked backwards", ("PR-18", "PC-03"), unpacks_backwards),
    Defect("disabled TPDO is sent", ("PR-19",), sends_when_off),
    Defect("RPDO stays on its old CAN-ID", ("PR-20",), stays_on_old_id),
    Defect("RPDO is not received", ("PR-11", "PR-12"), hears("205#.*")),
    Defect("TPDO has the values before SYNC", ("PR-21",), lags, left=True),
    Defect("type 254 sends nothing", ("PR-22",), all_act_as(0x1800, 2, {254: 0}), left=True),
)
