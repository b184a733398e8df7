from __future__ import annotations

import json
import re
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.testing.report.html_tree import Element, parse_page
from tests.emulators.testing.report.real_runs import DRIVE, GOLDEN, MOVE, run_epos, run_rrc
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
from tickrig.emulators.testing.report.report_file import from_json, to_json

RUN = RunEnvironment("2026-11-22 14:00", "virtual", 7, "rig.toml", "[device.rrc]\n")
STOPS = "tests/test_chair.py::test_a_pulled_bus_stops_the_chair"
NOISE = "tests/test_chair.py::test_the_rrc_answers_through_noise"
WHEEL = "tests/test_wheel.py::test_a_blocked_shaft_is_told"


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> BenchReport:
    """Report of three runs that have happened."""
    folder = tmp_path_factory.mktemp("real")
    faults = (GOLDEN / "faults.txt").read_text("ascii")
    stops = run_rrc(STOPS, DRIVE, folder / "stops.trace")
    noise = run_rrc(NOISE, faults, folder / "noise.trace")
    wheel = run_epos(WHEEL, MOVE, folder / "wheel.log")
    tests = (
        replace(stops, requirements=("SAF-12",), command=f"pytest {STOPS}", seed=7),
        replace(noise, requirements=("SAF-12", "COM-4"), longrepr="E  no line 'RRC'\n"),
        replace(wheel, requirements=("SAF-9",), expected="an EMCY within 800 ms"),
        TestRecord("tests/test_wheel.py::test_real", Outcome.BLOCKED, reason="14 ms late"),
    )
    named = Requirement("SAF-12", "A pulled bus stops the chair"), Requirement("SAF-30")
    return BenchReport("Wheelchair", (RUN,), tests, named)


@pytest.fixture(scope="module")
def page(real: BenchReport) -> Element:
    return parse_page(html_page(real))


def test_of(page: Element, nodeid: str) -> Element:
    found = [test for test in page.by_class("test") if test.by_class("nodeid")[0].text == nodeid]
    assert len(found) == 1
    return found[0]


test_of.__test__ = False  # type: ignore[attr-defined] # pytest: no test


def one(report: TestRecord) -> Element:
    return parse_page(html_page(BenchReport(runs=(RUN,), tests=(report,))))


def test_the_head_counts_and_sets_blocked_apart(page: Element) -> None:
    header = page.all("header")[0]
    assert header.by_class("verdict")[0].words == "1 failed 1 blocked 2 passed of 4 tests"
    assert "Blocked is not failed" in header.words
    assert "2026-11-22 14:00 · virtual · seed 7 · rig.toml" in header.words


def test_what_needs_a_look_comes_first_with_its_reason(page: Element) -> None:
    failed, blocked = page.all(id="look")[0].all("li")
    assert failed.words.startswith("failed test_the_rrc_answers_through_noise")
    assert "no line 'RRC' within 50 ms of 1.510000" in failed.words
    assert blocked.words == "blocked test_real 14 ms late"


def test_a_requirement_that_no_test_has_shown_stands_out(page: Element) -> None:
    rows = page.by_class("requirements")[0].all("tr")[1:]
    told = [row.words for row in rows]
    assert told == [
        "COM-4 not among the requirements failed 0 of 1",
        "SAF-12 A pulled bus stops the chair failed 1 of 2",
        "SAF-30 not shown 0 of 0 no test names it",
        "SAF-9 not among the requirements shown 1 of 1",
    ]
    assert [row.attributes["class"] for row in rows] == ["failed", "failed", "not-shown", "shown"]
    cells = rows[1].by_class("cell")
    assert [cell.attributes["aria-label"] for cell in cells] == [
        "test_a_pulled_bus_stops_the_chair: passed",
        "test_the_rrc_answers_through_noise: failed",
    ]


def test_a_test_tells_what_was_asked_and_how_to_repeat_it(page: Element) -> None:
    test = test_of(page, STOPS)
    facts = test.by_class("facts")[0]
    heads = [head.words for head in facts.all("dt")]
    told = dict(zip(heads, (text.words for text in facts.all("dd")), strict=True))
    assert told["Fault plan"] == "bus_unplugged from 0.8 s to 1.2 s"
    assert told["Repeat"] == f"pytest {STOPS} Copy"
    assert (told["Seed"], told["Kept"]) == ("7", "stops.trace")
    wheel = test_of(page, WHEEL).by_class("facts")[0].words
    assert wheel.startswith("Expected an EMCY within 800 ms")


