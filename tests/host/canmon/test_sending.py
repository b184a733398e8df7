from __future__ import annotations

import gzip
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.terminal import PROGRAM
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.cli import main

EDS = str(Path(__file__).parents[3] / "examples/eds/epos.eds")
LOG = """\
(1600000000.000000) can0 080#
(1600000000.001000) can1 705#05
(1600000000.002000) can0 181#0102
(1600000000.003000) can0 20000020#0000000000000000
(1600000000.004000) can0 182#R
"""


@pytest.fixture
def log(tmp_path: Path) -> str:
    path = tmp_path / "run.log"
    path.write_text(LOG)
    return str(path)


def canmon(*words: str, stdin: str = "") -> Result:
    return CliRunner().invoke(main, words, input=stdin)


def test_frames_are_sent_in_their_order_and_printed(wire: Wire) -> None:
    result = canmon("send", wire.word, "123#DEADBEEF", "00000605#40", "705#R")
    assert wire.all() == ["123#DEADBEEF", "00000605#40", "705#R"]
    assert re.sub(r"\(\d+\.\d{6}\)", "T", result.stdout).splitlines() == [
        f"T {wire.name} 123#DEADBEEF",
        f"T {wire.name} 00000605#40",
        f"T {wire.name} 705#R",
    ]


def test_a_pdo_is_sent_by_the_names_of_its_objects(wire: Wire) -> None:
    canmon("send", wire.word, "5.rpdo1", "target=-1", "080#", "--eds", f"5={EDS}", "-q")
    assert wire.all() == ["205#0000FFFFFFFF", "080#"]


@pytest.mark.realtime
def test_words_with_an_equals_sign_are_the_verbs_own(wire: Wire, log: str) -> None:
    kwargs = ("--bus-kwargs", "receive_own_messages=false")
    canmon("send", wire.word, "5.rpdo1", *kwargs, "target=-1", "--eds", f"5={EDS}", "-q")
    canmon("play", log, *kwargs, f"{wire.word}=can1")
    assert wire.all() == ["205#0000FFFFFFFF", "705#05"]
    drawn = canmon("graph", log, "way=181[0]")
    assert "way 1" in drawn.stdout


def test_a_frame_is_sent_again_with_counter_and_checksum(wire: Wire) -> None:
    fields = ("--counter", "0:7..8", "--checksum", "1:sum8")
    result = canmon("send", wire.word, "100#000001", "--every", "1ms", "--count", "3", *fields)
    assert wire.all() == ["100#070801", "100#080901", "100#070801"]
    assert len(result.stdout.splitlines()) == 3


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["123"], "'123' is neither a frame as 123#DEADBEEF nor a PDO as 5.rpdo1"),
        (["123#1"], "'123#1' is not a frame like 705#7F"),
        (["5.rpdo1"], "no description of node 5; give --eds 5=FILE"),
        (["5.rpdo1", "speed=1", "--eds", f"5={EDS}"], "it has controlword, target_velocity"),
        (["080#", "--eds", "5"], "--eds '5' is not NODE=FILE with a node-ID 1..127"),
        (["080#", "--eds", "200=a"], "--eds '200=a' is not NODE=FILE"),
        (["080#", "--eds", "5=nowhere.eds"], "--eds nowhere.eds: No such file or directory"),
        (["080#", "--eds", f"5={__file__}"], ".py: has no objects"),
        (["080#", "--count", "3"], "--count says how often --every sends; give --every TIME"),
        (["080#", "--every", "soon"], "--every 'soon' is not a time"),
        (["080#", "--every", "0s"], "a period of 0 us; 1 us is the least"),
        (["080#", "--counter", "0:0..9"], "no byte 0 for a counter or checksum: 0 bytes are sent"),
        (["080#", "--checksum", "0:md5"], "no checksum 'md5'; known: xor"),
    ],
)
def test_a_mistake_sends_nothing_and_is_told_in_a_line(
    wire: Wire, words: list[str], said: str
) -> None:
    result = canmon("send", wire.word, *words)
    assert (result.exit_code, result.stdout, wire.all()) == (2, "", [])
    assert said in result.stderr
    assert result.stderr.count("\n") == 1


def test_frames_are_not_sent_into_a_log(log: str) -> None:
    result = canmon("send", log, "080#")
    assert result.exit_code == 2
    assert "is no bus; frames are sent on can0 or slcan:/dev/ttyACM0@500k" in result.stderr


