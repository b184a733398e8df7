from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import fromstring

import pytest

from tests.emulators.testing.report.html_tree import parse_page
from tests.host.canopen.conform.defects.defect import Defect
from tests.host.canopen.conform.defects.table import DEFECTS
from tests.host.canopen.conform.defects.test_found import DefectiveR1, judge
from tests.host.canopen.conform.report.sample import EVIDENCE, HOSTILE, SAMPLE, result
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.sequence import SequenceRun, TomlSequence
from tickrig.host.canopen.conform.check import RefuseRead, Send, Step
from tickrig.host.canopen.conform.report.baseline import Baseline, baseline_text
from tickrig.host.canopen.conform.report.ci import badge, report_junit
from tickrig.host.canopen.conform.report.issue import issue_text
from tickrig.host.canopen.conform.report.page import html_page
from tickrig.host.canopen.conform.report.report_json import report_json
from tickrig.host.canopen.conform.report.text import text_report
from tickrig.host.canopen.conform.verdict import CheckOutcome, CheckVerdict, Report, Result

KNOWN = Baseline(frozenset({"NMT-11", "LS-02", "XX-99"}))
MANY = replace(SAMPLE, results=tuple(result(f"UE-{n}", CheckVerdict.FAIL, "no") for n in range(30)))


def test_the_text_has_a_line_a_group_and_failures_with_frames_and_what_to_look_at() -> None:
    text = text_report(SAMPLE, again="canmon conform can0 --node 5")
    assert re.search(r"^NMT  NMT state machine and boot-up +2: 1 pass, 1 fail$", text, re.MULTILINE)
    assert re.search(
        r"^HB   Heartbeat producer and consumer +3: 2 not applicable, 1 inconclusive$",
        text,
        re.MULTILINE,
    )
    failure = text[text.index("FAIL NMT-11") :].split("\n\n")[0]
    assert failure.splitlines() == [
        "FAIL NMT-11: what NMT-11 wants",
        "  CiA 301 v4.2, 7.2.3.1",
        "  got 585#4B01200034120000, want 585#4B0120000000....",
        " (001.000000)  >  605   [8]  40 01 20 00 00 00 00 00",
        " (001.001250)  <  585   [8]  4B 01 20 00 34 12 00 00",
        " (001.001300)  #  power cycle",
        " (001.002000)  >  705   [1]  remote request",
        " (001.003000)  <  0000017F   [0]",
        "  look at the table of NMT states: which command leads where, and what it resets",
        "  alone: canmon conform can0 --node 5 --only NMT-11",
    ]
    assert "    2  1016h is not there" in text
    assert "not restored:\n  1017h: 100 was written" in text
    assert "findings:\n  1800h" in text


def test_the_worst_is_told_last_where_a_terminal_ends() -> None:
    assert text_report(SAMPLE).splitlines()[-1] == (
        "8 checks: 2 pass, 1 fail, 2 not applicable, 1 implementation-defined,"
        " 1 inconclusive, 1 blocked"
    )


def test_of_many_failures_the_last_ones_are_told_without_their_frames() -> None:
    text = text_report(MANY, again="canmon conform can0 --node 5")
    assert text.count("FAIL UE-") == 30
    assert text.count("look at") == 20
    assert "\n\n10 more, without their frames; --html FILE and --json have them:\n\n" in text
    last = text[text.index("FAIL UE-29") :].split("\n\n")[0]
    assert last.splitlines() == [
        "FAIL UE-29: what UE-29 wants",
        "  CiA 301 v4.2, 7.2.2.9",
        "  no",
        "  alone: canmon conform can0 --node 5 --only UE-29",
    ]


def test_a_failure_without_a_frame_is_told_by_its_name() -> None:
    silent = result("HB-01", CheckVerdict.FAIL, "no 705#7F within 220 ms", evidence=())
    assert "FAIL HB-01: what HB-01 wants" in text_report(replace(SAMPLE, results=(silent,)))


