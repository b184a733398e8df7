from __future__ import annotations

from tests.host.canopen.conform.r1 import R1, R1Names
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.verdict import Report, Verdict


def run(*only: str, level: Level = Level.COMMUNICATION) -> Report:
    plan = Plan(level, only)
    features = frozenset({"heartbeat"})
    return ConformRun(R1().link, 5, plan, names=R1Names(), features=features).run()


def test_r1_starts_stops_and_enters_pre_operational() -> None:
    report = run("NMT-0[345]")
    assert [(r.check.id, r.outcome.verdict) for r in report.results] == [
        ("NMT-03", Verdict.PASS),
        ("NMT-04", Verdict.PASS),
        ("NMT-05", Verdict.PASS),
    ]


def test_a_check_beyond_the_level_is_not_run() -> None:
    assert run(level=Level.READ_ONLY).results == ()
