from __future__ import annotations

import gzip
import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from decimal import Decimal
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.emulators.testing.conformance.test_page import ThisEnvironment
from tests.environment import ROOT
from tests.host.canmon.model.check.sound_log import candump, eight_faults, sound
from tests.host.canmon.net.test_net_page import Here
from tests.host.canmon.wire import new_wire
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.check.diagnosis import RULES
from tickrig.host.canmon.model.check.learnt import RULES as LEARNT
from tickrig.host.canmon.sources import source as block_log

DRIVE_EDS = Path(__file__).parents[4] / "examples/eds/epos.eds"
PAGE = (Path(__file__).parents[4] / "docs/reference/canmon/canmon-model.md").read_text("utf-8")
WRONG = ROOT / "docs/howto/wrong-on-the-bus.md"
CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")
LOG = """\
(1.000000) can0 703#05
(1.050000) can0 083#3081110000000000
(1.100000) can0 703#05
(1.300000) can0 703#05
"""
EMCY = (
    "(1.050000) no-emcy: node 3: EMCY 8130h life guard error or heartbeat error"
    " [can0 083#3081110000000000]"
)
LATE = (
    "(1.300000) heartbeat 3: node 3: 200.000 ms since its last heartbeat, at most 120.000 is right"
    " [can0 703#05]"
)
HEARTBEAT = ("--heartbeat", "3=100ms+-20%")


SOUND = "".join(f"({at / 10:.6f}) can0 703#05\n" for at in range(10, 40))
LOST = SOUND.replace("(2.500000) can0 703#05\n", "")


