"""R1 through the tester: what the older checks, which look inside, give."""

from __future__ import annotations

from tests.device.canopen.actions import SlaveActions
from tests.host.canopen.conform.r1 import R1, Stimulus, yes
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.verdict import Report, Verdict

PROFILE = frozenset(range(0x6000, 0xA000))


def judge(r1: R1, actions: type[SlaveActions], *only: str) -> Report:
    stimulus = Stimulus(r1, actions(r1.slave))
    plan = Plan(Level.INTRUSIVE, only, PROFILE, stimulus=stimulus, confirm=yes, bit_rate=1_000_000)
    return r1.judge(plan)


def others_than_passed(report: Report) -> dict[str, tuple[Verdict, str]]:
    results = [(r.check.id, r.outcome) for r in report.results]
    return {
        name: (outcome.verdict, outcome.reason)
        for name, outcome in results
        if outcome.verdict is not Verdict.PASS
    }


def test_r1_passes_all() -> None:
    r1 = R1(("1029", "1F80"))
    before = r1.values()
    report = judge(r1, SlaveActions, "[!ID]*", "DE", "DS", "DE-*")
    assert others_than_passed(report) == {}
    assert report.unrestored == ()
    assert r1.values() == before
