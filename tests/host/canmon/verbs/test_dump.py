from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import can
import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.decode.filter import KNOWN_WORDS
from tickrig.host.canmon.model.logs.log_reader import read_log

CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")

LOG = """\
(0000000001.000000) can0 605#4000100000000000
(0000000001.000250) can0 585#4300100091010F00 T
(0000000001.100000) can1 00000605#40
(0000000001.200000) can0 123#R5
(0000000001.300000) can0 20000088#0000010000000000
(0000000001.400000) can0 123##1AABB
not a line
(0000000002.000000) can0 123#
"""


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words)


def test_raw_lines_are_those_of_candump(log: str) -> None:
    result = canmon("dump", log, "--raw", "-t", "z", "-x")
    assert result.stdout.splitlines() == [
        " (000.000000)  can0  RX - -  605   [8]  40 00 10 00 00 00 00 00",
        " (000.000250)  can0  TX - -  585   [8]  43 00 10 00 91 01 0F 00",
        " (000.100000)  can1  RX - -  00000605   [1]  40",
        " (000.200000)  can0  RX - -       123   [5]  remote request",
        " (000.300000)  can0  RX - -  20000088   [8]  00 00 01 00 00 00 00 00   ERRORFRAME",
        " (000.400000)  can0  RX B -       123  [02]  AA BB",
        " (001.000000)  can0  RX - -       123   [0] ",
    ]


def test_error_frames_are_put_into_words_in_raw_lines_too(log: str) -> None:
    lines = canmon("dump", log, "-r", "-e").stdout.splitlines()
    assert lines[4].endswith("ERRORFRAME   error protocol, bus error")
    assert lines[0].endswith("40 00 10 00 00 00 00 00")


@pytest.mark.parametrize(
    ("stamp", "second"),
    [("a", " (0000000001.000250)"), ("d", " (000.000250)"), ("z", " (000.000250)")],
)
def test_stamps_are_those_of_candump(log: str, stamp: str, second: str) -> None:
    lines = canmon("dump", log, "-r", "-t", stamp).stdout.splitlines()
    assert lines[1].startswith(f"{second}  can0  585")


def test_what_a_frame_means_stands_behind_it(log: str) -> None:
    first, second, *_ = canmon("dump", log).stdout.splitlines()
    assert first.endswith("40 00 10 00 00 00 00 00   5 sdo upload of 1000h:00 asked for")
    assert "device_type = 0x000F0191" in second


def test_what_is_no_frame_is_said_on_standard_error(log: str) -> None:
    assert canmon("dump", log).stderr.splitlines() == [
        f"{log}: line 7 is no frame: 'not a line'",
    ]


def test_a_log_comes_out_as_it_went_in(log: str) -> None:
    lines = [line for line in LOG.splitlines(keepends=True) if line[0] == "("]
    assert canmon("dump", log, "-L").stdout == "".join(lines)


def test_json_lines_are_read_again_as_the_same_frames(log: str) -> None:
    said = canmon("dump", log, "--jsonl").stdout
    assert json.loads(said.splitlines()[1]) == {
        "v": 1,
        "t": 1.00025,
        "ch": "can0",
        "id": 0x585,
        "x": 0,
        "dir": "tx",
        "data": "4300100091010F00",
        "kind": "sdo",
        "node": 5,
        "text": "upload 1000h:00 device_type = 0x000F0191 (0.2 ms)",
        "sig": {"device_type": 0xF0191},
    }
    words = [*CANMON, "dump", "-", "-L"]
    again = subprocess.run(words, input=said, capture_output=True, text=True, check=True)
    assert again.stdout == canmon("dump", log, "-L").stdout


def test_json_says_what_the_recorder_lost_and_strict_fails(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.write_text('{"v":1,"ev":"drop","n":12}\n')
    result = canmon("dump", str(path), "--jsonl", "--strict")
    assert (result.exit_code, result.stdout) == (4, '{"v":1,"ev":"drop","n":12}\n')
    assert result.stderr.startswith(f"{path}: its recorder lost 12 frames\n")


def test_rows_of_csv_have_a_header_and_quotes(log: str) -> None:
    rows = canmon("dump", log, "--csv").stdout.splitlines()
    assert rows[0] == "t,ch,id,dir,dlc,data,kind,node,text"
    assert rows[3] == "1.100000,can1,00000605,rx,1,40,raw,,"
    assert rows[5] == ('1.300000,can0,20000088,rx,8,0000010000000000,error,,"protocol, bus error"')


def test_a_filter_passes_what_is_wanted(log: str) -> None:
    assert len(canmon("dump", log, "-F", "node=5 and sdo").stdout.splitlines()) == 2


def test_it_ends_after_so_many_frames(log: str) -> None:
    result = canmon("dump", log, "-n", "2", "-L", "-F", "sdo or id=123")
    assert len(result.stdout.splitlines()) == 2


def test_a_log_file_is_written_and_nothing_is_shown(log: str, tmp_path: Path) -> None:
    blf = tmp_path / "run.blf"
    result = canmon("dump", log, "-l", str(blf))
    assert (result.exit_code, result.stdout) == (0, "")
    assert list(read_log(blf))[:2] == list(read_log(Path(log)))[:2]


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (("-l", "run.xyz"), 2, "a log's name ends in"),
        (("-l", "/nowhere/run.log"), 3, "/nowhere/run.log: No such file"),
        (("-l", "run.log", "-L"), 2, "-l shows nothing"),
        (("-F", "node="), 2, "column"),
        (("--eds", "5"), 2, "is not NODE=FILE"),
    ],
)
def test_mistakes_are_one_line(log: str, words: tuple[str, ...], status: int, said: str) -> None:
    result = canmon("dump", log, *words)
    assert result.exit_code == status
    assert said in result.stderr
    assert "Traceback" not in result.stderr