def test_a_folded_row_shows_the_faults_of_its_test(page: Element) -> None:
    (summary,) = test_of(page, STOPS).all("summary")[:1]
    assert "bus_unplugged" in summary.words
    many = tuple(PlannedFault(f"fault{n}") for n in range(5))
    (summary,) = (
        one(TestRecord("t.py::t", Outcome.PASSED, faults=many))
        .by_class("test")[0]
        .all("summary")[:1]
    )
    assert "fault0 fault1 fault2 and 2 more faults" in summary.words
    assert "fault3" not in summary.words


def test_the_fault_plan_tells_what_came_of_each_order() -> None:
    faults = (
        PlannedFault("cut", 1_200_000, 1_400_000, "the 3rd OK:output", 100_000),
        PlannedFault("drop=0.5", None, None, "5 s", 0),
        PlannedFault("flip=0.1", 2_000_000, None, ordered_us=10_000),
    )
    facts = one(TestRecord("t.py::t", Outcome.PASSED, faults=faults)).by_class("facts")[0]
    assert [line.words for line in facts.all("li")] == [
        "cut ordered at 0.1 s, at the 3rd OK:output from 1.2 s to 1.4 s",
        "drop=0.5 ordered at 0 s, at 5 s: did not come",
        "flip=0.1 ordered at 0.01 s, from 2 s on",
    ]


def test_the_journal_is_what_the_transcript_said(page: Element) -> None:
    lines = [line.text for line in test_of(page, STOPS).by_class("journal")[0].all("li")]
    assert lines[-3:] == [
        "0.900000 * state PowerOffByOthers",
        "0.902865 < EV:PowerOffWaitByNoCommunication",
        "1.200000 ! bus_unplugged=0",
    ]


def test_the_trace_is_on_the_page_to_the_byte(page: Element, real: BenchReport) -> None:
    for record in real.tests[:3]:
        (trace,) = test_of(page, record.nodeid).by_class("trace")
        assert trace.all("pre")[0].text == record.trace
        assert trace.all("button")[0].attributes["data-save"].endswith(".trace")


def test_faults_and_values_share_an_axis(page: Element) -> None:
    figure = test_of(page, STOPS).by_class("timeline")[0]
    (fault,) = figure.by_class("fault")
    assert (fault.attributes["x"], fault.attributes["width"]) == ("57.14%", "28.57%")
    bands = figure.by_class("band")
    lanes = [lane for lane in figure.by_class("lane") if not lane.by_class("axis")]
    assert len(bands) == len(lanes) - 1  # one in each but the axis
    assert {band.attributes["x"] for band in bands} == {"57.14%"}
    names = [lane.all("b")[0].text for lane in lanes if lane.all("b")]
    assert names == [
        "faults",
        "actions",
        "state",
        "stick_v_pct",
        "out_v_pct",
        "out_w_pct",
        "buzzer",
    ]
    states = [word.all("text")[0].text for word in lanes[2].by_class("word")]
    assert states == ["WaitPowerOn", "Standby", "Limit", "PowerOffByOthers"]


def test_a_drive_has_lines_and_its_values_as_a_table(page: Element) -> None:
    figure = test_of(page, WHEEL).by_class("timeline")[0]
    curves = [lane for lane in figure.by_class("lane") if lane.all("path")]
    assert [lane.all("b")[0].text for lane in curves] == [
        "shaft_deg_s",
        "position",
        "current_a",
        "winding_c",
    ]
    assert all("L" in lane.all("path")[0].attributes["d"] for lane in (curves[0], curves[2]))
    rows = [row.words for row in figure.all("table")[0].all("tr")[1:]]
    assert rows[0].startswith("drive_state ")
    assert re.fullmatch(r"current_a A 0 -?[\d.]+ 9\.[\d]+ [\d.-]+ \d+", rows[3])


def test_every_link_of_a_page_leads_somewhere_on_it(page: Element) -> None:
    ids = [one.attributes["id"] for one in page.below() if "id" in one.attributes]
    assert len(ids) == len(set(ids))
    for link in page.all("a"):
        assert link.attributes["href"].startswith("#")
        assert link.attributes["href"][1:] in ids
    for use in page.all("use"):
        assert use.attributes["href"][1:] in ids
    for named in (one for one in page.below() if "aria-labelledby" in one.attributes):
        assert named.attributes["aria-labelledby"] in ids


def test_a_page_is_readable_by_a_screen_reader(page: Element) -> None:
    assert page.all("html")[0].attributes["lang"] == "en"
    assert [len(page.all(mark)) for mark in ("header", "nav", "main", "footer", "h1")] == [1] * 5
    for table in page.all("table"):
        assert all(head.attributes["scope"] for head in table.all("th"))
    for plot in page.by_class("plot"):
        assert "aria-label" in plot.attributes or "aria-hidden" in plot.attributes
    for box in (*page.all("pre"), *page.by_class("journal")):
        assert box.attributes["tabindex"] == "0"
        assert box.attributes["aria-label"]
    levels = [int(one.tag[1]) for one in page.below() if re.fullmatch(r"h\d", one.tag)]
    assert all(later - before <= 1 for before, later in pairwise(levels))