def test_a_second_go_like_the_first_is_told_once() -> None:
    later = tuple(line._replace(at_us=line.at_us + 50_000) for line in EVIDENCE)
    first = CheckOutcome(CheckVerdict.FAIL, "no", EVIDENCE)
    again = result("UE-01", CheckVerdict.FAIL, "no", first=first, evidence=later)
    report = replace(SAMPLE, results=(again,))
    for write in (text_report, report_junit, html_page):
        assert write(report).count("40 01 20 00") == 1
        assert "first: the same" in write(report)
    other = replace(first, reason="late")
    report = replace(SAMPLE, results=(replace(again, first=other),))
    for write in (text_report, report_junit, html_page):
        assert write(report).count("40 01 20 00") == 2
    assert "first: fail: late" in text_report(report)


def test_objects_that_fail_alike_are_one_cause() -> None:
    def failed(index: int, suffix: str, got: str) -> Result:
        reason = f"step {index % 7}, refuse read {index:04X}:01: got {got}, want abort 0609 0011h"
        return result(f"OD-{index:04X}-{suffix}", CheckVerdict.FAIL, reason)

    alike = [failed(index, "subs", "a value") for index in range(0x1000, 0x1020)]
    others = [failed(0x1000, "subs", "OK (60h)"), failed(0x1000, "long", "a value")]
    text = text_report(replace(SAMPLE, results=(*alike, *others)))
    assert text.count("FAIL OD-") == 3
    assert text.count("look at") == 3
    assert "  the same in 31 others: OD-1001-subs, OD-1002-subs, OD-1003-subs" in text
    assert "OD-100C-subs, and 19 more\n" in text


def test_steps_are_in_json_and_on_the_page_of_what_failed() -> None:
    steps = (Step(Send("605#40")), Step(RefuseRead("$absent_object", ("06020000",))))
    checks = [
        replace(one, check=replace(one.check, steps=steps))
        for one in (result("UE-01"), result("UE-02", CheckVerdict.FAIL))
    ]
    report = replace(SAMPLE, results=tuple(checks))
    said = json.loads(report_json(report))["checks"]
    words = ["> 605#40", "refuse read $absent_object 06020000"]
    assert [one["steps"] for one in said] == [words, words]
    (told,) = parse_page(html_page(report)).all("ol")
    assert [one.text for one in told.all("li")] == words


def test_checks_that_nobody_began_are_counted_in_a_line() -> None:
    reason = "node 5 does not answer; other nodes: none"
    silent = tuple(result(f"UE-{n}", CheckVerdict.BLOCKED, reason, evidence=()) for n in range(30))
    text = text_report(replace(SAMPLE, results=(*silent, *SAMPLE.results)))
    assert text.count("BLOCKED") == 2
    assert "\n\nBLOCKED 30 checks: node 5 does not answer; other nodes: none\n" in text
    assert "\nBLOCKED PR-03: " in text


def test_a_known_failure_is_not_shown_again_and_one_that_is_mended_is_told() -> None:
    text = text_report(SAMPLE, KNOWN)
    assert "FAIL NMT-11" not in text
    assert "1 failure known, 0 new" in text
    assert "known to fail, and passed: LS-02" in text


def test_text_of_a_device_stays_in_its_line_and_commands_no_terminal() -> None:
    text = text_report(SAMPLE)
    assert all(line.isprintable() for line in text.splitlines())
    assert not any(line.startswith("FAIL all") for line in text.splitlines())


def test_json_holds_all_that_was_seen() -> None:
    said = json.loads(report_json(SAMPLE, KNOWN))
    assert (said["v"], said["node"], said["level"]) == (1, 5, "communication")
    assert said["counts"]["fail"] == 1
    failed = said["checks"][1]
    assert failed["frames"][1] == [1_001_250, "<", "585#4B01200034120000"]
    assert (failed["verdict"], failed["known"], failed["needs"]) == (
        "fail",
        True,
        ["hbcons", "store"],
    )
    assert said["checks"][6]["first"]["reason"] == "?"
    assert said["device"]["1008h device name"] == HOSTILE