class Unplugged(can.BusABC):
    """A bus whose adapter is pulled."""

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise can.CanOperationError("Network is down")

    def recv(self, timeout: float | None = None) -> can.Message | None:
        raise can.CanOperationError("Network is down")


def test_a_bus_that_is_gone_ends_with_status_3(wire: Wire, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("can.interfaces.virtual.VirtualBus.send", Unplugged.send)
    result = canmon("send", wire.word, "080#")
    assert result.exit_code == 3
    assert result.stderr == f"Error: cannot send on {wire.name}: Network is down\n"


def test_a_log_is_played_onto_a_bus(wire: Wire, log: str) -> None:
    result = canmon("play", log, wire.word, "--speed", "max")
    assert wire.all() == ["080#", "705#05", "181#0102", "182#R"]
    assert re.fullmatch(r"4 frames in \d+\.\d{3} s; 1 left out\n", result.stderr)


@pytest.mark.realtime
def test_what_was_recorded_on_one_bus_goes_where_it_is_told(wire: Wire, log: str) -> None:
    result = canmon("play", log, f"{wire.word}=can0", "--loop", "2", "--from", "2ms")
    assert wire.all() == ["181#0102", "182#R"] * 2
    assert "late p50" in result.stderr


def test_a_replay_begins_at_a_date_and_ends_with_1_where_nothing_is(wire: Wire, log: str) -> None:
    first_s = float(LOG.partition(")")[0].strip("("))
    path = Path(log)
    path.write_text(f"({first_s - 5:.6f}) can0 7FF#\n{LOG}", "ascii")
    early, late = ("--to", f"{first_s - 1:.6f}"), ("--from", "2100-01-01")
    assert canmon("play", log, wire.word, "--speed", "max", *late).exit_code == 1
    assert canmon("play", log, f"{wire.word}=nobus", "--speed", "max").exit_code == 1
    assert wire.all() == []
    assert canmon("play", log, wire.word, "--speed", "max", *early).exit_code == 0
    assert wire.all() == ["7FF#"]


def test_options_that_would_do_nothing_are_refused(wire: Wire, log: str, tmp_path: Path) -> None:
    steps = tmp_path / "steps.txt"
    steps.write_text("+10 123#00\n", "ascii")
    for words, said in (
        (["send", wire.word, "123#", "--eds", f"5={EDS}"], "--eds does nothing here: frames by"),
        (["play", log, wire.word, "--step", "--speed", "2"], "--speed does nothing here: --step"),
        (["seq", wire.word, str(steps), "--dry-run", "-q"], "--quiet does nothing here: --dry-run"),
        (["conform", "--list", "--json"], "--json does nothing here: --list judges nothing"),
    ):
        result = canmon(*words)
        assert (result.exit_code, said in result.stderr) == (2, True), result.stderr
    assert wire.all() == []


def test_frames_are_played_one_by_one(wire: Wire, log: str) -> None:
    result = canmon("play", log, wire.word, "--step", stdin="\n\n")
    assert wire.all() == ["080#", "705#05"]
    assert result.stdout.splitlines() == [
        f"{wire.name} {text}" for text in ("080#", "705#05", "181#0102")
    ]


@pytest.mark.realtime
def test_a_replay_begins_when_a_frame_is_received(wire: Wire, log: str) -> None:
    for word in ("581", "00000581"):
        with wire.calling(f"{word}#"):
            result = canmon("play", log, wire.word, "--speed", "max", "--wait-rx", word)
        assert result.exit_code == 0
        assert wire.all() == ["080#", "705#05", "181#0102", "182#R"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--speed", "0"], "--speed '0' is neither a factor above 0, as 2 or 0.5, nor max"),
        (["--speed", "fast"], "--speed 'fast' is neither"),
        (["--loop", "0"], "--loop '0' is neither 1 or more nor forever"),
        (["--from", "9s", "--to", "3s"], "from 9000000 us to 3000000 us there is nothing"),
        (["--to", "x"], "'x' is not a time"),
        (["--wait-rx", "5"], "--wait-rx '5' is no CAN-ID of 3 or 8 hex digits"),
        (["--wait-rx", "FFF"], "--wait-rx CAN-ID 0xFFF is not 11-bit"),
        (["can9"], "both take all of it; write can9=RECORDED"),
        (["=can0"], "'=can0' is not BUS=RECORDED, once for each recorded bus"),
    ],
)
def test_a_replay_that_cannot_be_is_refused(
    wire: Wire, log: str, words: list[str], said: str
) -> None:
    result = canmon("play", log, wire.word, *words)
    assert (result.exit_code, wire.all()) == (2, [])
    assert said in result.stderr