@pytest.mark.parametrize("small_bytes", [0, 1 << 20])
def test_without_a_rule_all_that_need_no_parameter_are_held(
    small_bytes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", small_bytes)
    result = check(write(tmp_path / "run.log", SOUND))
    assert (result.exit_code, result.stdout) == (0, "")
    judged, *others, summary = result.stderr.splitlines()
    assert judged.startswith("judged: ")
    assert "no-lost-heartbeat" in judged
    assert "not judged, no bit rate is known: give -b, as -b 500000: max-load" in others
    assert any(one.startswith("not judged, no PDO came") for one in others)
    assert summary == "0 findings"


@pytest.mark.parametrize("small_bytes", [0, 1 << 20])
def test_what_is_wrong_without_a_rule_is_told_with_its_frames(
    small_bytes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", small_bytes)
    result = check(write(tmp_path / "run.log", LOST))
    assert (result.exit_code, result.stdout.splitlines()) == (
        1,
        [
            "(2.400000) no-lost-heartbeat: can0 node 3: no heartbeat for 200.000 ms,"
            " one each 100.000 before",
            "    frames: 15 (2.400000), 16 (2.600000)",
        ],
    )
    assert result.stderr.splitlines()[-1] == "1 finding: no-lost-heartbeat: 1"
    zero = check(write(tmp_path / "run.log", LOST), "-t", "z").stdout
    assert "    frames: 15 (001.400000), 16 (001.600000)" in zero


def test_findings_without_a_rule_are_objects(tmp_path: Path) -> None:
    (line,) = check(write(tmp_path / "run.log", LOST), "--jsonl").stdout.splitlines()
    assert json.loads(line) == {
        **{"v": 1, "t": 2.4, "last": 2.6, "rule": "no-lost-heartbeat", "ch": "can0", "node": 3},
        **{"id": "703", "text": "no heartbeat for 200.000 ms, one each 100.000 before", "n": 1},
        "frames": [{"n": 15, "t": 2.4}, {"n": 16, "t": 2.6}],
    }


def test_findings_without_a_rule_go_into_reports(tmp_path: Path) -> None:
    log, junit, sarif = write(tmp_path / "run.log", LOST), tmp_path / "a.xml", tmp_path / "a.sarif"
    check(log, "--junit", str(junit), "--sarif", str(sarif))
    suite = ET.fromstring(junit.read_bytes()).find("testsuite")
    assert suite is not None
    assert suite.get("failures") == "1"
    (result,) = json.loads(sarif.read_text("utf-8"))["runs"][0]["results"]
    assert result["ruleId"] == "no-lost-heartbeat"


def test_only_so_many_findings_and_frames_are_shown(tmp_path: Path) -> None:
    text = LOST + "(4.000000) can0 083#3081110000000000\n"
    result = check(write(tmp_path / "run.log", text), "--max", "1")
    assert result.stdout.splitlines()[1:] == ["    frames: 15 (2.400000), and 1 more"]
    assert "and 1 finding more: --max 2" in result.stderr


REFUSED_SDO = """\
(1.000000) can0 080#
(1.001000) can0 602#2F98600063000000
(1.002000) can0 582#8098600030000906
(1.003000) can0 080#
(1.004000) can0 082#2073210000000000
(1.005000) can0 080#
"""


def test_frames_around_findings_of_all_rules_are_those_of_the_log(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", REFUSED_SDO)
    plain, around = check(log), check(log, "--around", "2")
    assert around.exit_code == plain.exit_code == 1
    assert [line for line in around.stdout.splitlines() if "  can0  " not in line] == (
        plain.stdout.splitlines()
    )
    aborted, emcy = re.split(r"^(?=\(1.00[24]000\) no)", around.stdout, flags=re.MULTILINE)[1:3]
    assert re.findall(r"^  >.*", aborted, flags=re.MULTILINE)[0].endswith(
        "2 sdo download 6098h:00 = 0x63 (aborted by server: invalid value (06090030h), 1.0 ms)"
    )
    assert len(aborted.splitlines()) == 7  # the finding, its frames, five frames around
    assert "  > (0000000001.004000)  can0  082" in emcy
    assert "beginning missing" not in emcy  # a frame of two findings is decoded once
    zero = check(log, "--around", "1", "-t", "z", "--from", "0.001")
    assert "  > (000.001000)  can0  582" in zero.stdout


def test_frames_around_findings_are_in_json(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", REFUSED_SDO)
    result = check(log, "--around", "1", "--jsonl")
    first = json.loads(result.stdout.splitlines()[0])
    assert [one["frame"] for one in first["around"]] == [
        *("602#2F98600063000000", "582#8098600030000906", "080#"),
    ]
    assert "around" not in json.loads(check(log, "--jsonl").stdout.splitlines()[0])


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("-", "--around", "1"), "--around does nothing here: it is for a log, or a --rule"),
        (("run.log", "--no-emcy", "--around", "1"), "--around does nothing here: it is for a --ru"),
        (("run.log", "--dbc", "x.dbc"), "--dbc does nothing here: it is for --around, or a --rule"),
    ],
)
def test_frames_around_findings_need_a_log(words: tuple[str, ...], why: str) -> None:
    result = check(*words)
    assert result.exit_code == 2
    assert why in result.stderr


@pytest.mark.parametrize("rule", [["--rule", "emcy never", "--around", "0"], ["--no-emcy"]])
def test_only_so_many_findings_of_a_rule_are_shown(tmp_path: Path, rule: list[str]) -> None:
    text = "".join(f"({at}.000000) can0 083#3081110000000000\n" for at in range(5))
    log, report = write(tmp_path / "run.log", text), tmp_path / "a.xml"
    everything = check(log, *rule)
    result = check(log, *rule, "--max", "2", "--junit", str(report))
    assert result.exit_code == everything.exit_code == 1
    assert result.stdout.splitlines() == everything.stdout.splitlines()[:2]
    assert result.stderr.splitlines()[0] == "and 3 findings more: --max 5"
    assert result.stderr.splitlines()[1:] == everything.stderr.splitlines()
    assert report.read_text("utf-8").count("083#3081110000000000") >= 5
    assert "more" not in check(log, *rule, "--max", "5").stderr


def test_where_no_frame_came_nothing_is_judged_without_a_rule(tmp_path: Path) -> None:
    result = check(write(tmp_path / "run.log", ""))
    assert (result.exit_code, result.stdout) == (5, "")
    assert result.stderr.splitlines()[-1].startswith("Error: nothing was judged: no frame in")


def test_rules_are_learnt_from_a_good_log_and_held_against_the_next(tmp_path: Path) -> None:
    good, rules = write(tmp_path / "good.log", SOUND), tmp_path / "good.toml"
    result = check("--init", good, "-o", str(rules))
    assert (result.exit_code, result.output) == (0, "")
    assert check("--init", good).stdout == rules.read_text("utf-8")
    assert "[learnt.can0.frame.703] # error control (703)" in rules.read_text("utf-8")
    again = check(good, str(rules))
    assert (again.exit_code, again.stdout) == (0, "")
    assert "learnt-period" in again.stderr.partition("\n")[0]
    slow = "".join(f"({at / 4:.6f}) can1 703#05\n" for at in range(4, 40))
    result = check(write(tmp_path / "next.log", slow), str(rules))
    assert result.exit_code == 1
    assert "error control (703) has a period of 250.000 ms, 100.000 is right" in result.stdout


def test_what_a_good_log_has_is_told_to_be_usual(tmp_path: Path) -> None:
    result = check("--init", write(tmp_path / "run.log", LOG), "-o", str(tmp_path / "a.toml"))
    assert result.stderr == (
        "can0: taken for usual: no-emcy: node 3: EMCY 8130h life guard error or heartbeat error\n"
    )


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--init", "--no-emcy"), "--init learns all rules: leave --no-emcy out"),
        (("learnt.toml", "--no-emcy"), "need no parameter: leave --no-emcy out"),
        (("learnt.toml", "other.toml"), "need no parameter: leave another file out"),
        (("bad.toml",), "rules bad.toml: learnt.can0: 'nodes' is not one of"),
    ],
)
def test_learnt_rules_stand_alone(
    words: tuple[str, ...], reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "run.log", LOG)
    write(tmp_path / "learnt.toml", "[learnt.can0]\n")
    write(tmp_path / "other.toml", "no_emcy = true\n")
    write(tmp_path / "bad.toml", "[learnt.can0]\nnodes = 3\n")
    result = check("run.log", *words)
    assert result.exit_code == 2
    assert reason in result.stderr


