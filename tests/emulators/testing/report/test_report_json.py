from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.emulators.testing.report import report_file
from tickrig.emulators.testing.report.bench_report import (
    BenchReport,
    JournalLine,
    Outcome,
    PlannedFault,
    Requirement,
    RunEnvironment,
    SignalSeries,
    TestRecord,
    merge_reports,
)
from tickrig.emulators.testing.report.page import html_page
from tickrig.emulators.testing.report.report_file import (
    ReportError,
    from_data,
    from_json,
    to_data,
    to_json,
)

RUN = RunEnvironment("2026-11-22 14:00", "virtual", 7, "rig.toml", "[device.rrc]\n")
TEST = TestRecord(
    "tests/test_stop.py::test_it_stops[fast]",
    Outcome.FAILED,
    mode="virtual",
    virtual_us=2_000_000,
    wall_us=3_100,
    requirements=("SAF-12",),
    faults=(PlannedFault("cut", 1_000_000), PlannedFault("noise", when="3rd OK")),
    journal=(JournalLine(10_000, "rrc", "<", "EV:Initialized"),),
    series=(SignalSeries("v", "m/s", ((0, 0), (1, 0.5), (2, "x"), (3, None)), steps=False),),
    artefacts=("stop.trace",),
)
REPORT = BenchReport("Night", (RUN,), (TEST,), (Requirement("SAF-12", "stops"),))


def test_a_report_comes_back_from_its_json() -> None:
    assert from_json(to_json(REPORT)) == REPORT


def test_a_worker_hands_over_what_json_has() -> None:
    data = to_data(TEST)
    assert from_data(TestRecord, json.loads(json.dumps(data))) == TEST
    assert from_data(TestRecord, data) == TEST


def test_what_is_left_out_has_its_default() -> None:
    text = '{"tickrig-report": 1, "runs": [{"date": ""}], "tests": [{"nodeid": "a", "outcome":'
    assert from_json(f'{text} "blocked"}}]}}').tests == (TestRecord("a", Outcome.BLOCKED),)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("{", "not JSON: Expecting property name"),
        ("[" * 100_000, "not JSON: "),
        ("[]", "no report: there is no key 'tickrig-report'"),
        ('{"tickrig-report": 2}', "report version 2; this program reads 1"),
        ('{"tickrig-report": 1, "pages": 1}', ": unknown key 'pages'"),
        ('{"tickrig-report": 1, "tests": {}}', ".tests: {} is no list of values"),
        ('{"tickrig-report": 1, "tests": [3]}', ".tests[0]: 3 is no object"),
        ('{"tickrig-report": 1, "runs": [{}]}', ".runs[0]: no date"),
        (
            to_json(REPORT).replace('"failed"', '"lost"'),
            ".tests[0].outcome: 'lost' is not one of failed, error, blocked, passed, skipped",
        ),
        (
            to_json(REPORT).replace("[10000,", "[true,"),
            ".tests[0].journal[0][0]: True is not a whole number",
        ),
        (
            to_json(REPORT).replace("[1,0.5]", "[1,{}]"),
            ".tests[0].series[0].points[1][1]: {} is not a number or a text or null",
        ),
        (to_json(REPORT).replace("[0,0],", "[0,0,0],"), "points[0]: [0, 0, 0] is no list of 2"),
        (
            to_json(REPORT).replace("[10000,", f"[{10**400},"),
            ".tests[0].journal[0][0]: a number of 1329 bits is too large",
        ),
        (to_json(REPORT).replace("[0,0],", "[9,0],"), "series[0]: v: 1 us comes after 9 us"),
        (to_json(REPORT).replace('"run":0', '"run":1'), "test_it_stops[fast]: there is no run 1"),
    ],
)
def test_what_is_no_report_says_where_and_why(text: str, error: str) -> None:
    with pytest.raises(ReportError) as caught:
        from_json(text)
    assert error in str(caught.value)
    assert "\n" not in str(caught.value)


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)


@settings(deadline=None)
@given(st.data())
def test_a_report_with_anything_in_it_is_read_or_refused(data: st.DataObject) -> None:
    changed = json.loads(to_json(REPORT))
    place = changed
    while isinstance(place, dict | list) and place:
        keys = list(place) if isinstance(place, dict) else range(len(place))
        key = data.draw(st.sampled_from(list(keys)))
        if not isinstance(place[key], dict | list) or data.draw(st.booleans()):
            place[key] = data.draw(ANYTHING)
            break
        place = place[key]
    try:
        report = from_json(json.dumps(changed))
    except ReportError:
        return
    assert from_json(to_json(report)) == report
    assert html_page(report)


