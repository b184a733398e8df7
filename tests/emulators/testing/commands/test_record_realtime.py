"""`tickrig record` between a host and an emulated RRC in real time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.live import LiveRrc, live_rrc, pty, served
from tickrig.device.rrc.settings import RrcConfig
from tickrig.emulators.commands.cli import main
from tickrig.emulators.record.replay import read_bench_recording
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.text.trace import Mark

pytestmark = pytest.mark.realtime

PROGRAM = "from tickrig.emulators.commands.cli import main; main()"
PATIENCE_S = 20.0


class Recorder:
    """`tickrig record` as a process."""

    def __init__(self, port: str, out: Path, link: Path) -> None:
        self.out, self.link = out, link
        self._ended: tuple[int, str] | None = None
        words = ["record", port, *self.options(str(out), str(link))]
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout
        assert self.process.stdout.readline() == f"{link}\n"

    @staticmethod
    def options(out: str, link: str) -> list[str]:
        """Return the options of the command."""
        return ["--out", out, "--type", "rrc", "--link", link]

    def type(self, line: str) -> None:
        assert self.process.stdin
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def wait_for(self, text: str) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while text not in self.out.read_text():
            assert time.monotonic() < deadline, self.out.read_text()
            time.sleep(0.01)

    def end(self) -> tuple[int, str]:
        """Interrupt it, and return its exit status and what it said."""
        if self._ended is None:
            if self.process.poll() is None:
                self.process.send_signal(signal.SIGINT)
            _, err = self.process.communicate(timeout=PATIENCE_S)
            self._ended = (self.process.returncode, err)
        return self._ended


Start = Callable[..., Recorder]


@pytest.fixture
def record() -> Iterator[Start]:
    """Return what starts recorders; they end with the test."""
    with ExitStack() as stack:

        def start(port: str, out: Path, link: Path) -> Recorder:
            recorder = Recorder(port, out, link)
            stack.callback(recorder.end)
            return recorder

        yield start


@pytest.fixture
def port() -> Iterator[PtyPort]:
    with pty() as port:
        yield port


@pytest.fixture
def rrc(port: PtyPort) -> Iterator[LiveRrc]:
    with live_rrc(port) as rrc:
        rrc.await_output("state", "WaitPowerOn")
        yield rrc


def answer(host: SerialLink, data: bytes, ending: bytes) -> bytes:
    host.send(data)
    got, deadline = b"", time.monotonic() + PATIENCE_S
    while not got.endswith(ending):
        assert time.monotonic() < deadline, got
        got += host.receive(100_000)
    return got


def passed(path: Path, mark: Mark) -> bytes:
    records = read_bench_recording(path.read_bytes()).records
    return b"".join(x.traffic for x in records if x.mark is mark and isinstance(x.traffic, bytes))


def test_a_host_and_its_device_are_recorded(
    port: PtyPort, rrc: LiveRrc, record: Start, tmp_path: Path
) -> None:
    recorder = record(port.path, tmp_path / "run.trace", tmp_path / "tty")
    host = SerialLink(str(recorder.link))
    said = answer(host, b"version\n", b"Version 1.0\n")
    recorder.type("power_button=1")
    recorder.type("stick=5,-5")
    recorder.type("stick=5")
    recorder.type("nonsense")
    recorder.type("power_button=7")
    recorder.type("reset")
    recorder.wait_for("! reset")
    host.close()
    again = SerialLink(str(recorder.link))
    noise = bytes(range(256))
    again.send(noise)
    recorder.wait_for(r"\xff")
    again.close()
    code, err = recorder.end()
    assert code == 0, err
    assert "'nonsense' is not NAME=VALUE, and not reset" in err
    assert "power_button 7 is not in 0..1" in err
    assert "stick takes 2 values: stick_v_pct, stick_w_pct" in err
    assert " bytes to the device, " in err
    assert passed(recorder.out, Mark.TO_DEVICE) == b"version\n" + noise
    assert passed(recorder.out, Mark.FROM_DEVICE).startswith(said)
    recording = read_bench_recording(recorder.out.read_bytes())
    typed = [x.text for x in recording.records if x.mark is Mark.PHYSICAL]
    assert typed == ["power_button=1", "stick_v_pct=5", "stick_w_pct=-5", "reset"]
    assert (recording.ended, recording.at_port) == (True, True)
    assert not recorder.link.exists()


JITTER = ("--tolerance", "200ms")  # a busy machine is no difference


@pytest.mark.parametrize(
    ("config", "code", "found"),
    [
        (RrcConfig(), 0, "\nsame: "),
        (RrcConfig(power_on_ticks=130), 1, "ms earlier\n  recorded < EV:PowerOnSuccess "),
        (RrcConfig(version="Version 1.1"), 1, "differently\n  recorded < Version 1.1 "),
    ],
)
def test_what_was_recorded_of_a_pty_is_compared(
    record: Start, tmp_path: Path, config: RrcConfig, code: int, found: str
) -> None:
    with pty() as port, live_rrc(port, config) as rrc:
        rrc.await_output("state", "WaitPowerOn")
        recorder = record(port.path, tmp_path / "run.trace", tmp_path / "tty")
        host = SerialLink(str(recorder.link))
        answer(host, b"version\n", config.version.encode() + b"\n")
        rrc.set("power_button", 1)
        recorder.type("power_button=1")
        answer(host, b"", b"EV:PowerOnSuccess\n")
        rrc.set("power_button", 0)
        recorder.type("power_button=0")
        answer(host, b"watchdog32\n", b"OK:watchdog\n")
        answer(host, b"output1e00\n", b"OK:output\n")
        answer(host, b"", b"EV:PowerOffWaitByWatchdog\n")
        assert recorder.end()[0] == 0
    result = CliRunner().invoke(main, ["compare", str(recorder.out), *JITTER])
    assert (result.exit_code, found in result.output) == (code, True), result.output


@pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
def test_a_port_over_the_network_is_recorded(record: Start, tmp_path: Path, scheme: str) -> None:
    with served(scheme) as port, live_rrc(port) as rrc:
        rrc.await_output("state", "WaitPowerOn")
        recorder = record(port.url, tmp_path / "run.trace", tmp_path / "tty")
        host = SerialLink(str(recorder.link))
        said = answer(host, b"version\n", b"Version 1.0\n")
        assert recorder.end()[0] == 0
    assert passed(recorder.out, Mark.TO_DEVICE) == b"version\n"
    assert passed(recorder.out, Mark.FROM_DEVICE).endswith(said)


def test_a_port_that_goes_ends_the_recording(record: Start, tmp_path: Path) -> None:
    with pty() as port, live_rrc(port) as rrc:
        rrc.await_output("state", "WaitPowerOn")
        recorder = record(port.path, tmp_path / "run.trace", tmp_path / "tty")
        answer(SerialLink(str(recorder.link)), b"version\n", b"Version 1.0\n")
    assert recorder.process.wait(PATIENCE_S) == 3
    _, err = recorder.end()
    assert "the port is gone: cannot " in err
    assert "Traceback" not in err
    assert read_bench_recording(recorder.out.read_bytes()).ended


def test_a_full_disk_ends_the_recording_alone(
    port: PtyPort, rrc: LiveRrc, record: Start, tmp_path: Path
) -> None:
    recorder = record(port.path, Path("/dev/full"), tmp_path / "tty")
    answer(SerialLink(str(recorder.link)), b"version\n", b"Version 1.0\n")
    code, err = recorder.end()
    assert code == 3
    assert err.count("recording ended: /dev/full: No space left on device; the link goes on") == 1


def test_a_stopped_recorder_loses_nothing_and_says_so(
    port: PtyPort, rrc: LiveRrc, record: Start, tmp_path: Path
) -> None:
    recorder = record(port.path, tmp_path / "run.trace", tmp_path / "tty")
    host = SerialLink(str(recorder.link))
    answer(host, b"version\n", b"Version 1.0\n")
    recorder.process.send_signal(signal.SIGSTOP)
    os.waitid(os.P_PID, recorder.process.pid, os.WSTOPPED)
    host.send(b"date\n")
    assert host.receive(1_000_000) == b""
    recorder.process.send_signal(signal.SIGCONT)
    recorder.wait_for("< OK:date")
    code, err = recorder.end()
    assert code == 0
    assert "stopped for " in err


def test_a_killed_recorder_leaves_what_passed_and_another_takes_its_place(
    port: PtyPort, rrc: LiveRrc, record: Start, tmp_path: Path
) -> None:
    for name in ("first", "second"):
        recorder = record(port.path, tmp_path / name, tmp_path / "tty")
        answer(SerialLink(str(recorder.link)), b"version\n", b"Version 1.0\n")
        recorder.wait_for("Version 1.0")
        recorder.process.kill()
        recorder.process.wait(PATIENCE_S)
        recording = read_bench_recording(recorder.out.read_bytes())
        assert not recording.ended
        assert passed(recorder.out, Mark.TO_DEVICE) == b"version\n"


def test_what_cannot_be_opened_is_said_in_a_line(tmp_path: Path) -> None:
    with pty() as port:
        for words, message in (
            (["/dev/nope"], "cannot open '/dev/nope': No such file or directory"),
            ([port.path, "--out", "/nope/t"], "trace /nope/t: No such file or directory"),
            ([port.path, "--type", "toaster"], "--type: no device 'toaster'; known: rrc"),
            ([port.path, "--link", "/nope/t"], "link /nope/t: No such file or directory"),
        ):
            out = [] if "--out" in words else ["--out", str(tmp_path / "t")]
            result = CliRunner().invoke(main, ["record", *words, *out])
            assert result.exit_code == (3 if "cannot open" in message else 2)
            assert message in result.stderr
            assert len(result.stderr.splitlines()) == 1