@pytest.mark.parametrize("small_bytes", [0, 1 << 20])
def test_a_time_ends_a_log_by_its_own_times(
    small_bytes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", small_bytes)
    log = write(tmp_path / "run.log", LOST)
    assert (check(log).exit_code, check(log, "--for", "1400ms").exit_code) == (1, 0)
    learnt = check("--init", log, "--for", "1s").stdout
    assert f"Learnt from {log}, 11 frames" in learnt
    late = ("--max-gap", "703=150ms")
    assert (check(log, *late).exit_code, check(log, *late, "--for", "1s").exit_code) == (1, 0)
    for verb in ("stats", "nodes", "top"):
        short = CliRunner().invoke(main, [verb, log, "--for", "1s"])
        whole = CliRunner().invoke(main, [verb, log])
        first = write(tmp_path / f"{verb}.log", "".join(LOST.splitlines(keepends=True)[:11]))
        alone = CliRunner().invoke(main, [verb, first])
        assert short.exit_code == 0
        assert short.stdout == alone.stdout != whole.stdout
    page = tmp_path / "a.html"
    result = CliRunner().invoke(main, ["report", log, "--for", "1s", "-o", str(page)])
    assert (result.exit_code, result.stderr) == (
        *(2, "Error: --for is how long a bus is recorded: leave it out for a log\n"),
    )


def test_learnt_rules_take_a_bit_rate(tmp_path: Path) -> None:
    good, rules = write(tmp_path / "good.log", SOUND), str(tmp_path / "good.toml")
    assert check("--init", good, "-b", "500000", "-o", rules).exit_code == 0
    result = check(good, rules, "-b", "500000")
    assert result.exit_code == 0
    judged = result.stderr.partition("\n")[0].removeprefix("judged: ").split(", ")
    assert {"max-load", "learnt-load", "no-emcy"} <= set(judged)
    assert "bit rate" not in result.stderr


def test_a_finding_shows_its_first_frames_and_stands_in_their_order(tmp_path: Path) -> None:
    log = SOUND + "".join(f"({5 + at / 10:.6f}) can0 083#3081110000000000\n" for at in range(5))
    again = log + "(9.000000) can0 703#00\n(9.000000) can0 084#3081110000000000\n"
    first, *_ = (found := check(write(tmp_path / "run.log", again)).stdout).splitlines()[1::2]
    assert first == "    frames: 30 (3.900000)"
    assert "    frames: 31 (5.000000), 32 (5.100000), 33 (5.200000), and 2 more" in found
    assert found.index("no-reboot") < found.index("can0 node 4")
    asked = check(str(tmp_path / "run.log"), "--max", "4").stdout
    assert "34 (5.300000), and 1 more" in asked


def test_nothing_is_learnt_of_no_frame(tmp_path: Path) -> None:
    result = check("--init", write(tmp_path / "run.log", ""))
    assert (result.exit_code, result.stdout) == (5, "")
    assert result.stderr.splitlines()[-1].startswith("Error: nothing was learnt: no frame in")


def test_a_file_without_a_rule_is_refused(log: str, tmp_path: Path) -> None:
    rules = write(tmp_path / "rules.toml", "bitrate = 500000\n")
    result = check(log, rules)
    assert (result.exit_code, result.stderr) == (
        2,
        f"Error: no rule in {rules}: leave it out for the usual ones\n",
    )


def test_what_the_page_shows_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "run.log", candump(eight_faults()))
    write(tmp_path / "good.log", candump(sound()))
    Here(ThisEnvironment(tmp_path), tmp_path).run(WRONG)


def test_the_page_has_all_rules() -> None:
    page = WRONG.read_text("utf-8")
    assert [rule for rule in RULES if f"`{rule}`" not in page and rule not in LEARNT] == []


@pytest.fixture
def log(tmp_path: Path) -> str:
    return write(tmp_path / "run.log", LOG)


def write(path: Path, text: str) -> str:
    path.write_text(text, "utf-8")
    return str(path)


def check(*words: str) -> Result:
    return CliRunner().invoke(main, ["check", *words])


def test_rules_that_hold_end_with_0(log: str) -> None:
    result = check(log, "--no-sdo-abort", "--nodes", "3", "--no-loss")
    assert (result.exit_code, result.stdout, result.stderr) == (
        *(0, "", "judged: no-loss, no-sdo-abort, nodes\nall rules hold\n"),
    )


