"""What CANopenNode and Lely do, and may do: the tester accuses nobody of it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

import pytest

from tests.device.canopen.actions import SlaveActions
from tests.device.canopen.profile_objects import make_dictionary
from tests.device.canopen.reference import NODE_ID
from tests.host.canopen.conform.defects.defect import (
    Bends,
    Defect,
    hears,
    make_defective,
    refuses,
    says,
    together,
    tolerant,
)
from tests.host.canopen.conform.defects.of_nmt import BusyAtStart
from tests.host.canopen.conform.defects.of_pdo import BOTH
from tests.host.canopen.conform.defects.of_sdo import TEXT, clings_to_transfer, row
from tests.host.canopen.conform.defects.of_services import Slow
from tests.host.canopen.conform.defects.test_found import DefectiveR1, judge
from tests.host.canopen.conform.r1 import EDS, R1, Stimulus, yes
from tests.host.canopen.conform.test_safety import SpyLink
from tests.host.canopen.conform.under_test import Judged, not_harmless
from tickrig.device.canopen.dictionary import Dictionary, Entry, SdoAbort
from tickrig.device.canopen.nmt import HeartbeatProducer, NmtSlave
from tickrig.device.canopen.slave import CanopenSlave, ServiceMaker
from tickrig.device.canopen.stack import make_slave
from tickrig.device.canopen.sync import Sync
from tickrig.emulators.can.outside.host import CanHost
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import RW, Access, DeviceInfo, EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode

SHORT: Final = row(0x2007, 0, TEXT, RW, "abc", 3)
LONG: Final = row(0x200E, 0, TEXT, RW, "a text that is longer than thirty bytes", 100)
SIZED: Final = ("DS-02", "DS-03", "DS-05", "DS-06", "DS-07", "DS-10")
BLOCKS: Final = ("BD-03", "BD-04", "BD-05", "BD-06", "BD-09", "BD-11")

MANDATORY: Final = (0x1000, 0x1001, 0x1018)
CLEARED: Final = ("5000", "3100")
"""Errors that EM-08 lets go, each told in an EMCY."""
ZEROS: Final = tolerant(AbortCode.NO_OBJECT, "1A00:00", "1A00:01")


class Prompt(HeartbeatProducer):
    """Sends a first heartbeat 2 ms after its time was written."""

    def schedule(self, due_us: int) -> None:
        super().schedule(due_us or self.node.now_us + 2_000)

    def tick(self, now_us: int) -> None:
        self._begins, self._due_us = False, now_us
        if self.node.dictionary[0x1017, 0].number:
            super().tick(now_us)


def clears_by_an_rpdo(slave: CanopenSlave) -> Bends:
    """Tell with the next RPDO that an earlier one was too short, which is in no register."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("205#"):
            slave.send(0x085, bytes(8))
        return (text,)

    return Bends(hear)


class OneAtATime(SpyLink):
    """A link to a node that does not know a request less than 5 ms behind one without an answer."""

    _ready_us = 0

    def send(self, frames: Frames, /) -> None:
        for frame in frames:
            sent, asked = frame, frame.can_id == 0x600 + NODE_ID
            if asked and self.now_us < self._ready_us:
                sent = CanFrame(frame.can_id, b"\xe0" + frame.data[1:])
            if asked and frame.data[0] in {0x80, 0xA1}:
                self._ready_us = self.now_us + 5_000
            super().send((sent,))


RESET: Final = 0x82
"""Reset communication; one is told to learn whether the error goes."""
UNSAVED: Final = ("585#4310100101000000", "585#4310100100000000")
SAVES: Final = ("585#4310100101000000", "585#4310100103000000")
SIZE: Final = r"(585#)C[26](.{6}).*"
CRC: Final = r"(585#[CD][159D])....(0{10})"
UNSIZED: Final = says(SIZE, r"\1C0\g<2>00000000")
UNCHECKED: Final = says(CRC, r"\g<1>0000\2")
UPLOADS: Final = tuple(f"BU-{number:02}" for number in range(1, 11))
UNLOADED: Final = ("585#4311100101000000", "585#4311100100000000")
PROMPT: Final[dict[ServiceMaker, ServiceMaker]] = {HeartbeatProducer: Prompt}


