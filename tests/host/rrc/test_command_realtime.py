"""`rrc` on an emulated RRC in real time: however it ends, the chair stops."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pexpect
import pytest

from tests.host.live import LiveRrc, live_rrc, pty
from tickrig.emulators.serial.pty_port import PtyPort

pytestmark = pytest.mark.realtime

PROGRAM = ["-u", "-c", "from tickrig.commands import rrc; rrc()"]
PATIENCE_S = 20
DRIVES = {
    "held key": ("drive", "30", "0"),
    "no key": ("drive", "30", "0", "--no-dead-man", "--for", "60s"),
}

Bench = tuple[LiveRrc, PtyPort]


@pytest.fixture
def bench() -> Iterator[Bench]:
    with pty() as port, live_rrc(port) as live:
        press_power(live)
        yield live, port


def press_power(live: LiveRrc) -> None:
    live.set("power_button", 1)
    live.set("power_button", 0)
    live.await_output("state", "Standby")


def spawned(port: PtyPort, *words: str) -> pexpect.spawn[bytes]:
    return pexpect.spawn(
        sys.executable, [*PROGRAM, port.path, *words], timeout=PATIENCE_S, echo=False
    )


def driving(live: LiveRrc, child: pexpect.spawn[bytes]) -> None:
    """Press SPACE until the chair drives, at most 30 s."""
    for _ in range(3_000):
        child.send(b" ")
        if live.read("out_v_pct") == 30:
            return
    raise AssertionError("it does not drive")


def hang_up(child: pexpect.spawn[bytes]) -> None:
    os.close(child.child_fd)


def press_ctrl_c(child: pexpect.spawn[bytes]) -> None:
    child.sendintr()


def terminate(child: pexpect.spawn[bytes]) -> None:
    child.kill(signal.SIGTERM)


def leave_by_key(child: pexpect.spawn[bytes]) -> None:
    child.send(b"q")


def status_of(child: pexpect.spawn[bytes]) -> int:
    """Wait for the end, reading what it prints."""
    assert child.pid is not None
    _, status = os.waitpid(child.pid, 0)
    child.terminated = True
    return os.waitstatus_to_exitcode(status)


ENDINGS = [(hang_up, 129), (press_ctrl_c, 130), (terminate, 143)]


@pytest.mark.parametrize("run", range(2))
@pytest.mark.parametrize("words", DRIVES.values(), ids=DRIVES)
@pytest.mark.parametrize(("end", "status"), ENDINGS)
def test_a_signal_stops_the_chair_before_the_command_ends(
    end: Callable[[pexpect.spawn[bytes]], None],
    status: int,
    words: tuple[str, ...],
    run: int,
    bench: Bench,
) -> None:
    live, port = bench
    child = spawned(port, *words)
    driving(live, child)
    end(child)
    assert status_of(child) == status
    assert (live.read("out_v_pct"), live.read("state")) == (0, "Output")


@pytest.mark.parametrize("run", range(2))
@pytest.mark.parametrize("words", DRIVES.values(), ids=DRIVES)
def test_the_watchdog_stops_the_chair_of_a_command_that_is_killed(
    words: tuple[str, ...], run: int, bench: Bench
) -> None:
    live, port = bench
    child = spawned(port, *words)
    driving(live, child)
    child.kill(signal.SIGKILL)
    live.await_output("state", "PowerOffByOthers")
    assert live.read("out_v_pct") == 0
    assert status_of(child) == -signal.SIGKILL


def test_the_chair_stops_when_nobody_presses_the_key(bench: Bench) -> None:
    live, port = bench
    child = spawned(port, "drive", "30", "0")
    driving(live, child)
    live.await_output("out_v_pct", 0)
    assert live.read("state") == "Output"
    driving(live, child)
    child.send(b"x")  # any other key lets go
    live.await_output("out_v_pct", 0)
    leave_by_key(child)
    assert status_of(child) == 0


def test_ctrl_c_stops_a_chair_that_the_stick_drives(bench: Bench) -> None:
    live, port = bench
    child = spawned(port, "limit", "50", "50", "--speed", "3")
    live.await_output("state", "Limit")
    live.move_stick(100, 0)
    live.await_output("out_v_pct", 50)
    live.await_output("speed_mode", 3)
    press_ctrl_c(child)
    assert status_of(child) == 130
    assert [live.read(name) for name in ("out_v_pct", "state", "speed_mode")] == [0, "Output", 1]


def ran(port: str, *words: str) -> tuple[int, str, str]:
    program = [sys.executable, *PROGRAM, port, *words]
    done = subprocess.run(
        program, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout, done.stderr


def test_a_stick_that_is_left_drives_on_without_a_watchdog(bench: Bench) -> None:
    live, port = bench
    assert ran(port.path, "limit", "50", "50", "--leave") == (0, "", "")
    live.move_stick(100, 0)
    live.await_output("out_v_pct", 50)
    live.ask("status")
    assert live.read("state") == "Limit"


def test_status_leaves_the_rrc_as_it_was(bench: Bench) -> None:
    live, port = bench
    live.move_stick(20, -10)
    code, out, err = ran(port.path, "status", "--json")
    assert (code, err) == (0, "")
    values = json.loads(out)
    assert values.items() >= {"device": "RRC", "vr2": "on", "stick_v_pct": 20, "gauge": 10}.items()
    assert live.read("state") == "Standby"
    assert "speed_mode       1\n" in ran(port.path, "status")[1]


def test_settings_reach_the_rrc(bench: Bench) -> None:
    live, port = bench
    assert ran(port.path, "speed", "4") == (0, "", "")
    assert live.read("speed_mode") == 4
    assert ran(port.path, "stick", "--low", "50", "50") == (0, "", "")
    assert ran(port.path, "limit", "100", "100", "--leave") == (0, "", "")
    live.move_stick(40, 0)
    assert ran(port.path, "beep", "2550ms") == (0, "", "")
    live.await_output("buzzer", 1)
    assert live.read("out_v_pct") == 0
    assert ran(port.path, "poweroff") == (0, "", "")
    live.await_output("state", "PowerOffByOthers")


def test_watch_prints_what_comes(bench: Bench) -> None:
    live, port = bench
    child = spawned(port, "watch", "--json")
    child.expect(rb'"stick_v_pct": 0')
    live.move_stick(30, 0)
    child.expect(rb'"stick_v_pct": 30')
    live.set("power_button", 1)
    child.expect(rb'"event": "PowerOffWaitByButton"')
    press_ctrl_c(child)
    child.expect(pexpect.EOF)
    assert status_of(child) == 130


def test_watch_ends_where_the_rrc_is_gone(bench: Bench) -> None:
    live, port = bench
    child = spawned(port, "watch")
    child.expect_exact("stick_v_pct 0")
    live.set("rrc_power", 0)
    child.expect_exact(f"Error: {port.path}: no answer: is the RRC still there?")
    child.expect(pexpect.EOF)
    assert status_of(child) == 3


def test_a_chair_that_is_switched_off_ends_the_drive(bench: Bench) -> None:
    live, port = bench
    child = spawned(port, "drive", "30", "0", "--no-dead-man", "--for", "60s")
    live.await_output("out_v_pct", 30)
    live.set("power_button", 1)
    child.expect_exact("Error: VR2 was stopped: EV:PowerOffWaitByButton")
    child.expect(pexpect.EOF)
    assert status_of(child) == 1


def test_a_device_that_is_gone_is_one_line(bench: Bench) -> None:
    live, port = bench
    child = spawned(port, "drive", "30", "0", "--no-dead-man", "--for", "60s")
    live.await_output("out_v_pct", 30)
    live.set("rrc_power", 0)
    child.expect_exact(
        f"Error: {port.path}: no status line for 300 ms: is the RRC still there?;"
        " the watchdog stops VR2 within 500 ms"
    )
    child.expect(pexpect.EOF)
    assert status_of(child) == 3


def test_no_device_and_another_device_are_one_line_each(tmp_path: Path) -> None:
    assert ran(str(tmp_path / "tty"), "status") == (
        3,
        "",
        f"Error: cannot open '{tmp_path}/tty': No such file or directory\n",
    )
    code, out, err = ran("loop://", "drive", "30", "0", "--for", "1s")
    assert (code, out) == (3, "")
    assert err == "Error: loop://: no RRC: b'\\ndevice\\ndevice\\n' came\n"
    with pty() as port:  # nobody reads it
        code, out, err = ran(port.path, "drive", "30", "0", "--for", "1s")
    assert (code, out) == (3, "")
    assert err.endswith(": no answer: is an RRC connected, and has it power?\n")


def test_vr2_that_is_off_is_not_driven() -> None:
    with pty() as port, live_rrc(port) as live:
        for verb in (["drive", "30", "0", "--for", "1s"], ["limit", "50", "50"], ["poweroff"]):
            code, out, err = ran(port.path, *verb)
            assert (code, out) == (1, "")
            assert err == "Error: VR2 is off: press its power button, then call this again\n"
        assert json.loads(ran(port.path, "status", "--json")[1])["vr2"] == "off"
        assert live.read("state") == "WaitPowerOn"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("status --watchdog", "No such option '--watchdog'"),
        ("drive 101 0", "101 is not in the range -100<=x<=100"),
        ("drive 30 0", "nothing holds a dead-man key"),
        ("drive 30 0 --for 1", "write 1s, 1ms or 1us"),
        ("beep 3s", "3s is not 0..2550ms in steps of 10ms"),
        ("beep 1s 1s 1s 1s 1s 1s 1s 1s 1s 1s 1s", "11 times, an RRC takes at most 10"),
        ("stick --low 50 0 --high 50 100", "lower dead zone is not below the upper one"),
        ("limit 50 50 --leave --for 1s", "--leave and --for: give one of them"),
        ("dirve 30 0", "No such command 'dirve'"),
        ("--panel status", "--panel and status: give one of them"),
        ("--watchdog 3s status", "--watchdog 3000ms is not 10ms..2550ms in steps of 10ms"),
        ("--watchdog 1s --no-watchdog status", "--watchdog and --no-watchdog: give one of them"),
        ("test --json none/a.json", "results none/a.json: no directory none"),
        ("", "a verb is missing"),
        ("--pad /dev/null drive 30 0", "/dev/null"),
    ],
)
def test_mistakes_are_said_and_the_port_is_not_opened(words: str, said: str) -> None:
    code, out, err = ran("/nowhere", *words.split())
    assert (code, out) == (2, "")
    assert said in err
    assert "Traceback" not in err


@pytest.mark.parametrize(("end", "status"), [(leave_by_key, 0), *ENDINGS])
def test_the_end_of_the_panel_stops_the_chair(
    end: Callable[[pexpect.spawn[bytes]], None], status: int, bench: Bench
) -> None:
    live, port = bench
    child = spawned(port, "--panel")
    child.expect_exact(" stopped")
    child.send(b"h")
    live.await_output("state", "Output")
    child.send(b"\x1b[A" * 3)
    driving(live, child)
    end(child)
    assert status_of(child) == status
    assert (live.read("out_v_pct"), live.read("state")) == (0, "Output")


IMPATIENT = """
import signal
from tickrig.host.rrc.chair import Chair
enter = Chair.__enter__
def entered(chair):
    enter(chair)
    signal.raise_signal({number})
    return chair
