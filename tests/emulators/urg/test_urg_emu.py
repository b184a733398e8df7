from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
import serial
from click.testing import CliRunner, Result

from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import UrgParameters
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.urg.cli import main as urg_emu
from tickrig.emulators.urg.device_type import build_urg

SCENARIO = """
0 send SCIP2.0
0 send VV
1ms expect SERI:H0000001;6 within 10ms
10ms set pose 0.5 0 0.25
20ms send MD0384038401002;a
21ms expect 99b within 210ms
260ms set post 1.5 0.25 0.25
400ms send QT
401ms expect QT within 10ms
410ms raw ff 0d
500ms end
"""
WORLD = ("--room", "4,3", "--post", "1,1,0.2", "--wall", "-1,-1,-1,1")


def emu(*words: str | Path, text: str | None = None) -> Result:
    return CliRunner().invoke(urg_emu, [str(word) for word in words], input=text)


def test_a_scenario_is_played_in_virtual_time() -> None:
    words = ("--serial", "H0000001", *WORLD, "--scenario", "-")
    result = emu(*words, text=SCENARIO)
    assert (result.exit_code, result.stderr) == (
        0,
        "ran 0.500 s; bytes lost: 0\nexpectations met: 3; missed: 0\n",
    )
    assert "< 0E" in result.stdout
    assert emu(*words, text=SCENARIO).stdout == result.stdout


def test_whole_scans_at_once_find_room_on_the_line() -> None:
    text = "0 send SCIP2.0\n0 send BM\n1ms send GD0000076800\n2ms send MD0000076800001\n300ms end"
    assert emu("--scenario", "-", text=text).stderr == "ran 0.300 s; bytes lost: 0\n"


def test_a_recorded_scenario_replays_identically(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    words = (*WORLD, "--noise", "1", "--seed", "7", "--fault", "flip=0.001")
    emu("--scenario", "-", "--trace", trace, *words, text=SCENARIO)
    assert "! heading_rad=0.25" in trace.read_text()
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.fullmatch(r"identical: \d+ ticks\n", result.stdout)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--room", "4"), "--room: a room is WIDTH,DEPTH in m, got '4'"),
        (("--room", "0,1"), "--room: a room has a width and a depth above 0, got 0.0, 1.0"),
        (("--wall", "1,2,3,x"), "--wall: a wall is X1,Y1,X2,Y2 in m, got '1,2,3,x'"),
        (("--post", "1,2,-3"), "--post: a post has a place and a radius of 0 or more, got"),
        (("--serial", "a b"), "--serial: serial 'a b' is not letters and digits"),
    ],
)
def test_an_impossible_world_is_one_line(words: tuple[str, ...], told: str) -> None:
    result = emu(*words)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {told}")
    assert result.stderr.count("\n") == 1


def test_it_starts_in_the_protocol_that_is_asked_for() -> None:
    text = "0 send VV\n10ms end"
    assert " < E\n" in emu("--scenario", "-", text=text).stdout
    assert " < 00P\n" in emu("--scip", "2.0", "--scenario", "-", text=text).stdout


def test_a_trace_of_before_starts_in_scip_2() -> None:
    assert build_urg({"serial": "H1"}).parameters.scip == "2.0"
    assert build_urg({"scip": "1.1"}).parameters.scip == "1.1"


