from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.host.links.serial_link import SerialLink

pytestmark = pytest.mark.realtime

PROGRAM = "from tickrig.emulators.rrc.cli import main; main()"
START_S = 20.0
PATIENCE_US = 5_000_000


class Child:
    """`rrc-emu` with a link and a control socket in a folder."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.link, self.control = folder / "tty", folder / "ctl"
        paths = ["--link", str(self.link), "--control", str(self.control)]
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *paths, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def wait_until_up(self) -> None:
        deadline = time.monotonic() + START_S
        while self.ctl("status").exit_code:
            assert self.process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)

    def ctl(self, *words: str) -> Result:
        return CliRunner().invoke(tickrig, ["ctl", str(self.control), *words])

    def wait_for(self, name: str, value: str) -> None:
        deadline = time.monotonic() + PATIENCE_US / 1e6
        while (shown := self.ctl("get", name).stdout) != f"{name} {value}\n":
            assert time.monotonic() < deadline, shown
            time.sleep(0.01)

    def end(self, number: signal.Signals = signal.SIGTERM) -> tuple[int, str, str]:
        if self.process.poll() is None:
            self.process.send_signal(number)
        out, err = self.process.communicate(timeout=START_S)
        return self.process.returncode, out, err


@contextmanager
def running(folder: Path, *options: str) -> Iterator[Child]:
    child = Child(folder, *options)
    try:
        child.wait_until_up()
        yield child
    finally:
        child.end(signal.SIGKILL)


def read_until(link: SerialLink, end: bytes) -> bytes:
    received, deadline_us = b"", link.now_us + PATIENCE_US
    while not received.endswith(end):
        assert link.now_us < deadline_us, received
        received += link.receive(100_000)
    return received


def test_a_host_talks_to_it_while_somebody_presses_its_buttons(tmp_path: Path) -> None:
    with running(tmp_path, "-v") as child:
        link = SerialLink(str(child.link))
        assert child.ctl("press", "power_button").exit_code == 0
        read_until(link, b"EV:PowerOnSuccess\n")
        link.send(b"output1e00\n")
        assert read_until(link, b"OK:output\n") == b"OK:output\n"
        link.close()
        assert child.ctl("set", "stick", "100", "-20").stdout == ""
        shown = child.ctl("get", "state", "out_v_pct", "stick_w_pct").stdout
        assert shown == "state Output\nout_v_pct 30\nstick_w_pct -20\n"
        lines = child.ctl("lines").stdout
        assert "> output1e00\n" in lines
        assert "< OK:output\n" in lines
        code, out, err = child.end()
    assert code == 0
    first, *events = out.splitlines()
    assert first == str(child.link)
    assert [event.split(" ", 1)[1] for event in events] == [
        *("* state Off", "* state WaitPowerOn", "< EV:Initialized"),
        *("! power_button=1", "< EV:PowerOnTrigger", "! power_button=0"),
        *("* state Standby", "< EV:PowerOnSuccess", "* state Output"),
        *("! stick_v_pct=100", "! stick_w_pct=-20"),
    ]
    assert f"\n  python -m serial.tools.miniterm --eol LF -e {child.link} 115200\n" in err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_cleanly(number: signal.Signals, tmp_path: Path) -> None:
    with running(tmp_path) as child:
        code, _, err = child.end(number)
    assert code == 0
    last = err.splitlines()[-1]
    assert last.startswith("ran ")
    assert "; late ticks: " in last
    assert last.endswith("; bytes lost: 0")
    assert list(tmp_path.iterdir()) == []


def test_one_that_was_killed_leaves_nothing_in_the_way(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    with running(tmp_path, "--trace", str(trace)) as child:
        child.ctl("press", "power_button")
        child.wait_for("state", "Standby")
        child.end(signal.SIGKILL)
    assert child.link.is_symlink()
    assert child.control.exists()
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert result.stdout.startswith("identical: ")
    assert "killed?" in result.stderr
    refused = child.ctl("status")
    assert refused.exit_code == 2
    assert refused.stderr.endswith("Connection refused, is the emulator running?\n")
    with running(tmp_path) as child:
        assert child.end()[0] == 0


def test_a_second_one_at_the_same_place_refuses_to_start(tmp_path: Path) -> None:
    with running(tmp_path) as child:
        code, out, err = Child(tmp_path).end(signal.SIGCONT)
        assert (code, out) == (2, "")
        used = f"another emulator uses it (process {child.process.pid})"
        assert err == f"Error: link {child.link}: {used}\n"
        words = [sys.executable, "-c", PROGRAM, "--control", str(child.control)]
        second = subprocess.run(words, capture_output=True, text=True, check=False)
        assert second.returncode == 2
        assert second.stderr == f"Error: control {child.control}: another process listens there\n"
        assert child.ctl("status").exit_code == 0


def test_it_is_recorded_in_real_time_and_replays_identically(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    with running(tmp_path, "--trace", str(trace), "--fault", "flip=0.01") as child:
        link = SerialLink(str(child.link))
        child.ctl("press", "power_button")
        child.wait_for("state", "Standby")
        for number in range(20):
            link.send(b"output1e%02x\nstatusA1\n" % number)
            link.receive(30_000)
        link.close()
        assert child.end()[0] == 0
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert (result.exit_code, result.stderr) == (0, "")


def test_a_scenario_is_played_beside_a_host(tmp_path: Path) -> None:
    (tmp_path / "s.txt").write_text(
        "0.1 press power_button\n+0s expect EV:PowerOnSuccess within 2s\n"
        "0.5 send device\n+0s expect RRC within 1s\n0.8 end\n"
    )
    process = Child(tmp_path, "--scenario", str(tmp_path / "s.txt")).process
    out, err = process.communicate(timeout=START_S)
    assert process.returncode == 0
    assert " < RRC\n" in out
    assert "expectations met: 2; missed: 0\n" in err


def test_each_mistake_at_the_control_socket_is_one_line(tmp_path: Path) -> None:
    with running(tmp_path) as child:
        for words, error in (
            (
                ("set", "stick", "1"),
                "Error: stick takes 2 values (stick_v_pct, stick_w_pct), got 1",
            ),
            (("set", "stick", "0", "-101"), "Error: stick_w_pct -101 is not in -100..100 %"),
            (("press", "stick"), "Error: no button 'stick'; known: power_button, alarm_button"),
            (
                ("press", "power_button", "--for", "1x"),
                "Error: --for: '1x' is not a time: write",
            ),
            (("fault", "cut", "--for", "1x"), "Error: --for: '1x' is not a time: write"),
            (("fault", "cut@1s", "--for", "2s"), "Error: --for 2s: 'cut@1s' has times of its own"),
            (("fault", "flip=2"), "Error: flip takes a rate above 0 and up to 1"),
            (("clear", "x"), "Error: no fault 'x'; known: flip, drop, dup, cut, delay, "),
            (("get", "x"), 'Error: no input or output "x"; known: state'),
        ):
            result = child.ctl(*words)
            assert (result.exit_code, result.stdout) == (2, "")
            assert result.stderr.startswith(error)
            assert result.stderr.count("\n") == 1
        assert CliRunner().invoke(tickrig, ["ctl", str(child.link), "get"]).exit_code == 2


def test_the_control_commands_answer_people_and_programs(tmp_path: Path) -> None:
    with running(tmp_path) as child:
        described = child.ctl("describe").stdout
        assert (
            "  stick_v_pct          level   -100..100 %  stick, forward is positive\n" in described
        )
        assert json.loads(child.ctl("describe", "--json").stdout)["device"] == "rrc"
        assert json.loads(child.ctl("set", "stick", "-5", "5", "--json").stdout)["ok"]
        for words in (("fault", "flip=0.5"), ("fault", "cut"), ("clear", "cut")):
            assert child.ctl(*words).exit_code == 0
        assert "faults flip\n" in child.ctl("status").stdout
        assert child.ctl("fault", "cut", "--for", "300ms").exit_code == 0
        while "faults flip cut\n" in child.ctl("status").stdout:
            pass  # it ends by itself
        assert "faults flip\n" in child.ctl("status").stdout
        assert child.ctl("stop").exit_code == 0
        assert child.process.wait(timeout=START_S) == 0