def test_junit_has_a_suite_a_group_and_a_case_a_check_for_a_foreign_reader(tmp_path: Path) -> None:
    junitparser = pytest.importorskip("junitparser", reason="of the group dev")
    path = tmp_path / "report.xml"
    path.write_text(report_junit(SAMPLE), "utf-8")
    suites = list(junitparser.JUnitXml.fromfile(str(path)))
    assert [(one.name, one.tests, one.failures, one.errors, one.skipped) for one in suites] == [
        ("NMT", 2, 1, 0, 0),
        ("HB", 3, 0, 1, 2),
        ("US", 1, 0, 0, 0),
        ("PR", 1, 0, 1, 0),
        ("LS", 1, 0, 0, 0),
    ]
    passed, failed = suites[0]
    assert (passed.is_passed, failed.is_failure) == (True, True)
    assert failed.name == "NMT-11 what NMT-11 wants"
    assert failed.time == pytest.approx(0.004)
    assert "585   [8]  4B 01 20 00 34 12 00 00" in failed.result[0].text
    assert {one.name: one.value for one in suites[0].properties()}["bit rate"] == "500000 bit/s"
    assert [case.is_skipped for case in suites[1]] == [False, True, True]


def test_junit_of_a_known_failure_is_skipped_and_a_run_that_was_cut_is_no_success() -> None:
    root = fromstring(report_junit(replace(SAMPLE, aborted="Ctrl-C"), KNOWN).encode())
    case = root.findall("testsuite")[0].findall("testcase")[1]
    skipped = case.find("skipped")
    assert skipped is not None
    assert skipped.get("message", "").startswith("known failure: got 585#")
    ended = root.find("testsuite[@name='run']/testcase/error")
    assert ended is not None
    assert ended.get("message") == "Ctrl-C"


def test_the_page_has_summary_clauses_and_each_check_with_its_frames() -> None:
    page = parse_page(html_page(SAMPLE))
    assert "1 fail" in page.by_class("verdict")[0].words
    clauses = page.all("section", id="clauses")[0].all("tbody")[0].all("tr")
    assert [row.all("th")[0].text for row in clauses] == sorted(
        {one.check.source for one in SAMPLE.results}
    )
    checks = page.all("details")
    assert [one.attributes["id"] for one in checks] == [
        f"c-{one.check.id}" for one in SAMPLE.results
    ]
    assert "605   [8]  40 01 20 00" in checks[0].all("pre")[0].text
    assert ["open" in one.attributes for one in checks] == [
        *(False, True, True, False),
        *(False, False, True, False),
    ]
    assert "First: fail" in checks[6].words
    assert "1800h" in page.all("section", id="findings")[0].text
    assert "500000 bit/s" in page.all("section", id="run")[0].text
    links = [one.attributes["href"][1:] for one in page.all("a")]
    assert set(links) <= {one.attributes.get("id") for one in page.below()}


def test_the_page_begins_with_the_groups() -> None:
    page = parse_page(html_page(SAMPLE))
    (table,) = page.all("header")[0].all("section", id="groups")
    rows = [[cell.text for cell in row.below()] for row in table.all("tbody")[0].all("tr")]
    assert [row[0].split()[0] for row in rows] == ["NMT", "HB", "US", "PR", "LS"]
    assert rows[0][0] == "NMT NMT state machine and boot-up"
    links = [link.attributes["href"] for link in table.all("a")]
    assert links == ["#g-NMT", "#g-HB", "#g-US", "#g-PR", "#g-LS"]
    assert "1 fail" not in table.text
    assert not parse_page(html_page(replace(SAMPLE, results=()))).all("section", id="groups")


def test_a_known_failure_that_passes_is_told_on_the_page() -> None:
    assert "Known to fail, and passed: LS-02" in html_page(SAMPLE, KNOWN)
    assert "Known to fail, and passed" not in html_page(SAMPLE)


