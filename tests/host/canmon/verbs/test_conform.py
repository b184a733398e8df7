from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from xml.etree.ElementTree import parse

import pytest
from click.testing import CliRunner, Result

from tickrig.device import make_epos
from tickrig.host.canmon.cli import main
from tickrig.host.canopen.conform.suite import group_titles, read_suite
from tickrig.wire.canopen.eds.eds_writer import write_eds

RIG = """\
[device.board]
type = "{eds}"
node_id = 5
"""
EDS = Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds"
NMT = ("--communication", "--only", "NMT-0[345]")


@pytest.fixture
def rig(tmp_path: Path) -> str:
    path = tmp_path / "bench.toml"
    path.write_text(RIG.format(eds=EDS))
    return str(path)


def conform(*words: str) -> Result:
    return CliRunner().invoke(main, ["conform", *words])


def test_a_rig_in_virtual_time_is_judged_without_a_question(rig: str) -> None:
    result = conform(rig, "--node", "5", *NMT)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1] == "3 checks: 3 pass"
    assert "\r" not in result.output, "no progress in a pipe"


def test_all_reports_are_written_at_once(rig: str, tmp_path: Path) -> None:
    names = ("html", "junit", "badge", "write-baseline")
    files = {name: tmp_path / name for name in names}
    words = [word for name, path in files.items() for word in (f"--{name}", str(path))]
    assert conform(rig, "--node", "5", *NMT, *words).exit_code == 0
    assert "Enter Pre-operational" in files["html"].read_text("utf-8")
    assert "start, node 5" in files["html"].read_text("utf-8"), "frames are decoded"
    assert len(parse(files["junit"]).findall("testsuite/testcase")) == 3
    assert "3 of 3 pass" in files["badge"].read_text()
    assert files["write-baseline"].read_text().startswith("# known failures")


def test_json_is_the_same_each_time_and_says_what_was_run(rig: str) -> None:
    first, again = (conform(rig, "--node", "5", *NMT, "--json").stdout for _ in range(2))
    assert first == again
    said = json.loads(first)
    assert said["settings"]["adapter"] == "a rig in virtual time"
    assert said["settings"]["EDS"] == "r1.eds"
    assert [check["verdict"] for check in said["checks"]] == ["pass"] * 3


def test_the_hash_seed_makes_no_difference(rig: str) -> None:
    line = [sys.executable, "-c", "from tickrig.commands import canmon; canmon()", "conform", rig]
    line += ["--node", "5", "--intrusive", "--only", "[NUES]*", "--json"]

    def run(seed: int) -> bytes:
        variables = {**os.environ, "PYTHONHASHSEED": f"{seed}"}
        done = subprocess.run(line, capture_output=True, check=False, env=variables)
        return done.stdout

    first = run(0)
    assert len(json.loads(first)["checks"]) > 50
    assert run(1) == first


