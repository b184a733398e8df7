"""`canmon eds`: what is printed, written and returned."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from click.shell_completion import BashComplete
from click.testing import CliRunner, Result

from tests.host.canopen.data_sheet.corpus import GOOD, NAME
from tests.wire.canopen.eds.xdd_text import XDD
from tickrig.emulators.canopen.eds import read_eds
from tickrig.host.canmon.cli import main
from tickrig.host.canopen.eds import MOST_BYTES, read_sound
from tickrig.wire.canopen.eds.eds_file import EdsError

DEFECT = GOOD.replace("NrOfRXPDO=4", "NrOfRXPDO=7").replace("DefaultValue=0x10", "DefaultValue=9")
COUNT = (
    ":29: warning: [pdo-count] [DeviceInfo] NrOfRXPDO=7, but of 1400h to 15FFh there are 4;"
    " fix: count the PDO parameters (CiA 306-1, [DeviceInfo])"
)
OUT_OF_LIMITS = "default-limits"


@pytest.fixture
def good(tmp_path: Path) -> Path:
    return write(tmp_path / NAME, GOOD)


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    (tmp_path / "odd").mkdir()
    return write(tmp_path / "odd" / NAME, DEFECT)


def write(path: Path, text: str) -> Path:
    path.write_bytes(text.encode())
    return path


def make_large(path: Path) -> Path:
    """Make a file, with a hole, that is larger than any EDS."""
    with path.open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    return path


def run(*words: object) -> Result:
    return CliRunner().invoke(main, ["eds", *map(str, words)])


def test_a_good_file_ends_with_0(good: Path) -> None:
    result = run("check", good, "--strict")
    assert (result.exit_code, result.stdout) == (0, "")
    assert result.stderr == "1 file: 0 errors, 0 warnings, 0 notes\n"


def test_findings_are_lines_with_rule_fix_and_clause(odd: Path) -> None:
    result = run("check", odd)
    assert result.exit_code == 0
    assert result.stdout.splitlines()[0] == f"{odd}{COUNT}"
    assert result.stderr == "1 file: 0 errors, 2 warnings, 0 notes\n"
    assert run("check", odd, "--strict").exit_code == 1


def test_errors_end_with_1(tmp_path: Path) -> None:
    bad = write(tmp_path / "bad.eds", GOOD.replace("SupportedObjects=12", "SupportedObjects=9"))
    result = run("check", bad, bad)
    assert result.exit_code == 1
    assert result.stdout.count("error: [list-count]") == 2


def test_findings_as_json(odd: Path) -> None:
    first = json.loads(run("check", odd, "--json").stdout.splitlines()[0])
    assert first == {
        "v": 1,
        "file": str(odd),
        "line": 29,
        "severity": "warning",
        "rule": "pdo-count",
        "section": "DeviceInfo",
        "text": "NrOfRXPDO=7, but of 1400h to 15FFh there are 4",
        "breaks": "tools show too many or too few",
        "fix": "count the PDO parameters",
        "clause": "CiA 306-1, [DeviceInfo]",
        "mended_by_fix": True,
    }


def test_a_report_has_a_case_for_each_rule_of_each_file(
    good: Path, odd: Path, tmp_path: Path
) -> None:
    report = tmp_path / "eds.xml"
    assert run("check", good, odd, "--strict", "--junit", report).exit_code == 1
    (suite,) = ET.parse(report).getroot()
    assert int(suite.attrib["tests"]) == len(suite) > 150
    failed = [case.attrib["name"] for case in suite if case.find("failure") is not None]
    assert failed == [f"{odd}: pdo-count", f"{odd}: {OUT_OF_LIMITS}"]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("check", "none.eds"), "FILE none.eds: No such file or directory"),
        (("check", "."), "FILE .: Is a directory"),
        (("show", "none.eds"), "FILE none.eds: No such file or directory"),
        (("diff", "none.eds", "none.eds"), "FILE none.eds: No such file or directory"),
        (("fix", "none.eds", "--dry-run"), "FILE none.eds: No such file or directory"),
        (
            ("check", "empty.eds", "--junit", "no/where.xml"),
            "--junit no/where.xml: no directory no",
        ),
        (("fix", "empty.eds"), "give -o OUT, or --dry-run"),
        (("fix", "empty.eds", "-o", "a.eds", "--dry-run"), "give -o OUT, or --dry-run"),
        (("fix", "empty.eds", "-o", "a.eds"), "FILE empty.eds: no EDS: it describes no object"),
        (("fix", "a.xdd", "-o", "a.eds"), "FILE a.xdd: XDD files cannot be fixed"),
        (("show", "large.eds"), "FILE large.eds: more than 32,000,000 bytes: not an EDS"),
        (("show", "empty.eds"), "FILE empty.eds: has no objects (no-objects)"),
        (("diff", "empty.eds", "empty.eds"), "FILE empty.eds: has no objects (no-objects)"),
        (
            ("show", "r1.eds", "60"),
            "'60' is not INDEX or INDEX:SUB in hexadecimal, as 6040 or 1018:01",
        ),
        (("show", "r1.eds", "6040"), "r1.eds: no 6040 is there"),
        *(
            (
                (verb, "bus.yml", *more),
                "FILE bus.yml: no EDS, but a bus.yml; use: tickrig check bus.yml",
            )
            for verb, *more in (("check",), ("fix", "--dry-run"), ("show",), ("diff", "bus.yml"))
        ),
        (
            ("check", "system.yaml"),
            "FILE system.yaml: no EDS, but a System Definition; use: rtc-canopen-server --check "
            "system.yaml",
        ),
        (
            ("check", "rig.toml"),
            "FILE rig.toml: TOML, not an EDS; for a rig file use: tickrig check rig.toml",
        ),
        (
            ("fix", "r1.eds", "--dry-run", "--from-encoding", "cp999"),
            "--from-encoding 'cp999' is no encoding, as cp1252, cp850 or latin-1",
        ),
        (("show", "bomb.xdd"), "FILE bomb.xdd:1: has a document type, which is refused (xml)"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], reason: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "empty.eds", "")
    write(tmp_path / "r1.eds", GOOD)
    write(tmp_path / "bus.yml", "master:\n  node_id: 1\n")
    write(tmp_path / "system.yaml", "nodes:  # two\n\n# a drive\n  - {id: 1, eds: a.eds}\n")
    write(tmp_path / "rig.toml", "[wires.can]\n")
    write(tmp_path / "a.xdd", XDD)
    make_large(tmp_path / "large.eds")
    write(tmp_path / "bomb.xdd", '<!DOCTYPE a [<!ENTITY b "b">]><a>&b;</a>')
    result = run(*words)
    assert (result.exit_code, result.stderr) == (2, f"Error: {reason}\n")
    assert not Path("a.eds").exists()


def test_where_a_mended_file_cannot_be_written_is_one_line_and_2(good: Path) -> None:
    result = run("fix", good, "-o", "no/a.eds")
    assert (result.exit_code, result.stderr) == (
        *(2, "Error: -o no/a.eds: No such file or directory\n"),
    )


def test_files_that_cannot_be_read_do_not_hide_the_others(odd: Path, tmp_path: Path) -> None:
    report = tmp_path / "eds.xml"
    result = run("check", tmp_path, odd, "none.eds", "--strict", "--junit", report)
    assert result.exit_code == 2
    assert f"{odd}{COUNT}" in result.stdout.splitlines()
    assert result.stderr.splitlines() == [
        f"Error: FILE {tmp_path}: Is a directory",
        "Error: FILE none.eds: No such file or directory",
        "1 file: 0 errors, 2 warnings, 0 notes",
    ]
    (suite,) = ET.parse(report).getroot()
    failed = [case.attrib["name"] for case in suite if case.find("failure") is not None]
    unread = [f"{tmp_path}: unread", "none.eds: unread"]
    assert failed == [*unread, f"{odd}: pdo-count", f"{odd}: {OUT_OF_LIMITS}"]


def test_a_file_too_large_for_an_eds_is_refused_by_hosts_too(tmp_path: Path) -> None:
    path = make_large(tmp_path / "large.eds")
    words = ["conform", "none.toml", "--node", "5", "--eds", str(path)]
    result = CliRunner().invoke(main, words)
    assert (result.exit_code, result.stderr) == (
        *(2, f"Error: --eds {path}: more than 32,000,000 bytes: not an EDS\n"),
    )
    for read in (read_sound, read_eds):
        with pytest.raises(EdsError, match="more than 32,000,000 bytes"):
            read(path)


def test_fix_writes_a_file_and_tells_what_is_left(odd: Path, tmp_path: Path) -> None:
    out = tmp_path / "mended.eds"
    result = run("fix", odd, "-o", out)
    assert result.exit_code == 1
    assert out.read_bytes() == DEFECT.replace("NrOfRXPDO=7", "NrOfRXPDO=4").encode()
    mended, left = result.stdout.splitlines()
    assert mended.startswith(f"{odd}:29: fixed: [pdo-count] [DeviceInfo] NrOfRXPDO=7")
    assert f"[{OUT_OF_LIMITS}] [2006] the default 9 is not in 16..32" in left
    assert result.stderr == "1 fixed, 1 left\n"


def test_fix_writes_utf_8_or_ascii_and_tells_which_letter_it_took(tmp_path: Path) -> None:
    path, out = tmp_path / NAME, tmp_path / "out" / NAME
    out.parent.mkdir()
    path.write_bytes(GOOD.replace("u8 write", "für Schönaich").encode("cp850"))
    check = run("check", path)
    assert check.exit_code == 0
    said = "not UTF-8, which the canopen library and dcf-tools need; byte 81h is 'ü' in cp850"
    assert f"warning: [not-utf-8] {said}" in check.stdout
    assert (
        "the canopen library"
        in json.loads(run("check", path, "--json").stdout.splitlines()[0])["breaks"]
    )
    result = run("fix", path, "-o", out)
    assert (result.exit_code, "für Schönaich" in out.read_text("utf-8")) == (0, True)
    assert "byte 81h is 'ü' in cp850" in result.stdout
    assert run("fix", path, "-o", out, "--encoding", "ascii").exit_code == 0
    assert "fuer Schoenaich" in out.read_text("ascii")
    told = run("fix", path, "-o", out, "--from-encoding", "latin-1").stdout
    assert "byte 81h is '\\x81' in latin-1, '\ufffd' in cp1252, 'ü' in cp850" in told


def test_fix_in_place_ends_with_0_where_nothing_is_left(tmp_path: Path) -> None:
    path = write(tmp_path / NAME, GOOD.replace("\n", "\r"))
    assert run("fix", path, "-o", path).exit_code == 0
    assert path.read_bytes() == GOOD.encode()


def test_a_dry_run_shows_lines_and_writes_nothing(odd: Path) -> None:
    result = run("fix", odd, "--dry-run")
    assert "-NrOfRXPDO=7\n+NrOfRXPDO=4\n" in result.stdout
    assert odd.read_bytes() == DEFECT.encode()


def test_files_of_one_device_do_not_differ(good: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.eds"
    other.write_bytes(GOOD.replace("0x00000191", "401").replace("\n", "\r\n").encode("utf-16"))
    assert (run("diff", good, other).stdout, run("diff", good, other).exit_code) == ("", 0)


def test_differences_are_lines(good: Path, odd: Path, tmp_path: Path) -> None:
    result = run("diff", good, odd)
    assert (result.exit_code, result.stdout.splitlines()) == (
        1,
        ["~ DeviceInfo NrOfRXPDO: 0x4 -> 0x7", "~ 2006h:00 default: 0x10 -> 0x09"],
    )
    said = json.loads(run("diff", good, odd, "--json").stdout.splitlines()[1])
    assert said == {"v": 1, "place": "2006h:00", "what": "default", "old": "0x10", "new": "0x09"}
    xdd = write(tmp_path / "lamp.xdd", XDD)
    lines = run("diff", good, xdd).stdout.splitlines()
    assert {"- 1001h Error register", "+ 2004h Lost type"} - {*lines} == {"+ 2004h Lost type"}
    assert "~ 2002h kind: VAR -> ARRAY" in lines
    assert "+ 2002h:01 First" in lines


def test_a_device_is_shown_with_its_pdos(good: Path) -> None:
    lines = run("show", good, "--node", "5").stdout.splitlines()
    assert lines[:3] == [
        "vendor        tickrig",
        "product       reference slave R1",
        "vendor-ID     0x0000AB01",
    ]
    assert (
        "2006h  00   UNSIGNED8       rw      0x10                16   32    u8 limits 10h..20h"
        in lines
    )
    at = lines.index("PDOs of node 5")
    assert lines[at : at + 4] == [
        "PDOs of node 5",
        "RPDO1   205  type 255",
        "        0..7    6200h:01 DO 8-bit.1",
        "        8..15   6200h:02 DO 8-bit.2",
    ]
    assert lines[-1] == "TPDO4   485  type 255, not valid"


def test_one_object_is_shown_alone(good: Path) -> None:
    result = run("show", good, "1018:04", "--json")
    said = json.loads(result.stdout)
    assert list(said) == ["v", "file", "entries"]
    assert [(row["index"], row["sub"], row["default"]) for row in said["entries"]] == [
        ("1018h", "04", "0x00005678")
    ]
    assert len(run("show", good, "0x1018").stdout.splitlines()) == 6


def test_the_shell_completes_the_verbs() -> None:
    shell = BashComplete(main, {}, "canmon", "")
    assert [item.value for item in shell.get_completions(["eds"], "")] == [
        *("check", "fix", "diff", "show"),
    ]


@pytest.mark.parametrize("verb", ["check", "fix", "diff", "show"])
def test_help_has_examples(verb: str) -> None:
    assert f"canmon eds {verb} " in run(verb, "--help").stdout


@pytest.mark.parametrize("verb", ["check", "show"])
def test_a_binary_file_is_told_in_one_line(tmp_path: Path, verb: str) -> None:
    path = tmp_path / "image.eds"
    path.write_bytes(bytes(range(256)) * 20)
    result = run(verb, path)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"Error: FILE {path}: a binary file: no EDS\n"


def test_a_report_does_not_go_into_what_is_checked(good: Path) -> None:
    before = good.read_bytes()
    result = run("check", good, "--junit", good)
    assert result.exit_code == 2
    assert f"--junit {good}: the run reads this file, it would be overwritten" in result.stderr
    assert good.read_bytes() == before


def test_what_is_left_is_told_with_the_lines_of_where_it_is_written(tmp_path: Path) -> None:
    file, out = tmp_path / "drive.eds", tmp_path / "out.eds"
    file.write_text(DEFECT.replace("NrOfRXPDO=7\n", "NrOfRXPDO=4\nNrOfRXPDO=4\n"))
    line = DEFECT[: DEFECT.index("[2006]")].count("\n") + 1
    written = run("fix", file, "-o", out).stdout.splitlines()
    shown = run("fix", file, "--dry-run").stdout.splitlines()
    (left,) = [one for one in written if OUT_OF_LIMITS in one]
    at = int(left.removeprefix(f"{out}:").partition(":")[0])
    assert out.read_text().splitlines()[at - 1] == "DefaultValue=9"
    assert at > line
    assert left.replace(f"{out}:{at}", f"{file}:{at + 1}") == shown[-1]
    assert (
        f"{file}:30: fixed: [doubled-key] [DeviceInfo] NrOfRXPDO is there twice: 4" in (written[0])
    )