def test_what_is_no_frame_in_a_log_is_told(wire: Wire, tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text("(1.000000) can0 080#\n???\n")
    result = canmon("play", str(path), wire.word)
    assert (result.exit_code, wire.all()) == (0, ["080#"])
    assert f"{path}: line 2 is no frame: '???'" in result.stderr


def test_a_log_that_ends_in_the_middle_ends_with_status_3(wire: Wire, tmp_path: Path) -> None:
    path = tmp_path / "run.log.gz"
    path.write_bytes(gzip.compress(LOG.encode())[:-20])
    result = canmon("play", str(path), wire.word)
    assert (result.exit_code, result.stderr.startswith(f"Error: {path}: ")) == (3, True)


def test_a_log_that_is_not_there_ends_with_status_3(wire: Wire) -> None:
    result = canmon("play", "/nowhere/run.log", wire.word)
    assert (result.exit_code, result.stderr) == (
        3,
        "Error: /nowhere/run.log: No such file or directory\n",
    )


START = """
[vars]
id = 3

[[step]]
send = ["000#01{id}", "{id}.rpdo1 target={2*4}"]

[[step]]
expect = ["{0x700+id:3}#05", "node={id} and emcy"]
within = "5s"
"""


@pytest.fixture
def start(tmp_path: Path) -> str:
    path = tmp_path / "start.toml"
    path.write_text(START)
    return str(path)


@pytest.mark.realtime
def test_a_sequence_that_is_answered_ends_well(wire: Wire, start: str) -> None:
    answers = {"000#0105": "705#05", "205#000008000000": "085#1023010000000000"}
    with wire.answering(lambda text: answers.get(text, "")):
        result = canmon("seq", wire.word, start, "--var", "id=5", "--eds", f"5={EDS}")
    assert result.exit_code == 0, result.output
    assert [line.split(" ", 1)[1] for line in result.stdout.splitlines()] == [
        "> 000#0105",
        "> 205#000008000000",
        "ok 705#05 and node=5 and emcy",
        ". 1 met, 0 missed",
    ]


@pytest.mark.realtime
def test_a_sequence_that_is_not_answered_ends_with_status_1(wire: Wire, tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text('[[step]]\nexpect = "705#05"\nwithin = "2ms"\n')
    result = canmon("seq", wire.word, str(path), "-q")
    assert result.exit_code == 1
    assert result.stdout.endswith(f" ? {path}:2: no 705#05 within 2 ms\n")


@pytest.mark.parametrize("within", ["100ms", "1s", "60s"])
def test_a_bus_that_is_gone_ends_a_sequence_with_status_3(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, within: str
) -> None:
    path = tmp_path / "a.toml"
    path.write_text(f'[[step]]\nexpect = "705#05"\nwithin = "{within}"\n')
    monkeypatch.setattr("can.interfaces.virtual.VirtualBus.recv", Unplugged.recv)
    result = canmon("seq", "virtual:alone", str(path))
    last = result.stderr.splitlines()[-1]
    assert (result.exit_code, last.partition("the last ")[0]) == (3, "Error: alone: ")
    assert last.endswith(" reads have failed: Network is down")


def test_a_dry_run_opens_no_bus(start: str) -> None:
    result = canmon("seq", "socketcan:nowhere", start, "--dry-run", "--eds", f"3={EDS}")
    assert result.stdout.splitlines() == [
        "send 000#0103 203#000008000000",
        "expect 703#05 and node=3 and emcy within 5000 ms, else stop",
    ]


@pytest.mark.realtime
def test_lines_are_sent_too(wire: Wire, tmp_path: Path) -> None:
    path = tmp_path / "two.seq"
    path.write_text("loop 2\n+0 000#0105\n+1.5 080#\n")
    assert canmon("seq", wire.word, str(path)).exit_code == 0
    assert wire.all() == ["000#0105", "080#"] * 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--var", "id"], "'id' is not NAME=NUMBER, as id=3"),
        (["--var", "node_number=5"], "does not name it"),
        ([], "start.toml:6: 3.rpdo1: no description of node 3; give --eds 3=FILE"),
    ],
)
def test_a_sequence_that_cannot_be_is_refused(
    wire: Wire, start: str, words: list[str], said: str
) -> None:
    result = canmon("seq", wire.word, start, *words)
    assert (result.exit_code, wire.all()) == (2, [])
    assert said in result.stderr


