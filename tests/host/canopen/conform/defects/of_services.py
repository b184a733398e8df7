"""Defects of SYNC, EMCY, store and LSS."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tests.host.canopen.conform.defects.defect import (
    Bends,
    Defect,
    Plant,
    acts_as,
    hears,
    says,
    together,
    unguarded,
)
from tickrig.device.canopen.dictionary import Entry
from tickrig.device.canopen.errors import EmcyProducer
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.sync import Sync
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER


class Slow(Sync):
    """Sends SYNC a tenth too late."""

    def schedule(self, due_us: int) -> None:
        if self.node.now_us < due_us < NEVER:
            due_us = self.node.now_us + self.period_us * 11 // 10
        super().schedule(due_us)


class Endless(Sync):
    """Goes on with period 0."""

    def schedule(self, due_us: int) -> None:
        super().schedule(self.node.now_us + 10_000 if due_us == NEVER else due_us)


class Deaf(EmcyProducer):
    """Shows no error in 1001h."""

    @property
    def register(self) -> int:
        return 0


class Silent(EmcyProducer):
    """Has no history."""

    def emergency(self, code: int, register: int, text: bytes) -> None:
        count = self.node.dictionary[0x1003, 0]
        before = count.data
        super().emergency(code, register, text)
        count.assign(before)


class Loud(EmcyProducer):
    """Sends EMCY in Stopped too."""

    def emergency(self, code: int, register: int, text: bytes) -> None:
        super().emergency(code, register, text)
        if self.node.state is NmtState.STOPPED:
            self.node.send(0x85, bytes(8))


def stores_nothing(slave: CanopenSlave) -> Bends:
    slave.dictionary[0x1010, 1].written = None
    return Bends()


def sorts_history_backwards(slave: CanopenSlave) -> Bends:
    fields = slave.dictionary.elements(0x1003)
    sources = [entry.source for entry in fields]

    def backwards(entry: Entry) -> bytes:
        count, source = slave.dictionary[0x1003, 0].number, sources[0]
        assert source is not None
        if entry.sub > count:
            return source(entry)
        return fields[count - entry.sub].data

    for entry in fields:
        entry.source = backwards
    return Bends()


def keeps_history(slave: CanopenSlave) -> Bends:
    """Take 1003h:00 = 0 and keep all."""
    count = slave.dictionary[0x1003, 0]
    kept = [count.data]
    check = count.guard

    def guard(entry: Entry, value: object) -> None:
        kept[0] = entry.data
        assert check is not None
        check(entry, value)  # type: ignore[arg-type]

    def written(entry: Entry) -> None:
        entry.assign(kept[0])

    count.guard, count.written = guard, written
    return Bends()


def restores_at_once(slave: CanopenSlave) -> Bends:
    restore = slave.dictionary[0x1011, 1]
    before = restore.written

    def written(entry: Entry) -> None:
        assert before is not None
        before(entry)
        for each in slave.dictionary:
            if each.index in range(0x1017, 0x1018) or each.index in range(0x2000, 0x3000):
                each.assign(each.description.power_on_data(slave.node_id))

    restore.written = written
    return Bends()


def restores_nothing(slave: CanopenSlave) -> Bends:
    slave.dictionary[0x1011, 1].written = None
    return Bends()


def stores_by_itself(slave: CanopenSlave) -> Bends:
    entry = slave.dictionary[0x1017, 0]

    def keep(entry: Entry) -> None:
        if entry.number:
            slave.nonvolatile.parameters[entry.key] = entry.data

    entry.watch(keep)
    return Bends()


def answers_lss(command: str, answer: int) -> Plant:
    """Answer an LSS message that is none of this node."""

    def plant(slave: CanopenSlave) -> Bends:
        def hear(text: str) -> Iterable[str]:
            if text.startswith(f"7E5#{command}"):
                slave.send(0x7E4, bytes([answer, *bytes(7)]))
                slave.due_us = 0
            return (text,)

        return Bends(hear)

    return plant


def emcy_moves(slave: CanopenSlave) -> Bends:
    """Send EMCY on its old CAN-ID for ever."""

    def say(text: str) -> Iterable[str]:
        can_id = f"{slave.dictionary[0x1014, 0].number & 0x7FF:03X}#"
        return (f"085#{text[4:]}",) if text.startswith(can_id) else (text,)

    return Bends(say=say)


def emcy_never_off(slave: CanopenSlave) -> Bends:
    """Send EMCY in spite of bit 31."""

    def heard(entry: Entry) -> None:
        if slave.dictionary[0x1014, 0].number >> 31 and entry.number:
            slave.send(0x85, bytes([0, 0x10, entry.number, 0, 0, 0, 0, 0]))

    slave.dictionary[0x1001, 0].watch(heard)
    return Bends()


ABORT: Final = AbortCode

DEFECTS: Final = (
    Defect(
        "SYNC has another default",
        ("SY-01",),
        says("585#43051000.*", "585#4305100081000000"),
        left=True,
    ),
    Defect("SYNC period off by 10 %", ("SY-02",), services={Sync: Slow}),
    Defect("no SYNC producer", ("SY-02", "SY-03"), says("080#.*")),
    Defect("SYNC counter begins at 0", ("SY-03",), says("080#0(.)", r"080#1\1")),
    Defect("SYNC counter never off", ("SY-04",), says("080#", "080#01")),
    Defect(
        *("1019h is changed while producing", ("SY-05", "SY-12")),
        unguarded("1019:00"),
    ),
    Defect(
        *("COB-ID SYNC takes all", ("SY-06", "SY-09", "SY-13")),
        unguarded("1005:00"),
    ),
    Defect("SYNC is consumed on 80h only", ("SY-07",), hears("(0B0|6A2)#.*")),
    Defect("EMCY 8240h missing", ("SY-08",), says("085#4082.*"), left=True),
    Defect("SYNC producer never stops", ("SY-10",), services={Sync: Endless}),
    Defect("TIME is not consumed", ("SY-11",), hears("100#.*")),
    Defect("SYNC is not consumed", ("PR-04", "PR-05"), hears("080#.*")),
    Defect(
        "EMCY has another default",
        ("EM-01",),
        says("585#43141000.*", "585#4314100086000000"),
        left=True,
    ),
    Defect("no EMCY", ("EM-02", "EM-11"), says("085#.*")),
    Defect(
        "EMCY without error register",
        ("EM-02", "EM-13"),
        says("085#(....)..(.*)", r"085#\g<1>00\2"),
    ),
    Defect("EMCY of 7 bytes", ("EM-02",), says("085#(.{14}).*", r"085#\1")),
    Defect("1001h shows no error", ("EM-03",), services={EmcyProducer: Deaf}),
    Defect("errors are not in 1003h", ("EM-04", "EM-05"), services={EmcyProducer: Silent}),
    Defect("1003h not newest first", ("EM-05", "EM-07"), sorts_history_backwards),
    Defect("1003h cannot be cleared", ("EM-06",), keeps_history),
    Defect("EMCY inhibit time ignored", ("EM-08",), acts_as("1015:00", lambda number: 0)),
    Defect("1014h is not switched off", ("EM-09",), emcy_never_off),
    Defect("COB-ID EMCY takes all", ("EM-10", "EM-14"), unguarded("1014:00")),
    Defect("EMCY stays on its CAN-ID", ("EM-11",), emcy_moves),
    Defect("EMCY in Stopped", ("NMT-18",), services={EmcyProducer: Loud}),
    Defect(
        "1010h says that it cannot store",
        ("ST-01",),
        says("585#43101001.*", "585#4310100100000000"),
        left=True,
    ),
    Defect("store without signature", ("ST-02",), unguarded("1010:01")),
    Defect("store does not store", ("ST-03", "HB-05"), stores_nothing),
    Defect("stores without being told", ("ST-04",), stores_by_itself),
    Defect("restore at once rather than after reset", ("ST-05",), restores_at_once),
    Defect("restore does not restore", ("ST-07", "ST-05"), restores_nothing),
    Defect("restore without signature", ("ST-06",), unguarded("1011:01")),
    Defect("LSS does not answer", ("LS-01", "LS-02", "LS-04"), says("7E4#.*")),
    Defect("LSS tells another vendor", ("LS-02",), says("7E4#5A(..)(.*)", r"7E4#5A77\2")),
    Defect(
        "LSS answers in waiting state",
        ("LS-03",),
        hears("7E5#5(.*)", "7E5#0401000000000000", r"7E5#5\1"),
    ),
    Defect(
        "LSS node-ID does not count after a reset",
        ("LS-04",),
        hears("7E5#11(?!00|80)..(.*)", r"7E5#1105\1"),
    ),
    Defect("LSS node-ID 0 is accepted", ("LS-05",), hears("7E5#1100(.*)", r"7E5#1105\1")),
    Defect("LSS bit timing is refused", ("LS-06",), says("7E4#13.*"), left=True),
    Defect("LSS bit timing 10 is accepted", ("LS-07",), hears("7E5#13000A(.*)", r"7E5#130002\1")),
    Defect("LSS stores nothing", ("LS-08",), hears("7E5#17.*")),
    Defect("LSS selective does not answer", ("LS-09",), says("7E4#44.*")),
    Defect(
        "LSS selective takes any serial number",
        ("LS-10",),
        hears("7E5#43.{8}(.*)", r"7E5#4378560000\1"),
    ),
    Defect("LSS identify does not answer", ("LS-11",), says("7E4#4F.*"), left=True),
    Defect(
        "LSS identify answers outside of its range",
        ("LS-12",),
        together(
            hears("7E5#4([8A]).{8}(.*)", r"7E5#4\g<1>00000000\2"),
            hears("7E5#4([9B]).{8}(.*)", r"7E5#4\g<1>FFFFFFFF\2"),
        ),
    ),
    Defect("LSS configured node says that it is not", ("LS-13",), answers_lss("4C", 0x50)),
    Defect("LSS fastscan is answered by a configured node", ("LS-14",), answers_lss("51", 0x4F)),
    Defect("LSS does not work in Stopped", ("LS-15",), hears("7E5#.*", only=NmtState.STOPPED)),
    Defect("LSS fastscan is not answered", ("LS-16", "LS-17"), says("7E4#4F.*")),
    Defect("LSS fastscan finds nobody", ("LS-17",), hears("7E5#51.{8}00.*")),
    Defect("no boot-up with a node-ID of LSS", ("LS-18",), says("7(?!05|E4)..#00")),
    Defect("LSS not configured is not told", ("LS-19",), says("7E4#50.*"), left=True),
)
