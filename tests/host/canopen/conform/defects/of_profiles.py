"""Defects of applications: a module of CiA 401, a drive of CiA 402."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO
from tests.host.canopen.conform.defects.defect import Bends, Defect, Plant, acts_as, hears, says
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import RW, EntryDescription


def module(
    name: str, breaks: tuple[str, ...], plant: Plant, *rows: EntryDescription, left: bool = False
) -> Defect:
    """Return a defect of a module of CiA 401."""
    return Defect(name, breaks, plant, rows=rows, needs=frozenset({GENERIC_IO}), left=left)


def drive(name: str, breaks: tuple[str, ...], plant: Plant, *, left: bool = False) -> Defect:
    """Return a defect of a drive of CiA 402."""
    return Defect(name, breaks, plant, needs=frozenset({DRIVE}), left=left)


def ignored(place: str, instead: int) -> Plant:
    """Let an option have no effect."""
    return acts_as(place, lambda number: instead)


def controlword(taken: str, instead: str) -> Plant:
    """Take one controlword for another."""
    return hears(f"605#2B406000{taken}00(.*)", rf"605#2B406000{instead}00\1")


def events_at_first(slave: CanopenSlave) -> Bends:
    """Send analogue values though 6423h says that they are not sent."""
    slave.dictionary[0x6423, 0].source = lambda entry: b"\0"
    return Bends()


def resets_without_edge(slave: CanopenSlave) -> Bends:
    """Take each fault reset for a new one."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#2B4060008000"):
            slave.dictionary[0x6040, 0].force(bytes(2))
        return (text,)

    return Bends(hear)


def needs_switched_on(slave: CanopenSlave) -> Bends:
    """Take Enable operation in Switched on only."""

    def hear(text: str) -> Iterable[str]:
        ready = slave.dictionary[0x6041, 0].number & 0x6F == 0x21
        if text.startswith("605#2B4060000F00") and ready:
            return ("605#2B40600006000000",)
        return (text,)

    return Bends(hear)


def number(index: str, instead: str) -> Plant:
    """Tell another number of four bytes."""
    return says(f"585#43{index}00.{{8}}", f"585#43{index}00{instead}")


DEFECTS: Final = (
    module(
        "1000h names another profile",
        ("IO-01", "OD-1000.00-type"),
        says("585#43001000.*", "585#4300100092010F00"),
    ),
    module(
        "inputs are not shown", ("IO-02", "IO-03"), says("585#4F006001.*", "585#4F00600155000000")
    ),
    module("input polarity ignored", ("IO-03",), ignored("6002:01", 0)),
    module("6005h ignored", ("IO-04",), ignored("6005:00", 1)),
    module("6006h ignored", ("IO-05", "IO-06"), ignored("6006:01", 0xFF)),
    module("6007h ignored", ("IO-06",), ignored("6007:01", 0)),
    module("6008h ignored", ("IO-07",), ignored("6008:01", 0)),
    module("outputs do not follow RPDOs", ("IO-08",), hears("205#.*")),
    module("output polarity ignored", ("IO-09",), ignored("6202:01", 0)),
    module("output filter mask ignored", ("IO-10",), ignored("6208:01", 0xFF)),
    module("error value ignored", ("IO-11", "IO-13"), ignored("6207:01", 0)),
    module("error value not on heartbeat loss", ("IO-13",), hears("7(?!05|E5)..#.*"), left=True),
    module("error mode ignored", ("IO-12",), ignored("6206:01", 0xFF)),
    module(
        *("analogue values are sent at once", ("IO-14",), events_at_first),
        EntryDescription(0x6423, 0, "enable", DataType.BOOLEAN, RW, default=True),
    ),
    module("6423h ignored", ("IO-15",), ignored("6423:00", 0)),
    module("upper limit ignored", ("IO-16",), ignored("6424:01", 0), left=True),
    module("lower limit ignored", ("IO-17",), ignored("6425:01", 0), left=True),
    module("delta ignored", ("IO-18",), ignored("6426:01", 0)),
    module("analogue error value ignored", ("IO-19",), ignored("6444:01", 0)),
    drive(
        "statusword before its time", ("D4-01",), says("585#4B416000[45]0(.*)", r"585#4B41600000\1")
    ),
    drive("Shutdown is not obeyed", ("D4-02",), controlword("06", "00")),
    drive("Switch on is not obeyed", ("D4-03",), controlword("07", "06")),
    drive("Enable operation is not obeyed", ("D4-04", "D4-05"), controlword("0F", "07")),
    drive("Enable operation from Ready is not obeyed", ("D4-05",), needs_switched_on, left=True),
    drive("Quick stop is not obeyed", ("D4-06", "D4-07"), controlword("02", "0F")),
    drive("605Ah ignored", ("D4-07",), ignored("605A:00", 2), left=True),
    drive("Disable voltage is not obeyed", ("D4-08",), controlword("00", "0F")),
    drive("no EMCY of a fault", ("D4-09",), says("085#1023.*")),
    drive("fault is reset without an edge", ("D4-10",), resets_without_edge),
    drive("6061h does not follow", ("D4-11",), says("585#4F6160.*", "585#4F61600000000000")),
    drive("velocity is not told", ("D4-12",), number("6C60", "00000000"), left=True),
    drive("position is not told", ("D4-13", "D4-14"), number("6460", "05000000")),
    drive(
        "target reached is not told",
        ("D4-14",),
        says("585#4B416000(...)[4-7C-F](.*)", r"585#4B416000\g<1>0\2"),
        left=True,
    ),
    drive(
        "homing attained is not told",
        ("D4-15",),
        says("585#4B416000(..)1.(.*)", r"585#4B416000\g<1>00\2"),
    ),
    drive("Disable operation is not obeyed", ("D4-16",), controlword("07", "0F")),
    drive("abort connection option ignored", ("D4-17",), ignored("6007:00", 0)),
)