def test_a_sequence_that_is_no_text_is_refused(wire: Wire, tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(b"\xff\xfe")
    assert canmon("seq", wire.word, str(path)).stderr == f"Error: {path} is no text\n"
    missing = canmon("seq", wire.word, str(tmp_path / "b.toml"))
    assert (missing.exit_code, "No such file or directory" in missing.stderr) == (2, True)


def test_a_condition_that_is_none_is_refused_with_its_line(wire: Wire, tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text('[[step]]\nexpect = "node=="\n')
    result = canmon("seq", wire.word, str(path))
    assert (result.exit_code, result.stderr.startswith(f"Error: {path}:2: filter")) == (2, True)


@contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """`canmon` as a process of its own."""
    program = f"import sys; sys.argv = {['canmon', *words]}; {PROGRAM}"
    with subprocess.Popen(
        [sys.executable, "-u", "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        yield process


def interrupted(process: subprocess.Popen[bytes]) -> tuple[int, str]:
    """Press Ctrl-C; return the exit status and what was said then."""
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=10)
    return process.returncode, said.decode()


@pytest.mark.realtime
def test_ctrl_c_ends_what_is_sent_for_ever() -> None:
    with running("send", "virtual:alone", "080#", "--every", "1ms") as process:
        assert process.stdout is not None
        for _ in range(10):
            assert b" alone 080#" in process.stdout.readline()
        status, said = interrupted(process)
    assert (status, "Traceback" in said) == (0, False)


@pytest.mark.realtime
def test_ctrl_c_cuts_a_sequence_short(tmp_path: Path) -> None:
    path = tmp_path / "a.seq"
    path.write_text("loop forever\n+1 080#\n")
    with running("seq", "virtual:alone", str(path)) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert interrupted(process) == (1, "interrupted before its end\n")


@pytest.mark.realtime
def test_sending_ends_quietly_when_nobody_reads_what_is_printed() -> None:
    with running("send", "virtual:alone", "080#", "--every", "1ms") as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.wait(10) == 0
        assert re.fullmatch(
            rb"(\d+ periods passed whole and were left out\n)?", process.stderr.read()
        )


def test_a_bus_is_named_by_its_channel(wire: Wire, log: str, tmp_path: Path) -> None:
    named = ("-i", "virtual", "-c", wire.name)
    steps = tmp_path / "steps.txt"
    steps.write_text("+0 124#\n")
    assert canmon("send", *named, "123#01", "123#02").exit_code == 0
    assert canmon("seq", *named, str(steps)).exit_code == 0
    assert canmon("play", log, *named, "--speed", "max").exit_code == 0
    assert wire.all() == ["123#01", "123#02", "124#", "080#", "705#05", "181#0102", "182#R"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("send", "can0", "123#"), "-c other names the bus: leave out can0, or -c"),
        (("send",), "Missing argument"),
        (("seq", "can0", "steps.txt"), "-c other names the bus"),
        (("seq",), "Missing argument"),
        (("play", "run.log", "can0"), "-c other names the bus: leave out can0, or -c"),
        (("dump", "virtual:one"), "BUS one and -c other name two channels"),
        (("check", "virtual:one", "--no-emcy"), "BUS one and -c other name two channels"),
        (("nodes", "one", "-i", "virtual"), "BUS one and -c other name two channels"),
        (("net", "-c", "other", "virtual:one", "scan"), "BUS one and -c other name two channels"),
    ],
)
def test_two_names_of_a_bus_are_refused(words: tuple[str, ...], said: str) -> None:
    result = canmon(*words, *(() if "-c" in words else ("-c", "other")))
    assert result.exit_code == 2
    assert said in result.stderr


@pytest.mark.parametrize("name", ["ff15:7079:7468", "tcp://host:3333", "udp:x"])
def test_beside_an_interface_a_bus_may_have_colons(name: str) -> None:
    with can.Bus(interface="virtual", channel=name) as far:
        assert canmon("send", name, "-i", "virtual", "123#01").exit_code == 0
        message = far.recv(1)
        assert message is not None
        assert message.arbitration_id == 0x123
        assert canmon("send", f"virtual:{name}", "-i", "virtual", "124#01").exit_code == 0
        assert far.recv(1) is not None
