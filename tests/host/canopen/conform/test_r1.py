"""R1 through the tester: each check gives what the older ones, which look inside, give."""

from __future__ import annotations

import pytest

from tests.device.canopen.actions import DriveActions, GenericIoActions, SlaveActions
from tests.device.canopen.conformance import load_all
from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO
from tests.host.canopen.conform.r1 import R1, Stimulus, yes
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.suite import ORDER, suite_checks
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report

PROFILE = frozenset(range(0x6000, 0xA000))
OF_ANY_NODE = tuple(group for group in ORDER if group not in ("IO", "D4"))


def judge(r1: R1, actions: type[SlaveActions], *only: str) -> Report:
    stimulus = Stimulus(r1, actions(r1.slave))
    plan = ConformancePlan(
        Level.INTRUSIVE, only, PROFILE, stimulus=stimulus, confirm=yes, bit_rate=1_000_000
    )
    return r1.judge(plan)


def not_passed(report: Report) -> list[str]:
    return [
        f"{result.check.id} {result.outcome.verdict}: {result.outcome.reason}"
        for result in report.results
        if result.outcome.verdict is not CheckVerdict.PASS
    ]


def test_each_older_check_is_among_those_of_the_tester() -> None:
    checks = {check.id for check in suite_checks()}
    assert checks >= {check.id for check in load_all()}


def test_r1_passes_all_and_is_left_as_it_was() -> None:
    r1 = R1(("1029", "1F80"))
    before = r1.values()
    report = judge(r1, SlaveActions, *OF_ANY_NODE)
    assert not_passed(report) == []
    assert report.unrestored == report.findings == ()
    assert r1.values() == before


def test_a_module_of_cia_401_passes_all() -> None:
    report = judge(R1((GENERIC_IO,), Ds401), GenericIoActions, "IO")
    assert not_passed(report) == []


def test_a_drive_of_cia_402_passes_all() -> None:
    report = judge(R1((DRIVE,), Ds402, device_type=402), DriveActions, "D4")
    assert not_passed(report) == []


@pytest.mark.parametrize("level", Level)
def test_without_a_hand_at_the_inputs_nothing_fails(level: Level) -> None:
    r1 = R1()
    before = r1.values()
    report = r1.judge(ConformancePlan(level, confirm=yes))
    assert report.count(CheckVerdict.PASS) > 20
    judged = {CheckVerdict.PASS, CheckVerdict.NOT_APPLICABLE, CheckVerdict.IMPLEMENTATION_DEFINED}
    assert {result.outcome.verdict for result in report.results} <= judged
    assert r1.values() == before


def test_objects_are_judged_in_any_order() -> None:
    plans = [ConformancePlan(only=("OD",), seed=seed) for seed in (0, 7, 7, 8)]
    told = [
        [(result.check.id, result.outcome.verdict) for result in R1().judge(plan).results]
        for plan in plans
    ]
    in_order, once, again, other = told
    assert once == again
    assert len({*map(tuple, told)}) == 3
    assert sorted(in_order) == sorted(once) == sorted(other)