def test_an_eds_is_told_by_line_section_and_key_and_used_as_far_as_it_is_sound(
    log: str, tmp_path: Path
) -> None:
    eds = tmp_path / "drive.eds"
    sound = "[1000]\nParameterName=Kind\nDataType=7\nAccessType=ro\n"
    eds.write_text(f"{sound}[1001]\nParameterName=b\nAccessType=ro\n")
    result = canmon("dump", log, "--eds", f"5={eds}")
    assert result.stderr.startswith(f"{eds}:5: [1001] DataType is missing: UNSIGNED8 is taken")
    assert "1000h:00 kind" in result.stdout


def test_an_eds_without_objects_is_refused(log: str, tmp_path: Path) -> None:
    eds = tmp_path / "empty.eds"
    for text in ("", "[DeviceInfo]\nVendorName=a\n"):
        eds.write_text(text)
        result = canmon("dump", log, "--eds", f"5={eds}")
        assert result.exit_code == 2
        assert result.stderr == f"Error: --eds {eds}: has no objects (no-objects)\n"


def test_a_file_that_is_read_is_not_overwritten(log: str) -> None:
    result = canmon("dump", log, "-l", log)
    assert (result.exit_code, result.stderr) == (
        2,
        f"Error: {log} is read, so it cannot be written\n",
    )
    assert Path(log).read_text("ascii") == LOG


def test_a_file_cut_short_ends_with_status_3(tmp_path: Path) -> None:
    path = tmp_path / "run.blf"
    path.write_bytes(b"LOGG")
    assert canmon("dump", str(path)).exit_code == 3


@pytest.mark.realtime
def test_a_silent_bus_ends_it() -> None:
    with can.Bus(interface="virtual", channel="silent"):
        result = canmon("dump", "virtual:silent", "-T", "1")
    assert (result.exit_code, result.output) == (0, "")


def test_nobody_reads_any_more_and_it_ends_quietly(tmp_path: Path) -> None:
    path = tmp_path / "long.log"
    path.write_text("(0000000001.000000) can0 705#7F\n" * 20_000)
    words = [*CANMON, "dump", str(path), "-L"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        child.stdout.readline()
        child.stdout.close()
        assert (child.stderr.read(), child.wait()) == (b"", 0)


def test_verbs_on_a_candump_log_do_not_import_what_is_slow(log: str) -> None:
    code = (
        "import sys; from tickrig.host.canmon.cli import main\n"
        "try: main(sys.argv[1:])\nfinally: print(*{'can', 'numpy'} & set(sys.modules))"
    )
    for words in (("dump", log, "-n", "1", "-r"), ("info", log)):
        run = subprocess.run(
            [sys.executable, "-c", code, *words], capture_output=True, text=True, check=True
        )
        assert run.stdout.splitlines()[-1] == ""


def test_a_log_is_left_alone_where_the_source_cannot_be_opened(tmp_path: Path) -> None:
    kept = tmp_path / "kept.log"
    kept.write_text(LOG, "ascii")
    assert canmon("dump", "socketcan:nowhere", "-l", str(kept)).exit_code == 3
    assert kept.read_text("ascii") == LOG


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("bus.yml", "YAML, not an EDS; for a bus.yml use: tickrig check"),
        ("rig.TOML", "TOML, not an EDS; for a rig file use: tickrig check"),
        ("car.dbc", "a DBC file, not an EDS; use: canmon dump LOG --dbc"),
    ],
)
def test_another_file_in_place_of_an_eds_is_named(
    log: str, tmp_path: Path, name: str, kind: str
) -> None:
    file = tmp_path / name
    file.write_text("anything: 1")
    result = canmon("dump", log, "--eds", f"1={file}")
    assert result.exit_code == 2
    assert result.stderr == f"Error: --eds {file}: {kind} {file}\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("name", ["full.log", "full.asc"])
def test_a_full_disk_ends_it_with_status_3(log: str, tmp_path: Path, name: str) -> None:
    full = tmp_path / name
    full.symlink_to("/dev/full")
    result = canmon("dump", log, "-l", str(full))
    assert result.exit_code == 3
    assert result.stderr.endswith(f"Error: {full}: No space left on device\n")


DRIVE = str(GOLDEN / "drive.log")


@pytest.mark.parametrize("verb", [["dump"], ["top"], ["conv", "out.log"]])
def test_a_filter_says_which_of_its_signals_never_came(tmp_path: Path, verb: list[str]) -> None:
    out = [str(tmp_path / name) for name in verb[1:]]
    wanted = "emyc or 5.statusword.fault or 9.statusword > 1"
    assert canmon(verb[0], DRIVE, *out, "-F", wanted).stderr.splitlines() == [
        "the filter asks for '9.statusword': no such signal came",
        "the filter asks for 'emyc': no such signal came; did you mean 'emcy'?",
    ]
    assert canmon(verb[0], DRIVE, *out, "-F", "node=5 and pdo").stderr == ""


@pytest.mark.parametrize("verb", [["dump"], ["top"], ["conv", "out.log"]])
def test_a_filter_says_which_of_its_kinds_never_came(tmp_path: Path, verb: list[str]) -> None:
    out = [str(tmp_path / name) for name in verb[1:]]
    wanted = "kind=qqq or src!=zzz or kind=nmt or (node=5 and kind=pdo1)"
    assert canmon(verb[0], DRIVE, *out, "-F", wanted).stderr.splitlines() == [
        "the filter asks for kind=qqq: no such frame came; there are "
        + ", ".join(KNOWN_WORDS["kind"]),
        "the filter asks for src=zzz: no such frame came; there are eds, seen, dbc",
    ]