Chair.__enter__ = entered
from tickrig.commands import rrc
rrc()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_before_the_panel_is_shown_ends_it(number: signal.Signals, bench: Bench) -> None:
    live, port = bench
    program = IMPATIENT.format(number=int(number))
    words = ["-u", "-c", program, port.path, "--panel"]
    child: pexpect.spawn[bytes] = pexpect.spawn(
        sys.executable, words, timeout=PATIENCE_S, echo=False
    )
    child.expect(pexpect.EOF)
    assert status_of(child) == 128 + number
    assert live.read("state") == "Standby"


def test_a_device_that_is_gone_ends_the_panel(bench: Bench) -> None:
    live, port = bench
    child = spawned(port, "--panel")
    child.expect_exact(" stopped")
    live.set("rrc_power", 0)
    child.expect_exact(
        f"Error: {port.path}: no status line for 300 ms: is the RRC still there?\r\n"
    )
    child.expect(pexpect.EOF)
    assert status_of(child) == 3


def test_the_test_procedure_ends_where_nobody_answers(bench: Bench, tmp_path: Path) -> None:
    _, port = bench
    code, out, err = ran(port.path, "test", "--json", str(tmp_path / "results.json"))
    assert (code, out) == (1, "")
    assert err.startswith(
        "RRC, Version 1.0, Apr 30 2015 00:00:00\n   Are the wheels off the ground"
    )
    assert err.endswith("Error: not complete: standard input has ended; 0 steps done\n")
    document = json.loads((tmp_path / "results.json").read_text("utf-8"))
    assert (document["complete"], document["steps"]) == (False, [])


def test_the_test_procedure_reports_each_step(bench: Bench, tmp_path: Path) -> None:
    live, port = bench
    child = spawned(port, "test", "--json", str(tmp_path / "results.json"))
    child.sendline(b"perhaps")
    child.expect_exact("type y, n or q: ")
    child.sendline(b"y")
    child.expect_exact(" 1 VR2 starts: ok")
    child.expect_exact("Push the stick forward")
    live.move_stick(100, 0)
    child.expect_exact("Let the stick go")
    live.move_stick(0, 0)
    child.expect_exact(" 2 the stick drives at 50 % at most (limit3232ffffff): ok")
    child.expect_exact("Did both wheels turn forward? [y/n/q]")
    assert live.read("out_v_pct") == 0
    child.sendline(b"n")
    child.expect_exact(" 3 forward at 30 % (output1e00): FAILED: the operator says no")
    press_ctrl_c(child)
    child.expect(pexpect.EOF)
    assert status_of(child) == 130
    document = json.loads((tmp_path / "results.json").read_text("utf-8"))
    assert [each["passed"] for each in document["steps"]] == [True, True, False]