def test_a_value_that_is_no_number_is_unknown() -> None:
    series = SignalSeries("v", points=((0, float("nan")), (1, float("inf")), (2, 1.5)))
    assert series.points == ((0, None), (1, None), (2, 1.5))
    assert "NaN" not in to_json(replace(REPORT, tests=(replace(TEST, series=(series,)),)))


def test_a_switch_is_a_number() -> None:
    series = SignalSeries("on", points=((0, False), (1, True)))
    assert [type(value) for _, value in series.points] == [int, int]
    assert from_data(SignalSeries, to_data(series)) == series


def test_reports_of_workers_become_one() -> None:
    others = replace(TEST, nodeid="other"), replace(TEST, nodeid="real", run=1)
    real = replace(RUN, mode="real")
    second = BenchReport("Late", (RUN, real), others, (Requirement("SAF-13"),))
    third = BenchReport(
        "", (real,), (replace(TEST, nodeid="again"),), (Requirement("SAF-13", "x"),)
    )
    merged = merge_reports([REPORT, second, third])
    assert merged.title == "Night"
    assert merged.runs == (RUN, real)
    assert [(test.nodeid, test.run) for test in merged.tests] == [
        (TEST.nodeid, 0),
        ("other", 0),
        ("real", 1),
        ("again", 1),
    ]
    assert merged.requirements == (Requirement("SAF-12", "stops"), Requirement("SAF-13", "x"))
    assert merge_reports([]) == BenchReport()


def test_an_environment_knows_its_machine() -> None:
    here = RunEnvironment("today", seed=3).of_this_machine()
    assert (here.date, here.seed) == ("today", 3)
    assert all((here.tickrig, here.python, here.platform))


PIECES = st.one_of(
    st.sampled_from([*"[]{},: \n", "", "null", "true", "1", "-1", "1e400", "NaN", "0.5", '"x"']),
    st.sampled_from(['"tests":[]', '"tests":[{}]', '"run":7', f"{2**63}", "[1,2]", '["a","b"]']),
)


def how_it_ends(read: Callable[[str], BenchReport], text: str) -> object:
    try:
        return read(text)
    except ReportError as error:
        return str(error)


@given(st.data())
def test_what_is_read_test_by_test_is_what_is_read_as_a_whole(data: st.DataObject) -> None:
    text = to_json(replace(REPORT, tests=REPORT.tests * 2))
    for _ in range(data.draw(st.integers(0, 3))):
        begin = data.draw(st.integers(0, len(text)))
        end = begin + data.draw(st.integers(0, 4))
        text = text[:begin] + data.draw(PIECES) + text[end:]
    assert how_it_ends(from_json, text) == how_it_ends(report_file._any_json, text)


@pytest.mark.parametrize("row", ["[1,2,3,4]", '[1,"a","b"]', f'[{2**63},"a","b","c"]', "[]", "7"])
def test_a_wrong_line_of_a_journal_is_named(row: str) -> None:
    lines = f'[1,"a","<","b"],{row},[2,"a","<","b"]'
    test = f'{{"nodeid":"x","outcome":"passed","journal":[{lines}]}}'
    text = f'{{"tickrig-report":1,"runs":[{{"date":"d"}}],"tests":[{test}]}}'
    with pytest.raises(ReportError, match=r"^\.tests\[0\]\.journal\[1\]"):
        from_json(text)


def test_values_that_come_again_keep_their_type_and_sign() -> None:
    points = ((1, 0.0), (2, -0.0), (3, 1.0), (4, 1.0))
    mixed = ((1, 1), (2, 1.0), (3, 2), (4, "1"))
    series = (SignalSeries("speed", "", points), SignalSeries("state", "", mixed))
    record = replace(REPORT.tests[0], series=series)
    text = to_json(replace(REPORT, tests=(record, record)))
    assert to_json(from_json(text)) == text


@pytest.mark.parametrize("cut", range(0, 60, 7))
def test_a_report_is_read_in_pieces_of_any_size(cut: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report_file, "_PIECE", cut + 1)
    assert from_json(to_json(REPORT)) == REPORT
