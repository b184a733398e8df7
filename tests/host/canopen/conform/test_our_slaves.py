"""Our own devices, and those of every EDS of the examples: nothing fails, all is as before."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canopen.conform.r1 import yes
from tests.host.canopen.conform.under_test import Judged, not_harmless
from tickrig.device.canopen.device_rtc import CanopenEcho, make_device_rtc
from tickrig.emulators.testing.conformance.bench_source import SlaveStimulus
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.verdict import CheckVerdict

EXAMPLES = Path(__file__).parents[4] / "examples"
FILES = sorted(EXAMPLES.rglob("*.eds"))
MODELS = ("f-palette", "motor-core-unit", "epos")
PROFILE = frozenset(range(0x6000, 0xA000))
ALL = ConformancePlan(Level.INTRUSIVE, confirm=yes)
MUST_PASS = {
    "f-palette": {"PR-01", "PR-11", *(f"IO-{number:02}" for number in (*range(2, 13), 15))},
    "epos": {"D4-11", "D4-13"},
}
"""Checks of models that are not applicable without a hand, or without leave to write."""


class StrictEcho(CanopenEcho):
    """The echo with NMT as CiA 301 has it."""

    strict_cia301 = True


def eds_of(model: str) -> Path:
    return EXAMPLES / "eds" / f"{model}.eds"


@pytest.mark.parametrize("model", MODELS)
def test_nothing_fails_at_a_model(model: str) -> None:
    judged = Judged.of(model)
    before = judged.values()
    report = judged.judge(ALL, eds_of(model))
    assert not_harmless(report) == []
    assert report.count(CheckVerdict.PASS) > 500
    assert report.unrestored == ()
    assert judged.values() == before


@pytest.mark.parametrize("path", FILES, ids=[path.stem for path in FILES])
def test_nothing_fails_at_a_device_of_an_example(path: Path) -> None:
    judged = Judged.of(path)
    before = judged.values()
    report = judged.judge(ALL, path)
    assert not_harmless(report) == []
    assert judged.values() == before


@pytest.mark.parametrize("model", MODELS)
def test_nothing_fails_without_an_eds(model: str) -> None:
    judged = Judged.of(model)
    before = judged.values()
    report = judged.judge(ConformancePlan(Level.COMMUNICATION))
    assert not_harmless(report) == []
    assert report.count(CheckVerdict.PASS) > 100
    assert judged.values() == before


def test_a_component_that_keeps_to_cia_301_fails_nothing() -> None:
    judged = Judged(make_device_rtc(StrictEcho, 48))
    assert not_harmless(judged.judge(ALL, eds_of("rtc-echo"))) == []


def test_the_component_of_the_report_leaves_error_by_a_reset_alone() -> None:
    report = Judged.of("rtc-echo").judge(ALL, eds_of("rtc-echo"))
    failed = [r.check.id for r in report.results if r.outcome.verdict is CheckVerdict.FAIL]
    assert failed == ["NMT-13", "NMT-17"]


@pytest.mark.parametrize("device", [*MODELS, *FILES], ids=lambda device: Path(device).stem)
def test_nothing_fails_with_all_allowed_and_hands_at_the_inputs(device: Path | str) -> None:
    judged = Judged.of(device)
    path = device if isinstance(device, Path) else eds_of(device)
    plan = ConformancePlan(
        Level.INTRUSIVE, (), PROFILE, stimulus=SlaveStimulus(judged.slave), confirm=yes
    )
    report = judged.judge(plan, path)
    assert not_harmless(report) == []
    passed = {each.check.id for each in report.results if each.outcome.verdict is CheckVerdict.PASS}
    assert passed >= MUST_PASS.get(str(device), set())


def test_what_the_tester_quiets_is_compared_with_what_was_there_before() -> None:
    report = Judged.of("epos").judge(
        ConformancePlan(Level.INTRUSIVE, ("OD-1800*",), confirm=yes), eds_of("epos")
    )
    assert report.count(CheckVerdict.IMPLEMENTATION_DEFINED) == 0
    assert report.count(CheckVerdict.PASS) > 10
