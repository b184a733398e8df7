from __future__ import annotations

from tests.host.canopen.conform.r1 import R1
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.verdict import Report, Verdict


def run(*only: str, level: Level = Level.COMMUNICATION) -> Report:
    return R1().judge(Plan(level, only))


def test_r1_starts_stops_and_enters_pre_operational() -> None:
    report = run("NMT-0[345]")
    assert [(r.check.id, r.outcome.verdict) for r in report.results] == [
        ("NMT-03", Verdict.PASS),
        ("NMT-04", Verdict.PASS),
        ("NMT-05", Verdict.PASS),
    ]
    assert report.unrestored == ()


def test_a_check_beyond_the_level_is_not_run() -> None:
    assert not any(r.check.level > Level.READ_ONLY for r in run(level=Level.READ_ONLY).results)
