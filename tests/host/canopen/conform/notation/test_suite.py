from __future__ import annotations

import re

import pytest

from tests.environment import ROOT
from tests.host.canopen.conform.r1 import R1
from tickrig.host.canopen.conform.check import (
    Check,
    ConformancePlan,
    Count,
    Expect,
    ExpectNone,
    Forget,
    Level,
    Macro,
    Read,
    ReadOther,
    RefuseRead,
    Send,
    Wait,
)
from tickrig.host.canopen.conform.notation import NAME, parse_step
from tickrig.host.canopen.conform.suite import ORDER, parse_group, read_suite, suite_checks

CHECKS = suite_checks()
SOURCE = re.compile(r"(practice: .+; )?CiA \d{3}(-\d)? v\d\.\d\.\d, .+|practice: .+")
READS = (Read, ReadOther, RefuseRead, Send, Expect, ExpectNone, Count, Wait, Forget, Macro)


def words_of(check: Check) -> str:
    return " ".join(str(step) for step in check.steps)


def test_groups_come_in_the_order_in_which_they_are_judged() -> None:
    assert tuple(group.name for group in read_suite()) == ORDER


def test_an_id_is_of_its_group_and_of_one_check() -> None:
    ids = [check.id for check in CHECKS]
    assert len(set(ids)) == len(ids)
    assert all(check.id.startswith(f"{check.group}-") for check in CHECKS)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.id)
def test_each_check_names_its_clause(check: Check) -> None:
    assert SOURCE.fullmatch(check.source), check.source


def test_what_only_reads_has_no_step_that_writes() -> None:
    reading = [check for check in CHECKS if check.level is Level.READ_ONLY]
    assert len(reading) > 30
    actions = [step.action for check in reading for step in check.steps]
    assert all(isinstance(action, READS) for action in actions)
    macros = {action.name for action in actions if isinstance(action, Macro)}
    assert macros == {"upload", "blockup"}


def test_each_name_stands_for_something_on_some_node() -> None:
    report = R1(("1029", "1F80")).judge(
        ConformancePlan(Level.INTRUSIVE, confirm=lambda question: True)
    )
    reasons = {result.check.id: result.outcome.reason for result in report.results}
    named = [check for check in CHECKS if NAME.search(words_of(check))]
    assert len(named) > 200
    assert not [name for name, reason in reasons.items() if "no check has such a name" in reason]


@pytest.mark.parametrize("line", ["", "sleep 5", "> ", "write 1017:00", "wait 5", "none on 705"])
def test_a_line_that_is_no_step_is_refused(line: str) -> None:
    with pytest.raises(
        ValueError, match=r"is not a step; docs/reference/canopen/conform\.md has the notation"
    ):
        parse_step(line)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("NMT-03 title", "is not a head like 'group: NMT, what it is about'"),
        ("group: NMT, states\n\ntitle alone", "is not a head like 'NMT-03 what conforming means'"),
        ("group: NMT, states\n\nNMT-03 title\nwait 5 ms", "NMT-03 has no level and no source"),
    ],
)
def test_a_file_that_is_no_group_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=re.escape(reason)):
        parse_group(text)


def test_the_readme_says_how_many_there_are() -> None:
    said = re.search(r"more than (\d+) checks by clause", (ROOT / "README.md").read_text("utf-8"))
    assert said is not None
    assert 0 < len(CHECKS) - int(said[1]) < 30