@pytest.mark.parametrize(
    ("config", "told"),
    [
        ('{"colour": 1}', "a sensor has no setting 'colour'; known: serial, "),
        ('{"noise": "loud"}', "noise 'loud' and noise_seed 0 are not two numbers"),
        ('{"walls": "1,2"}', "a wall is X1,Y1,X2,Y2 in m, got '1,2'"),
    ],
)
def test_a_trace_of_another_sensor_is_refused(config: str, told: str, tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    trace.write_text(f"# tickrig-trace v1 urg {config}\n0.000000 . end\n")
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert result.exit_code == 2
    assert told in result.stderr


def ask(port: serial.SerialBase, command: bytes) -> bytes:
    """Send a command of SCIP 2.0; return the status of its reply, empty if none comes."""
    port.write(command + b"\n")
    lines = port.read_until(b"\n\n").split(b"\n")
    return lines[1] if lines[0] == command else b""


def rs232() -> Bench:
    return Bench(Urg(UrgParameters(scip="2.0", rs232_baud=19_200)))


def test_a_host_follows_the_bit_rate_that_it_has_set() -> None:
    with rs232() as bench:
        port = bench.serial(timeout=0.1)
        assert port.baudrate == 19_200
        assert ask(port, b"SS115200") == b"00P"
        assert ask(port, b"BM") == b""  # the host is at 19200 bit/s still
        port.baudrate = 115_200
        port.write(b"\n")  # ends what was garbled
        assert port.read_until(b"\n\n")
        assert ask(port, b"SS115200") == b"03S"


@pytest.mark.parametrize("way", ["RS", "power"])
def test_reset_and_power_lead_back_to_the_first_bit_rate(way: str) -> None:
    with rs232() as bench:
        port = bench.serial(timeout=0.1)
        assert ask(port, b"SS115200") == b"00P"
        port.baudrate = 115_200
        if way == "RS":
            assert ask(port, b"RS") == b"00P"
        else:
            bench.fault("power_cut")
            bench.run_for("5ms")
            bench.clear("power_cut")
            bench.run_for("5ms")
        port.baudrate = 19_200
        assert ask(port, b"SS019200") == b"03S"


def test_on_usb_a_host_of_any_bit_rate_is_understood() -> None:
    result = emu("--scip", "2.0", "--scenario", "-", text="0 send SS115200\n5ms send VV\n99ms end")
    assert "SERI:H0614967" in result.stdout


def test_a_trace_has_the_bit_rate_and_replays_the_change(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    text = "0 send SS115200\n20ms send II\n99ms end"
    result = emu(
        *("--scip", "2.0", "--baud", "19200", "--trace", trace, "--scenario", "-"), text=text
    )
    assert "115200[bps]" in result.stdout
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert (result.exit_code, result.stderr) == (0, "")


@contextmanager
def running(tmp_path: Path) -> Iterator[list[str]]:
    """Run a sensor on RS-232C; yield where it is: a pty, and a port that speaks RFC 2217."""
    program = "from tickrig.emulators.urg.cli import main; main()"
    words = ["--scip", "2.0", "--baud", "19200", "--serve", "rfc2217://0"]
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words, "--link", str(tmp_path / "tty")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    places = [process.stdout.readline().strip() for _ in range(2)]
    try:
        yield places
    finally:
        process.terminate()
        _, told = process.communicate(timeout=20)
        places.append(told)


@pytest.mark.realtime
@pytest.mark.filterwarnings("ignore:set:DeprecationWarning")  # of pyserial's own thread
def test_over_rfc2217_a_host_that_does_not_follow_is_not_understood(tmp_path: Path) -> None:
    with (
        running(tmp_path) as places,
        closing(serial.serial_for_url(places[1], 19_200, timeout=20)) as port,
    ):
        assert ask(port, b"SS115200") == b"00P"
        port.timeout = 0.3
        assert ask(port, b"VV") == b""
        port.timeout, port.baudrate = 20, 115_200
        port.reset_input_buffer()
        port.write(b"\n")  # ends what was garbled
        assert port.read_until(b"\n\n")
        assert ask(port, b"SS115200") == b"03S"


@pytest.mark.realtime
def test_on_a_pty_a_host_that_does_not_follow_is_told_of(tmp_path: Path) -> None:
    with running(tmp_path) as places, serial.Serial(places[0], 19_200, timeout=20) as port:
        assert ask(port, b"SS115200") == b"00P"
        assert ask(port, b"SS115200") == b"03S"  # a pty passes bytes, not bits
    told = "The host has set its port to 19200 8N1, the device has 115200 8N1: on a real line"
    assert places[-1].count(told) == 1
