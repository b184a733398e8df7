"""`canmon tui` in a terminal, fed over the loopback, by a pipe, or by an adapter on a pty."""

from __future__ import annotations

import os
import pty
import signal
import termios
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest

from tests.host.canmon.terminal import Terminal
from tests.interop.buses import GROUP, PORT

pytestmark = pytest.mark.realtime

BUS = (f"udp:{GROUP}", "--bus-kwargs", f"port={PORT}")
BURST = 10_000
ALTERNATE, NORMAL = "\x1b[?1049h", "\x1b[?1049l"
F2 = "\x1bOQ"


@pytest.fixture
def bus() -> Iterator[can.BusABC]:
    with can.Bus(interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0) as bus:
        yield bus


def tell(bus: can.BusABC, data: int) -> None:
    bus.send(can.Message(arbitration_id=0x181, data=[data], is_extended_id=False))


def by_key(terminal: Terminal) -> None:
    terminal.child.send("q")


def by_interrupt(terminal: Terminal) -> None:
    terminal.child.send("\x03")


def by_signal(terminal: Terminal) -> None:
    terminal.child.kill(signal.SIGTERM)


@pytest.mark.parametrize("leave", [by_key, by_interrupt, by_signal])
def test_it_shows_frames_and_leaves_the_terminal_as_it_was(
    bus: can.BusABC, leave: Callable[[Terminal], None]
) -> None:
    terminal = Terminal("tui", *BUS)
    terminal.wait_for("LISTEN-ONLY")
    descriptor = terminal.child.child_fd
    assert not termios.tcgetattr(descriptor)[3] & termios.ICANON
    tell(bus, 0xA5)
    terminal.wait_for("[1] A5")
    leave(terminal)
    terminal.child.expect_exact(NORMAL)
    assert terminal.end() == 0
    assert ALTERNATE in terminal.written
    assert "Traceback" not in terminal.written + str(terminal.child.before)


def test_it_goes_along_with_the_size_of_its_window(bus: can.BusABC) -> None:
    terminal = Terminal("tui", *BUS, columns=60)
    terminal.wait_for("LISTEN-ONLY")
    terminal.child.send("3")
    terminal.wait_for("0 identifiers")
    assert "jitter" not in terminal.text()
    terminal.resize(160, 40)
    terminal.wait_for("jitter")
    by_key(terminal)
    assert terminal.end() == 0


def test_a_burst_is_counted_to_the_frame(tmp_path: Path) -> None:
    log = tmp_path / "burst"
    lines = (f"(1.{n:06d}) can0 {0x181 + n % 50:03X}#{n:08X}\n" for n in range(BURST))
    log.write_text("".join(lines), "ascii")
    terminal = Terminal("tui", "-", feed=log)
    terminal.wait_for(f"{BURST} frames")
    terminal.wait_for("lost 0")
    terminal.child.send("3")
    terminal.wait_for(f"can0: {BURST} frames")
    by_key(terminal)
    assert terminal.end() == 0


def test_a_bus_that_is_unplugged_is_told_and_ends_it_with_status_3() -> None:
    master, slave = pty.openpty()
    tty.setraw(slave)
    name = os.ttyname(slave)
    terminal = Terminal("tui", f"slcan:{name}@500k", "--bus-kwargs", "sleep_after_open=0")
    try:
        terminal.wait_for("LISTEN-ONLY")
        os.write(master, b"t18111A\r")
        terminal.wait_for("[1] 1A")
    finally:
        os.close(slave)
        os.close(master)
    terminal.wait_for("the last ")  # reads have failed
    assert "[1] 1A" in terminal.text()
    by_key(terminal)
    assert terminal.end() == 3
    assert "Traceback" not in terminal.written


def test_settings_are_kept_and_recalled(bus: can.BusABC, tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    terminal = Terminal("tui", *BUS, "-w", str(path))
    terminal.wait_for("LISTEN-ONLY")
    terminal.child.send("ob")
    terminal.wait_for("frames CAN-ID")
    by_key(terminal)
    assert terminal.end() == 0
    assert "overwrite = true" in path.read_text("utf-8")
    terminal = Terminal("tui", "-w", str(path))
    terminal.wait_for("LISTEN-ONLY")
    tell(bus, 0x81)
    terminal.wait_for("181       [1] 10000001")
    by_key(terminal)
    assert terminal.end() == 0


F8 = "\x1b[19~"


def test_a_recording_is_ended_when_somebody_leaves(bus: can.BusABC, tmp_path: Path) -> None:
    terminal = Terminal("tui", *BUS)
    terminal.wait_for("LISTEN-ONLY")
    terminal.child.send(F8)
    terminal.wait_for("record into")
    terminal.child.send("\x15")  # all that stands in the field goes
    terminal.child.send(f"{tmp_path}/run.log\r")
    terminal.wait_for("REC")
    tell(bus, 0xA5)
    terminal.wait_for("1 frame ")
    by_key(terminal)
    assert terminal.end() == 0
    assert "1 frame in 1 file; " in terminal.written
    (part,) = tmp_path.glob("run-*.log")
    assert part.read_text("ascii").endswith(" 181#A5\n")
    assert '"ev":"end"' in (tmp_path / "run.index.jsonl").read_text("ascii")


def test_enter_triggers_a_recording_of_dump(bus: can.BusABC, tmp_path: Path) -> None:
    index = tmp_path / "run.index.jsonl"
    terminal = Terminal("dump", *BUS, "-l", str(tmp_path / "run.log"), "--pre", "5", "-n", "2")
    terminal.wait_until(index.exists)
    tell(bus, 0xA5)

    def triggered() -> bool:
        terminal.child.send("\r")
        return '"ev":"trigger"' in index.read_text("ascii")

    terminal.wait_until(triggered)
    tell(bus, 0xA6)
    assert terminal.end() == 0
    (part,) = tmp_path.glob("run-*.log")
    frames = [text.split()[-1] for text in part.read_text("ascii").splitlines()]
    assert [text for text in frames if text.startswith("181")] == ["181#A5", "181#A6"]
    assert "# trigger: key" in part.read_text("ascii").splitlines()


def test_settings_change_a_bus_for_a_log_and_the_workspace_keeps_it(
    bus: can.BusABC, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    log, kept = tmp_path / "run.log", tmp_path / "bench.toml"
    log.write_text("(1.000000) can0 705#00\n(2.000000) can0 705#05\n", "ascii")
    terminal = Terminal("tui", *BUS, "-w", str(kept), columns=100)
    terminal.wait_for("LISTEN-ONLY")
    tell(bus, 0xA5)
    terminal.wait_for("[1] A5")
    terminal.child.send(F2)
    terminal.wait_for("EDS of nodes")
    for name, then in (("no.log", "No such file"), ("run.log", "end of the log")):
        terminal.child.send("\x15")  # Ctrl-U empties the field
        terminal.wait_for("as can0, slcan")
        terminal.child.send(name)
        terminal.wait_for(name)
        terminal.child.send("\r")
        terminal.wait_for(then)
    terminal.wait_for("operational")
    by_key(terminal)
    assert terminal.end() == 0
    assert 'source = ["run.log"]' in kept.read_text("utf-8")


def test_settings_that_ask_for_a_source_are_left_without_one() -> None:
    terminal = Terminal("tui")
    terminal.wait_for("bus or file")
    terminal.child.send("\x11")  # Ctrl-Q
    assert terminal.end() == 0
