"""What the tester says of two foreign stacks, beside what the 172 public checks said."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from tests.emulators.testing.conformance.stacks import judge_durand, judge_local_node, judge_ours
from tests.emulators.testing.conformance.verdict_page import FOREIGN, PAGE
from tests.emulators.testing.conformance.verdict_table import compare, read_table
from tickrig.host.canopen.conform.suite import suite_checks
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report

pytestmark = pytest.mark.unmeasured

LEAST = 0.95
GROUPS = (
    *("UE", "US", "BU", "DE", "DS", "BD", "SG", "NMT", "HB", "NG", "PC", "PR", "SY", "EM"),
    *("IO", "D4", "ST", "LS"),
)


def test_our_slave_has_no_failure() -> None:
    report = judge_ours()
    assert [
        one.check.id for one in report.results if one.outcome.verdict is CheckVerdict.FAIL
    ] == []
    assert report.exit_status == 0


@pytest.mark.parametrize(
    ("stack", "judge"), [("LocalNode", judge_local_node), ("durand", judge_durand)]
)
def test_the_verdicts_are_those_of_the_public_checks(
    stack: str, judge: Callable[[tuple[str, ...]], Report]
) -> None:
    report = judge(GROUPS)
    assert report.count(CheckVerdict.BLOCKED) == 0
    found = compare(report, read_table(stack))
    assert found.both >= 75
    assert found.same >= LEAST * found.both
    assert {one.check_id for one in found.differences} <= found.explained, "each has its reason"


def test_the_page_tells_of_these_stacks() -> None:
    text = PAGE.read_text("utf-8")
    for stack, name, _ in FOREIGN:
        assert f"## {name}\n" in text, "run tools/conform-stacks"
        assert f"another tester, with {len(read_table(stack)) - 1} checks." in text
    known = {check.id for check in suite_checks()}
    named = set(re.findall(r"^\| ([A-Z0-9]+-\d+): ", text, re.MULTILINE))
    assert named
    assert named <= known
