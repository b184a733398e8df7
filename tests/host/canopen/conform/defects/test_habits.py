"""What CANopenNode and Lely do, and may do: the tester accuses nobody of it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import pytest

from tests.device.canopen.actions import SlaveActions
from tests.device.canopen.reference import NODE_ID
from tests.host.canopen.conform.defects.defect import Bends, Defect, hears, make_defective, tolerant
from tests.host.canopen.conform.defects.of_sdo import TEXT, clings_to_transfer, row
from tests.host.canopen.conform.defects.test_found import judge
from tests.host.canopen.conform.r1 import R1, Stimulus, yes
from tests.host.canopen.conform.test_safety import SpyLink
from tests.host.canopen.conform.under_test import Judged, not_harmless
from tickrig.device.canopen.core.slave import CanopenSlave, ServiceMaker
from tickrig.device.canopen.nmt.error_control import HeartbeatProducer
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.verdict import Verdict
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import RW, DeviceInfo
from tickrig.wire.canopen.sdo.abort import AbortCode

SHORT: Final = row(0x2007, 0, TEXT, RW, "abc", 3)
LONG: Final = row(0x200E, 0, TEXT, RW, "a text that is longer than thirty bytes", 100)
SIZED: Final = ("DS-02", "DS-03", "DS-05", "DS-06", "DS-07", "DS-10")
BLOCKS: Final = ("BD-03", "BD-04", "BD-05", "BD-06", "BD-09", "BD-11")

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


RESET: Final = 0x82
"""Reset communication; one is told to learn whether the error goes."""
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
    assert report.count(Verdict.NOT_APPLICABLE) == len(SIZED + BLOCKS)


def test_the_string_that_holds_most_is_taken() -> None:
    slave = make_defective(Defect("two strings", (), rows=(SHORT, LONG))).slave
    device = EdsDevice(DeviceInfo(), tuple(slave.dictionary.description), slave.dictionary.objects)
    plan = Plan(Level.INTRUSIVE, (*SIZED, *BLOCKS), confirm=yes)
    report = ConformRun(Judged(slave).link, NODE_ID, plan, device=device).run()
    assert report.count(Verdict.PASS) == len(SIZED + BLOCKS)


def test_what_the_inhibit_time_holds_back_does_not_come_in_the_next_check() -> None:
    outcome = judge(Defect("none", ()), "EM-08").results[0].outcome
    assert outcome.verdict is Verdict.PASS
    assert sum(line.text.startswith("085#0000") for line in outcome.evidence) == len(CLEARED)


def test_an_error_of_before_the_run_that_is_gone_brings_no_reset() -> None:
    r1 = R1()
    Stimulus(r1, SlaveActions(r1.slave))("emergency", "5000", "01")
    r1.rig.run_for(10_000)
    link = SpyLink(r1)
    report = r1.judge(Plan(Level.INTRUSIVE, ("NMT-11", "HB"), confirm=yes), link=link)
    assert not_harmless(report) == []
    assert sum(frame.can_id == 0 and frame.data[0] == RESET for frame in link.sent) <= 1