@pytest.mark.parametrize(
    ("habit", "checks"),
    [
        (Defect("a string of three bytes", (), rows=(SHORT,)), (*SIZED, *BLOCKS)),
        (Defect("no new transfer while one runs", (), clings_to_transfer), ("US-07",)),
        (Defect("no other bit rate", (), hears("7E5#13.*")), ("LS-06", "LS-07")),
        (Defect("zeros for dummies", (), ZEROS), ("PC-29",)),
        (Defect("a heartbeat at once", (), services=PROMPT), ("NMT-10", "NMT-11", "ST-05")),
        (Defect("EMCY 0000h with an RPDO", (), clears_by_an_rpdo), ("PR-16",)),
        (Defect("self-starting", (), services={NmtSlave: BusyAtStart}), ("NMT-23", "NMT-28")),
        (Defect("longer NMT commands", (), hears("000#(..05).+", r"000#\1")), ("NMT-09",)),
        (Defect("no LSS configuration is stored", (), says("7E4#1700", "7E4#1701")), ("LS-08",)),
        (Defect("stores nothing on command", (), says(*UNSAVED)), ("ST-01", "ST-02", "ST-03")),
        (Defect("restores nothing on command", (), says(*UNLOADED)), ("ST-05", "ST-08")),
        (Defect("saves by itself", (), says(*SAVES)), ("ST-01", "ST-04")),
        (Defect("blocks of no size, with a CRC", (), says(SIZE, r"\1C4\g<2>00000000")), UPLOADS),
        (
            Defect(
                "blocks of no size or CRC",
                (),
                together(says(SIZE, r"\1C0\g<2>00000000"), says(CRC, r"\g<1>0000\2")),
            ),
            UPLOADS,
        ),
    ],
    ids=lambda value: value.name if isinstance(value, Defect) else "",
)
def test_a_habit_of_theirs_is_no_failure(habit: Defect, checks: tuple[str, ...]) -> None:
    report = judge(habit, *checks)
    assert {result.check.id for result in report.results} == set(checks)
    assert not_harmless(report) == []


def test_a_string_that_is_too_short_is_told() -> None:
    report = judge(Defect("a string of three bytes", (), rows=(SHORT,)), *SIZED, *BLOCKS)
    reasons = {result.check.id: result.outcome.reason for result in report.results}
    assert reasons["BD-03"] == "2007h:00 holds less than 30 bytes"
    assert report.count(CheckVerdict.NOT_APPLICABLE) == len(SIZED + BLOCKS)


def test_the_string_that_holds_most_is_taken() -> None:
    slave = make_defective(Defect("two strings", (), rows=(SHORT, LONG))).slave
    device = EdsDevice(DeviceInfo(), tuple(slave.dictionary.description), slave.dictionary.objects)
    plan = ConformancePlan(Level.INTRUSIVE, (*SIZED, *BLOCKS), confirm=yes)
    report = ConformRun(Judged(slave).link, NODE_ID, plan, device=device).run()
    assert report.count(CheckVerdict.PASS) == len(SIZED + BLOCKS)


def test_a_server_that_takes_one_request_at_a_time_fails_nothing() -> None:
    r1 = R1()
    plan = ConformancePlan(Level.INTRUSIVE, ("US", "BU", "DS", "BD"), confirm=yes)
    report = r1.judge(plan, link=OneAtATime(r1))
    assert report.count(CheckVerdict.PASS) > 20
    assert not_harmless(report) == []


def test_a_wrong_segment_of_an_upload_fails_no_download() -> None:
    never_last = Defect("c is not set", (), says("585#054142434445(.*)", r"585#044142434445\1"))
    (result,) = judge(never_last, "DS-03").results
    assert result.outcome.verdict is CheckVerdict.INCONCLUSIVE
    assert result.outcome.reason.startswith("could not be read back, see the checks of group US")