def test_only_our_style_and_script_run_and_nothing_is_fetched(page: Element) -> None:
    (policy,) = page.all("meta", http_equiv="Content-Security-Policy") or [
        meta for meta in page.all("meta") if "http-equiv" in meta.attributes
    ]
    allowed = policy.attributes["content"]
    assert allowed.startswith("default-src 'none';")
    for tag, source in (("style", "style-src"), ("script", "script-src")):
        (element,) = page.all(tag)
        digest = b64encode(sha256(element.text.encode()).digest()).decode()
        assert f"{source} 'sha256-{digest}'" in allowed
        assert not element.attributes
    for element in page.below():
        assert not {"src", "style", "srcset", "action", "data"} & element.attributes.keys()
        assert not any(name.startswith("on") for name in element.attributes)
    assert "http://" not in page.text
    assert "https://" not in page.text


EVIL = "</script><script>alert(1)</script>\"'><img src=x onerror=alert(2)>{{7*7}}{% raw %}&amp;"
HOSTILE = TestRecord(
    f"tests/{EVIL}.py::test[{EVIL}]",
    Outcome.FAILED,
    mode=EVIL,
    requirements=(EVIL,),
    markers=(EVIL,),
    expected=EVIL,
    reason=EVIL,
    longrepr=EVIL,
    command=EVIL,
    faults=(PlannedFault(EVIL, 0, 1_000, EVIL), PlannedFault(EVIL, when=EVIL)),
    journal=(JournalLine(0, EVIL, "<", EVIL), JournalLine(1, EVIL, "!", EVIL)),
    series=(
        SignalSeries(EVIL, EVIL, ((0, 0), (1, 1))),
        SignalSeries(EVIL, EVIL, ((0, EVIL), (1, "b"))),
    ),
    trace=EVIL,
    artefacts=(EVIL,),
)


def shape(element: Element) -> list[tuple[str, tuple[str, ...]]]:
    """Return what an attacker must not change: which elements with which attributes there are."""
    return [(one.tag, tuple(one.attributes)) for one in element.below()]


def hostile_report(text: str) -> BenchReport:
    """Return a report in which everything is this text."""
    run = RunEnvironment(EVIL, EVIL, 1, EVIL, EVIL, EVIL, EVIL, EVIL)
    report = BenchReport(EVIL, (run,), (HOSTILE,), (Requirement(EVIL, EVIL),))
    word = json.dumps(EVIL)[1:-1]
    return from_json(to_json(report).replace(word, json.dumps(text)[1:-1]))


def test_nothing_from_a_test_is_markup() -> None:
    tame, evil = (parse_page(html_page(hostile_report(text))) for text in ("tame", EVIL))
    assert shape(evil) == shape(tame)
    for element in evil.by_class("test")[0].below():
        assert "alert" not in " ".join(element.attributes)
    assert evil.by_class("trace")[0].all("pre")[0].text == EVIL
    assert evil.by_class("reason")[0].text == EVIL
    assert evil.all("h1")[0].text == EVIL


@pytest.fixture(scope="module")
def tame() -> list[tuple[str, tuple[str, ...]]]:
    return shape(parse_page(html_page(hostile_report("tame"))))


@settings(max_examples=25, deadline=None)
@given(text=st.text(min_size=1, max_size=40))
def test_any_text_is_only_text(text: str, tame: list[tuple[str, tuple[str, ...]]]) -> None:
    assert shape(parse_page(html_page(hostile_report(f"a{text}b")))) == tame


def test_what_cannot_be_seen_is_shown() -> None:
    page = one(TestRecord("t.py::t", Outcome.FAILED, reason="\x1b[31m\u202egnp.exe\x00\ud800"))
    assert page.by_class("reason")[0].text == "␛[31m<U+202E>gnp.exe␀<U+D800>"


def test_a_report_of_no_test_says_so() -> None:
    page = parse_page(html_page(BenchReport()))
    assert page.all("header")[0].by_class("verdict")[0].words == "No test was run."
    assert page.by_class("empty")[0].words == "No test was run."
    assert not page.all("table")