def test_findings_are_lines_and_end_with_1(log: str) -> None:
    result = check(log, "--no-emcy", *HEARTBEAT)
    assert (result.exit_code, result.stdout) == (1, f"{EMCY}\n{LATE}\n")
    said = "judged: no-emcy, heartbeat 3\n2 findings: heartbeat 3: 1, no-emcy: 1\n"
    assert result.stderr == said


def test_a_file_holds_the_same_rules(log: str, tmp_path: Path) -> None:
    rules = write(tmp_path / "rules.toml", 'no_emcy = true\n[heartbeat]\n3 = "100ms±20%"\n')
    assert check(log, rules).stdout == f"{EMCY}\n{LATE}\n"


def test_options_go_beside_a_file(log: str, tmp_path: Path) -> None:
    rules = write(tmp_path / "rules.toml", 'no_emcy = true\nknown = "083"\n')
    assert check(rules, log, "--known", "703").stdout == f"{EMCY}\n"


def test_a_large_log_is_checked_the_same(log: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    result = check(log, "--no-emcy", *HEARTBEAT)
    assert (result.exit_code, result.stdout) == (1, f"{EMCY}\n{LATE}\n")


@pytest.mark.parametrize("small_bytes", [0, 1 << 20])
def test_times_count_from_the_first_frame(
    small_bytes: int, log: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", small_bytes)
    first_s = Decimal(LOG.partition(")")[0].strip(" ("))
    found = [line.partition(")") for line in (EMCY, LATE)]
    wanted = [f"({Decimal(at[1:]) - first_s:010.6f}{end}{text}" for at, end, text in found]
    assert check(log, "--no-emcy", *HEARTBEAT, "-t", "z").stdout.splitlines() == wanted
    assert "'d' is not one of 'a', 'z', 'A'" in check(log, "--no-emcy", "-t", "d").stderr


def test_frames_around_a_finding_have_its_kind_of_time(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", WRITTEN)
    _, *around = check(log, "--rule", "emcy never", "-t", "z").stdout.splitlines()
    dumped = CliRunner().invoke(main, ["dump", log, "-t", "z"]).stdout
    assert {line[3:] for line in around} <= set(dumped.splitlines())
    assert around


def test_findings_are_lines_of_json(log: str) -> None:
    (line,) = check(log, "--no-emcy", "--jsonl").stdout.splitlines()
    assert json.loads(line) == {
        "v": 1,
        "t": 1.05,
        "rule": "no-emcy",
        "text": "node 3: EMCY 8130h life guard error or heartbeat error",
        "ch": "can0",
        "frame": "083#3081110000000000",
    }


def test_a_report_has_a_case_for_each_rule(log: str, tmp_path: Path) -> None:
    report = tmp_path / "out.xml"
    check(log, "--no-emcy", "--no-loss", *HEARTBEAT, "--junit", str(report))
    suite = ET.fromstring(report.read_bytes()).find("testsuite")
    assert suite is not None
    assert (suite.get("tests"), suite.get("failures")) == ("3", "2")
    failed = {case.get("name"): case.findtext("failure") for case in suite}
    assert failed == {"no-loss": None, "no-emcy": EMCY, "heartbeat 3": LATE}


def test_a_report_holds_what_xml_does_not(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", LOG + "\x01 <&> \x02\n")
    report = tmp_path / "out.xml"
    assert check(log, "--no-loss", "--junit", str(report)).exit_code == 1
    assert "<&>" in str(ET.fromstring(report.read_bytes()).findtext(".//failure"))


def test_a_line_that_is_no_frame_breaks_no_loss(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", LOG + "what?\n")
    result = check(log, "--no-loss")
    assert result.exit_code == 1
    assert "no-loss: " in result.stdout
    assert "line 5 is no frame: 'what?'" in result.stdout


def test_lost_frames_end_a_strict_check_with_4(tmp_path: Path) -> None:
    log = write(tmp_path / "run.jsonl", '{"v":1,"ev":"drop","n":12}\n')
    assert check(log, "--no-emcy").exit_code == 5
    assert check(log, "--no-emcy", "--strict").exit_code == 4


@pytest.mark.parametrize("at_once", [False, True])
@pytest.mark.parametrize("text", ["", "what?\n", "(1.000000) can0 45123#81:00:12345678#1122\n"])
def test_where_nothing_was_judged_nothing_is_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at_once: bool, text: str
) -> None:
    if at_once:
        monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    log = write(tmp_path / "run.log", text)
    report = tmp_path / "out.xml"
    result = check(log, "--no-emcy", "--junit", str(report))
    assert (result.exit_code, result.stdout) == (5, "")
    said = f"nothing was judged: no frame in {log}"
    assert result.stderr.splitlines()[-1] == f"Error: {said}"
    suite = ET.fromstring(report.read_bytes()).find("testsuite")
    assert suite is not None
    assert [suite.get(name) for name in ("tests", "failures", "errors")] == ["1", "0", "1"]
    assert [error.get("message") for error in suite.iter("error")] == [said]


def test_a_silent_bus_is_no_good_bus() -> None:
    result = check("virtual:silent", "--for", "20ms", "--no-emcy")
    assert (result.exit_code, result.stderr) == (5, "Error: nothing was judged: no frame came\n")


def test_what_must_come_is_judged_by_silence(tmp_path: Path) -> None:
    result = check(write(tmp_path / "run.log", ""), "--nodes", "3", "--no-emcy")
    assert (result.exit_code, result.stdout) == (1, "(0.000000) nodes: node 3 was never seen\n")


def test_a_report_of_a_log_that_breaks_off_does_not_say_that_it_is_well(tmp_path: Path) -> None:
    log, report = tmp_path / "run.log.gz", tmp_path / "out.xml"
    log.write_bytes(gzip.compress(LOG.encode())[:-12])
    assert check(str(log), "--no-sdo-abort", "--junit", str(report)).exit_code == 3
    (error,) = ET.fromstring(report.read_bytes()).iter("error")
    assert str(log) in (error.get("message") or "")


def test_the_load_is_checked_against_the_bit_rate(log: str) -> None:
    assert check(log, "--max-load", "50", "-b", "500000").exit_code == 0
    result = check(log, "--max-load", "1", "-b", "10000")
    assert result.stdout == "(1.000000) max-load: can0: load 3.0 %, at most 1 % is right\n"


def test_a_rule_file_may_name_the_bit_rate(log: str, tmp_path: Path) -> None:
    rules = write(tmp_path / "rules.toml", "max_load = 1\nbitrate = 10000\n")
    assert check(log, rules).exit_code == 1
    assert check(log, rules, "-b", "1000000").exit_code == 0
    assert check(log, write(tmp_path / "none.toml", "bitrate = 10000\n")).exit_code == 2


def test_a_source_may_name_the_bit_rate() -> None:
    words = ("--for", "50ms", "--max-load", "50")
    assert check("virtual:check@500k", *words).exit_code == 5
    assert check("virtual:check", *words).exit_code == 2


@pytest.mark.parametrize(
    ("words", "status", "reason"),
    [
        (("--max-load", "50"), 2, "a limit of the load needs the bit rate: give -b, as -b 500000"),
        (("--nodes", "x"), 2, "nodes 'x' is not like 3 or 3-7"),
        (("--nodes", "3-1"), 2, "nodes '3-1': the lower node-ID stands first, as 1-3"),
        (("none.toml",), 2, "rules none.toml: No such file or directory"),
        (
            ("--no-emcy", "--junit", "no/out.xml"),
            2,
            "--junit no/out.xml: No such file or directory",
        ),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    log: str, words: tuple[str, ...], status: int, reason: str
) -> None:
    result = check(log, *words)
    assert result.exit_code == status
    assert result.stderr == f"Error: {reason}\n"


def test_a_rule_file_that_is_wrong_is_named(log: str, tmp_path: Path) -> None:
    for text in ("no_emcy = 1", "[[", "emcy = true"):
        rules = write(tmp_path / "rules.toml", text)
        result = check(log, rules)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"Error: rules {rules}: ")
        assert len(result.stderr.splitlines()) == 1


def test_all_that_is_wrong_in_a_rule_file_is_said_with_its_line(log: str, tmp_path: Path) -> None:
    text = 'no_emci = true\nmax_gap = {181 = 20}\n[rule]\n"a" = "dlc"\n"x" = "emcy nevr"\n'
    rules = write(tmp_path / "rules.toml", text)
    head, *lines = check(log, rules).stderr.splitlines()
    assert head == f"Error: rules {rules}: 3 mistakes"
    assert [line[:31] for line in lines] == [
        "  line 1: rule 'no_emci' is not",
        "  line 2: '20' has no unit: wri",
        "  line 5: rule 'emcy nevr', col",
    ]
    assert lines[0].endswith("; did you mean 'no_emcy'?")
    assert lines[2].endswith("; did you mean 'never'?")


def test_what_is_no_toml_is_said_with_its_line(log: str, tmp_path: Path) -> None:
    rules = write(tmp_path / "rules.toml", "no_emci = true\n[b\nnodes = \n")
    head, *lines = check(log, rules).stderr.splitlines()
    assert head == f"Error: rules {rules}: 2 mistakes"
    assert [line[:9] for line in lines] == ["  line 2:", "  line 3:"]


def test_lines_that_are_no_frames_are_said_before_the_verdict(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", LOG + "what?\n")
    first, *_, last = check(log, "--no-sdo-abort").stderr.splitlines()
    assert "line 5 is no frame" in first
    assert last == "all rules hold"


def test_a_file_is_given_as_the_page_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "run.log", LOG)
    write(tmp_path / "rules.toml", PAGE.partition("```toml\n")[2].partition("```")[0])
    words = re.findall(r"^\$ canmon check (.*)$", PAGE, re.MULTILINE)
    assert words
    for line in words:
        result = check(*line.split())
        assert (result.exit_code, EMCY in result.stdout) == (1, True)
        assert "nodes: node 16 was never seen" in result.stdout


def test_a_log_that_is_not_there_ends_with_3() -> None:
    result = check("none.log", "--no-emcy")
    assert (result.exit_code, result.stderr) == (3, "Error: none.log: No such file or directory\n")


WRITTEN = """\
(1.000000) can0 703#05
(1.010000) can0 080#
(1.050000) can0 083#3081110000000000
(1.060000) can0 080#
(1.100000) can0 703#05
(1.110000) can0 080#
"""
FOUND = """\
(1.050000) emcy never: emcy of node 3: 8130h life guard error or heartbeat error,\
 register GENERIC|COMMUNICATION [can0 083#3081110000000000]
    (0000000001.000000)  can0  703   [1]  05                        3 heartbeat operational
    (0000000001.010000)  can0  080   [0]                            sync
  > (0000000001.050000)  can0  083   [8]  30 81 11 00 00 00 00 00   3 emcy 8130h life guard error\
 or heartbeat error, register GENERIC|COMMUNICATION
    (0000000001.060000)  can0  080   [0]                            sync
    (0000000001.100000)  can0  703   [1]  05                        3 heartbeat operational
"""


def test_a_finding_of_a_written_rule_has_the_frames_around_it(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", WRITTEN)
    result = check(log, "--rule", "emcy never")
    assert (result.exit_code, result.stdout) == (1, FOUND)
    alone = check(log, "--rule", "emcy never", "--around", "0")
    assert alone.stdout == FOUND.splitlines(keepends=True)[0]
    assert check(log, "--rule", "emcy of 4 never").exit_code == 0


def test_findings_stand_in_the_order_of_their_frames(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", WRITTEN)
    result = check(log, "--rule", "emcy never", "--max-gap", "080=10ms", "--rule", "sync at most 2")
    heads = [line for line in result.stdout.splitlines() if line.startswith("(")]
    assert [line.split(":")[0] for line in heads] == [
        "(1.050000) emcy never",
        "(1.060000) max-gap 080",
        "(1.110000) max-gap 080",
        "(1.110000) sync at most 2",
    ]


def test_written_rules_are_held_by_a_file_and_reported(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", WRITTEN)
    rules = write(tmp_path / "rules.toml", '[rule]\nquiet = "emcy never"\nform = "dlc"\n')
    report = tmp_path / "out.xml"
    result = check(log, rules, "--junit", str(report))
    assert result.stderr == "judged: quiet, form\n1 finding: quiet: 1\n"
    cases = ET.fromstring(report.read_bytes()).iter("testcase")
    failed = {case.get("name"): case.findtext("failure") for case in cases}
    quiet = FOUND.replace("emcy never", "quiet").removesuffix("\n")
    assert failed == {"quiet": quiet, "form": None}


def test_frames_around_a_finding_are_in_json(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", WRITTEN)
    result = check(log, "--rule", "emcy never", "--around", "1", "--jsonl")
    (line,) = result.stdout.splitlines()
    found = json.loads(line)
    assert found["frame"] == "083#3081110000000000"
    assert [(one["t"], one["frame"]) for one in found["around"]] == [
        (1.01, "080#"),
        (1.05, "083#3081110000000000"),
        (1.06, "080#"),
    ]


def test_written_rules_are_held_against_standard_input() -> None:
    words = [*CANMON, "check", "-", "--rule", "emcy never", "--rule", "sync to time under 5us"]
    text = WRITTEN + "(1.120000) can0 100#000000000000\n(1.130000) can0 080#\n"
    piped = subprocess.run(words, input=text, capture_output=True, text=True, check=False)
    assert piped.returncode == 1
    heads = [line.split(":")[0] for line in piped.stdout.splitlines() if line.startswith("(")]
    late = "sync to time under 5us"
    at_s = ("1.010005", "1.060005", "1.110005")
    first, *others = [f"({at}) {late}" for at in at_s]
    assert heads == [first, "(1.050000) emcy never", *others]


def test_written_rules_are_held_against_a_large_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    assert check(write(tmp_path / "run.log", WRITTEN), "--rule", "emcy never").stdout == FOUND


def test_a_bus_is_heard_for_a_time_and_judged_without_a_rule() -> None:
    with new_wire() as wire, wire.calling("000#0205"):
        result = check(wire.word, "--for", "500ms")
    assert result.exit_code == 1
    assert " nmt-stop: " in result.stdout
    assert "NMT stops node 5 [" in result.stdout
    assert result.stderr.endswith("\n1 finding: nmt-stop: 1\n")


def test_written_rules_are_held_against_a_bus() -> None:
    with new_wire() as wire, wire.calling("083#3081110000000000"):
        result = check(wire.word, "--for", "500ms", "--rule", "emcy at most 2", "--around", "0")
    assert result.exit_code == 1
    assert "emcy came 3 times, at most 2 is right [" in result.stdout


def test_a_rule_that_is_none_is_one_line(log: str, tmp_path: Path) -> None:
    said = "rule 'emcy nevr', column 6: 'nevr' is no demand; wanted never, always, "
    result = check(log, "--rule", "emcy nevr")
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {said}")
    assert result.stderr.endswith("; did you mean 'never'?\n")
    rules = write(tmp_path / "rules.toml", 'rule = ["emcy nevr"]\n')
    assert check(log, rules).stderr.startswith(f"Error: rules {rules}: line 1: {said}")


def test_a_written_rule_knows_what_an_eds_says(tmp_path: Path) -> None:
    log = write(tmp_path / "run.log", "(1.0) can0 185#3702D2040000\n(1.1) can0 185#3802\n")
    words = ("--rule", "dlc", "--rule", "5.statusword.fault never", "--around", "0")
    assert check(log, *words, "--eds", f"5={DRIVE_EDS}").stdout.splitlines() == [
        "(1.100000) dlc: tpdo1 of node 5 has 2 B, 6 is right by its mapping [can0 185#3802]"
    ]


def test_findings_are_written_as_sarif(tmp_path: Path) -> None:
    log, report = write(tmp_path / "a b.log", WRITTEN), tmp_path / "out.sarif"
    words = ("--rule", "quiet: emcy never", "--rule", "dlc", "--nodes", "9")
    assert check(log, *words, "--sarif", str(report)).exit_code == 1
    said = json.loads(report.read_text("utf-8"))
    (run,) = said["runs"]
    assert said["version"] == "2.1.0"
    assert [rule["id"] for rule in run["tool"]["driver"]["rules"]] == ["nodes", "quiet", "dlc"]
    assert run["invocations"] == [{"executionSuccessful": True}]
    quiet, nodes = run["results"]
    head, *around = FOUND.replace("emcy never", "quiet").splitlines()
    assert quiet["message"]["text"] == head.partition("quiet: ")[2]
    related = [one["message"]["text"] for one in quiet["relatedLocations"]]
    assert related == [line.strip() for line in around]
    assert quiet["properties"] == {"t": 1.05, "ch": "can0", "frame": "083#3081110000000000"}
    assert (quiet["ruleId"], quiet["ruleIndex"], quiet["level"]) == ("quiet", 1, "error")
    place = quiet["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert place.endswith("/a%20b.log")
    assert nodes["message"] == {"text": "node 9 was never seen"}
    assert nodes["properties"] == {"t": 1.11}


def test_sarif_does_not_say_that_an_empty_log_is_well(tmp_path: Path) -> None:
    log, report = write(tmp_path / "run.log", ""), tmp_path / "out.sarif"
    assert check(log, "--rule", "dlc", "--sarif", str(report)).exit_code == 5
    (run,) = json.loads(report.read_text("utf-8"))["runs"]
    (said,) = run["invocations"]
    note = said["toolExecutionNotifications"][0]["message"]["text"]
    assert (said["executionSuccessful"], run["results"]) == (False, [])
    assert note == f"nothing was judged: no frame in {log}"
    assert check(log, "--rule", "dlc", "--sarif", "no/x").stderr == (
        "Error: --sarif no/x: No such file or directory\n"
    )


@pytest.mark.parametrize("at_once", [False, True])
def test_a_rule_that_judged_nothing_is_said_and_none_at_all_ends_with_5(
    log: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at_once: bool
) -> None:
    if at_once:
        monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    report, other = tmp_path / "out.xml", tmp_path / "out.sarif"
    words = ("--max-gap", "083=1s", "--junit", str(report), "--sarif", str(other))
    result = check(log, "--no-sdo-abort", *words)
    assert (result.exit_code, result.stdout) == (0, "")
    assert result.stderr.splitlines() == [
        "judged: no-sdo-abort",
        "max-gap 083 judged nothing: 083 came once",
        "1 rule held, 1 judged nothing",
    ]
    suite = ET.fromstring(report.read_bytes()).find("testsuite")
    assert suite is not None
    assert [suite.get(name) for name in ("tests", "failures", "errors", "skipped")] == list("2001")
    assert [one.get("message") for one in suite.iter("skipped")] == ["083 came once"]
    (run,) = json.loads(other.read_text("utf-8"))["runs"]
    (note,) = run["invocations"][0]["toolExecutionNotifications"]
    assert note == {
        "level": "warning",
        "message": {"text": "max-gap 083 judged nothing: 083 came once"},
    }
    alone = check(log, *words)
    said = "nothing was judged: max-gap 083: 083 came once"
    assert (alone.exit_code, alone.stderr) == (5, f"Error: {said}\n")
    suite = ET.fromstring(report.read_bytes()).find("testsuite")
    assert suite is not None
    assert [error.get("message") for error in suite.iter("error")] == [said]


def test_a_finding_goes_before_what_was_not_judged(log: str) -> None:
    result = check(log, "--no-emcy", "--max-gap", "083=1s")
    assert (result.exit_code, result.stdout) == (1, f"{EMCY}\n")
    assert result.stderr.splitlines() == [
        "judged: no-emcy",
        "max-gap 083 judged nothing: 083 came once",
        "1 finding: no-emcy: 1",
    ]


PEAK = """\
;$FILEVERSION=2.1
;$STARTTIME=45000
;$COLUMNS=N,O,T,B,I,d,R,L,D
      1      1059.900 DT 1      0300 Rx -  2    00 00
"""
VECTOR = "base hex  timestamps absolute\n   0.1 1  300  Rx   d 2 00 00\n"


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("x.trc", PEAK + "2 1334.2 ER 1 - Rx - 5 04 00 02 00 00\n", "protocol: bit stuffing"),
        ("x.trc", PEAK + "2 1334.2 ST 1 - Rx - 4 00 00 00 08\n", "its warning limit (BUSHEAVY)"),
        ("x.trc", PEAK + "2 1334.2 EC 1 - Rx - 2 02 02\n", "error counters are above 0: 1 time"),
        ("y.trc", ";$FILEVERSION=1.1\n  1)  2.0  Error  0008  4  00 19 08 08\n", "no acknowledge"),
        ("y.trc", " 1)  1  0300  0\n 2)  2  0008  4  ERROR 00 19 08 08\n", "no acknowledge"),
        ("x.asc", VECTOR + "   0.2 CANFD   1 Rx        ErrorFrame\n", "bus error"),
        ("x.asc", VECTOR + "   0.2 1  ErrorFrame\n", "bus error"),
        ("x.asc", VECTOR + "   0.2 CAN 1 Status:chip status bus off\n", "is bus-off: 1 time"),
    ],
)
@pytest.mark.parametrize("at_once", [False, True])
def test_no_error_frames_sees_all_that_a_log_tells_of_errors(  # noqa: PLR0913, PLR0917 - cases
    name: str,
    text: str,
    said: str,
    at_once: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if at_once:
        monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    result = check(write(tmp_path / name, text), "--no-error-frames")
    assert result.exit_code == 1
    assert said in result.stdout


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "run.csv",
            "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
            "1000,00000701,false,Rx,0,1,05,00,00,00,00,00,00,00,\n",
        ),
    ],
)
def test_a_log_that_has_no_error_frames_proves_none(name: str, text: str, tmp_path: Path) -> None:
    log = write(tmp_path / name, text)
    result = check(log, "--no-error-frames")
    why = "a GVRET log holds no error frames"
    said = f"Error: nothing was judged: no-error-frames: {why}\n"
    assert (result.exit_code, result.stderr) == (5, said)
    assert check(log, "--no-error-frames", "--no-emcy").exit_code == 0


def test_a_screen_without_times_says_nothing_of_gaps(tmp_path: Path) -> None:
    log = write(tmp_path / "run.txt", "  can0  703   [1]  05\n" * 3)
    words = ("--max-gap", "703=1s", "--rule", "heartbeat of 3 every ..1s")
    result = check(
        log, *words, "--no-lost-heartbeat", *HEARTBEAT, "--max-load", "50", "-b", "1000000"
    )
    assert result.exit_code == 1  # three heartbeats at once are too early, if they were at once
    assert check(log, *words, "--no-lost-heartbeat").exit_code == 5


def test_an_eds_tells_how_often_a_heartbeat_comes(log: str, tmp_path: Path) -> None:
    eds, text = tmp_path / "drive.eds", DRIVE_EDS.read_text("latin-1")
    head, section, rest = text.partition("[1017]")
    changed = rest.replace("DefaultValue=0x0000", "DefaultValue=0x0064", 1)
    eds.write_text(head + section + changed, "latin-1")
    quiet = write(tmp_path / "quiet.log", "(1.0) can0 705#05\n(9.0) can0 080#\n")
    result = check(quiet, "--no-lost-heartbeat", "--eds", f"5={eds}")
    assert result.stdout == (
        "(9.000000) no-lost-heartbeat: can0 node 5: no heartbeat for 8000.0 ms,"
        " its 1017h says 100.000 ms\n"
    )
    assert "LATE" in CliRunner().invoke(main, ["nodes", quiet, "--eds", f"5={eds}"]).stdout
    assert check(quiet, "--no-lost-heartbeat").exit_code == 5
    assert check(log, "--no-emcy", "--eds", "5=none.eds").exit_code == 2