def test_a_mandatory_object_that_is_not_there_fails_one_check() -> None:
    slave = make_defective(Defect("R1", ())).slave
    entries = [e for e in slave.dictionary.description if e.index not in MANDATORY]
    bare = make_slave(Dictionary(entries, slave.dictionary.objects), NODE_ID)
    device = EdsDevice(DeviceInfo(), tuple(entries), slave.dictionary.objects)
    plan = ConformancePlan(Level.INTRUSIVE, confirm=yes)
    report = ConformRun(Judged(bare).link, NODE_ID, plan, device=device).run()
    failed = [one.check.id for one in report.results if one.outcome.verdict is CheckVerdict.FAIL]
    assert failed == ["UE-01", "UE-02", "UE-05"]
    reasons = {result.check.id: result.outcome.reason for result in report.results}
    assert reasons["DE-17"] == "the node has no 1018h:00: UE-05"


@pytest.mark.parametrize("level", [Level.COMMUNICATION, Level.INTRUSIVE])
def test_a_pdo_that_exists_keeps_its_mapping_whatever_is_written(
    tmp_path: Path, level: Level
) -> None:
    eds, head = tmp_path / "limits.eds", "[1600sub0]\n"
    text = EDS.read_text("utf-8").replace("\r", "")
    assert head in text
    eds.write_text(text.replace(head, f"{head}LowLimit=0\nHighLimit=8\n"), "utf-8")
    plan = ConformancePlan(level, ("OD-1600.00-*",), confirm=yes)
    report = Judged.of(eds).judge(plan, eds)
    assert "OD-1600.00-high" in {result.check.id for result in report.results}
    assert not_harmless(report) == []


def test_what_the_inhibit_time_holds_back_does_not_come_in_the_next_check() -> None:
    outcome = judge(Defect("none", ()), "EM-08").results[0].outcome
    assert outcome.verdict is CheckVerdict.PASS
    assert sum(line.text.startswith("085#0000") for line in outcome.evidence) == len(CLEARED)


def test_an_error_of_before_the_run_that_is_gone_brings_no_reset() -> None:
    r1 = R1()
    Stimulus(r1, SlaveActions(r1.slave))("emergency", "5000", "01")
    r1.rig.run_for(10_000)
    link = SpyLink(r1)
    report = r1.judge(ConformancePlan(Level.INTRUSIVE, ("NMT-11", "HB"), confirm=yes), link=link)
    assert not_harmless(report) == []
    assert sum(frame.can_id == 0 and frame.data[0] == RESET for frame in link.sent) <= 1


UNMAPPED: Final = tuple(
    EntryDescription(index, 0, "number", DataType.UNSIGNED8, RW, default=0)
    for index in (0x1600, 0x1A00)
)
AFTER: Final = frozenset({"PC-16", "PC-23", "PC-24", "PR-10"})
"""Checks that enable a PDO before they ask what they are about."""
FIXED: Final = {
    (0x1005, 0): 0x80,
    (0x1014, 0): 0x85,
    (0x1015, 0): 0,
    **{(0x1016, sub): 0 for sub in range(1, 5)},
    (0x1017, 0): 1_000,
    (0x1003, 0): 0,
    (0x1400, 1): 0x205,
    (0x1400, 2): 255,
    (0x1800, 1): 0x4000_0185,
    (0x1800, 2): 255,
    (0x1800, 5): 100,
}
"""Objects that CiA 301 lets be constant, and what they hold."""
GROUPS: Final = ("NMT", "HB", "NG", "PC", "PR", "SY", "EM", "ST", "UE", "DE")


def wants_a_mapping(slave: CanopenSlave) -> Bends:
    """Refuse to enable a PDO that has no objects, as CANopenNode does."""

    def guarded(entry: Entry) -> None:
        before, count = entry.guard, slave.dictionary[entry.index + 0x200, 0]

        def check(entry: Entry, value: Value) -> None:
            if not count.number and not int(value) & 1 << 31:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            if before is not None:
                before(entry, value)

        entry.guard = check

    for index in (0x1400, 0x1800):
        guarded(slave.dictionary[index, 1])
    return Bends()