def test_merged_runs_are_told_apart(real: BenchReport) -> None:
    late = replace(real.tests[0], mode="real", outcome=Outcome.BLOCKED, reason="12 ms late")
    pty = BenchReport("", (replace(RUN, mode="real"),), (late,))
    page = parse_page(html_page(merge_reports([real, pty])))
    assert "2 runs : virtual, real" in page.all("header")[0].words
    blocked = page.all(id="look")[0].all("li")[-1]
    assert blocked.words == "blocked test_a_pulled_bus_stops_the_chair real 12 ms late"
    row = page.by_class("requirements")[0].all("tr")[2]
    assert [cell.attributes["title"].rpartition(" ")[2] for cell in row.by_class("cell")] == [
        "(virtual)",
        "(virtual)",
        "(real)",
    ]
    both = page.by_class("file")[0].by_class("test")[:2]
    assert [test.by_class("mode")[0].text for test in both] == ["virtual", "real"]
    assert both[1].by_class("facts")[0].all("a")[0].attributes["href"] == "#run-2"


def test_equal_names_have_anchors_of_their_own() -> None:
    names = ("a.py::t[1]", "a.py::t[1]", "a.py::t-1", "a.py::t-1-2", "a.py::" + "x" * 300)
    tests = tuple(TestRecord(name, Outcome.PASSED) for name in names)
    page = parse_page(html_page(BenchReport(runs=(RUN,), tests=tests)))
    ids = [test.attributes["id"] for test in page.by_class("test")]
    assert len(set(ids)) == len(names)
    assert ids[:2] == ["t-a-py-t-1", "t-a-py-t-1-2"]
    assert max(map(len, ids)) < 130


def test_what_has_no_room_is_named_and_failed_tests_come_first() -> None:
    lines = tuple(JournalLine(n, "", "<", "x" * 50) for n in range(300))
    test = TestRecord("a.py::a", Outcome.PASSED, journal=lines, trace="0.000000 .\n" * 100_000)
    failed = replace(test, nodeid="a.py::b", outcome=Outcome.FAILED)
    report = BenchReport(runs=(RUN,), tests=(test, failed))
    passed_test, failed_test = parse_page(html_page(report, 300_000)).by_class("test")
    assert "Last 200 lines 100 earlier ones left out" in failed_test.words
    assert len(failed_test.by_class("journal")[0].all("li")) == 200
    assert "Not on this page, for its size: the last 844 kB of the trace." in failed_test.words
    assert "Not on this page, for its size: the trace, 1.1 MB." in passed_test.words
    text = html_page(report, 1_000)
    assert len(text) < 40_000
    assert "the trace, 1.1 MB; 300 journal lines." in text


def test_a_long_line_is_cut_and_says_so() -> None:
    page = one(TestRecord("t", Outcome.PASSED, journal=(JournalLine(0, "", "<", "y" * 5_000),)))
    assert page.by_class("journal")[0].words.endswith("yyy … 3000 more")


def test_failed_tests_are_unfolded_unless_there_are_many() -> None:
    test = TestRecord("a.py::a", Outcome.FAILED)
    for number, opened in ((12, 12), (13, 0)):
        page = parse_page(html_page(BenchReport(runs=(RUN,), tests=(test,) * number)))
        assert sum("open" in one.attributes for one in page.by_class("test")) == opened


def test_a_page_is_the_same_each_time(real: BenchReport, tmp_path: Path) -> None:
    again = run_epos(WHEEL, MOVE, tmp_path / "wheel.log")
    tests = list(real.tests)
    tests[2] = replace(again, requirements=("SAF-9",), expected="an EMCY within 800 ms")
    assert html_page(replace(real, tests=tuple(tests))) == html_page(real)


def luminance(colour: str) -> float:
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def tinted(colour: str, paper: str, share: float) -> str:
    pairs = [(int(colour[at : at + 2], 16), int(paper[at : at + 2], 16)) for at in (1, 3, 5)]
    return "#" + "".join(f"{round(a * share + b * (1 - share)):02x}" for a, b in pairs)


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_texts_have_contrast(page: Element, theme: int) -> None:
    """WCAG 2.2, 1.4.3 (AA): 4.5 to 1."""
    found = re.findall(r"--([\w-]+): light-dark\((#\w+), (#\w+)\)", page.all("style")[0].text)
    colours = {name: pair[theme] for name, *pair in found}
    papers = [colours["paper"], colours["panel"]]
    outcomes = [outcome.value for outcome in Outcome]
    pairs = [
        (name, colours[name], paper)
        for name in ("ink", "quiet", "link", "curve", *outcomes)
        for paper in (*papers, tinted(colours[name], papers[0], 0.12))
    ]
    words = (colours["word"], colours["word-odd"], tinted(colours["band"], papers[0], 0.4))
    pairs += [("ink", colours["ink"], paper) for paper in words]
    for name, colour, paper in pairs:
        darker, lighter = sorted((luminance(colour), luminance(paper)))
        assert (lighter + 0.05) / (darker + 0.05) >= 4.5, f"{name} {colour} on {paper}"