def test_a_node_without_power_is_blocked_not_failed(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(RIG.format(eds=EDS) + '[fault]\nboard = "power_off@50ms"\n')
    result = conform(str(path), "--node", "5", *NMT)
    assert result.exit_code == 4, result.output
    assert result.stderr == "Error: node 5 does not answer; other nodes: none\n"
    assert not result.stdout, "no wall of what was not judged"
    said = json.loads(conform(str(path), "--node", "5", *NMT, "--json").stdout)
    assert said["counts"]["blocked"] == 3


def test_without_a_node_it_says_who_is_there(rig: str) -> None:
    result = conform(rig)
    assert (result.exit_code, result.stdout, result.stderr) == (0, "node 5  board\n", "")


@pytest.mark.parametrize(
    "words",
    [
        ("{rig}", "--html", "{rig}"),
        ("{rig}", "--junit", "{eds}", "--eds", "{eds}"),
        ("{rig}", "--badge", "{link}", "--eds", "{eds}"),
        ("{rig}", "--badge", "{eds}"),
        ("{rig}", "--html", "{known}", "--baseline", "{known}"),
        ("{rig}", "--html", "{known}", "--stimulus", "cat {known}"),
    ],
)
def test_no_report_goes_into_what_the_run_reads(words: tuple[str, ...], tmp_path: Path) -> None:
    paths = {name: tmp_path / name for name in ("rig.toml", "x.eds", "link", "known")}
    paths["x.eds"].write_bytes(EDS.read_bytes())
    paths["rig.toml"].write_text(RIG.format(eds=paths["x.eds"]))
    paths["link"].symlink_to(paths["x.eds"])
    paths["known"].write_text("NMT-03\n")
    before = {name: path.read_bytes() for name, path in paths.items()}
    named = {name.partition(".")[0]: str(path) for name, path in paths.items()}
    named["eds"] = named["x"]
    result = conform(*(word.format(**named) for word in words), "--node", "5", *NMT)
    assert result.exit_code == 2, result.output
    assert "the run reads this file, it would be overwritten" in result.stderr
    assert {name: path.read_bytes() for name, path in paths.items()} == before


def test_a_baseline_may_be_written_anew(rig: str, tmp_path: Path) -> None:
    path = tmp_path / "known.txt"
    path.write_text("NMT-03\n")
    words = ("--baseline", str(path), "--write-baseline", str(path))
    result = conform(rig, "--node", "5", *NMT, *words)
    assert result.exit_code == 0, result.output
    assert "known to fail, and passed: NMT-03" in result.stdout
    assert "NMT-03" not in path.read_text()


def test_a_baseline_with_ids_that_are_none_is_told(rig: str, tmp_path: Path) -> None:
    path = tmp_path / "known.txt"
    path.write_text("NMT-03\nNTM-04\nNMT-\x1b[2J\nOD-1000h-read\n")
    result = conform(rig, "--node", "5", *NMT, "--baseline", str(path))
    assert result.exit_code == 0, result.output
    told = result.stderr.splitlines()
    assert len(told) == 2
    assert f"--baseline {path}: NTM-04: no such group or check; did you mean 'NMT-04'?" in told
    assert all(line.isprintable() for line in told)


def test_several_groups_are_named_at_once(rig: str) -> None:
    result = conform(rig, "--node", "5", "--communication", "--only", "NMT-0[34], HB-01")
    assert "3 checks:" in result.stdout, result.output
    listed = conform("--list", "--only", "NMT,HB").stdout.splitlines()
    end = listed.index("")
    assert {line.partition("-")[0] for line in listed[:end]} == {"NMT", "HB"}
    assert listed[end + 1 :] == [
        "NMT  NMT state machine and boot-up",
        "HB   Heartbeat producer and consumer",
    ]
    assert "NMT or UE-01,PR-*" in " ".join(conform("--help").stdout.split())


def test_who_names_no_group_is_told_the_groups(rig: str) -> None:
    told = conform(rig, "--node", "5", "--only", "XYZQ").stderr
    groups = ", ".join([*(group.name for group in read_suite()), "OD"])
    assert told.endswith(f"--only XYZQ: no such group or check; groups: {groups}; see --list\n")


def test_an_eds_of_another_device_is_told_first(rig: str, tmp_path: Path) -> None:
    other, page = tmp_path / "other.eds", tmp_path / "page.html"
    other.write_text(write_eds(make_epos(5).dictionary.description), "utf-8")
    words = ("--eds", str(other), "--html", str(page), *NMT)
    result = conform(rig, "--node", "5", *words)
    first, *_, last = result.stdout.splitlines()
    assert first.startswith("this EDS is of another device: ")
    assert (
        "device type 00020192h in the EDS, 000F0191h in the node, product 00006210h in the EDS"
        in first
    )
    assert last == first
    assert "this EDS is of another device: " in page.read_text("utf-8")
    assert "another device" not in conform(rig, "--node", "5", "--eds", str(EDS), *NMT).stdout


def test_what_eds_check_finds_in_the_eds_is_counted(rig: str, tmp_path: Path) -> None:
    path = tmp_path / "r 1.eds"
    path.write_text(EDS.read_text("utf-8").replace("NrOfRXPDO=4", "NrOfRXPDO=7"), "utf-8")
    result = conform(rig, "--node", "5", "--eds", str(path), *NMT)
    told = CliRunner().invoke(main, ["eds", "check", str(path)]).stderr
    counts = told.strip().removeprefix("1 file: ")
    assert counts.startswith("0 errors, 1 warning, ")
    lines = [" ".join(line.split()) for line in result.stdout.splitlines()]
    assert f"EDS findings {counts}: canmon eds check '{path}'" in lines
    assert result.exit_code == 0


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--node", "7"), "has no node 7; its nodes: 5"),
        (("--node", "5", "--eds", "nosuch.eds"), "--eds nosuch.eds: No such file"),
        (("--node", "5", "--eds", "/bin/sh"), "--eds /bin/sh: a binary file: no EDS"),
        (("--node", "5", "--only", "NTM"), "--only NTM: no such group or check; did you mean"),
        (("--node", "5", "--only", "NMT-03"), "--only NMT-03 needs --communication"),
        (("--node", "5", "--only", "UE", "--only", "LS"), "--only LS needs --intrusive"),
        (("--node", "5", "--allow", "600"), "--allow '600' is no index as 6200h: 1000h to"),
        (("--node", "5", "--never", "x"), "--never 'x' is no index as 6200h"),
        (("--node", "5", "--html", "/nosuch/x.html"), "--html /nosuch/x.html: no directory"),
        (("--node", "5", "--badge", "/"), "--badge /: it is a directory"),
        (("--node", "5", "--baseline", "/nosuch"), "--baseline /nosuch: No such file"),
        (("--node", "5", "--stimulus", "nosuch-command x"), "'nosuch-command': no such command"),
        (("--node", "5", "--stimulus", ""), "--stimulus wants a command, ask, or the path of"),
        (("--node", "5", "--stimulus", "control:"), "--stimulus wants a command, ask, or the"),
        (("--node", "5", "-i", "virtual", "-c", "1"), "--interface=virtual is of a bus: in "),
        (("--node", "5", "-b", "250000"), "--bitrate=250000 is of a bus: in "),
        (("--node", "5", "--stimulus", "'"), "--stimulus: No closing quotation"),
        (("--node", "5", "--stimulus", "control:/nosuch"), "--stimulus /nosuch: No such file"),
        (("--node", "5", "--stimulus", "ask"), "--stimulus ask needs a terminal"),
        (("--node", "0"), "0 is not in the range 1<=x<=127"),
        (("--node", "5", "--max-load", "0"), "0 is not in the range 1<=x<=100"),
        (("--node", "5", "--max-load", "0.01"), "0.01 is not in the range 1<=x<=100"),
        (("--node", "5", "--max-load", "nan"), "nan is no number from 1 to 100"),
        (("--node", "5", "--max-load", "inf"), "inf is not in the range 1<=x<=100"),
        (("--node", "5", "--junit", "/tmp/a", "--html", "/tmp/a"), "cannot go into one file"),
        (
            ("--node", "5", "--read-only", "--intrusive", "--yes"),
            "--read-only and --intrusive: which level? give one",
        ),
        (("--json",), "--node is missing: it is needed for checks and reports"),
    ],
)
def test_what_cannot_be_is_told_before_the_run(rig: str, words: tuple[str, ...], why: str) -> None:
    result = conform(rig, *words)
    assert result.exit_code == 2, result.output
    assert why in result.stderr
    assert not result.stdout