def fixed_row(at: tuple[int, int], value: int) -> EntryDescription:
    """Describe an object of R1 as constant."""
    was = next(e for e in make_dictionary(frozenset()).description if (e.index, e.sub) == at)
    access = was.access & ~Access.WRITE
    return EntryDescription(*at, was.name, was.data_type, access, default=value)


def judge_as_described(defect: Defect, *only: str) -> Report:
    """Judge a slave with an EDS that says what it has."""
    slave = make_defective(defect).slave
    device = EdsDevice(DeviceInfo(), tuple(slave.dictionary.description), slave.dictionary.objects)
    plan = ConformancePlan(Level.INTRUSIVE, only, confirm=yes)
    return ConformRun(Judged(slave).link, NODE_ID, plan, device=device).run()


def test_a_pdo_that_is_not_enabled_without_objects_fails_no_check_of_others() -> None:
    report = judge(Defect("wants a mapping", (), wants_a_mapping, rows=UNMAPPED), *AFTER)
    assert not_harmless(report) == []
    assert report.count(CheckVerdict.PASS) == len(AFTER)


def test_a_pdo_that_cannot_be_enabled_at_all_is_told() -> None:
    stubborn = Defect("never", (), refuses(AbortCode.VALUE_RANGE, "1400:01", "1800:01"))
    outcomes = {r.check.id: r.outcome for r in judge(stubborn, *AFTER).results}
    assert {each.verdict for each in outcomes.values()} == {CheckVerdict.INCONCLUSIVE}
    assert outcomes["PC-23"].reason.startswith("could not be prepared: step 1, given macro enable")
    assert "abort 0609 0030h" in outcomes["PC-23"].reason


@pytest.mark.parametrize(
    "at", [*FIXED, None], ids=lambda at: f"{at[0]:04X}.{at[1]:02X}" if at else "all"
)
def test_a_constant_object_is_legal(at: tuple[int, int] | None) -> None:
    some = FIXED if at is None else {at: FIXED[at]}
    constant = Defect("constant", (), rows=tuple(fixed_row(*each) for each in some.items()))
    assert not_harmless(judge_as_described(constant, *GROUPS)) == []


def test_an_object_that_is_constant_only_at_the_node_is_legal() -> None:
    places = [f"{index:04X}:{sub:02X}" for index, sub in FIXED if index < 0x1400]
    constant = Defect("constant", (), refuses(AbortCode.READ_ONLY, *places))
    report = judge(constant, *GROUPS)
    assert not_harmless(report) == []


def test_a_limit_that_leaves_one_value_makes_a_constant() -> None:
    only = EntryDescription(
        *(0x1017, 0, "heartbeat", DataType.UNSIGNED16, RW), default=500, low=500, high=500
    )
    report = judge_as_described(Defect("one value", (), rows=(only,)), "NMT", "HB", "NG", "ST")
    assert not_harmless(report) == []
    reasons = {r.outcome.reason for r in report.results if r.check.id == "HB-01"}
    assert reasons == {"1017h:00 accepts only 500 to 500"}


def test_an_event_timer_of_the_node_disturbs_no_check() -> None:
    timed = EntryDescription(0x1800, 5, "event timer", DataType.UNSIGNED16, RW, default=100)
    report = judge(Defect("event timer", (), rows=(timed,)), "PR-01", "PR-03", "PR-24", "NMT-14")
    assert [r.outcome.verdict for r in report.results] == [CheckVerdict.PASS] * 4
    assert report.unrestored == ()