def test_why_a_run_says_nothing_of_the_node_is_told_everywhere() -> None:
    doubtful = replace(SAMPLE, doubt="this EDS is of another device: vendor 1h in EDS, 2h here")
    for write in (html_page, report_json, report_junit, text_report):
        assert doubtful.doubt in write(doubtful)
    assert text_report(doubtful).splitlines()[0] == doubtful.doubt
    (told,) = parse_page(html_page(doubtful)).all("header")[0].all("b")[-1:]
    assert told.text == doubtful.doubt


def test_only_our_style_is_let_in_and_nothing_is_fetched() -> None:
    text = html_page(SAMPLE)
    page = parse_page(text)
    policy = page.all("meta")[1].attributes["content"]
    assert policy.startswith("default-src 'none'; style-src 'sha256-")
    assert not page.all("script")
    assert not re.search(r"(?:src|href)=\"(?!#)|url\(|@import", text)


def test_nothing_from_the_wire_is_markup() -> None:
    evil = replace(result(HOSTILE, CheckVerdict.FAIL, HOSTILE), first=SAMPLE.results[6].first)
    report = replace(SAMPLE, source=HOSTILE, results=(evil,), findings=(HOSTILE,), aborted=HOSTILE)
    tame = [
        (one.tag, sorted(one.attributes)) for one in parse_page(html_page(_tame(report))).below()
    ]
    wild = [(one.tag, sorted(one.attributes)) for one in parse_page(html_page(report)).below()]
    assert wild == tame
    assert "alert" in fromstring(report_junit(report).encode())[0].get("name", "")


def _elements(report: Report) -> list[tuple[str, list[str]]]:
    page = parse_page(html_page(report))
    return [(one.tag, sorted(one.attributes)) for one in page.below()]


def _tame(report: Report) -> Report:
    evil = report.results[0]
    check = replace(evil.check, id="A", group="A", title="A", source="A")
    tame = replace(evil, check=check, outcome=replace(evil.outcome, reason="A"))
    return replace(report, source="A", results=(tame,), findings=("A",), aborted="A")


def test_a_long_domain_is_cut_on_the_page_and_whole_in_json() -> None:
    long = replace(SAMPLE, results=(result("BD-01", evidence=EVIDENCE * 1_000),))
    assert "... 4801 more lines ..." in html_page(long)
    assert len(json.loads(report_json(long))["checks"][0]["frames"]) == 5_000


def test_a_badge_is_red_for_a_new_failure_alone() -> None:
    assert "2 of 3 pass" in badge(SAMPLE)
    assert "#c62828" in badge(SAMPLE)
    healthy = replace(SAMPLE, results=SAMPLE.results[:2])
    assert "#2e7d32" in badge(healthy, KNOWN)
    assert "nothing judged" in badge(replace(SAMPLE, results=()))
    assert "not all" in badge(replace(SAMPLE, aborted="Ctrl-C"))
    fromstring(badge(SAMPLE))


def test_a_baseline_is_written_and_read_back(tmp_path: Path) -> None:
    path = tmp_path / "known.txt"
    path.write_text(baseline_text(SAMPLE), "utf-8")
    baseline = Baseline.read(path)
    assert baseline.known == {"NMT-11"}
    assert baseline_text(SAMPLE).splitlines()[1] == "NMT-11  # what NMT-11 wants"


def test_exit_statuses() -> None:
    only = {one.check.id: replace(SAMPLE, results=(one,)) for one in SAMPLE.results}
    statuses = {name: Baseline().exit_status(report) for name, report in only.items()}
    assert statuses == {
        **{"NMT-01": 0, "NMT-11": 1, "HB-10": 4, "HB-12": 5, "HB-13": 5, "US-08": 5},
        **{"PR-03": 4, "LS-02": 0},
    }
    assert {name: report.exit_status for name, report in only.items()} == statuses
    assert KNOWN.exit_status(only["NMT-11"]) == 0
    assert KNOWN.exit_status(SAMPLE) == 4
    assert KNOWN.exit_status(MANY) == 1