@pytest.mark.parametrize(
    ("source", "why"),
    [
        ("run.log", "is no bus: a log holds what was said, and answers nothing"),
        ("-", "is no bus: a log holds"),
        ("serial:/dev/ttyUSB0,rrc", "is no whole CAN bus"),
        ("can0,123:7FF", "is no whole CAN bus"),
        ("nosuch.toml", "rig nosuch.toml: No such file"),
    ],
)
def test_what_answers_nothing_is_no_source(source: str, why: str) -> None:
    result = conform(source, "--node", "5")
    assert result.exit_code == 2, result.output
    assert why in result.stderr


def test_no_source_at_all_is_told() -> None:
    assert "no SOURCE: name a bus as can0" in conform("--node", "5").stderr


def test_a_full_disk_is_told_and_the_verdict_is_shown(rig: str) -> None:
    result = conform(rig, "--node", "5", *NMT, "--html", "/dev/full")
    assert result.exit_code == 3
    assert "Error: --html /dev/full: No space left on device" in result.stderr
    assert "3 checks: 3 pass" in result.stdout


def test_the_list_names_checks_and_their_levels() -> None:
    result = conform("--list", "--only", "NMT-03")
    assert result.exit_code == 0
    assert result.stdout.startswith("NMT-03  communication  Start remote node")


def test_the_list_has_the_checks_of_objects_where_there_is_an_eds() -> None:
    alone = conform("--list", "--only", "OD")
    assert alone.exit_code == 0
    assert alone.stdout == "\nOD   each object of the EDS, which --eds FILE names\n"
    assert conform("--list").stdout.endswith(alone.stdout[1:])
    listed = conform("--list", "--only", "OD-1000*", "--eds", str(EDS)).stdout.splitlines()
    assert [line.split()[0] for line in listed[:2]] == ["OD-1000.00-type", "OD-1000.00-write"]
    assert listed[-1] == "OD   each object of the EDS"


def test_a_name_is_known_in_any_case(rig: str) -> None:
    names = "ue-01,nmt-0[34],od-1000.00-TYPE"
    result = conform(rig, "--node", "5", "--communication", "--only", names)
    assert "4 checks: 4 pass" in result.stdout, result.output
    assert conform("--list", "--only", "hb-01").stdout.startswith("HB-01 ")


def test_the_report_says_what_a_group_is(rig: str, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    result = conform(rig, "--node", "5", *NMT, "--html", str(page))
    assert "\nNMT  NMT state machine and boot-up      3: 3 pass\n" in result.stdout
    assert page.read_text("utf-8").count("NMT state machine and boot-up") == 2
    said = json.loads(conform(rig, "--node", "5", *NMT, "--json").stdout)
    assert said["groups"] == {"NMT": "NMT state machine and boot-up"}


def test_the_page_of_docs_explains_all_groups() -> None:
    text = (Path(__file__).parents[4] / "docs" / "reference/canopen/conform.md").read_text("utf-8")
    for name, title in group_titles().items():
        assert f"| {name} | {title} |" in text


def test_names_of_checks_are_completed() -> None:
    from click.shell_completion import BashComplete  # noqa: PLC0415 - only here

    complete = BashComplete(main, {}, "canmon", "_CANMON_COMPLETE")
    found = complete.get_completions(["conform", "can0", "--only"], "NMT-0")
    assert "NMT-03" in [item.value for item in found]