def test_a_value_that_is_there_already_is_not_written_to_see_whether_it_goes() -> None:
    there = (
        EntryDescription(0x2001, 0, "u16", DataType.UNSIGNED16, RW | BOTH, default=0x34A5),
        EntryDescription(0x1017, 0, "heartbeat", DataType.UNSIGNED16, RW, default=100),
    )
    report = judge(Defect("there already", (), rows=there), "NMT-10", "NMT-11", "ST-04", "ST-05")
    assert [r.outcome.verdict for r in report.results] == [CheckVerdict.PASS] * 4


def test_the_node_id_that_lss_gives_is_no_other_node() -> None:
    report = judge(Defect("none", ()), "LS-04", "LS-08")
    assert report.count(CheckVerdict.PASS) == 2
    assert report.settings["other nodes"] == "none"


def beats_behind_boot_up(slave: CanopenSlave) -> Bends:
    return says("705#00", "705#00", "705#7F")(slave)


def test_a_heartbeat_right_behind_the_boot_up_is_told_under_its_own_clause() -> None:
    outcomes = {
        r.check.id: (r.outcome.verdict, r.check.source)
        for r in judge(Defect("at once", (), beats_behind_boot_up), "NMT-01", "HB-05").results
    }
    assert outcomes["NMT-01"][0] is CheckVerdict.PASS
    assert outcomes["HB-05"] == (CheckVerdict.FAIL, "CiA 301 v4.2.0, 7.2.8.3.2.2")


@pytest.mark.parametrize(
    ("said", "instead", "checks"),
    [
        ("585#80......01000405", "00000008", ("US-04", "US-05", "DS-09")),
        ("585#80......02000106", "00000106", ("DE-07", "DE-16", "DE-17", "DS-08", "BD-07")),
        ("585#80031000........", "31000906", ("DE-14",)),
        ("585#80031000........", "00000008", ("DE-14",)),
    ],
)
def test_another_abort_code_that_the_text_allows(
    said: str, instead: str, checks: tuple[str, ...]
) -> None:
    bend = says(f"({said[:12]}){said[12:]}", rf"\g<1>{instead}")
    assert not_harmless(judge(Defect("another code", (), bend), *checks)) == []


def test_a_refusal_when_all_has_come_is_one() -> None:
    report = judge(Defect("late", (), refuses_late), "DS-08")
    assert [r.outcome.verdict for r in report.results] == [CheckVerdict.PASS]


def refuses_late(slave: CanopenSlave) -> Bends:
    """Refuse a segmented download of 1000h with its last segment."""
    begun, told = [False], list[str]()

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#21001000"):
            begun[0] = True
        elif begun[0] and text.startswith("605#0"):
            return ("605#2100100004000000",)
        return (text,)

    def say(text: str) -> Iterable[str]:
        if begun[0] and text == "585#8000100002000106" and not told:
            told.append(text)
            return ("585#6000100000000000",)
        return (text,)

    return Bends(hear, say)


def test_a_busy_host_is_no_slow_producer_of_sync() -> None:
    slow = Defect("SYNC is late", (), services={Sync: Slow})
    for shared, verdict in ((True, CheckVerdict.INCONCLUSIVE), (False, CheckVerdict.FAIL)):
        defective = DefectiveR1(slow)
        plan = ConformancePlan(Level.INTRUSIVE, ("SY-02",), confirm=yes, shared_host=shared)
        link = Lagging(defective.link)
        device = EdsDevice(DeviceInfo(), tuple(make_dictionary(frozenset()).description), {})
        report = ConformRun(link, NODE_ID, plan, device=device).run()
        assert [r.outcome.verdict for r in report.results] == [verdict]


class Lagging:
    """A link whose frames are read 2 ms after they were on the bus."""

    def __init__(self, link: CanHost) -> None:
        self._link = link

    @property
    def now_us(self) -> int:
        return self._link.now_us

    def send(self, traffic: Frames, /) -> None:
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> Frames:
        return self._link.receive(timeout_us)

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        now_us, frames = self._link.receive_stamped(timeout_us)
        return now_us, tuple((at_us - 2_000, frame) for at_us, frame in frames)

    def close(self) -> None:
        self._link.close()