@pytest.mark.parametrize(
    ("aborted", "absent", "status"),
    [("interrupted", False, 130), ("can0: no such device", False, 3), ("nobody", True, 1)],
)
def test_json_has_the_status_with_which_the_command_ends(
    aborted: str, absent: bool, status: int
) -> None:
    report = replace(SAMPLE, aborted=aborted, absent=absent)
    assert json.loads(report_json(report))["exit_status"] == status
    assert json.loads(report_json(SAMPLE, KNOWN))["exit_status"] == 4


def test_findings_are_counted_where_a_terminal_ends() -> None:
    assert text_report(SAMPLE).splitlines()[-2] == "1 finding, above"
    assert "finding" not in text_report(replace(SAMPLE, findings=()))


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"NMT-01 NMT-02\n", "line 1: 'NMT-01 NMT-02' is not the id of a check"),
        (b"\xff\xfe", "is not a text: byte 0 is not UTF-8"),
        (b"\n" + b"A" * 1_000, "line 2: 'AAAA"),
        (b'{"v": 1, "checks": []}', "is not the id of a check"),
    ],
)
def test_what_is_no_baseline_is_refused(tmp_path: Path, data: bytes, why: str) -> None:
    path = tmp_path / "known.txt"
    path.write_bytes(data)
    with pytest.raises(ValueError, match=re.escape(why)):
        Baseline.read(path)


def test_the_same_run_gives_the_same_bytes() -> None:
    for write in (html_page, report_json, report_junit, text_report, badge):
        assert write(SAMPLE, KNOWN) == write(replace(SAMPLE), Baseline(frozenset(KNOWN.known)))


def carried_out(text: str, r1: DefectiveR1) -> SequenceRun:
    """Carry out a script of a report at a slave, as `canmon seq` does."""
    run, host = SequenceRun(TomlSequence(text, "issue.toml").parse()), r1.link
    host.send(run.tick(host.now_us))
    while not run.done:
        for frame in host.receive(run.due_us - host.now_us):
            host.send(run.tick(host.now_us, (Record(host.now_us, "can0", frame),)))
        host.send(run.tick(host.now_us))
    return run


@pytest.mark.parametrize(
    ("name", "check"),
    [
        ("toggle ignored", "US-03"),
        ("no EMCY on heartbeat loss", "HB-10"),
        ("high limit unchecked", "DE-11"),
        ("unknown command is not answered", "SG-01"),
        ("boot-up missing", "NMT-10"),
        ("SYNC type 1 counts two", "PR-04"),
        ("LSS tells another vendor", "LS-02"),
    ],
)
def test_the_script_of_an_issue_shows_the_failure_and_nothing_at_a_sound_slave(
    name: str, check: str
) -> None:
    defect = next(each for each in DEFECTS if each.name == name)
    text = issue_text(judge(defect, check))
    assert f"## {check}: " in text
    script = text.partition("```toml\n")[2].partition("```")[0]
    assert carried_out(script, DefectiveR1(defect)).missed == 1
    assert carried_out(script, DefectiveR1(Defect("none", ()))).missed == 0


def test_an_issue_tells_clause_and_frames_and_leaves_out_what_is_known() -> None:
    text = issue_text(SAMPLE)
    assert text.startswith("# 1 failure of CANopen conformance, node 5\n")
    assert "- Clause: CiA 301 v4.2, 7.2.3.1\n" in text
    assert "- What came: got 585#4B01200034120000, want 585#4B0120000000....\n" in text
    assert " (001.001250)  <  585   [8]  4B 01 20 00 34 12 00 00\n" in text
    assert "\x1b" not in text
    assert issue_text(SAMPLE, KNOWN).startswith("# 0 failures of")
